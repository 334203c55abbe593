"""Where R-RANSAC fails and ER-RANSAC does not: aircraft that turn ever faster (thesis, section 6.2.2, leaves it open).

One aircraft flies at 15 m/s on a level circle, 200 m from a radar with the noise, missed plots and clutter of the
thesis (section 3.3.5: 0.4 m, 1 deg, 1 deg; 0.8; 0 to 3 plots a scan). All else is equal between the two trackers: the
gate, the window, the support that a track needs. R-RANSAC has the process noise that serves it best at each turn rate,
which nobody can choose beforehand; ER-RANSAC has one for all.

Run: ``python -m experiments.rransac_study``; it prints the tables and writes ``docs/results/rransac_study.md``.
"""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from wideberth.evaluation.tracking_metrics import score_run, summarise
from wideberth.plots import Plots
from wideberth.sensors.radar.plot_file import PlotTruth
from wideberth.tracking.rransac.tracker import ErRransacTracker, RransacTracker

PAGE = Path(__file__).resolve().parents[1] / "docs" / "results" / "rransac_study.md"
RATES_DEG_S = (0.0, 5.0, 10.0, 20.0, 30.0)
SEEDS = 6
TRIALS = 20
SCANS = 600
STEP_S = 0.1
SPEED = 15.0
SIGMA = (0.4, math.radians(1.0), math.radians(1.0))
DENSITIES = (1e-4, 1e-2, 1.0)

# Tables 3.3 and 3.4 but for the model; the plots' own covariances, as R of table 4.5 would count against R-RANSAC.
LONG_WINDOW: Mapping[str, Any] = {
    "window_scans": 150,
    "gate_sigmas": (17.5, 3.5, 3.5),
    "begin_ratio": 0.4,
    "end_ratio": 0.3,
    "consensus_ratio": 0.3,
    "lifetime_scans": 20,
    "ransac_iterations": TRIALS,
    "update": "tangent",
    "process_noise_per_s": (0.0,) * 9,
}
LONG_TURNING: Mapping[str, Any] = {"preset": "thesis", "ransac_iterations": TRIALS, "update": "tangent"}


def circle(rate_deg_s: float, seed: int) -> tuple[Plots, PlotTruth]:
    """Return the plots and the truth of one flight."""
    rng = np.random.default_rng([seed, round(10 * rate_deg_s)])
    t = STEP_S * np.arange(SCANS, dtype=np.float64)
    rate = math.radians(rate_deg_s)
    course = rate * t
    position = np.zeros((SCANS, 3))
    if rate == 0.0:
        position[:, 0] = SPEED * (t - t[-1] / 2)
    else:
        position[:, 0] = SPEED / rate * np.sin(course)
        position[:, 1] = SPEED / rate * (1 - np.cos(course))
    position += (100.0, 170.0, -80.0)
    velocity = SPEED * np.stack([np.cos(course), np.sin(course), np.zeros(SCANS)], axis=1)
    rows, first = [], [0]
    for p in position:
        scan = []
        if rng.random() < 0.8:
            ground = math.hypot(p[0], p[1])
            true = (math.hypot(ground, p[2]), math.atan2(p[1], p[0]), math.atan2(-p[2], ground))
            scan.append(true + rng.normal(size=3) * SIGMA)
        for _ in range(rng.integers(0, 4)):
            scan.append(np.array([rng.uniform(20, 600), rng.uniform(-math.pi, math.pi), rng.uniform(0, math.pi / 2)]))
        rows += [scan[i] for i in rng.permutation(len(scan))]
        first.append(len(rows))
    z = np.full((len(rows), 4), np.nan)
    z[:, :3] = rows
    plots = Plots(
        first=np.array(first, dtype=np.int64),
        z=z,
        t=t,
        sensor_position=np.zeros((SCANS, 3)),
        sensor_attitude=np.tile(np.eye(3), (SCANS, 1, 1)),
        sigma=np.array([*SIGMA, np.nan]),
        detection_probability=0.8,
        range_max=600.0,
        field_of_view=(math.pi, math.pi / 2),
        dt=STEP_S,
        ownship=np.full((SCANS, 6), np.nan),
    )
    truth = PlotTruth(position[:, None], velocity[:, None], np.ones((SCANS, 1), dtype=np.bool_), -1)
    return plots, truth


