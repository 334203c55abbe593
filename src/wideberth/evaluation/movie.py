"""A recording as a movie: the map with everybody's recent path, heights beside it, and what was decided in words."""

import math
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, MaxNLocator
from numpy.typing import NDArray

from wideberth.errors import InputError
from wideberth.evaluation.flight_log import Encounter, FlightLog, encounters
from wideberth.evaluation.report_map import map_limits
from wideberth.evaluation.report_style import (
    FAINT,
    INK,
    LEVELS,
    MANEUVER,
    MISSION,
    MUTED,
    OWNSHIP,
    RC,
    clock,
    traffic_colour,
)
from wideberth.recording import RecordedStep, Recording
from wideberth.types import AlertLevel, Mission, Snapshot

FloatArray = NDArray[np.float64]
Picture = NDArray[np.uint8]

FORMATS = (".mp4", ".gif")
TRAIL = 60.0  # s of path behind each aircraft
_NEAR_MAX = 8
_EVENTS = 6
_EVENT_WIDTH = 54
_DPI = 100
_LEVEL_WORDS = {level: level.name.lower() for level in AlertLevel}


@dataclass(frozen=True, slots=True)
class MovieSettings:
    """How a movie is cut.

    Attributes
    ----------
    speed : float
        Recorded seconds in a second of the movie.
    frame_rate : float
        Pictures a second of the movie.
    t_from, t_to : float or None
        Seconds after the recording's start between which it plays; None: all.
    """

    speed: float = 10.0
    frame_rate: float = 20.0
    t_from: float | None = None
    t_to: float | None = None

    def __post_init__(self) -> None:
        for name, most in (("speed", 10_000.0), ("frame_rate", 120.0)):
            value = getattr(self, name)
            if not (math.isfinite(value) and 0.0 < value <= most):
                raise InputError(f"{name} {value:g} must be above 0 and at most {most:g}")
        for name in ("t_from", "t_to"):
            value = getattr(self, name)
            if value is not None and not math.isfinite(value):
                raise InputError(f"{name} must be finite")


