"""From which bearings and speeds of intruder a sensor on board protects an aircraft, and what would cure the rest."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wideberth.analysis.sensor_sizing import (
    Protection,
    RequiredRangeFunction,
    available_range,
    fastest_closing,
    protected,
)
from wideberth.analysis.sizing_config import AdsbSizingConfig, AircraftConfig, GroundRadarConfig, SensorConfig
from wideberth.argument_checks import POSITIVE, FloatArray, checked
from wideberth.sensors.radar.coverage import off_boresight

BoolArray = NDArray[np.bool_]
Interval = tuple[float, float]

LARGEST_RCS = 1e4  # m2, up to which a cross-section is looked for
_BISECTIONS = 11
_BEARINGS = np.radians(np.arange(-180.0, 180.0, 2.0))
_MAP_BEARINGS = np.radians(np.arange(-180.0, 180.0, 4.0))
_MAP_SPEEDS = 40
_SPEED_STEP = 0.25  # m/s, to which the limits are found


@dataclass(frozen=True, slots=True)
class Intruder:
    """An intruder to ask about.

    Attributes
    ----------
    name : str
    speed : float
        m/s.
    """

    name: str
    speed: float


INTRUDERS = (
    Intruder("multirotor", 10.0),
    Intruder("small fixed wing", 15.0),
    Intruder("fast multirotor", 20.0),
    Intruder("large drone", 30.0),
    Intruder("ultralight", 45.0),
    Intruder("light airplane", 64.8),
    Intruder("fast light plane", 77.2),
    Intruder("turboprop", 100.0),
    Intruder("airliner, low", 128.6),
    Intruder("jet", 150.0),
)
"""Typical speeds; 126 kt is the Cessna SkyHawk of the ADS-B paper (figure 3), 150 kt that of the thesis (table 2.3)."""


@dataclass(frozen=True, slots=True)
class SpeedLimit:
    """Up to what speed of intruder some bearings are protected, all slower ones included.

    Attributes
    ----------
    speed : float or None
        m/s; None where not even the slowest is avoided.
    at_least : bool
        Whether that was the fastest asked for.
    """

    speed: float | None
    at_least: bool = False


@dataclass(frozen=True, slots=True)
class IntruderAnswer:
    """What a sensor does against an intruder of one speed.

    Attributes
    ----------
    intruder : Intruder
    protected, unprotected, no_threat : tuple of (float, float)
        Bearings from, to, clockwise, rad in (-pi, pi]. From those without a threat no intruder of that speed can
        come into the safety volume; they are neither of the others.
    required_head_on, available_head_on : float
        m.
    worst_bearing : float
        Where most is missing, rad.
    worst_required, worst_available, shortfall : float
        There, m; the shortfall is 0 where all is protected.
    shortfall_in_view : float
        The same, of the bearings in the sensor's field of view.
    needed_range : float
        Greatest range that is required within the field of view, m.
    needed_range_all_round : float
        And from anywhere, m.
    needed_field_of_view : float
        Width, about the nose, out of which no intruder can come into the safety volume, rad.
    needed_rcs : float or None
        Least cross-section, from the present on, with which the whole field of view is protected, m2; None: no
        cross-section is enough, or the sensor is ADS-B and does not ask for one.
    needed_decision_time : float or None
        Longest of the aircraft's, up to the present, with which the whole field of view is protected, s; None: not even
        without any.
    """

    intruder: Intruder
    protected: tuple[Interval, ...]
    unprotected: tuple[Interval, ...]
    no_threat: tuple[Interval, ...]
    required_head_on: float
    available_head_on: float
    worst_bearing: float
    worst_required: float
    worst_available: float
    shortfall: float
    shortfall_in_view: float
    needed_range: float
    needed_range_all_round: float
    needed_field_of_view: float
    needed_rcs: float | None
    needed_decision_time: float | None


@dataclass(frozen=True, slots=True)
class SizingAnswer:
    """What a sensor on board does for an aircraft.

    Attributes
    ----------
    rcs : float
        Radar cross-section of the intruders, m2.
    protection : Protection
        For the intruders asked about.
    visible : ndarray of bool, shape (b,)
        Which bearings of `protection` are in the field of view.
    map : Protection
        Over all speeds.
    head_on, field_of_view, all_round : SpeedLimit
        Up to what speed the aircraft is protected from ahead, in the sensor's field of view, and from everywhere.
    intruders : tuple of IntruderAnswer
    """

    rcs: float
    protection: Protection
    visible: BoolArray
    map: Protection
    head_on: SpeedLimit
    field_of_view: SpeedLimit
    all_round: SpeedLimit
    intruders: tuple[IntruderAnswer, ...] = field(repr=False)


def intervals(bearings: ArrayLike, mask: ArrayLike) -> tuple[Interval, ...]:
    """Return where a mask over a whole circle of bearings holds, as stretches from one bearing clockwise to another.

    Parameters
    ----------
    bearings : array_like, shape (b,)
        rad, rising, within one turn.
    mask : array_like of bool, shape (b,)

    Returns
    -------
    tuple of (float, float)
        rad; the second is less than the first where a stretch goes through the tail. All round is (-pi, pi).
    """
    angles, holds = np.asarray(bearings, np.float64), np.asarray(mask, np.bool_)
    if holds.all():
        return ((-math.pi, math.pi),)
    begins = np.flatnonzero(holds & ~np.roll(holds, 1))
    ends = np.flatnonzero(holds & ~np.roll(holds, -1))
    if len(begins) and ends[0] < begins[0]:
        ends = np.roll(ends, -1)
    found = [(float(angles[a]), float(angles[b])) for a, b in zip(begins, ends, strict=True)]
    return tuple(sorted(found))


def visible_bearings(sensor: SensorConfig, bearings: FloatArray) -> BoolArray:
    """Return which level bearings lie in a sensor's field of view.

    Parameters
    ----------
    sensor : RadarConfig or AdsbSizingConfig
    bearings : ndarray
        rad, clockwise from the nose.

    Returns
    -------
    ndarray of bool
    """
    if isinstance(sensor, AdsbSizingConfig):
        return np.ones(bearings.shape, np.bool_)
    return off_boresight(bearings, 0.0, sensor)[2]


def size_sensor(
    sensor: SensorConfig,
    aircraft: AircraftConfig,
    intruders: Sequence[Intruder] = INTRUDERS,
    *,
    required_range: RequiredRangeFunction,
    rcs: float = 1.0,
) -> SizingAnswer:
    """Return from which bearings and speeds of intruder a sensor on board protects an aircraft.

    Parameters
    ----------
    sensor : RadarConfig or AdsbSizingConfig
    aircraft : AircraftConfig
        Flies at its cruise speed.
    intruders : sequence of Intruder
        At least one.
    required_range : callable
        See `sensor_sizing.RequiredRangeFunction`.
    rcs : float
        Radar cross-section of the intruders, m2.

    Returns
    -------
    SizingAnswer

    Raises
    ------
    ValueError
        If there is no intruder, a speed or cross-section is not finite and positive, or the sensor on the ground.
    """
    if isinstance(sensor, GroundRadarConfig):
        raise ValueError("sensor: a radar on the ground protects a volume, not bearings: use ground_sizing")
    speeds = checked("intruder speeds", [intruder.speed for intruder in intruders], POSITIVE)
    if not speeds.size:
        raise ValueError("intruders: give at least one")
    section = float(checked("rcs", rcs, POSITIVE))

    def ask(bearings: FloatArray, at: FloatArray) -> Protection:
        return protected(sensor, aircraft, bearings, at, required_range=required_range, rcs=section)

    found = ask(_BEARINGS, speeds)
    visible = visible_bearings(sensor, _BEARINGS)
    fastest = max(150.0, float(speeds.max()))
    whole = ask(_MAP_BEARINGS, np.linspace(fastest / _MAP_SPEEDS, fastest, _MAP_SPEEDS))
    everywhere = np.ones(len(_MAP_BEARINGS), np.bool_)
    head_on, field_of_view, all_round = (
        _limit(whole, which, ask)
        for which in (np.abs(_MAP_BEARINGS) < 1e-9, visible_bearings(sensor, _MAP_BEARINGS), everywhere)
    )
    seen = _rows(found, visible)
    sections = _needed_rcs(sensor, aircraft.speed_cruise_mps, seen, section)
    times = _needed_decision_times(aircraft, seen, required_range)
    answers = [_intruder_answer(one, k, found, seen, sections[k], times[k]) for k, one in enumerate(intruders)]
    return SizingAnswer(section, found, visible, whole, head_on, field_of_view, all_round, tuple(answers))


def _limit(whole: Protection, which: BoolArray, ask: Callable[[FloatArray, FloatArray], Protection]) -> SpeedLimit:
    """Return up to what speed the bearings are protected; between two speeds of the map it looks again."""
    if not which.any():
        return SpeedLimit(None)
    safe = whole.protected[which].all(axis=0)
    if safe.all():
        return SpeedLimit(float(whole.intruder_speeds[-1]), at_least=True)
    first_bad = int(np.argmin(safe))
    low = 0.0 if first_bad == 0 else float(whole.intruder_speeds[first_bad - 1])
    high = float(whole.intruder_speeds[first_bad])
    between = np.linspace(low, high, math.ceil((high - low) / _SPEED_STEP) + 1)
    fine = ask(whole.bearings[which], between[1:-1]).protected.all(axis=0)
    count = int(np.argmin(np.append(fine, False)))
    return SpeedLimit(float(between[count]) or None)


def _rows(found: Protection, which: BoolArray) -> Protection:
    """Return what holds for some of the bearings."""
    return Protection(
        found.bearings[which],
        found.intruder_speeds,
        found.closing_speed[which],
        found.required_range[which],
        found.available_range[which],
        found.margin[which],
        found.protected[which],
    )


def _needed_rcs(sensor: SensorConfig, own: float, seen: Protection, rcs: float) -> list[float | None]:
    """Return the least cross-section, from the present on, with which all that is seen is protected, for each speed."""
    already = np.asarray(seen.protected.all(axis=0))
    count = len(already)
    if isinstance(sensor, AdsbSizingConfig):
        return [None] * count
    # What is protected now is protected from a larger one too.
    rows, columns = np.nonzero(~seen.protected)
    bearing, required = seen.bearings[rows], seen.required_range[rows, columns]
    closing = fastest_closing(bearing, own, seen.intruder_speeds[columns])

    def enough(exponent: FloatArray, which: BoolArray) -> BoolArray:
        cells = which[columns]
        sections = 10.0 ** exponent[columns[cells]]
        available = available_range(sensor, bearing[cells], closing[cells], rcs=sections)
        short = np.bincount(columns[cells][available < required[cells]], minlength=count)
        return np.asarray(short[which] == 0)

    now, largest = np.full(count, math.log10(rcs)), np.full(count, math.log10(max(LARGEST_RCS, rcs)))
    possible = np.zeros(count, np.bool_)
    if not already.all():
        possible[~already] = enough(largest, ~already)
    found = 10.0 ** _between(enough, now, largest, possible)
    found[already] = rcs
    return [float(x) if can else None for x, can in zip(found, possible | already, strict=True)]


def _needed_decision_times(
    aircraft: AircraftConfig, seen: Protection, required_range: RequiredRangeFunction
) -> list[float | None]:
    """Return the longest decision time, up to the present, with which all that is seen is protected, for each speed."""
    count = len(seen.intruder_speeds)

    def enough(time: FloatArray, which: BoolArray) -> BoolArray:
        found = []
        for k in np.flatnonzero(which):
            sooner = aircraft.model_copy(update={"decision_time_s": float(time[k])})
            speed = np.full(seen.bearings.shape, seen.intruder_speeds[k])
            required = np.nan_to_num(required_range(seen.bearings, speed, sooner), nan=0.0, posinf=math.inf)
            found.append(bool((seen.available_range[:, k] >= required).all()))
        return np.array(found, np.bool_)

    now = np.full(count, aircraft.decision_time_s)
    already = np.asarray(seen.protected.all(axis=0))
    possible = np.zeros(count, np.bool_)
    possible[~already] = enough(np.zeros(count), ~already)
    found = _between(enough, now, np.zeros(count), possible)
    found[already] = aircraft.decision_time_s
    return [float(x) if can else None for x, can in zip(found, possible | already, strict=True)]


def _between(
    enough: Callable[[FloatArray, BoolArray], BoolArray], bad: FloatArray, good: FloatArray, which: BoolArray
) -> FloatArray:
    """Return, on the good side, where it begins to be enough between two ends, by halving."""
    bad, good = bad.copy(), good.copy()
    for _ in range(_BISECTIONS if which.any() else 0):
        middle = 0.5 * (bad + good)
        better = np.zeros(len(which), np.bool_)
        better[which] = enough(middle, which)
        good[better], bad[~better] = middle[better], middle[~better]
    return good


def _intruder_answer(
    intruder: Intruder, k: int, found: Protection, seen: Protection, rcs: float | None, time: float | None
) -> IntruderAnswer:
    angles, required, safe = found.bearings, found.required_range[:, k], found.protected[:, k]
    threat = required > 0.0
    ahead = int(np.argmin(np.abs(angles)))
    worst = int(np.argmin(found.margin[:, k]))
    # Where several bearings lack as much (all of an infinite range), the one nearest to the nose.
    ties = np.flatnonzero(found.margin[:, k] == found.margin[worst, k])
    worst = int(ties[np.argmin(np.abs(angles[ties]))])
    return IntruderAnswer(
        intruder,
        intervals(angles, safe & threat),
        intervals(angles, ~safe),
        intervals(angles, ~threat),
        float(required[ahead]),
        float(found.available_range[ahead, k]),
        float(angles[worst]),
        float(required[worst]),
        float(found.available_range[worst, k]),
        float(max(-found.margin[worst, k], 0.0)),
        float(np.max(-seen.margin[:, k], initial=0.0)),
        float(seen.required_range[:, k].max(initial=0.0)),
        float(required.max()),
        min(2.0 * float(np.abs(angles[threat]).max(initial=0.0)), 2.0 * math.pi),
        rcs,
        time,
    )
