"""Thresholds of TCAS by altitude."""

import math
from dataclasses import dataclass

from wideberth.units import FOOT, NAUTICAL_MILE


@dataclass(frozen=True, slots=True)
class AlertThresholds:
    """When a traffic or resolution advisory is due.

    Attributes
    ----------
    tau : float
        Time to the closest point, and to equal altitude, s.
    dmod : float
        Range within which a slow closure alerts too, m.
    zthr : float
        Altitude difference, m.
    """

    tau: float
    dmod: float
    zthr: float


@dataclass(frozen=True, slots=True)
class TcasThresholds:
    """All thresholds of one sensitivity level.

    Attributes
    ----------
    level : int
        2 to 7.
    ta : AlertThresholds
    ra : AlertThresholds or None
        None: no resolution advisories.
    alim : float
        Altitude difference at the closest point that a resolution advisory is to reach, m; NaN without one.
    hmd : float
        A larger horizontal miss distance needs no resolution advisory, m; NaN without one.
    """

    level: int
    ta: AlertThresholds
    ra: AlertThresholds | None = None
    alim: float = math.nan
    hmd: float = math.nan


def _alert(tau: float, dmod_nmi: float, zthr_ft: float) -> AlertThresholds:
    return AlertThresholds(tau, dmod_nmi * NAUTICAL_MILE, zthr_ft * FOOT)


def _resolving(level: int, ta: AlertThresholds, ra: AlertThresholds, alim_ft: float, hmd_ft: float) -> TcasThresholds:
    return TcasThresholds(level, ta, ra, alim_ft * FOOT, hmd_ft * FOOT)


Bands = tuple[tuple[float, TcasThresholds], ...]

# Upper limits of the altitude bands in feet; the first two are heights above ground.
TCAS_II: Bands = (
    (1000.0, TcasThresholds(2, _alert(20, 0.30, 850))),
    (2350.0, _resolving(3, _alert(25, 0.33, 850), _alert(15, 0.20, 600), 300, 1215)),
    (5000.0, _resolving(4, _alert(30, 0.48, 850), _alert(20, 0.35, 600), 300, 2126)),
    (10000.0, _resolving(5, _alert(40, 0.75, 850), _alert(25, 0.55, 600), 350, 3342)),
    (20000.0, _resolving(6, _alert(45, 1.0, 850), _alert(30, 0.80, 600), 400, 4861)),
    (42000.0, _resolving(7, _alert(48, 1.3, 850), _alert(35, 1.1, 700), 600, 6683)),
    (math.inf, _resolving(7, _alert(48, 1.3, 1200), _alert(35, 1.1, 800), 700, 6683)),
)
"""TCAS II version 7.1 (errata, "TCAS II v7.1")."""

# The source gives only the ends: 20 s below 1000 ft and 48 s above FL300; 1.0 nmi below 2350 ft and 3.0 nmi above
# FL300 (CAS thesis, 3.4). In between, tau goes as in TCAS II, and DMOD grows with it: our reading.
TCAS_I: Bands = (
    (1000.0, TcasThresholds(2, _alert(20, 1.0, 850))),
    (2350.0, TcasThresholds(3, _alert(25, 1.0, 850))),
    (5000.0, TcasThresholds(4, _alert(30, 1.4, 850))),
    (10000.0, TcasThresholds(5, _alert(40, 2.0, 850))),
    (20000.0, TcasThresholds(6, _alert(45, 2.5, 850))),
    (30000.0, TcasThresholds(7, _alert(48, 2.7, 850))),
    (math.inf, TcasThresholds(7, _alert(48, 3.0, 1200))),
)
"""TCAS I: traffic advisories only, from larger ranges (CAS thesis, 3.4)."""


def sensitivity_level(
    altitude: float, height_above_ground: float | None = None, bands: Bands = TCAS_II
) -> TcasThresholds:
    """Return the thresholds that hold at an altitude.

    Parameters
    ----------
    altitude : float
        Pressure altitude, m.
    height_above_ground : float, optional
        By radio altimeter, m; decides the lowest two levels. By default the altitude stands for it.
    bands : tuple
        `TCAS_II` or `TCAS_I`.

    Raises
    ------
    ValueError
        If a height is not finite.
    """
    height = altitude if height_above_ground is None else height_above_ground
    if not (math.isfinite(altitude) and math.isfinite(height)):
        raise ValueError(f"altitude {altitude} and height above ground {height} must be finite")
    for limit, thresholds in bands[:2]:
        if height < limit * FOOT:
            return thresholds
    for limit, thresholds in bands[2:-1]:
        if altitude < limit * FOOT:
            return thresholds
    return bands[-1][1]
