"""The pictures of a sensor's sizing: what is required and what the sensor gives, by bearing and by speed."""

import math
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter, MaxNLocator, MultipleLocator
from numpy.typing import NDArray

from wideberth.analysis.sensor_reach import needed_snr_db
from wideberth.analysis.sizing_answer import SizingAnswer
from wideberth.argument_checks import FloatArray
from wideberth.evaluation.report_style import FAINT, INK, LIMIT, MUTED, OWNSHIP, RC, TRAFFIC, new_figure
from wideberth.evaluation.sizing_words import intruder_text
from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.link_budget import snr_db

CURVES_MAX = 4
SAFE, LATE, BLIND = TRAFFIC[1], TRAFFIC[3], LIMIT


def protection_figure(answer: SizingAnswer) -> Figure:
    """Return the polar plot of ranges, and beside it which bearings and speeds are protected."""
    with rc_context(RC):
        figure = new_figure(9.6, 5.4)
        grid = figure.add_gridspec(1, 2, width_ratios=(1.1, 1), wspace=0.06)
        polar, right = figure.add_subplot(grid[0], projection="polar"), figure.add_subplot(grid[1])
        handles = _draw_polar(polar, answer)
        _draw_map(right, answer)
        figure.legend(handles=handles, loc="outside lower left", ncols=3, columnspacing=1.4, handlelength=1.8)
    return figure


def shown_speeds(answer: SizingAnswer) -> list[int]:
    """Return which intruders the polar plot shows: evenly among those whose curve is within the plot."""
    limit = _radius(answer)
    fits = [k for k in range(len(answer.intruders)) if answer.protection.required_range[:, k].min() < limit]
    fits = [k for k in fits if np.quantile(answer.protection.required_range[:, k], 0.5) < limit] or fits[:1]
    pick = np.unique(np.round(np.linspace(0, len(fits) - 1, min(CURVES_MAX, len(fits)))).astype(int))
    return [fits[k] for k in pick]


def _radius(answer: SizingAnswer) -> float:
    """Return how far the polar plot goes: what is required, but not so far that the sensor becomes a dot."""
    finite = answer.protection.required_range[np.isfinite(answer.protection.required_range)]
    needed = float(finite.max(initial=1.0))
    seen = float(answer.protection.available_range.max())
    return min(1.15 * needed, 2.4 * seen if seen > 0.0 else math.inf)


def polar_style(axes: Any) -> None:
    """Make polar axes show bearings clockwise from the nose, which is up, and ranges in m or km."""
    axes.set_theta_zero_location("N")
    axes.set_theta_direction(-1)
    axes.set_rlabel_position(180)
    axes.yaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10]))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda r, _: f"{r / 1000:g} km" if r >= 2000.0 else f"{r:.0f} m"))
    axes.set_thetagrids(range(0, 360, 30), [_bearing(a) for a in range(0, 360, 30)])
    axes.spines["polar"].set_visible(False)


def _draw_polar(axes: Any, answer: SizingAnswer) -> list[Line2D | Patch]:
    found, limit = answer.protection, _radius(answer)
    polar_style(axes)
    angle = np.append(found.bearings, found.bearings[0] + 2.0 * math.pi)
    handles: list[Line2D | Patch] = []
    for k, column in enumerate(shown_speeds(answer)):
        colour = TRAFFIC[(0, 2, 6, 3)[k % 4]]
        seen = _closed(found.available_range[:, column])
        axes.fill(angle, np.minimum(seen, limit), color=OWNSHIP, alpha=0.11, linewidth=0, zorder=2)
        axes.plot(angle, np.where(seen < limit, seen, np.nan), color=colour, linewidth=1.0, linestyle=(0, (4, 2)))
        needed, safe = _closed(found.required_range[:, column]), _closed(found.protected[:, column])
        drawn = np.where((needed > 0.0) & (needed < limit), needed, np.nan)
        axes.plot(angle, drawn, color=colour, linewidth=1.2, zorder=4)
        axes.plot(angle, np.where(safe, drawn, np.nan), color=colour, linewidth=3.4, zorder=5, solid_capstyle="butt")
        # Beside the scale: the bearings that are not protected.
        ring = limit * (1.02 + 0.032 * k)
        axes.plot(
            angle, np.where(safe, np.nan, ring), color=colour, linewidth=2.6, clip_on=False, solid_capstyle="butt"
        )
        one = answer.intruders[column].intruder
        handles.append(Line2D([], [], color=colour, linewidth=2.4, label=intruder_text(one)))
    axes.set_rlim(0.0, limit)
    axes.tick_params(axis="x", pad=20)
    axes.set_title("Range required and range available", pad=18)
    thick = Line2D([], [], color=MUTED, linewidth=3.4, label="required, protected")
    thin = Line2D([], [], color=MUTED, linewidth=1.2, label="required, not protected")
    track = Patch(facecolor=OWNSHIP, alpha=0.25, label="confirmed track (edge dashed)")
    ring_handle = Line2D([], [], color=MUTED, linewidth=2.6, label="rim: bearings not protected")
    return [*handles, thick, thin, track, ring_handle]


