"""What can be wrong with the reports of an ADS-B scan, one by one."""

import numpy as np
from numpy.typing import NDArray

from wideberth.types import Scan

FUTURE_S = 0.5
"""Reports this far ahead of the clock are still believed."""

LARGEST = np.array([2e7, 2e7, 1e5, 2e3, 2e3, 2e3])
"""Largest position, altitude and velocity that are believed to come from the air at all, m and m/s."""


def report_faults(scan: Scan, t: float, oldest: float) -> tuple[tuple[str, NDArray[np.bool_]], ...]:
    """Return what may be wrong, and which of the k reports of a scan it is wrong with.

    Parameters
    ----------
    scan : Scan
        Of kind "adsb".
    t, oldest : float
        Now, and the earliest validity that is used, s.

    Returns
    -------
    tuple of (str, ndarray of bool, shape (k,))
    """
    times: NDArray[np.float64] = np.asarray(scan.t_valid, dtype=np.float64)
    variances = scan.R.diagonal(axis1=1, axis2=2)
    sound = (variances > 1e-12) & (variances < 1e12)
    return (
        ("time not finite", ~np.isfinite(times)),
        ("time in the future", times > t + FUTURE_S),
        ("too late", times < oldest),
        ("value out of range", np.asarray((np.abs(scan.z) > LARGEST).any(axis=1))),
        ("variance out of range", np.asarray(~(sound | np.isnan(scan.z)).all(axis=1))),
    )
