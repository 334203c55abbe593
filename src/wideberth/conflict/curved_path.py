"""Collision detection along waypoints with intruders that turn, climb and accelerate (beyond the thesis: its 6.2.3)."""

import math
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wideberth.argument_checks import FINITE, POSITIVE, POSITIVE_OR_INFINITE, checked, choice
from wideberth.conflict import curved_path_kernels as kernels
from wideberth.conflict.cylinder import LOOKAHEAD, Beyond, CheckedPath, PathConflict, checked_path, scalar, vector
from wideberth.conflict.cylinder_kernels import N_FIRST
from wideberth.tracking import motion_kernels

FloatArray = NDArray[np.float64]
Motion = Literal["constant_velocity", "constant_acceleration", "turning"]

MODELS: dict[str, int] = {
    "constant_velocity": motion_kernels.CONSTANT_VELOCITY,
    "constant_acceleration": motion_kernels.CONSTANT_ACCELERATION,
    "turning": motion_kernels.TURNING,
}


def turning_state(position: ArrayLike, velocity: ArrayLike, acceleration: ArrayLike) -> FloatArray:
    """Return the nine states of the turning model that move as given at this instant.

    Parameters
    ----------
    position, velocity, acceleration : array_like, shape (3,)
        Local NED; of a track, say.

    Returns
    -------
    ndarray, shape (9,)
        Position, speed V, course, flight path angle, and their rates (thesis 3.48). Straight up or down the course is
        0 and does not change; without any speed the direction is that of the acceleration.

    Raises
    ------
    ValueError
        If an argument is not finite or has another shape.
    """
    p, v, a = vector("position", position), vector("velocity", velocity), vector("acceleration", acceleration)
    speed = float(np.linalg.norm(v))
    along = v if speed > 0.0 else a
    level = math.hypot(along[0], along[1])
    course = math.atan2(along[1], along[0]) if level > 0.0 else 0.0
    gamma = math.atan2(-along[2], level) if along.any() else 0.0
    state = np.array([*p, speed, course, gamma, 0.0, 0.0, 0.0])
    if speed == 0.0:
        state[6] = np.linalg.norm(a)
        return state
    cc, sc, cg, sg = math.cos(course), math.sin(course), math.cos(gamma), math.sin(gamma)
    forward, up = cc * a[0] + sc * a[1], -a[2]
    state[6] = cg * forward + sg * up
    state[8] = (cg * up - sg * forward) / speed
    if level > 0.0:
        state[7] = (cc * a[1] - sc * a[0]) / level
    return state


def curved_path_conflict(
    *,
    own_position: ArrayLike,
    own_speed: ArrayLike,
    waypoints: ArrayLike,
    intruder_state: ArrayLike,
    motion: Motion = "turning",
    maneuver_time: float = math.inf,
    lookahead: float,
    tolerance: float = 1e-3,
    safety_radius: float,
    safety_height: float,
    distance_threshold: float = math.inf,
    height_threshold: float = math.inf,
    time_threshold: float = math.inf,
    beyond: Beyond = "along_last_leg",
) -> PathConflict:
    """Predict whether a maneuvering intruder enters the cylinder around an ownship that flies along waypoints.

    Parameters
    ----------
    own_position, own_speed, waypoints, safety_radius, safety_height
        As for `cylinder.path_conflict`, and so are the thresholds and `beyond`.
    intruder_state : array_like, shape (9,), or (6,) for constant velocity
        By the motion model, local NED, SI and radians: position and velocity (and acceleration), or the nine states of
        the turning model (thesis 3.48; `turning_state` makes them of a track).
    motion : {"turning", "constant_acceleration", "constant_velocity"}
        Rates and accelerations stay, also where the speed falls through zero.
    maneuver_time : float
        For so long, s; then the intruder flies straight on.
    lookahead : float
        Nothing is judged later, s.
    tolerance : float
        s: no stay that lasts longer is missed; times are good to a nanosecond then.

    Returns
    -------
    PathConflict
        A curved path may leave and come back on one segment: entry is the first, exit the last time inside.

    Raises
    ------
    ValueError
        As `cylinder.path_conflict`.

    Notes
    -----
    The work is bounded by `lookahead` / `tolerance` looks, and needs so many only along the bound of the cylinder.
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
    choice("motion", motion, tuple(MODELS))
    model = MODELS[motion]
    state = checked("intruder_state", intruder_state, FINITE)
    if state.shape != (motion_kernels.state_count(model),):
        raise ValueError(f"intruder_state must have shape ({motion_kernels.state_count(model)},), got {state.shape}")
    return maneuver_conflict(
        path,
        model,
        np.array(state),
        scalar("maneuver_time", maneuver_time, POSITIVE_OR_INFINITE),
        scalar("lookahead", lookahead, LOOKAHEAD),
        scalar("tolerance", tolerance, POSITIVE),
    )


def maneuver_conflict(
    path: CheckedPath, model: int, state: FloatArray, maneuver_time: float, lookahead: float, tolerance: float
) -> PathConflict:
    """Judge one intruder against a checked path; arguments as the kernel takes them, see `curved_path_conflict`."""
    n = path.waypoints.shape[0]
    penetration, alert = np.empty(n, np.bool_), np.empty(n, np.bool_)
    entry, exit_, first = np.empty(n), np.empty(n), np.empty(N_FIRST)
    kernels.curved_path_intervals(
        path.own_position,
        path.speeds,
        path.waypoints,
        model,
        state,
        maneuver_time,
        lookahead,
        tolerance,
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
    return PathConflict(penetration, alert, entry, exit_, *first.tolist())
