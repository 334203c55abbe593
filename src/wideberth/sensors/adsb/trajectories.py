"""Decoded trajectories: a JSON list of rows with timestamp, icao24, latitude, longitude, altitude, groundspeed, ..."""

import json
import math
from collections import Counter
from typing import Any

from wideberth.sensors.adsb.geodetic_reader import GeodeticReader, say
from wideberth.sensors.adsb.report import AdsbReport
from wideberth.units import DEGREE, FOOT, FOOT_PER_MINUTE, KNOT

_MILLISECONDS_FROM = 1e11  # as milliseconds the year 1973, as seconds the year 5138
_HUGE = 1e15  # more than any number in a row means
_NUMBERS = ("latitude", "longitude", "altitude", "geoaltitude", "groundspeed", "track", "vertical_rate")


class TrajectoryReader(GeodeticReader):
    """Reader of decoded trajectories.

    Keys of a row: `timestamp` (Unix ms), `icao24`, `latitude`, `longitude` (deg), `altitude` (pressure altitude, ft),
    `geoaltitude` (ft), `groundspeed` (kt), `track` (deg), `vertical_rate` (ft/min), `onground`, `callsign`, `squawk`;
    null, NaN or a missing key is "unknown". The rows are sorted by time, as such files list one aircraft after another.
    """

    def __init__(self) -> None:
        super().__init__()
        self._data = bytearray()

    def feed(self, data: bytes, t: float | None = None) -> list[AdsbReport]:
        """Keep more bytes; all reports come at the end of the file."""
        self._data += data
        return []

    def restart(self) -> None:
        """Do nothing: the format is of files only."""

    def finish(self) -> list[AdsbReport]:
        """Return the reports of the whole file in the order of time."""
        text, self._data = self._data.decode("utf-8", "replace"), bytearray()
        rows = self._usable(_rows(text, self._rejects))
        rows.sort(key=lambda row: row[0])
        reports = (self._report(t, address, row) for t, address, row in rows)
        return [report for report in reports if report is not None]

    def _usable(self, rows: list[Any]) -> list[tuple[float, str, dict[str, Any]]]:
        self.messages += len(rows)
        usable = []
        newest: dict[str, float] = {}
        seen: set[tuple[object, ...]] = set()
        for row in rows:
            if not isinstance(row, dict):
                self._rejects["row not understood"] += 1
                continue
            address, stamp = row.get("icao24"), row.get("timestamp")
            if not isinstance(address, str) or not address.strip():
                self._rejects["row without address"] += 1
                continue
            if not isinstance(stamp, (int, float)) or isinstance(stamp, bool) or not abs(stamp) < _HUGE:
                self._rejects["time not a number"] += 1
                continue
            t = stamp / 1000.0 if abs(stamp) >= _MILLISECONDS_FROM else float(stamp)
            address = address.strip().lower()
            # Two aircraft may have one address: only at the same place is a row of the same time the same one.
            key = (address, t, *(v if type(v := row.get(name)) is float else _number(v) for name in _NUMBERS[:2]))
            if key in seen:
                self._rejects["duplicate rows"] += 1
                continue
            seen.add(key)
            if t < newest.get(address, -math.inf):
                self.results["times that jump back (sorted)"] += 1
            newest[address] = t
            usable.append((t, address, row))
        return usable

    def _report(self, t: float, address: str, row: dict[str, Any]) -> AdsbReport | None:
        aircraft = self._of(address)
        callsign, squawk = row.get("callsign"), row.get("squawk")
        if isinstance(callsign, str) and callsign.strip():
            say(aircraft, {"callsign": callsign.strip()})
        if isinstance(squawk, str) and squawk:
            say(aircraft, {"squawk": squawk})
        if row.get("onground") is True:
            self._rejects["surface"] += 1
            return None
        self.kinds["rows in flight"] += 1
        latitude, longitude, altitude, geometric, speed, track, climb = [
            value if type(value := row.get(name)) is float and -_HUGE < value < _HUGE else _number(value)
            for name in _NUMBERS
        ]
        position = None if math.isnan(latitude) or math.isnan(longitude) else (latitude, longitude)
        if position is None:
            self.results["rows without position"] += 1
        velocity = (
            speed * KNOT * math.cos(track * DEGREE),
            speed * KNOT * math.sin(track * DEGREE),
            climb * FOOT_PER_MINUTE,
        )
        return aircraft.report(t, position, altitude * FOOT, geometric * FOOT, velocity)


def _number(value: object) -> float:
    """Return a number, NaN for anything else (null, text, infinity)."""
    if isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) < _HUGE:
        return float(value)
    return math.nan


def _rows(text: str, rejects: Counter[str]) -> list[Any]:
    """Return the rows of a JSON list; of a damaged one all rows up to the damage."""
    try:
        whole = json.loads(text)
        return whole if isinstance(whole, list) else [whole]
    except (ValueError, RecursionError):
        rejects["file cut or damaged"] += 1
    decoder = json.JSONDecoder()
    rows: list[Any] = []
    start = text.find("{")
    while start >= 0:
        try:
            row, end = decoder.raw_decode(text, start)
        except (ValueError, RecursionError):
            break
        rows.append(row)
        start = text.find("{", end)
    return rows
