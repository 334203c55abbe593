"""The waypoint control function (thesis 4.4): when to plan a path, which waypoints stay, and the way back."""

import itertools
import math
from collections.abc import Mapping, Sequence

import numpy as np

from wideberth.avoidance import decision_kernels as dk
from wideberth.avoidance.keep_out.volumes import keep_out_arrays
from wideberth.avoidance.local_level import ground_state
from wideberth.avoidance.waypoint_paths.astar import Limits, cell_size
from wideberth.avoidance.waypoint_paths.config import AStarChainConfig, AStarConfig
from wideberth.avoidance.waypoint_paths.first_turn_kernels import inertia_of
from wideberth.avoidance.waypoint_paths.path_planner import JudgedPath, PathPlanner, path_length
from wideberth.avoidance.waypoint_paths.prediction import Prediction, Predictor
from wideberth.avoidance.waypoint_paths.work import Work
from wideberth.avoidance.wording import describe_maneuver
from wideberth.conflict.cylinder_kernels import near_now
from wideberth.types import FloatArray, Maneuver, Mission, Ownship, Threat, Track
from wideberth.vehicles import kernels as vk

_EPSILON = 1e-6  # s, so that a period of 0.1 s is met by steps of 0.1 s
_SAME_PLACE = 1.0  # m
_HOVERING = 0.3  # of the wanted speed: slower than this the ownship may begin in any direction
_LATE = 1.5  # a maneuver may take so many times its planned time
_DETECTIONS_LEAST = 3  # in a row, however soon a cylinder is entered
_SHORTER = 0.98  # of the way left: what is shorter by less is not worth a change
_CORNER_MAX = math.radians(120.0)  # paths have no sharper ones
_MUCH_SHORTER = 0.9  # of a path that is free and follows from the one flown: another sense costs seconds


