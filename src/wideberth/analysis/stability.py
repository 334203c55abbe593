"""Stability of two vehicles that avoid each other vertically by tangent velocities (CAS thesis, chapter 5).

Each vehicle's vertical velocity follows its command with a first-order lag; the command makes the relative velocity
tangent to the sphere of radius d around the other (5.5). About trajectories that already pass at d the loop is linear.
The print loses 1/tau on the gain K in (5.23), (5.27), (5.42) and (5.46) (errata, "CAS thesis"); here it is in its place
unless `as_printed` is asked for.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq

from wideberth.argument_checks import FINITE, POSITIVE, FloatArray, checked, choice

LAWS = ("full", "shared", "shared_corrected", "non_cooperative")
"""Both make all of the change; both make half of it, as printed; the same mended; only the first vehicle avoids."""

_LARGEST_ORDER = 20


class TangentGains(NamedTuple):
    """Derivatives of the commanded relative velocity to the first vehicle's state; the second's are the opposite.

    Attributes
    ----------
    position : ndarray, shape (3,)
        I, J and K of (5.10): to x, y and z, 1/s.
    velocity : ndarray, shape (2,)
        L and M: to the velocities along x and y.
    """

    position: FloatArray
    velocity: FloatArray


def tangent_velocity(relative_position: ArrayLike, relative_velocity: ArrayLike, separation: float) -> float:
    """Return the relative vertical velocity with which the first vehicle passes over the second at a distance (5.5).

    Parameters
    ----------
    relative_position, relative_velocity : array_like, shape (3,)
        First minus second vehicle, z down (NED); any unit of length. The vertical velocity is not used.
    separation : float
        d.

    Returns
    -------
    float
        NaN where no vertical velocity is tangent.

    Raises
    ------
    ValueError
        If a value is not finite, `separation` not positive, or a shape wrong.
    """
    numerator, denominator, _, _ = _quotient(relative_position, relative_velocity, separation)
    return numerator / denominator


def tangent_gains(relative_position: ArrayLike, relative_velocity: ArrayLike, separation: float) -> TangentGains:
    """Return the derivatives of `tangent_velocity` (5.11)-(5.13), (5.24).

    Parameters
    ----------
    relative_position, relative_velocity : array_like, shape (3,)
        First minus second vehicle, z down (NED); any unit of length.
    separation : float
        d.

    Returns
    -------
    TangentGains
        K, the third of `position`, is -1/t* on the approach of a pair that passes one above the other.

    Raises
    ------
    ValueError
        If a value is not finite, `separation` not positive, a shape wrong, or no vertical velocity is tangent.
    """
    numerator, denominator, up, down = _quotient(relative_position, relative_velocity, separation)
    gains = (up - numerator / denominator * down) / denominator
    if not np.isfinite(gains).all():
        raise ValueError("no vertical velocity is tangent to the sphere there, or it is at the edge where none is")
    return TangentGains(gains[:3], gains[3:])


def _quotient(
    relative_position: ArrayLike, relative_velocity: ArrayLike, separation: float
) -> tuple[float, float, FloatArray, FloatArray]:
    """Return numerator and denominator of (5.5), and their derivatives to x, y, z, Vx, Vy.

    (5.5) is 0/0 where the horizontal distance is d; while the pair approaches one above the other, the same quotient
    extended by the conjugated numerator is not.
    """
    x, y, z = _vector("relative_position", relative_position)
    vx, vy, _ = _vector("relative_velocity", relative_velocity)
    d = float(checked("separation", separation, POSITIVE))
    beyond = x * x + y * y + z * z - d * d  # Delta^2 of (5.4)
    rest = d * d - x * x - y * y
    closing, speed2 = vx * x + vy * y, vx * vx + vy * vy
    q = rest * speed2 + closing * closing
    if beyond <= 0.0 or q < 0.0 or (rest == 0.0 and z * closing <= 0.0):
        nothing = np.full(5, math.nan)
        return math.nan, 1.0, nothing, nothing
    d_beyond = np.array([2 * x, 2 * y, 2 * z, 0.0, 0.0])
    d_rest = np.array([-2 * x, -2 * y, 0.0, 0.0, 0.0])
    d_closing = np.array([vx, vy, 0.0, x, y])
    d_speed2 = np.array([0.0, 0.0, 0.0, 2 * vx, 2 * vy])
    d_q = d_rest * speed2 + rest * d_speed2 + 2 * closing * d_closing
    root = math.sqrt(beyond * q)
    with np.errstate(divide="ignore", invalid="ignore"):
        d_root = (d_beyond * q + beyond * d_q) / np.float64(2.0 * root)
    d_z_closing = z * d_closing + np.array([0.0, 0.0, closing, 0.0, 0.0])
    if z * closing > 0.0:
        up = d_beyond * speed2 + beyond * d_speed2 - 2 * closing * d_closing
        return beyond * speed2 - closing * closing, root + z * closing, up, d_root + d_z_closing
    return root - z * closing, rest, d_root - d_z_closing, d_rest


def _vector(name: str, value: ArrayLike) -> tuple[float, float, float]:
    vector = checked(name, value, FINITE)
    if vector.shape != (3,):
        raise ValueError(f"{name} must have shape (3,), got {vector.shape}")
    return float(vector[0]), float(vector[1]), float(vector[2])


def vertical_matrix(k: float, tau: float, law: str = "full", *, as_printed: bool = False) -> FloatArray:
    """Return the system matrix of the vertical states z1, V1, z2, V2 (5.23), (5.41), (5.45).

    Parameters
    ----------
    k : float
        K, 1/s.
    tau : float
        Lag of the vertical velocity, s.
    law : {"full", "shared", "shared_corrected", "non_cooperative"}
    as_printed : bool
        Without the 1/tau on K.

    Returns
    -------
    ndarray, shape (4, 4)

    Raises
    ------
    ValueError
        If `k` is not finite, `tau` not positive, or `law` another word.
    """
    return _reduced(full_matrix(TangentGains(np.array([0.0, 0.0, k]), np.zeros(2)), tau, law, as_printed=as_printed))


def _reduced(matrix: FloatArray) -> FloatArray:
    vertical = [4, 5, 10, 11]
    return matrix[np.ix_(vertical, vertical)]


def full_matrix(gains: TangentGains, tau: float, law: str = "full", *, as_printed: bool = False) -> FloatArray:
    """Return the system matrix of x, Vx, y, Vy, z, Vz of both vehicles (5.10).

    Parameters
    ----------
    gains : TangentGains
    tau : float
        Lag of the vertical velocity, s.
    law : {"full", "shared", "shared_corrected", "non_cooperative"}
    as_printed : bool
        Without the 1/tau on the gains.

    Returns
    -------
    ndarray, shape (12, 12)

    Raises
    ------
    ValueError
        If a gain is not finite, `tau` not positive, or `law` another word.
    """
    lag = float(checked("tau", tau, POSITIVE))
    choice("law", law, LAWS)
    command = np.zeros(6)
    command[[0, 2, 4]] = checked("gains.position", gains.position, FINITE)
    command[[1, 3]] = checked("gains.velocity", gains.velocity, FINITE)
    command *= 1.0 if law in ("full", "non_cooperative") else 0.5
    command *= 1.0 if as_printed else 1.0 / lag
    # What makes a vehicle's velocity follow the other's; mended, the shared law follows its share of the change only.
    follow = (0.5 if law == "shared_corrected" else 1.0) / lag
    matrix = np.zeros((12, 12))
    for k in (0, 2, 4, 6, 8, 10):
        matrix[k, k + 1] = 1.0
    matrix[5, :6], matrix[5, 6:] = command, -command
    matrix[5, [5, 11]] += -follow, follow
    if law == "non_cooperative":
        matrix[11, 11] = -1.0 / lag
    else:
        matrix[11, :6], matrix[11, 6:] = -command, command
        matrix[11, [5, 11]] += follow, -follow
    return matrix


def eigenvalues(k: float, tau: float, law: str = "full", *, as_printed: bool = False) -> NDArray[np.complex128]:
    """Return the eigenvalues of `vertical_matrix` in closed form (5.27), (5.42), (5.46), rising in their real parts.

    Parameters
    ----------
    k : float
        K, 1/s.
    tau : float
        Lag of the vertical velocity, s.
    law : {"full", "shared", "shared_corrected", "non_cooperative"}
    as_printed : bool
        Without the 1/tau on K.

    Returns
    -------
    ndarray, shape (4,)
        1/s; two are 0, or 0 and -1/tau with the non-cooperative law.

    Raises
    ------
    ValueError
        If `k` is not finite, `tau` not positive, or `law` another word.
    """
    lag, gain = float(checked("tau", tau, POSITIVE)), float(checked("k", k, FINITE))
    choice("law", law, LAWS)
    gain *= 1.0 if as_printed else 1.0 / lag
    middle, inside, others = {
        "full": (-1.0 / lag, 1.0 / lag**2 + 2.0 * gain, (0.0, 0.0)),
        "shared": (-1.0 / lag, 1.0 / lag**2 + gain, (0.0, 0.0)),
        "shared_corrected": (-0.5 / lag, 0.25 / lag**2 + gain, (0.0, 0.0)),
        "non_cooperative": (-0.5 / lag, 0.25 / lag**2 + gain, (0.0, -1.0 / lag)),
    }[law]
    root = np.sqrt(complex(inside))
    return np.sort_complex(np.array([middle - root, middle + root, *others]))


class EncounterStability(NamedTuple):
    """The loop linearised about an encounter.

    Attributes
    ----------
    vertical_velocity : float
        That of the first relative to the second with which it passes at the distance: that of the equilibrium, m/s.
    gains : TangentGains
    eigenvalues, as_printed : dict of str to ndarray of complex, shape (4,)
        By law, 1/s; those of x, y and their velocities are eight more zeros. `as_printed` lacks the 1/tau on K.
    largest_stable_delay : dict of str to float
        By law, s: 0 where the loop is unstable without delay, infinite where no delay makes it so.
    """

    vertical_velocity: float
    gains: TangentGains
    eigenvalues: dict[str, NDArray[np.complex128]]
    as_printed: dict[str, NDArray[np.complex128]]
    largest_stable_delay: dict[str, float]


def encounter_stability(
    relative_position: ArrayLike, relative_velocity: ArrayLike, separation: float, tau: float
) -> EncounterStability:
    """Return the loop linearised about the encounter in which the first vehicle passes above at the distance.

    Parameters
    ----------
    relative_position, relative_velocity : array_like, shape (3,)
        First minus second vehicle, z down (NED), m and m/s. The vertical velocity is not used: the equilibrium's is.
    separation : float
        d, m.
    tau : float
        Lag of the vertical velocity, s.

    Returns
    -------
    EncounterStability

    Raises
    ------
    ValueError
        If a value is not finite, `separation` or `tau` not positive, a shape wrong, or no vertical velocity is tangent.
    """
    gains = tangent_gains(relative_position, relative_velocity, separation)
    k = float(gains.position[2])
    return EncounterStability(
        tangent_velocity(relative_position, relative_velocity, separation),
        gains,
        {law: eigenvalues(k, tau, law) for law in LAWS},
        {law: eigenvalues(k, tau, law, as_printed=True) for law in LAWS},
        # The loop knows the time to the closest point by K alone.
        {law: float(largest_stable_delay(-1.0 / k, tau, law)) if k < 0.0 else 0.0 for law in LAWS},
    )


def largest_stable_delay(
    t_star: ArrayLike, tau: ArrayLike, law: str = "full", pade: int | None = None
) -> FloatArray | float:
    """Return the communication delay at which the loop of two avoiding vehicles becomes unstable.

    Each hears the other's position and velocity late by the same time and knows its own at once (5.47). The difference
    of the heights then obeys tau s^2 + (s + 1/t*)(1 + exp(-sT)) = 0, which first has roots on the imaginary axis at
    w = sqrt(2/(tau t*)), T = (2/w) atan(w t*). A Pade approximation of the delay also has magnitude 1 on that axis:
    w is the same, and only the delay that has the phase of exp(-i w T) is another one. For order 1 it is 2 t*, (5.51).

    Parameters
    ----------
    t_star : array_like
        Time to the closest point of approach, s. The arrays broadcast.
    tau : array_like
        Lag of the vertical velocity, s.
    law : {"full", "shared", "shared_corrected", "non_cooperative"}
        With the last the loop is closed within one vehicle, and no delay makes it unstable.
    pade : int or None
        Order of the approximation, 1 to 20; None: exact.

    Returns
    -------
    float or ndarray
        s.

    Raises
    ------
    ValueError
        If a time is not finite and positive, or `law` or `pade` is none of those.
    """
    star, lag = np.broadcast_arrays(checked("t_star", t_star, POSITIVE), checked("tau", tau, POSITIVE))
    choice("law", law, LAWS)
    if pade is not None and not (isinstance(pade, int | np.integer) and 1 <= pade <= _LARGEST_ORDER):
        raise ValueError(f"pade must be None or a whole number from 1 to {_LARGEST_ORDER}, not {pade!r}")
    if law == "non_cooperative":
        delay = np.full(star.shape, math.inf)
    else:
        # Half of K is that of twice the time; half of both K and the damping that of twice the lag.
        star = 2.0 * star if law == "shared" else star
        lag = 2.0 * lag if law == "shared_corrected" else lag
        frequency = np.sqrt(2.0 / (lag * star))
        phase = np.arctan(frequency * star)
        delay = 2.0 * phase / frequency if pade is None else _pade_argument(phase, int(pade)) / frequency
    return float(delay) if delay.ndim == 0 else delay


def _pade_argument(phase: FloatArray, order: int) -> FloatArray:
    """Return the x at which the denominator of the Pade approximation of exp(-s) has a phase at s = ix."""
    coefficients = [
        math.comb(order, k) * math.factorial(2 * order - k) / math.factorial(2 * order) for k in range(order + 1)
    ]
    roots = np.roots(coefficients[::-1])

    def excess(x: float, wanted: float) -> float:
        # All roots lie in the left half-plane: no factor's phase leaves the quarter in which arctan is.
        return float(np.angle(1.0 - 1j * x / roots).sum()) - wanted

    # The phase of order 1 is the smallest of all.
    found = [brentq(excess, 0.0, 2.0 * math.tan(p) * (1.0 + 1e-9) + 1e-9, (p,), xtol=1e-14) for p in phase.ravel()]
    return np.array(found).reshape(phase.shape)
