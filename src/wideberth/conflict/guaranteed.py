"""Guaranteed miss distance: a lower bound for every motion within given bounds (the idea of Shewchun and Feron)."""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wideberth.argument_checks import FINITE, NOT_NEGATIVE, POSITIVE, checked
from wideberth.conflict import guaranteed_kernels as kernels
from wideberth.conflict.cylinder import LOOKAHEAD, scalar, vector

FloatArray = NDArray[np.float64]


def guaranteed_miss_distance(
    relative_position: ArrayLike,
    relative_velocity: ArrayLike,
    lookahead: float,
    *,
    position_bound: ArrayLike,
    velocity_bound: ArrayLike = (0.0, 0.0, 0.0),
    relative_acceleration: ArrayLike = (0.0, 0.0, 0.0),
    acceleration_bound: ArrayLike = (0.0, 0.0, 0.0),
    horizontal: bool = False,
    tolerance: float = 1e-2,
) -> float:
    """Return a distance that the aircraft keep until the look-ahead, whatever the error within its bounds.

    Parameters
    ----------
    relative_position, relative_velocity, relative_acceleration : array_like, shape (3,)
        Nominal, local NED; the acceleration stays.
    lookahead : float
        s.
    position_bound, velocity_bound, acceleration_bound : array_like, shape (3,) or (3, m)
        How far each component may be off, or the columns of a zonotope: the error is the columns times numbers between
        -1 and 1, which are other ones for position, velocity and acceleration.
    horizontal : bool
        Judge the horizontal distance alone.
    tolerance : float
        m; the bound is at most so far below the smallest distance that is possible.

    Returns
    -------
    float
        m; 0 where a collision cannot be excluded.

    Raises
    ------
    ValueError
        If an argument is not finite, has another shape, or a bound, the look-ahead or the tolerance makes no
        sense.

    Notes
    -----
    Errata, "Conflict probability (Paielli-Erzberger) and guaranteed miss distance". It holds between times, too.
    """
    motion = np.array(
        [
            vector("relative_position", relative_position),
            vector("relative_velocity", relative_velocity),
            vector("relative_acceleration", relative_acceleration),
        ]
    )
    parts = [
        _columns("position_bound", position_bound),
        _columns("velocity_bound", velocity_bound),
        _columns("acceleration_bound", acceleration_bound),
    ]
    columns = np.zeros((3, 3, sum(part.shape[1] for part in parts)))
    at = 0
    for order, part in enumerate(parts):
        columns[order, :, at : at + part.shape[1]] = part
        at += part.shape[1]
    acceleration = float(np.linalg.norm(motion[2]) + np.linalg.norm(parts[2], axis=0).sum())
    return kernels.guaranteed_distance(
        kernels.POLYNOMIAL,
        motion,
        columns,
        columns.shape[2],
        acceleration,
        scalar("lookahead", lookahead, LOOKAHEAD),
        bool(horizontal),
        scalar("tolerance", tolerance, POSITIVE),
    )


def guaranteed_turning_miss_distance(
    own_position: ArrayLike,
    own_velocity: ArrayLike,
    intruder_state: ArrayLike,
    state_bound: ArrayLike,
    lookahead: float,
    *,
    horizontal: bool = False,
    tolerance: float = 1e-2,
) -> float:
    """Return a distance kept from an intruder that turns, climbs and accelerates, by an ownship that flies straight on.

    Parameters
    ----------
    own_position, own_velocity : array_like, shape (3,)
        Local NED; what is not known of them may be added to the bounds of the intruder's position.
    intruder_state, state_bound : array_like, shape (9,)
        States of the turning model (thesis 3.48; see `curved_path.turning_state`) and how far each may be off. The
        rates stay.
    lookahead, horizontal, tolerance
        As for `guaranteed_miss_distance`; but what the states' errors do beyond first order is bounded and taken off in
        addition, which is much where they turn the path by far.

    Returns
    -------
    float
        m; 0 where a collision cannot be excluded by these means.

    Raises
    ------
    ValueError
        If an argument is not finite, has another shape, or is negative where that makes no sense.
    """
    x = checked("intruder_state", intruder_state, FINITE)
    bound = checked("state_bound", state_bound, NOT_NEGATIVE)
    if x.shape != (9,) or bound.shape != (9,):
        raise ValueError(f"intruder_state and state_bound must have shape (9,), got {x.shape} and {bound.shape}")
    columns = np.zeros((1, 2, 9))
    columns[0, 0] = bound
    columns[0, 1, :3], columns[0, 1, 3:6] = vector("own_position", own_position), vector("own_velocity", own_velocity)
    until = scalar("lookahead", lookahead, LOOKAHEAD)
    most = np.abs(x) + bound
    fastest = most[3] + until * most[6]
    return kernels.guaranteed_distance(
        kernels.TURNING,
        np.array(x).reshape(3, 3),
        columns,
        9,
        math.hypot(most[6], fastest * math.hypot(most[7], most[8])),
        until,
        bool(horizontal),
        scalar("tolerance", tolerance, POSITIVE),
    )


def _columns(name: str, bound: ArrayLike) -> FloatArray:
    array = checked(name, bound, FINITE)
    if array.shape == (3,):
        return np.diag(checked(name, array, NOT_NEGATIVE))
    if array.ndim != 2 or array.shape[0] != 3:
        raise ValueError(f"{name} must have shape (3,) or (3, m), got {array.shape}")
    return np.array(array)
