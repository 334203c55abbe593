"""The path from here to a goal: A*, then the chain over it, each checked in fine time; the best of them."""

import itertools
import math
from dataclasses import dataclass

import numpy as np

from wideberth.avoidance.keep_out.kernels import KeepOuts, path_enters
from wideberth.avoidance.waypoint_paths.astar import FoundPath, GridSearch, Limits
from wideberth.avoidance.waypoint_paths.chain import Chain
from wideberth.avoidance.waypoint_paths.config import AStarConfig
from wideberth.avoidance.waypoint_paths.judge_kernels import judge_path
from wideberth.avoidance.waypoint_paths.limits_kernels import SHARP_FIRST, path_flaws
from wideberth.avoidance.waypoint_paths.prediction import Prediction
from wideberth.avoidance.waypoint_paths.refinement import Refinement
from wideberth.avoidance.waypoint_paths.work import LOOK, Work, judgement
from wideberth.types import FloatArray

# Of the work that is left, each time: the escapes, for which it is kept, of all; a search, the chain over its path and
# a refinement of that of one try; the chain over the path that is flown and a refinement of that, again of all.
_ESCAPE_SHARE = 1 / 6
_SEARCH_SHARE, _CHAIN_SHARE, _REFINEMENT_SHARE = 1 / 2, 1 / 3, 2 / 5
_FOLLOWING_CHAIN_SHARE, _FOLLOWING_REFINEMENT_SHARE = 1 / 8, 1 / 16
_SHORT = 1.05  # times the direct way: no climb can be much shorter
_CHEAP_SHARE = 3  # so much less for them: searches with cheap climbs look at many levels
_CHEAP = 0.1  # of what a climb costs more than the way: next to a long detour it is worth it
# One search after the other: factors on k_r, on the cells' size, on the spreads of the predictions, and on the cost of
# climbs.
_TRIES = (
    (1.0, 1.0, 1.0, 1.0), (0.1, 1.0, 1.0, _CHEAP), (0.1, 1.0, 0.5, 1.0), (0.1, 1.0, 0.5, _CHEAP),
    (0.0, 1.0, 0.0, 1.0), (0.0, 0.5, 0.0, 1.0), (0.0, 0.5, 0.0, _CHEAP),
)  # fmt: skip

