"""The real world through the protocol of a world: the autopilot's telemetry and mission, and what the inputs heard."""

import math
from collections.abc import Sequence

import numpy as np

from wideberth.live.autopilot import Autopilot
from wideberth.live.inputs import Input
from wideberth.types import Maneuver, Mission, Ownship, Scan

MISSION_WAIT = 10.0
"""How long a mission is waited for after the first telemetry, before straight flight is assumed, s."""

_ASSUMED_FOR = 5.0  # s that straight flight is assumed from one place on
_AHEAD = 600.0  # s of it
_SLOWEST = 1.0  # m/s


class LiveWorld:
    """The real world.

    Nothing is sensed before the autopilot has told where it is and what it is to fly: without either nothing can be
    said of the traffic, least of all that it is clear. Where no mission comes within `MISSION_WAIT`, straight flight is
    assumed: threats are told, but nothing is commanded. Afterwards the last telemetry and the last mission are given on
    for as long as no new ones come; whoever takes them sees by their times how old they are.

    Parameters
    ----------
    autopilot : Autopilot
    inputs : sequence of Input
    """

    def __init__(self, autopilot: Autopilot, inputs: Sequence[Input]) -> None:
        self._autopilot = autopilot
        self._inputs = tuple(inputs)
        self._ownship: Ownship | None = None
        self._mission: Mission | None = None
        self._t_telemetry = math.inf
        self._t = -math.inf
        self._discarded = 0

    @property
    def inputs(self) -> tuple[Input, ...]:
        """The inputs."""
        return self._inputs

    @property
    def counters(self) -> dict[str, int]:
        """Packets that came before anything could be made of them."""
        return {"packets before the first step": self._discarded} if self._discarded else {}

    def missing(self, t: float) -> str:
        """Return what is still missing before anything can be sensed, in words; empty where nothing is."""
        self._listen(t)
        lacking = [
            what for what, have in (("telemetry", self._ownship), ("the mission", self._mission)) if have is None
        ]
        return f"waiting for {' and '.join(lacking)}" if lacking else ""

    def discard(self, t: float) -> None:
        """Forget what the inputs heard up to time `t`, s: nobody knows yet where the ownship is."""
        for each in self._inputs:
            while each.drain():
                pass
            self._discarded += len(each.take_arrivals())
            each.forget(t)

    @property
    def mission(self) -> Mission:
        """The mission with its progress.

        Raises
        ------
        ValueError
            Before there is one.
        """
        if self._mission is None:
            raise ValueError("there is no mission yet")
        return self._mission

    @property
    def done(self) -> bool:
        """Whether the last waypoint of the mission is reached."""
        mission = self._mission
        return mission is not None and not mission.assumed and mission.index >= len(mission.waypoints)

    def _listen(self, t: float) -> None:
        """Take over what the autopilot says."""
        ownship, mission = self._autopilot.ownship(t), self._autopilot.mission()
        self._ownship = self._ownship if ownship is None else ownship
        if self._ownship is not None:
            self._t_telemetry = min(self._t_telemetry, t)
        if mission is not None:
            self._mission = mission
        elif self._ownship is not None and t - self._t_telemetry >= MISSION_WAIT:
            before = self._mission
            if before is None or (before.assumed and t - before.t_start >= _ASSUMED_FOR):
                self._mission = straight_on(t, self._ownship)

    def sense(self, t: float) -> tuple[Ownship, list[Scan]]:
        """Return the latest telemetry and what the inputs heard since the last call, late scans with their own times.

        Raises
        ------
        ValueError
            If there is no telemetry yet, or `t` does not lie after the last time.
        """
        if not t > self._t:
            raise ValueError(f"time cannot run back from {self._t:.3f} s to {t:.3f} s")
        self._listen(t)
        if self._ownship is None:
            raise ValueError("there is no telemetry yet")
        self._t = t
        scans: list[Scan] = []
        for each in self._inputs:
            while each.drain():
                pass
            scans += each.sense(t, self._ownship)
        return self._ownship, scans

    def actuate(self, t: float, maneuver: Maneuver | None) -> None:
        """Ask the autopilot to fly a maneuver, at most while it is valid; None: the mission.

        Where the mission is assumed there is nothing to come back to: a maneuver is advice alone.
        """
        assumed = self._mission is not None and self._mission.assumed
        if maneuver is not None and (assumed or t >= maneuver.valid_until):
            maneuver = None
        self._autopilot.fly(t, maneuver)


def straight_on(t: float, ownship: Ownship) -> Mission:
    """Return the mission of flying straight on and level from where the ownship is at time `t`, s."""
    north, east = (float(v) for v in ownship.velocity[:2])
    speed = math.hypot(north, east)
    course = math.atan2(east, north)
    speed = max(speed, _SLOWEST)
    end = ownship.position + _AHEAD * speed * np.array([math.cos(course), math.sin(course), 0.0])
    return Mission(np.array([ownship.position, end]), np.full(2, speed), t, assumed=True)


def changed(before: Mission | None, mission: Mission) -> bool:
    """Return whether a mission is another than the one before, its progress aside."""
    return (
        before is None
        or before.t_start != mission.t_start
        or before.assumed != mission.assumed
        or not np.array_equal(before.waypoints, mission.waypoints)
        or not np.array_equal(before.speeds, mission.speeds)
    )
