"""Missions from CSV files."""

import csv
import math
from pathlib import Path

from pydantic import ValidationError

from wideberth.errors import InputError
from wideberth.simulation.config import MissionConfig, WaypointConfig

COLUMNS = ("lat_deg", "lon_deg", "altitude_m", "speed_mps", "start_time_s")
_RANGES = {
    "lat_deg": (-90.0, 90.0),
    "lon_deg": (-180.0, 180.0),
    "altitude_m": (-1000.0, 100_000.0),
    "speed_mps": (0.0, 1000.0),
}


def read_mission_file(path: str | Path) -> tuple[MissionConfig, tuple[str, ...]]:
    """Read a mission from a CSV file with the columns of `COLUMNS`.

    Parameters
    ----------
    path : str or Path
        A row per waypoint: WGS84 latitude and longitude, altitude (pressure altitude where the traffic's is), ground
        speed on the leg that ends there, and in the first row the Unix time of the start. Later rows may leave
        `start_time_s` empty or repeat it; other values there are ignored with a message. Other columns are ignored.

    Returns
    -------
    mission : MissionConfig
    messages : tuple of str
        What was merged or ignored, in words.

    Raises
    ------
    InputError
        If the file cannot be read or is no such table, with the line and what to do.
    """
    path = Path(path)
    rows, messages = _rows(path)
    waypoints: list[WaypointConfig] = []
    start = math.nan
    for line, row in rows:
        values = {name: _number(path, line, name, row[name]) for name in _RANGES}
        if values["speed_mps"] <= 0:
            raise InputError(f"{path}, line {line}: speed_mps is {values['speed_mps']:g}: give a speed above 0")
        text = row["start_time_s"]
        if not waypoints:
            start = _number(path, line, "start_time_s", text)
        elif text and (time := _number(path, line, "start_time_s", text)) != start:
            messages.append(f"line {line}: start_time_s {time:.10g} ignored: only the first row's counts")
        waypoint = WaypointConfig(**values)
        if waypoints and _same_place(waypoints[-1], waypoint):
            messages.append(f"line {line}: repeats the waypoint before, merged")
            continue
        waypoints.append(waypoint)
    if len(waypoints) < 2:
        raise InputError(f"{path}: a mission needs at least two different waypoints, this file has {len(waypoints)}")
    try:
        return MissionConfig(waypoints=tuple(waypoints), start_time_s=start), tuple(messages)
    except ValidationError as error:
        raise InputError(f"{path}: {error.errors()[0]['msg']}") from error


def _rows(path: Path) -> tuple[list[tuple[int, dict[str, str]]], list[str]]:
    """Return the rows that are not blank, with their line numbers and only the known columns, and messages."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise InputError(f"cannot read the mission {path}: {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path} is not a text file: a mission is a CSV file with {', '.join(COLUMNS)}") from error
    reader = csv.reader(text.splitlines(), skipinitialspace=True)
    rows: list[tuple[int, dict[str, str]]] = []
    messages: list[str] = []
    header: list[str] | None = None
    try:
        for cells in reader:
            cells = [cell.strip() for cell in cells]
            if not any(cells):
                continue
            if header is None:
                header = [cell.lower() for cell in cells]
                messages += _check_header(path, header)
                continue
            if len(cells) > len(header) and any(cells[len(header) :]):
                raise InputError(f"{path}, line {reader.line_num}: {len(cells)} values for {len(header)} columns")
            cells += [""] * (len(header) - len(cells))
            row = dict(zip(header, cells, strict=False))
            rows.append((reader.line_num, {name: row[name] for name in COLUMNS}))
    except csv.Error as error:
        raise InputError(f"{path}, line {reader.line_num}: {error}") from error
    if header is None:
        raise InputError(f"{path} is empty: a mission is a CSV file with the columns {', '.join(COLUMNS)}")
    return rows, messages


def _check_header(path: Path, header: list[str]) -> list[str]:
    missing = [name for name in COLUMNS if name not in header]
    if missing:
        raise InputError(
            f"{path}: missing columns {', '.join(missing)}; the first line must name {', '.join(COLUMNS)},"
            " separated by commas"
        )
    twice = sorted({name for name in COLUMNS if header.count(name) > 1})
    if twice:
        raise InputError(f"{path}: the columns {', '.join(twice)} stand there twice")
    other = [name for name in header if name and name not in COLUMNS]
    return [f"columns ignored: {', '.join(other)}"] if other else []


def _number(path: Path, line: int, name: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        what = f"'{text[:40]}' is not a number" if text else "is empty"
        raise InputError(f"{path}, line {line}: {name} {what}") from None
    low, high = _RANGES.get(name, (-math.inf, math.inf))
    if not math.isfinite(value) or not low <= value <= high:
        limits = f" from {low:g} to {high:g}" if math.isfinite(low) else ""
        raise InputError(f"{path}, line {line}: {name} is {value:g}: give a finite number{limits}")
    return value


def _same_place(a: WaypointConfig, b: WaypointConfig) -> bool:
    return (a.lat_deg, a.lon_deg, a.altitude_m) == (b.lat_deg, b.lon_deg, b.altitude_m)
