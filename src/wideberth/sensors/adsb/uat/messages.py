"""ADS-B messages of UAT as values, from payloads and to payloads.

Source: RTCA DO-282B, 2.2.4.5: header (2.2.4.5.1), state vector (2.2.4.5.2), mode status (2.2.4.5.4), auxiliary state
vector (2.2.4.5.5); table 2-10 says which payload types hold which. Bytes are numbered from 1, bits from 1 (first sent).
"""

import math
from dataclasses import dataclass

SHORT_BYTES, LONG_BYTES = 18, 34
ICAO, OTHER, TISB_ICAO, TISB_TRACK, VEHICLE, BEACON, ADSR_OTHER = range(7)
AIRBORNE, SUPERSONIC, ON_GROUND = range(3)
_WITH_STATUS = (1, 3)
_WITH_AUXILIARY = (1, 2, 5, 6)
_LAST_TYPE = 10
_STEP = 360.0 / (1 << 24)
_ALPHABET = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZ    "
_FIELD = 10
"""Bits of a velocity; its sign is another one."""


@dataclass(frozen=True, slots=True)
class ModeStatus:
    """What the aircraft says of itself.

    Attributes
    ----------
    category : int
        Number of the emitter category.
    callsign : str
        Callsign, or the flight plan's code (`is_callsign` False).
    is_callsign : bool
    emergency, version, sil, sda, nacp, nacv : int
        `sda` only of version 2 on.
    acas_operational, acas_active, ident, receives : bool
        Whether it has a working TCAS or ACAS, whether that gives an advisory, whether ident is pressed, and whether
        it receives ADS-B (version 2) or shows traffic (before).
    """

    category: int = 0
    callsign: str = ""
    is_callsign: bool = True
    emergency: int = 0
    version: int = 2
    sil: int = 0
    sda: int = 0
    nacp: int = 0
    nacv: int = 0
    acas_operational: bool = False
    acas_active: bool = False
    ident: bool = False
    receives: bool = False


@dataclass(frozen=True, slots=True)
class UatMessage:
    """An ADS-B message; NaN where it says "no data".

    Attributes
    ----------
    qualifier : int
        `ICAO`, `OTHER`, `TISB_ICAO`, `TISB_TRACK`, `VEHICLE`, `BEACON`, `ADSR_OTHER` or 7.
    address : int
    latitude, longitude : float
        Degrees.
    nic : int
    pressure_altitude, geometric_altitude : float
        ft; one of them in the state vector, the other in the auxiliary one.
    state : int
        `AIRBORNE`, `SUPERSONIC`, `ON_GROUND` or 3.
    velocity_north, velocity_east, climb_rate : float
        kt, kt, ft/min; NaN on the ground.
    geometric_climb : bool
        Whether the climb rate is geometric, not barometric.
    ground_speed, ground_track : float
        kt, degrees, on the ground; the track NaN where a heading is given in its place.
    status : ModeStatus or None
    """

    qualifier: int
    address: int
    latitude: float = math.nan
    longitude: float = math.nan
    nic: int = 0
    pressure_altitude: float = math.nan
    geometric_altitude: float = math.nan
    state: int = AIRBORNE
    velocity_north: float = math.nan
    velocity_east: float = math.nan
    climb_rate: float = math.nan
    geometric_climb: bool = False
    ground_speed: float = math.nan
    ground_track: float = math.nan
    status: ModeStatus | None = None


class _Bits:
    """Bits of a payload by byte and bit, both from 1."""

    def __init__(self, payload: bytes) -> None:
        self._number, self._bits = int.from_bytes(payload, "big"), 8 * len(payload)

    def __call__(self, byte: int, bit: int, count: int) -> int:
        return self._number >> (self._bits - 8 * (byte - 1) - (bit - 1) - count) & ((1 << count) - 1)


