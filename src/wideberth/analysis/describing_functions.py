"""Limit cycles of the avoidance loop's relays and its saturation, by describing functions (CAS thesis, 5.3.2).

A nonlinearity that is fed a sine of amplitude A answers, in its first harmonic, like a gain N(A). A limit cycle is
where the loop with that gain just oscillates. The source names the nonlinearities and the method and goes no further;
here the time to the closest point t* is held, and each prediction is flown by `limit_cycle_flights`.

The switch between the upper and the lower side is a relay that drives the miss away from zero: it has two stable sides
and no limit cycle. The switch where no tangent exists depends on the horizontal miss alone, which the vertical loop
does not move: it only opens the loop. `window_gain` is its gain, for loops that are coupled.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from wideberth.argument_checks import NOT_NEGATIVE, POSITIVE, FloatArray, checked

_SCAN = 4000  # frequencies tried between the slowest and the fastest


class LimitCycle(NamedTuple):
    """An oscillation.

    Attributes
    ----------
    amplitude : float
        Of what the nonlinearity is fed: m/s before the saturation, m before the switch.
    frequency : float
        rad/s.
    """

    amplitude: float
    frequency: float


def saturation_gain(amplitude: float, limit: float) -> float:
    """Return N of a gain of one that is limited to +-`limit`; 1 where the limit is not reached."""
    if amplitude <= limit:
        return 1.0
    ratio = limit / amplitude
    return 2.0 / math.pi * (math.asin(ratio) + ratio * math.sqrt(1.0 - ratio * ratio))


def relay_gain(amplitude: float, level: float, hysteresis: float = 0.0) -> complex:
    """Return N of a relay of +-`level` that switches at +-`hysteresis`; 0 where the amplitude does not reach that."""
    if amplitude <= hysteresis:
        return 0.0
    ratio = hysteresis / amplitude
    return 4.0 * level / (math.pi * amplitude) * complex(math.sqrt(1.0 - ratio * ratio), -ratio)


def window_gain(amplitude: float, level: float, width: float) -> float:
    """Return N of a relay of +-`level` that is off where its input exceeds `width`: where no tangent exists."""
    share = 1.0 if amplitude <= width else 1.0 - math.sqrt(1.0 - (width / amplitude) ** 2)
    return 4.0 * level / (math.pi * amplitude) * share


def command_response(frequency: float, t_star: float, tau: float, delay: float) -> complex:
    """Return the response of the command wanted to the command flown, both vehicles avoiding alike.

    With z the own height, w the own velocity and E the delay, each wants -((1 + E) z / t* + E w): the loop of (5.47)
    whose limit of stability `stability.largest_stable_delay` gives.
    """
    s = 1j * frequency
    late = np.exp(-s * delay)
    return complex(-((1.0 + late) / (s * t_star) + late) / (1.0 + s * tau))


def saturation_limit_cycle(t_star: float, tau: float, delay: float, limit: float) -> LimitCycle | None:
    """Return the limit cycle of two vehicles whose commands are limited, both with the full law.

    Parameters
    ----------
    t_star, tau, delay : float
        Time to the closest point, lag of the vertical velocity, and delay of the other's state, s.
    limit : float
        Largest vertical velocity up and down, m/s.

    Returns
    -------
    LimitCycle or None
        Of the command wanted; None where the loop is stable.

    Raises
    ------
    ValueError
        If a time or the limit is not finite and positive.
    """
    star, lag, late, most = _positive(t_star=t_star, tau=tau, delay=delay, limit=limit)

    def response(w: float) -> complex:
        return command_response(w, star, lag, late)

    largest, found = 1.0, math.nan
    for w in _crossings(lambda w: response(w).imag, star, lag, late):
        if response(w).real > largest:
            largest, found = response(w).real, w
    if math.isnan(found):
        return None
    # N falls from 1 to 0 as the amplitude grows: at one amplitude it is 1 / largest.
    ratio = brentq(lambda r: saturation_gain(1.0 / r, 1.0) - 1.0 / largest, 1e-9, 1.0)
    return LimitCycle(most / float(ratio), found)


def miss_response(frequency: float, t_star: float, tau: float, delay: float) -> complex:
    """Return the response of the miss at the closest point, z + w t*, to a velocity commanded `delay` s earlier."""
    s = 1j * frequency
    return complex((1.0 / s + t_star) / (1.0 + s * tau) * np.exp(-s * delay))


def switching_limit_cycle(
    t_star: float, tau: float, level: float, hysteresis: float, delay: float
) -> LimitCycle | None:
    """Return the limit cycle of the switch that begins and ends an avoidance, by its describing function.

    A vehicle climbs at `level` while the miss at the closest point is too small, and returns at `level` while it is too
    large.

    Parameters
    ----------
    t_star, tau : float
        Time to the closest point and lag of the vertical velocity, s.
    level : float
        Vertical velocity of avoidance and return, m/s.
    hysteresis : float
        Half-width of the switching band (figure 4.19), m.
    delay : float
        s.

    Returns
    -------
    LimitCycle or None
        Of the miss; None where the method sees none: the miss follows the command at once by t*, and the switch then
        chatters faster than a first harmonic can tell. `exact_switching_limit_cycle` does.

    Raises
    ------
    ValueError
        If a value is not finite or negative.
    """
    star, lag, velocity = _positive(t_star=t_star, tau=tau, level=level)
    width, late = (
        float(checked(name, value, NOT_NEGATIVE)) for name, value in (("hysteresis", hysteresis), ("delay", delay))
    )
    # -1 / N has the imaginary part -pi hysteresis / (4 level) at every amplitude: that alone gives the frequency.
    wanted = -math.pi * width / (4.0 * velocity)
    for w in _crossings(lambda w: miss_response(w, star, lag, late).imag - wanted, star, lag, late):
        real = miss_response(w, star, lag, late).real
        if real < 0.0:
            return LimitCycle(math.hypot(4.0 * velocity * real / math.pi, width), w)
    return None


def exact_switching_limit_cycle(
    t_star: float, tau: float, level: float, hysteresis: float, delay: float
) -> LimitCycle | None:
    """Return the limit cycle of the same switch from the exact response to a square wave (Tsypkin's method).

    Parameters
    ----------
    t_star, tau, level, hysteresis, delay : float
        As of `switching_limit_cycle`.

    Returns
    -------
    LimitCycle or None
        None without hysteresis and delay: then the switch chatters without a period.

    Raises
    ------
    ValueError
        If a value is not finite or negative.
    """
    star, lag, velocity = _positive(t_star=t_star, tau=tau, level=level)
    width, late = (
        float(checked(name, value, NOT_NEGATIVE)) for name, value in (("hysteresis", hysteresis), ("delay", delay))
    )
    if width == 0.0 and late == 0.0:
        return None

    def miss(t: float, half: float) -> float:
        """Return the miss `t` s after the command went up, in a square wave of half period `half`."""
        slowest = velocity * math.tanh(half / (2.0 * lag))
        decay = math.exp(-t / lag)
        w = velocity - (velocity + slowest) * decay
        gained = velocity * t - (velocity + slowest) * lag * (1.0 - decay)
        return gained - (0.5 * velocity * half - velocity * lag * math.tanh(half / (2.0 * lag))) + star * w

    # The miss reaches the upper edge of the band `late` before the command goes down.
    low = max(late, 1e-9)
    high = low + star + lag + late + width / velocity
    while miss(high - late, high) < width:
        high *= 2.0
    half = float(brentq(lambda p: miss(p - late, p) - width, low, high, xtol=1e-12))
    amplitude = max(abs(miss(float(t), half)) for t in np.linspace(0.0, half, 2001))
    return LimitCycle(amplitude, math.pi / half)


def _positive(**values: float) -> list[float]:
    return [float(checked(name, value, POSITIVE)) for name, value in values.items()]


def _crossings(imaginary: Callable[[float], float], t_star: float, tau: float, delay: float) -> list[float]:
    """Return the frequencies at which a function of the frequency changes its sign, rising."""
    slowest, fastest = 0.01 / (t_star + tau + delay), 100.0 / min(t_star, tau, delay or tau)
    frequencies: FloatArray = np.geomspace(slowest, fastest, _SCAN)
    values = np.array([imaginary(float(w)) for w in frequencies])
    return [
        float(brentq(imaginary, frequencies[k], frequencies[k + 1]))
        for k in np.flatnonzero(values[:-1] * values[1:] < 0.0)
    ]
