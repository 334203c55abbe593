"""Horizontal advisories, as TCAS III adds them to the vertical ones (CAS thesis, 3.4). How they are chosen is ours."""

import enum
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from wideberth.argument_checks import FINITE, checked
from wideberth.conflict.tcas.advisories import FIRST_RESPONSE, Advisory, Response, Sense
from wideberth.conflict.tcas.alerts import TcasAlert, geometry
from wideberth.conflict.tcas.logic import TcasUnit
from wideberth.conflict.tcas.resolution import separation
from wideberth.conflict.tcas.thresholds import TcasThresholds
from wideberth.types import FloatArray

TURN_RATE = math.radians(3.0)  # rad/s, a standard turn
LARGEST_TURN = math.radians(90.0)
_STEP = 0.25  # s, at which turned paths are looked at
_LOOKAHEAD = 90.0  # s
_LEAST_GAIN = 0.05  # of the miss distance wanted: a turn that gains less is not advised


class Turn(enum.IntEnum):
    """Which way to turn."""

    LEFT = -1
    RIGHT = 1


class Passing(enum.IntEnum):
    """On which side two aircraft pass each other: both have the other on that side, so that both say the same."""

    LEFT = -1
    RIGHT = 1


@dataclass(frozen=True, slots=True)
class TurnAdvisory:
    """A turn, to be flown at `TURN_RATE` until it is over or `LARGEST_TURN` is reached.

    Attributes
    ----------
    turn : Turn
    passing : Passing
        What it leads to, and what the other aircraft is told.
    issued : float
        s.
    """

    turn: Turn
    passing: Passing
    issued: float


def turned_miss(own: ArrayLike, intruder: ArrayLike, turn: Turn, delay: float) -> tuple[float, Passing]:
    """Return the least horizontal distance of a turn until the look-ahead, m, and the side on which the two pass.

    Parameters
    ----------
    own, intruder : array_like, shape (6,)
        Position and velocity, NED; the intruder flies straight on.
    turn : Turn
    delay : float
        Until the turn begins, s.

    Raises
    ------
    ValueError
        If a state has another shape or is not finite.
    """
    x, other = _states(own, intruder)
    t = np.arange(0.0, _LOOKAHEAD + _STEP, _STEP)
    # Turned by an angle in the time that it lasts, straight before and after.
    turning = np.clip(t - delay, 0.0, LARGEST_TURN / TURN_RATE)
    rate = turn * TURN_RATE
    straight = t - turning
    after = np.maximum(straight - delay, 0.0)
    before = straight - after
    angle = rate * turning
    along, right = np.sin(angle) / rate, (1.0 - np.cos(angle)) / rate
    along, right = before + along + after * np.cos(angle), right + after * np.sin(angle)
    north = x[0] + x[3] * along - x[4] * right - other[0] - other[3] * t
    east = x[1] + x[4] * along + x[3] * right - other[1] - other[4] * t
    distance = np.hypot(north, east)
    k = int(np.argmin(distance))
    # The intruder's side, seen along the own relative motion there.
    k = min(max(k, 1), len(t) - 1)
    across = (north[k] - north[k - 1]) * -east[k] - (east[k] - east[k - 1]) * -north[k]
    return float(distance.min()), Passing.RIGHT if across > 0.0 else Passing.LEFT


def choose_turn(
    own: ArrayLike, intruder: ArrayLike, wanted: float, delay: float, passing: Passing | None = None
) -> tuple[Turn, Passing] | None:
    """Return the turn that passes widest, and how it passes; None where none gains anything, or enough is kept already.

    Parameters
    ----------
    own, intruder : array_like, shape (6,)
        Position and velocity, NED.
    wanted : float
        Horizontal distance, m.
    delay : float
        Until the turn begins, s.
    passing : Passing, optional
        What the intruder has said: only turns that agree are looked at.

    Raises
    ------
    ValueError
        As `turned_miss`.
    """
    x, other = _states(own, intruder)
    straight = geometry(x[:3], x[3:], other[:3], other[3:]).miss
    if straight >= wanted:
        return None
    best, best_miss = None, straight + _LEAST_GAIN * wanted
    for turn in (Turn.RIGHT, Turn.LEFT):
        miss, side = turned_miss(x, other, turn, delay)
        if miss > best_miss and passing in (None, side):
            best, best_miss = (turn, side), miss
    return best


class TcasThreeUnit:
    """One aircraft's TCAS III against one intruder: TCAS II, and a turn where no vertical advisory reaches ALIM.

    Parameters
    ----------
    address : int
        As for `TcasUnit`; in a tie the lower one keeps its side.

    Attributes
    ----------
    vertical : TcasUnit
    turn : TurnAdvisory or None
        In force.
    turn_advisories : int
        How many were begun.
    """

    def __init__(self, address: int = 0) -> None:
        self.vertical = TcasUnit(address)
        self.turn: TurnAdvisory | None = None
        self.turn_advisories = 0

    @property
    def passing(self) -> Passing | None:
        """The side of the turn in force: what the other aircraft is told."""
        return None if self.turn is None else self.turn.passing

    def step(
        self,
        t: float,
        own: ArrayLike,
        intruder: ArrayLike,
        thresholds: TcasThresholds,
        *,
        other_sense: Sense | None = None,
        other_passing: Passing | None = None,
        other_address: int = 0,
    ) -> tuple[Advisory | None, TurnAdvisory | None]:
        """Take one step, once a second, and return the vertical and the horizontal advisory in force.

        Parameters
        ----------
        t : float
            Now, s.
        own, intruder : array_like, shape (6,)
            Position and velocity, NED.
        thresholds : TcasThresholds
        other_sense, other_passing : Sense and Passing, optional
            What the intruder's unit has said it will do.
        other_address : int
            Of the intruder.

        Raises
        ------
        ValueError
            If a state has another shape or is not finite.
        """
        x, other = _states(own, intruder)
        g = geometry(x[:3], x[3:], other[:3], other[3:])
        advisory = self.vertical.step(t, g, -float(x[5]), thresholds, other_sense, other_address)
        if self.vertical.alert is not TcasAlert.RESOLUTION or advisory is None:
            self.turn = None
            return advisory, None
        if self.turn is not None:
            if other_passing not in (None, self.turn.passing) and self.vertical.address > other_address:
                self._advise(t, x, other, thresholds, other_passing)
            return advisory, self.turn
        remaining = advisory.response.delay - (t - advisory.issued)
        if g.range_rate < 0.0 and remaining >= 0.0:
            response = Response(remaining, advisory.response.acceleration)
            reached = separation(g, -float(x[5]), advisory.advisory, response)
            if reached < thresholds.alim:
                self._advise(t, x, other, thresholds, other_passing)
        return advisory, self.turn

    def _advise(
        self, t: float, x: FloatArray, other: FloatArray, thresholds: TcasThresholds, passing: Passing | None
    ) -> None:
        chosen = choose_turn(x, other, thresholds.hmd, FIRST_RESPONSE.delay, passing)
        self.turn = None if chosen is None else TurnAdvisory(*chosen, issued=t)
        self.turn_advisories += chosen is not None


def _states(own: ArrayLike, intruder: ArrayLike) -> tuple[FloatArray, FloatArray]:
    states = checked("own", own, FINITE), checked("intruder", intruder, FINITE)
    if any(state.shape != (6,) for state in states):
        raise ValueError("own and intruder must be six numbers each")
    return states
