"""The pictures of a report against time: altitude, separation, alerts."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter, NullFormatter
from numpy.typing import NDArray

from wideberth.evaluation.flight_log import Encounter, FlightLog
from wideberth.evaluation.report_labels import Label, place_labels
from wideberth.evaluation.report_style import (
    FAINT,
    LEVELS,
    LIMIT,
    MANEUVER,
    MISSION,
    MUTED,
    OWNSHIP,
    PAPER,
    RC,
    VOLUME_NAMES,
    clock_axis,
    new_figure,
    traffic_colour,
    traffic_dashes,
)
from wideberth.frames import LocalFrame
from wideberth.types import AlertLevel, Mission
from wideberth.units import FOOT

FloatArray = NDArray[np.float64]

ROWS_MAX = 6
_NEAR_HORIZONTAL = 10_000.0
_TIMELINE_ROWS_MAX = 14
_LIMIT_STYLES: tuple[Any, ...] = ("-", (0, (5, 2)), (0, (1, 1.5)))


def altitude_figure(log: FlightLog, near: list[Encounter], mission: Mission | None, frame: LocalFrame) -> Figure:
    """Return altitude against time, in metres and feet, of the ownship, its mission and near aircraft."""
    with rc_context(RC):
        figure = new_figure(9.6, 3.6)
        axes = figure.add_subplot()
        t0, own_t, own = log.own.t[0], log.own.t, log.own.positions
        altitude = frame.to_geodetic(own)[2]
        labels, avoid = [], [np.column_stack([own_t - t0, altitude])[:: max(1, len(own_t) // 300)]]
        values = [altitude]
        for k, encounter in enumerate(near):
            close = encounter.horizontal < _NEAR_HORIZONTAL
            height = np.where(close, frame.to_geodetic(encounter.positions)[2], np.nan)
            axes.plot(
                encounter.t - t0, height, color=traffic_colour(k), linewidth=1.5, linestyle=traffic_dashes(k), zorder=3
            )
            c = encounter.closest
            axes.plot(encounter.t[c] - t0, height[c], "o", color=traffic_colour(k), markersize=5, zorder=5)
            avoid.append(np.column_stack([encounter.t - t0, height])[:: max(1, len(height) // 150)])
            labels.append(Label(float(encounter.t[c] - t0), float(height[c]), encounter.label, traffic_colour(k)))
            values.append(height[c : c + 1])
        if mission is not None:
            planned = frame.to_geodetic(_nearest_on_mission(own, mission))[2]
            axes.plot(own_t - t0, planned, color=MISSION, linewidth=1.4, linestyle=(0, (5, 3)), zorder=4)
            values.append(planned)
        axes.plot(own_t - t0, altitude, color=OWNSHIP, linewidth=2.4, zorder=6)
        _mark_maneuvers(axes, log)
        every = np.concatenate(values)
        low, high = float(np.nanmin(every)), float(np.nanmax(every))
        margin = max(40.0, 0.18 * (high - low))
        axes.set_ylim(low - margin, high + margin)
        axes.set_xlim(0, max(own_t[-1] - t0, 1.0))
        axes.set_ylabel("altitude, m")
        axes.set_xlabel("time since start, min:s")
        clock_axis(axes, own_t[-1] - t0)
        feet = axes.secondary_yaxis("right", functions=(_to_feet, _from_feet))
        feet.set_ylabel("ft")
        feet.spines["right"].set_visible(False)
        handles: list[Artist] = [
            Line2D([], [], color=OWNSHIP, linewidth=2.4, label="ownship"),
            Line2D([], [], color=MISSION, linewidth=1.4, linestyle=(0, (5, 3)), label="mission, at the nearest point"),
        ]
        if near:
            handles.append(Line2D([], [], color=MUTED, linewidth=1.5, label="near aircraft, while within 10 km"))
        if log.maneuvers:
            handles.append(Patch(facecolor=MANEUVER, alpha=0.14, label="maneuver flown"))
        figure.legend(handles=handles, loc="outside upper left", ncols=4)
        place_labels(axes, labels, avoid, size=8.8)
    return figure


def _to_feet(metres: Any) -> Any:
    return metres / FOOT


def _from_feet(feet: Any) -> Any:
    return feet * FOOT


def _nearest_on_mission(own: FloatArray, mission: Mission) -> FloatArray:
    """Return the point of the mission's path that is horizontally nearest to each position."""
    best, best_distance = np.full_like(own, np.nan), np.full(len(own), np.inf)
    for start, end in zip(mission.waypoints[:-1], mission.waypoints[1:], strict=True):
        leg = end - start
        length = float(leg[:2] @ leg[:2])
        part = np.clip((own - start)[:, :2] @ leg[:2] / length, 0, 1) if length > 0 else np.zeros(len(own))
        point = start + part[:, None] * leg
        distance = np.hypot(*(own - point)[:, :2].T)
        # Ties go to the later leg, so that a path flown back does not jump.
        nearer = distance <= best_distance
        best[nearer], best_distance[nearer] = point[nearer], distance[nearer]
    return best