def measure(tracker: type[RransacTracker], settings: Mapping[str, Any], rate: float) -> dict[str, Any]:
    """Return the metrics of a tracker over all seeds."""
    runs = []
    for seed in range(SEEDS):
        plots, truth = circle(rate, seed)
        runs.append(score_run(tracker(tracker.Config(**settings)).run(plots), truth, plots.t))
    return summarise(runs)


def best_linear(settings: Mapping[str, Any], rate: float) -> tuple[float, dict[str, Any]]:
    """Return the process noise with which R-RANSAC has the smallest OSPA, and its metrics."""
    results = [(q, measure(RransacTracker, {**settings, "noise_density": (q,) * 3}, rate)) for q in DENSITIES]
    return min(results, key=lambda result: float(result[1]["ospa_m"]))


def row(result: Mapping[str, Any]) -> str:
    """Return the cells of one tracker."""
    if result["rmse_position_m"] is None:
        return f"{result['ospa_m']:.1f} | {100 * result['missed_fraction']:.0f} % | - | - | -"
    first = result["first_confirmed_s"]
    return (
        f"{result['ospa_m']:.1f} | {100 * result['missed_fraction']:.0f} % | {first:.1f} | "
        f"{result['rmse_position_m']:.1f} / {result['rmse_velocity_mps']:.1f} | "
        f"{result['identity_switches'] / SEEDS:.1f}"
    )


def table(title: str, linear: Mapping[str, Any], turning: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """Return one comparison as a table."""
    head = "OSPA, m | missed | first, s | RMSE m, m/s | switches"
    lines = [f"## {title}", "", f"| turn, deg/s | tracker | {head} |", "| ---: | --- " + "| ---: " * 5 + "|"]
    for rate in RATES_DEG_S:
        density, result = best_linear(linear, rate)
        lines.append(f"| {rate:g} | R-RANSAC, q {density:g} | {row(result)} |")
        for name, settings in turning.items():
            lines.append(f"| | {name} | {row(measure(ErRransacTracker, settings, rate))} |")
    return [*lines, ""]


def main() -> None:
    """Run the study."""
    lines = [
        "# Where R-RANSAC fails and ER-RANSAC does not",
        "",
        "`python -m experiments.rransac_study`. One aircraft at 15 m/s on a level circle, about 200 m from the radar;",
        f"0.4 m, 1 deg, 1 deg, detected 8 times in 10, 0 to 3 clutter plots a scan; {SEEDS} runs of {SCANS} scans of",
        f"{STEP_S:g} s. R-RANSAC (constant acceleration) has the best process noise q of",
        f"{', '.join(f'{q:g}' for q in DENSITIES)} m2/s5 at each turn rate; ER-RANSAC has that of table 3.3 (first",
        "table) or of its preset (second) at all. Missed: of the scans after 10 s; switches: in each run of a minute.",
        "",
        *table(
            "The window of the thesis: 15 s, 45 plots for a track",
            LONG_WINDOW,
            {
                "ER-RANSAC": LONG_TURNING,
                "the same, 100 steps": {**LONG_TURNING, "step_count_max": 100},
            },
        ),
        "R-RANSAC finds no parabola through 45 plots of a circle, and where it does, its velocity is off by several",
        "m/s. With the 30 steps of table 3.5, of 1 deg/s each, Gauss-Newton hardly reaches 30 deg/s from a straight",
        "line: with more steps it can.",
        "",
        *table(
            "A short window: preset robust, 1.5 to 2 s, 4 or 5 plots for a track",
            {"preset": "robust", "model": "constant_acceleration", "covariance_inflation": 1.0},
            {"ER-RANSAC": {"preset": "robust"}},
        ),
        "A short window sees little of the turn: both find tracks at once. The parabola then costs accuracy only, most",
        "in the velocity: 8 m/s at 30 deg/s, with which a closest point of approach half a minute ahead means nothing.",
        "",
    ]
    print("\n".join(lines))
    PAGE.write_text("\n".join(lines), encoding="utf-8")


if __name__ == "__main__":
    main()
