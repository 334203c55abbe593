"""The grid between the ownship and its goal, and the search on it."""

import math
from dataclasses import dataclass, field

import numpy as np

from wideberth.avoidance.keep_out.kernels import KeepOuts
from wideberth.avoidance.waypoint_paths import astar_kernels as ak
from wideberth.avoidance.waypoint_paths.config import AStarConfig
from wideberth.avoidance.waypoint_paths.first_turn_kernels import N_INERTIA
from wideberth.types import FloatArray

_BEHIND = 2  # cells of the grid behind the ownship, and beyond the goal
_TIMES_DIRECT = 3.0  # a path may take so many times the direct one, and so many steps at least
_STEPS_LEAST = 12.0
_AXIS_MIN = 1e-3  # m: nearer than this a goal gives no direction


@dataclass(frozen=True, slots=True)
class Limits:
    """What plans may ask of the ownship.

    Attributes
    ----------
    speed : float
        Along the path, m/s.
    radius : float
        Of a turn, m.
    climb_max, sink_max : float
        m/s.
    inertia : ndarray, shape (first_turn_kernels.N_INERTIA,)
        What the ownship first goes on with.
    """

    speed: float
    radius: float
    climb_max: float
    sink_max: float
    inertia: FloatArray = field(default_factory=lambda: np.zeros(N_INERTIA))


@dataclass(frozen=True, slots=True)
class FoundPath:
    """A path of the search: places (n, 3), local NED, the first the start; times (n,), s from now.

    Attributes
    ----------
    complete : bool
        Whether it reaches the goal; else it is the best so far.
    cell : float
        Size of the cells, m.
    cost : float
    expansions, distances : int
        What the search took of its budget.
    """

    points: FloatArray
    times: FloatArray
    complete: bool
    cell: float
    cost: float
    expansions: int
    distances: int


def cell_size(cell: float, limits: Limits) -> float:
    """Return a cell of the size (m) given, or the least that the ownship can turn in."""
    # An eighth of a turn takes R tan(pi/8) of the steps on both sides: less than half of each.
    return max(cell, 2.4 * limits.radius * math.tan(math.pi / 8.0))


