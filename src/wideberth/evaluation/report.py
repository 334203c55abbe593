"""The report of a run: one self-contained page and its pictures."""

import datetime
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from wideberth import __version__
from wideberth.errors import InputError
from wideberth.evaluation.flight_log import FlightLog, encounters
from wideberth.evaluation.report_map import map_figure
from wideberth.evaluation.report_page import page
from wideberth.evaluation.report_plots import altitude_figure, separation_figure, timeline_figure
from wideberth.evaluation.report_shell import write_files
from wideberth.evaluation.report_style import png, svg
from wideberth.recording import Recording
from wideberth.units import DEGREE

# More than this many near aircraft are not told apart by colour any more.
NEAR_MAX = 8
_TITLES = {
    "map": "Map of the flight",
    "altitude": "Altitude against time",
    "separation": "Separation against time",
    "timeline": "Alert levels against time",
}


def write_report(
    out_dir: str | os.PathLike[str], recording: Recording, summary: Mapping[str, Any], title: str = ""
) -> Path:
    """Write ``report.html`` and ``map.png``, ``altitude.png``, ``separation.png``, ``timeline.png``.

    Parameters
    ----------
    out_dir : str or Path
        Made where it does not exist.
    recording : Recording
        Of the run, whole or torn.
    summary : mapping
        As `RunMetrics.summary` makes it.
    title : str
        Of the page; else the scenario's name.

    Returns
    -------
    Path
        Of the page.

    Raises
    ------
    InputError
        If the recording has no steps, or the folder cannot be written.
    """
    log = FlightLog.of(recording.steps())
    if not log.own.rows:
        raise InputError(f"{recording.path} has no steps: there is nothing to report")
    near = encounters(log)[:NEAR_MAX]
    figures = {
        "map": map_figure(log, near, recording.mission),
        "altitude": altitude_figure(log, near, recording.mission, recording.frame),
        "separation": separation_figure(log, near, summary),
        "timeline": timeline_figure(log, near),
    }
    name = title or str(recording.scenario.get("name") or recording.path.parent.name or "Run")
    notes = [str(note) for note in summary.get("notes", ())]
    if not recording.complete:
        notes.insert(0, f"The recording is not whole: {recording.message}.")
    notes.append(f"wideberth {__version__}, seed {summary.get('seed')}, {recording.message}.")
    text = page(
        name,
        _subtitle(log, recording),
        summary,
        log,
        near,
        {key: svg(figure, _TITLES[key]) for key, figure in figures.items()},
        notes,
    )
    out = Path(out_dir)
    write_files(out, {**{f"{key}.png": png(figure) for key, figure in figures.items()}, "report.html": text})
    return out / "report.html"


def _subtitle(log: FlightLog, recording: Recording) -> str:
    """Return when and where: times since 1970 as a date, others as they are."""
    t = log.own.t[0]
    if t > 1e8:
        start = datetime.datetime.fromtimestamp(t, datetime.UTC)
        when = f"{start:%Y-%m-%d %H:%M:%S} UTC"
    else:
        when = f"from {t:g} s"
    latitude, longitude, _ = recording.frame.to_geodetic(log.own.positions[0])
    lat, lon = float(latitude) / DEGREE, float(longitude) / DEGREE
    return f"{when}, at {abs(lat):.3f}° {'N' if lat >= 0 else 'S'} {abs(lon):.3f}° {'E' if lon >= 0 else 'W'}"