_ESCAPE_S = 10.0  # that an escape goes on for
# The small ones first: with little work left those are tried.
_ESCAPE_TURNS = np.radians([0, -30, 30, -60, 60, -90, 90, -120, 120, -150, 150]).tolist()
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
        margin: float | None = None,
    ) -> JudgedPath:
        """Return a path of waypoints (n, 3), begun with a course (rad, NaN where any will do), with what it meets.

        The cylinders are larger by a `margin`, by default by `trigger_margin`.
        """
        points = np.ascontiguousarray(points)
        scale = 1.0 + (self._config.trigger_margin if margin is None else margin)
        length, turn, entry, inside, soon, times, arrivals, entries = judge_path(
            points, course, limits.radius, limits.inertia, limits.speed, prediction.rows, scale,
            self._config.decide_by_s,
        )  # fmt: skip
        weight = soon + _LATE_SHARE * (inside - soon)
        return JudgedPath(
            points, times, arrivals, length, turn, cell, inside, weight, entry, entries, complete
        )  # fmt: skip

    def plan(
        self, start: FloatArray, course: float, goal: FloatArray, limits: Limits, prediction: Prediction,
        work: Work | None = None,
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
        work : Work, optional
            The decision's; by default as much as a decision may do.

        Returns
        -------
        JudgedPath or None
            The first that is free and not too long, else the shortest free one, else the one that is in cylinders for
            the least time, soon above all. None without any move.
        """
        config = self._config
        work = Work(config.work_max) if work is None else work
        if config.constant_altitude:
            goal = np.array([goal[0], goal[1], start[2]])
        last_resort = work.split(_ESCAPE_SHARE)
        expansions = config.expansions_max
        wanted = config.length_ratio_max * math.dist(start, goal)
        best: JudgedPath | None = None
        short = _SHORT * math.dist(start, goal)
        for i, (berth, cell_share, spread, climb) in enumerate(_TRIES):
            cheap = climb < 1.0
            if cheap and (config.constant_altitude or (best is not None and best.free and best.length <= short)):
                continue
            intruders = prediction.widened(config.plan_margin, spread)
            part = work.split(2.0 / (len(_TRIES) - i + 1))
            found = self._search.find(
                start, course, goal, limits, intruders, berth=berth, cell_share=cell_share, climb=climb,
                expansions_max=expansions // (_CHEAP_SHARE if cheap else 1),
                distances_max=min(config.distances_max, part.part(_SEARCH_SHARE)),
            )  # fmt: skip
            if found is None:
                work.join(part)
                break
            expansions -= found.expansions
            part.take(found.distances)
            if found.complete or not cheap:  # a climb that is not finished ends high above the goal
                new = self._made_of(found, course, goal, limits, intruders, prediction, part)
                best = min([best, *new] if best else new, key=_rank, default=None)
            work.join(part)
            # What is no climb is compared with one first.
            enough = wanted if cheap or config.constant_altitude else short
            if (best and best.free and best.length <= enough) or expansions <= 0:
                break
        work.join(last_resort)
        if best is None or not best.free:
            tries = self._escapes(start, course, goal, limits, prediction, work)
            best = min([*tries, best] if best else tries, key=_rank, default=None)
        return best

    def _made_of(
        self, found: FoundPath, course: float, goal: FloatArray, limits: Limits, intruders: FloatArray,
        prediction: Prediction, work: Work,
    ) -> list[JudgedPath]:  # fmt: skip
        """Return what was found, what the chain makes of it, and both refined, as far as there is work for it."""
        points, complete = self._completed(found, goal)
        path = self._judged(points, course, limits, prediction, found.cell, complete, work)
        if path is None:
            return []
        paths = [path]
        if self._chain is not None and len(path.points) > 2:
            settled = self._settled(path, course, limits, intruders, prediction, _CHAIN_SHARE, work)
            if settled and self._allowed(settled.points, settled.times, course, limits):
                paths.append(settled)
        share = _REFINEMENT_SHARE
        return [*paths, *(self._refined(one, course, limits, intruders, prediction, share, work) for one in paths)]

    def _escapes(
        self, start: FloatArray, course: float, goal: FloatArray, limits: Limits, prediction: Prediction, work: Work
    ) -> list[JudgedPath]:
        """Return the best of some turns with a climb or descent at the limits, and it refined: the last resort.

        The grid has no move that turns and climbs at once, and none between its eighths of a turn.
        """
        config = self._config
        base = math.atan2(goal[1] - start[1], goal[0] - start[0]) if math.isnan(course) else course
        reach = _ESCAPE_S * limits.speed
        lowest, highest = max(-config.altitude_min_m, start[2]), min(-config.altitude_max_m, start[2])
        rates = (0.0,) if config.constant_altitude else (0.0, -limits.climb_max, limits.sink_max)
        judged: list[JudgedPath] = []
        for turn, rate in itertools.product(_ESCAPE_TURNS, rates):
            away = base + turn
            down = min(max(start[2] + _ESCAPE_S * rate, highest), lowest)
            place = (start[0] + reach * math.cos(away), start[1] + reach * math.sin(away), down)
            points = np.array([start, place, goal])
            if path_enters(points, 3, self._keep_outs.volumes, self._keep_outs.vertices) < 0:
                path = self._judged(points, course, limits, prediction, reach, True, work)
                if path is None:
                    break
                judged.append(path)
        if not judged:
            return []
        best = min(judged, key=_rank)
        intruders = prediction.widened(config.plan_margin, 0.0)
        return [best, self._refined(best, course, limits, intruders, prediction, _REFINEMENT_SHARE, work)]

    def _judged(
        self, points: FloatArray, course: float, limits: Limits, prediction: Prediction, cell: float, complete: bool,
        work: Work,
    ) -> JudgedPath | None:  # fmt: skip
        """Return a path judged, if there is work left for it."""
        needed = judgement(len(points), len(prediction.rows))
        if work.left < needed:
            return None
        work.take(needed)
        return self.judge(points, course, limits, prediction, cell, complete)

    def _settled(
        self, path: JudgedPath, course: float, limits: Limits, intruders: FloatArray, prediction: Prediction,
        share: float, work: Work,
    ) -> JudgedPath | None:  # fmt: skip
        """Return what the chain makes of a path with a share of the work, if there is enough of it."""
        assert self._chain is not None
        most = work.part(share, kept=judgement(len(path.points), len(prediction.rows)))
        points, _, taken = self._chain.settle(path.points, course, path.cell, limits, intruders, most)
        work.take(taken)
        return self._judged(points, course, limits, prediction, path.cell, path.complete, work) if taken else None

    def _refined(
        self, path: JudgedPath, course: float, limits: Limits, intruders: FloatArray, prediction: Prediction,
        share: float, work: Work,
    ) -> JudgedPath:  # fmt: skip
        """Return a path refined with a share of the work, or as it is where that is not enough."""
        most = work.part(share, kept=judgement(len(path.points), len(prediction.rows)))
        points, taken = self._refinement.refined(path.points, course, path.cell, limits, intruders, most // LOOK)
        work.take(LOOK * taken)
        judged = self._judged(points, course, limits, prediction, path.cell, path.complete, work) if taken else None
        # Where the last leg of an unfinished search cannot be flown, the refinement must not make others like it.
        if judged is None or (
            self._flyable_but_for_end(path, course, limits) and not self._flyable_but_for_end(judged, course, limits)
        ):
            return path
        return judged

    def _flyable_but_for_end(self, path: JudgedPath, course: float, limits: Limits) -> bool:
        return self._allowed(path.points[:-1], path.times[:-1], course, limits)

    def follow(
        self, points: FloatArray, course: float, cell: float, limits: Limits, prediction: Prediction,
        work: Work | None = None,
    ) -> JudgedPath | None:  # fmt: skip
        """Change a path that is being flown as little as need be: refine it, and let the chain go on from it.

        Parameters are those of `plan`; `points` (n, 3) begin with the ownship and end with the goal.

        Returns
        -------
        JudgedPath or None
            The shortest that is free; else what the chain makes of it. None where that cannot be flown.
        """
        work = Work(self._config.work_max) if work is None else work
        intruders = prediction.widened(self._config.plan_margin)
        kept = self._judged(points, course, limits, prediction, cell, True, work)
        if kept is None:
            return None
        share = _FOLLOWING_REFINEMENT_SHARE
        tries = [self._refined(kept, course, limits, intruders, prediction, share, work)]
        settled: JudgedPath | None = None
        if self._chain is not None and len(points) > 2:
            settled = self._settled(kept, course, limits, intruders, prediction, _FOLLOWING_CHAIN_SHARE, work)
        if settled:
            tries.append(self._refined(settled, course, limits, intruders, prediction, share, work))
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
        whole = self.judge(np.vstack([path.points, rest]), course, limits, prediction, margin=self._config.plan_margin)
        return path if whole.free else None

    def _completed(self, found: FoundPath, goal: FloatArray) -> tuple[FloatArray, bool]:
        """Return the path with its end at the goal, or as it is where the way there is closed, and whether it has."""
        leg = np.array([found.points[-1], goal])
        if found.complete or path_enters(leg, 2, self._keep_outs.volumes, self._keep_outs.vertices) >= 0:
            return found.points, found.complete
        return np.vstack([found.points, goal]), True

    def _allowed(self, points: FloatArray, times: FloatArray, course: float, limits: Limits, taken: int = 0) -> bool:
        """Return whether a path enters no keep-out, and has no flaws of `path_flaws` but those taken as they are."""
        volumes = self._keep_outs
        flaws = path_flaws(points, times, len(points), course, limits.radius, limits.climb_max, limits.sink_max)
        return flaws & ~taken == 0 and path_enters(points, len(points), volumes.volumes, volumes.vertices) < 0


def _rank(path: JudgedPath) -> tuple[float, bool, float]:
    """Order paths: least time in cylinders (what comes late is worth less), reaching the goal, short.

    Of two about as long the one that begins more gently is worth more: what is learned later changes it more easily.
    """
    return path.weight, not path.complete, path.length + _TURN_METRES * path.turn
