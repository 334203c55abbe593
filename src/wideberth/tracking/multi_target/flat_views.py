"""Radars that measure no elevation, where the traffic's altitude is not known: what their tracks leave out.

Such a track is kept at the height of its radar, as if the range were one in the plane. An aircraft higher or lower is
nearer on the ground: along the line of sight if the radar measures azimuth, along its forward axis if it is a line of
elements, whose angle is that of a cone (what lies across the axis is right then). With x the distance along that
direction and h the height, the true one is sqrt(x^2 - h^2), and the speed along it x / sqrt(x^2 - h^2) times that of
the track. The mean squares of both errors, over the elevations of the field of view, are added to what is reported.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wideberth.types import Scan

FloatArray = NDArray[np.float64]

_ELEVATIONS = np.linspace(-1.0, 1.0, 21)
_LEAST_SHARE = 0.3
"""Nearer than this part of the distance along the direction nothing is reckoned with."""


class _View(NamedTuple):
    position: FloatArray
    forward: FloatArray | None
    sines: FloatArray


class FlatViews:
    """The sensors that have given plots without any elevation."""

    def __init__(self) -> None:
        self._views: dict[int, _View] = {}

    def note(self, sensor: int, scan: Scan) -> None:
        """Note how a scan's plots were measured; one with elevations says that the sensor is none of these.

        Parameters
        ----------
        sensor : int
            Its number.
        scan : Scan
            Of a radar.
        """
        if not len(scan.z):
            return
        if not math.isnan(scan.z[0, 2]) or not np.isnan(scan.z[:, 2]).all():
            self._views.pop(sensor, None)
            return
        forward = _level(scan.sensor_attitude[:, 0]) if scan.kind == "radar_cone" else None
        self._views[sensor] = _View(scan.sensor_position, forward, np.sin(scan.field_of_view[1] * _ELEVATIONS))

    def widened(self, fed: int, sensor: int, x: FloatArray, p: FloatArray) -> FloatArray:
        """Return the covariance (9, 9) of a track, wider where no sensor has measured its elevation.

        Parameters
        ----------
        fed : int
            The sensors that had plots of it, as bits.
        sensor : int
            Number of the one that sees it.
        x : ndarray, shape (9,)
        p : ndarray, shape (9, 9)
        """
        view = self._views.get(sensor)
        if view is None or fed != 1 << min(sensor, 62):
            return p
        offset = x[:3] - view.position
        axis = _level(offset) if view.forward is None else view.forward
        along, speed = float(offset @ axis), float(x[3:6] @ axis)
        height = float(np.linalg.norm(offset)) * view.sines
        true = np.sqrt(np.maximum(along**2 - height**2, (_LEAST_SHARE * along) ** 2))
        wide = p.copy()
        wide[:3, :3] += np.mean((true - abs(along)) ** 2) * np.outer(axis, axis)
        wide[3:6, 3:6] += np.mean((speed * (abs(along) / np.maximum(true, 1e-6) - 1.0)) ** 2) * np.outer(axis, axis)
        return wide


def _level(direction: FloatArray) -> FloatArray:
    """Return the unit vector of the horizontal part; north where there is none."""
    length = math.hypot(direction[0], direction[1])
    return np.array([direction[0], direction[1], 0.0]) / length if length > 1e-9 else np.array([1.0, 0.0, 0.0])
