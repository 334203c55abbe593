"""The pictures of a tracking report that score: OSPA, errors within their bands, NEES, and the life of tracks."""

from collections.abc import Sequence

import numpy as np
from matplotlib import rc_context
from matplotlib.artist import Artist
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray
from scipy.stats import chi2

from wideberth.evaluation.plot_run import SeedRun
from wideberth.evaluation.report_style import FAINT, INK, LIMIT, MUTED, OWNSHIP, RC, TRAFFIC, new_figure
from wideberth.evaluation.tracking_figures import History, broken, target_colour, target_name
from wideberth.evaluation.tracking_metrics import RunScore
from wideberth.sensors.radar.plot_file import PlotTruth

FloatArray = NDArray[np.float64]

TIMELINE_ROWS_MAX = 30
_TARGETS_MAX = 8


def ospa_figure(runs: Sequence[SeedRun]) -> Figure:
    """Return OSPA against time of the first run, with its parts, and of all runs.

    Parameters
    ----------
    runs : sequence of SeedRun
        With a score each.

    Returns
    -------
    Figure
    """
    scores = [run.score for run in runs if run.score is not None]
    score = scores[0]
    t = score.t - score.t[0]
    with rc_context(RC):
        figure = new_figure(9.6, 3.4)
        axes = figure.add_subplot()
        if len(scores) > 1:
            every = np.stack([one.scans.ospa for one in scores])
            axes.fill_between(
                t, every.min(axis=0), every.max(axis=0), color=FAINT, alpha=0.35, linewidth=0,
                label=f"least to most of {len(scores)} seeds",
            )  # fmt: skip
        axes.plot(t, score.scans.ospa, color=OWNSHIP, linewidth=3.2, alpha=0.45, label="OSPA", zorder=3)
        axes.plot(t, score.scans.ospa_localisation, color=TRAFFIC[1], linewidth=1.1, label="localisation", zorder=4)
        axes.plot(t, score.scans.ospa_cardinality, color=TRAFFIC[0], linewidth=1.1, label="cardinality", zorder=4)
        axes.set_yscale("symlog", linthresh=1.0)
        axes.set_yticks([0, 0.5, 1, 2, 5, 10, 20, 50], ["0", "0.5", "1", "2", "5", "10", "20", "50"])
        axes.minorticks_off()
        axes.set(ylim=(0, 55), xlim=(0, max(t[-1], 1.0)), xlabel="time, s", ylabel="m")
        figure.legend(loc="outside upper left", ncols=4)
    return figure


