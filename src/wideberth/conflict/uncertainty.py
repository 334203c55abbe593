"""How uncertain a predicted separation is: from constant standard deviations, or from the covariance of a track."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wideberth.conflict import detection_kernels as kernels
from wideberth.conflict.states import finite_array
from wideberth.units import FOOT, FOOT_PER_MINUTE, KNOT

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ConstantNoise:
    """Constant standard deviations of the state of one aircraft; m and m/s.

    Attributes
    ----------
    position, velocity : float
        Of each horizontal component.
    altitude, climb_rate : float
    noisy_aircraft : int
        1 where the ownship knows its own state well, 2 where both aircraft have these errors.

    Raises
    ------
    ValueError
        If a value is negative or not finite, or `noisy_aircraft` is neither 1 nor 2.
    """

    position: float
    velocity: float
    altitude: float
    climb_rate: float
    noisy_aircraft: int = 1

    def __post_init__(self) -> None:
        for value in (self.position, self.velocity, self.altitude, self.climb_rate):
            if not (math.isfinite(value) and value >= 0):
                raise ValueError(f"standard deviations must be finite and not negative, got {value}")
        if self.noisy_aircraft not in (1, 2):
            raise ValueError(f"noisy_aircraft must be 1 or 2, got {self.noisy_aircraft}")

    def array(self) -> FloatArray:
        """Return position, velocity, altitude, climb rate."""
        return np.array([self.position, self.velocity, self.altitude, self.climb_rate])


# ADS-B paper, simulation section: one noisy aircraft (ERRATA, ADS-B paper).
PAPER_NOISE = ConstantNoise(124 * FOOT, 8 * KNOT, 75.9 * FOOT, 27.96 * FOOT_PER_MINUTE)


def sigma_at_cpa(noise: ConstantNoise, t_cpa: ArrayLike, *, printed: bool = False) -> tuple[FloatArray, FloatArray]:
    """Return the standard deviations of the horizontal and vertical separation at the closest point of approach, m.

    Parameters
    ----------
    noise : ConstantNoise
    t_cpa : array_like
        s from now.
    printed : bool
        Let the variance grow with t as printed (ADS-B paper, before algorithm 2) in place of t^2.

    Raises
    ------
    ValueError
        If a time is not finite.
    """
    t = finite_array("t_cpa", t_cpa, "(n,) or ()").reshape(np.shape(t_cpa))
    growth = np.maximum(t, 0.0) if printed else t * t
    n = noise.noisy_aircraft
    return (
        np.sqrt(n * (noise.position**2 + growth * noise.velocity**2)),
        np.sqrt(n * (noise.altitude**2 + growth * noise.climb_rate**2)),
    )


def relative_position_covariance(
    intruder_covariance: ArrayLike, t: float, own_covariance: ArrayLike | None = None
) -> FloatArray:
    """Return the covariance (3, 3) of the relative position after `t` seconds of straight flight, m^2.

    Parameters
    ----------
    intruder_covariance : array_like, shape (9, 9) or (6, 6)
        Of position, velocity (and acceleration, not used); NED.
    t : float
        s from the time of the covariances.
    own_covariance : array_like, shape (6, 6), optional
        Zero if absent.

    Raises
    ------
    ValueError
        If an input is not finite or has another shape.
    """
    intruder = finite_array("intruder_covariance", intruder_covariance, "(9, 9) or (6, 6)")
    own = np.zeros((6, 6)) if own_covariance is None else finite_array("own_covariance", own_covariance, "(6, 6)")
    if intruder.shape not in ((9, 9), (6, 6)) or own.shape != (6, 6):
        raise ValueError(f"covariances must be (9, 9) or (6, 6), and (6, 6), got {intruder.shape} and {own.shape}")
    if not math.isfinite(t):
        raise ValueError(f"t must be finite, got {t}")
    return np.array(
        [[kernels.relative_covariance(own, intruder, i, j, float(t), float(t)) for j in range(3)] for i in range(3)],
        float,
    )