def separation_figure(log: FlightLog, near: list[Encounter], summary: Mapping[str, Any]) -> Figure:
    """Return horizontal and vertical separation against time, a row for each near aircraft, with bounds."""
    with rc_context(RC):
        shown = near[:ROWS_MAX]
        figure = new_figure(9.6, 1.1 + 1.95 * len(shown))
        t0, span = log.own.t[0], log.own.t[-1] - log.own.t[0]
        if not shown:
            _nothing(figure, "no aircraft came within 5 km and 500 m")
            return figure
        limits = _limits(summary)
        lost = {
            row["id"]: row["first_loss_time_s"]["well_clear_volume"]
            for row in summary.get("per_intruder", ())
            if "well_clear_volume" in row["first_loss_time_s"]
        }
        grid = figure.subplots(len(shown), 2, sharex=True, squeeze=False)
        for k, encounter in enumerate(shown):
            left, right = grid[k]
            t, colour, c = encounter.t - t0, traffic_colour(k), encounter.closest
            for (_, dthr, zthr), style in zip(limits, _LIMIT_STYLES, strict=False):
                left.axhline(dthr, color=LIMIT, linewidth=1.0, linestyle=style, zorder=2)
                for sign in (-1, 1):
                    right.axhline(sign * zthr, color=LIMIT, linewidth=1.0, linestyle=style, zorder=2)
                inside = (encounter.horizontal <= dthr) & (np.abs(encounter.above) <= zthr)
                for axes in (left, right):
                    _shade(axes, t, inside, LIMIT, 0.10)
            left.plot(*_gapped(t, np.maximum(encounter.horizontal, 1.0)), color=colour, linewidth=1.8, zorder=4)
            right.plot(*_gapped(t, encounter.above), color=colour, linewidth=1.8, zorder=4)
            left.plot(t[c], max(encounter.horizontal[c], 1.0), "o", color=colour, markersize=5.5, zorder=5)
            right.plot(t[c], encounter.above[c], "o", color=colour, markersize=5.5, zorder=5)
            _separation_axes(left, right, encounter, limits, span)
            if encounter.id in lost:
                for axes in (left, right):
                    axes.axvline(lost[encounter.id] - t0, color=LIMIT, linewidth=1.4, alpha=0.75, zorder=3)
                    axes.plot(
                        lost[encounter.id] - t0, 0.0, "^", color=LIMIT, markersize=7, zorder=7, clip_on=False,
                        transform=axes.get_xaxis_transform(),
                    )  # fmt: skip
            left.set_title(encounter.label, color=colour)
            for axes, value in ((left, encounter.horizontal[c]), (right, encounter.above[c])):
                _annotate(axes, float(t[c]), float(max(value, 1.0) if axes is left else value), f"{value:,.0f} m", span)
        grid[0][0].set_title("horizontal separation", loc="right", fontweight="normal", fontsize=9, color=MUTED)
        grid[0][1].set_title(
            "the other aircraft is above (+) or below (–)", fontweight="normal", fontsize=9, color=MUTED
        )
        for axes in grid[-1]:
            clock_axis(axes, span * 1.6)
            axes.set_xlabel("time since start, min:s")
        handles: list[Artist] = [
            Line2D([], [], color=LIMIT, linewidth=1.0, linestyle=style, label=name)
            for (name, _, _), style in zip(limits, _LIMIT_STYLES, strict=False)
        ]
        handles.append(Patch(facecolor=LIMIT, alpha=0.2, label="inside both distances"))
        if lost:
            handles.append(Line2D([], [], color=LIMIT, marker="^", markersize=7, label="first loss of well clear"))
        figure.legend(handles=handles, loc="outside upper left", ncols=4)
    return figure


def _separation_axes(
    left: Axes, right: Axes, encounter: Encounter, limits: list[tuple[str, float, float]], span: float
) -> None:
    least = float(np.nanmin(encounter.horizontal))
    bounds = [dthr for _, dthr, _ in limits]
    left.set_yscale("log")
    left.set_ylim(min([*bounds, least, 200.0]) * 0.6, 20_000.0)
    left.yaxis.set_major_formatter(FuncFormatter(lambda v, _: f"{v / 1000:g} km" if v >= 1000 else f"{v:g} m"))
    left.yaxis.set_minor_formatter(NullFormatter())
    c = encounter.closest
    half = max(1.4 * max((z for _, _, z in limits), default=100.0), 1.5 * abs(float(encounter.above[c])), 150.0)
    right.set_ylim(-half, half)
    right.yaxis.set_major_formatter(FuncFormatter(lambda v, _: f"{v:+g} m" if v else "level"))
    left.set_xlim(0, max(span, 1.0))


