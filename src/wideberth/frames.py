"""WGS84, ECEF and the local frame.

The local frame is north, east, down about an origin. Horizontally it is the tangent plane at the origin; *down* is
minus the altitude itself (not the distance below the tangent plane), so that altitude differences are exact at any
distance: the tangent plane alone is 25 m too high at 18 km. ``altitude = -down`` is written here and nowhere else.
"""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]

SEMI_MAJOR_AXIS = 6378137.0
FLATTENING = 1 / 298.257223563
ECCENTRICITY_SQUARED = FLATTENING * (2 - FLATTENING)


def ecef(latitude: ArrayLike, longitude: ArrayLike, altitude: ArrayLike) -> FloatArray:
    """Return Earth-centred, Earth-fixed coordinates (..., 3), m, of WGS84 latitude, longitude (rad) and height (m)."""
    lat, lon, alt = (np.asarray(x, float) for x in (latitude, longitude, altitude))
    n = SEMI_MAJOR_AXIS / np.sqrt(1 - ECCENTRICITY_SQUARED * np.sin(lat) ** 2)
    return np.stack(
        [
            (n + alt) * np.cos(lat) * np.cos(lon),
            (n + alt) * np.cos(lat) * np.sin(lon),
            (n * (1 - ECCENTRICITY_SQUARED) + alt) * np.sin(lat),
        ],
        axis=-1,
    )


def rotation_ned_ecef(latitude: float, longitude: float) -> FloatArray:
    """Return C_ned_ecef (3, 3) at a latitude and longitude in radians."""
    sl, cl, so, co = math.sin(latitude), math.cos(latitude), math.sin(longitude), math.cos(longitude)
    return np.array([[-sl * co, -sl * so, cl], [-so, co, 0.0], [-cl * co, -cl * so, -sl]])


def rotation_ned_body(roll: float, pitch: float, yaw: float) -> FloatArray:
    """Return C_ned_body (3, 3) from the Euler angles roll, pitch, yaw in radians (order 3-2-1)."""
    cr, sr, cp, sp, cy, sy = (
        math.cos(roll),
        math.sin(roll),
        math.cos(pitch),
        math.sin(pitch),
        math.cos(yaw),
        math.sin(yaw),
    )
    return np.array(
        [
            [cp * cy, sr * sp * cy - cr * sy, cr * sp * cy + sr * sy],
            [cp * sy, sr * sp * sy + cr * cy, cr * sp * sy - sr * cy],
            [-sp, sr * cp, cr * cp],
        ]
    )


def euler_angles(rotation: FloatArray) -> tuple[float, float, float]:
    """Return roll, pitch and yaw, rad, of a rotation C_ned_body (3, 3); roll is 0 where it looks straight up or down.

    The inverse of `rotation_ned_body`.
    """
    level = math.hypot(rotation[0, 0], rotation[1, 0])
    pitch = math.atan2(-rotation[2, 0], level)
    if level < 1e-9:
        return 0.0, pitch, math.atan2(-rotation[0, 1], rotation[1, 1])
    return math.atan2(rotation[2, 1], rotation[2, 2]), pitch, math.atan2(rotation[1, 0], rotation[0, 0])


