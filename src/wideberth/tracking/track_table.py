"""What a tracker that runs over a whole file of plots answers: one row for each confirmed track and scan."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class TrackTable:
    """Confirmed tracks, in order of scan.

    Attributes
    ----------
    scan : ndarray of int32, shape (n,)
    track_id : ndarray of int64, shape (n,)
        The same number for the same track in every scan; none is used twice.
    x : ndarray, shape (n, 9)
        Position, velocity, acceleration, local NED; m, m/s, m/s2.
    P : ndarray, shape (n, 9, 9)
        Covariance of `x`.
    existence : ndarray, shape (n,)
        Probability that the aircraft exists.
    is_ownship : ndarray of bool, shape (n,)
    counters : mapping of str to int
        What was left out, by cause (plots that are not finite, scans whose time went back), and whatever else counts.
    nis : ndarray, shape (m,)
        Normalised innovation squared of each accepted update; empty where the tracker does not keep them.
    nis_dof : ndarray, shape (m,)
        Degrees of freedom of each.
    """

    scan: NDArray[np.int32]
    track_id: NDArray[np.int64]
    x: FloatArray
    P: FloatArray
    existence: FloatArray
    is_ownship: NDArray[np.bool_]
    counters: Mapping[str, int] = field(default_factory=dict)
    nis: FloatArray = field(default_factory=lambda: np.empty(0))
    nis_dof: FloatArray = field(default_factory=lambda: np.empty(0))

    def __post_init__(self) -> None:
        n = len(self.scan)
        shapes = {
            "scan": (n,),
            "track_id": (n,),
            "x": (n, 9),
            "P": (n, 9, 9),
            "existence": (n,),
            "is_ownship": (n,),
            "nis_dof": (len(self.nis),),
        }
        for name, shape in shapes.items():
            if getattr(self, name).shape != shape:
                raise ValueError(f"{name} must have shape {shape}, got {getattr(self, name).shape}")
        if n and np.any(np.diff(self.scan) < 0):
            raise ValueError("scan must not decrease: rows stand in order of scan")

    def __len__(self) -> int:
        return len(self.scan)
