"""The local-level maps: how many nodes, where, and how long each ring lasts."""

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wideberth.avoidance.graph_kernels import FLYABLE, RINGS


@dataclass(frozen=True, slots=True)
class Ring:
    """Nodes that are reached after the same time.

    Attributes
    ----------
    duration : float
        Time from the ring before, s.
    nodes : tuple of (float, float)
        Course (rad) and height (m) against the ownship's.
    """

    duration: float
    nodes: tuple[tuple[float, float], ...]


@dataclass(frozen=True, slots=True)
class LocalLevelMap:
    """A map of nodes around the ownship (ADS-B paper, figure 7).

    Attributes
    ----------
    geometry : int
        `graph_kernels.RINGS` (as printed) or `graph_kernels.FLYABLE`.
    rings : tuple of Ring
    """

    geometry: int
    rings: tuple[Ring, ...]

    @property
    def node_count(self) -> int:
        """Number of nodes, the ownship's own included, as the paper counts them."""
        return 1 + sum(len(ring.nodes) for ring in self.rings)

    @property
    def duration(self) -> float:
        """Time from the ownship to the last ring, s."""
        return sum(ring.duration for ring in self.rings)

    def arrays(
        self, dt: float
    ) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
        """Return first node of each ring, ring durations in steps of `dt`, and each node's course and height."""
        sizes = [len(ring.nodes) for ring in self.rings]
        steps = [max(1, round(ring.duration / dt)) for ring in self.rings]
        nodes = np.array([node for ring in self.rings for node in ring.nodes])
        return (
            np.array([0, *itertools.accumulate(sizes)], np.int64),
            np.array(steps, np.int64),
            nodes[:, 0].copy(),
            nodes[:, 1].copy(),
        )


def _grid(courses_deg: tuple[float, ...], heights: tuple[float, ...]) -> tuple[tuple[float, float], ...]:
    return tuple((math.radians(course), height) for course in courses_deg for height in heights)


def collision_38(ring_s: float = 5.0, height: float = 25.0) -> LocalLevelMap:
    """Return the paper's map for collision avoidance: 38 = 1 + 7 + 15 + 15 nodes (errata, "ADS-B paper").

    Parameters
    ----------
    ring_s : float
        Time between rings, s.
    height : float
        Height between levels of the first ring, m; the later rings' levels are multiples of it.
    """
    courses = (0.0, 30.0, -30.0, 60.0, -60.0)
    first = (*_grid(courses, (0.0,)), (0.0, height), (0.0, -height))
    rings = [Ring(ring_s, first)]
    rings += [Ring(ring_s, _grid(courses, (0.0, k * height, -k * height))) for k in (2, 3)]
    return LocalLevelMap(RINGS, tuple(rings))


def self_separation_150(ring_s: float = 20.0, height: float = 60.0) -> LocalLevelMap:
    """Return the paper's map for self-separation: 150 = 1 + 9 + 15 + 35 + 45 + 45 nodes (errata, "ADS-B paper").

    Parameters
    ----------
    ring_s, height : float
        As for `collision_38`.
    """
    five = (0.0, 15.0, -15.0, 30.0, -30.0)
    seven = (*five, 45.0, -45.0)
    nine = (*seven, 60.0, -60.0)
    levels = (0.0, 1.0, -1.0, 2.0, -2.0)
    rings = (
        Ring(ring_s, (*_grid(seven, (0.0,)), (0.0, height), (0.0, -height))),
        Ring(ring_s, _grid(five, (0.0, height, -height))),
        Ring(ring_s, _grid(seven, tuple(level * height for level in levels))),
        Ring(ring_s, _grid(nine, tuple(1.5 * level * height for level in levels))),
        Ring(ring_s, _grid(nine, tuple(2.0 * level * height for level in levels))),
    )
    return LocalLevelMap(RINGS, rings)


def flyable(
    durations_s: tuple[float, ...] = (6.0, 10.0, 14.0, 20.0, 24.0, 30.0),
    courses_deg: tuple[float, ...] = (0.0, 20.0, -20.0, 40.0, -40.0, 60.0, -60.0, 90.0, -90.0, 120.0, -120.0),
    heights: tuple[float, ...] = (0.0, 120.0, -120.0, 240.0, -240.0),
) -> LocalLevelMap:
    """Return the default map: every ring holds all courses and heights, and a node is where the aircraft then is.

    Parameters
    ----------
    durations_s : tuple of float
        Time of each ring, s: short at first, where decisions matter, longer later.
    courses_deg, heights : tuple of float
        Courses (deg) and heights (m) against the ownship's.
    """
    return LocalLevelMap(FLYABLE, tuple(Ring(duration, _grid(courses_deg, heights)) for duration in durations_s))


def flyable_38() -> LocalLevelMap:
    """Return the 38 nodes of `collision_38` with places that can be flown to.

    The first two rings are 5 s long as there; the last is longer, so that the map reaches from where a maneuver begins
    to beyond the closest point: else a way that only puts it off looks clear.
    """
    rings = collision_38(5.0, 25.0).rings
    return LocalLevelMap(FLYABLE, (rings[0], rings[1], Ring(15.0, rings[2].nodes)))


def flyable_150() -> LocalLevelMap:
    """Return 150 nodes in rings of as many as `self_separation_150`, with places that can be flown to.

    Smooth at long range: rings are short at first and longer later. In 120 s a climb of 5 m/s clears the well-clear
    volume's height more than twice over, and an intruder passes that is a modified tau of 35 s away when it matters.
    """
    three, five = (0.0, 120.0, -120.0), (0.0, 120.0, -120.0, 240.0, -240.0)
    few = (0.0, 30.0, -30.0, 60.0, -60.0)
    wide = (0.0, 20.0, -20.0, 40.0, -40.0, 60.0, -60.0, 90.0, -90.0)
    rings = (
        Ring(10.0, _grid((0.0, 40.0, -40.0), three)),
        Ring(15.0, _grid(few, three)),
        Ring(25.0, _grid((*few, 90.0, -90.0), five)),
        Ring(30.0, _grid(wide, five)),
        Ring(40.0, _grid(wide, five)),
    )
    return LocalLevelMap(FLYABLE, rings)


MAPS: dict[str, Callable[[], LocalLevelMap]] = {
    "collision_38": collision_38,
    "self_separation_150": self_separation_150,
    "flyable": flyable,
    "flyable_38": flyable_38,
    "flyable_150": flyable_150,
}