def error_figure(truth: PlotTruth, tracks: Sequence[History], t: FloatArray, what: str) -> Figure:
    """Return the errors of each target's tracks against time, with three standard deviations to both sides.

    Parameters
    ----------
    truth : PlotTruth
    tracks : sequence of History
    t : ndarray, shape (n_scans,)
        Time of each scan, s.
    what : {"position", "velocity"}

    Returns
    -------
    Figure
    """
    first = 0 if what == "position" else 3
    known = truth.position if what == "position" else truth.velocity
    after = t - t[0]
    targets = range(min(known.shape[1], _TARGETS_MAX))
    outside = inside = 0
    with rc_context(RC):
        figure = new_figure(9.6, 1.0 + 1.55 * len(targets))
        grid = figure.subplots(len(targets), 3, sharex=True, squeeze=False)
        for target in targets:
            colour = target_colour(truth, target)
            limit = np.zeros(3)
            for track in tracks:
                mine = track.owner == target
                if not mine.any():
                    continue
                scan = track.scan[mine]
                error = track.x[mine, first : first + 3] - known[scan, target]
                sigma = np.sqrt(np.maximum(np.diagonal(track.P[mine], axis1=1, axis2=2)[:, first : first + 3], 0))
                late = after[scan] >= 5.0
                rows = late if late.any() else np.ones(len(scan), dtype=bool)
                limit = np.maximum(limit, np.percentile(3 * sigma[rows], 98, axis=0))
                limit = np.maximum(limit, np.percentile(np.abs(error[rows]), 98, axis=0))
                outside += int((np.abs(error) > 3 * sigma).sum())
                inside += int((np.abs(error) <= 3 * sigma).sum())
                for column in range(3):
                    axes = grid[target][column]
                    axes.fill_between(
                        after[scan], -3 * sigma[:, column], 3 * sigma[:, column], color=colour, alpha=0.17, linewidth=0
                    )
                    axes.plot(*broken(after[scan], error[:, column]), color=colour, linewidth=1.0, zorder=4)
            for column in range(3):
                axes = grid[target][column]
                half = 1.35 * float(limit[column]) or 1.0
                axes.set(ylim=(-half, half), xlim=(0, max(after[-1], 1.0)))
                axes.axhline(0, color=MUTED, linewidth=0.7)
            grid[target][0].set_title(target_name(truth, target), color=colour)
            grid[target][0].set_ylabel("m" if what == "position" else "m/s")
        for column, name in enumerate(("north", "east", "down")):
            grid[0][column].set_title(name, loc="right", fontweight="normal", color=MUTED)
            grid[-1][column].set_xlabel("time, s")
        share = inside / (inside + outside) if inside + outside else 1.0
        handles: list[Artist] = [
            Line2D([], [], color=MUTED, linewidth=1.0, label=f"error of {what}"),
            Patch(
                facecolor=MUTED, alpha=0.25, label=f"±3 σ; holds {100 * share:.1f} % of the errors (99.7 % is honest)"
            ),
        ]
        if known.shape[1] > len(targets):
            handles.append(Line2D([], [], linestyle="none", label=f"{known.shape[1] - len(targets)} targets not shown"))
        figure.legend(handles=handles, loc="outside upper left", ncols=3)
    return figure


def nees_figure(runs: Sequence[SeedRun]) -> Figure:
    """Return NEES per degree of freedom against time, mean over targets: of the first run and of all runs.

    Parameters
    ----------
    runs : sequence of SeedRun
        With a score each.

    Returns
    -------
    Figure
    """
    scores = [run.score for run in runs if run.score is not None]
    t = scores[0].t - scores[0].t[0]
    with rc_context(RC):
        figure = new_figure(9.6, 3.2)
        axes = figure.add_subplot()
        for chosen, colour, width, name in (
            (scores[:1], FAINT, 0.9, "mean over targets, this seed"),
            (scores, OWNSHIP, 1.5, f"mean over targets and {len(scores)} seeds"),
        )[: 1 if len(scores) == 1 else 2]:
            mean, count = _mean_nees(chosen)
            axes.plot(t, mean, color=colour, linewidth=width, label=name, zorder=4)
        dof = 6.0 * np.maximum(count, 1)
        for point in (0.025, 0.975):
            axes.plot(
                t, np.where(count > 0, chi2.ppf(point, dof) / dof, np.nan), color=LIMIT, linewidth=0.9,
                linestyle=(0, (4, 2)), label="95 % of a consistent tracker's" if point < 0.5 else None,
            )  # fmt: skip
        axes.axhline(1.0, color=INK, linewidth=0.8)
        axes.set_yscale("log")
        top = max(12.0, 1.3 * float(np.nanmax(mean, initial=0.0)))
        ticks = [0.1, 0.2, 0.5, 1, 2, 5, 10] if top < 30 else [10.0**k for k in range(-1, int(np.log10(top)) + 1)]
        axes.set_yticks(ticks, [f"{tick:,g}" for tick in ticks])
        axes.minorticks_off()
        axes.set(ylim=(0.1, top), xlim=(0, max(t[-1], 1.0)), xlabel="time, s", ylabel="NEES per dof")
        figure.legend(loc="outside upper left", ncols=3)
    return figure


