"""The ways that a wave takes from the transmitter to a target and back to the receiver, straight or by the ground."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wideberth.argument_checks import FINITE, POSITIVE, Domain, FloatArray, checked, choice
from wideberth.sensors.radar.detection import SWERLING

_SLOW = Domain(-1e5, 1e5, "between -100 and 100 km/s, far below the speed of light")


@dataclass(frozen=True)
class RadarTarget:
    """A target as the radar sees it in the middle of a frame.

    Attributes
    ----------
    range, azimuth, elevation : float
        m, rad, in the sensor's axes (see `array`).
    range_rate : float
        m/s, positive if it goes away; constant through the frame.
    rcs : float
        Mean radar cross-section, m2.
    swerling : {0, 1, 3}
        Fluctuation of the cross-section from frame to frame.
    azimuth_rate, elevation_rate : float
        rad/s.

    Raises
    ------
    ValueError
        If a number is not finite, range or cross-section not positive, or the range rate beyond 100 km/s.
    """

    range: float
    azimuth: float = 0.0
    elevation: float = 0.0
    range_rate: float = 0.0
    rcs: float = 1.0
    swerling: int = 0
    azimuth_rate: float = 0.0
    elevation_rate: float = 0.0

    def __post_init__(self) -> None:
        for name in ("range", "rcs"):
            checked(name, getattr(self, name), POSITIVE)
        checked("range_rate", self.range_rate, _SLOW)
        for name in ("azimuth", "elevation", "azimuth_rate", "elevation_rate"):
            checked(name, getattr(self, name), FINITE)
        choice("swerling", self.swerling, SWERLING)


@dataclass(frozen=True)
class Multipath:
    """Flat, smooth ground that mirrors waves on their way to a target, back from it, or both.

    Attributes
    ----------
    radar_height : float
        Of the radar above the ground, m.
    reflection : complex
        Coefficient of the ground, of magnitude 1 or less, in the beat signal; a grazing wave is turned over (-1).

    Raises
    ------
    ValueError
        If the height is not positive and finite, or the coefficient of more than magnitude 1.
    """

    radar_height: float
    reflection: complex = -0.7

    def __post_init__(self) -> None:
        checked("radar_height", self.radar_height, POSITIVE)
        if not abs(self.reflection) <= 1.0:
            raise ValueError(f"reflection must be of magnitude 1 or less, got {self.reflection}")


@dataclass(frozen=True)
class Paths:
    """Ways there and back, each with arrays of shape (n,), in the middle of the frame.

    Attributes
    ----------
    target : ndarray of int
        Whose echo it is.
    out, back : ndarray, shape (n, 4)
        Length, m, its rate, m/s, and the direction at the radar (azimuth, elevation, rad) of each half of the way.
    turn : ndarray, shape (n, 2)
        Rates of azimuth and elevation, rad/s.
    factor : ndarray of complex
        Of the amplitude, for reflections.
    """

    target: NDArray[np.intp]
    out: FloatArray
    back: FloatArray
    turn: FloatArray
    factor: NDArray[np.complex128]


def echo_paths(
    targets: Sequence[RadarTarget], boresight_elevation: float = 0.0, multipath: Multipath | None = None
) -> Paths:
    """Return the ways of the targets' echoes: one each, or four with multipath.

    Parameters
    ----------
    targets : sequence of RadarTarget
    boresight_elevation : float
        Of the sensor's forward axis above the horizon, rad; its right is level.
    multipath : Multipath or None

    Returns
    -------
    Paths

    Raises
    ------
    ValueError
        If a target is not above the ground that mirrors it.
    """
    number = np.arange(len(targets))
    direct = np.array([(t.range, t.range_rate, t.azimuth, t.elevation) for t in targets]).reshape(-1, 4)
    turn = np.array([(t.azimuth_rate, t.elevation_rate) for t in targets]).reshape(-1, 2)
    one = np.ones(len(targets), dtype=np.complex128)
    if multipath is None:
        return Paths(number, direct, direct, turn, one)
    mirrored, mirrored_turn = _mirrored(direct, turn, boresight_elevation, multipath.radar_height)
    out = np.concatenate([direct, direct, mirrored, mirrored])
    back = np.concatenate([direct, mirrored, direct, mirrored])
    turns = np.concatenate([turn, mirrored_turn, turn, mirrored_turn])
    once = multipath.reflection * one
    return Paths(np.tile(number, 4), out, back, turns, np.concatenate([one, once, once, multipath.reflection**2 * one]))


def _mirrored(
    direct: FloatArray, turn: FloatArray, boresight_elevation: float, height: float
) -> tuple[FloatArray, FloatArray]:
    """Return length, rate and direction to the targets' images below the ground, and the rates of the directions."""
    place, velocity = _to_level(*_cartesian(direct, turn), boresight_elevation)
    low = place[:, 2] >= height
    if low.any():
        raise ValueError(f"target {np.flatnonzero(low)[0]} is not above the ground, {height:g} m below the radar")
    place[:, 2], velocity[:, 2] = 2.0 * height - place[:, 2], -velocity[:, 2]
    return _spherical(*_to_level(place, velocity, -boresight_elevation))


def _cartesian(polar: FloatArray, turn: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return places and velocities (n, 3), forward, right and down, of (range, range rate, azimuth, elevation)."""
    distance, rate, az, el = polar.T
    towards = np.stack([np.cos(el) * np.cos(az), np.cos(el) * np.sin(az), -np.sin(el)], axis=-1)
    across = np.stack([-np.cos(el) * np.sin(az), np.cos(el) * np.cos(az), np.zeros_like(az)], axis=-1)
    up = np.stack([-np.sin(el) * np.cos(az), -np.sin(el) * np.sin(az), -np.cos(el)], axis=-1)
    velocity = rate[:, None] * towards + distance[:, None] * (turn[:, :1] * across + turn[:, 1:] * up)
    return distance[:, None] * towards, velocity


def _spherical(place: FloatArray, velocity: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return (n, 4) range, range rate, azimuth and elevation, and (n, 2) rates of the angles."""
    distance = np.linalg.norm(place, axis=-1)
    level = np.maximum(np.hypot(place[:, 0], place[:, 1]), 1e-9 * distance)
    rate = (place * velocity).sum(axis=-1) / distance
    az, el = np.arctan2(place[:, 1], place[:, 0]), np.arctan2(-place[:, 2], level)
    az_rate = (place[:, 0] * velocity[:, 1] - place[:, 1] * velocity[:, 0]) / level**2
    el_rate = (-velocity[:, 2] - rate * np.sin(el)) / level
    return np.stack([distance, rate, az, el], axis=-1), np.stack([az_rate, el_rate], axis=-1)


def _to_level(place: FloatArray, velocity: FloatArray, elevation: float) -> tuple[FloatArray, FloatArray]:
    turned = levelling(elevation)
    return place @ turned.T, velocity @ turned.T


def levelling(elevation: float) -> FloatArray:
    """Return the matrix that turns vectors of a sensor that looks up by an elevation, rad, to a level one's axes."""
    c, s = np.cos(elevation), np.sin(elevation)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
