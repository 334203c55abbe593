"""Scans made ready for the kernels: what cannot be used is left out, with a reason."""

import itertools
import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wideberth.tracking.multi_target.config import MultiTargetConfig
from wideberth.tracking.multi_target.window_kernels import TABLE_NODES
from wideberth.types import DetectionModel, Scan

FloatArray = NDArray[np.float64]

RADAR_KINDS = ("radar", "radar_cone")

AGREE_SCANS = 3
"""So many scans in a row from a new place are believed."""

ROTATION_TOLERANCE = 1e-3
"""How far C C' may be from the identity."""

_LEAST_JUMP_M = 5.0
_MOST_PROBABLE = 0.999


@dataclass(frozen=True, slots=True)
class ReadyScan:
    """One scan as `process_scan` takes it; variances instead of R, a table instead of a detection model."""

    t: float
    sensor: int
    z: FloatArray
    variance: FloatArray
    position: FloatArray
    velocity: FloatArray
    attitude: FloatArray
    field_of_view: FloatArray
    ranges: FloatArray
    probabilities: FloatArray
    cone: bool = False


@dataclass(slots=True)
class SensorLog:
    """What is remembered of one sensor.

    Attributes
    ----------
    index : int
    t : float
        Of its last good scan, s.
    position, velocity : ndarray, shape (3,)
        Then, NED.
    strange : list of (float, ndarray)
        Times and places of the scans in a row that lie too far off.
    recent : list of (float, ndarray)
        Times and plots of the last scans, to know repeats by.
    table : tuple or None
        The detection model of its last good scan, and `detection_table` of it.
    """

    index: int
    t: float = -math.inf
    position: FloatArray = field(default_factory=lambda: np.zeros(3))
    velocity: FloatArray = field(default_factory=lambda: np.zeros(3))
    strange: list[tuple[float, FloatArray]] = field(default_factory=list)
    recent: list[tuple[float, FloatArray]] = field(default_factory=list)
    table: tuple[DetectionModel | None, FloatArray, FloatArray] | None = None

    def is_repeat(self, t: float, z: FloatArray) -> bool:
        """Return whether a scan of the same time with the same plots has come before; else remember it.

        Parameters
        ----------
        t : float
        z : ndarray, shape (k, 4)
        """
        for known_t, known in self.recent:
            if known_t == t and np.array_equal(known, z, equal_nan=True):
                return True
        self.recent.append((t, z))
        del self.recent[:-20]
        return False

    def moves_to(self, t: float, position: FloatArray, speed_max: float) -> bool:
        """Note the sensor's place, and return whether it can be there; its velocity follows from the last place.

        Parameters
        ----------
        t : float
        position : ndarray, shape (3,)
        speed_max : float
            m/s.
        """
        if self.t == -math.inf:
            self.t, self.position = t, position
            return True
        if t <= self.t:
            # A late scan: its place must fit, but says nothing new of the motion.
            return _near(self.t, self.position, t, position, speed_max)
        if _near(self.t, self.position, t, position, speed_max):
            self.velocity = (position - self.position) / (t - self.t)
            self.t, self.position = t, position
            self.strange.clear()
            return True
        if self.strange and not _near(*self.strange[-1], t, position, speed_max):
            self.strange.clear()
        self.strange.append((t, position))
        if len(self.strange) < AGREE_SCANS:
            return False
        before, place = self.strange[-2]
        self.velocity = (position - place) / (t - before) if t > before else np.zeros(3)
        self.t, self.position = t, position
        self.strange.clear()
        return True


def _near(t0: float, place: FloatArray, t: float, position: FloatArray, speed_max: float) -> bool:
    return bool(np.linalg.norm(position - place) <= max(speed_max * abs(t - t0), _LEAST_JUMP_M))