def _closed(values: NDArray[Any]) -> NDArray[Any]:
    return np.append(values, values[0])


def _wrapped(values: NDArray[Any]) -> NDArray[Any]:
    return np.concatenate([values, values[:1]])


def _bearing(degrees: int) -> str:
    signed = degrees if degrees <= 180 else degrees - 360
    return f"{signed}°".replace("-", "−")


def _draw_map(axes: Axes, answer: SizingAnswer) -> None:
    """Draw which bearings and speeds are protected, and why the others are not."""
    found = answer.map
    speeds = found.intruder_speeds
    # The tail is at both ends.
    bearings = np.append(np.degrees(found.bearings), 180.0)
    step, width = speeds[1] - speeds[0], bearings[1] - bearings[0]
    safe, threat = _wrapped(found.protected), _wrapped(found.required_range > 0.0)
    view = np.any(_wrapped(found.available_range > 0.0), axis=1, keepdims=True)
    kinds = (
        ("protected", safe & threat, SAFE, 0.75),
        ("seen too late", ~safe & view, LATE, 0.65),
        ("not seen", ~safe & ~view, BLIND, 0.55),
        ("none can come", ~threat, FAINT, 0.35),
    )
    for _, mask, colour, alpha in kinds:
        for k, speed in enumerate(speeds):
            edges = np.flatnonzero(np.diff(np.concatenate([[0], mask[:, k].astype(int), [0]])))
            bars = [(bearings[a] - 0.5 * width, width * (b - a)) for a, b in zip(edges[::2], edges[1::2], strict=True)]
            axes.broken_barh(bars, (speed - 0.5 * step, step), facecolor=colour, alpha=alpha, linewidth=0, zorder=2)
    for one in answer.intruders:
        axes.axhline(one.intruder.speed, color=INK, linewidth=0.5, alpha=0.5, zorder=3)
    axes.set_xlim(-180.0, 180.0)
    axes.set_ylim(speeds[0] - 0.5 * step, speeds[-1] + 0.5 * step)
    axes.xaxis.set_major_locator(MultipleLocator(60))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:.0f}°".replace("-", "−")))
    axes.grid(visible=False)
    axes.set_xlabel("bearing of the intruder, from the nose")
    axes.set_ylabel("its speed, m/s")
    axes.set_title("Where the aircraft is protected")
    patches = [Patch(facecolor=colour, alpha=alpha, label=name) for name, mask, colour, alpha in kinds if mask.any()]
    axes.legend(handles=patches, loc="upper center", bbox_to_anchor=(0.5, -0.13), ncols=4, columnspacing=1.0,
                handlelength=1.1, handletextpad=0.5)  # fmt: skip


