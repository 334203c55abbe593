"""The pictures of a tracking report against the truth: flight paths, radar plots, states (thesis, chapters 3 and 4)."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from wideberth.evaluation.plot_run import SeedRun
from wideberth.evaluation.report_style import FAINT, GRID, INK, MUTED, OWNSHIP, RC, new_figure, traffic_colour
from wideberth.plots import Plots
from wideberth.sensors.radar.plot_file import PlotFile, PlotTruth
from wideberth.units import DEGREE

FloatArray = NDArray[np.float64]

# Wide and pale below, the estimate narrow on top: both are seen where they agree.
_TRUTH: dict[str, Any] = {"linewidth": 4.5, "alpha": 0.3, "solid_capstyle": "round"}
_ESTIMATE: dict[str, Any] = {"linewidth": 1.2, "zorder": 5}
# As pixels: thousands of dots would make a page of megabytes.
_DOTS: dict[str, Any] = {"linestyle": "none", "marker": ".", "markersize": 1.6, "color": FAINT, "rasterized": True}


@dataclass(frozen=True, slots=True)
class History:
    """One track: its scans, states (n, 9) and covariances (n, 9, 9), and the target that it follows most (-1: none)."""

    track_id: int
    scan: NDArray[np.int64]
    x: FloatArray
    P: FloatArray
    owner: NDArray[np.int64]
    target: int
    is_ownship: bool


def histories(run: SeedRun) -> list[History]:
    """Return the tracks of a run, in order of birth.

    Parameters
    ----------
    run : SeedRun

    Returns
    -------
    list of History
    """
    table = run.table
    owner = np.full(len(table), -1, dtype=np.int64)
    if run.score is not None:
        owner[run.score.pairs.row] = run.score.pairs.target
    ids, first = np.unique(table.track_id, return_index=True)
    found = []
    for track_id in ids[np.argsort(first)].tolist():
        rows = np.flatnonzero(table.track_id == track_id)
        owners = owner[rows]
        followed = owners[owners >= 0]
        main = int(np.bincount(followed).argmax()) if len(followed) > 0.5 * len(owners) else -1
        marked = bool(table.is_ownship[rows].mean() > 0.5)
        found.append(
            History(track_id, table.scan[rows].astype(np.int64), table.x[rows], table.P[rows], owners, main, marked)
        )
    return found


def target_colour(truth: PlotTruth | None, target: int) -> str:
    """Return the colour of a target.

    Parameters
    ----------
    truth : PlotTruth or None
    target : int
        -1: what follows none.

    Returns
    -------
    str
    """
    if target < 0:
        return INK
    own = -1 if truth is None else truth.ownship
    if target == own:
        return OWNSHIP
    return traffic_colour(target - (0 <= own < target))


def target_name(truth: PlotTruth, target: int) -> str:
    """Return what to call a target.

    Parameters
    ----------
    truth : PlotTruth
    target : int

    Returns
    -------
    str
    """
    if target == truth.ownship:
        return "ownship"
    return f"intruder {target + (0 if 0 <= truth.ownship < target else 1)}"


def track_colours(truth: PlotTruth | None, tracks: Sequence[History]) -> list[str]:
    """Return a colour for each track: that of the target it follows, or without truth one after the other.

    Parameters
    ----------
    truth : PlotTruth or None
    tracks : sequence of History

    Returns
    -------
    list of str
    """
    if truth is None:
        return [OWNSHIP if track.is_ownship else traffic_colour(k) for k, track in enumerate(tracks)]
    return [target_colour(truth, track.target) for track in tracks]


def legend(
    figure: Figure, file: PlotFile, tracks: Sequence[History], *, dots: bool = False, onboard: bool = False
) -> None:
    """Put one legend above the whole figure.

    Parameters
    ----------
    figure : Figure
    file : PlotFile
    tracks : sequence of History
        Those that are drawn.
    dots : bool
        Whether the radar's plots are drawn.
    onboard : bool
        Whether the path of an ownship that carries the radar is drawn.
    """
    handles: list[Artist] = []
    truth = file.truth
    if onboard:
        handles.append(Line2D([], [], color=OWNSHIP, **_TRUTH, label="ownship, carries the radar"))
    if truth is not None:
        for k in range(truth.position.shape[1]):
            handles.append(Line2D([], [], color=target_colour(truth, k), linewidth=3, label=target_name(truth, k)))
        handles.append(Line2D([], [], color=MUTED, **_TRUTH, label="truth"))
    if tracks:
        handles.append(Line2D([], [], color=MUTED, linewidth=1.2, label="track"))
    if truth is not None and any(track.target < 0 for track in tracks):
        handles.append(Line2D([], [], color=INK, linewidth=1.2, label="track of none"))
    if dots:
        handles.append(Line2D([], [], linestyle="none", marker=".", color=FAINT, label="radar plot"))
    figure.legend(handles=handles, loc="outside upper left", ncols=10, handlelength=1.2, columnspacing=1.0)


def plot_positions(plots: Plots) -> FloatArray:
    """Return the place (rows, 3) of each plot, local NED, m.

    Parameters
    ----------
    plots : Plots

    Returns
    -------
    ndarray, shape (rows, 3)
        NaN where the plot is not finite.
    """
    scan = np.repeat(np.arange(plots.n_scans), np.diff(plots.first))
    r, azimuth, elevation = plots.z[:, 0], plots.z[:, 1], plots.z[:, 2]
    flat = r * np.cos(elevation)
    local = np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), -r * np.sin(elevation)], axis=1)
    places: FloatArray = plots.sensor_position[scan] + np.einsum("nij,nj->ni", plots.sensor_attitude[scan], local)
    return places


def polar(positions: FloatArray, sensor_position: FloatArray, sensor_attitude: FloatArray) -> FloatArray:
    """Return range, azimuth and elevation of places as a sensor sees them.

    Parameters
    ----------
    positions : ndarray, shape (n, 3)
        Local NED, m.
    sensor_position : ndarray, shape (n, 3)
        Local NED, m.
    sensor_attitude : ndarray, shape (n, 3, 3)
        C_ned_sensor.

    Returns
    -------
    ndarray, shape (n, 3)
        Range m, azimuth and elevation rad; (3.50) and (3.53) of the thesis.
    """
    local = np.einsum("nji,nj->ni", sensor_attitude, positions - sensor_position)
    r = np.linalg.norm(local, axis=1)
    up = np.clip(-local[:, 2] / np.maximum(r, 1e-9), -1, 1)
    return np.stack([r, np.arctan2(local[:, 1], local[:, 0]), np.arcsin(up)], axis=1)


def path_figure(file: PlotFile, plots: Plots, tracks: Sequence[History], *, measured: bool) -> Figure:
    """Return the flight paths in space, from above and from the side.

    Parameters
    ----------
    file : PlotFile
    plots : Plots
    tracks : sequence of History
    measured : bool
        With the radar's plots and the tracks (figures 3.8, 3.9 and 4.15 of the thesis); else the true paths alone
        (figures 3.6, 3.7).

    Returns
    -------
    Figure
    """
    truth = file.truth
    known = [] if truth is None else [truth.position[:, k] for k in range(truth.position.shape[1])]
    with rc_context(RC):
        figure = new_figure(9.6, 6.6)
        grid = figure.add_gridspec(2, 2, width_ratios=(1.15, 1), height_ratios=(2.7, 1))
        space: Any = figure.add_subplot(grid[0, 0], projection="3d")
        above, side = figure.add_subplot(grid[0, 1]), figure.add_subplot(grid[1, :])
        space.set_box_aspect(None, zoom=0.92)
        limits = _limits([*known, *([file.sensor_position] if file.onboard else [])])
        views: list[tuple[Any, tuple[int, ...]]] = [(space, (1, 0, 2)), (above, (1, 0)), (side, (0, 2))]
        for axes, order in views:
            for k, path in enumerate(known):
                _draw(axes, path, order, color=target_colour(truth, k), **_TRUTH)
            if file.onboard:
                _draw(axes, file.sensor_position, order, color=OWNSHIP, **_TRUTH)
            else:
                _draw(axes, np.zeros((1, 3)), order, marker="^", color=INK, markersize=6)
            if measured:
                places = plot_positions(plots)
                _draw(axes, _inside(places, limits) if axes is space else places, order, **_DOTS)
                for track, colour in zip(tracks, track_colours(truth, tracks), strict=True):
                    _draw(axes, track.x[:, :3], order, color=colour, **_ESTIMATE)
            for k, path in enumerate(known):
                _draw(axes, path[:1], order, marker="o", color=target_colour(truth, k), markersize=4.5)
        above.set(xlabel="east, m", ylabel="north, m", aspect="equal", adjustable="box")
        side.set(xlabel="north, m", ylabel="altitude, m")
        space.set_xlabel("east, m")
        space.set_ylabel("north, m")
        space.set_zlabel("altitude, m")
        _tidy_space(space)
        if limits is not None:
            north, east, up = limits.T.tolist()
            space.set(xlim=east, ylim=north, zlim=up)
            above.set(xlim=east, ylim=north)
            side.set(xlim=north, ylim=up)
        legend(figure, file, tracks if measured else [], dots=measured, onboard=file.onboard)
    return figure


def _draw(axes: Any, path: FloatArray, order: tuple[int, ...], **style: Any) -> None:
    neu = path * [1.0, 1.0, -1.0]
    axes.plot(*(neu[:, k] for k in order), **style)


def _limits(paths: Sequence[FloatArray]) -> FloatArray | None:
    """Return the least and the most (2, 3) of north, east, up to show, so that clutter does not; None without paths."""
    if not paths:
        return None
    every = np.concatenate(paths) * [1.0, 1.0, -1.0]
    low, high = np.nanmin(every, axis=0), np.nanmax(every, axis=0)
    margin = np.maximum(0.08 * (high - low), 40.0)
    return np.stack([low - margin, high + margin])


def _inside(positions: FloatArray, limits: FloatArray | None) -> FloatArray:
    """Return the positions inside the limits: axes in space do not clip."""
    if limits is None:
        return positions
    neu = positions * [1.0, 1.0, -1.0]
    inside: FloatArray = positions[((neu >= limits[0]) & (neu <= limits[1])).all(axis=1)]
    return inside


def _tidy_space(space: Any) -> None:
    for axis in (space.xaxis, space.yaxis, space.zaxis):
        axis.set_pane_color((0, 0, 0, 0))
        axis._axinfo["grid"]["color"] = GRID
    space.tick_params(labelsize=7.5, pad=-1)
    space.view_init(elev=26, azim=-58)


def polar_figure(file: PlotFile, plots: Plots, tracks: Sequence[History]) -> Figure:
    """Return range, azimuth and elevation against time: plots, truth and tracks (figures 3.10 and 4.14 of the thesis).

    Parameters
    ----------
    file : PlotFile
    plots : Plots
    tracks : sequence of History

    Returns
    -------
    Figure
    """
    truth = file.truth
    scale = np.array([1.0, DEGREE, DEGREE])
    t = file.t - file.t[0]
    scan = np.repeat(np.arange(plots.n_scans), np.diff(plots.first))
    frame = "body" if file.onboard else "radar's"
    with rc_context(RC):
        figure = new_figure(9.6, 6.4)
        for column, (axes, name) in enumerate(
            zip(figure.subplots(3, 1, sharex=True), ("range, m", "azimuth, °", "elevation, °"), strict=True)
        ):
            axes.plot(t[scan], plots.z[:, column] / scale[column], **_DOTS)
            for k in range(0 if truth is None else truth.position.shape[1]):
                assert truth is not None
                seen = polar(truth.position[:, k], file.sensor_position, file.sensor_attitude)[:, column]
                seen = np.where(truth.visible[:, k], seen, np.nan)
                axes.plot(*broken(t, seen / scale[column]), color=target_colour(truth, k), **_TRUTH)
            for track, colour in zip(tracks, track_colours(truth, tracks), strict=True):
                there = polar(track.x[:, :3], file.sensor_position[track.scan], file.sensor_attitude[track.scan])
                axes.plot(*broken(t[track.scan], there[:, column] / scale[column]), color=colour, **_ESTIMATE)
            axes.set_ylabel(name)
            if name == "azimuth, °":
                _round_axis(axes)
        axes.set_xlabel(f"time, s (angles in the {frame} frame)")
        axes.set_xlim(0, max(t[-1], 1.0))
        legend(figure, file, tracks, dots=True)
    return figure


def state_figure(file: PlotFile, plots: Plots, tracks: Sequence[History], what: str) -> Figure:
    """Return states against time, beside the truth.

    Parameters
    ----------
    file : PlotFile
    plots : Plots
    tracks : sequence of History
    what : {"position", "velocity", "acceleration"}
        Position (figures 3.11 and 4.16 of the thesis); velocity: with a radar on board speed, course and flight-path
        angle (3.12), with one on the ground north, east and up (4.17); acceleration: the rates of those (3.13).

    Returns
    -------
    Figure
    """
    truth, t = file.truth, file.t - file.t[0]
    names = _NAMES[what, file.onboard]
    with rc_context(RC):
        figure = new_figure(9.6, 6.0)
        known: list[FloatArray] = []
        for k in range(0 if truth is None else truth.position.shape[1]):
            assert truth is not None
            rate = np.gradient(truth.velocity[:, k], file.dt, axis=0) if len(t) > 1 else np.zeros((1, 3))
            state = np.concatenate([truth.position[:, k], truth.velocity[:, k], rate], axis=1)
            known.append(_shown(state, what, file.onboard))
        estimates = [_shown(track.x, what, file.onboard) for track in tracks]
        measured = plot_positions(plots) * [1.0, 1.0, -1.0]
        scan = np.repeat(np.arange(plots.n_scans), np.diff(plots.first))
        for row, (axes, name) in enumerate(zip(figure.subplots(3, 1, sharex=True), names, strict=True)):
            for k, values in enumerate(known):
                axes.plot(*broken(t, values[:, row]), color=target_colour(truth, k), **_TRUTH)
            for track, values, colour in zip(tracks, estimates, track_colours(truth, tracks), strict=True):
                axes.plot(*broken(t[track.scan], values[:, row]), color=colour, **_ESTIMATE)
            _limit(axes, [v[:, row] for v in known or estimates], what, name)
            if what == "position":
                axes.plot(t[scan], measured[:, row], **_DOTS, scaley=False)
            axes.set_ylabel(name)
        axes.set_xlabel("time, s")
        axes.set_xlim(0, max(t[-1], 1.0))
        legend(figure, file, tracks, dots=what == "position")
    return figure


_NAMES = {
    ("position", True): ("north, m", "east, m", "altitude, m"),
    ("position", False): ("north, m", "east, m", "altitude, m"),
    ("velocity", True): ("speed, m/s", "course, °", "flight-path angle, °"),
    ("velocity", False): ("north, m/s", "east, m/s", "up, m/s"),
    ("acceleration", True): ("speed rate, m/s²", "course rate, °/s", "flight-path angle rate, °/s"),
    ("acceleration", False): ("north, m/s²", "east, m/s²", "up, m/s²"),
}
# The least half-height of a picture: the truth of straight flight would show nothing but noise.
_LEAST = {"position": 60.0, "velocity": 3.0, "acceleration": 1.5}


def _shown(x: FloatArray, what: str, path_angles: bool) -> FloatArray:
    """Return the three quantities of a picture (n, 3) from states (n, 9)."""
    neu = np.array([1.0, 1.0, -1.0])
    if what == "position":
        return np.asarray(x[:, :3] * neu)
    v, a = x[:, 3:6] * neu, x[:, 6:9] * neu
    if not path_angles:
        return np.asarray(v if what == "velocity" else a)
    # Speed, course and flight-path angle of (3.48), and their rates.
    flat = np.maximum(np.hypot(v[:, 0], v[:, 1]), 1e-6)
    speed = np.hypot(flat, v[:, 2])
    if what == "velocity":
        return np.stack([speed, np.arctan2(v[:, 1], v[:, 0]) / DEGREE, np.arctan2(v[:, 2], flat) / DEGREE], axis=1)
    flat_rate = (v[:, 0] * a[:, 0] + v[:, 1] * a[:, 1]) / flat
    course_rate = (v[:, 0] * a[:, 1] - v[:, 1] * a[:, 0]) / flat**2
    angle_rate = (a[:, 2] * flat - v[:, 2] * flat_rate) / speed**2
    return np.stack([np.sum(v * a, axis=1) / speed, course_rate / DEGREE, angle_rate / DEGREE], axis=1)


def _limit(axes: Axes, values: Sequence[FloatArray], what: str, name: str) -> None:
    """Show the truth with room around it: the first estimates of a track may be far off."""
    every = np.concatenate(values) if values else np.zeros(1)
    if name == "course, °":
        _round_axis(axes)
        return
    low, high = np.nanpercentile(every, [0.5, 99.5])
    margin = max(0.25 * (high - low), (3.0 if "°" in name else 1.0) * _LEAST[what])
    axes.set_ylim(low - margin, high + margin)


def _round_axis(axes: Axes) -> None:
    axes.set_ylim(-185, 185)
    axes.set_yticks([-180, -90, 0, 90, 180])


def broken(t: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Break a line where an angle in degrees jumps from one side to the other, and where scans are missing.

    Parameters
    ----------
    t : ndarray, shape (n,)
    values : ndarray, shape (n,)

    Returns
    -------
    t, values : ndarray, shape (n + breaks,)
        With a NaN at each break.
    """
    step = np.median(np.diff(t)) if len(t) > 1 else 1.0
    breaks = np.flatnonzero((np.abs(np.diff(values)) > 180.0) | (np.diff(t) > 2.5 * step)) + 1
    return np.insert(t, breaks, np.nan), np.insert(values, breaks, np.nan)