class AStarPlanner:
    """A* with the waypoint control function, as a part: tracks in, a maneuver with its reason out.

    While flying the mission its remaining waypoints are judged, during a maneuver those of the maneuver not yet visited
    and the mission after them. `detections_needed` consecutive conflicts begin a maneuver or replace the rest of it.
    A maneuver ends at the mission, or once the straight way back has been free for a while; it is replaced only by a
    path that meets less.

    Parameters
    ----------
    config : AStarConfig
    vehicle : ndarray
        Parameters of the ownship's point mass (`vehicles.kernels`): its limits shape the grid.
    """

    Config: type[AStarConfig] = AStarConfig
    _with_chain = False

    def __init__(self, config: AStarConfig, vehicle: FloatArray) -> None:
        self._config, self._vehicle = config, vehicle
        self._free = dk.free_of_capture(vehicle)
        self._predictor = Predictor(config)
        keep_outs = keep_out_arrays(config.keep_out, config.keep_out_margin_m)
        self._planner = PathPlanner(config, keep_outs, self._with_chain)
        self._t_decided = -math.inf
        self._counts = {"planned": 0, "replanned": 0, "kept": 0, "least_bad": 0, "returned": 0, "no_waypoints_left": 0}
        self._forget()

    @property
    def counters(self) -> Mapping[str, int]:
        """What was decided how often, and what was wrong with tracks."""
        return {**self._counts, **self._predictor.counters}

    def _forget(self) -> None:
        self._maneuver: Maneuver | None = None
        self._path = np.empty((0, 3))  # of the maneuver, from where it was chosen
        self._index = 0  # its waypoint that is flown to; those before are visited
        self._rejoin = 0  # the mission's waypoint after it
        self._cell = 0.0
        self._detections = 0
        self._free_since = math.inf  # when the straight way back was first seen to be free

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
            What was decided, in words.
        """
        if t - self._t_decided < self._config.decision_period_s - _EPSILON:
            return self._maneuver, ()
        self._t_decided = t
        prediction, events = self._predictor.predict(t, ownship, tracks)
        if mission.index >= len(mission.waypoints):
            self._counts["no_waypoints_left"] += 1
            self._forget()
            return None, events
        x = ground_state(ownship)
        limits = self._limits(x, mission)
        if self._maneuver is not None:
            self._index = int(dk.advance_index(x, self._path, self._index, self._free))
            if self._index >= len(self._path) or t >= self._maneuver.valid_until:
                self._forget()
                events = (*events, "avoidance waypoints flown: return to the mission")
        course = self._course(x, limits)
        kept = self._planner.judge(self._remaining(x, mission), course, limits, prediction, self._cell)
        if not self._is_conflict(kept, ownship, prediction):
            self._detections = 0
            return self._maneuver, (*events, *self._cut_short(t, x, limits, prediction, mission))
        self._detections += 1
        self._free_since = math.inf
        if self._detections < self._needed(kept) or not self._may_replace(t, kept):
            return self._maneuver, events
        self._detections = 0
        return self._plan(t, x, limits, prediction, threats, mission, kept, events)

    def _limits(self, x: FloatArray, mission: Mission) -> Limits:
        p, config = self._vehicle, self._config
        wanted = float(mission.speeds[min(mission.index, len(mission.speeds) - 1)])
        speed = min(max(wanted, p[vk.P_SPEED_MIN], 0.1), p[vk.P_SPEED_MAX])
        return Limits(
            speed=speed,
            radius=vk.turn_radius(speed, config.bank_share * p[vk.P_BANK_MAX]),
            climb_max=config.climb_share * p[vk.P_CLIMB_MAX],
            sink_max=config.climb_share * p[vk.P_SINK_MAX],
            inertia=inertia_of(x, p, speed),
        )

    def _remaining(self, x: FloatArray, mission: Mission) -> FloatArray:
        """Return what is left to fly: from here, the maneuver's waypoints not yet visited, and the mission's."""
        if self._maneuver is None:
            return _distinct(x[:3], mission.waypoints[mission.index :])
        return _distinct(x[:3], self._corner(x), self._path[self._index :], mission.waypoints[self._rejoin :])

    def _corner(self, x: FloatArray) -> FloatArray:
        """Return the place (at most one) where the course meets the leg being joined.

        A corner is passed where its turn begins. To the waypoint after it the way is straight only beyond the turn,
        and the chord across it may lead through a cylinder that the turn keeps clear of.
        """
        nowhere = np.empty((0, 3))
        if self._index < 2:
            return nowhere
        before, after = self._path[self._index - 1], self._path[self._index]
        leg = after - before
        length = math.hypot(leg[0], leg[1])
        if length < _SAME_PLACE:
            return nowhere
        along = ((x[0] - before[0]) * leg[0] + (x[1] - before[1]) * leg[1]) / length
        aside = (leg[0] * (x[1] - before[1]) - leg[1] * (x[0] - before[0])) / length
        turn = vk.wrap_angle(math.atan2(leg[1], leg[0]) - float(x[4]))
        if aside * turn <= 0.0 or abs(turn) > _CORNER_MAX:
            return nowhere  # the course does not lead to the leg
        share = max(0.0, (along + aside / math.tan(turn)) / length)
        return (before + share * leg)[np.newaxis] if share < 0.5 else nowhere

    def _is_conflict(self, path: JudgedPath, ownship: Ownship, prediction: Prediction) -> bool:
        """Return whether a cylinder is entered, by somebody near or soon (thesis alg. 3, line 19)."""
        config = self._config
        own = np.array(ownship.position, float)
        return any(
            (
                entry <= config.detection_time_s
                or (entry < math.inf and near_now(own, row, config.detection_distance_m, config.detection_height_m))
            )
            and not prediction.doubts[i]
            and self._is_known(i, entry, prediction)
            for i, (entry, row) in enumerate(zip(path.entries, prediction.rows, strict=True))
        )

    def _is_known(self, i: int, entry: float, prediction: Prediction) -> bool:
        """Return whether it is known well enough where an intruder will be, or there is no time to learn more.

        For one that is avoided already there is until it is urgent: what is flown was chosen against it, and changing
        the sense costs seconds.
        """
        config = self._config
        avoided = self._maneuver is not None and prediction.owners[i].id in self._maneuver.threat_ids
        if entry <= (config.urgent_s if avoided else config.decide_by_s):
            return True
        level, _ = prediction.sigmas_at(i, entry)
        return level <= config.known_share * config.separation_radius_m and self._is_height_known(i, entry, prediction)

    def _is_height_known(self, i: int, t: float, prediction: Prediction) -> bool:
        """Return whether it is known well enough how high an intruder will be in `t` seconds."""
        config = self._config
        _, vertical = prediction.sigmas_at(i, t)
        return config.constant_altitude or vertical <= config.known_share * 0.5 * config.separation_height_m

    def _cut_short(
        self, t: float, x: FloatArray, limits: Limits, prediction: Prediction, mission: Mission
    ) -> tuple[str, ...]:
        """Replace the rest of a maneuver by the straight way back to the mission, once that has been free for long."""
        maneuver = self._maneuver
        if maneuver is None or t - maneuver.t < self._config.return_after_s or len(self._path) - self._index < 2:
            return ()
        goal, rejoin = self._goals(x, limits, mission)[0]
        left = path_length(_distinct(x[:3], self._path[self._index :], mission.waypoints[self._rejoin :]))
        rest = mission.waypoints[rejoin:]
        back = None
        # A path seems free of one whose height is unknown, too.
        known = all(
            self._is_height_known(i, self._config.decide_by_s, prediction)
            for i, owner in enumerate(prediction.owners)
            if owner.id in maneuver.threat_ids
        )
        if known and path_length(_distinct(x[:3], goal[np.newaxis], rest)) < _SHORTER * left:
            back = self._planner.way_back(x[:3].copy(), self._course(x, limits), goal, rest, limits, prediction)
        if back is None:
            self._free_since = math.inf
            return ()
        self._free_since = min(self._free_since, t)
        if t - self._free_since < self._config.return_after_s - _EPSILON:
            return ()
        self._counts["returned"] += 1
        event = "the straight way back to the mission is free"
        self._fly(t, back, rejoin, event, maneuver.threat_ids)
        return (event,)

    def _course(self, x: FloatArray, limits: Limits) -> float:
        """Return the course that a path has to begin with, rad; NaN where the ownship hardly moves."""
        return float(x[4]) if x[3] > _HOVERING * limits.speed else math.nan

    def _needed(self, kept: JudgedPath) -> int:
        """Return how many detections in a row are waited for: fewer, the sooner a cylinder is entered."""
        needed = self._config.detections_needed
        if kept.entry >= self._config.urgent_s:
            return needed
        return max(min(needed, _DETECTIONS_LEAST), round(needed * kept.entry / self._config.urgent_s))

    def _may_replace(self, t: float, kept: JudgedPath) -> bool:
        maneuver = self._maneuver
        return maneuver is None or t - maneuver.t >= self._config.settle_s or kept.entry <= self._config.urgent_s

    def _plan(
        self,
        t: float,
        x: FloatArray,
        limits: Limits,
        prediction: Prediction,
        threats: Sequence[Threat],
        mission: Mission,
        kept: JudgedPath,
        events: tuple[str, ...],
    ) -> tuple[Maneuver | None, tuple[str, ...]]:
        course, work = self._course(x, limits), Work(self._config.work_max)
        followed = None
        if self._maneuver is not None:
            points = _distinct(x[:3], self._path[self._index :])
            followed = self._planner.follow(points, course, self._cell, limits, prediction, work)
        new, goal, rejoin = self._new_path(x, course, limits, prediction, mission, followed, work)
        ahead = self._planner.judge(_up_to(kept, goal), course, limits, prediction, kept.cell)
        if self._maneuver is not None and self._maneuver.least_bad and not (new is not None and new.free):
            # Between paths that are not free the one begun is worth more: changing the sense takes time.
            same = followed if followed is not None and followed.weight < ahead.weight else ahead
            if new is None or new.weight > self._config.replace_share * same.weight:
                new, rejoin = same, self._rejoin
        if new is None or new.weight >= ahead.weight:
            # Nothing better than flying on; the conflict may lie beyond the goal, and is left for when that is passed.
            if self._maneuver is not None or ahead.free:
                self._counts["kept"] += 1
                return self._maneuver, events
            new = ahead  # the first is said
        return self._adopt(t, x, new, rejoin, prediction, threats, kept, events)

    def _new_path(
        self,
        x: FloatArray,
        course: float,
        limits: Limits,
        prediction: Prediction,
        mission: Mission,
        followed: JudgedPath | None,
        work: Work,
    ) -> tuple[JudgedPath | None, FloatArray, int]:
        """Return the path to fly, its goal, and the mission's waypoint after it.

        A free one that follows from what is flown is taken if it is not too long, or unless a new one is much shorter.
        """
        (goal, rejoin), *others = self._goals(x, limits, mission)
        follows = followed is not None and followed.free
        direct = math.dist(x[:3], goal)
        if followed is not None and follows and followed.length <= self._config.length_ratio_max * direct:
            return followed, goal, self._rejoin
        part = work.split(0.5 if others and not follows else 1.0)
        new = self._planner.plan(x[:3].copy(), course, goal, limits, prediction, part)
        free = new is not None and new.free
        if followed is not None and follows:
            shorter = new is not None and free and new.length < _MUCH_SHORTER * followed.length
            return (new, goal, rejoin) if shorter else (followed, goal, self._rejoin)
        if others and not free:
            # Somebody may cover the next waypoint: then it is given up for the one after it.
            work.join(part)
            farther = self._planner.plan(x[:3].copy(), course, others[0][0], limits, prediction, work)
            if farther is not None and (new is None or farther.weight < new.weight):
                return farther, *others[0]
        return new, goal, rejoin

    def _goals(self, x: FloatArray, limits: Limits, mission: Mission) -> list[tuple[FloatArray, int]]:
        """Return where the way back may end on the mission, each with the mission's waypoint after it.

        The next waypoint that is at least a cell away, and the one after it; or the point of the way to them where that
        leaves the grid.
        """
        cell = cell_size(self._config.cell_m, limits)
        reach = self._config.reach_cells * cell
        n = len(mission.waypoints)
        along, before = 0.0, x[:3]
        goals: list[tuple[FloatArray, int]] = []
        for k in range(mission.index, n):
            waypoint = mission.waypoints[k]
            leg = math.dist(before, waypoint)
            if along + leg > reach:
                return [*goals, (before + (reach - along) / leg * (waypoint - before), k)]
            along, before = along + leg, waypoint
            if k == n - 1 or math.hypot(*(waypoint[:2] - x[:2])) >= cell:
                goals.append((waypoint, k + 1))
            if len(goals) == 2:
                break
        return goals

    def _adopt(
        self,
        t: float,
        x: FloatArray,
        path: JudgedPath,
        rejoin: int,
        prediction: Prediction,
        threats: Sequence[Threat],
        kept: JudgedPath,
        events: tuple[str, ...],
    ) -> tuple[Maneuver, tuple[str, ...]]:
        order = sorted(
            np.flatnonzero((kept.entries < math.inf) & ~prediction.doubts),
            key=lambda i: (kept.entries[i], prediction.owners[i].id),
        )
        involved = list(dict.fromkeys(prediction.owners[i].id for i in order))
        first = prediction.owners[order[0]] if order else None
        courses = [
            vk.wrap_angle(math.atan2(b[1] - a[1], b[0] - a[0]) - x[4]) for a, b in itertools.pairwise(path.points)
        ][:3]
        reason = describe_maneuver(
            label=first.label if first else None,
            threat=next((threat for threat in threats if first and threat.track_id == first.id), None),
            others=max(0, len(involved) - 1),
            course_change=max(courses, key=abs),
            height_change=max((float(x[2] - point[2]) for point in path.points[1:]), key=abs),
            least_bad=not path.free,
        )
        self._counts["planned" if self._maneuver is None else "replanned"] += 1
        self._counts["least_bad"] += not path.free
        return self._fly(t, path, rejoin, reason, tuple(involved)), (*events, reason)

    def _fly(self, t: float, path: JudgedPath, rejoin: int, reason: str, threat_ids: tuple[str, ...]) -> Maneuver:
        self._maneuver = Maneuver(
            t=t,
            waypoints=path.points[1:].copy(),
            times=t + path.arrivals[1:],
            reason=reason,
            valid_until=t + _LATE * float(path.arrivals[-1]) + 5.0,
            threat_ids=threat_ids,
            least_bad=not path.free,
        )
        self._path, self._index, self._rejoin, self._cell = path.points, 1, rejoin, path.cell
        self._free_since = math.inf
        return self._maneuver


class AStarChainPlanner(AStarPlanner):
    """The same with the chain (thesis 4.4): A* at the first detection, afterwards the chain goes on from where it was.

    A* is only searched again where the chain leads to no free path.
    """

    Config = AStarChainConfig
    _with_chain = True


def _distinct(start: FloatArray, *parts: FloatArray) -> FloatArray:
    """Return the places of a path without those repeated; at least two."""
    points = [np.array(start, float)]
    for place in itertools.chain.from_iterable(parts):
        if math.dist(place, points[-1]) > _SAME_PLACE:
            points.append(np.array(place, float))
    if len(points) == 1:
        points.append(points[0].copy())
    return np.array(points)


def _up_to(path: JudgedPath, goal: FloatArray) -> FloatArray:
    """Return the part of a path up to the place of it that is nearest to a goal."""
    best, at, end = math.inf, 0, path.points[0]
    for i, (a, b) in enumerate(itertools.pairwise(path.points)):
        leg = b - a
        length2 = float(leg @ leg)
        s = min(1.0, max(0.0, float((goal - a) @ leg) / length2)) if length2 > 0.0 else 0.0
        place = a + s * leg
        distance = math.dist(place, goal)
        if distance < best - _EPSILON:
            best, at, end = distance, i, place
    return _distinct(path.points[0], path.points[1 : at + 1], end[np.newaxis])
