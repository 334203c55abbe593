"""Bounds that the quality categories of ADS-B stand for (RTCA DO-260B), as scalar kernels that other steps may use."""

import math

from wideberth._jit import jit

NAUTICAL_MILE = 1852.0

EPU: tuple[float, ...] = (
    20.0 * NAUTICAL_MILE,  # unknown, or 10 nmi and more
    10.0 * NAUTICAL_MILE,
    4.0 * NAUTICAL_MILE,
    2.0 * NAUTICAL_MILE,
    1.0 * NAUTICAL_MILE,
    0.5 * NAUTICAL_MILE,
    0.3 * NAUTICAL_MILE,
    0.1 * NAUTICAL_MILE,
    0.05 * NAUTICAL_MILE,
    30.0,
    10.0,
    3.0,
)
"""Estimated position uncertainty (95 % horizontal radius, m) of NACp 0 to 11."""

VELOCITY_BOUND: tuple[float, ...] = (20.0, 10.0, 3.0, 1.0, 0.3)
"""95 % bound of the horizontal velocity error, m/s, of NACv 0 to 4; NACv 0 is unknown, or 10 m/s and more."""

CONTAINMENT_RADIUS: tuple[float, ...] = (
    math.inf,
    20.0 * NAUTICAL_MILE,
    8.0 * NAUTICAL_MILE,
    4.0 * NAUTICAL_MILE,
    2.0 * NAUTICAL_MILE,
    1.0 * NAUTICAL_MILE,
    0.6 * NAUTICAL_MILE,
    0.2 * NAUTICAL_MILE,
    0.1 * NAUTICAL_MILE,
    75.0,
    25.0,
    7.5,
)
"""Containment radius R_c, m, of NIC 0 (unknown) to 11; the largest of each (NIC 6 also covers 0.5 and 0.3 nmi)."""

RAYLEIGH_95 = math.sqrt(-2.0 * math.log(0.05))
"""Radius that holds 95 % of a circular normal error, in standard deviations of one axis (2.448)."""


@jit
def position_sigma_of(nacp: int) -> float:
    """Return the standard deviation of one horizontal axis, m; `nacp` 0 to 11, not checked."""
    return EPU[nacp] / RAYLEIGH_95


@jit
def velocity_sigma_of(nacv: int) -> float:
    """Return the standard deviation of one horizontal axis, m/s; `nacv` 0 to 4, not checked."""
    return VELOCITY_BOUND[nacv] / RAYLEIGH_95


@jit
def nic_bound_of(nic: int) -> float:
    """Return the containment radius, m; `nic` 0 to 11, not checked."""
    return CONTAINMENT_RADIUS[nic]


def warmup() -> None:
    """Compile every kernel of this module for the types it is used with."""
    position_sigma_of(8)
    velocity_sigma_of(1)
    nic_bound_of(7)