@dataclass(frozen=True, slots=True)
class LocalFrame:
    """Local north-east-down frame about an origin; see the module's text for what *down* means.

    Parameters
    ----------
    latitude, longitude : float
        WGS84 origin in radians.
    """

    latitude: float
    longitude: float
    _origin: FloatArray = field(init=False, repr=False, compare=False)
    _rotation: FloatArray = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if not (abs(self.latitude) <= math.pi / 2 and abs(self.longitude) <= 2 * math.pi):
            raise ValueError(
                f"origin latitude {math.degrees(self.latitude):.6g} deg,"
                f" longitude {math.degrees(self.longitude):.6g} deg is not on the Earth"
            )
        object.__setattr__(self, "_origin", ecef(self.latitude, self.longitude, 0.0))
        object.__setattr__(self, "_rotation", rotation_ned_ecef(self.latitude, self.longitude))

    def to_ned(self, latitude: ArrayLike, longitude: ArrayLike, altitude: ArrayLike) -> FloatArray:
        """Return local positions (..., 3), m, of latitudes, longitudes (rad) and altitudes (m; NaN stays in *down*)."""
        lat, lon, alt = np.broadcast_arrays(*(np.asarray(x, float) for x in (latitude, longitude, altitude)))
        ned = (ecef(lat, lon, np.zeros_like(lat)) - self._origin) @ self._rotation.T
        ned[..., 2] = -alt
        return ned

    def to_geodetic(self, ned: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return latitude, longitude (rad) and altitude (m) of local positions (..., 3)."""
        p = np.asarray(ned, float)
        plane = p.copy()
        # The point of the ellipsoid above (n, e): two fixed-point steps on the plane's drop reach micrometres.
        plane[..., 2] = 0.0
        radius = SEMI_MAJOR_AXIS
        plane[..., 2] = (p[..., 0] ** 2 + p[..., 1] ** 2) / (2 * radius)
        lat = lon = np.zeros(p.shape[:-1])
        for _ in range(6):
            lat, lon, height = geodetic(plane @ self._rotation + self._origin)
            plane[..., 2] += height
        return lat, lon, -p[..., 2]

    def velocity_to_ned(self, latitude: ArrayLike, longitude: ArrayLike, velocity: ArrayLike) -> FloatArray:
        """Rotate velocities (..., 3) given in the north-east-down frame at their own position into this frame.

        The vertical component is kept as it is, as *down* is minus the altitude.
        """
        return self._rotate(latitude, longitude, velocity, inverse=False)

    def velocity_from_ned(self, latitude: ArrayLike, longitude: ArrayLike, velocity: ArrayLike) -> FloatArray:
        """Rotate local velocities (..., 3) into the north-east-down frame at the given positions."""
        return self._rotate(latitude, longitude, velocity, inverse=True)

    def _rotate(self, latitude: ArrayLike, longitude: ArrayLike, velocity: ArrayLike, *, inverse: bool) -> FloatArray:
        # Only the convergence of the meridians matters: north there, seen from the origin, is turned by this angle.
        lat, lon = np.asarray(latitude, float), np.asarray(longitude, float)
        north = np.stack([-np.sin(lat) * np.cos(lon), -np.sin(lat) * np.sin(lon), np.cos(lat)], axis=-1)
        local = north @ self._rotation.T
        angle = np.arctan2(local[..., 1], local[..., 0]) * (-1.0 if inverse else 1.0)
        v = np.asarray(velocity, float)
        c, s = np.cos(angle), np.sin(angle)
        return np.stack([c * v[..., 0] - s * v[..., 1], s * v[..., 0] + c * v[..., 1], v[..., 2]], axis=-1)


def geodetic(position: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return WGS84 latitude, longitude (rad) and height (m) of ECEF positions (..., 3), m (Bowring's iteration)."""
    p = np.asarray(position, float)
    x, y, z = p[..., 0], p[..., 1], p[..., 2]
    rho = np.hypot(x, y)
    b = SEMI_MAJOR_AXIS * (1 - FLATTENING)
    beta = np.arctan2(z * SEMI_MAJOR_AXIS, rho * b)
    lat = beta
    for _ in range(3):
        lat = np.arctan2(
            z + ECCENTRICITY_SQUARED * SEMI_MAJOR_AXIS**2 / b * np.sin(beta) ** 3,
            rho - ECCENTRICITY_SQUARED * SEMI_MAJOR_AXIS * np.cos(beta) ** 3,
        )
        beta = np.arctan2((1 - FLATTENING) * np.sin(lat), np.cos(lat))
    n = SEMI_MAJOR_AXIS / np.sqrt(1 - ECCENTRICITY_SQUARED * np.sin(lat) ** 2)
    height = rho * np.cos(lat) + z * np.sin(lat) - n * (1 - ECCENTRICITY_SQUARED * np.sin(lat) ** 2)
    return lat, np.arctan2(y, x), height
