"""The vertical controllers as planners: tracks in, a path that climbs or descends along the mission out."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from wideberth.avoidance import decision_kernels as dk
from wideberth.avoidance.cas.settings import REASONS
from wideberth.avoidance.local_level import ground_state
from wideberth.avoidance.vertical import vertical_kernels as vk
from wideberth.avoidance.vertical.config import BangBangConfig, ContinuousConfig, VerticalConfig
from wideberth.avoidance.vertical.flight_ahead import STEP, Flight, FlightAhead, Held
from wideberth.avoidance.vertical.intruders import Intruders, IntruderViews
from wideberth.avoidance.vertical.way_ahead import few_points
from wideberth.avoidance.wording import describe_maneuver
from wideberth.types import FloatArray, Maneuver, Mission, Ownship, Threat, Track

_EPSILON = 1e-6  # s, so that a period of 0.1 s is met by steps of 0.1 s
_CHORD = 0.2  # m, by which a path may be off the flight ahead
_BACK = 1.0  # m from the mission's altitude: the maneuver is over
_SLACK = 5.0  # s that a maneuver may take longer than planned
_RENEW = 10.0  # s before its end a path that still avoids is replaced
_SIDE_MEMORY = 15.0  # s for which the side of somebody who is no longer met is remembered


class VerticalPlanner:
    """Avoids by climbing or descending along the mission (CAS thesis, 4.3).

    The controller is flown ahead against the tracks, which go straight on: avoidance, return by its own criterion, and
    the way back to the mission's altitude are one path. It is kept until the one that the controller would fly now
    departs from it noticeably, or leads less into a zone. On which side each intruder is passed is kept too.

    Parameters
    ----------
    config : VerticalConfig
    vehicle : ndarray
        Parameters of the ownship's point mass (`vehicles.kernels`).
    """

    Config: type[VerticalConfig]

    def __init__(self, config: VerticalConfig, vehicle: FloatArray) -> None:
        self._config = config
        self._free = dk.free_of_capture(vehicle)
        self._ahead = FlightAhead(config, vehicle)
        self._views = IntruderViews(config)
        # Limits of the return that the mission's own guidance does not know.
        self._slow_return = config.return_climb_rate_max_mps is not None or config.return_sink_rate_max_mps is not None
        self._t_decided = -math.inf
        self._counts = dict.fromkeys(
            ("planned", "replanned", "least_bad", "reversed", "blocked", "no_waypoints_left", "clock"), 0
        )
        self._held = Held()
        self._last_met: dict[str, float] = {}  # by track
        self._forget()

    @property
    def counters(self) -> Mapping[str, int]:
        """What was decided how often, and what was wrong with tracks and the clock."""
        return {**self._counts, **self._views.counters}

    def _forget(self) -> None:
        self._maneuver: Maneuver | None = None
        self._path = np.empty((0, 3))  # of the maneuver, from where it was chosen
        self._index = 0  # its waypoint that is flown to
        self._down = np.empty(0)  # of the flight ahead that it was made of
        self._held = Held(sides=self._held.sides)
        self._t_begun = math.nan
        self._ended = False  # avoidance is over, and the rest of the path leads back
        self._in_a_row = 0  # decisions to avoid, or during a maneuver not to
        self._doubts = 0  # decisions in a row that the path should be another one

    def decide(
        self, t: float, ownship: Ownship, tracks: Sequence[Track], threats: Sequence[Threat], mission: Mission
    ) -> tuple[Maneuver | None, tuple[str, ...]]:
        """Decide what to fly; between decisions the maneuver stays as it is.

        Parameters
        ----------
        t : float
            Now, s.
        ownship : Ownship
        tracks : sequence of Track
        threats : sequence of Threat
            One for every track; used for the words only.
        mission : Mission

        Returns
        -------
        maneuver : Maneuver or None
            None: fly the mission.
        events : tuple of str
            Start, reason, command and end of each avoidance (CAS thesis, 3.3), and what was wrong with the input.
        """
        if 0.0 <= t - self._t_decided < self._config.decision_period_s - _EPSILON:
            return self._maneuver, ()
        said = []
        if t < self._t_decided:
            self._counts["clock"] += 1
            said.append(f"the clock went back by {self._t_decided - t:.1f} s: avoidance begins anew")
            self._forget()
            self._held, self._last_met = Held(), {}
        self._t_decided = t
        if mission.index >= len(mission.waypoints):
            self._counts["no_waypoints_left"] += 1
            self._forget()
            return None, tuple(said)
        own = np.array([*ownship.position, *ownship.velocity], float)
        if self._config.delay_compensation == "timestamp":
            own[:3] += own[3:] * (t - ownship.t)
        intruders, wrong = self._views.step(t, own, tracks)
        self._forget_sides(t)
        places, corners = self._ahead.way(own, mission)
        if self._maneuver is None:
            chosen = self._watch(own, intruders, places, wrong)
        else:
            self._index = int(dk.advance_index(ground_state(ownship), self._path, self._index, self._free))
            chosen = self._go_on(t, own, intruders, places, self._maneuver, wrong)
        if chosen is not None:
            wrong.append(self._adopt(t, own, chosen, intruders, places, corners, threats))
        return self._maneuver, (*said, *wrong)

    def _watch(self, own: FloatArray, intruders: Intruders, places: FloatArray, said: list[str]) -> Flight | None:
        """Return the flight that begins a maneuver, where the controller avoids often enough."""
        if not self._ahead.sides(own, intruders, self._held)[1].any():
            self._in_a_row = 0
            return None
        flight = self._ahead.best(own, intruders, self._held, places, reverse=True)
        self._in_a_row = self._in_a_row + 1 if flight.avoids_now else 0
        if self._in_a_row < self._config.detections_needed:
            return None
        if flight.blocked:
            self._counts["blocked"] += 1
            if self._in_a_row == self._config.detections_needed:
                said.append("avoidance is blocked: keep-out volumes above and below")
            return None
        return flight

    def _go_on(
        self,
        t: float,
        own: FloatArray,
        intruders: Intruders,
        places: FloatArray,
        maneuver: Maneuver,
        said: list[str],
    ) -> Flight | None:
        """Return the flight that replaces the path being flown, if any; or end the maneuver."""
        config = self._config
        settled = t - maneuver.t >= config.settle_s
        flight = self._ahead.best(own, intruders, self._held, places, reverse=settled)
        self._hold(t, flight, intruders)
        self._in_a_row = 0 if flight.avoids else self._in_a_row + 1
        over = self._index >= len(self._path) or t >= maneuver.valid_until
        flown = self._still_flown(t, flight, maneuver, places)
        until = flight.end + 1
        departs = float(np.abs(flown[:until, vk.DOWN] - flight.ahead[:until, vk.DOWN]).max())
        if not flight.avoids:
            if self._in_a_row >= config.detections_needed or over:
                return self._end(t, own, flight, places, over, departs, said)
            return None
        self._ended = False
        if flight.blocked:
            self._counts["blocked"] += 1
            if over:
                self._forget()
            return None
        kept = self._ahead.judged(flown, (flight.sides, flight.met), intruders, places)
        worse = kept.inside > flight.inside and departs > _BACK and (settled or kept.entry <= config.urgent_s)
        short = maneuver.times[-1] - t < _RENEW and flight.end == len(places) - 1
        self._doubts = self._doubts + 1 if worse or (settled and departs > config.path_tolerance_m) else 0
        return flight if over or short or self._doubts >= config.detections_needed else None

    def _hold(self, t: float, flight: Flight, intruders: Intruders) -> None:
        """Remember what the controller decided, and the sides of those that are met."""
        now, held = flight.ahead[0], self._held
        held.avoiding, held.command = flight.avoids_now, float(now[vk.COMMAND])
        held.target = intruders.tracks[int(now[vk.TARGET])].id if now[vk.TARGET] >= 0.0 else None
        for track, side, met in zip(intruders.tracks, flight.sides, flight.met, strict=True):
            if met:
                self._counts["reversed"] += int(held.sides.get(track.id, side) != side)
                held.sides[track.id] = float(side)
                self._last_met[track.id] = t

    def _forget_sides(self, t: float) -> None:
        for name in [name for name, last in self._last_met.items() if t - last > _SIDE_MEMORY]:
            del self._last_met[name], self._held.sides[name]

    def _still_flown(self, t: float, flight: Flight, maneuver: Maneuver, places: FloatArray) -> FloatArray:
        """Return what is left of the path being flown, and the mission after it, as a flight ahead (n, N_AHEAD)."""
        times = t - maneuver.t + STEP * np.arange(len(places))
        left = np.interp(times, STEP * np.arange(len(self._down)), self._down)
        flown = flight.ahead.copy()
        flown[:, vk.DOWN] = np.where(times <= maneuver.times[-1] - maneuver.t, left, places[:, vk.WANTED])
        return flown

    def _end(
        self,
        t: float,
        own: FloatArray,
        flight: Flight,
        places: FloatArray,
        over: bool,
        departs: float,
        said: list[str],
    ) -> Flight | None:
        """End an avoidance: say so, and fly the rest of the path back where that is what guidance would do."""
        if not self._ended:
            said.append(f"avoidance ends after {t - self._t_begun:.0f} s: return to the mission")
            self._ended = True
        back = abs(own[2] - places[0, vk.WANTED]) < _BACK
        if not back and departs > self._config.path_tolerance_m and self._slow_return:
            return flight
        if back or over or departs > self._config.path_tolerance_m:
            self._forget()
        return None

    def _adopt(
        self,
        t: float,
        own: FloatArray,
        flight: Flight,
        intruders: Intruders,
        places: FloatArray,
        corners: FloatArray,
        threats: Sequence[Threat],
    ) -> str:
        """Fly a flight from now on, and return it in words."""
        first = self._maneuver is None
        if first:
            self._t_begun = t
        self._counts["planned" if first else "replanned"] += 1
        self._counts["least_bad"] += flight.inside > 0.0
        self._hold(t, flight, intruders)
        n = flight.end + 1
        times, down = STEP * np.arange(n, dtype=np.float64), flight.ahead[:n, vk.DOWN].copy()
        at = few_points(times, down, corners, _CHORD)
        columns = (places[:n, vk.NORTH], places[:n, vk.EAST], down)
        self._path = np.column_stack([np.interp([0.0, *at], times, column) for column in columns])
        self._index, self._down, self._in_a_row, self._doubts = 1, down, 0, 0
        reason = self._describe(own, flight, intruders, places, threats)
        self._maneuver = Maneuver(
            t=t,
            waypoints=self._path[1:].copy(),
            times=t + at,
            reason=reason,
            valid_until=t + float(at[-1]) + _SLACK,
            threat_ids=tuple(track.id for track in self._involved(flight, intruders, places)),
            least_bad=flight.inside > 0.0,
        )
        why = REASONS[int(next((r for r in flight.ahead[:, vk.REASON] if r), 0))]
        fastest = float(np.abs(flight.ahead[:n, vk.RATE]).max())
        what = "begins" if first else "changes"
        return f"avoidance {what} ({why}): {reason}, at up to {fastest:.1f} m/s"

    def _involved(self, flight: Flight, intruders: Intruders, places: FloatArray) -> list[Track]:
        """Return who is avoided: the target first, and all whose zone the mission's altitude would enter."""
        level = flight.ahead.copy()
        level[:, vk.DOWN] = places[:, vk.WANTED]
        least = self._ahead.judged(level, (flight.sides, flight.met), intruders, places).least
        rows = [int(row) for row in flight.ahead[:, vk.TARGET] if row >= 0.0][:1]
        rows += [int(j) for j in np.argsort(least) if least[j] < 1.0 and j not in rows]
        return [intruders.tracks[j] for j in rows]

    def _describe(
        self, own: FloatArray, flight: Flight, intruders: Intruders, places: FloatArray, threats: Sequence[Threat]
    ) -> str:
        involved = self._involved(flight, intruders, places)
        first = involved[0] if involved else None
        away = flight.ahead[:, vk.DOWN] - places[:, vk.WANTED]
        return describe_maneuver(
            label=first.label if first else None,
            threat=next((threat for threat in threats if first and threat.track_id == first.id), None),
            others=max(0, len(involved) - 1),
            course_change=0.0,
            height_change=float(own[2] - flight.ahead[int(np.argmax(np.abs(away))), vk.DOWN]),
            least_bad=flight.inside > 0.0,
        )


class BangBangPlanner(VerticalPlanner):
    """Full climb or descent, begun as late as the dynamics allow (CAS thesis, 4.3.1)."""

    Config = BangBangConfig


class ContinuousPlanner(VerticalPlanner):
    """The vertical velocity that is tangent to the protected zone, again at each step (CAS thesis, 4.3.2)."""

    Config = ContinuousConfig
