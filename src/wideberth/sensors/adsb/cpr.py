"""Compact position reporting of airborne positions: global decoding from a pair, local decoding about a reference.

RTCA DO-260B, appendix A, A.1.7 (17-bit encoding, 15 latitude zones per quadrant). Latitudes and longitudes are in
degrees, as the algorithm is defined in them.
"""

import math

_SCALE = 131072.0  # 2^17 steps per zone
_ZONES = 15
_DLAT = (360.0 / (4 * _ZONES), 360.0 / (4 * _ZONES - 1))  # even, odd


def _transitions() -> tuple[float, ...]:
    a = 1 - math.cos(math.pi / (2 * _ZONES))
    return tuple(
        math.degrees(math.acos(math.sqrt(a / (1 - math.cos(2 * math.pi / zones))))) for zones in range(59, 1, -1)
    )


_TRANSITIONS = _transitions()  # latitudes, ascending, at which the number of longitude zones drops from 59 to 58, ...


def longitude_zones(latitude: float) -> int:
    """Return NL, the number of longitude zones at a latitude in degrees (DO-260B, A.1.7.2.d)."""
    latitude = abs(latitude)
    low, high = 0, len(_TRANSITIONS)
    while low < high:
        middle = (low + high) // 2
        if latitude < _TRANSITIONS[middle]:
            high = middle
        else:
            low = middle + 1
    return 59 - low


def encode(latitude: float, longitude: float, *, odd: bool) -> tuple[int, int]:
    """Return the encoded latitude and longitude, 0 to 131071, of a position in degrees (DO-260B, A.1.7.3)."""
    dlat = _DLAT[odd]
    y = math.floor(_SCALE * latitude / dlat + 0.5)
    dlon = 360.0 / max(longitude_zones(dlat * y / _SCALE) - odd, 1)
    x = math.floor(_SCALE * longitude / dlon + 0.5)
    return y % int(_SCALE), x % int(_SCALE)


def decode_global(
    lat_even: int, lon_even: int, lat_odd: int, lon_odd: int, *, latest_is_odd: bool
) -> tuple[float, float] | None:
    """Return the position of the later of an even and an odd message (DO-260B, A.1.7.7).

    Parameters
    ----------
    lat_even, lon_even, lat_odd, lon_odd : int
        The encoded values, 0 to 131071. The two messages must lie within 10 s of each other (the caller's to see to).
    latest_is_odd : bool
        Which of the two is the later.

    Returns
    -------
    tuple of float or None
        Latitude and longitude, degrees, longitude in [-180, 180); None where the pair straddles a change of the number
        of longitude zones or gives a latitude off the Earth.
    """
    ye, xe, yo, xo = lat_even / _SCALE, lon_even / _SCALE, lat_odd / _SCALE, lon_odd / _SCALE
    j = math.floor(59 * ye - 60 * yo + 0.5)
    even = _DLAT[0] * (j % 60 + ye)
    odd = _DLAT[1] * (j % 59 + yo)
    even -= 360.0 if even >= 270.0 else 0.0
    odd -= 360.0 if odd >= 270.0 else 0.0
    if not (-90.0 <= even <= 90.0 and -90.0 <= odd <= 90.0):
        return None
    zones = longitude_zones(even)
    if zones != longitude_zones(odd):
        return None
    latitude, count, x = (odd, max(zones - 1, 1), xo) if latest_is_odd else (even, zones, xe)
    m = math.floor(xe * (zones - 1) - xo * zones + 0.5)
    longitude = 360.0 / count * (m % count + x)
    return latitude, longitude - 360.0 if longitude >= 180.0 else longitude


def decode_local(lat: int, lon: int, *, odd: bool, latitude: float, longitude: float) -> tuple[float, float] | None:
    """Return the position nearest to a reference that a single message can mean (DO-260B, A.1.7.5).

    Parameters
    ----------
    lat, lon : int
        The encoded values.
    odd : bool
    latitude, longitude : float
        Reference, degrees; the true position must lie within half a zone of it (about 180 nmi).

    Returns
    -------
    tuple of float or None
        Latitude and longitude, degrees, longitude in [-180, 180); None where the latitude falls off the Earth.
    """
    y, x = lat / _SCALE, lon / _SCALE
    dlat = _DLAT[odd]
    # One quotient, not a floor and a remainder: at the edge of a zone rounding may set those apart by a whole zone.
    result = dlat * (math.floor(0.5 + latitude / dlat - y) + y)
    if not -90.0 <= result <= 90.0:
        return None
    dlon = 360.0 / max(longitude_zones(result) - odd, 1)
    found = dlon * (math.floor(0.5 + longitude / dlon - x) + x)
    return result, (found + 180.0) % 360.0 - 180.0