def decode(payload: bytes) -> UatMessage | str:
    """Return an ADS-B message; or why it is none, in words.

    Parameters
    ----------
    payload : bytes
        18 bytes (basic) or 34 (long).
    """
    if len(payload) not in (SHORT_BYTES, LONG_BYTES):
        return "wrong length"
    bits = _Bits(payload)
    kind = bits(1, 1, 5)
    if kind > _LAST_TYPE:
        return "payload type not known"
    if (kind == 0) != (len(payload) == SHORT_BYTES):
        return "payload type and length do not agree"
    latitude, longitude, nic = bits(5, 1, 23), bits(7, 8, 24), bits(12, 5, 4)
    degrees = latitude * _STEP, longitude * _STEP
    known = bool(latitude or longitude or nic)
    altitudes = [_altitude(bits(11, 1, 12)), math.nan]
    if kind in _WITH_AUXILIARY:
        altitudes[1] = _altitude(bits(30, 1, 12))
    geometric_first = bits(10, 8, 1)
    pressure, geometric = reversed(altitudes) if geometric_first else altitudes
    state = bits(13, 1, 2)
    north = east = climb = speed = track = math.nan
    if state in (AIRBORNE, SUPERSONIC):
        step = 4.0 if state == SUPERSONIC else 1.0
        north, east = step * _velocity(bits(13, 4, 11)), step * _velocity(bits(14, 7, 11))
        climb = 64.0 * _velocity(bits(16, 3, 10), 9)
    elif state == ON_GROUND:
        speed = _velocity(bits(13, 5, 10))
        track = bits(15, 1, 9) * 360.0 / 512.0 if bits(14, 7, 2) == 1 else math.nan
    return UatMessage(
        qualifier=bits(1, 6, 3),
        address=bits(2, 1, 24),
        latitude=degrees[0] - 180.0 * (degrees[0] > 90.0) if known else math.nan,
        longitude=degrees[1] - 360.0 * (degrees[1] > 180.0) if known else math.nan,
        nic=nic,
        pressure_altitude=pressure,
        geometric_altitude=geometric,
        state=state,
        velocity_north=north,
        velocity_east=east,
        climb_rate=climb,
        geometric_climb=not bits(16, 2, 1),
        ground_speed=speed,
        ground_track=track,
        status=_status(bits) if kind in _WITH_STATUS else None,
    )


def encode(message: UatMessage) -> bytes:
    """Return the payload of a message: type 0 (basic), or with its status or both altitudes type 1 (long).

    Values are rounded to what a payload can hold, and held within it.

    Raises
    ------
    ValueError
        If address, qualifier, latitude or longitude are none, or an infinite value is given.
    """
    known = not (math.isnan(message.latitude) or math.isnan(message.longitude))
    if not (0 <= message.address < 1 << 24 and 0 <= message.qualifier < 8 and 0 <= message.state < 4):
        raise ValueError(f"address {message.address:x} of qualifier {message.qualifier} does not fit into a message")
    if known and not (abs(message.latitude) <= 90.0 and abs(message.longitude) <= 180.0):
        raise ValueError(f"latitude {message.latitude}, longitude {message.longitude} are not on the Earth")
    pressure_first = not math.isnan(message.pressure_altitude)
    first, second = message.pressure_altitude, message.geometric_altitude
    if not pressure_first:
        first, second = second, math.nan
    long = message.status is not None or not math.isnan(second)
    out = _Writer()
    out.put(int(long), 5)
    out.put(message.qualifier, 3)
    out.put(message.address, 24)
    out.put(round(message.latitude / _STEP) % (1 << 23) if known else 0, 23)
    out.put(round(message.longitude / _STEP) % (1 << 24) if known else 0, 24)
    out.put(not pressure_first and not math.isnan(first), 1)
    out.put(_altitude_code(first), 12)
    out.put(min(max(message.nic, 0), 15) if known else 0, 4)
    out.put(message.state, 2)
    if message.state == ON_GROUND:
        track = message.ground_track
        out.put(0, 2)
        out.put(_velocity_code(message.ground_speed), _FIELD)
        out.put(not math.isnan(track), 2)
        out.put(0 if math.isnan(track) else round(track * 512.0 / 360.0) % 512, 9)
        out.put(0, 11)
    else:
        step = 4.0 if message.state == SUPERSONIC else 1.0
        out.put(0, 1)
        for speed in (message.velocity_north, message.velocity_east):
            out.put_signed(speed / step, _FIELD)
        out.put(not message.geometric_climb, 1)
        out.put_signed(message.climb_rate / 64.0, 9)
    out.put(0, 4)
    if not long:
        out.put(0, 8)
        return out.bytes()
    _put_status(out, message.status or ModeStatus())
    out.put(0, 16)
    out.put(_altitude_code(second), 12)
    out.put(0, 28)
    return out.bytes()