def _mean_nees(scores: Sequence[RunScore]) -> tuple[FloatArray, NDArray[np.int64]]:
    """Return NEES per degree of freedom at each scan, NaN where there is none, and of how many pairs it is the mean."""
    n = len(scores[0].t)
    total, count = np.zeros(n), np.zeros(n, dtype=np.int64)
    for score in scores:
        good = np.isfinite(score.pairs.nees) & score.pairs.own
        np.add.at(total, score.pairs.scan[good], score.pairs.nees[good] / 6)
        np.add.at(count, score.pairs.scan[good], 1)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan), count


def timeline_figure(truth: PlotTruth, tracks: Sequence[History], t: FloatArray) -> Figure:
    """Return when each target was visible and each track lived, in the colour of the target that it was assigned to.

    Parameters
    ----------
    truth : PlotTruth
    tracks : sequence of History
        The longest `TIMELINE_ROWS_MAX` are shown.
    t : ndarray, shape (n_scans,)
        Time of each scan, s.

    Returns
    -------
    Figure
    """
    after = t - t[0]
    step = float(np.median(np.diff(after))) if len(after) > 1 else 1.0
    shown = sorted(tracks, key=lambda track: -len(track.scan))[:TIMELINE_ROWS_MAX]
    shown.sort(key=lambda track: (int(track.scan[0]), track.track_id))
    n = truth.visible.shape[1]
    with rc_context(RC):
        figure = new_figure(9.6, 1.3 + 0.27 * (n + len(shown) + 1))
        axes = figure.add_subplot()
        names = []
        for target in range(n):
            _bars(
                axes, target, after, np.flatnonzero(truth.visible[:, target]), step, target_colour(truth, target), 0.3
            )
            names.append(f"{target_name(truth, target)}, visible")
        for y, track in enumerate(shown, start=n + 1):
            for owner in np.unique(track.owner).tolist():
                colour = target_colour(truth, owner) if owner >= 0 else FAINT
                _bars(axes, y, after, track.scan[track.owner == owner], step, colour, 0.6)
            for scan, mark in ((track.scan[0], ">"), (track.scan[-1], "|")):
                axes.plot(after[scan], y, mark, color=INK, markersize=5 if mark == ">" else 9, zorder=6)
            names.append(f"track {track.track_id}{' (ownship)' if track.is_ownship else ''}")
        axes.set_yticks([*range(n), *range(n + 1, n + 1 + len(shown))], names, fontsize=8.5)
        axes.set_ylim(n + len(shown) + 0.7, -0.7)
        axes.set(xlim=(-0.01 * max(after[-1], 1.0), 1.01 * max(after[-1], 1.0)), xlabel="time, s")
        axes.grid(visible=False, axis="y")
        axes.set_axisbelow(True)
        axes.spines["left"].set_visible(False)
        axes.tick_params(axis="y", length=0)
        handles: list[Artist] = [
            Patch(facecolor=MUTED, label="assigned to the target of that colour"),
            Patch(facecolor=FAINT, label="assigned to none"),
            Line2D([], [], linestyle="none", marker=">", color=INK, label="first confirmed"),
            Line2D([], [], linestyle="none", marker="|", color=INK, label="last"),
        ]
        figure.legend(handles=handles, loc="outside upper left", ncols=4)
        if len(tracks) > len(shown):
            axes.set_title(f"{len(tracks) - len(shown)} more not shown", loc="right", fontweight="normal", color=MUTED)
    return figure


def _bars(
    axes: object, y: int, t: FloatArray, scans: NDArray[np.int64], step: float, colour: str, height: float
) -> None:
    """Draw one bar for each stretch of consecutive scans."""
    for stretch in np.split(scans, np.flatnonzero(np.diff(scans) > 1) + 1):
        if len(stretch):
            bar = [(float(t[stretch[0]]), float(t[stretch[-1]] - t[stretch[0]]) + step)]
            axes.broken_barh(bar, (y - height / 2, height), facecolors=colour)  # type: ignore[attr-defined]
