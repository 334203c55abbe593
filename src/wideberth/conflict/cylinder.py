"""Collision detection along the ownship's waypoints (thesis 4.3, algorithms 3, 4 and 5, corrected)."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wideberth.argument_checks import FINITE, NOT_NEGATIVE, POSITIVE, Domain, checked
from wideberth.conflict import cylinder_kernels as kernels

FloatArray = NDArray[np.float64]
Beyond = Literal["along_last_leg", "hover"]

LOOKAHEAD = Domain(0.0, 1e6, "between 0 and 1,000,000 s")
_THRESHOLD = Domain(0.0, math.inf, "not negative (infinite: every entry counts)", infinite=True)


@dataclass(frozen=True, slots=True)
class PathConflict:
    """What an intruder means for each segment of a path; segment i ends at waypoint i.

    Attributes
    ----------
    penetration_flags : ndarray of bool, shape (n,)
        Whether the intruder is inside the cylinder at a time of the segment, its ends included.
    alert_flags : ndarray of bool, shape (n,)
        Whether it also counts: near now, or entered soon.
    entry_time, exit_time : ndarray, shape (n,)
        First and last time inside during the segment, s from now; NaN where it is not penetrated.
    first_entry_time, first_alert_entry_time : float
        The earliest entry on the path, and the earliest one that counts; NaN for none.
    beyond_last_entry_time : float
        First time inside after the last waypoint, where the path says nothing; NaN for none. Part of nothing above.
    """

    penetration_flags: NDArray[np.bool_]
    alert_flags: NDArray[np.bool_]
    entry_time: FloatArray
    exit_time: FloatArray
    first_entry_time: float
    first_alert_entry_time: float
    beyond_last_entry_time: float

    @property
    def collision(self) -> bool:
        """Whether an entry that counts is predicted on any segment (thesis, algorithm 3 line 30)."""
        return bool(self.alert_flags.any())


@dataclass(frozen=True, slots=True)
class CheckedPath:
    """The arguments about ownship, path and cylinder, as the kernels take them; see `checked_path`."""

    own_position: FloatArray
    speeds: FloatArray
    waypoints: FloatArray
    radius: float
    half_height: float
    thresholds: tuple[float, float, float]
    hover: bool


def path_conflict(
    *,
    own_position: ArrayLike,
    own_speed: ArrayLike,
    waypoints: ArrayLike,
    intruder_position: ArrayLike,
    intruder_velocity: ArrayLike,
    safety_radius: float,
    safety_height: float,
    distance_threshold: float = math.inf,
    height_threshold: float = math.inf,
    time_threshold: float = math.inf,
    beyond: Beyond = "along_last_leg",
) -> PathConflict:
    """Predict whether an intruder in straight flight enters the cylinder around an ownship that flies along waypoints.

    Parameters
    ----------
    own_position : array_like, shape (3,)
        Local NED, m.
    own_speed : float or array_like, shape (n,)
        V_g along the path in three dimensions, m/s; one for all segments, or one for each. At 0 the ownship stays at
        the beginning of the segment for ever, and later waypoints are not reached.
    waypoints : array_like, shape (n, 3)
        What is flown to, in order; n >= 1. A repeated waypoint is a segment of no duration.
    intruder_position, intruder_velocity : array_like, shape (3,)
        Local NED, m and m/s.
    safety_radius : float
        R_s, m.
    safety_height : float
        h_s, the full height of the cylinder, m.
    distance_threshold, height_threshold : float
        tau_p, tau_h, m: an intruder that is within both now counts whenever it enters.
    time_threshold : float
        tau_T, s: an entry until then counts.
    beyond : {"along_last_leg", "hover"}
        What the ownship does after the last waypoint.

    Returns
    -------
    PathConflict

    Raises
    ------
    ValueError
        If an argument is not finite, has another shape, or a size, speed or threshold makes no sense.

    Notes
    -----
    The cylinder is closed: touching it counts, as in the thesis (algorithm 3 line 19: entry <= exit).
    """
    path = checked_path(
        own_position=own_position,
        own_speed=own_speed,
        waypoints=waypoints,
        safety_radius=safety_radius,
        safety_height=safety_height,
        distance_threshold=distance_threshold,
        height_threshold=height_threshold,
        time_threshold=time_threshold,
        beyond=beyond,
    )
    p = vector("intruder_position", intruder_position)
    v = vector("intruder_velocity", intruder_velocity)
    return path_conflicts(path, p[None], v[None])[0]


def path_conflicts(path: CheckedPath, positions: FloatArray, velocities: FloatArray) -> list[PathConflict]:
    """Judge k intruders against one path; `positions` and `velocities` are (k, 3), contiguous and finite."""
    k, n = positions.shape[0], path.waypoints.shape[0]
    penetration, alert = np.empty((k, n), np.bool_), np.empty((k, n), np.bool_)
    entry, exit_, first = np.empty((k, n)), np.empty((k, n)), np.empty((k, kernels.N_FIRST))
    kernels.path_intervals_all(
        path.own_position,
        path.speeds,
        path.waypoints,
        positions,
        velocities,
        path.radius,
        path.half_height,
        *path.thresholds,
        path.hover,
        penetration,
        alert,
        entry,
        exit_,
        first,
    )
    return [
        PathConflict(penetration[i], alert[i], entry[i], exit_[i], *times) for i, times in enumerate(first.tolist())
    ]


def checked_path(
    *,
    own_position: ArrayLike,
    own_speed: ArrayLike,
    waypoints: ArrayLike,
    safety_radius: float,
    safety_height: float,
    distance_threshold: float,
    height_threshold: float,
    time_threshold: float,
    beyond: Beyond,
) -> CheckedPath:
    """Check what `path_conflict` is told of ownship, path and cylinder (same arguments and errors)."""
    points = checked("waypoints", waypoints, FINITE)
    if points.ndim != 2 or points.shape[1] != 3 or not points.shape[0]:
        raise ValueError(f"waypoints must have shape (n, 3) with n >= 1, got {points.shape}")
    speeds = checked("own_speed", own_speed, NOT_NEGATIVE)
    if speeds.shape not in ((), (points.shape[0],)):
        raise ValueError(f"own_speed must be one number or one for each waypoint, got shape {speeds.shape}")
    if beyond not in ("along_last_leg", "hover"):
        raise ValueError(f"beyond must be 'along_last_leg' or 'hover', got {beyond!r}")
    return CheckedPath(
        vector("own_position", own_position),
        np.array(np.broadcast_to(speeds, points.shape[:1])),
        np.array(points, order="C"),
        scalar("safety_radius", safety_radius, POSITIVE),
        0.5 * scalar("safety_height", safety_height, POSITIVE),
        (
            scalar("distance_threshold", distance_threshold, _THRESHOLD),
            scalar("height_threshold", height_threshold, _THRESHOLD),
            scalar("time_threshold", time_threshold, _THRESHOLD),
        ),
        beyond == "hover",
    )


def vector(name: str, value: ArrayLike) -> FloatArray:
    """Return a finite vector (3,) as a writable array of its own; a ValueError names it otherwise."""
    array = np.array(checked(name, value, FINITE))
    if array.shape != (3,):
        raise ValueError(f"{name} must have shape (3,), got {array.shape}")
    return array


def scalar(name: str, value: ArrayLike, domain: Domain) -> float:
    """Return one number within its domain; a ValueError names it otherwise."""
    array = checked(name, value, domain)
    if array.ndim:
        raise ValueError(f"{name} must be one number, got shape {array.shape}")
    return float(array)
