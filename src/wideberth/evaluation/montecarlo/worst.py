"""The encounters worth a look: the closest, and those in which a volume was entered; a bounded list of each."""

import shlex
from collections.abc import Mapping
from typing import Any

import numpy as np

from wideberth.evaluation.montecarlo import rows
from wideberth.evaluation.montecarlo.experiment import Experiment
from wideberth.evaluation.montecarlo.tally import BoolArray, Columns, separation_ratio

CLOSEST_MAX = 10
"""Closest encounters kept for each number of intruders."""

ENTERED_MAX = 50
"""Encounters kept, the closest first, in which a volume was entered, for each number of intruders."""

Row = dict[str, Any]


class WorstEncounters:
    """Collects the worst encounters of a stream of blocks, by the closest intruder of each.

    Parameters
    ----------
    experiment : Experiment
    settings : mapping
        Of the run: ``experiment_path``, ``seed``, ``avoidance``, ``overrides`` tell how to replay an encounter.
    """

    def __init__(self, experiment: Experiment, settings: Mapping[str, Any]) -> None:
        scoring = experiment.scoring
        self._size = scoring.violation_radius_m, scoring.violation_half_height_m
        # What the set is there to prevent.
        self.entered_volume = "violation" if scoring.paper == "collision" else "loss_of_self_separation"
        self._entered_bit = rows.VOLUME_FULL if scoring.paper == "collision" else rows.LOSS
        self._experiment, self._settings = experiment, settings
        self._closest: dict[int, list[Row]] = {}
        self._entered: dict[int, list[Row]] = {}

    def add(self, k: int, block: Columns) -> None:
        """Add encounters.

        Parameters
        ----------
        k : int
            Number of intruders.
        block : dict of str to ndarray, shape (n, k)
        """
        ratio = separation_ratio(block["horizontal_m"], block["vertical_m"], *self._size)
        # Of an encounter in which the volume was entered the intruder that did, else the closest.
        inside = (block["inside"] & self._entered_bit) != 0
        entered = inside.any(axis=1)
        order = np.where(inside | ~entered[:, None], ratio, np.inf)
        worst = order.argmin(axis=1)
        for kept, limit, mask in (
            (self._closest, CLOSEST_MAX, np.ones_like(entered)),
            (self._entered, ENTERED_MAX, entered),
        ):
            kept[k] = self._best(kept.get(k, []), limit, mask, ratio, worst, block)

    def _best(
        self, kept: list[Row], limit: int, mask: BoolArray, ratio: np.ndarray, worst: np.ndarray, block: Columns
    ) -> list[Row]:
        """Return the rows with the least ratio among those kept and those of the block."""
        which = np.flatnonzero(mask)
        if which.size == 0:
            return kept
        closest = ratio[which, worst[which]]
        # A tie goes to the smaller number, so that the order of blocks does not matter.
        first = np.lexsort((block["encounter"][which, 0], closest))[:limit]
        rows_new = [self._row(block, int(i), int(worst[i]), float(ratio[i, worst[i]])) for i in which[first]]
        return sorted([*kept, *rows_new], key=lambda row: (row["separation_ratio"], row["encounter"]))[:limit]

    def _row(self, block: Columns, i: int, j: int, ratio: float) -> Row:
        inside = int(block["inside"][i, j])
        k, encounter = int(block["intruders"][i, j]), int(block["encounter"][i, j])
        t_maneuver = float(block["t_maneuver_s"][i, j])
        return {
            "intruders": k,
            "encounter": encounter,
            "intruder": int(block["intruder"][i, j]),
            "separation_ratio": ratio,
            "horizontal_m": float(block["horizontal_m"][i, j]),
            "vertical_m": float(block["vertical_m"][i, j]),
            "horizontal_alone_m": float(block["horizontal_alone_m"][i, j]),
            "vertical_alone_m": float(block["vertical_alone_m"][i, j]),
            "t_cpa_s": float(block["t_cpa_s"][i, j]),
            "t_maneuver_s": None if np.isnan(t_maneuver) else t_maneuver,
            "violation": bool(inside & rows.VOLUME_FULL),
            "loss_of_self_separation": bool(inside & rows.LOSS),
            "loss_of_self_separation_filtered": bool(inside & rows.LOSS_FILTERED),
            "command": self._command(k, encounter),
        }

    def _command(self, k: int, encounter: int) -> str:
        path = str(self._settings.get("experiment_path") or f"experiments/{self._experiment.name}.toml")
        parts = [
            "wideberth",
            "run",
            "--encounter",
            f"{path}:{k}-{encounter}",
            "--out",
            f"out/{k}-{encounter}",
        ]
        # Always told: the file may name another seed than the run had.
        parts += ["--seed", str(self._settings.get("seed", self._experiment.seed))]
        if self._settings.get("avoidance") is False:
            parts.append("--no-avoidance")
        for override in self._settings.get("overrides") or ():
            parts += ["--set", str(override)]
        return shlex.join(parts)

    def closest(self) -> list[Row]:
        """Return the closest encounters of each number of intruders."""
        return [row for k in sorted(self._closest) for row in self._closest[k]]

    def entered(self) -> list[Row]:
        """Return the encounters of each number of intruders in which the volume was entered."""
        return [row for k in sorted(self._entered) for row in self._entered[k]]
