"""The report of a sensor's sizing: one self-contained page, its pictures, and the numbers as JSON."""

import json
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from wideberth import __version__
from wideberth.analysis.escapes import range_by_escapes
from wideberth.analysis.ground_sizing import GroundProtection
from wideberth.analysis.sensor_sizing import available_range, fastest_closing
from wideberth.analysis.sizing_answer import SizingAnswer
from wideberth.analysis.sizing_config import AdsbSizingConfig, SensorConfig
from wideberth.argument_checks import FloatArray
from wideberth.evaluation.report_shell import make_folder, notes_footer, section, shell, write_files
from wideberth.evaluation.report_style import png, svg
from wideberth.evaluation.sizing_figures import protection_figure, snr_figure, speed_figure
from wideberth.evaluation.sizing_ground_figure import ground_figure, required_figure
from wideberth.evaluation.sizing_tables import (
    Sizing,
    cross_sections,
    cure_rows,
    escape_rows,
    protection_rows,
    reach_rows,
)

NOTES = (
    "Intruders fly straight and level on whatever course would enter the safety volume; the worst counts. The aircraft "
    "flies straight until its decision time after the track is confirmed, then makes one maneuver.",
    "Not modelled: clutter, terrain and multipath, rain, errors of the track, an intruder that maneuvers, and a sensor "
    "that loses sight of the intruder in the turn. At the edge of the field of view a few degrees are uncertain.",
)


def write_sizing_report(out: Path, sizing: Sizing, summary: Mapping[str, Any]) -> Path:
    """Write ``report.html``, its pictures as PNG, and ``size.json``.

    Parameters
    ----------
    out : Path
        A folder, made where it does not exist.
    sizing : Sizing
    summary : mapping
        What goes into ``size.json``, as `sizing_summary.summary` makes it.

    Returns
    -------
    Path
        Of the page.

    Raises
    ------
    InputError
        If the folder cannot be written.
    """
    make_folder(out)
    figures = _figures(sizing)
    text = _page(sizing, {name: svg(figure, title) for name, (figure, title) in figures.items()})
    pictures = {f"{name}.png": png(figure) for name, (figure, _) in figures.items()}
    numbers = json.dumps(summary, indent=1, allow_nan=False) + "\n"
    write_files(out, {**pictures, "size.json": numbers, "report.html": text})
    return out / "report.html"


def _figures(sizing: Sizing) -> dict[str, tuple[Figure, str]]:
    found: dict[str, tuple[Figure, str]] = {}
    if isinstance(sizing.answer, GroundProtection):
        bearings = np.radians(np.arange(-180.0, 180.0, 2.0))
        angle, speed = np.meshgrid(bearings, sizing.answer.intruder_speeds, indexing="ij")
        required = range_by_escapes(angle, speed, sizing.aircraft)
        found["volumes"] = ground_figure(sizing.answer, sizing.intruders), "Surveillance and operation volumes"
        found["required"] = required_figure(required, bearings, sizing.intruders), "Range required by bearing"
    else:
        speeds = sizing.answer.map.intruder_speeds
        found["protection"] = protection_figure(sizing.answer), "Ranges by bearing, and bearings and speeds protected"
        found["ranges"] = speed_figure(sizing.answer, _reaches(sizing, speeds), speeds), "Ranges against speed"
    if not isinstance(sizing.sensor, AdsbSizingConfig):
        found["snr"] = snr_figure(sizing.sensor, cross_sections(sizing.rcs)), "Signal-to-noise ratio against range"
    return found


def _reaches(sizing: Sizing, speeds: FloatArray) -> dict[float, FloatArray]:
    closing = fastest_closing(np.zeros(speeds.shape), sizing.aircraft.speed_cruise_mps, speeds)
    if isinstance(sizing.sensor, AdsbSizingConfig):
        return {0.0: available_range(sizing.sensor, 0.0, closing)}
    return {rcs: available_range(sizing.sensor, 0.0, closing, rcs=rcs) for rcs in cross_sections(sizing.rcs)}