def write_movie(
    path: str | os.PathLike[str],
    recording: Recording,
    settings: MovieSettings | None = None,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> int:
    """Write a recording as a movie.

    Parameters
    ----------
    path : str or Path
        Ending in .mp4 (needs imageio-ffmpeg, the extra "movie") or .gif; replaced once it is finished.
    recording : Recording
    settings : MovieSettings, optional
    progress : callable
        Told how many pictures are drawn, of how many.

    Returns
    -------
    int
        Pictures written.

    Raises
    ------
    InputError
        If the ending is another one, nothing of the recording lies in the time wanted, or the file cannot be written.
    """
    target = Path(path)
    cut = MovieSettings() if settings is None else settings
    if target.suffix.lower() not in FORMATS:
        raise InputError(f"{target}: a movie is {' or '.join(FORMATS)}")
    if not target.parent.is_dir():
        raise InputError(f"folder '{target.parent}' does not exist: create it, or name another file")
    times = frame_times(recording, cut)
    pictures = _pictures(recording, times, progress)
    partial = target.with_name(f"{target.stem}.part{target.suffix}")
    try:
        if target.suffix.lower() == ".gif":
            _write_gif(partial, pictures, cut.frame_rate)
        else:
            _write_mp4(partial, pictures, cut.frame_rate)
        os.replace(partial, target)
    except OSError as error:
        raise InputError(f"cannot write {target}: {error.strerror or error}") from error
    finally:
        partial.unlink(missing_ok=True)
    return len(times)


def frame_times(recording: Recording, settings: MovieSettings) -> FloatArray:
    """Return the recorded times of the pictures, s.

    Raises
    ------
    InputError
        If the recording has no steps, or none between `t_from` and `t_to`.
    """
    if not recording.step_count:
        raise InputError(f"{recording.path} has no steps: there is nothing to show")
    length = recording.t_end - recording.t_start
    first = 0.0 if settings.t_from is None else max(0.0, settings.t_from)
    last = length if settings.t_to is None else min(length, settings.t_to)
    if first > last:
        raise InputError(f"nothing to show from {first:g} to {last:g} s: the recording lasts {length:.1f} s")
    count = math.floor((last - first) * settings.frame_rate / settings.speed + 1e-9) + 1
    return np.asarray(recording.t_start + first + np.arange(count) * settings.speed / settings.frame_rate, np.float64)


def _pictures(recording: Recording, times: FloatArray, progress: Callable[[int, int], None]) -> Iterator[Picture]:
    log = FlightLog.of(recording.steps())
    with rc_context(RC):
        scene = Scene(log, encounters(log)[:_NEAR_MAX], recording.mission)
        done = 0
        last: RecordedStep | None = None
        # A picture shows the last step at or before its time.
        for step in recording.steps():
            while last is not None and done < len(times) and times[done] < step.t - 1e-9:
                yield scene.draw(last.snapshot)
                done += 1
                progress(done, len(times))
            last = step
        while last is not None and done < len(times):
            yield scene.draw(last.snapshot)
            done += 1
            progress(done, len(times))


class Scene:
    """The picture, whose parts move from step to step.

    Parameters
    ----------
    log : FlightLog
    near : sequence of Encounter
        The aircraft with a colour of their own.
    mission : Mission or None
    """

    def __init__(self, log: FlightLog, near: Sequence[Encounter], mission: Mission | None) -> None:
        self._log, self._near = log, near
        self._t0 = float(log.own.t[0])
        self._paths = log.aircraft()
        self._figure = Figure(figsize=(12.8, 7.2), dpi=_DPI)
        self._canvas: Any = FigureCanvasAgg(self._figure)
        self._map = self._figure.add_axes((0.06, 0.09, 0.56, 0.82))
        self._heights = self._figure.add_axes((0.70, 0.58, 0.28, 0.33))
        self._set_map(mission)
        self._set_heights()
        self._head = self._figure.text(0.06, 0.945, "", fontsize=13, fontweight="bold", color=INK)
        self._alert = self._figure.text(
            0.70, 0.945, "", fontsize=11, fontweight="bold", bbox={"boxstyle": "round,pad=0.35", "edgecolor": "none"}
        )
        self._reason = self._figure.text(0.66, 0.48, "", fontsize=9.5, color=MANEUVER, va="top", wrap=True)
        self._events = self._figure.text(0.66, 0.38, "", fontsize=8.5, color=MUTED, va="top", linespacing=1.5)

    def _set_map(self, mission: Mission | None) -> None:
        axes = self._map
        east0, east1, north0, north1 = map_limits(self._log, list(self._near), mission)
        box = axes.get_window_extent()
        # As much more to both sides as fills the axes at one scale.
        scale = max((east1 - east0) / box.width, (north1 - north0) / box.height) / 2.0
        east, north = (east0 + east1) / 2.0, (north0 + north1) / 2.0
        axes.set_xlim(east - scale * box.width, east + scale * box.width)
        axes.set_ylim(north - scale * box.height, north + scale * box.height)
        _distances(axes, 2.0 * scale * box.width)
        if mission is not None:
            w = mission.waypoints
            axes.plot(w[:, 1], w[:, 0], color=MISSION, linewidth=1.4, linestyle=(0, (5, 3)), marker="s", markersize=4)
        self._others = axes.plot([], [], "o", color=FAINT, markersize=3)[0]
        self._lines = [_moving(axes, traffic_colour(k), 1.7) for k in range(len(self._near))]
        self._names = [
            axes.annotate("", (0, 0), (7, 7), textcoords="offset points", fontsize=8.5, color=traffic_colour(k))
            for k in range(len(self._near))
        ]
        self._tracks = axes.plot([], [], "o", markerfacecolor="none", markeredgecolor=MUTED, markersize=11)[0]
        self._plan = axes.plot([], [], "-D", color=MANEUVER, linewidth=1.3, markersize=4)[0]
        self._own = _moving(axes, OWNSHIP, 2.6)

    def _set_heights(self) -> None:
        axes = self._heights
        axes.set_ylabel("altitude, m")
        axes.set_xlabel(f"last {TRAIL:g} s")
        axes.set_xlim(-TRAIL, 2.0)
        heights = [-self._log.own.positions[:, 2]] + [-one.positions[:, 2] for one in self._near]
        low, high = min(h.min() for h in heights), max(h.max() for h in heights)
        # Whoever passes far above or below would make the rest a line.
        own = heights[0]
        low, high = max(low, own.min() - 400.0), min(high, own.max() + 400.0)
        margin = 0.1 * max(high - low, 50.0)
        axes.set_ylim(low - margin, high + margin)
        self._height_lines = [_moving(axes, traffic_colour(k), 1.5) for k in range(len(self._near))]
        self._own_height = _moving(axes, OWNSHIP, 2.4)

    def draw(self, snapshot: Snapshot) -> Picture:
        """Return the picture of one step, shape (height, width, 3)."""
        t = snapshot.t
        self._draw_own(t)
        self._draw_traffic(t, snapshot)
        self._draw_words(t, snapshot)
        self._canvas.draw()
        pixels = np.asarray(self._canvas.buffer_rgba())
        # MP4 wants an even number of rows and columns.
        height, width = (pixels.shape[0] // 2) * 2, (pixels.shape[1] // 2) * 2
        return np.ascontiguousarray(pixels[:height, :width, :3])

    def _draw_own(self, t: float) -> None:
        times, p = _tail(self._log.own.t, self._log.own.positions, t)
        _move(self._own, p[:, 1], p[:, 0])
        _move(self._own_height, times - t, -p[:, 2])

    def _draw_traffic(self, t: float, snapshot: Snapshot) -> None:
        for k, one in enumerate(self._near):
            times, p = _tail(one.t, one.positions, t)
            _move(self._lines[k], p[:, 1], p[:, 0])
            _move(self._height_lines[k], times - t, -p[:, 2])
            there = len(p) > 0
            self._names[k].set_text(one.label if there else "")
            if there:
                self._names[k].xy = (float(p[-1, 1]), float(p[-1, 0]))
        named = {one.id for one in self._near}
        rest = [_tail(path.t, path.positions, t)[1] for name, path in self._paths.items() if name not in named]
        last = np.array([p[-1] for p in rest if len(p)]).reshape(-1, 3)
        self._others.set_data(last[:, 1], last[:, 0])
        tracks = np.array([track.position for track in snapshot.tracks if not track.is_ownship]).reshape(-1, 3)
        self._tracks.set_data(tracks[:, 1], tracks[:, 0])

    def _draw_words(self, t: float, snapshot: Snapshot) -> None:
        maneuver = snapshot.maneuver
        points = np.zeros((0, 3))
        if maneuver is not None:
            ahead = maneuver.times >= t - 1e-9
            points = np.vstack([snapshot.ownship.position, maneuver.waypoints[ahead]])
        self._plan.set_data(points[:, 1], points[:, 0])
        self._reason.set_text("flying the mission" if maneuver is None else "\n".join(_wrapped(maneuver.reason)[:4]))
        self._reason.set_color(MUTED if maneuver is None else MANEUVER)
        self._head.set_text(f"{clock(t - self._t0)}   to mission waypoint {snapshot.mission_index}")
        state = snapshot.alert_state
        self._alert.set_text(f"alert: {_LEVEL_WORDS[state]}")
        self._alert.set_color("white" if state in (AlertLevel.WARNING, AlertLevel.UNKNOWN) else INK)
        box = self._alert.get_bbox_patch()
        assert box is not None
        box.set_facecolor(LEVELS[state])
        said = [(when, text) for when, text in self._log.events if when <= t + 1e-9][-_EVENTS:]
        lines = [line for when, text in said for line in _wrapped(f"{clock(when - self._t0)}  {text}")[:2]]
        self._events.set_text("\n".join(lines))


def _moving(axes: Axes, colour: str, width: float) -> tuple[Line2D, Line2D]:
    """Return a trail and the dot at its head."""
    trail = axes.plot([], [], color=colour, linewidth=width, solid_capstyle="round")[0]
    head = axes.plot([], [], "o", color=colour, markersize=6.5, markeredgecolor="white")[0]
    return trail, head


def _move(line: tuple[Line2D, Line2D], x: FloatArray, y: FloatArray) -> None:
    line[0].set_data(x, y)
    line[1].set_data(x[-1:], y[-1:])


def _tail(times: FloatArray, positions: FloatArray, t: float) -> tuple[FloatArray, FloatArray]:
    """Return the path of the last `TRAIL` seconds; empty where the aircraft is not known any more."""
    last = int(np.searchsorted(times, t + 1e-9, side="right"))
    if not last or t - times[last - 1] > 2.0:
        return np.zeros(0), np.zeros((0, 3))
    first = int(np.searchsorted(times, t - TRAIL))
    return times[first:last], positions[first:last]


def _wrapped(text: str) -> list[str]:
    import textwrap

    return textwrap.wrap(text, _EVENT_WIDTH)


def _distances(axes: Axes, width: float) -> None:
    per_unit, unit = (1000.0, "km") if width >= 5000.0 else (1.0, "m")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator(8, steps=[1, 2, 5, 10]))
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value / per_unit:g}"))
    axes.set_xlabel(f"east, {unit}")
    axes.set_ylabel(f"north, {unit}")


def _write_gif(path: Path, pictures: Iterator[Picture], frame_rate: float) -> None:
    from PIL import Image

    images: Iterator[Any] = (Image.fromarray(picture).quantize(64) for picture in pictures)
    first = next(images)
    # GIF counts hundredths of a second.
    duration = max(20, round(100.0 / frame_rate) * 10)
    first.save(path, save_all=True, append_images=images, duration=duration, loop=0)


def _write_mp4(path: Path, pictures: Iterator[Picture], frame_rate: float) -> None:
    try:
        import imageio_ffmpeg
    except ImportError:
        raise InputError("an .mp4 needs imageio-ffmpeg: install wideberth[movie], or write a .gif") from None
    first = next(pictures)
    size = (first.shape[1], first.shape[0])
    writer = imageio_ffmpeg.write_frames(
        str(path), size, fps=frame_rate, macro_block_size=2, ffmpeg_log_level="error", quality=7
    )
    writer.send(None)
    try:
        writer.send(first)
        for picture in pictures:
            writer.send(picture)
    finally:
        writer.close()