def detection_table(model: DetectionModel | None, config: MultiTargetConfig) -> tuple[FloatArray, FloatArray]:
    """Return ranges and probabilities (TABLE_NODES,) of a detection model, or of the assumed one for None.

    Parameters
    ----------
    model : DetectionModel or None
    config : MultiTargetConfig
    """
    if model is None:
        ranges = np.array([config.assumed_range_max_m])
        probabilities = np.array([config.assumed_detection_probability])
    else:
        ranges, probabilities = model.ranges.astype(float), model.probabilities.astype(float)
    if len(ranges) > TABLE_NODES:
        nodes = np.linspace(ranges[0], ranges[-1], TABLE_NODES)
        ranges, probabilities = nodes, np.interp(nodes, ranges, probabilities)
    table = np.empty((2, TABLE_NODES))
    table[0, : len(ranges)], table[1, : len(ranges)] = ranges, np.minimum(probabilities, _MOST_PROBABLE)
    table[:, len(ranges) :] = table[:, len(ranges) - 1 : len(ranges)]
    return table[0], table[1]


def pose_fault(position: FloatArray, attitude: FloatArray) -> str | None:
    """Return what is wrong with a sensor's pose, None where nothing is.

    Parameters
    ----------
    position : ndarray, shape (3,)
    attitude : ndarray, shape (3, 3)
    """
    if np.shape(position) != (3,) or np.shape(attitude) != (3, 3):
        return "sensor pose of a wrong shape"
    rows = np.asarray(attitude, float).tolist()
    if not all(map(math.isfinite, itertools.chain(np.asarray(position, float).tolist(), *rows))):
        return "sensor pose not finite"
    return None if _is_rotation(rows) else "sensor attitude is no rotation"


def _is_rotation(rows: list[list[float]]) -> bool:
    """Return whether C C' of finite rows (3, 3) is the identity, and C no mirror image; plain numbers are fastest."""
    (a, b, c), (d, e, f), (g, h, i) = rows
    lengths = a * a + b * b + c * c, d * d + e * e + f * f, g * g + h * h + i * i
    angles = a * d + b * e + c * f, a * g + b * h + c * i, d * g + e * h + f * i
    off = max(abs(length - 1.0) for length in lengths), max(map(abs, angles))
    determinant = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
    return max(off) <= ROTATION_TOLERANCE and determinant > 0.0


def scan_fault(scan: Scan) -> str | None:
    """Return why a radar scan cannot be used as a whole, None where it can.

    Parameters
    ----------
    scan : Scan
    """
    if not math.isfinite(scan.t):
        return "scan time not finite"
    z, r = np.asarray(scan.z), np.asarray(scan.R)
    if z.ndim != 2 or z.shape[1] != 4 or r.shape != (len(z), 4, 4):
        return "scan of a wrong shape"
    azimuth, elevation = scan.field_of_view
    if not (0.0 < azimuth <= math.pi + 1e-9 and 0.0 < elevation <= math.pi / 2 + 1e-9):
        return "field of view out of range"
    return pose_fault(scan.sensor_position, scan.sensor_attitude)


def ready(scan: Scan, log: SensorLog, config: MultiTargetConfig) -> ReadyScan:
    """Return a scan that has no fault as the kernels take it.

    Parameters
    ----------
    scan : Scan
    log : SensorLog
        Of its sensor, after `SensorLog.moves_to`.
    config : MultiTargetConfig
    """
    if log.table is None or log.table[0] is not scan.detection:
        log.table = (scan.detection, *detection_table(scan.detection, config))
    _, ranges, probabilities = log.table
    return ReadyScan(
        t=float(scan.t),
        sensor=log.index,
        z=_own(scan.z),
        variance=_own(np.diagonal(scan.R, axis1=1, axis2=2)),
        position=_own(scan.sensor_position),
        velocity=log.velocity,
        attitude=_own(scan.sensor_attitude),
        field_of_view=_own(scan.field_of_view),
        ranges=ranges,
        probabilities=probabilities,
        cone=scan.kind == "radar_cone",
    )


def _own(values: ArrayLike) -> FloatArray:
    """Return a copy: an array that cannot be written is another type to the compiler, which would compile in flight."""
    return np.array(values, dtype=np.float64, order="C")
