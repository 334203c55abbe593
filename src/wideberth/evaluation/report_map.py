"""The map of a report: who flew where, north up."""

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Ellipse
from matplotlib.ticker import FuncFormatter, MaxNLocator
from numpy.typing import NDArray

from wideberth.evaluation.flight_log import Encounter, FlightLog, Path
from wideberth.evaluation.report_labels import Label, place_labels
from wideberth.evaluation.report_style import (
    FAINT,
    INK,
    MANEUVER,
    MISSION,
    MUTED,
    OWNSHIP,
    RC,
    clock,
    new_figure,
    traffic_colour,
    traffic_dashes,
)
from wideberth.types import Mission

FloatArray = NDArray[np.float64]

# sqrt of the 95 % quantile of chi-squared with 2 degrees of freedom.
ELLIPSE_95 = 2.4477
_ELLIPSES_MAX = 9
_MARGIN = 0.09
_ASPECT_MIN, _ASPECT_MAX = 0.5, 0.86


def map_figure(log: FlightLog, near: list[Encounter], mission: Mission | None) -> Figure:
    """Return the map: mission, path flown, near aircraft with their tracks and uncertainty, the others faint."""
    with rc_context(RC):
        limits = map_limits(log, near, mission)
        aspect = (limits[3] - limits[2]) / (limits[1] - limits[0])
        figure = new_figure(9.6, 8.8 * aspect + 1.1)
        axes = figure.add_subplot()
        axes.set_aspect("equal", adjustable="box")
        axes.set_xlim(limits[0], limits[1])
        axes.set_ylim(limits[2], limits[3])
        avoid: list[FloatArray] = []
        near_ids = {encounter.id for encounter in near}
        for name, path in log.aircraft().items():
            if name not in near_ids:
                p = path.positions
                axes.plot(*_broken(path.t, p[:, 1], p[:, 0]), color=FAINT, linewidth=0.6, alpha=0.55, zorder=1)
        if mission is not None:
            w = mission.waypoints
            # A pale band shows it where others fly exactly along it.
            axes.plot(w[:, 1], w[:, 0], color=MISSION, linewidth=7, alpha=0.22, zorder=2, solid_capstyle="butt")
            axes.plot(w[:, 1], w[:, 0], color=MISSION, linewidth=1.4, linestyle=(0, (5, 3)), zorder=3)
            axes.plot(w[:, 1], w[:, 0], "s", color=MISSION, markersize=4, zorder=3)
        own = log.own.positions
        labels = _draw_near(axes, log, near, limits, avoid)
        axes.plot(own[:, 1], own[:, 0], color=OWNSHIP, linewidth=2.6, zorder=8, solid_capstyle="round")
        avoid.append(_thin(np.column_stack([own[:, 1], own[:, 0]]), 400))
        labels = [*_draw_ownship(axes, log), *labels]
        axes.xaxis.set_major_locator(MaxNLocator(8, steps=[1, 2, 5, 10]))
        axes.yaxis.set_major_locator(MaxNLocator(8, steps=[1, 2, 5, 10]))
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value / 1000:g}"))
        axes.set_xlabel("east, km")
        axes.set_ylabel("north, km")
        _legend(figure, log, near)
        place_labels(axes, labels, avoid, size=8.8)
    return figure


def map_limits(log: FlightLog, near: list[Encounter], mission: Mission | None) -> tuple[float, float, float, float]:
    """Return east and north limits: the ownship's path, its mission, and where the near aircraft were closest."""
    points = [log.own.positions[:, :2]]
    if mission is not None:
        points.append(mission.waypoints[:, :2])
    points += [encounter.positions[encounter.closest : encounter.closest + 1, :2] for encounter in near]
    both = np.concatenate(points)
    (n0, e0), (n1, e1) = both.min(axis=0), both.max(axis=0)
    side = max(n1 - n0, e1 - e0, 2000.0)
    half_e, half_n = (e1 - e0) / 2 + _MARGIN * side, (n1 - n0) / 2 + _MARGIN * side
    # A long straight path gets room beside it, where the traffic is.
    half_e, half_n = max(half_e, half_n / _ASPECT_MAX), max(half_n, half_e * _ASPECT_MIN)
    e, n = (e0 + e1) / 2, (n0 + n1) / 2
    return float(e - half_e), float(e + half_e), float(n - half_n), float(n + half_n)


def _draw_near(
    axes: Axes, log: FlightLog, near: list[Encounter], limits: tuple[float, ...], avoid: list[FloatArray]
) -> list[Label]:
    labels = []
    for k, encounter in enumerate(near):
        colour = traffic_colour(k)
        e, n = encounter.positions[:, 1], encounter.positions[:, 0]
        axes.plot(*_broken(encounter.t, e, n), color=colour, linewidth=1.7, linestyle=traffic_dashes(k), zorder=5)
        inside = (e > limits[0]) & (e < limits[1]) & (n > limits[2]) & (n < limits[3])
        avoid.append(_thin(np.column_stack([e, n])[inside], 150))
        _arrow(axes, e, n, inside, colour)
        if encounter.id in log.tracks:
            _draw_track(axes, log.tracks[encounter.id], limits, colour)
        c = encounter.closest
        axes.plot([e[c], encounter.own[c, 1]], [n[c], encounter.own[c, 0]], color=colour, linewidth=0.9, zorder=6)
        axes.plot(e[c], n[c], "o", markersize=6.5, markerfacecolor=colour, markeredgecolor="white", zorder=9)
        axes.plot(
            encounter.own[c, 1], encounter.own[c, 0], "o", markersize=5, markerfacecolor=colour,
            markeredgecolor="white", zorder=10,
        )  # fmt: skip
        text = (
            f"{encounter.label}\n{_distance(encounter.horizontal[c])}, {_height(encounter.above[c])}"
            f" at {clock(encounter.t[c] - log.own.t[0])}"
        )
        labels.append(Label(float(e[c]), float(n[c]), text, colour, bold=False))
    return labels


