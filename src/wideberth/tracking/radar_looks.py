"""The last plots of each radar, checked, placed in space, and matched to the aircraft that tracks know of."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wideberth.tracking import registration_kernels as kernels
from wideberth.tracking.registration_kernels import BIASES
from wideberth.types import FloatArray, Scan, Track, TrackStatus

IntArray = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Look:
    """The plots (k) of one scan of a radar; `free` are those not used in a comparison yet."""

    radar: int
    z: FloatArray
    variance: FloatArray
    t: FloatArray
    sensor: FloatArray
    attitude: FloatArray
    free: NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Match:
    """The plots (k) of a look in space, each with the aircraft that it may be of.

    `track` is the number of that aircraft, -1 if there is none; where there is one, `state` (k, 6) and `covariance`
    (k, 6, 6) are its at the plot's time, and `position`, `to_bias` and `noise` are as `registration_kernels.place`
    writes them.
    """

    track: IntArray
    state: FloatArray
    covariance: FloatArray
    position: FloatArray
    to_bias: FloatArray
    noise: FloatArray


def look_of(radar: int, scan: Scan, counters: Counter[str]) -> Look:
    """Return the usable plots of a radar scan; those that cannot be used are counted by cause.

    Parameters
    ----------
    radar : int
        Its number.
    scan : Scan
    counters : Counter
        Added to.

    Returns
    -------
    Look
    """
    z = np.asarray(scan.z, float).reshape(-1, 4)[:, :3]
    variance = np.asarray(scan.R, float).reshape(-1, 4, 4).diagonal(axis1=1, axis2=2)[:, :3]
    t_valid = np.asarray(scan.t_valid, float)
    good = np.ones(len(z), np.bool_)
    flat = np.isnan(z[:, 2])
    for cause, bad in (
        ("plot: time not finite", ~np.isfinite(t_valid)),
        ("plot: range not positive and finite", ~((z[:, 0] > 0.0) & (z[:, 0] < 1e6))),
        ("plot: azimuth not within a turn", ~(np.abs(z[:, 1]) <= 2.0 * math.pi)),
        ("plot: elevation beyond the vertical", ~((np.abs(z[:, 2]) <= 0.5 * math.pi) | flat)),
        (
            "plot: variance not positive and finite",
            ~(_usable(variance[:, :2]).all(1) & (_usable(variance[:, 2]) | flat)),
        ),
    ):
        if bad.any():
            counters[cause] += int(np.count_nonzero(bad & good))
            good &= ~bad
    return Look(
        radar,
        z[good],
        np.where(flat[good, None] & (np.arange(3) == 2), np.nan, variance[good]),
        t_valid[good],
        np.asarray(scan.sensor_position, float),
        np.asarray(scan.sensor_attitude, float),
        np.ones(int(good.sum()), np.bool_),
    )


def _usable(variance: FloatArray) -> NDArray[np.bool_]:
    return (variance > 0.0) & (variance < 1e12)


@dataclass(frozen=True, slots=True)
class Aircraft:
    """Tracks as arrays: time (m,), position and velocity (m, 6), their covariance (m, 6, 6), and the names."""

    t: FloatArray
    x: FloatArray
    p: FloatArray
    ids: tuple[str, ...]


def aircraft_of(tracks: Sequence[Track], counters: Counter[str], *, tentative: bool = False) -> Aircraft:
    """Return tracks as arrays, without tentative ones; what is not finite is left out and counted.

    Parameters
    ----------
    tracks : sequence of Track
    counters : Counter
        Added to.
    tentative : bool
        Take tentative tracks as well.

    Returns
    -------
    Aircraft
    """
    kept: list[Track] = []
    for track in tracks:
        if track.status == TrackStatus.TENTATIVE and not tentative:
            continue
        block = track.covariance[:6, :6]
        values = (track.position, track.velocity, block, track.t)
        if not all(np.isfinite(v).all() for v in values) or not (block.diagonal() >= 0.0).all():
            counters["track not finite"] += 1
            continue
        kept.append(track)
    x = np.array([np.concatenate([track.position, track.velocity]) for track in kept]).reshape(-1, 6)
    p = np.array([track.covariance[:6, :6] for track in kept]).reshape(-1, 6, 6)
    return Aircraft(np.array([track.t for track in kept]), x, p, tuple(track.id for track in kept))


def match(
    look: Look,
    b: FloatArray,
    p: FloatArray,
    aircraft: Aircraft,
    velocity_variance: float,
    height_variance: float,
    gate: float,
) -> Match:
    """Place the free plots of a look by the biases of its radar, each with the aircraft that is nearest.

    Parameters
    ----------
    look : Look
    b, p : ndarray, shape (n,) and (n, n)
        Biases of all radars, and their covariance.
    aircraft : Aircraft
    velocity_variance : float
        Added to each axis of the velocity of the aircraft, m2/s2.
    height_variance : float
        Added to their height for plots without elevation, m2.
    gate : float
        Largest squared Mahalanobis distance.

    Returns
    -------
    Match
    """
    k = len(look.z)
    found = Match(
        np.full(k, -1), np.zeros((k, 6)), np.zeros((k, 6, 6)), np.zeros((k, 3)), np.zeros((k, 3, BIASES)),
        np.zeros((k, 3, 3)),
    )  # fmt: skip
    if len(aircraft.t) and look.free.any():
        kernels.match_plots(
            b, p, look.radar, look.sensor, look.attitude, look.z, look.variance, look.t, look.free,
            aircraft.t, aircraft.x, aircraft.p, velocity_variance, height_variance, gate,
            found.track, found.state, found.covariance, found.position, found.to_bias, found.noise,
        )  # fmt: skip
    return found