def _page(sizing: Sizing, pictures: Mapping[str, str]) -> str:
    aircraft = sizing.aircraft
    subtitle = f"{sizing.sensor_name} for {aircraft.name} at {aircraft.speed_cruise_mps:g} m/s"
    body = []
    if isinstance(sizing.answer, GroundProtection):
        state = "good" if all(sizing.answer.protected) else "warn" if any(sizing.answer.protected) else "bad"
        headline = "Protected inside the operation volume" if state != "bad" else "Not protected"
        body += [
            section(
                "Where it may fly",
                "Dashed: where the radar holds a track of an intruder that comes straight at it. Filled: where the "
                "aircraft, wherever the intruder comes from, still has the required range and the radius of its turn.",
                pictures["volumes"] + table(*protection_rows(sizing)),
            ),
            section("Range required, by bearing", "From the aircraft's nose.", pictures["required"]),
        ]
    else:
        limits = (sizing.answer.head_on, sizing.answer.field_of_view, sizing.answer.all_round)
        none = all(limit.speed is None for limit in limits)
        state = "good" if sizing.answer.all_round.at_least else "bad" if none else "warn"
        headline = {"good": "Protected", "warn": "Protected in part", "bad": "Not protected"}[state]
        body += [
            section(
                "By bearing and speed",
                "Left: the range at which a track must be confirmed, and the region where the sensor has confirmed it "
                "(for each speed its own edge). Where a curve is inside the region of its colour, it is thick: there "
                f"the aircraft is protected. Right: the same for all speeds. Cross-section {sizing.rcs:g} m².",
                pictures["protection"],
            ),
            section("Intruders", "Bearings clockwise from the nose.", table(*protection_rows(sizing))),
            _cures(sizing.answer),
            section(
                "Head-on", "Where the lines cross, protection from ahead ends.", pictures["ranges"]
            ),
        ]  # fmt: skip
    if "snr" in pictures:
        body.append(
            section(
                "Signal-to-noise ratio",
                "On boresight. Processing (channels, averages) is in the lines of detection, not in the curves.",
                pictures["snr"],
            )
        )
    body += [
        section("The sensor's reach", _reach_words(sizing.sensor), table(*reach_rows(sizing))),
        section(
            "The aircraft's escapes",
            f"Head-on range that each takes. Counted above: {', '.join(aircraft.escapes)}.",
            table(*escape_rows(sizing)),
        ),
        notes_footer([*NOTES, f"wideberth {__version__}."]),
    ]
    return shell("What the sensor protects from", subtitle, state, headline, sizing.words, "\n".join(body))


def _cures(answer: SizingAnswer) -> str:
    head, rows = cure_rows(answer)
    text = (
        "In the present field of view: the range at which a track must be there, or the cross-section from which on it "
    )
    text += "is, or the decision time that would do. All round: the range and the width of view that would do."
    return section("What would protect", text, table(head, rows)) if rows else ""


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return an HTML table; columns of numbers are set right."""
    right = [bool(rows) and all(row[k][:1] in "0123456789−–n" for row in rows) for k in range(len(head))]
    classes = ["" if not k or not right[k] else " class=n" for k in range(len(head))]
    titles = "".join(f"<th{c}>{escape(text.replace(chr(10), ' '))}</th>" for c, text in zip(classes, head, strict=True))
    lines = "".join(
        f"<tr>{''.join(f'<td{c}>{escape(text)}</td>' for c, text in zip(classes, row, strict=True))}</tr>"
        for row in rows
    )
    return f'<div class="scroll"><table><tr>{titles}</tr>{lines}</table></div>'


def _reach_words(sensor: SensorConfig) -> str:
    if isinstance(sensor, AdsbSizingConfig):
        return (
            f"Only aircraft that send. A message each {sensor.interval_s:g} s, of which {100 * sensor.loss:.0f} % are "
            f"lost; a track after {sensor.confirm_hits} of {sensor.confirm_window}, with probability "
            f"{sensor.confirmation_probability:g}."
        )
    return (
        f"Field of view {sensor.azimuth_fov_deg:g}° × {sensor.elevation_fov_deg:g}°, "
        f"{len(sensor.boresight_azimuths_deg)} boresight(s); a scan each {sensor.update_interval_s:g} s; false alarms "
        f"{sensor.false_alarm_probability:g} per bin and scan. A track is confirmed by {sensor.confirm_hits} of "
        f"{sensor.confirm_window} scans and after {sensor.confirm_time_s:g} s, with probability "
        f"{sensor.confirmation_probability:g}. Tracks by closing speed; beside them, by how much "
        "that is beyond or short of what one scan sees."
    )
