"""Fields of Mode S messages that the decoding library does not give (or not for all encodings), from the frame's bits.

Messages are the 56-bit field of a long frame (ME, MV, MB) as an integer, its bits numbered 1 to 56 as in RTCA DO-260B
and ICAO Annex 10.
"""

import math
from dataclasses import dataclass

from wideberth.units import FOOT, FOOT_PER_MINUTE, KNOT

EMERGENCIES = (
    "none",
    "general emergency",
    "medical",
    "minimum fuel",
    "no communication",
    "unlawful interference",
    "downed aircraft",
    "reserved",
)
"""What the emergency codes 0 to 7 mean; UAT and GDL90 have the same."""


def bits(message: int, first: int, count: int) -> int:
    """Return `count` bits of a 56-bit message field from bit `first` (1 = the first sent)."""
    return (message >> (57 - first - count)) & ((1 << count) - 1)


def place_bits(*parts: tuple[int, int, int]) -> int:
    """Return a 56-bit message field of (first bit, count, value): the opposite of `bits`."""
    message = 0
    for first, count, value in parts:
        message |= (int(value) & ((1 << count) - 1)) << (57 - first - count)
    return message


def squawk(code: int) -> str:
    """Return the four octal digits of a 13-bit identity code C1 A1 C2 A2 C4 A4 X B1 D1 B2 D2 B4 D4."""
    c1, a1, c2, a2, c4, a4, _, b1, d1, b2, d2, b4, d4 = ((code >> k) & 1 for k in range(12, -1, -1))
    return f"{a4 * 4 + a2 * 2 + a1}{b4 * 4 + b2 * 2 + b1}{c4 * 4 + c2 * 2 + c1}{d4 * 4 + d2 * 2 + d1}"


def emergency_state(message: int) -> str:
    """Return the emergency state of an aircraft status message (type 28, subtype 1); "none" where there is none."""
    return EMERGENCIES[bits(message, 9, 3)]


def advisory_active(message: int, first: int) -> bool:
    """Return whether a resolution advisory is on whose 14 bits start at bit `first`.

    ICAO Annex 10 Volume IV, 4.3.8.4.2.2: ARA (14 bits), RAC (4), RA terminated (1), multiple threats (1).
    """
    advisory, terminated, multiple = (
        bits(message, first, 14),
        bits(message, first + 18, 1),
        bits(message, first + 19, 1),
    )
    return bool((advisory or multiple) and not terminated)


@dataclass(frozen=True, slots=True)
class Velocity:
    """An airborne velocity message (type 19); NaN where it says "no information".

    Attributes
    ----------
    north, east : float
        Ground velocity, m/s; NaN for the airspeed subtypes.
    climb_rate : float
        m/s, positive up.
    difference : float
        Geometric minus barometric altitude, m.
    nacv : int
    ground : bool
        Whether the message is of a ground velocity subtype (1, 2).
    """

    north: float
    east: float
    climb_rate: float
    difference: float
    nacv: int
    ground: bool


def velocity(message: int) -> Velocity:
    """Decode an airborne velocity message (DO-260B, 2.2.3.2.6); subtypes 2 and 4 count in steps of 4 kt."""
    subtype = bits(message, 6, 3)
    north = east = climb = difference = math.nan
    if subtype in (1, 2):
        step = KNOT * (4 if subtype == 2 else 1)
        east_code, north_code = bits(message, 15, 10), bits(message, 26, 10)
        if east_code and north_code:
            east = (east_code - 1) * step * (-1 if bits(message, 14, 1) else 1)
            north = (north_code - 1) * step * (-1 if bits(message, 25, 1) else 1)
    rate = bits(message, 38, 9)
    if rate:
        climb = (rate - 1) * 64 * FOOT_PER_MINUTE * (-1 if bits(message, 37, 1) else 1)
    offset = bits(message, 50, 7)
    if offset:
        difference = (offset - 1) * 25 * FOOT * (-1 if bits(message, 49, 1) else 1)
    return Velocity(north, east, climb, difference, bits(message, 11, 3), subtype in (1, 2))


@dataclass(frozen=True, slots=True)
class OperationalStatus:
    """An operational status message (type 31); None where its version has no such field.

    `size_code` is the length/width code of the surface subtype.
    """

    version: int
    nic_supplement_a: int = 0
    nacp: int | None = None
    sil: int | None = None
    sda: int | None = None
    nacv: int | None = None
    tcas_equipped: bool | None = None
    tcas_advisory: bool | None = None
    ident: bool | None = None
    adsb_in: bool | None = None
    size_code: int | None = None


def operational_status(message: int) -> OperationalStatus:
    """Decode an operational status message (DO-260B, 2.2.3.2.7.2; version 1: DO-260A)."""
    version, surface = bits(message, 41, 3), bits(message, 6, 3) == 1
    if version not in (1, 2):
        return OperationalStatus(version)
    tcas = adsb_in = nacv = sda = None
    if version == 2:
        sda = bits(message, 31, 2)
        receives_uat = bits(message, 16, 1) if surface else bits(message, 19, 1)
        adsb_in = bool(bits(message, 12, 1) or receives_uat)
        if surface:
            nacv = bits(message, 17, 3)
        else:
            tcas = bool(bits(message, 11, 1))
    elif not surface:
        tcas = not bits(message, 11, 1)
    return OperationalStatus(
        version,
        nic_supplement_a=bits(message, 44, 1),
        nacp=bits(message, 45, 4),
        sil=bits(message, 51, 2),
        sda=sda,
        nacv=nacv,
        tcas_equipped=tcas,
        tcas_advisory=bool(bits(message, 27, 1)),
        ident=bool(bits(message, 28, 1)),
        adsb_in=adsb_in,
        size_code=bits(message, 21, 4) if surface else None,
    )