def speed_figure(answer: SizingAnswer, reaches: dict[float, FloatArray], speeds: FloatArray) -> Figure:
    """Return ranges head-on against the intruder's speed: what is required, and available by cross-section.

    `reaches` has, for each cross-section (m2), the ranges at `speeds`; ADS-B has one, under the key 0.
    """
    found = answer.map
    ahead = int(np.argmin(np.abs(found.bearings)))
    with rc_context(RC):
        figure = new_figure(9.6, 3.6)
        axes = figure.add_subplot()
        styles = ((0, (1, 1.5)), (0, (3, 2)), "-", (0, (6, 2, 1, 2)), "-.") if len(reaches) > 1 else ("-",)
        seen = max(float(ranges.max()) for ranges in reaches.values())
        for k, (rcs, ranges) in enumerate(reaches.items()):
            label = f"track, {rcs:g} m²" if rcs else "track"
            style = styles[k % len(styles)]
            axes.plot(speeds, ranges, color=OWNSHIP, linewidth=2.0, linestyle=style, label=label)
        axes.plot(found.intruder_speeds, found.required_range[ahead], color=TRAFFIC[0], linewidth=2.2,
                  label="required, head-on")  # fmt: skip
        most = np.where(np.isfinite(found.required_range), found.required_range, np.nan)
        axes.plot(found.intruder_speeds, np.nanmax(most, axis=0), color=TRAFFIC[0], linewidth=1.2,
                  linestyle=(0, (4, 2)), label="required, worst bearing")  # fmt: skip
        if answer.head_on.speed is not None and not answer.head_on.at_least:
            axes.axvline(answer.head_on.speed, color=SAFE, linewidth=1.2)
            axes.annotate(f"protected head-on\nup to {answer.head_on.speed:.1f} m/s", (answer.head_on.speed, 0.97),
                          (5, 0), xycoords=("data", "axes fraction"), textcoords="offset points", va="top",
                          color=SAFE, fontsize=9)  # fmt: skip
        axes.set_xlim(0.0, found.intruder_speeds[-1])
        highest = 1.05 * float(np.nanmax(most, initial=1.0))
        axes.set_ylim(0.0, min(highest, 4.0 * seen) if 0.0 < seen < highest else 1.2 * highest)
        if seen > 1.2 * highest:
            axes.set_title(f"The sensor has its track from {seen / 1000:,.1f} km on, beyond this plot")
        if np.isinf(found.required_range[ahead]).all():
            axes.set_title("Head-on no range is enough for the escapes counted")
        axes.set_xlabel("speed of the intruder, m/s")
        axes.set_ylabel("range, m")
        axes.yaxis.set_major_formatter(FuncFormatter(lambda y, _: f"{y:,.0f}"))
        figure.legend(loc="outside upper left", ncols=4, columnspacing=1.3)
    return figure


def snr_figure(radar: RadarConfig, sections: tuple[float, ...]) -> Figure:
    """Return the signal-to-noise ratio on boresight against range, by cross-section."""
    end = radar.range_limit
    ranges = np.geomspace(max(end / 40.0, radar.range_min_m), 2.0 * end, 200)
    with rc_context(RC):
        figure = new_figure(9.6, 3.6)
        axes = figure.add_subplot()
        for k, rcs in enumerate(sections):
            axes.plot(ranges, snr_db(ranges, rcs, radar), color=TRAFFIC[k % len(TRAFFIC)], linewidth=2.0,
                      label=f"{rcs:g} m²")  # fmt: skip
        levels = (0.5, radar.confirmation_probability) if radar.snr_threshold_db is None else (0.5,)
        for probability in levels:
            level = needed_snr_db(radar, probability)
            text = f"detected with {100 * probability:.0f} %" if radar.snr_threshold_db is None else "threshold"
            axes.axhline(level, color=MUTED, linewidth=1.1, linestyle=(0, (5, 3)))
            axes.annotate(text, (ranges[0], level), (3, 3), textcoords="offset points", color=MUTED, fontsize=8.8)
        axes.axvspan(end, ranges[-1], color=FAINT, alpha=0.25, linewidth=0)
        axes.annotate(f"not looked at beyond {end:,.0f} m", (end, 0.97), (-6, 0), xycoords=("data", "axes fraction"),
                      textcoords="offset points", va="top", ha="right", color=MUTED, fontsize=9)  # fmt: skip
        axes.set_xscale("log")
        axes.set_xlim(ranges[0], ranges[-1])
        ticks = [t for t in (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10_000, 20_000, 50_000)
                 if ranges[0] <= t <= ranges[-1]]  # fmt: skip
        axes.set_xticks(ticks, [f"{t:,}" for t in ticks])
        axes.minorticks_off()
        axes.set_xlabel("range, m")
        axes.set_ylabel("SNR, one channel, one sweep, dB")
        figure.legend(loc="outside upper left", ncols=6, title=None)
    return figure
