"""The pictures of the sweeps of the detection range: levels are told by colour, methods by dashes."""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, FuncFormatter, NullFormatter, NullLocator

from wideberth.analysis.range_sweep import LENGTH_UNITS, Panel, Sweep
from wideberth.evaluation.report_labels import Label, place_labels
from wideberth.evaluation.report_style import INK, LIMIT, MUTED, OWNSHIP, RC, TRAFFIC, new_figure
from wideberth.units import DEGREE, KNOT

METHOD_NAMES: Mapping[str, str] = {"tgvv": "TGVV", "gvv": "GVV", "tt": "TT", "gt": "GT"}

_DASHES: Mapping[str, Any] = {"tgvv": "-", "gvv": (0, (1, 1.3)), "tt": (0, (6, 2)), "gt": (0, (6, 1.6, 1, 1.6))}
_WIDTHS: Mapping[str, float] = {"tgvv": 1.7, "gvv": 2.2, "tt": 1.4, "gt": 1.4}
_METHOD_COLOURS: Mapping[str, str] = {"tgvv": TRAFFIC[0], "gvv": INK, "tt": OWNSHIP, "gt": TRAFFIC[1]}
_MARKERS: Mapping[str, str] = {"tgvv": ">", "gvv": "<"}
# The common level is blue everywhere.
_LEVEL_COLOURS = (TRAFFIC[1], TRAFFIC[0], TRAFFIC[2], TRAFFIC[3], OWNSHIP)
_TITLES: Mapping[str, str] = {
    "distance": "minimum detection range",
    "range": "distance between the aircraft",
    "cpa": "closest approach",
    "error": "range short of TGVV's",
    "maneuver_time": "time to maneuver",
    "ownship_speed": "ownship speed",
    "time": "time since detection",
    "pilot_delay": "pilot's delay",
    "inverse_bank_rate": "largest bank rate, deg/s (even in its inverse)",
}
# What is far above the rest is cut off at the value that it has this part of the way from the left.
_CUT_AT = {"distance": 0.05, "maneuver_time": 0.08}
_CUT_FROM = 1.5
_SAME = 0.004  # of the height of the picture
# When labels are placed: a dot's half size as parts of the picture, and how many points of a line it weighs.
_DOT_SIZE, _DOT_WEIGHT = (0.006, 0.02), 8


class Scale(NamedTuple):
    """How a quantity is written: its name, unit, and that unit in SI."""

    title: str
    unit: str
    factor: float

    @property
    def label(self) -> str:
        """For an axis."""
        return f"{self.title}, {self.unit}" if self.unit else self.title


def scale(quantity: str, length_unit: str = "ft") -> Scale:
    """Return how a panel's quantity, swept or shown, is written.

    Parameters
    ----------
    quantity : str
        `Panel.x` or `Panel.y`.
    length_unit : str
        Of `range_sweep.LENGTH_UNITS`.
    """
    title = _TITLES[quantity]
    if quantity in ("distance", "range", "cpa"):
        return Scale(title, length_unit, LENGTH_UNITS[length_unit])
    if quantity == "error":
        return Scale(title, "%", 0.01)
    if quantity == "ownship_speed":
        return Scale(title, "kt", KNOT)
    if quantity == "inverse_bank_rate":
        return Scale(title, "", 1.0 / DEGREE)
    return Scale(title, "s", 1.0)


def sweep_figure(sweep: Sweep) -> Figure:
    """Return the picture of a figure; curves break where a method has no answer."""
    with rc_context(RC):
        columns = 1 if len(sweep.panels) == 1 else 2
        rows = math.ceil(len(sweep.panels) / columns)
        figure = new_figure(9.6, 0.5 + (4.3 if columns == 1 else 3.55) * rows)
        layout: Any = figure.get_layout_engine()
        layout.set(h_pad=0.1, w_pad=0.08)
        grid = figure.subplots(rows, columns, squeeze=False)
        for axes, panel in zip(grid.flat, sweep.panels, strict=False):
            _draw(axes, panel)
        for axes in grid.flat[len(sweep.panels) :]:
            axes.set_axis_off()
        handles = _method_handles(sweep)
        figure.legend(handles=handles, loc="outside upper left", ncols=len(handles), handlelength=3.2)
        for axes, panel in zip(grid.flat, sweep.panels, strict=False):
            if panel.y == "range":
                _label_closest_approaches(axes, panel)
    return figure


