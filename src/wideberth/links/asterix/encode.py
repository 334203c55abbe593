"""Data blocks of ASTERIX for senders: plots, north marks, ADS-B reports, system tracks."""

import math
import re
from collections.abc import Sequence
from typing import Any

from wideberth.links.asterix import blocks as b
from wideberth.links.asterix.plots import ANGLE_STEP, HEIGHT_STEP, RANGE_STEP, SPEED_STEP
from wideberth.links.asterix.reports import CATEGORIES
from wideberth.sensors.adsb.accuracy import position_sigma, velocity_sigma
from wideberth.sensors.adsb.report import AdsbReport
from wideberth.types import FloatArray
from wideberth.units import FOOT, FOOT_PER_MINUTE, NAUTICAL_MILE

_NUMBERS = {name: number for number, name in CATEGORIES.items()}
_METRES_PER_DEGREE = 111_195.0


class AsterixEncoder:
    """Writes data blocks.

    Parameters
    ----------
    sac, sic : int
        Of the sending system, 0 to 255.

    Raises
    ------
    InputError
        If libasterix is not installed.
    """

    def __init__(self, sac: int = 0, sic: int = 0) -> None:
        self._specifications = b.Specifications()
        self._source = (("SAC", sac), ("SIC", sic))

    def plots(self, t: float, z: FloatArray, boresight_azimuth: float = 0.0, altitude: float = 0.0) -> bytes:
        """Return a block of category 048 (of an empty scan: a north mark of 034).

        Parameters
        ----------
        t : float
            Time of all plots, Unix s.
        z : ndarray, shape (k, 4)
            As in `Scan` of kind ``"radar"``, of a level radar; elevations become heights.
        boresight_azimuth : float
            Of the radar, from north, rad.
        altitude : float
            Of the radar, m.

        Raises
        ------
        ValueError
            If a range is beyond 256 NM, or the plots do not fit into a datagram.
        """
        if not len(z):
            return self.north_mark(t)
        rows = []
        for distance, azimuth, elevation, rate in z:
            steps = round(distance / RANGE_STEP)
            if not 0 < steps < 65536:
                raise ValueError(f"range {distance:g} m does not fit into a plot")
            theta = round((azimuth + boresight_azimuth) / ANGLE_STEP) % 65536
            row: dict[str, Any] = {
                "010": self._source,
                "140": round(b.time_of_day(t) / b.TIME_STEP),
                "020": ((1, 0, 0, 0, 0, None),),
                "040": (("RHO", steps), ("THETA", theta)),
            }
            if not math.isnan(elevation):
                height = round((altitude + distance * math.sin(elevation)) / HEIGHT_STEP)
                row["110"] = (0, _held(height, 14))
            if not math.isnan(rate):
                row["120"] = {"CAL": (0, 0, _held(round(rate / SPEED_STEP), 10))}
            rows.append(row)
        return self._specifications.block(48, rows)

    def north_mark(self, t: float) -> bytes:
        """Return a north mark (category 034)."""
        row = {"010": self._source, "000": 1, "030": round(b.time_of_day(t) / b.TIME_STEP)}
        return self._specifications.block(34, [row])

    def adsb(self, reports: Sequence[AdsbReport]) -> bytes:
        """Return a block of category 021; a report without position or address of six digits is left out."""
        return self._specifications.block(21, [self._adsb(report) for report in reports if _sendable(report)])

    def tracks(self, reports: Sequence[AdsbReport]) -> bytes:
        """Return a block of category 062, with the accuracy that NACp and NACv stand for."""
        return self._specifications.block(62, [self._track(report) for report in reports if _sendable(report)])

    def _adsb(self, report: AdsbReport) -> dict[str, Any]:
        info = report.info
        north, east = report.velocity_north, report.velocity_east
        latitude, longitude = _place(report, 30)
        speed = math.hypot(north, east) / NAUTICAL_MILE * (1 << 14)
        track = math.atan2(east, north) / ANGLE_STEP
        nacv, nic, nacp = (value or 0 for value in (info.nacv, info.nic, info.nacp))
        row: dict[str, Any] = {
            "010": self._source,
            # Address type 3: anonymous.
            "040": ((3 * report.address.startswith("~"), 0, 0, 0, None), (0, int(report.on_ground), 0, 0, 0, 0, None)),
            "073": round(b.time_of_day(report.t) / b.TIME_STEP),
            "131": (latitude, longitude),
            "080": int(report.address.lstrip("~"), 16),
            "090": (
                (nacv & 7, nic & 15, 0, None),
                (0, (info.sil or 0) & 3, nacp & 15, None),
                (0, 0, (info.sda or 0) & 3, 0, None),
            ),
            "210": (0, 0, 2, 2),
        }
        if not math.isnan(report.pressure_altitude):
            row["145"] = _held(round(report.pressure_altitude / FOOT / 25.0), 16)
        if not math.isnan(report.geometric_altitude):
            row["140"] = _held(round(report.geometric_altitude / FOOT / 6.25), 16)
        if not math.isnan(speed):
            row["160"] = (0, min(round(speed), (1 << 15) - 1), round(track) % 65536)
        if not math.isnan(report.climb_rate):
            row["155"] = (0, _held(round(report.climb_rate / FOOT_PER_MINUTE / 6.25), 15))
        if info.callsign:
            row["170"] = _characters(info.callsign)
        if info.category in _NUMBERS:
            row["020"] = _NUMBERS[info.category]
        return row

    def _track(self, report: AdsbReport) -> dict[str, Any]:
        info = report.info
        latitude, longitude = _place(report, 25)
        row: dict[str, Any] = {
            "010": self._source,
            "070": round(b.time_of_day(report.t) / b.TIME_STEP),
            "105": (latitude, longitude),
            "040": int(report.address.lstrip("~"), 16) & 0xFFFF,
            "080": ((0, 0, 0, 0, 0, None),),
        }
        derived: dict[str, Any] = {}
        if not report.address.startswith("~"):
            derived["ADR"] = int(report.address, 16)
        if info.callsign:
            derived["ID"] = _characters(info.callsign)
        if derived:
            row["380"] = derived
        if not math.isnan(report.velocity_north):
            row["185"] = tuple(_held(round(v / 0.25), 16) for v in (report.velocity_east, report.velocity_north))
        if not math.isnan(report.pressure_altitude):
            row["136"] = _held(round(report.pressure_altitude / FOOT / 25.0), 16)
        if not math.isnan(report.geometric_altitude):
            row["130"] = _held(round(report.geometric_altitude / FOOT / 6.25), 16)
        if not math.isnan(report.climb_rate):
            row["220"] = _held(round(report.climb_rate / FOOT_PER_MINUTE / 6.25), 16)
        accuracy: dict[str, Any] = {}
        if info.nacp is not None:
            step = 180.0 / (1 << 25) * _METRES_PER_DEGREE
            sigma = position_sigma(info.nacp) / step
            across = sigma / max(math.cos(report.latitude), 0.01)
            # Downwards, so that what is read back is not one category worse.
            accuracy["APW"] = tuple(min(int(0.998 * s), 65535) for s in (sigma, across))
        if info.nacv is not None:
            accuracy["ATV"] = (min(int(velocity_sigma(info.nacv) / 0.25), 255),) * 2
        if accuracy:
            row["500"] = accuracy
        return row


def _held(value: int, bits: int) -> int:
    """Return a signed value, held within its bits, as the unsigned number that stands for it."""
    most = (1 << (bits - 1)) - 1
    return min(max(value, -most - 1), most) & ((1 << bits) - 1)


def _place(report: AdsbReport, power: int) -> tuple[int, int]:
    """Return latitude and longitude in steps of 180/2**power degrees, 32 bits each."""
    step = math.pi / (1 << power)
    return _held(round(report.latitude / step), 32), _held(round(report.longitude / step), 32)


def _characters(callsign: str) -> str:
    return re.sub(r"[^A-Z0-9 ]", " ", callsign.upper())[:8]


def _sendable(report: AdsbReport) -> bool:
    finite = math.isfinite(report.latitude) and math.isfinite(report.longitude)
    return finite and bool(re.fullmatch(r"~?[0-9a-f]{6}", report.address))