def _limits(summary: Mapping[str, Any]) -> list[tuple[str, float, float]]:
    """Return name, horizontal and vertical bound of the volumes to draw: the scenario's own and NMAC, no two alike."""
    volumes, own = summary.get("volumes", {}), str(summary.get("well_clear_volume"))
    found: list[tuple[str, float, float]] = []
    names = {
        "nmac": "NMAC, 500 ft and 100 ft",
        "collision_volume": "collision volume",
        "well_clear_volume": f"well clear, {VOLUME_NAMES.get(own, 'as in the scenario')}",
    }
    for key, name in names.items():
        if key in volumes:
            bounds = volumes[key]["dthr_m"], volumes[key]["zthr_m"]
            if bounds not in [other[1:] for other in found]:
                found.append((name, *bounds))
    return found


def timeline_figure(log: FlightLog, near: list[Encounter]) -> Figure:
    """Return the alert level of each threat against time, with the maneuvers."""
    with rc_context(RC):
        t0, t_end = log.own.t[0], log.own.t[-1]
        order = {encounter.id: k for k, encounter in enumerate(near)}
        alerted = [
            name for name, changes in log.levels.items() if any(level > AlertLevel.CLEAR for _, level in changes)
        ]
        alerted.sort(key=lambda name: (-max(level for _, level in log.levels[name]), order.get(name, len(order))))
        shown = sorted(alerted[:_TIMELINE_ROWS_MAX], key=lambda name: order.get(name, len(order)))
        rows = [("all", log.alert_levels), *((log.label(name), log.levels[name]) for name in shown)]
        figure = new_figure(9.6, 1.5 + 0.34 * (len(rows) + 1))
        axes = figure.add_subplot()
        for y, (_, changes) in enumerate(rows):
            ends = [t for t, _ in changes[1:]] + [t_end]
            for (start, level), end in zip(changes, ends, strict=True):
                if level > AlertLevel.CLEAR:
                    # Height repeats what the colour says.
                    height = {1: 0.36, 2: 0.44, 3: 0.6, 4: 0.78}[int(level)]
                    axes.broken_barh([(start - t0, end - start)], (y - height / 2, height), facecolors=LEVELS[level])
            axes.axhline(y, color=LEVELS[AlertLevel.CLEAR], linewidth=2.0, zorder=0.5)
        y = len(rows)
        names = ["worst of all", *(name for name, _ in rows[1:]), *(["maneuver"] if log.maneuvers else [])]
        for span in log.maneuvers:
            width = max(span.t_end - span.t_start, 0.004 * (t_end - t0))
            axes.broken_barh([(span.t_start - t0, width)], (y - 0.28, 0.56), facecolors=MANEUVER, edgecolors="white")
            axes.axvline(span.t_start - t0, color=MANEUVER, linewidth=0.6, alpha=0.3, zorder=0.4)
        axes.set_yticks(range(len(names)), names)
        axes.set_ylim(len(names) - 0.4, -0.6)
        axes.set_axisbelow(True)
        axes.set_xlim(0, max(t_end - t0, 1.0))
        axes.grid(visible=False, axis="y")
        axes.spines["left"].set_visible(False)
        axes.tick_params(axis="y", length=0)
        clock_axis(axes, t_end - t0)
        axes.set_xlabel("time since start, min:s")
        handles = [
            Patch(facecolor=LEVELS[level], label=level.name.lower()) for level in AlertLevel if level > AlertLevel.CLEAR
        ]
        figure.legend(handles=handles, loc="outside upper left", ncols=4)
        if len(alerted) > len(shown):
            axes.set_title(f"{len(alerted) - len(shown)} more not shown", loc="right", fontweight="normal", color=MUTED)
    return figure


def _annotate(axes: Axes, t: float, y: float, text: str, span: float) -> None:
    """Write the value at the closest approach beside its dot, towards the middle of the picture."""
    side = 1 if t < 0.75 * span else -1
    axes.annotate(
        text, (t, y), (7 * side, 6), textcoords="offset points", ha="left" if side > 0 else "right", fontsize=8.8,
        fontweight="bold", zorder=8, bbox={"facecolor": PAPER, "edgecolor": "none", "alpha": 0.75, "pad": 0.8},
    )  # fmt: skip


def _mark_maneuvers(axes: Axes, log: FlightLog) -> None:
    for span in log.maneuvers:
        axes.axvspan(span.t_start - log.own.t[0], span.t_end - log.own.t[0], color=MANEUVER, alpha=0.12, linewidth=0)


def _shade(axes: Axes, t: FloatArray, inside: NDArray[np.bool_], colour: str, alpha: float) -> None:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], inside, [False]]).astype(int)))
    for start, end in edges.reshape(-1, 2):
        axes.axvspan(t[start], t[min(end, len(t) - 1)], color=colour, alpha=alpha, linewidth=0)


def _gapped(t: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    gaps = np.flatnonzero(np.diff(t) > 5.0) + 1
    return np.insert(t, gaps, np.nan), np.insert(values, gaps, np.nan)


def _nothing(figure: Figure, text: str) -> None:
    axes = figure.add_subplot()
    axes.set_axis_off()
    axes.text(0.5, 0.5, text, ha="center", va="center", color=FAINT, fontsize=12)
