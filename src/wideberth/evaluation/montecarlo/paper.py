"""What the ADS-B paper reports of its two Monte Carlo sets: tables 3 to 8 and the numbers in its text.

Source: ADS-B paper, "Simulation results" and "Conclusions".
"""

from dataclasses import dataclass
from typing import Literal

Set = Literal["collision", "self_separation"]


@dataclass(frozen=True, slots=True)
class Detection:
    """A row of tables 3 and 4."""

    p_cd: float
    p_fa: float
    safety_ratio: float


@dataclass(frozen=True, slots=True)
class Times:
    """A row of tables 5 to 8, s."""

    mean_max: float
    p95: float
    max: float


@dataclass(frozen=True, slots=True)
class PaperSet:
    """What the paper says of one set.

    Attributes
    ----------
    title : str
        What the paper calls it.
    tables : (int, int, int)
        Numbers of its tables of detection, delay and execution time.
    figure : int
        Number of its figure of counts.
    encounters : int
        In all.
    detection, delay, execution : dict
        By number of intruders.
    entered : int
        Collision-volume violations, or losses of self-separation, in all.
    entered_by_intruders, true_events : dict of int to int
        Where the text tells.
    """

    title: str
    tables: tuple[int, int, int]
    figure: int
    encounters: int
    detection: dict[int, Detection]
    delay: dict[int, Times]
    execution: dict[int, Times]
    entered: int
    entered_by_intruders: dict[int, int]
    true_events: dict[int, int]

    def mean_pair(self) -> tuple[float, float]:
        """Return P_cd and P_fa, averaged over the numbers of intruders."""
        rows = self.detection.values()
        return sum(r.p_cd for r in rows) / len(rows), sum(r.p_fa for r in rows) / len(rows)


SETS: dict[Set, PaperSet] = {
    "self_separation": PaperSet(
        title="conflict detection and self-separation",
        tables=(3, 5, 7),
        figure=8,
        encounters=10_000,
        detection={
            1: Detection(0.998, 0.00214, 0.002),
            2: Detection(0.994, 0.00209, 0.006),
            3: Detection(0.997, 0.00211, 0.003),
            4: Detection(0.994, 0.00206, 0.006),
            5: Detection(0.991, 0.00225, 0.009),
        },
        delay={
            1: Times(1.389, 11.280, 12.9),
            2: Times(1.308, 8.900, 13.7),
            3: Times(1.370, 8.160, 24.9),
            4: Times(1.444, 6.255, 36.9),
            5: Times(1.148, 5.200, 18.9),
        },
        execution={
            1: Times(0.218, 0.292, 0.363),
            2: Times(0.387, 0.523, 0.649),
            3: Times(0.519, 0.627, 0.645),
            4: Times(0.521, 1.022, 2.131),
            5: Times(0.578, 0.930, 2.403),
        },
        entered=0,
        entered_by_intruders={1: 0, 2: 0, 3: 0, 4: 0, 5: 0},
        true_events={},
    ),
    "collision": PaperSet(
        title="collision detection and avoidance",
        tables=(4, 6, 8),
        figure=9,
        encounters=100_000,
        detection={
            1: Detection(1.000, 0.00051, 0.000),
            2: Detection(1.000, 0.00153, 0.000),
            3: Detection(0.990, 0.00068, 0.010),
            4: Detection(1.000, 0.00089, 0.000),
            5: Detection(1.000, 0.00082, 0.000),
        },
        delay={
            1: Times(2.010, 9.990, 18.2),
            2: Times(2.348, 9.900, 31.9),
            3: Times(2.219, 9.900, 35.9),
            4: Times(2.354, 10.245, 31.9),
            5: Times(2.190, 9.900, 28.5),
        },
        execution={
            1: Times(0.108, 0.198, 0.386),
            2: Times(0.108, 0.329, 0.392),
            3: Times(0.072, 0.079, 0.140),
            4: Times(0.014, 0.026, 0.734),
            5: Times(0.019, 0.042, 0.878),
        },
        entered=17,
        entered_by_intruders={5: 10},
        true_events={5: 1928},
    ),
}

VIOLATIONS_THIRD_FIVE = 1
"""Violations of a third of the collision volume with five intruders."""

VIOLATIONS_AIRCRAFT_FIVE = 0
"""Violations of a cylinder of 10 ft radius and 3 ft height with five intruders."""
