"""Surveillance and operation volume of a radar on the ground, from above and from the side (thesis, figure 4.2)."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch

from wideberth.analysis.ground_sizing import GroundProtection
from wideberth.analysis.operation_volume import SurveillanceVolume
from wideberth.analysis.sizing_answer import Intruder
from wideberth.argument_checks import FloatArray
from wideberth.evaluation.report_style import FAINT, INK, MUTED, RC, TRAFFIC, new_figure
from wideberth.evaluation.sizing_figures import polar_style
from wideberth.evaluation.sizing_words import intruder_text

_SHOWN_MAX = 3


def ground_figure(found: GroundProtection, intruders: Sequence[Intruder]) -> Figure:
    """Return the volumes for the slowest intruders: surveillance dashed, operation filled, a colour for each speed."""
    good = [k for k, safe in enumerate(found.protected) if safe]
    with_view = [k for k, volume in enumerate(found.surveillance) if volume is not None]
    shown = (good or with_view)[:_SHOWN_MAX]
    if good and len(shown) < _SHOWN_MAX:
        # One that is not protected: the reader sees how far the volume falls short.
        shown += [k for k in with_view if k not in shown][:1]
    with rc_context(RC):
        figure = new_figure(9.6, 5.0)
        plan, side = figure.subplots(1, 2, width_ratios=(1, 1.15))
        handles: list[Line2D | Patch] = []
        far = 1.0
        for k, column in enumerate(shown):
            colour = TRAFFIC[(0, 2, 6, 3)[k % 4]]
            volume, operation = found.surveillance[column], found.operation[column]
            assert volume is not None
            far = max(far, volume.radius)
            plan.add_patch(Circle((0, 0), volume.radius, fill=False, edgecolor=colour, linestyle=(0, (4, 2)), lw=1.3))
            side.plot(*_outline(volume), color=colour, linestyle=(0, (4, 2)), linewidth=1.3)
            one = intruders[column]
            label = intruder_text(one)
            if operation is not None and operation.radius > 0.0:
                plan.add_patch(Circle((0, 0), operation.radius, facecolor=colour, alpha=0.25, lw=0))
                plan.add_patch(Circle((0, 0), operation.radius, fill=False, edgecolor=colour, lw=2.0))
                heights = np.linspace(0.0, operation.height, 120)
                radius = operation.radius_at(heights)
                x, z = np.concatenate([-radius, radius[::-1]]), np.concatenate([heights, heights[::-1]])
                side.fill(x, z, color=colour, alpha=0.25, linewidth=0)
                side.plot(np.append(x, x[0]), np.append(z, z[0]), color=colour, linewidth=2.0)
            else:
                label += " (no operation volume)"
            handles.append(Line2D([], [], color=colour, linewidth=2.0, label=label))
        for axes in (plan, side):
            axes.plot(0, 0, "^", color=INK, markersize=7, zorder=6)
            axes.set_aspect("equal", adjustable="box")
            axes.set_xlim(-1.08 * far, 1.08 * far)
        plan.set_ylim(-1.08 * far, 1.08 * far)
        side.set_ylim(0.0, 1.08 * far)
        side.axhline(0.0, color=FAINT, linewidth=1.5)
        plan.set_title("From above")
        side.set_title("From the side")
        plan.set_xlabel("east, m")
        plan.set_ylabel("north, m")
        side.set_xlabel("east, m")
        side.set_ylabel("above the radar, m")
        if shown and (good or with_view):
            handles.append(Line2D([], [], color=MUTED, linestyle=(0, (4, 2)), label="surveillance volume"))
            handles.append(Patch(facecolor=MUTED, alpha=0.3, label="operation volume"))
        handles.append(Line2D([], [], color=INK, marker="^", linestyle="", label="radar"))
        figure.legend(handles=handles, loc="outside lower left", ncols=3, columnspacing=1.4)
    return figure


def required_figure(required: FloatArray, bearings: FloatArray, intruders: Sequence[Intruder]) -> Figure:
    """Return required ranges by bearing, shape (bearings, intruders): a polar plot without a sensor."""
    pick = np.unique(np.round(np.linspace(0, len(intruders) - 1, min(5, len(intruders)))).astype(int))
    angle = np.append(bearings, bearings[0] + 2 * np.pi)
    with rc_context(RC):
        figure = new_figure(9.6, 4.6)
        axes: Any = figure.add_subplot(projection="polar")
        polar_style(axes)
        for k, column in enumerate(pick):
            curve = np.append(required[:, column], required[0, column])
            axes.plot(angle, np.where((curve > 0) & np.isfinite(curve), curve, np.nan), color=TRAFFIC[k], linewidth=2.0,
                      label=intruder_text(intruders[column]))  # fmt: skip
        axes.set_rlim(0.0, None)
        axes.tick_params(axis="x", pad=4)
        figure.legend(loc="outside lower center", ncols=3)
    return figure


def _outline(volume: SurveillanceVolume) -> tuple[FloatArray, FloatArray]:
    """Return the side view of a surveillance volume above the ground."""
    if volume.shape == "cylinder":
        r, h = volume.radius, volume.height
        return np.array([-r, -r, r, r]), np.array([0.0, h, h, 0.0])
    angle = np.linspace(0.0, np.pi, 181)
    return volume.radius * np.cos(angle), volume.radius * np.sin(angle)
