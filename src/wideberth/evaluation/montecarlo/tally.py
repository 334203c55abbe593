"""What is counted of the encounters with one number of intruders, block by block."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from wideberth.errors import InputError
from wideberth.evaluation.montecarlo import rows
from wideberth.evaluation.montecarlo.experiment import Experiment
from wideberth.evaluation.montecarlo.histograms import BinnedHistogram, ExactHistogram, PairedTally, RatioTally
from wideberth.units import NAUTICAL_MILE

BoolArray = NDArray[np.bool_]
Columns = dict[str, NDArray[Any]]

TIME_STEP_S = 0.1
PATH_STEP_M = 0.1
VOLUMES = {
    "violations": rows.VOLUME_FULL,
    "violations_third": rows.VOLUME_THIRD,
    "violations_aircraft": rows.VOLUME_AIRCRAFT,
    "nmac": rows.NMAC,
    "loss_of_self_separation": rows.LOSS,
    "loss_of_self_separation_filtered": rows.LOSS_FILTERED,
    "loss_of_astm": rows.ASTM,
}
"""Names of the volumes in a summary, and their bits in the rows."""

RATIO_EDGES: NDArray[np.float64] = 10.0 ** (np.arange(-80, 121) / 40)
"""Bins of the separation ratio at the closest approach: 40 for each power of ten."""


def blocks(table: pa.Table) -> Iterator[tuple[int, Columns]]:
    """Cut a table of rows into one block for each number of intruders.

    Parameters
    ----------
    table : pyarrow.Table
        With `rows.SCHEMA`, whole encounters, their rows one after another.

    Yields
    ------
    (int, dict of str to ndarray, shape (n, k))
        The number of intruders k, and the columns of n encounters.

    Raises
    ------
    InputError
        If columns are missing, or an encounter is not whole.
    """
    missing = [name for name in rows.SCHEMA.names if name not in table.column_names]
    if missing:
        raise InputError(f"rows of encounters lack the columns {', '.join(missing)}: run the encounters anew")
    columns = {name: table.column(name).to_numpy() for name in rows.SCHEMA.names}
    for k in np.unique(columns["intruders"]).tolist():
        mine = columns["intruders"] == k
        flat = {name: values[mine] for name, values in columns.items()}
        total = len(flat["encounter"])
        whole = k >= 1 and total % k == 0
        if whole:
            block = {name: values.reshape(-1, k) for name, values in flat.items()}
            numbers = block["encounter"]
            whole = bool((numbers == numbers[:, :1]).all()) and len(np.unique(numbers[:, 0])) == total // k
        if not whole:
            raise InputError(f"rows of encounters with {k} intruders are not whole encounters: run them anew")
        yield k, block


@dataclass
class DetectionTally:
    """Events, detections and delays by one way of counting."""

    correct: RatioTally = field(default_factory=RatioTally)
    false: RatioTally = field(default_factory=RatioTally)
    delays: ExactHistogram = field(default_factory=lambda: ExactHistogram(TIME_STEP_S))
    longest_delays: ExactHistogram = field(default_factory=lambda: ExactHistogram(TIME_STEP_S))

    def add(self, t_true: NDArray[np.float64], t_detected: NDArray[np.float64]) -> None:
        """Add encounters.

        Parameters
        ----------
        t_true, t_detected : ndarray, shape (n, k)
            s; NaN: no event, no detection.
        """
        event, detected = ~np.isnan(t_true), ~np.isnan(t_detected)
        hit = event & detected
        self.correct.add(hit, event)
        self.false.add(detected & ~event, ~event)
        delay = np.where(hit, t_detected - t_true, -np.inf)
        self.delays.add(delay[hit])
        longest = delay.max(axis=1)
        self.longest_delays.add(longest[np.isfinite(longest)])

    def merge(self, other: Self) -> None:
        """Add other encounters."""
        self.correct.merge(other.correct)
        self.false.merge(other.false)
        self.delays.merge(other.delays)
        self.longest_delays.merge(other.longest_delays)


class SetTally:
    """All counts of the encounters with one number of intruders, or of several numbers once merged.

    Parameters
    ----------
    experiment : Experiment
        Gives the size of the collision volume and of the circle.
    """

    def __init__(self, experiment: Experiment) -> None:
        scoring = experiment.scoring
        self._size = scoring.violation_radius_m, scoring.violation_half_height_m
        # A maneuver was needed where, without it, an intruder would have come in here.
        self._needed = rows.NMAC if scoring.paper == "collision" else rows.LOSS
        self.encounters = 0
        self.pairs = 0
        self.full_tier = 0
        self.least_bad = 0
        self.detectors = [DetectionTally() for _ in rows.DETECTORS]
        self.in_run = DetectionTally()
        self.other = DetectionTally()
        self.volumes = {name: PairedTally() for name in VOLUMES}
        self.maneuvered = RatioTally()  # encounters with a maneuver
        self.unnecessary = RatioTally()  # of those
        self.maneuvers = ExactHistogram(1.0)  # of an encounter
        self.extra_path = ExactHistogram(PATH_STEP_M)
        self.duration = ExactHistogram(TIME_STEP_S)
        self.duration_alone = ExactHistogram(TIME_STEP_S)
        horizontal = experiment.encounter.circle_nmi * NAUTICAL_MILE / 100 * np.arange(101.0)
        self.distances = {
            "ratio": BinnedHistogram(RATIO_EDGES),
            "ratio_alone": BinnedHistogram(RATIO_EDGES),
            "ratio_of_events": BinnedHistogram(RATIO_EDGES),
            "horizontal": BinnedHistogram(horizontal),
            "horizontal_alone": BinnedHistogram(horizontal),
        }

    def add(self, block: Columns) -> None:
        """Add encounters.

        Parameters
        ----------
        block : dict of str to ndarray, shape (n, k)
            As `blocks` makes them.
        """
        n, k = block["encounter"].shape
        self.encounters += n
        self.pairs += n * k
        self.full_tier += int(block["full_tier"][:, 0].sum())
        self.least_bad += int(block["least_bad"][:, 0].sum())
        for index, detector in enumerate(self.detectors):
            detector.add(block["t_true_s"], block[f"t_{index}_s"])
        self.in_run.add(block["t_true_in_run_s"], block["t_detected_in_run_s"])
        self.other.add(block["t_true_other_s"], block["t_3_s"])
        for name, bit in VOLUMES.items():
            self.volumes[name].add((block["inside"] & bit) != 0, (block["inside_alone"] & bit) != 0)
        maneuver = ~np.isnan(block["t_maneuver_s"][:, 0])
        needed = ((block["inside_alone"] & self._needed) != 0).any(axis=1)
        self.maneuvered.add(maneuver, np.ones_like(maneuver))
        self.unnecessary.add(maneuver & ~needed, maneuver)
        self.maneuvers.add(block["maneuvers"][:, 0])
        self.extra_path.add(block["extra_path_m"][maneuver, 0])
        self.duration.add(block["duration_s"][:, 0])
        self.duration_alone.add(block["duration_alone_s"][:, 0])
        ratio = separation_ratio(block["horizontal_m"], block["vertical_m"], *self._size)
        self.distances["ratio"].add(ratio)
        self.distances["ratio_of_events"].add(ratio[~np.isnan(block["t_true_s"])])
        self.distances["ratio_alone"].add(
            separation_ratio(block["horizontal_alone_m"], block["vertical_alone_m"], *self._size)
        )
        self.distances["horizontal"].add(block["horizontal_m"])
        self.distances["horizontal_alone"].add(block["horizontal_alone_m"])

    def merge(self, other: Self) -> None:
        """Add the encounters of another tally of the same experiment."""
        for name in ("encounters", "pairs", "full_tier", "least_bad"):
            setattr(self, name, getattr(self, name) + getattr(other, name))
        for name in ("in_run", "other", "maneuvered", "unnecessary", "maneuvers", "extra_path"):
            getattr(self, name).merge(getattr(other, name))
        self.duration.merge(other.duration)
        self.duration_alone.merge(other.duration_alone)
        for mine, theirs in zip(self.detectors, other.detectors, strict=True):
            mine.merge(theirs)
        for name, paired in self.volumes.items():
            paired.merge(other.volumes[name])
        for name, histogram in self.distances.items():
            histogram.merge(other.distances[name])


def separation_ratio(
    horizontal: NDArray[np.float64], vertical: NDArray[np.float64], radius: float, half_height: float
) -> NDArray[np.float64]:
    """Return the size of the cylinder, as a multiple of the collision volume, on whose surface an intruder was.

    Parameters
    ----------
    horizontal, vertical : ndarray
        Separations, m; the vertical one of either sign.
    radius, half_height : float
        Of the volume, m.
    """
    return np.maximum(horizontal / radius, np.abs(vertical) / half_height)