class GridSearch:
    """A* on grids of one configuration; holds the buffers.

    Parameters
    ----------
    config : AStarConfig
    keep_outs : KeepOuts
    """

    def __init__(self, config: AStarConfig, keep_outs: KeepOuts) -> None:
        self._config, self._keep_outs = config, keep_outs
        nodes = ak.MOVES * config.expansions_max + 1
        slots = 1 << math.ceil(math.log2(2 * nodes))
        costs = config.costs
        self._cost = np.zeros(ak.N_COST)
        self._cost[ak.K_DIST], self._cost[ak.K_ALT] = costs.k_dist, costs.k_alt
        self._cost[ak.K_MAX], self._cost[ak.K_R], self._cost[ak.VARRHO] = costs.k_max, costs.k_r, costs.varrho
        self._cost[ak.K_N], self._cost[ak.K_CPA], self._cost[ak.K_V] = costs.k_n, costs.k_cpa, costs.k_v
        self._cost[ak.K_LEFT], self._cost[ak.DELTA_2] = costs.k_left, config.forces.delta_2
        self._memory = ak.Search(
            cells=np.zeros((nodes, 5), np.int64),
            values=np.zeros((nodes, 3)),
            heap=np.zeros(nodes, np.int64),
            keys=np.zeros(slots, np.int64),
            slots=np.zeros(slots, np.int64),
            near=np.zeros(3 * config.intruders_max, np.int64),
            path=np.zeros((nodes, 3)),
            times=np.zeros(nodes),
            done=np.zeros(2, np.int64),
        )

    def find(
        self,
        start: FloatArray,
        course: float,
        goal: FloatArray,
        limits: Limits,
        intruders: FloatArray,
        *,
        berth: float = 1.0,
        cell_share: float = 1.0,
        climb: float = 1.0,
        expansions_max: int | None = None,
        distances_max: int | None = None,
    ) -> FoundPath | None:
        """Search a path.

        Parameters
        ----------
        start, goal : ndarray, shape (3,)
            Local NED, m.
        course : float
            Of the ownship, rad; NaN where it hardly moves: it then begins towards the goal.
        limits : Limits
        intruders : ndarray, shape (m, intruder_kernels.N_INTRUDER)
        berth : float
            Factor on `k_r`, the cost of flying near a cylinder.
        cell_share : float
            Factor on the size of the cells.
        climb : float
            Factor on what a climbing step costs more than a level one (`k_alt` less `k_dist`).
        expansions_max, distances_max : int, optional
            Budget; the configuration's by default.

        Returns
        -------
        FoundPath or None
            None where there is no move at all, or no way to go.
        """
        grid = self._grid(start, goal, limits, cell_share)
        if grid is None:
            return None
        turned = course - math.atan2(grid[ak.AXIS_EAST], grid[ak.AXIS_NORTH])
        heading = 0 if math.isnan(course) else round(turned / (math.pi / 4.0)) % 8
        costs = self._cost.copy()
        costs[ak.K_R] *= berth
        costs[ak.K_ALT] = costs[ak.K_DIST] + climb * (costs[ak.K_ALT] - costs[ak.K_DIST])
        config, volumes = self._config, self._keep_outs
        status, n, cost = ak.search(
            grid, costs, heading, intruders, len(intruders), volumes.volumes, volumes.vertices,
            config.expansions_max if expansions_max is None else expansions_max,
            config.distances_max if distances_max is None else distances_max,
            self._memory,
        )  # fmt: skip
        if status == ak.NOWHERE:
            return None
        return FoundPath(
            points=self._memory.path[:n].copy(),
            times=self._memory.times[:n].copy(),
            complete=status == ak.FOUND,
            cell=float(grid[ak.CELL]),
            cost=cost,
            expansions=int(self._memory.done[0]),
            distances=int(self._memory.done[1]),
        )

    def _grid(self, start: FloatArray, goal: FloatArray, limits: Limits, cell_share: float) -> FloatArray | None:
        config = self._config
        dn, de = goal[0] - start[0], goal[1] - start[1]
        distance = math.hypot(dn, de)
        if distance < _AXIS_MIN:
            return None
        least = cell_size(cell_share * config.cell_m, limits)
        # Of the sizes that lead to the goal in whole steps the nearest one.
        steps = max(1, round(distance / least))
        cell = distance / steps
        grid = np.zeros(ak.N_GRID)
        grid[ak.ORIGIN_NORTH], grid[ak.ORIGIN_EAST], grid[ak.ORIGIN_DOWN] = start
        grid[ak.AXIS_NORTH], grid[ak.AXIS_EAST] = dn / distance, de / distance
        grid[ak.CELL], grid[ak.GOAL] = cell, steps
        grid[ak.BEHIND], grid[ak.BEYOND] = _BEHIND, steps + _BEHIND
        grid[ak.ASIDE] = max(1, round(config.aside_cells * config.cell_m / cell))
        descent = 0.0 if config.constant_altitude else goal[2] - start[2]
        # The steepest way that leaves a level of climb beside it; the rest of the height is the mission's to fly.
        steepest = 0.5 * distance / limits.speed
        descent = min(max(descent, -limits.climb_max * steepest), limits.sink_max * steepest)
        grid[ak.SLOPE] = descent / distance
        rate = min(limits.climb_max, limits.sink_max) - abs(grid[ak.SLOPE]) * limits.speed
        # A level step takes cell / speed seconds at least.
        grid[ak.LEVEL] = min(config.cell_height_m, max(0.98 * rate * cell / limits.speed, 1e-3))
        levels = 0 if config.constant_altitude else config.levels
        grid[ak.LEVEL_LOW], grid[ak.LEVEL_HIGH] = -levels, levels
        grid[ak.SPEED], grid[ak.CLIMB_MAX], grid[ak.SINK_MAX] = limits.speed, limits.climb_max, limits.sink_max
        grid[ak.FLOOR], grid[ak.CEILING] = config.altitude_min_m, config.altitude_max_m
        step_time = cell / limits.speed
        grid[ak.TIME_BIN] = config.time_bin * step_time
        grid[ak.TIME_MAX] = max(_TIMES_DIRECT * steps, _STEPS_LEAST) * step_time
        return grid
