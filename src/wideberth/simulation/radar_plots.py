"""Made radar plots: flights drawn at random, and what a radar with false plots and misses sees of them.

The rules are those of the tracking benchmark: every visible aircraft gives a plot with the probability of detection,
with normal errors in range, azimuth and elevation; besides, each scan has a number of false plots, uniform from 0 to a
largest, that lie evenly over the volume that the radar watches.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth.plots import Plots
from wideberth.sensors.radar.plot_file import PlotTruth
from wideberth.sensors.radar.plot_model import even_directions
from wideberth.tracking.motion_kernels import TURNING, path_velocity, propagate
from wideberth.types import DetectionModel, Scan

FloatArray = NDArray[np.float64]

SIGMA = (0.4, math.radians(1.0), math.radians(1.0))
"""Standard deviations of range (m), azimuth and elevation (rad) of the radar of thesis section 3.3."""


def straight_flights(
    rng: np.random.Generator, n: int, n_scans: int, dt: float = 0.1, extent: float = 1.0
) -> tuple[FloatArray, FloatArray]:
    """Return aircraft that cross the sky over a radar in straight lines.

    Parameters
    ----------
    rng : numpy.random.Generator
    n, n_scans : int
        Aircraft and scans.
    dt : float
        Time between scans, s.
    extent : float
        Factor on the distances of 200 to 550 m at which they begin.

    Returns
    -------
    position, velocity : ndarray, shape (n_scans, n, 3)
        Local NED around the radar, m and m/s.
    """
    return _fly(rng, n, n_scans, dt, extent, legs=0)


def maneuvering_flights(
    rng: np.random.Generator,
    n: int,
    n_scans: int,
    dt: float = 0.1,
    extent: float = 1.0,
    *,
    leg_s: tuple[float, float] = (5.0, 20.0),
    turn_deg_per_s: tuple[float, float] = (3.0, 8.0),
) -> tuple[FloatArray, FloatArray]:
    """Return aircraft that fly straight, turn, climb and change speed, one after the other (turning model (3.48)).

    Parameters
    ----------
    rng : numpy.random.Generator
    n, n_scans : int
        Aircraft and scans.
    dt : float
        Time between scans, s.
    extent : float
        Factor on the distances of 200 to 550 m at which they begin.
    leg_s : tuple of float
        Shortest and longest time that an aircraft goes on as it does.
    turn_deg_per_s : tuple of float
        Slowest and fastest turn of a leg that is nothing but a turn.

    Returns
    -------
    position, velocity : ndarray, shape (n_scans, n, 3)
        Local NED around the radar, m and m/s.
    """
    return _fly(rng, n, n_scans, dt, extent, legs=100, leg_s=leg_s, turn_deg_per_s=turn_deg_per_s)


def _fly(
    rng: np.random.Generator,
    n: int,
    n_scans: int,
    dt: float,
    extent: float,
    *,
    legs: int,
    leg_s: tuple[float, float] = (1.0, 1.0),
    turn_deg_per_s: tuple[float, float] = (0.0, 0.0),
) -> tuple[FloatArray, FloatArray]:
    position, velocity = np.zeros((n_scans, n, 3)), np.zeros((n_scans, n, 3))
    for j in range(n):
        bearing, distance = rng.uniform(-math.pi, math.pi), extent * rng.uniform(200.0, 550.0)
        x = np.zeros(9)
        x[:3] = distance * math.cos(bearing), distance * math.sin(bearing), -extent * rng.uniform(120.0, 280.0)
        x[3] = rng.uniform(10.0, 22.0)
        # Roughly over the radar, so that most stay in its range.
        x[4] = bearing + math.pi + rng.uniform(-0.5, 0.5)
        x[5] = math.radians(rng.uniform(-2.0, 2.0))
        ends = np.cumsum(rng.uniform(*leg_s, size=legs))
        leg = -1
        for k in range(n_scans):
            position[k, j] = x[:3]
            path_velocity(x[3], x[4], x[5], velocity[k, j])
            if legs and leg < np.searchsorted(ends, k * dt, side="right"):
                leg = int(np.searchsorted(ends, k * dt, side="right"))
                x[6:] = _rates(rng, x, turn_deg_per_s)
            propagate(TURNING, dt, x, x)
    return position, velocity


def _rates(rng: np.random.Generator, x: FloatArray, turn_deg_per_s: tuple[float, float]) -> tuple[float, float, float]:
    """Draw the rates of speed, course and path angle of the next leg; back towards level and medium speed."""
    kind = rng.integers(4)
    if kind == 0:
        return 0.0, 0.0, 0.0
    if kind == 1:
        return 0.0, math.radians(rng.uniform(*turn_deg_per_s)) * rng.choice([-1.0, 1.0]), 0.0
    if kind == 2:
        return -0.15 * math.copysign(1.0, x[3] - 15.0), math.radians(rng.uniform(-7.0, 7.0)), 0.0
    return 0.0, math.radians(rng.uniform(-2.0, 2.0)), -math.copysign(math.radians(rng.uniform(0.2, 0.5)), x[5])


def radar_plots(
    rng: np.random.Generator,
    position: FloatArray,
    velocity: FloatArray,
    *,
    dt: float = 0.1,
    sigma: tuple[float, float, float] = SIGMA,
    detection_probability: float = 0.8,
    clutter_max: int = 3,
    range_max: float = 600.0,
    sensor_position: FloatArray | None = None,
    sensor_attitude: FloatArray | None = None,
    field_of_view: tuple[float, float] = (math.pi, math.pi / 2),
    ownship: int = -1,
) -> tuple[Plots, PlotTruth]:
    """Return what a radar sees of some flights.

    Parameters
    ----------
    rng : numpy.random.Generator
    position, velocity : ndarray, shape (n_scans, n, 3)
        Of the aircraft, local NED, m and m/s.
    dt : float
        Time between scans, s.
    sigma : tuple of float
        Standard deviations of range (m), azimuth and elevation (rad).
    detection_probability : float
        Of an aircraft inside range and field of view.
    clutter_max : int
        The number of false plots of a scan is uniform from 0 to this.
    range_max : float
        m.
    sensor_position : ndarray, shape (n_scans, 3), optional
        NED, m; the origin where not given.
    sensor_attitude : ndarray, shape (n_scans, 3, 3), optional
        C_ned_sensor; level and looking north where not given.
    field_of_view : tuple of float
        Half-widths in azimuth and elevation, rad. A radar that sees everything has its false plots above the ground.
    ownship : int
        Which aircraft sends telemetry; -1 none.

    Returns
    -------
    plots : Plots
    truth : PlotTruth
    """
    n_scans, n = position.shape[:2]
    where = np.zeros((n_scans, 3)) if sensor_position is None else sensor_position
    attitude = np.tile(np.eye(3), (n_scans, 1, 1)) if sensor_attitude is None else sensor_attitude
    seen = np.einsum("kji,knj->kni", attitude, position - where[:, None])
    distance = np.linalg.norm(seen, axis=2)
    azimuth, elevation = np.arctan2(seen[..., 1], seen[..., 0]), np.arcsin(-seen[..., 2] / distance)
    visible = (distance <= range_max) & (np.abs(azimuth) <= field_of_view[0]) & (np.abs(elevation) <= field_of_view[1])
    lowest = 0.0 if field_of_view[1] >= math.pi / 2 else -math.sin(field_of_view[1])
    first, rows = np.zeros(n_scans + 1, np.int64), []
    for k in range(n_scans):
        hit = np.flatnonzero(visible[k] & (rng.random(n) < detection_probability))
        true = np.stack([distance[k, hit], azimuth[k, hit], elevation[k, hit]], axis=1)
        true += rng.normal(size=true.shape) * sigma
        false = np.zeros((int(rng.integers(clutter_max + 1)), 3))
        false[:, 0] = range_max * rng.random(len(false)) ** (1.0 / 3.0)
        false[:, 1], false[:, 2] = even_directions(rng, len(false), field_of_view, lowest)
        rows.append(rng.permutation(np.concatenate([true, false])))
        first[k + 1] = first[k] + len(rows[-1])
    z = np.concatenate([*rows, np.zeros((0, 3))])
    telemetry = np.full((n_scans, 6), np.nan)
    if ownship >= 0:
        telemetry = np.concatenate([position[:, ownship], velocity[:, ownship]], axis=1)
    plots = Plots(
        first=first,
        z=np.column_stack([z, np.full(len(z), np.nan)]),
        t=dt * np.arange(n_scans, dtype=np.float64),
        sensor_position=where,
        sensor_attitude=attitude,
        sigma=np.array([*sigma, np.nan]),
        detection_probability=detection_probability,
        range_max=range_max,
        field_of_view=field_of_view,
        dt=dt,
        ownship=telemetry,
    )
    return plots, PlotTruth(position, velocity, visible, ownship)


def radar_scan(plots: Plots, k: int, name: str = "radar") -> Scan:
    """Return scan `k` of plots as the sensor `name` gives it."""
    rows = slice(plots.first[k], plots.first[k + 1])
    z = plots.z[rows]
    return Scan(
        t=float(plots.t[k]),
        t_received=float(plots.t[k]),
        sensor=name,
        kind="radar",
        z=z,
        R=np.where(np.eye(4) > 0.0, plots.variances(rows)[:, np.newaxis], 0.0),
        t_valid=np.full(len(z), plots.t[k]),
        sensor_position=plots.sensor_position[k],
        sensor_attitude=plots.sensor_attitude[k],
        field_of_view=plots.field_of_view,
        detection=DetectionModel(np.array([plots.range_max]), np.array([plots.detection_probability])),
    )
