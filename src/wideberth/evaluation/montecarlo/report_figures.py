"""The pictures of a Monte Carlo report."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, NullFormatter, NullLocator
from numpy.typing import NDArray

from wideberth.evaluation.montecarlo import paper
from wideberth.evaluation.montecarlo.experiment import Experiment
from wideberth.evaluation.report_style import (
    FAINT,
    INK,
    LIMIT,
    MANEUVER,
    MISSION,
    MUTED,
    OWNSHIP,
    PAPER,
    RC,
    TRAFFIC,
    new_figure,
)
from wideberth.units import FOOT, NAUTICAL_MILE

Summary = Mapping[str, Any]

_DETECTOR_STYLES: dict[str, tuple[str, Any, str]] = {
    "algorithm_1": (MANEUVER, "-", "s"),
    "algorithm_2_printed": (TRAFFIC[0], (0, (6, 2)), "D"),
    "algorithm_2_track": (TRAFFIC[1], (0, (4, 1.5, 1, 1.5)), "^"),
    "default": (OWNSHIP, "-", "o"),
}


def counts_figure(summary: Summary, experiment: Experiment) -> Figure:
    """Return figure 8 or 9 of the paper, of this run: five counts for each number of intruders.

    The axis is logarithmic, for the counts are between none and thousands; each bar carries its number.
    """
    collision = experiment.scoring.paper == "collision"
    paper_set = paper.SETS[experiment.scoring.paper]
    event = "collision" if collision else "conflict"
    entered = "violations" if collision else "loss_of_self_separation"
    series = (
        ("true_events", f"true {event}s", MISSION),
        ("correct", "detected correctly", OWNSHIP),
        ("missed", "missed", TRAFFIC[0]),
        ("false_alarms", "false alarms", TRAFFIC[3]),
        (entered, "collision volume entered" if collision else "self-separation lost", LIMIT),
    )
    told = {"true_events": paper_set.true_events, entered: paper_set.entered_by_intruders}
    with rc_context(RC):
        figure = new_figure(9.6, 3.7)
        axes = figure.add_subplot()
        sets, width = summary["by_intruders"], 0.16
        for j, (key, title, colour) in enumerate(series):
            values = [counts[key] for counts in sets]
            x = np.arange(len(sets)) + (j - 2) * (width + 0.012)
            axes.bar(x, [max(v - 0.5, 0.0) for v in values], width, bottom=0.5, color=colour, label=title, zorder=3)
            for k, (at, value) in enumerate(zip(x, values, strict=True)):
                axes.annotate(
                    f"{value:,}",
                    (at, max(value, 0.5)),
                    (0, 2),
                    textcoords="offset points",
                    ha="center",
                    va="bottom",
                    fontsize=7.6 if value < 10_000 else 7.0,
                    color=INK if value else MUTED,
                )
                number = told.get(key, {}).get(sets[k]["intruders"])
                if number and summary["pooled"]["encounters"] == paper_set.encounters:
                    axes.plot(at, number, "D", color=PAPER, markeredgecolor=INK, markersize=5.5, zorder=5)
        axes.set_yscale("log")
        most = max(max(counts[key] for counts in sets) for key, _, _ in series)
        axes.set_ylim(0.5, 6 * max(most, 2))
        axes.yaxis.set_major_locator(LogLocator(10))
        axes.yaxis.set_major_formatter(FuncFormatter(lambda y, _: f"{y:,.0f}"))
        axes.yaxis.set_minor_locator(NullLocator())
        axes.set_xticks(range(len(sets)), [_intruders(c["intruders"]) for c in sets])
        axes.tick_params(axis="x", length=0)
        axes.grid(axis="x", visible=False)
        axes.set_ylabel("intruders, of all encounters")
        handles, titles = axes.get_legend_handles_labels()
        if paper_set.true_events and summary["pooled"]["encounters"] == paper_set.encounters:
            handles.append(Line2D([], [], marker="D", linestyle="", color=PAPER, markeredgecolor=INK, markersize=5.5))
            titles.append("paper's text")
        figure.legend(handles, titles, loc="outside upper left", ncols=6, columnspacing=1.3, handlelength=1.2)
    return figure


def _intruders(count: int) -> str:
    return f"{count} intruder{'' if count == 1 else 's'}"


def curves_figure(summary: Summary, experiment: Experiment) -> Figure:
    """Return P_cd against P_fa of the detectors and the ideal one, on scales that open up the corner that matters."""
    events = max(summary["pooled"]["true_events"], 1)
    paper_cd, paper_fa = paper.SETS[experiment.scoring.paper].mean_pair()
    shown = [d for d in summary["detectors"] if d["p_cd"] is not None and d["p_fa"] is not None]
    most_missed = max([1 - paper_cd, *(1 - d["p_cd"] for d in shown)])
    most_false = max([paper_fa, *(d["p_fa"] for d in shown)])
    floor = max(10.0 ** math.floor(math.log10(0.5 / events)), 1e-5)
    with rc_context(RC):
        figure = new_figure(9.6, 4.3)
        axes = figure.add_subplot()
        ideal = summary["ideal_detector"]
        _curve(axes, ideal["curve"], floor, color=MUTED, linestyle=(0, (1, 1.6)), linewidth=2.0, label="ideal detector")
        for detector in summary["detectors"]:
            colour, dashes, marker = _DETECTOR_STYLES[detector["name"]]
            _curve(axes, detector["curve"], floor, color=colour, linestyle=dashes, linewidth=2.0)
            p_cd, p_fa = detector["p_cd"], detector["p_fa"]
            if p_cd is not None and p_fa:
                axes.plot(p_fa, max(1 - p_cd, floor), marker, color=colour, markersize=8, zorder=6, clip_on=False)
            axes.plot([], [], color=colour, linestyle=dashes, marker=marker, linewidth=2.0, label=detector["title"])
        axes.plot(
            paper_fa,
            max(1 - paper_cd, floor),
            "*",
            color=LIMIT,
            markersize=14,
            zorder=7,
            label="paper, mean of its table",
        )
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_xlim(10.0 ** math.floor(math.log10(paper_fa) - 0.5), min(10.0 * most_false, 1.0))
        axes.set_ylim(min(max(4.0 * most_missed, 0.05), 1.0), floor)
        axes.set_xlabel("P_fa, false alarms for each intruder that is no event")
        axes.set_ylabel("P_cd, correct detections for each event")
        ticks = [v for v in (0.8, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 5e-3, 2e-3, 1e-3, 1e-4, 1e-5) if v >= floor]
        axes.yaxis.set_major_locator(FixedLocator(ticks))
        axes.yaxis.set_major_formatter(FuncFormatter(lambda y, _: f"{1 - y:.5f}".rstrip("0")))
        axes.yaxis.set_minor_formatter(NullFormatter())
        axes.yaxis.set_minor_locator(NullLocator())
        axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}" if x >= 1e-4 else f"{x:.5f}".rstrip("0")))
        axes.xaxis.set_minor_formatter(NullFormatter())
        figure.legend(loc="outside right upper", fontsize=8.6)
    return figure


def _curve(axes: Axes, points: Sequence[Mapping[str, float]], floor: float, **style: Any) -> None:
    # Zeros have no logarithm: they are drawn on the edge.
    x = [max(p["p_fa"], 1e-6) for p in points]
    y = [max(1 - p["p_cd"], floor / 10) for p in points]
    axes.plot(x, y, zorder=4, **style)


def miss_figure(summary: Summary, experiment: Experiment) -> Figure:
    """Return how close intruders came, with and without avoidance: the tail on the left, the bulk on the right."""
    d, scoring = summary["miss_distances"], experiment.scoring
    collision = scoring.paper == "collision"
    curves = (
        ("ratio_alone", "without avoidance", MISSION, (0, (5, 2))),
        ("ratio", "with avoidance", OWNSHIP, "-"),
        ("ratio_of_events", "with avoidance, true events only", TRAFFIC[0], (0, (4, 1.5, 1, 1.5))),
    )
    with rc_context(RC):
        figure = new_figure(9.6, 3.9)
        left, right = figure.subplots(1, 2)
        edges = np.array(d["ratio_edges"])
        least = 1.0
        for key, title, colour, dashes in curves:
            counts = np.array(d[key])
            total = counts.sum()
            # The last bin holds what is beyond its upper edge: there the fraction is not known.
            fraction = np.cumsum(counts)[:-1] / max(total, 1)
            shown = fraction > 0
            if shown.any():
                least = min(least, float(fraction[shown][0]))
                left.plot(edges[1:-1][shown], fraction[shown], color=colour, linestyle=dashes, linewidth=2, label=title)
        left.set_xscale("log")
        left.set_yscale("log")
        left.set_ylim(10 ** math.floor(math.log10(least)), 1.3)
        radius, half_height = scoring.violation_radius_m, scoring.violation_half_height_m
        aircraft = min(scoring.aircraft_radius_m / radius, scoring.aircraft_half_height_m / half_height)
        distances = {1.0: "collision volume"}
        if collision:
            distances |= {aircraft: "aircraft size", 1 / 3: "a third"}
        else:
            distances |= {4000 * FOOT / radius: "4000 ft", scoring.volume_radius_m / radius: "conflict volume"}
        for x, name in distances.items():
            _limit(left, x, name)
        left.set_xlim((0.01, 20) if collision else (0.1, 200))
        left.set_title("closest approach, cumulative")
        left.set_xlabel("separation ratio (1: surface of the collision volume)")
        left.set_ylabel("fraction closer than that")
        left.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
        left.yaxis.set_major_locator(LogLocator(10, numticks=8))
        left.yaxis.set_minor_locator(NullLocator())

        unit, unit_name = (1.0, "m") if collision else (NAUTICAL_MILE, "nmi")
        edges = np.array(d["horizontal_edges_m"]) / unit
        alone, flown = np.array(d["horizontal_alone"]), np.array(d["horizontal"])
        last = _last_shown(alone, flown)
        for counts, colour, dashes in (
            (alone, MISSION, (0, (5, 2))),
            (flown, OWNSHIP, "-"),
        ):
            right.stairs(counts[:last], edges[: last + 1], color=colour, linewidth=1.8, linestyle=dashes, zorder=3)
        right.set_xlim(0, edges[last])
        right.set_ylim(0, 1.14 * max(1, int(alone[:last].max()), int(flown[:last].max())))
        for x, name in distances.items():
            if collision == (x == 1.0):
                _limit(right, x * radius / unit, name)
        right.set_title("horizontal distance at the closest approach")
        right.set_xlabel(f"horizontal distance, {unit_name}")
        right.set_ylabel(f"intruders in each {edges[1] * unit:,.0f} m")
        right.yaxis.set_major_formatter(FuncFormatter(lambda y, _: f"{y:,.0f}"))
        figure.legend(*left.get_legend_handles_labels(), loc="outside upper left", ncols=3)
    return figure


def _last_shown(*counts: NDArray[np.int64]) -> int:
    """Return after how many bins the rest are few; the last bin, which holds all beyond, is never shown."""
    total = np.sum(counts, axis=0)[:-1]
    enough = np.flatnonzero(np.cumsum(total) >= 0.995 * total.sum())
    return max(10, int(enough[0]) + 1) if enough.size and total.sum() else len(total)


def _limit(axes: Axes, x: float, name: str) -> None:
    axes.axvline(x, color=LIMIT, linewidth=1.1, linestyle=(0, (3, 2)), zorder=2)
    axes.annotate(
        name,
        (x, 1.0),
        (-3, -2),
        xycoords=("data", "axes fraction"),
        textcoords="offset points",
        rotation=90,
        ha="right",
        va="top",
        fontsize=8,
        color=LIMIT,
        bbox={"facecolor": PAPER, "edgecolor": "none", "pad": 1.0},
        zorder=5,
    )


def delay_figure(summary: Summary) -> Figure:
    """Return how long after the event the default detector detected it; negative: before."""
    histogram = summary["delay_histogram"]
    starts, counts = np.array(histogram["from_s"], float), np.array(histogram["counts"], float)
    with rc_context(RC):
        figure = new_figure(9.6, 2.9)
        axes = figure.add_subplot()
        if not len(counts):
            axes.text(
                0.5, 0.5, "no event was detected", ha="center", va="center", transform=axes.transAxes, color=MUTED
            )
            axes.set_axis_off()
            return figure
        late = starts >= 0
        width = 0.5
        for mask, colour, title in (
            (~late, TRAFFIC[1], "before the event: counted as no delay"),
            (late, OWNSHIP, "at the event or after it"),
        ):
            if mask.any():
                axes.bar(
                    starts[mask],
                    counts[mask],
                    width,
                    align="edge",
                    color=colour,
                    edgecolor=PAPER,
                    linewidth=0.4,
                    label=title,
                    zorder=3,
                )
        axes.set_yscale("log")
        axes.set_ylim(0.6, 2.5 * counts.max())
        axes.set_xlim(min(starts[0] - 1, -1), starts[-1] + 2)
        axes.yaxis.set_major_formatter(FuncFormatter(lambda y, _: f"{y:,.0f}"))
        axes.yaxis.set_minor_locator(NullLocator())
        p95 = summary["pooled"]["delay_s"]["p95"]
        if p95 is not None:
            axes.axvline(
                p95, color=MANEUVER, linewidth=1.4, linestyle=(0, (3, 2)), zorder=5, label=f"95 %: {p95:.1f} s"
            )
        axes.set_xlabel("detected after the event, s")
        axes.set_ylabel("events in each 0.5 s")
        figure.legend(loc="outside upper left", ncols=3)
    return figure


def sensitivity_figure(results: Sequence[Mapping[str, Any]]) -> Figure:
    """Return P_cd, P_fa, NMAC risk ratio and losses against NACp (above) and message loss (below), with intervals."""
    panels = (
        ("p_cd", "P_cd"),
        ("p_fa", "P_fa"),
        ("nmac_risk_ratio", "NMAC risk ratio"),
        ("losses_per_encounter", "losses of self-separation\nfor each encounter"),
    )
    rows = (("nacp", "NACp", 1.0), ("loss", "messages lost, %", 100.0))
    counts = sorted({r["intruders"] for r in results})
    colours = (OWNSHIP, TRAFFIC[0], TRAFFIC[1])
    with rc_context(RC):
        figure = new_figure(9.6, 4.9)
        grid = figure.subplots(2, 4, squeeze=False)
        for i, (parameter, label, scale) in enumerate(rows):
            mine = [r for r in results if r["parameter"] == parameter]
            own = [scale * r["value"] for r in mine if r["own"]]
            for j, (key, title) in enumerate(panels):
                axes = grid[i, j]
                values = sorted({scale * r["value"] for r in mine})
                apart = 0.02 * (values[-1] - values[0]) if values else 0.0
                for index, (k, colour) in enumerate(zip(counts, colours, strict=False)):
                    chosen = [r for r in mine if r["intruders"] == k]
                    # Beside each other, as their intervals overlap.
                    _errors(axes, chosen, key, scale, (2 * index - len(counts) + 1) * apart, colour, _intruders(k))
                if own:
                    axes.axvline(own[0], color=FAINT, linewidth=1.2, linestyle=(0, (3, 2)), zorder=1)
                if i == 0:
                    axes.set_title(title, fontsize=9.5)
                axes.set_xlabel(label)
                axes.set_xticks(values, [f"{v:g}" for v in values])
                low, high = axes.get_ylim()
                room = 0.03 * (high - low)
                axes.set_ylim(max(low, -room), min(high, 1.0 + room) if key == "p_cd" else max(high, 1e-3))
        handles, titles = grid[0, 0].get_legend_handles_labels()
        handles.append(Line2D([], [], color=FAINT, linewidth=1.2, linestyle=(0, (3, 2))))
        titles.append("this experiment")
        figure.legend(handles, titles, loc="outside upper left", ncols=4)
    return figure


def _errors(
    axes: Axes, results: Sequence[Mapping[str, Any]], key: str, scale: float, shift: float, colour: str, title: str
) -> None:
    known = [r for r in results if r[key] is not None and r[f"{key}_interval"] is not None]
    x = np.array([scale * r["value"] + shift for r in known])
    y = np.array([r[key] for r in known], float)
    bounds = np.array([r[f"{key}_interval"] for r in known], float).reshape(-1, 2)
    errors = np.abs(bounds - y[:, None]).T
    axes.errorbar(
        x, y, errors, color=colour, marker="o", markersize=4.5, linewidth=1.5, capsize=3, label=title, zorder=4
    )