def cut_off(panel: Panel) -> tuple[float, float] | None:
    """Return where a panel's picture ends above, and up to what swept value curves leave it (SI); None if none does."""
    part = _CUT_AT.get(panel.y)
    shown = np.array([curve.values[panel.y] for curve in panel.curves])
    x = panel.curves[0].x
    finite = np.isfinite(shown)
    if part is None or panel.x != "ownship_speed" or not finite.any():
        return None
    kept = finite & (x >= x[0] + part * (x[-1] - x[0]))
    top = float(shown[kept].max()) if kept.any() else math.inf
    if shown[finite].max() <= _CUT_FROM * top:
        return None
    return 1.04 * top, float(x[(np.where(finite, shown, 0.0) > 1.04 * top).any(axis=0)].max())


def _draw(axes: Axes, panel: Panel) -> None:
    x_scale, y_scale = scale(panel.x), scale(panel.y, panel.length_unit)
    colours = _level_colours(panel)
    shared = {method for method in METHOD_NAMES if _same_at_all_levels(panel, method)}
    for curve in panel.curves:
        if curve.method in shared and curve.level != panel.curves[0].level:
            continue
        colour = INK if curve.method in shared else colours[curve.level]
        if len(colours) == 1:
            colour = _METHOD_COLOURS[curve.method]
        axes.plot(
            curve.x / x_scale.factor,
            curve.values[panel.y] / y_scale.factor,
            color=colour,
            linestyle=_DASHES[curve.method],
            linewidth=_WIDTHS[curve.method],
            zorder=4 if curve.method in ("tgvv", "gvv") else 3,
        )
        if panel.y == "distance":
            for mark in curve.marks:
                x, y = mark.x / x_scale.factor, mark.y / y_scale.factor
                axes.plot(x, y, _MARKERS[curve.method], color=colour, markersize=6.5, zorder=6)
    _limits(axes, panel, x_scale, y_scale)
    if panel.y == "range":
        _closest_approaches(axes, panel, y_scale)
    axes.set_title(f"({panel.letter}) {panel.title}" if panel.letter else "", pad=24 if len(colours) > 1 else 6)
    axes.set_xlabel(x_scale.label)
    axes.set_ylabel(y_scale.label)
    if not any(np.isfinite(curve.values[panel.y]).any() for curve in panel.curves):
        axes.text(0.5, 0.5, "no answer here: the report says why", transform=axes.transAxes, ha="center", color=MUTED)
    if len(colours) > 1:
        legend = axes.legend(
            handles=[
                Line2D([], [], color=colour, linewidth=2.4, label=level.replace(" deg", "°"))
                for level, colour in colours.items()
            ],
            loc="lower left",
            bbox_to_anchor=(-0.02, 0.985),
            ncols=len(colours),
            handlelength=1.1,
            handletextpad=0.4,
            columnspacing=0.9,
            fontsize=8.6,
        )
        legend.set_in_layout(False)  # its width is not to squeeze the axes


def _closest_approaches(axes: Axes, panel: Panel, y_scale: Scale) -> None:
    """Mark the closest approaches and the safety radius of the relative range."""
    radius = panel.curves[0].arguments["safety_radius"] / y_scale.factor
    axes.axhline(radius, color=LIMIT, linewidth=1.1, linestyle=(0, (3, 2)), zorder=2)
    axes.annotate(
        f"R_s = {radius:,.0f} {y_scale.unit}", (0.0, radius), (4, 3), xycoords=("axes fraction", "data"),
        textcoords="offset points", fontsize=8.8, color=LIMIT,
    )  # fmt: skip
    for curve in panel.curves:
        for mark in curve.marks:
            axes.plot(mark.x, mark.y / y_scale.factor, "o", color=_METHOD_COLOURS[curve.method], markersize=6, zorder=6)


def _label_closest_approaches(axes: Axes, panel: Panel) -> None:
    """Write them beside their marks; the figure is complete otherwise."""
    y_scale = scale(panel.y, panel.length_unit)
    labels = [
        Label(
            mark.x,
            mark.y / y_scale.factor,
            f"{METHOD_NAMES[curve.method]}: {mark.y / y_scale.factor:,.0f} {y_scale.unit} after {mark.x:.1f} s",
            _METHOD_COLOURS[curve.method],
        )
        for curve in panel.curves
        for mark in curve.marks
    ]
    t = panel.curves[0].x
    lines = [np.column_stack([curve.x, curve.values[panel.y] / y_scale.factor]) for curve in panel.curves]
    radius = np.full(len(t), panel.curves[0].arguments["safety_radius"] / y_scale.factor)
    wide, high = _DOT_SIZE[0] * float(t[-1] - t[0]), _DOT_SIZE[1] * _top(panel) / y_scale.factor
    around = np.array([(0.0, 0.0), (wide, 0.0), (-wide, 0.0), (0.0, high), (0.0, -high)] * _DOT_WEIGHT)
    dots = np.concatenate([np.array([label.x, label.y]) + around for label in labels] or [np.empty((0, 2))])
    place_labels(axes, labels, [*lines, np.column_stack([t, radius]), dots], size=8.8)


