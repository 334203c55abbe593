"""A small encoder of Mode S frames, the decoder's opposite: written from the documents, sharing no code with it."""

import math

GENERATOR = 0b1111111111111010000001001
ALPHABET = "#ABCDEFGHIJKLMNOPQRSTUVWXYZ##### ###############0123456789######"


def parity(data: int, bits: int) -> int:
    """Return the 24-bit remainder of `bits` of data, by long division."""
    value = data << 24
    for position in range(bits + 23, 23, -1):
        if value >> position & 1:
            value ^= GENERATOR << (position - 24)
    return value


def field(*parts: tuple[int, int, int]) -> int:
    """Return a 56-bit field from (first bit, count, value), bits numbered from 1."""
    message = 0
    for first, count, value in parts:
        assert 0 <= value < 1 << count, (first, count, value)
        message |= value << (57 - first - count)
    return message


def squitter(address: int, me: int, df: int = 17, control: int = 5) -> bytes:
    """Return an extended squitter (DF17, DF18)."""
    data = (df << 83) | (control << 80) | (address << 56) | me
    return (data << 24 | parity(data, 88)).to_bytes(14, "big")


def all_call(address: int, interrogator: int = 0) -> bytes:
    """Return an all-call reply (DF11)."""
    data = (11 << 27) | (5 << 24) | address
    return (data << 24 | parity(data, 32) ^ interrogator).to_bytes(7, "big")


def reply(address: int, df: int, header: int, message: int = 0) -> bytes:
    """Return a reply with the address on the parity; `header` are the 27 bits after the format."""
    data, bits = (df << 27) | header, 32
    if df >= 16:
        data, bits = data << 56 | message, 88
    return (data << 24 | parity(data, bits) ^ address).to_bytes((bits + 24) // 8, "big")


def zones(latitude: float) -> int:
    """Return the number of longitude zones, straight from its definition."""
    if abs(latitude) >= 87.0:
        return 2 if abs(latitude) == 87.0 else 1
    x = 1 - (1 - math.cos(math.pi / 30)) / math.cos(math.radians(latitude)) ** 2
    return math.floor(2 * math.pi / math.acos(x))


def cpr(latitude: float, longitude: float, odd: int) -> tuple[int, int]:
    """Return the encoded latitude and longitude (degrees) of an airborne position."""
    dlat = 360 / (60 - odd)
    y = math.floor(131072 * (latitude % dlat) / dlat + 0.5)
    rlat = dlat * (y / 131072 + math.floor(latitude / dlat))
    dlon = 360 / max(zones(rlat) - odd, 1)
    x = math.floor(131072 * (longitude % dlon) / dlon + 0.5)
    return y % 131072, x % 131072


def airborne_position(
    latitude: float,
    longitude: float,
    altitude_ft: float,
    odd: int,
    type_code: int = 11,
    status: int = 0,
    supplement_b: int = 0,
) -> int:
    """Return the message of an airborne position; the altitude in steps of 25 ft from -1000 ft."""
    n = round((altitude_ft + 1000) / 25)
    altitude = (n >> 4) << 5 | 1 << 4 | n & 15
    y, x = cpr(latitude, longitude, odd)
    return field(
        (1, 5, type_code),
        (6, 2, status),
        (8, 1, supplement_b),
        (9, 12, altitude),
        (22, 1, odd),
        (23, 17, y),
        (40, 17, x),
    )


def ground_velocity(
    north_kt: int,
    east_kt: int,
    climb_fpm: int | None = 0,
    nacv: int = 2,
    difference_ft: int | None = None,
    step: int = 1,
) -> int:
    """Return an airborne velocity message (subtype 1, or 2 with a step of 4 kt)."""
    climb = (0, 0) if climb_fpm is None else (int(climb_fpm < 0), abs(climb_fpm) // 64 + 1)
    difference = (0, 0) if difference_ft is None else (int(difference_ft < 0), abs(difference_ft) // 25 + 1)
    return field(
        (1, 5, 19),
        (6, 3, 1 if step == 1 else 2),
        (11, 3, nacv),
        (14, 1, int(east_kt < 0)),
        (15, 10, abs(east_kt) // step + 1),
        (25, 1, int(north_kt < 0)),
        (26, 10, abs(north_kt) // step + 1),
        (37, 1, climb[0]),
        (38, 9, climb[1]),
        (49, 1, difference[0]),
        (50, 7, difference[1]),
    )


def identification(callsign: str, type_code: int = 4, category: int = 3) -> int:
    """Return an identification message."""
    letters = [(9 + 6 * k, 6, ALPHABET.index(letter)) for k, letter in enumerate(callsign.ljust(8))]
    return field((1, 5, type_code), (6, 3, category), *letters)


def beast(frame: bytes, ticks: int) -> bytes:
    """Return a Beast message."""
    body = ticks.to_bytes(6, "big") + b"\x80" + frame
    return b"\x1a" + {2: b"1", 7: b"2", 14: b"3"}[len(frame)] + body.replace(b"\x1a", b"\x1a\x1a")


def flight(
    address: int,
    *,
    latitude: float = 48.0,
    longitude: float = 2.0,
    altitude_ft: float = 3000.0,
    north_kt: int = 100,
    east_kt: int = 0,
    t0: float = 1000.0,
    duration: float = 20.0,
) -> list[tuple[float, bytes]]:
    """Return times and frames of a straight level flight: positions each 0.5 s, even and odd in turn, velocities."""
    frames = []
    for k in range(int(duration * 2)):
        t = t0 + 0.5 * k
        lat = latitude + north_kt * (t - t0) / 3600 / 60
        lon = longitude + east_kt * (t - t0) / 3600 / 60 / math.cos(math.radians(latitude))
        frames.append((t, squitter(address, airborne_position(lat, lon, altitude_ft, k % 2))))
        frames.append((t + 0.1, squitter(address, ground_velocity(north_kt, east_kt))))
    return frames
