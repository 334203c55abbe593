"""The page and the maps of the ground radar study."""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib import rc_context

from experiments.flight_pictures import FlightTrace, draw_flight
from wideberth import __version__
from wideberth.evaluation.montecarlo.intervals import paired_ratio, wilson
from wideberth.evaluation.report_style import RC, new_figure, png

CASES = {
    "gbr_1": "gbr_1, plots",
    "gbr_1_fixed_wing": "gbr_1, plots, fixed wing",
    "gbr_1_samples": "gbr_1, samples",
    "gbr_2": "gbr_2, plots",
    "gbr_2_fixed_wing": "gbr_2, plots, fixed wing",
    "gbr_2_samples": "gbr_2, samples",
    "straight": "random, straight",
    "maneuvering": "random, maneuvering",
}
_RADIUS, _HALF_HEIGHT = 153.0, 30.5
Row = Mapping[str, Any]


def markdown(cases: Mapping[str, Sequence[Row]], planned: Mapping[str, int], command: str) -> str:
    """Return the page.

    Parameters
    ----------
    cases : mapping of str to sequence of dict
        The rows of each case, as `ground_radar_runs.fly` makes them.
    planned : mapping of str to int
        How many rows of each case were asked for.
    command : str
        What made them.
    """
    flown = {case: rows for case, rows in cases.items() if rows}
    lines = [
        "# The ground radar system",
        "",
        f"`{command}`: an up-looking 4 x 4 radar, the tracker `wideberth`, collision detection along the path, A* and"
        " the chain; a point mass flies, or where the row says so the twelve states of a fixed wing (zagi, 11 to"
        " 15 m/s). A violation is an intruder within 153 m and 30.5 m of height, on true states. The twins without"
        " avoidance fly by the true states alone, without sensors.",
        "",
        f"Flown with wideberth {__version__}: {_extent(flown, planned)}.",
        "",
        "## Violations",
        "",
        "Runs with one at least, with the 95 % interval of Wilson; the risk ratio's is that of paired proportions.",
        "",
        "| runs | with avoidance | 95 % | without | risk ratio | least bad path | causes |",
        "| --- | ---: | --- | ---: | --- | ---: | --- |",
        *(_violations(case, rows) for case, rows in flown.items()),
        "",
        "Causes: *no feasible path at first detection*: none of 375 maneuvers flown from the true state at the first"
        " track, among the true futures, keeps clear; *late detection*: at the first track one did, at the first alert"
        " or maneuver none; *track lost*: for more than a second in between; *planner*: the rest.",
        "",
        "## Paths, tracks and times",
        "",
        "A track is good when it is confirmed and within 30 m, counted from when the intruder is within the radar's"
        " 614 m. CPU is of one core: a cycle is tracking, detection, A* and chain; the factor of real time counts the"
        " simulation as well.",
        "",
        "| runs | path / mission, mean, max (above 1.25) | good track, median, 95 %, max, s | never good | ownship"
        " alerted on | cycle, mean, worst of a run (median, largest), ms | times real time | reversals |",
        "| --- | --- | --- | ---: | ---: | --- | ---: | ---: |",
        *(_numbers(case, rows) for case, rows in flown.items()),
        "",
        "The first seed of each, from above (circles of 153 m at the closest points) and over time:",
        "",
        "![The two scenarios, first seed](ground_radar.png)",
        "",
    ]
    return "\n".join(lines)


def _extent(flown: Mapping[str, Sequence[Row]], planned: Mapping[str, int]) -> str:
    """Return which seeds were flown, in words."""
    told = []
    for case, rows in flown.items():
        seeds = sorted({row["seed"] for row in rows})
        short = "" if len(rows) == planned[case] else f" ({len(rows)} of {planned[case]} flights so far)"
        told.append(f"{CASES[case]}: {len(seeds)} seeds, {seeds[0]} to {seeds[-1]}{short}")
    return "; ".join(told)


def _violations(case: str, rows: Sequence[Row]) -> str:
    avoided = {row["seed"]: row for row in rows if row["avoid"]}
    alone = {row["seed"]: row for row in rows if not row["avoid"]}
    bad = {seed for seed, row in avoided.items() if row["violations"]}
    low, high = wilson(len(bad), len(avoided)) or (0.0, 1.0)
    without, ratio = "-", "-"
    if alone:
        worse = {seed for seed, row in alone.items() if row["violations"]}
        without = f"{len(worse)} of {len(alone)}"
        between = paired_ratio(len(bad & worse), len(bad - worse), len(worse - bad))
        if between is not None:
            ratio = f"{len(bad) / len(worse):.3f} ({between[0]:.3f} to {between[1]:.3f})"
    causes = Counter(cause for row in avoided.values() for cause in row["causes"])
    told = ", ".join(f"{cause}: {count}" for cause, count in causes.most_common()) or "-"
    least_bad = sum(row["least_bad"] > 0 for row in avoided.values())
    return (
        f"| {CASES[case]} | {len(bad)} of {len(avoided)} | {100 * low:.1f} to {100 * high:.1f} % | {without} |"
        f" {ratio} | {least_bad} | {told} |"
    )


def _numbers(case: str, rows: Sequence[Row]) -> str:
    avoided = [row for row in rows if row["avoid"]]
    paths = np.array([row["path_ratio"] for row in avoided])
    good = np.array([one for row in avoided for one in row["good_track_s"]])
    cycles = [row["cycle_ms"] for row in avoided]
    mean = np.average([one["mean"] for one in cycles], weights=[one["steps"] for one in cycles])
    worst = np.sort([one["max"] for one in cycles])
    tracks = "-" if not good.size else f"{np.median(good):.1f}, {np.quantile(good, 0.95):.1f}, {good.max():.1f}"
    return (
        f"| {CASES[case]} | {paths.mean():.3f}, {paths.max():.3f} ({(paths > 1.25).sum()}) | {tracks} |"
        f" {sum(row['never_tracked'] for row in avoided)} | {sum(row['own_alerts'] for row in avoided)} |"
        f" {mean:.2f}, {np.median(worst):.1f}, {worst[-1]:.1f} |"
        f" {np.median([row['real_time_factor'] for row in avoided]):.1f} | {sum(row['reversals'] for row in avoided)} |"
    )


def maps(rows: Sequence[Row]) -> dict[str, bytes]:
    """Return the pictures of the first seed of the two scenarios, from above and from the side, by file name."""
    drawn = [row for row in rows if row["case"] in ("gbr_1", "gbr_2") and "map" in row]
    if not drawn:
        return {}
    with rc_context(RC):
        figure = new_figure(7.6, 3.2 * len(drawn))
        grid = figure.add_gridspec(len(drawn), 2)
        for k, row in enumerate(drawn):
            t, own, intruders = (np.array(row["map"][name]) for name in ("t", "own", "intruders"))
            trace = FlightTrace(t, own, intruders, own[[0, -1]], _RADIUS, _HALF_HEIGHT)
            draw_flight(figure, (grid[k, 0], grid[k, 1]), trace, row["case"])
        return {"ground_radar.png": png(figure)}
