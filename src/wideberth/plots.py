"""A run of radar plots as arrays: what a tracker that runs over a whole file is given, and all that it may see."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Plots:
    """The plots of one run, scan by scan, with the pose of the radar; a scan without plots is information too.

    Rows may be bad (NaN, ranges below zero, scans whose time goes back): a tracker leaves them out and counts them.

    Attributes
    ----------
    first : ndarray of int64, shape (n_scans + 1,)
        Scan k holds the rows ``first[k]`` to ``first[k + 1] - 1``.
    z : ndarray, shape (rows, 4)
        Range m, azimuth rad (clockwise from the sensor's forward axis), elevation rad (above the sensor's horizontal
        plane; noise may carry it past 90 deg), range rate m/s (positive opening); NaN where the radar gives none.
    t : ndarray, shape (n_scans,)
        Time of each scan, s.
    sensor_position : ndarray, shape (n_scans, 3)
        Local NED, m.
    sensor_attitude : ndarray, shape (n_scans, 3, 3)
        C_ned_sensor.
    sigma : ndarray, shape (4,)
        Standard deviations of the columns of `z`; NaN where the radar does not give one.
    detection_probability : float
        Of an aircraft inside range and field of view.
    range_max : float
        Largest range that the radar reports, m.
    field_of_view : tuple of float
        Azimuth and elevation half-widths, rad; (pi, pi/2) sees everything.
    dt : float
        Time between scans, s.
    ownship : ndarray, shape (n_scans, 6)
        Position and velocity of the ownship from its telemetry, local NED, m and m/s; NaN where there is none, or where
        the ownship carries the radar and so is never among the plots.
    variance : ndarray, shape (rows, 4), or None
        Of each plot's columns of `z`, where the radar tells them apart; None: the squares of `sigma` for all.
    """

    first: NDArray[np.int64]
    z: FloatArray
    t: FloatArray
    sensor_position: FloatArray
    sensor_attitude: FloatArray
    sigma: FloatArray
    detection_probability: float
    range_max: float
    field_of_view: tuple[float, float]
    dt: float
    ownship: FloatArray
    variance: FloatArray | None = None

    @property
    def n_scans(self) -> int:
        """How many scans there are."""
        return len(self.t)

    def variances(self, rows: slice = slice(None)) -> FloatArray:
        """Return the variances of the columns of `z` in some rows, (k, 4)."""
        return np.tile(self.sigma**2, (len(self.z[rows]), 1)) if self.variance is None else self.variance[rows]
