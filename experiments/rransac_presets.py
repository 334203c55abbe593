"""The presets of R-RANSAC and ER-RANSAC on files of radar plots, and what each fault of the printed recipe costs.

Run: ``python -m experiments.rransac_presets FILE.npz ...``; the first file is also that of the second table, in which
table 4.5 is repaired step by step. CPU time is the least of all runs, by process time.
"""

import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from wideberth.evaluation.tracking_metrics import score_run, summarise
from wideberth.sensors.radar.plot_file import PlotFile, read_plot_file
from wideberth.tracking.rransac.tracker import ErRransacTracker, RransacArticleTracker, RransacTracker

PRESETS: tuple[tuple[str, type[RransacTracker], Mapping[str, Any]], ...] = (
    ("rransac thesis", RransacTracker, {}),
    ("rransac_article thesis", RransacArticleTracker, {}),
    ("rransac robust", RransacTracker, {"preset": "robust"}),
    ("rransac robust, noise_density 1", RransacTracker, {"preset": "robust", "noise_density": (1.0, 1.0, 1.0)}),
    ("er_rransac thesis", ErRransacTracker, {}),
    ("er_rransac robust", ErRransacTracker, {"preset": "robust"}),
    ("er_rransac robust, turning", ErRransacTracker, {"preset": "robust", "hypothesis": "turning"}),
    ("er_rransac robust, linear", ErRransacTracker, {"preset": "robust", "hypothesis": "linear"}),
)
_FREE = 1e9
REPAIRS: tuple[tuple[str, Mapping[str, Any]], ...] = (
    ("as printed", {}),
    ("the gate of table 3.3: 17.5, 3.5, 3.5 sigma", {"gate_sigmas": (17.5, 3.5, 3.5)}),
    ("covariances of the plots for R", {"update": "tangent"}),
    ("one plot to one track", {"weighting": "nearest"}),
    ("Mahalanobis gate", {"gate": "mahalanobis", "gate_mahalanobis": 5.0}),
    (
        "births from unused plots, 4 of them",
        {"consensus_ratio": 0.08, "births_from": "unassociated"},
    ),
    ("good at birth", {"begin_ratio": 0.08, "end_ratio": 0.0, "lifetime_scans": None}),
    (
        "window of 15 scans, reach, wider hypotheses",
        {
            "window_scans": 15,
            "consensus_ratio": 0.26,
            "begin_ratio": 0.26,
            "hypothesis_sigmas": (4.0, 3.0, 3.0),
            "speed_max_mps": 100.0,
        },
    ),
    (
        "constant velocity, q 1e-4",
        {
            "model": "constant_velocity",
            "process_noise_per_s": (0.0,) * 9,
            "noise_density": (1e-4, 1e-4, 1e-4),
            "merge_thresholds": (15.0, 15.0, 15.0, 5.0, 5.0, 5.0, _FREE, _FREE, _FREE),
            "covariance_inflation": 100.0,
            "misses_max": 8,
            "report_in_sight_only": True,
        },
    ),
)
HEAD = (
    "OSPA, m | missed | first, s | false tracks | switches | RMSE m / m/s | NEES a degree | own / mistaken | "
    "CPU ms a scan"
)


def measure(kind: type[RransacTracker], settings: Mapping[str, Any], file: PlotFile) -> str:
    """Return the cells of a tracker's row: all runs of a file."""
    scores, cpu = [], []
    kind(kind.Config(**settings)).run(file.scans(file.seeds()[0]))
    for seed in file.seeds():
        plots = file.scans(seed)
        tracker = kind(kind.Config(**settings))
        start = time.process_time()
        table = tracker.run(plots)
        cpu.append(time.process_time() - start)
        if file.truth is None:
            raise SystemExit(f"{file.name} has no truth")
        scores.append(score_run(table, file.truth, plots.t))
    m = summarise(scores)
    own = "-" if m["ownship_identified"] is None else f"{m['ownship_identified']:.2f}"
    never = f" ({m['never_confirmed']} never)" if m["never_confirmed"] else ""
    return (
        f"{m['ospa_m']:.2f} | {100 * m['missed_fraction']:.1f} % | {m['first_confirmed_s']:.2f}{never} | "
        f"{m['false_tracks']} | {m['identity_switches']} | {m['rmse_position_m']:.2f} / {m['rmse_velocity_mps']:.2f} | "
        f"{m['nees_per_dof']:.2g} | {own} / {m['intruder_taken_for_ownship_scans']} | "
        f"{1e3 * min(cpu) / len(file.t):.3f}"
    )


def main() -> None:
    """Print the tables."""
    files = [read_plot_file(Path(name)) for name in sys.argv[1:]]
    if not files:
        raise SystemExit(__doc__)
    rule = "| --- " * 2 + "| ---: " * 9 + "|"
    print(f"| set | tracker | {HEAD} |\n{rule}")
    for file in files:
        for name, kind, settings in PRESETS:
            print(f"| {Path(file.name).stem} | {name} | {measure(kind, settings, file)} |", flush=True)
    print(f"\n| {Path(files[0].name).stem} | each with those above | {HEAD} |\n{rule}")
    together: dict[str, Any] = {}
    for number, (name, settings) in enumerate(REPAIRS):
        together.update(settings)
        print(f"| {number} | {name} | {measure(RransacTracker, together, files[0])} |", flush=True)


if __name__ == "__main__":
    main()
