"""SBS (BaseStation) lines, plain or behind the nanosecond counter of a Stratux log with its START lines."""

import math
import re
from datetime import UTC, datetime

from wideberth.sensors.adsb.geodetic_reader import say
from wideberth.sensors.adsb.line_reader import LineReader
from wideberth.sensors.adsb.report import AdsbReport
from wideberth.units import DEGREE, FOOT, FOOT_PER_MINUTE, KNOT

_KINDS = {
    1: "identifications",
    2: "surface",
    3: "airborne positions",
    4: "velocities",
    5: "surveillance replies",
    6: "surveillance replies",
    7: "air-air replies",
    8: "all-call replies",
}
_FIELDS = 22
_ADDRESS = re.compile(r"~?[0-9A-Fa-f]{6}")
_TRUE = ("1", "-1")


class SbsReader(LineReader[list[str]]):
    """Reader of SBS lines.

    The time of a message is its date and time generated (taken as UTC), else logged, else the counter in front of the
    line after the time of the last START line, else messages are taken to come every `NOMINAL_INTERVAL` s from 0 on.
    Altitudes of surveillance and air-air replies (types 5 to 7) are not used, like those of raw frames.
    """

    def _read(self, lines: list[str], t: float | None) -> list[AdsbReport]:
        reports: list[AdsbReport] = []
        for line in lines:
            if line.startswith("START"):
                if not self._log.begin(line):
                    self.messages += 1
                    self._rejects["line not understood"] += 1
                continue
            parts = line.split(",")
            counted = self._log.time(parts[0]) if len(parts) > 1 else None
            if counted is not None:
                del parts[0]
            if parts[0] in ("SEL", "ID", "AIR", "STA", "CLK"):
                self.messages += 1
                self.kinds["receiver's own messages"] += 1
                continue
            self.messages += 1
            if parts[0] != "MSG" or not 10 <= len(parts) <= _FIELDS + 2 or not _ADDRESS.fullmatch(parts[4]):
                self._rejects["line not understood"] += 1
                continue
            parts += [""] * (_FIELDS - len(parts))
            if t is not None:
                reports += self._reports([(t, parts)])
            else:
                reports += self._reports(self._clock.check(self._time(parts, counted), parts))
        return reports

    def _time(self, parts: list[str], counted: float | None) -> float:
        for date, clock in ((parts[6], parts[7]), (parts[8], parts[9])):
            if date and clock:
                try:
                    return (
                        datetime.strptime(f"{date} {clock[:15]}", "%Y/%m/%d %H:%M:%S.%f")
                        .replace(tzinfo=UTC)
                        .timestamp()
                    )
                except (ValueError, OverflowError):
                    return math.nan
        return self._counted(counted)

    def _reports(self, messages: list[tuple[float, list[str]]]) -> list[AdsbReport]:
        reports = []
        for t, parts in messages:
            report = self._report(t, parts)
            if report is not None:
                reports.append(report)
        return reports

    def _report(self, t: float, parts: list[str]) -> AdsbReport | None:
        kind = _KINDS.get(int(parts[1]) if parts[1].isdecimal() and len(parts[1]) == 1 else 0)
        try:
            altitude, speed, track, latitude, longitude, climb = (_number(parts[k]) for k in range(11, 17))
        except ValueError:
            kind = None
            altitude = speed = track = latitude = longitude = climb = math.nan
        if kind is None:
            self._rejects["line not understood"] += 1
            return None
        aircraft = self._of(parts[4].lower())
        said: dict[str, object] = {}
        if parts[10].strip():
            said["callsign"] = parts[10].strip()
        if len(parts[17]) == 4 and parts[17].isdecimal():
            said["squawk"] = parts[17]
        if parts[20]:
            said["ident"] = parts[20] in _TRUE
        if parts[19] in _TRUE:
            said["emergency"] = "general emergency"
        say(aircraft, said)
        if kind == "surface" or parts[21] in _TRUE:
            self._rejects["surface"] += 1
            return None
        self.kinds[kind] += 1
        if kind not in ("airborne positions", "velocities"):
            return None
        velocity = (
            speed * KNOT * math.cos(track * DEGREE),
            speed * KNOT * math.sin(track * DEGREE),
            climb * FOOT_PER_MINUTE,
        )
        located = kind == "airborne positions" and not (math.isnan(latitude) or math.isnan(longitude))
        # A zero position is how some programs write "unknown".
        position = (latitude, longitude) if located and (latitude, longitude) != (0.0, 0.0) else None
        return aircraft.report(t, position, altitude * FOOT, math.nan, velocity)


def _number(text: str) -> float:
    value = float(text) if text.strip() else math.nan
    if math.isinf(value):
        raise ValueError("not finite")
    return value
