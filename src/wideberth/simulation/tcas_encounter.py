"""A drone meets an aircraft that carries TCAS: the vertical flown by each side's logic, the horizontal straight.

With TCAS III (3.4) the aircraft may be turned as well, where no vertical advisory is enough.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from wideberth.avoidance.cas.complement import FREE, ComplementaryManeuver
from wideberth.conflict.tcas.advisories import FIRST_RESPONSE, GRAVITY
from wideberth.conflict.tcas.alerts import geometry
from wideberth.conflict.tcas.horizontal import LARGEST_TURN, TURN_RATE, TcasThreeUnit, TurnAdvisory
from wideberth.conflict.tcas.thresholds import TCAS_II, Bands, sensitivity_level
from wideberth.types import FloatArray

STEP = 0.25  # s, of the motion; decisions come once a second
_DECIDE_EVERY = 4
_OWN_ACCELERATION = 0.25 * GRAVITY


@dataclass(frozen=True, slots=True)
class TcasEncounter:
    """What came of an encounter.

    Attributes
    ----------
    traffic_advisories, resolution_advisories, turn_advisories : int
        That the other aircraft's TCAS began.
    horizontal, vertical : ndarray, shape (n,)
        Separation at each step, m.
    own_height, intruder_height : ndarray, shape (n,)
        m above the origin.
    sides, senses : ndarray, shape (n,)
        Of the own maneuver, and of the advisory in force: +1 up, -1 down, 0 none.
    courses : ndarray, shape (n,)
        Of the other aircraft, rad.
    """

    traffic_advisories: int
    resolution_advisories: int
    turn_advisories: int
    horizontal: FloatArray
    vertical: FloatArray
    own_height: FloatArray
    intruder_height: FloatArray
    sides: FloatArray
    senses: FloatArray
    courses: FloatArray

    def lost(self, radius: float, half_height: float) -> bool:
        """Return whether the two were ever within both distances, m."""
        return bool(np.any((self.horizontal < radius) & (self.vertical < half_height)))


def fly_tcas_encounter(
    own: ArrayLike,
    intruder: ArrayLike,
    duration: float,
    maneuver: ComplementaryManeuver | None,
    *,
    altitude: float = 0.0,
    link_delay: float = 1.0,
    follows: bool = True,
    bands: Bands = TCAS_II,
    turns: bool = False,
) -> TcasEncounter:
    """Fly an encounter.

    Parameters
    ----------
    own, intruder : array_like, shape (6,)
        Position and velocity at the start, NED.
    duration : float
        s.
    maneuver : ComplementaryManeuver or None
        Of the own aircraft; None: it flies straight on.
    altitude : float
        Pressure altitude of the origin, m.
    link_delay : float
        Until the own aircraft hears of an advisory, s.
    follows : bool
        Whether the other pilot flies the advisories.
    bands : tuple
        Thresholds by altitude.
    turns : bool
        Whether the other aircraft has TCAS III, which advises turns too.

    Raises
    ------
    ValueError
        If a state has another shape or is not finite.
    """
    x, y = np.array(own, float), np.array(intruder, float)
    third = TcasThreeUnit(address=1)
    unit = third.vertical
    cruise, wanted = -y[5], -x[5]
    rate, side = wanted, FREE
    heard: list[tuple[float, int]] = []
    turning, turned = None, 0.0  # the turn that is flown, and by how much it has turned
    rows = np.empty((math.ceil(duration / STEP), 7))
    for k in range(len(rows)):
        t = k * STEP
        if k % _DECIDE_EVERY == 0:
            thresholds = sensitivity_level(altitude - y[2], bands=bands)
            if turns:
                third.step(t, y, x, thresholds)
            else:
                unit.step(t, geometry(y[:3], y[3:], x[:3], x[3:]), -y[5], thresholds)
            heard.append((t + link_delay, int(unit.sense or 0)))
            advised = next((sense for due, sense in reversed(heard) if due <= t), FREE)
            if maneuver is not None:
                rate, side = maneuver.decide(x, y, wanted, advised, side)
        rows[k, :2] = math.hypot(x[0] - y[0], x[1] - y[1]), abs(x[2] - y[2])
        rows[k, 2:] = -x[2], -y[2], side, int(unit.sense or 0), math.atan2(y[4], y[3])
        _fly(x, rate, _OWN_ACCELERATION)
        if follows and third.turn is not turning:
            turning, turned = third.turn, 0.0
        if follows and turning is not None:
            turned += _turn(y, turning, t, turned)
        held = unit.advisory
        if held is None or not follows:
            _fly(y, cruise, 0.25 * GRAVITY)
        else:
            ready = t - held.issued >= held.response.delay
            _fly(y, held.advisory.complied(-y[5]) if ready else -y[5], held.response.acceleration)
    return TcasEncounter(
        unit.traffic_advisories,
        unit.resolution_advisories,
        third.turn_advisories,
        *(np.ascontiguousarray(column) for column in rows.T),
    )


def _fly(state: FloatArray, climb_rate: float, acceleration: float) -> None:
    """Move a state on by one step, its climb rate towards one wanted; in place."""
    change = np.clip(-climb_rate - state[5], -acceleration * STEP, acceleration * STEP)
    state[:2] += state[3:5] * STEP
    state[2] += (state[5] + 0.5 * change) * STEP
    state[5] += change


def _turn(state: FloatArray, advisory: TurnAdvisory, t: float, turned: float) -> float:
    """Turn a velocity by what a step of an advised turn leaves to do, in place; return the angle."""
    if t - advisory.issued < FIRST_RESPONSE.delay:
        return 0.0
    angle = min(TURN_RATE * STEP, LARGEST_TURN - turned)
    c, s = math.cos(angle), advisory.turn * math.sin(angle)
    state[3:5] = c * state[3] - s * state[4], s * state[3] + c * state[4]
    return angle


def draw_tcas_encounter(rng: np.random.Generator) -> tuple[FloatArray, FloatArray, float, float]:
    """Draw an encounter of a level drone with a faster aircraft that passes within 1500 m and 400 m of height.

    Half of the aircraft fly level, the others climb or sink by up to 8 m/s.

    Returns
    -------
    own, intruder : ndarray, shape (6,)
        Position and velocity at the start, NED; closest after 70 to 100 s.
    duration : float
        s.
    altitude : float
        Of the origin, m: one of 800, 1500 and 3000.
    """
    closest = rng.uniform(70.0, 100.0)
    course, speed = rng.uniform(0.0, 2.0 * math.pi), rng.uniform(60.0, 150.0)
    own = np.array([0.0, 0.0, 0.0, rng.uniform(20.0, 60.0), 0.0, 0.0])
    climb = rng.choice([0.0, rng.uniform(-8.0, 8.0)])
    velocity = np.array([speed * math.cos(course), speed * math.sin(course), -climb])
    relative = velocity - own[3:]
    across = np.array([-relative[1], relative[0], 0.0]) / math.hypot(relative[0], relative[1])
    miss = rng.uniform(-1500.0, 1500.0) * across + np.array([0.0, 0.0, rng.uniform(-400.0, 400.0)])
    altitude = float(rng.choice([800.0, 1500.0, 3000.0]))
    return own, np.concatenate([miss - relative * closest, velocity]), closest + 40.0, altitude
