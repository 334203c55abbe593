"""Our multi-target trackers beside Stone Soup's on the same radar plots, in the same run."""

import numpy as np

from benchmarks import stonesoup_trackers
from benchmarks.timing import cpu_seconds
from wideberth.evaluation.plot_run import load_tracker
from wideberth.evaluation.tracking_metrics import score_run
from wideberth.plots import Plots
from wideberth.sensors.radar.plot_file import PlotTruth
from wideberth.simulation.radar_plots import radar_plots, straight_flights
from wideberth.tracking.track_table import TrackTable

SEED = 2026
SCANS, FALSE_PLOTS_MAX = 600, 3
BESIDE = 5  # aircraft in the scene that all fly
OURS = ("wideberth", "rransac", "er_rransac")
CROWDS = (20, 50, 200)  # of ours alone, to see how the cost grows


def measure() -> dict[str, float | str]:
    """Return CPU ms a scan and OSPA after 10 s of all, and the ratios to Stone Soup."""
    plots, truth = _made(BESIDE, 1.0)
    results: dict[str, float | str] = {"aircraft": float(BESIDE)}
    for name in OURS:
        results |= _ours(name, plots, truth, name)
    density = stonesoup_trackers.clutter_density(plots, FALSE_PLOTS_MAX / 2)
    for kind in ("gnn", "jpda"):
        rows, seconds = stonesoup_trackers.track(plots, kind, density, plots.n_scans)
        results[f"stone_soup_{kind}_ms_a_scan"] = seconds * 1e3
        results[f"stone_soup_{kind}_ospa_m"] = _ospa(_table(rows), plots, truth)
        results[f"ratio_to_stone_soup_{kind}"] = seconds * 1e3 / float(results["wideberth_ms_a_scan"])
        results[f"ospa_over_stone_soup_{kind}"] = float(results["wideberth_ospa_m"]) / float(
            results[f"stone_soup_{kind}_ospa_m"]
        )
    for targets in CROWDS:
        plots, truth = _made(targets, 3.0)
        results |= _ours("wideberth", plots, truth, f"wideberth_{targets}_aircraft")
    return results


def _made(aircraft: int, extent: float) -> tuple[Plots, PlotTruth]:
    rng = np.random.default_rng(SEED)
    flights = straight_flights(rng, aircraft, SCANS, extent=extent)
    return radar_plots(rng, *flights, clutter_max=FALSE_PLOTS_MAX, range_max=600.0 * extent)


def _ours(name: str, plots: Plots, truth: PlotTruth, key: str) -> dict[str, float]:
    make = load_tracker(name)
    table = make().run(plots)
    seconds = cpu_seconds(lambda: make().run(plots), repeats=3)
    return {f"{key}_ms_a_scan": seconds / plots.n_scans * 1e3, f"{key}_ospa_m": _ospa(table, plots, truth)}


def _ospa(table: TrackTable, plots: Plots, truth: PlotTruth) -> float:
    score = score_run(table, truth, plots.t)
    return float(np.mean(score.scans.ospa[score.settled]))


def _table(rows: list[stonesoup_trackers.Row]) -> TrackTable:
    numbers = {name: k for k, name in enumerate(dict.fromkeys(row.track for row in rows))}
    x = np.zeros((len(rows), 9))
    x[:, :6] = [row.state for row in rows]
    return TrackTable(
        scan=np.array([row.scan for row in rows], np.int32),
        track_id=np.array([numbers[row.track] for row in rows], np.int64),
        x=x,
        P=np.tile(np.eye(9), (len(rows), 1, 1)),
        existence=np.ones(len(rows)),
        is_ownship=np.zeros(len(rows), np.bool_),
    )
