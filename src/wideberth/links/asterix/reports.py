"""ADS-B reports (category 021) and system tracks (category 062) of ASTERIX as reports of aircraft."""

import math
import re
from typing import Any

from wideberth.links.asterix import blocks as b
from wideberth.links.config import RadarClockConfig
from wideberth.links.message_time import time_of_validity
from wideberth.sensors.adsb.accuracy import nacp_of_sigma, nacv_of_sigma
from wideberth.sensors.adsb.geodetic_reader import GeodeticReader, say
from wideberth.sensors.adsb.message_fields import EMERGENCIES
from wideberth.sensors.adsb.quality import nic_and_nacp_of_nucp
from wideberth.sensors.adsb.report import AdsbReport
from wideberth.units import DEGREE, FOOT, FOOT_PER_MINUTE, NAUTICAL_MILE

_FLIGHT_LEVEL = 100.0 * FOOT
_EARTH_RADIUS = 6371000.0
CATEGORIES = {1: "A1", 2: "A2", 3: "A3", 4: "A4", 5: "A5", 6: "A6", 10: "A7", 11: "B1", 12: "B2", 13: "B6"} | {
    14: "B7",
    15: "B4",
    16: "B3",
    20: "C1",
    21: "C2",
    22: "C3",
    23: "C4",
    24: "C5",
}
"""Emitter categories of I021/020 and I062/380 as ADS-B has them."""

_FAILED_CHECKS = ("RCF", "CPR", "LDPJ", "IPC", "NOGO")


class AsterixReports(GeodeticReader):
    """Reports of aircraft from records.

    Parameters
    ----------
    clock : RadarClockConfig
        What is believed of their times.
    accept_test_targets : bool
        Whether simulated and test targets are used.
    """

    def __init__(self, clock: RadarClockConfig, *, accept_test_targets: bool = False) -> None:
        super().__init__()
        self._clock = clock
        self._accept_test_targets = accept_test_targets

    def read(self, category: int, record: Any, t: float) -> list[AdsbReport]:
        """Return the report of a record of category 021 or 062, or none.

        Parameters
        ----------
        category : {21, 62}
        record : Record
        t : float
            Time of receipt, s.
        """
        self.messages += 1
        report = self._adsb(record, t) if category == 21 else self._track(record, t)
        return [] if report is None else [report]

    def _time(self, second_of_day: float, t: float) -> float | None:
        found = time_of_validity(b.unix_time(second_of_day, t), t, self._clock)
        if isinstance(found, str):
            self._refuse(found)
            return None
        return found

    def _adsb(self, record: Any, t: float) -> AdsbReport | None:
        tests = ("SIM", "RAB", "TST")
        if not self._accept_test_targets and any(b.flag(record, "040", name) for name in tests):
            self._refuse("test target")
            return None
        address = b.code(record, "080")
        if address is None:
            self._refuse("record without address")
            return None
        stamps = (b.number(record, item) for item in ("071", "073", "077"))
        when = self._time(next((stamp for stamp in stamps if not math.isnan(stamp)), math.nan), t)
        if when is None:
            return None
        if b.code(record, "040", "CL") == 1 or any(b.flag(record, "040", name) for name in _FAILED_CHECKS):
            self._refuse("report suspect")
            return None
        kind = b.code(record, "040", "ATP") or 0
        aircraft = self._of(("~" if kind else "") + f"{address:06x}")
        say(aircraft, _said_by_adsb(record))
        if kind == 2 or b.flag(record, "040", "GBS"):
            self._refuse("surface")
            return None
        self.kinds["ADS-B reports"] += 1
        item = "131" if b.find(record, "131") is not None else "130"
        position = (b.number(record, item, "LAT"), b.number(record, item, "LON"))
        speed = b.number(record, "160", "GS") * NAUTICAL_MILE
        if b.flag(record, "160", "RE"):
            speed = math.nan
        track = b.number(record, "160", "TA") * DEGREE
        climb = math.nan
        for rate, name in (("157", "GVR"), ("155", "BVR")):
            if b.find(record, rate) is not None and not b.flag(record, rate, "RE"):
                climb = b.number(record, rate, name) * FOOT_PER_MINUTE
        return aircraft.report(
            when,
            None if math.isnan(position[0]) else position,
            b.number(record, "145") * _FLIGHT_LEVEL,
            b.number(record, "140") * FOOT,
            (speed * math.cos(track), speed * math.sin(track), climb),
        )

    def _track(self, record: Any, t: float) -> AdsbReport | None:
        for cause, name in (("test target", "SIM"), ("tentative track", "CNF"), ("track ended", "TSE")):
            if b.flag(record, "080", name) and not (name == "SIM" and self._accept_test_targets):
                self._refuse(cause)
                return None
        if b.flag(record, "080", "CST"):
            self._refuse("coasted track")
            return None
        number, system = b.code(record, "040"), b.source(record)
        address = b.code(record, "380", "ADR")
        if address is None and (number is None or system < 0):
            self._refuse("record without address")
            return None
        when = self._time(b.number(record, "070"), t)
        if when is None:
            return None
        latitude, longitude = b.number(record, "105", "LAT"), b.number(record, "105", "LON")
        if math.isnan(latitude):
            self._refuse("track without latitude and longitude")
            return None
        # A track's number is of its system alone: the system's goes before it.
        name = f"~{system & 255:02x}{(number or 0) & 0xFFFF:04x}" if address is None else f"{address:06x}"
        aircraft = self._of(name)
        say(aircraft, _said_by_track(record, latitude))
        if b.flag(record, "080", "SFC"):
            self._refuse("surface")
            return None
        self.kinds["system tracks"] += 1
        barometric, geometric = b.number(record, "135", "CTB") * _FLIGHT_LEVEL, b.number(record, "130") * FOOT
        pressure = b.number(record, "136") * _FLIGHT_LEVEL
        if b.flag(record, "135", "QNH"):
            geometric = barometric if math.isnan(geometric) else geometric
        elif math.isnan(pressure):
            pressure = barometric
        east, north = b.number(record, "185", "VX"), b.number(record, "185", "VY")
        climb = b.number(record, "220") * FOOT_PER_MINUTE
        return aircraft.report(when, (latitude, longitude), pressure, geometric, (north, east, climb))

    def _refuse(self, cause: str) -> None:
        self._rejects[cause] += 1