def _draw_track(axes: Axes, track: Path, limits: tuple[float, ...], colour: str) -> None:
    """Draw estimates as dots and, now and then, the 95 % ellipse of the position."""
    p = track.positions
    inside = np.flatnonzero(
        (p[:, 1] > limits[0]) & (p[:, 1] < limits[1]) & (p[:, 0] > limits[2]) & (p[:, 0] < limits[3])
    )
    if not inside.size:
        return
    dots = inside[:: max(1, len(inside) // 60)]
    axes.plot(p[dots, 1], p[dots, 0], ".", color=colour, markersize=2.2, alpha=0.8, zorder=4)
    for i in inside[:: max(1, len(inside) // _ELLIPSES_MAX)]:
        nn, ne, ee, _ = track.covariances[i]
        values, vectors = np.linalg.eigh(np.array([[ee, ne], [ne, nn]]))
        if not np.all(np.isfinite(values)) or values[0] < 0:
            continue
        width, height = 2 * ELLIPSE_95 * np.sqrt(values[::-1])
        angle = float(np.degrees(np.arctan2(vectors[1, 1], vectors[0, 1])))
        axes.add_patch(
            Ellipse(
                (float(p[i, 1]), float(p[i, 0])), width, height, angle=angle,
                facecolor=colour, alpha=0.13, edgecolor=colour, linewidth=0.8, zorder=4,
            )
        )  # fmt: skip


def _draw_ownship(axes: Axes, log: FlightLog) -> list[Label]:
    own, t = log.own.positions, log.own.t
    labels = [Label(float(own[0, 1]), float(own[0, 0]), "start", OWNSHIP, bold=True)]
    span = t[-1] - t[0]
    step = next((s for s in (10, 30, 60, 120, 300, 600, 1200) if span / s <= 14), 3600)
    ticks = np.arange(step, span, step) + t[0]
    axes.plot(
        np.interp(ticks, t, own[:, 1]), np.interp(ticks, t, own[:, 0]), "o", color="white", markersize=3.2,
        markeredgecolor=OWNSHIP, markeredgewidth=0.9, zorder=9,
    )  # fmt: skip
    for k, tick in enumerate(ticks):
        if k % 2:
            e, n = float(np.interp(tick, t, own[:, 1])), float(np.interp(tick, t, own[:, 0]))
            labels.append(Label(e, n, clock(tick - t[0]), MUTED))
    whole = np.ones(len(own), bool)
    _arrow(axes, own[:, 1], own[:, 0], whole, OWNSHIP)
    for span_ in log.maneuvers:
        axes.plot(
            span_.position[1], span_.position[0], "D", markersize=6, markerfacecolor=MANEUVER, markeredgecolor="white",
            zorder=11,
        )  # fmt: skip
    return labels


def _arrow(axes: Axes, east: FloatArray, north: FloatArray, inside: NDArray[np.bool_], colour: str) -> None:
    """Show which way a path goes, at its last visible point."""
    rows = np.flatnonzero(inside)
    if rows.size < 2:
        return
    last = rows[-1]
    back = max(0, last - max(1, len(east) // 60))
    if np.hypot(east[last] - east[back], north[last] - north[back]) < 1.0:
        return
    axes.annotate(
        "", (east[last], north[last]), (east[back], north[back]),
        arrowprops={"arrowstyle": "-|>,head_width=.32,head_length=.62", "color": colour, "linewidth": 1.2}, zorder=9,
    )  # fmt: skip


def _legend(figure: Figure, log: FlightLog, near: list[Encounter]) -> None:
    handles = [
        Line2D([], [], color=OWNSHIP, linewidth=2.6, label="ownship, as flown"),
        Line2D([], [], color=MISSION, linewidth=1.4, linestyle=(0, (5, 3)), marker="s", markersize=4, label="mission"),
    ]
    if log.maneuvers:
        handles.append(Line2D([], [], color=MANEUVER, marker="D", linestyle="", label="maneuver chosen"))
    if near:
        handles.append(
            Line2D([], [], color=INK, linewidth=1.7, label="near aircraft" + (", true" if log.truths else ""))
        )
        handles.append(Line2D([], [], color=INK, marker="o", linestyle="-", markersize=5, label="closest approach"))
        ellipse = Line2D([], [], marker="o", markersize=11, markerfacecolor="none", markeredgecolor=MUTED, linestyle="")
        ellipse.set_label("track, 95 % ellipse")
        handles.append(ellipse)
    if len(log.aircraft()) > len(near):
        handles.append(Line2D([], [], color=FAINT, linewidth=0.8, label="other aircraft"))
    figure.legend(handles=handles, loc="outside upper left", ncols=4, columnspacing=1.6, handlelength=2.2)


def _broken(t: FloatArray, east: FloatArray, north: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return a path with gaps where the aircraft was not known for over 5 s."""
    gaps = np.flatnonzero(np.diff(t) > 5.0) + 1
    return np.insert(east, gaps, np.nan), np.insert(north, gaps, np.nan)


def _thin(points: FloatArray, count: int) -> FloatArray:
    return points[:: max(1, len(points) // count)]


def _distance(metres: float) -> str:
    return f"{metres / 1000:.1f} km" if metres >= 1000 else f"{metres:.0f} m"


def _height(metres: float) -> str:
    return "level" if abs(metres) < 0.5 else f"{abs(metres):.0f} m {'above' if metres > 0 else 'below'}"
