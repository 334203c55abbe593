"""The path from here to a goal: A*, then the chain over it, each checked in fine time; the best of them."""

import itertools
import math
from dataclasses import dataclass

import numpy as np

from wideberth.avoidance.keep_out.kernels import KeepOuts, path_enters
from wideberth.avoidance.waypoint_paths import first_turn_kernels as ftk
from wideberth.avoidance.waypoint_paths.astar import FoundPath, GridSearch, Limits
from wideberth.avoidance.waypoint_paths.chain import Chain
from wideberth.avoidance.waypoint_paths.config import AStarConfig
from wideberth.avoidance.waypoint_paths.intruder_kernels import path_inside
from wideberth.avoidance.waypoint_paths.limits_kernels import SHARP_FIRST, path_flaws
from wideberth.avoidance.waypoint_paths.prediction import Prediction
from wideberth.avoidance.waypoint_paths.refinement import Refinement
from wideberth.types import FloatArray
from wideberth.vehicles.kernels import wrap_angle

_CHAIN_SHARE, _REFINEMENT_SHARE = 2, 4  # of their budgets, what is left, each time
_SHORT = 1.05  # times the direct way: no climb can be much shorter
_CHEAP_SHARE = 3  # of what is left of the budget: searches with cheap climbs look at many levels
_CHEAP = 0.1  # of what a climb costs more than the way: next to a long detour it is worth it
# One search after the other: factors on k_r, on the cells' size, on the spreads of the predictions, and on the cost of
# climbs.
_TRIES = (
    (1.0, 1.0, 1.0, 1.0), (0.1, 1.0, 1.0, _CHEAP), (0.1, 1.0, 0.5, 1.0), (0.1, 1.0, 0.5, _CHEAP),
    (0.0, 1.0, 0.0, 1.0), (0.0, 0.5, 0.0, 1.0), (0.0, 0.5, 0.0, _CHEAP),
)  # fmt: skip

_ESCAPE_S = 10.0  # that an escape goes on for
_ESCAPE_TURNS = np.radians(np.arange(-150.0, 151.0, 30.0)).tolist()
_TURN_METRES = 20.0  # of way that a radian of turn is worth
_LATE_SHARE = 0.2  # of a second in a cylinder later than `decide_by_s`


@dataclass(frozen=True, slots=True)
class JudgedPath:
    """A path from the ownship to its goal, and what it meets.

    Attributes
    ----------
    points, times : ndarray, shape (n, 3), (n,)
        Local NED, m, the first the ownship; s from now, along the legs.
    arrivals : ndarray, shape (n,)
        When the places are reached with the turn that begins the path, s from now; the first means nothing.
    length : float
        As it is flown, with the turn that begins it, m.
    turn : float
        From the ownship's course to the first leg, rad, not negative.
    cell : float
        Of the grid it comes from, m.
    inside : float
        Seconds in collision cylinders (with the trigger's margin), all together.
    weight : float
        The same, with those that come late worth less: there is time to change the path, and to learn more.
    entry : float
        When it first enters one, s from now, inf if never.
    entries : ndarray, shape (m,)
        The same for each predicted intruder.
    complete : bool
        Whether it leads to the goal.
    """

    points: FloatArray
    times: FloatArray
    arrivals: FloatArray
    length: float
    turn: float
    cell: float
    inside: float
    weight: float
    entry: float
    entries: FloatArray
    complete: bool = True

    @property
    def free(self) -> bool:
        """Whether it meets nobody."""
        return self.inside == 0.0


def path_length(points: FloatArray) -> float:
    """Return the length of a path of places (n, 3), m."""
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