def _said_by_adsb(record: Any) -> dict[str, object]:
    said: dict[str, object] = {}
    nic, nacv = b.code(record, "090", "NUCPNIC"), b.code(record, "090", "NUCRNACV")
    if nic is not None:
        nacp = b.code(record, "090", "NACP")
        # Version 0 has no NACp: its quality is the NUCp.
        said["nic"], said["nacp"] = nic_and_nacp_of_nucp(nic) if nacp is None else (nic, nacp)
        said |= {"nacv": nacv, "sil": b.code(record, "090", "SIL"), "sda": b.code(record, "090", "SDA")}
    callsign = b.text(record, "170")
    if callsign:
        said["callsign"] = callsign
    category = b.code(record, "020")
    if category is not None:
        said["category"] = CATEGORIES.get(category)
    emergency = b.code(record, "200", "PS")
    if emergency is not None:
        said["emergency"] = EMERGENCIES[emergency & 7]
    squawk = b.text(record, "070", "MODE3A")
    if re.fullmatch(r"[0-7]{4}", squawk):
        said["squawk"] = squawk
    if b.find(record, "008") is not None:
        said["tcas_equipped"] = not b.flag(record, "008", "NOTTCAS")
        said["tcas_advisory"] = b.flag(record, "008", "RA")
    return said


def _said_by_track(record: Any, latitude: float) -> dict[str, object]:
    """Return what a track says of its aircraft; its accuracy as the categories that promise no more than it does."""
    said: dict[str, object] = {"nacp": None, "nacv": None}
    degrees = [b.number(record, "500", "APW", axis) for axis in ("LAT", "LON")]
    sigma = [degrees[0] * DEGREE * _EARTH_RADIUS, degrees[1] * DEGREE * _EARTH_RADIUS * math.cos(latitude * DEGREE)]
    if math.isnan(sigma[0]):
        sigma = [b.number(record, "500", "APC", axis) for axis in ("X", "Y")]
    if not math.isnan(sigma[0]):
        said["nacp"] = nacp_of_sigma(max(sigma))
    speed = [b.number(record, "500", "ATV", axis) for axis in ("X", "Y")]
    if not math.isnan(speed[0]):
        said["nacv"] = nacv_of_sigma(max(speed))
    callsign = b.text(record, "380", "ID") or b.text(record, "245", "CHR")
    if callsign:
        said["callsign"] = callsign
    squawk = b.text(record, "060", "MODE3A")
    if re.fullmatch(r"[0-7]{4}", squawk):
        said["squawk"] = squawk
    return said
