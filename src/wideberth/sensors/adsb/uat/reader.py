"""Reader of raw UAT as text: ``-`` and a payload in hexadecimal, then fields such as ``;rs=1;t=1441635461.318;``."""

import math
import re

from wideberth.sensors.adsb.geodetic_reader import say
from wideberth.sensors.adsb.line_reader import LineReader
from wideberth.sensors.adsb.message_fields import EMERGENCIES
from wideberth.sensors.adsb.quality import emitter_category_of_number
from wideberth.sensors.adsb.report import AdsbReport
from wideberth.sensors.adsb.uat import messages as m
from wideberth.units import FOOT, FOOT_PER_MINUTE, KNOT

_LINE = re.compile(r"(?:(\d{1,24}),)?([-+])([0-9A-Fa-f]+)(?:;([^\n]*))?")
_TIME = re.compile(r"(?:^|;)t=(\d{1,12}(?:\.\d{1,9})?)(?:;|$)")
_ICAO_QUALIFIERS = (m.ICAO, m.TISB_ICAO)
_CATEGORIES = 12


class UatReader(LineReader[bytes]):
    """Reader of the raw output of dump978 (port 30978), plain or behind the nanosecond counter of a Stratux log.

    The time of a message is its field ``t``, else the counter in front of the line after the time of the last START
    line, else messages are taken to come every `NOMINAL_INTERVAL` s from 0 on. Ground uplinks are counted, not used;
    aircraft and vehicles on the ground are left out. Addresses that are no ICAO ones (also track numbers of TIS-B) are
    marked with "~".
    """

    def _read(self, lines: list[str], t: float | None) -> list[AdsbReport]:
        reports: list[AdsbReport] = []
        for line in lines:
            if line.startswith("START") and self._log.begin(line):
                continue
            if line.startswith("!"):
                continue  # dump978 says which version it is, and the like
            match = _LINE.fullmatch(line)
            if match is None or len(match[3]) % 2:
                self._rejects["line not understood"] += 1
                continue
            self.messages += 1
            if match[2] == "+":
                self.kinds["ground uplinks (not used)"] += 1
            elif t is not None:
                reports += self._reports([(t, bytes.fromhex(match[3]))])
            else:
                when = self._time(match[1], match[4] or "")
                reports += self._reports(self._clock.check(when, bytes.fromhex(match[3])))
        return reports

    def _time(self, counter: str | None, fields: str) -> float:
        stamp = _TIME.search(fields)
        if stamp is not None:
            return float(stamp[1])
        return self._counted(self._log.time(counter) if counter else None)

    def _reports(self, payloads: list[tuple[float, bytes]]) -> list[AdsbReport]:
        reports = []
        for t, payload in payloads:
            message = m.decode(payload)
            if isinstance(message, str):
                self._rejects[message] += 1
                continue
            report = self._report(t, message)
            if report is not None:
                reports.append(report)
        return reports

    def _report(self, t: float, message: m.UatMessage) -> AdsbReport | None:
        if message.qualifier > m.ADSR_OTHER or message.state > m.ON_GROUND:
            self._rejects["field out of range"] += 1
            return None
        aircraft = self._of(("" if message.qualifier in _ICAO_QUALIFIERS else "~") + f"{message.address:06x}")
        say(aircraft, _said(message))
        if message.qualifier in (m.VEHICLE, m.BEACON) or message.state == m.ON_GROUND:
            self._rejects["surface"] += 1
            return None
        tisb = message.qualifier in (m.TISB_ICAO, m.TISB_TRACK)
        self.kinds["TIS-B reports" if tisb else "state vectors"] += 1
        position = None if math.isnan(message.latitude) else (message.latitude, message.longitude)
        north, east = message.velocity_north * KNOT, message.velocity_east * KNOT
        if math.isnan(north) or math.isnan(east):
            north = east = math.nan
        velocity = (north, east, message.climb_rate * FOOT_PER_MINUTE)
        return aircraft.report(
            t, position, message.pressure_altitude * FOOT, message.geometric_altitude * FOOT, velocity
        )


def _said(message: m.UatMessage) -> dict[str, object]:
    said: dict[str, object] = {"nic": message.nic if message.nic < _CATEGORIES else None}
    status = message.status
    if status is None:
        return said
    said |= {
        "category": emitter_category_of_number(status.category),
        "emergency": EMERGENCIES[status.emergency],
        "sil": status.sil,
        "nacp": status.nacp if status.nacp < _CATEGORIES else None,
        "nacv": status.nacv,
        "tcas_equipped": status.acas_operational,
        "tcas_advisory": status.acas_active,
        "ident": status.ident,
        "adsb_in": status.receives,
    }
    if status.version >= 2:
        said["sda"] = status.sda
    if status.callsign and status.is_callsign:
        said["callsign"] = status.callsign
    elif re.fullmatch(r"[0-7]{4}", status.callsign):
        said["squawk"] = status.callsign
    return said
