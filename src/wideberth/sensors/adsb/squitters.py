"""Extended squitters of reports (DF17, DF18): the opposite of `decoder`, for senders (RTCA DO-260B, version 2)."""

import math

from wideberth.sensors.adsb.cpr import encode as encode_cpr
from wideberth.sensors.adsb.message_fields import place_bits
from wideberth.sensors.adsb.parity import syndromes
from wideberth.sensors.adsb.quality import EMITTER_LETTERS, airborne_type
from wideberth.sensors.adsb.report import AdsbReport
from wideberth.types import SourceInfo
from wideberth.units import FOOT, FOOT_PER_MINUTE, KNOT

_ALPHABET = "#ABCDEFGHIJKLMNOPQRSTUVWXYZ##### ###############0123456789######"
_GEOMETRIC_TYPE = 20
_MOST_SPEED = 1021
_HIGHEST = 50175.0
"""ft, the highest altitude in steps of 25 ft."""


def encode(report: AdsbReport) -> list[bytes]:
    """Return the frames of a report: position as an even and an odd one, velocity, identification, status.

    What the report lacks, or no frame can hold (altitudes over 50175 ft, a report on the ground), is left out.
    """
    if report.on_ground:
        return []
    address = report.address.split("#")[0]
    other = address.startswith("~")
    head = ((18 << 3 | 1) if other else (17 << 3 | 5)).to_bytes(1, "big") + bytes.fromhex(address.lstrip("~"))
    messages = [_identification(report.info)] if report.info.callsign else []
    messages += [_operational_status(report.info)]
    messages += [message for odd in (False, True) if (message := _position(report, odd=odd)) is not None]
    messages += [_velocity(report)] if math.isfinite(report.velocity_north + report.velocity_east) else []
    frames = [head + message.to_bytes(7, "big") for message in messages]
    checks = syndromes([frame + bytes(3) for frame in frames])
    return [frame + check.to_bytes(3, "big") for frame, check in zip(frames, checks, strict=True)]


def _position(report: AdsbReport, *, odd: bool) -> int | None:
    if not (math.isfinite(report.latitude) and math.isfinite(report.longitude)):
        return None
    geometric = math.isnan(report.pressure_altitude)
    altitude = (report.geometric_altitude if geometric else report.pressure_altitude) / FOOT
    code = 0
    if math.isfinite(altitude):
        if altitude > _HIGHEST:
            return None
        steps = max(round((altitude + 1000.0) / 25.0), 0)
        code = (steps >> 4) << 5 | 1 << 4 | steps & 15
    y, x = encode_cpr(math.degrees(report.latitude), math.degrees(report.longitude), odd=odd)
    kind = _GEOMETRIC_TYPE if geometric and code else airborne_type(report.info.nic)
    supplement_b = report.info.nic in (9, 3)
    return place_bits((1, 5, kind), (8, 1, supplement_b), (9, 12, code), (22, 1, odd), (23, 17, y), (40, 17, x))


def _velocity(report: AdsbReport) -> int:
    east, north = round(report.velocity_east / KNOT), round(report.velocity_north / KNOT)
    fast = max(abs(east), abs(north)) > _MOST_SPEED
    step = 4 if fast else 1
    climb = report.climb_rate / FOOT_PER_MINUTE / 64.0
    climb_code = 0 if math.isnan(climb) else min(round(abs(climb)), 510) + 1
    difference = (report.geometric_altitude - report.pressure_altitude) / FOOT / 25.0
    difference_code = 0 if math.isnan(difference) else min(round(abs(difference)), 126) + 1
    return place_bits(
        (1, 5, 19),
        (6, 3, 2 if fast else 1),
        (11, 3, (report.info.nacv or 0) & 7),
        (14, 1, east < 0),
        (15, 10, min(round(abs(east) / step), _MOST_SPEED) + 1),
        (25, 1, north < 0),
        (26, 10, min(round(abs(north) / step), _MOST_SPEED) + 1),
        (37, 1, climb < 0.0),
        (38, 9, climb_code),
        (49, 1, difference < 0.0),
        (50, 7, difference_code),
    )


def _identification(info: SourceInfo) -> int:
    category = info.category or "A0"
    letters = (info.callsign or "").upper()[:8].ljust(8)
    codes = [(9 + 6 * k, 6, max(_ALPHABET.find(c), 0) if c != "#" else 0) for k, c in enumerate(letters)]
    letter = category[0] if category[0] in EMITTER_LETTERS else "A"
    number = int(category[1]) & 7 if category[1:2].isdigit() else 0
    return place_bits((1, 5, 4 - EMITTER_LETTERS.index(letter)), (6, 3, number), *codes)


def _operational_status(info: SourceInfo) -> int:
    # NIC supplement A: of the NICs that share a type with another (9 with 8, 3 with 2) the better one.
    return place_bits(
        (1, 5, 31),
        (31, 2, (info.sda or 0) & 3),
        (41, 3, 2),
        (44, 1, info.nic in (9, 3)),
        (45, 4, (info.nacp or 0) & 15),
        (51, 2, (info.sil or 0) & 3),
    )