def _status(bits: _Bits) -> ModeStatus:
    words = [bits(byte, 1, 16) for byte in (18, 20, 22)]
    characters = [words[0] // 40, words[0], *(w // d for w in words[1:] for d in (1600, 40, 1))]
    version = bits(24, 4, 3)
    # DO-282A has one bit of capability less in front of the modes.
    later = version >= 2
    first = 3 if later else 2
    return ModeStatus(
        category=words[0] // 1600 % 40,
        callsign="".join(_ALPHABET[c % 40] for c in characters).strip(),
        is_callsign=bool(bits(27, 7, 1)),
        emergency=bits(24, 1, 3),
        version=version,
        sil=bits(24, 7, 2),
        sda=bits(25, 7, 2) if later else 0,
        nacp=bits(26, 1, 4),
        nacv=bits(26, 5, 3),
        acas_operational=bool(bits(27, first, 1)),
        acas_active=bool(bits(27, first + 1, 1)),
        ident=bool(bits(27, first + 2, 1)),
        receives=bool(bits(27, 1, first - 1)),
    )


def _put_status(out: "_Writer", status: ModeStatus) -> None:
    text = status.callsign.upper()[:8].ljust(8)
    codes = [min(max(status.category, 0), 39), *(max(_ALPHABET.find(c), 0) if c != " " else 36 for c in text)]
    for k in (0, 3, 6):
        out.put(codes[k] * 1600 + codes[k + 1] * 40 + codes[k + 2], 16)
    out.put(status.emergency & 7, 3)
    out.put(status.version & 7, 3)
    out.put(status.sil & 3, 2)
    out.put(0, 6)
    out.put(status.sda & 3 if status.version >= 2 else 0, 2)
    out.put(status.nacp & 15, 4)
    out.put(status.nacv & 7, 3)
    out.put(0, 1)
    out.put(status.receives, 1)
    if status.version >= 2:
        out.put(0, 1)
    for flag in (status.acas_operational, status.acas_active, status.ident):
        out.put(flag, 1)
    out.put(0, 1 if status.version >= 2 else 2)
    out.put(status.is_callsign, 1)
    out.put(0, 1)


class _Writer:
    """Bits put one after another."""

    def __init__(self) -> None:
        self._number = self._count = 0

    def put(self, value: int, count: int) -> None:
        self._number = self._number << count | int(value)
        self._count += count

    def put_signed(self, value: float, count: int) -> None:
        self.put(value < 0.0, 1)
        self.put(_velocity_code(abs(value), count), count)

    def bytes(self) -> bytes:
        return self._number.to_bytes(self._count // 8, "big")


def _altitude(code: int) -> float:
    return 25.0 * (code - 41) if code else math.nan


def _altitude_code(altitude: float) -> int:
    return 0 if math.isnan(altitude) else min(max(_whole(altitude / 25.0) + 41, 1), 4095)


def _velocity(code: int, bits: int = _FIELD) -> float:
    """Return a signed magnitude, in steps; zero is "no data"."""
    magnitude = code & ((1 << bits) - 1)
    return math.nan if magnitude == 0 else (1.0 - magnitude if code >> bits & 1 else magnitude - 1.0)


def _velocity_code(value: float, bits: int = _FIELD) -> int:
    return 0 if math.isnan(value) else min(_whole(value) + 1, (1 << bits) - 1)


def _whole(value: float) -> int:
    if math.isinf(value):
        raise ValueError("a message has no infinite values")
    return round(value)