class PathPlanner:
    """Paths of one configuration.

    Parameters
    ----------
    config : AStarConfig
    keep_outs : KeepOuts
    with_chain : bool
    """

    def __init__(self, config: AStarConfig, keep_outs: KeepOuts, with_chain: bool) -> None:
        self._config, self._keep_outs = config, keep_outs
        self._search = GridSearch(config, keep_outs)
        self._chain = Chain(config, keep_outs) if with_chain else None
        self._refinement = Refinement(config, keep_outs)

    def judge(
        self,
        points: FloatArray,
        course: float,
        limits: Limits,
        prediction: Prediction,
        cell: float = 0.0,
        complete: bool = True,
    ) -> JudgedPath:
        """Return a path of waypoints (n, 3), begun with a course (rad, NaN where any will do), with what it meets."""
        points = np.ascontiguousarray(points)
        lengths = np.sqrt(np.square(np.diff(points, axis=0)).sum(axis=1))
        times = np.concatenate(([0.0], np.cumsum(lengths) / limits.speed))
        flown, arrivals, length = self._flown(points, course, limits)
        scale = 1.0 + self._config.trigger_margin
        entry, inside, entries = _meets(flown, arrivals, prediction.rows, scale)
        weight = inside
        if inside > 0.0:
            n = int(np.searchsorted(arrivals, self._config.decide_by_s)) + 1
            soon = _meets(flown[:n], arrivals[:n], prediction.rows, scale)[1]
            weight = soon + _LATE_SHARE * (inside - soon)
        at_places = arrivals[len(flown) - len(points) :]
        return JudgedPath(
            points,
            times,
            at_places,
            length,
            _first_turn(points, course),
            cell,
            inside,
            weight,
            entry,
            entries,
            complete,
        )

    def _flown(self, points: FloatArray, course: float, limits: Limits) -> tuple[FloatArray, FloatArray, float]:
        """Return a path with its first turn, when it is where, and its length."""
        places = np.empty((len(points) + ftk.PLACES, 3))
        times = np.empty(len(places))
        n, length = ftk.flown_times(points, len(points), course, limits.radius, limits.speed, places, times)
        return places[:n], times[:n], length

    def plan(
        self, start: FloatArray, course: float, goal: FloatArray, limits: Limits, prediction: Prediction,
        share: float = 1.0,
    ) -> JudgedPath | None:  # fmt: skip
        """Search a path to the goal.

        Parameters
        ----------
        start, goal : ndarray, shape (3,)
            Local NED, m.
        course : float
            Of the ownship, rad; NaN where it hardly moves.
        limits : Limits
        prediction : Prediction
        share : float
            Of the budget.

        Returns
        -------
        JudgedPath or None
            The first that is free and not too long, else the shortest free one, else the one that is in cylinders for
            the least time, soon above all. None without any move.
        """
        config = self._config
        if config.constant_altitude:
            goal = np.array([goal[0], goal[1], start[2]])
        expansions, distances, chain_distances = (
            int(share * most) for most in (config.expansions_max, config.distances_max, config.chain_distances_max)
        )
        looks = int(share * config.refinement_looks_max)
        wanted = config.length_ratio_max * math.dist(start, goal)
        best: JudgedPath | None = None
        short = _SHORT * math.dist(start, goal)
        for berth, cell_share, spread, climb in _TRIES:
            cheap = climb < 1.0
            if cheap and (config.constant_altitude or (best is not None and best.free and best.length <= short)):
                continue
            intruders = prediction.widened(config.plan_margin, spread)
            part = _CHEAP_SHARE if cheap else 1
            found = self._search.find(
                start, course, goal, limits, intruders, berth=berth, cell_share=cell_share, climb=climb,
                expansions_max=expansions // part, distances_max=distances // part,
            )  # fmt: skip
            if found is None:
                break
            expansions, distances = expansions - found.expansions, distances - found.distances
            tries = [best] if best else []
            if found.complete or not cheap:  # a climb that is not finished ends high above the goal
                path = self._completed(found, course, goal, limits, prediction)
                new = [path]
                if self._chain is not None and len(path.points) > 2:
                    points, times, taken = self._chain.settle(
                        path.points, course, found.cell, limits, intruders, chain_distances // _CHAIN_SHARE
                    )
                    chain_distances -= taken
                    if self._allowed(points, times, course, limits):
                        new.append(self.judge(points, course, limits, prediction, found.cell, path.complete))
                for one in tuple(new):
                    refined, taken = self._refined(
                        one, course, limits, intruders, prediction, looks // _REFINEMENT_SHARE
                    )
                    looks -= taken
                    new.append(refined)
                tries += new
            best = min(tries, key=_rank)
            # What is no climb is compared with one first.
            enough = wanted if cheap or config.constant_altitude else short
            if (best.free and best.length <= enough) or expansions <= 0 or distances <= 0:
                break
        if best is None or not best.free:
            # With looks of their own: they are the last resort.
            own_looks = int(share * config.refinement_looks_max) // _REFINEMENT_SHARE
            tries = self._escapes(start, course, goal, limits, prediction, own_looks)
            best = min([*tries, best] if best else tries, key=_rank, default=None)
        return best

    def _escapes(
        self, start: FloatArray, course: float, goal: FloatArray, limits: Limits, prediction: Prediction, looks: int
    ) -> list[JudgedPath]:
        """Return the best of some turns with a climb or descent at the limits, and it refined: the last resort.

        The grid has no move that turns and climbs at once, and none between its eighths of a turn.
        """
        config = self._config
        base = math.atan2(goal[1] - start[1], goal[0] - start[0]) if math.isnan(course) else course
        reach = _ESCAPE_S * limits.speed
        lowest, highest = max(-config.altitude_min_m, start[2]), min(-config.altitude_max_m, start[2])
        rates = (0.0,) if config.constant_altitude else (0.0, -limits.climb_max, limits.sink_max)
        best: JudgedPath | None = None
        for turn, rate in itertools.product(_ESCAPE_TURNS, rates):
            away = base + turn
            down = min(max(start[2] + _ESCAPE_S * rate, highest), lowest)
            place = (start[0] + reach * math.cos(away), start[1] + reach * math.sin(away), down)
            points = np.array([start, place, goal])
            if path_enters(points, 3, self._keep_outs.volumes, self._keep_outs.vertices) < 0:
                path = self.judge(points, course, limits, prediction, reach)
                best = path if best is None else min(path, best, key=_rank)
        if best is None:
            return []
        intruders = prediction.widened(config.plan_margin, 0.0)
        return [best, self._refined(best, course, limits, intruders, prediction, looks)[0]]

    def _refined(
        self, path: JudgedPath, course: float, limits: Limits, intruders: FloatArray, prediction: Prediction, looks: int
    ) -> tuple[JudgedPath, int]:
        """Return a path refined, and the looks that it took."""
        points, taken = self._refinement.refined(path.points, course, path.cell, limits, intruders, looks)
        judged = self.judge(points, course, limits, prediction, path.cell, path.complete)
        # Where the last leg of an unfinished search cannot be flown, the refinement must not make others like it.
        if self._flyable_but_for_end(path, course, limits) and not self._flyable_but_for_end(judged, course, limits):
            return path, taken
        return judged, taken

    def _flyable_but_for_end(self, path: JudgedPath, course: float, limits: Limits) -> bool:
        return self._allowed(path.points[:-1], path.times[:-1], course, limits)

    def follow(
        self, points: FloatArray, course: float, cell: float, limits: Limits, prediction: Prediction
    ) -> JudgedPath | None:
        """Change a path that is being flown as little as need be: refine it, and let the chain go on from it.

        Parameters are those of `plan`; `points` (n, 3) begin with the ownship and end with the goal.

        Returns
        -------
        JudgedPath or None
            The shortest that is free; else what the chain makes of it. None where that cannot be flown.
        """
        intruders = prediction.widened(self._config.plan_margin)
        looks = self._config.refinement_looks_max // _REFINEMENT_SHARE
        kept = self.judge(points, course, limits, prediction, cell)
        tries = [self._refined(kept, course, limits, intruders, prediction, looks)[0]]
        settled: JudgedPath | None = None
        if self._chain is not None and len(points) > 2:
            budget = self._config.chain_distances_max
            points, _, _ = self._chain.settle(points, course, cell, limits, intruders, budget)
            settled = self.judge(points, course, limits, prediction, cell)
            tries.append(self._refined(settled, course, limits, intruders, prediction, looks)[0])
        free = [path for path in tries if path.free and self._allowed(path.points, path.times, course, limits)]
        if free:
            return min(free, key=_rank)
        # The chain keeps the sense, which a refinement need not do.
        return settled if settled and self._allowed(settled.points, settled.times, course, limits) else None

    def way_back(
        self, start: FloatArray, course: float, goal: FloatArray, rest: FloatArray, limits: Limits,
        prediction: Prediction,
    ) -> JudgedPath | None:  # fmt: skip
        """Return the straight way to a goal on the mission, if it can be flown and it and what follows meet nobody.

        Parameters
        ----------
        start, goal : ndarray, shape (3,)
            Local NED, m.
        course : float
            Of the ownship, rad; NaN where it hardly moves.
        rest : ndarray, shape (n, 3)
            The mission's waypoints after the goal.
        limits : Limits
        prediction : Prediction
            The cylinders are kept clear of as by plans (`plan_margin`), so that no new conflict is found at once.
        """
        path = self.judge(np.vstack([start, goal]), course, limits, prediction)
        # However far it turns back: the turn is judged as it is flown.
        if not self._allowed(path.points, path.times, course, limits, SHARP_FIRST):
            return None
        whole, times, _ = self._flown(np.vstack([path.points, rest]), course, limits)
        return path if _meets(whole, times, prediction.rows, 1.0 + self._config.plan_margin)[1] == 0.0 else None

    def _completed(
        self, found: FoundPath, course: float, goal: FloatArray, limits: Limits, prediction: Prediction
    ) -> JudgedPath:
        """Return the path with its end at the goal, or as it is where the way there is closed."""
        path = self.judge(found.points, course, limits, prediction, found.cell, found.complete)
        end = found.points[-1]
        if found.complete:
            return path
        leg = np.array([end, goal])
        if path_enters(leg, 2, self._keep_outs.volumes, self._keep_outs.vertices) >= 0:
            return path
        return self.judge(np.vstack([found.points, goal]), course, limits, prediction, found.cell)

    def _allowed(self, points: FloatArray, times: FloatArray, course: float, limits: Limits, taken: int = 0) -> bool:
        """Return whether a path enters no keep-out, and has no flaws of `path_flaws` but those taken as they are."""
        volumes = self._keep_outs
        flaws = path_flaws(points, times, len(points), course, limits.radius, limits.climb_max, limits.sink_max)
        return flaws & ~taken == 0 and path_enters(points, len(points), volumes.volumes, volumes.vertices) < 0


def _meets(points: FloatArray, times: FloatArray, rows: FloatArray, scale: float) -> tuple[float, float, FloatArray]:
    """Return when a path first enters a cylinder larger by a factor, the seconds inside, and the entry of each."""
    entries = np.full(len(rows), math.inf)
    entry, inside = path_inside(points, times, len(points), rows, len(rows), scale, entries)
    return entry, inside, entries


def _first_turn(points: FloatArray, course: float) -> float:
    if math.isnan(course):
        return 0.0
    leg = points[1] - points[0]
    return abs(float(wrap_angle(math.atan2(leg[1], leg[0]) - course)))


def _rank(path: JudgedPath) -> tuple[float, bool, float]:
    """Order paths: least time in cylinders (what comes late is worth less), reaching the goal, short.

    Of two about as long the one that begins more gently is worth more: what is learned later changes it more easily.
    """
    return path.weight, not path.complete, path.length + _TURN_METRES * path.turn
