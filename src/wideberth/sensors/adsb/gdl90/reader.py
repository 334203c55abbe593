"""Reader of a GDL90 stream: traffic reports become reports, the ownship is kept apart."""

import math
from collections import Counter
from dataclasses import replace

from wideberth.sensors.adsb.gdl90 import messages as m
from wideberth.sensors.adsb.gdl90.framing import Deframer
from wideberth.sensors.adsb.geodetic_reader import GeodeticReader, say
from wideberth.sensors.adsb.message_fields import EMERGENCIES
from wideberth.sensors.adsb.quality import emitter_category_of_number
from wideberth.sensors.adsb.report import AdsbReport
from wideberth.units import DEGREE, FOOT, FOOT_PER_MINUTE, KNOT

_ICAO_TYPES = (0, 2)
_CATEGORIES = 12
_SECONDS_A_DAY = 86400


class Gdl90Reader(GeodeticReader):
    """Reader of GDL90, as it comes over UDP or serial lines, cut anywhere.

    Attributes
    ----------
    ownship : AdsbReport or None
        The latest ownship report, with the geometric altitude that came last.
    heartbeat : Heartbeat or None
        The latest.

    Notes
    -----
    Reports carry no times: without times of receipt they get that of the last heartbeat, in seconds since its midnight,
    days counted. Extrapolated reports are left out (nothing was heard anew), and so are vehicles and obstacles on the
    surface. A velocity is used only with a true track: a heading is where the nose points. What fails its check is no
    message: bytes without sense do not keep the source alive.
    """

    def __init__(self) -> None:
        super().__init__()
        self.ownship: AdsbReport | None = None
        self.heartbeat: m.Heartbeat | None = None
        self._damage: Counter[str] = Counter()
        self._frames = Deframer(self._damage)
        self._geometric_altitude = math.nan
        self._days = 0

    def _left_out(self) -> dict[str, int]:
        return {**self._damage, **super()._left_out()}

    def feed(self, data: bytes, t: float | None = None) -> list[AdsbReport]:
        """Return the traffic that more bytes complete."""
        reports = []
        for message in self._frames.feed(data):
            self.messages += 1
            report = self._take(message, t)
            if report is not None:
                reports.append(report)
        return reports

    def finish(self) -> list[AdsbReport]:
        """Count what is left at the end of the stream."""
        self._frames.restart()
        return []

    def restart(self) -> None:
        """Forget the part of a message that a broken connection left."""
        self._frames.restart()

    def _take(self, message: bytes, t: float | None) -> AdsbReport | None:
        kind = message[0]
        if kind == m.HEARTBEAT:
            heartbeat = m.decode_heartbeat(message)
            if heartbeat is None:
                self._refuse("wrong length")
                return None
            if heartbeat.second_of_day >= _SECONDS_A_DAY:
                self._refuse("time not of a day")
                return None
            if self.heartbeat and heartbeat.second_of_day < self.heartbeat.second_of_day - _SECONDS_A_DAY // 2:
                self._days += 1
            self.heartbeat = heartbeat
            self.kinds["heartbeats"] += 1
        elif kind == m.OWNSHIP_ALTITUDE:
            altitude = m.decode_altitude(message)
            if altitude is None:
                self._refuse("wrong length")
                return None
            self.kinds["ownship altitudes"] += 1
            self._geometric_altitude = altitude.altitude * FOOT
            if self.ownship is not None:
                self.ownship = replace(self.ownship, geometric_altitude=self._geometric_altitude)
        elif kind in (m.OWNSHIP_REPORT, m.TRAFFIC_REPORT):
            target = m.decode_target(message)
            if target is None:
                self._refuse("wrong length")
                return None
            return self._target(kind, target, self._time() if t is None else t)
        else:
            self.kinds["other messages (not used)"] += 1
        return None

    def _time(self) -> float:
        second = self.heartbeat.second_of_day if self.heartbeat else 0
        return float(_SECONDS_A_DAY * self._days + second)

    def _target(self, kind: int, target: m.TargetReport, t: float) -> AdsbReport | None:
        address = ("" if target.address_type in _ICAO_TYPES else "~") + f"{target.address:06x}"
        if kind == m.OWNSHIP_REPORT:
            self.kinds["ownship reports"] += 1
            self.ownship = self._own(address, target, t)
            return None
        if target.address_type > 5:
            self._refuse("address type not known")
            return None
        if target.address_type in (4, 5) or not target.airborne:
            self._refuse("surface")
            return None
        if target.extrapolated:
            self._refuse("extrapolated by the receiver")
            return None
        self.kinds["traffic reports"] += 1
        aircraft = self._of(address)
        say(aircraft, _said(target))
        position = None if math.isnan(target.latitude) else (target.latitude, target.longitude)
        return aircraft.report(t, position, target.pressure_altitude * FOOT, math.nan, _velocity(target))

    def _own(self, address: str, target: m.TargetReport, t: float) -> AdsbReport:
        north, east, up = _velocity(target)
        report = AdsbReport(
            t,
            address,
            math.radians(target.latitude),
            math.radians(target.longitude),
            target.pressure_altitude * FOOT,
            self._geometric_altitude,
            north,
            east,
            up,
            on_ground=not target.airborne,
        )
        return replace(report, info=replace(report.info, **_said(target)))  # type: ignore[arg-type]

    def _refuse(self, cause: str) -> None:
        self._rejects[cause] += 1


def _velocity(target: m.TargetReport) -> tuple[float, float, float]:
    """Return the velocity north, east and up, m/s."""
    track = target.track * DEGREE if target.track_type == m.TRUE_TRACK else math.nan
    speed = target.speed * KNOT
    return speed * math.cos(track), speed * math.sin(track), target.climb_rate * FOOT_PER_MINUTE


def _said(target: m.TargetReport) -> dict[str, object]:
    said: dict[str, object] = {
        "nic": target.nic if target.nic < _CATEGORIES else None,
        "nacp": target.nacp if target.nacp < _CATEGORIES else None,
        "emergency": EMERGENCIES[target.emergency] if target.emergency < len(EMERGENCIES) else None,
        "category": emitter_category_of_number(target.category),
    }
    if target.callsign and target.callsign.isascii() and target.callsign.isprintable():
        said["callsign"] = target.callsign
    return said
