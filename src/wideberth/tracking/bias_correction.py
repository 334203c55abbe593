"""The biases of one radar: how large they may be, taking them off a scan, and what their uncertainty does."""

import dataclasses
import math
from dataclasses import dataclass

import numpy as np

from wideberth.tracking import registration_kernels as kernels
from wideberth.tracking.config import RegistrationConfig
from wideberth.tracking.registration_kernels import AZIMUTH, BIASES, CLOCK, ELEVATION, RANGE, SCALE
from wideberth.types import FloatArray, Scan


@dataclass(frozen=True, slots=True)
class BiasEstimate:
    """The biases of one radar, in the order of `wideberth.tracking.registration_kernels`.

    Attributes
    ----------
    sensor : str
    value, sigma : ndarray, shape (10,)
        Estimate and standard deviation; m, 1, rad, m and s.
    prior_sigma : ndarray, shape (10,)
        Standard deviation before anything was known; 0: not estimated.
    comparisons : int
        Plots of this radar that were used since it (last) started.
    """

    sensor: str
    value: FloatArray
    sigma: FloatArray
    prior_sigma: FloatArray
    comparisons: int


def prior_sigma(config: RegistrationConfig) -> FloatArray:
    """Return the standard deviations (10,) of the biases of a radar before anything is known.

    Parameters
    ----------
    config : RegistrationConfig

    Returns
    -------
    ndarray
    """
    c = config
    angles = (c.azimuth_sigma_deg, c.elevation_sigma_deg, c.roll_sigma_deg, c.pitch_sigma_deg)
    place = (c.position_sigma_m, c.position_sigma_m, c.height_sigma_m)
    return np.array([c.range_sigma_m, c.range_scale_sigma, *map(math.radians, angles), *place, c.clock_sigma_s])


def corrected(scan: Scan, b: FloatArray, p: FloatArray, *, inflate: bool) -> Scan:
    """Return a scan of a radar with the biases taken off.

    Parameters
    ----------
    scan : Scan
    b, p : ndarray, shape (10,) and (10, 10)
        Biases and their covariance.
    inflate : bool
        Whether the uncertainty of the biases is added to `R`, which stays diagonal.

    Returns
    -------
    Scan
        Plots nearer than the range offset, whose range would mean nothing, are left out.
    """
    z = np.array(scan.z, float).reshape(-1, 4)
    noise = np.array(scan.R, float).reshape(-1, 4, 4)
    z[:, 0] = (z[:, 0] - b[RANGE]) / (1.0 + b[SCALE])
    near = z[:, 0] <= 0.0
    z, noise, t_valid = z[~near], noise[~near], scan.t_valid[~near]
    with np.errstate(invalid="ignore"):  # what is not finite stays so, and is the tracker's to reject
        z[:, 1] = (z[:, 1] - b[AZIMUTH] + math.pi) % (2.0 * math.pi) - math.pi
    z[:, 2] -= b[ELEVATION]
    pose = np.zeros((4, 3))
    kernels.true_pose(b, scan.sensor_position, scan.sensor_attitude, pose)
    if inflate:
        noise[:, [0, 1, 2], [0, 1, 2]] += _plot_variance(p, z, pose)
    return dataclasses.replace(
        scan,
        t=scan.t - float(b[CLOCK]),
        z=z,
        R=noise,
        t_valid=t_valid - b[CLOCK],
        sensor_position=pose[3].copy(),
        sensor_attitude=pose[:3].copy(),
    )


def _plot_variance(p: FloatArray, z: FloatArray, pose: FloatArray) -> FloatArray:
    """Return the variances (k, 3) that biases put on range, azimuth and elevation; the clock's needs a velocity."""
    out = np.zeros((len(z), 3))
    slopes, plot, states, work = np.zeros((3, BIASES)), np.zeros(3), np.zeros((3, 6)), np.zeros((12, 3))
    x = np.zeros(6)
    for k, (distance, azimuth, elevation) in enumerate(np.nan_to_num(z[:, :3])):
        ground = distance * math.cos(elevation)
        seen = [ground * math.cos(azimuth), ground * math.sin(azimuth), -distance * math.sin(elevation)]
        x[:3] = pose[3] + pose[:3] @ seen
        kernels.biased_plot(np.zeros(BIASES), pose[3], pose[:3], x, 0.0, plot, slopes, states, work)
        out[k] = np.einsum("ij,jk,ik->i", slopes, p, slopes)
    return out


def position_covariance(
    b: FloatArray, p: FloatArray, sensor: FloatArray, attitude: FloatArray, position: FloatArray, velocity: FloatArray
) -> FloatArray:
    """Return the covariance that uncertain biases leave in the position of an aircraft, m2.

    Parameters
    ----------
    b, p : ndarray, shape (10,) and (10, 10)
        Biases and their covariance.
    sensor, attitude : ndarray, shape (3,) and (3, 3)
        Told pose.
    position, velocity : ndarray, shape (3,)
        Of the aircraft, NED, m and m/s.

    Returns
    -------
    ndarray, shape (3, 3)
    """
    slopes, plot, work = np.zeros((3, BIASES)), np.zeros(3), np.zeros((28, BIASES))
    x, nothing, out = np.concatenate([position, velocity]), np.zeros((3, 3)), np.zeros((3, 3))
    kernels.biased_plot(b, sensor, attitude, x, 0.0, plot, slopes, np.zeros((3, 6)), np.zeros((12, 3)))
    kernels.place(b, sensor, attitude, plot, np.zeros(3), velocity, np.zeros(3), slopes, nothing, work)
    kernels.spread(p, 0, 0, slopes, slopes, out)
    return 0.5 * (out + out.T)