def _limits(axes: Axes, panel: Panel, x_scale: Scale, y_scale: Scale) -> None:
    x = panel.curves[0].x / x_scale.factor
    axes.set_xlim(x[0], x[-1])
    if panel.x == "inverse_bank_rate":
        rates = (math.inf, 240, 120, 80, 60, 48, 40, 34, 30)
        axes.set_xticks([1.0 / rate for rate in rates], [f"{rate:g}".replace("inf", "∞") for rate in rates])
    else:
        axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:,g}"))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda y, _: f"{y:,g}"))
    values = np.concatenate([curve.values[panel.y] for curve in panel.curves]) / y_scale.factor
    values = values[np.isfinite(values)]
    if panel.y == "error" and panel.x == "ownship_speed" and (values > 0.0).any():
        axes.set_yscale("log")
        # Nothing of interest is below a hundredth of a percent.
        axes.set_ylim(max(0.7 * float(values[values > 0.0].min()), 0.01), 130.0)
        axes.yaxis.set_major_locator(FixedLocator([0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0]))
        axes.yaxis.set_major_formatter(FuncFormatter(lambda y, _: f"{y:g}"))  # the scale has set its own
        axes.yaxis.set_minor_locator(NullLocator())
        axes.yaxis.set_minor_formatter(NullFormatter())
        return
    top, bottom = _top(panel) / y_scale.factor, 0.0
    if panel.y == "range":
        bottom = -0.12 * top  # the words below the dots need room
    elif panel.y == "distance" and values.min(initial=math.inf) > 0.4 * top:
        bottom = 0.85 * float(values.min())
    axes.set_ylim(bottom, top)
    if panel.y == "range":
        axes.yaxis.set_major_locator(FixedLocator([v for v in axes.get_yticks() if 0.0 <= v <= top]))


def _top(panel: Panel) -> float:
    """Return where the picture ends above, SI."""
    cut = cut_off(panel)
    if cut is not None:
        return cut[0]
    values = np.concatenate([curve.values[panel.y] for curve in panel.curves])
    most = float(values[np.isfinite(values)].max(initial=0.0))
    return 1.06 * most if most > 0.0 else 1.0


def _level_colours(panel: Panel) -> dict[str, str]:
    nominal = {curve.level for curve in panel.curves if curve.nominal}
    levels = list(dict.fromkeys(curve.level for curve in panel.curves))
    others = iter(_LEVEL_COLOURS)
    return {level: OWNSHIP if level in nominal else next(others) for level in levels}


def _same_at_all_levels(panel: Panel, method: str) -> bool:
    """Return whether a method's curves lie on each other, as far as one can see."""
    top = _top(panel)
    rows = [np.minimum(curve.values[panel.y], top) for curve in panel.curves if curve.method == method]
    if panel.y == "error":
        near, rtol = 0.0, 0.01
    else:
        near, rtol = _SAME * top, 0.0
    return len(rows) > 1 and all(np.allclose(rows[0], row, rtol=rtol, atol=near, equal_nan=True) for row in rows[1:])


def _method_handles(sweep: Sweep) -> list[Line2D]:
    shown: Sequence[str] = [m for m in METHOD_NAMES if any(c.method == m for p in sweep.panels for c in p.curves)]
    one_level = all(len(_level_colours(panel)) == 1 for panel in sweep.panels)
    handles = [
        Line2D(
            [],
            [],
            color=_METHOD_COLOURS[method] if one_level else MUTED,
            linestyle=_DASHES[method],
            linewidth=_WIDTHS[method],
            label=METHOD_NAMES[method],
        )
        for method in shown
    ]
    marked = {
        curve.method
        for panel in sweep.panels
        if panel.y == "distance"
        for curve in panel.curves
        if any(mark.y <= _top(panel) for mark in curve.marks)
    }
    for method, words in (("tgvv", "case B to A"), ("gvv", "case 1 to 2")):
        if method in marked:
            label = f"{METHOD_NAMES[method]}, {words}"
            handles.append(
                Line2D([], [], color=MUTED, linestyle="", marker=_MARKERS[method], markersize=6.5, label=label)
            )
    return handles
