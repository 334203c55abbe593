"""Well-clear volumes and when a pair of aircraft in straight flight is inside one.

The volume is WCV_TAUMOD (Munoz, Narkawicz, Chamberlain, Upchurch: "A family of well-clear boundary models for the
integration of UAS in the NAS", AIAA 2014-2412): horizontally within DTHR, or closing with a modified tau of at most
TTHR towards a miss of at most DTHR; and vertically within +-ZTHR, or with a time to co-altitude of at most TCOA. A
cylinder is the case TTHR = TCOA = 0. Bounds belong to the volume; a touch of no duration is no conflict.
"""

import math
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wideberth.conflict import kernels
from wideberth.conflict.states import pair_states
from wideberth.units import FOOT, NAUTICAL_MILE

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class WellClearVolume:
    """Thresholds of a well-clear volume.

    Attributes
    ----------
    dthr : float
        Horizontal distance threshold, m.
    zthr : float
        Vertical distance threshold, the half-height of the volume, m.
    tthr : float
        Threshold on modified tau, s; 0 gives a cylinder.
    tcoa : float
        Threshold on the time to co-altitude, s.

    Raises
    ------
    ValueError
        If a threshold is negative or not finite, or a distance is 0.
    """

    dthr: float
    zthr: float
    tthr: float = 0.0
    tcoa: float = 0.0

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            if not (math.isfinite(value) and value >= 0):
                raise ValueError(f"well-clear volume: {item.name} must be finite and not negative, got {value}")
        if not (self.dthr > 0 and self.zthr > 0):
            raise ValueError(f"well-clear volume: dthr and zthr must be positive, got {self.dthr} and {self.zthr}")


PRESETS: dict[str, WellClearVolume] = {
    # ADS-B paper, "Conflict/collision detection" (Cook et al., 2015): the SARP volume.
    "sarp": WellClearVolume(4000 * FOOT, 700 * FOOT, 35.0),
    # RTCA DO-365: phase I, the same with sensor buffers, and against non-cooperative intruders.
    "do365_phase1": WellClearVolume(0.66 * NAUTICAL_MILE, 450 * FOOT, 35.0),
    "do365_buffered": WellClearVolume(1.0 * NAUTICAL_MILE, 450 * FOOT, 35.0, 20.0),
    "do365_noncooperative": WellClearVolume(2200 * FOOT, 450 * FOOT),
    "astm_f3442": WellClearVolume(2000 * FOOT, 250 * FOOT),
    "nmac": WellClearVolume(500 * FOOT, 100 * FOOT),
}


def conflict_interval(
    volume: WellClearVolume,
    own_position: ArrayLike,
    own_velocity: ArrayLike,
    intruder_position: ArrayLike,
    intruder_velocity: ArrayLike,
    lookahead: float,
    *,
    miss_filter: bool = True,
) -> tuple[FloatArray, FloatArray]:
    """Return when pairs of aircraft that fly straight on are inside a well-clear volume.

    Parameters
    ----------
    volume : WellClearVolume
    own_position, own_velocity, intruder_position, intruder_velocity : array_like, shape (n, 3) or (3,)
        Local NED, m and m/s. A single state serves all pairs.
    lookahead : float
        How far to look, s.
    miss_filter : bool
        Whether modified tau counts only where the horizontal miss distance is at most `volume.dthr`, as WCV_TAUMOD is
        defined. Without it every closing pair with a small modified tau is inside.

    Returns
    -------
    t_in, t_out : ndarray, shape (n,), or shape () where all states are single
        Seconds from now; `t_in` is 0 when already inside, `t_out` is cut at the look-ahead; NaN without conflict.

    Raises
    ------
    ValueError
        If an input is not finite, has another shape, or the look-ahead is negative.
    """
    states, n, single = pair_states(own_position, own_velocity, intruder_position, intruder_velocity)
    if not (np.ndim(lookahead) == 0 and math.isfinite(lookahead) and lookahead >= 0):
        raise ValueError(f"lookahead must be one number, finite and not negative, got {lookahead}")
    t_in, t_out = np.empty(n), np.empty(n)
    kernels.conflict_intervals(
        *states,
        float(volume.dthr),
        float(volume.zthr),
        float(volume.tthr),
        float(volume.tcoa),
        float(lookahead),
        bool(miss_filter),
        t_in,
        t_out,
    )
    return (t_in.reshape(()), t_out.reshape(())) if single else (t_in, t_out)


def violation(
    volume: WellClearVolume,
    own_position: ArrayLike,
    own_velocity: ArrayLike,
    intruder_position: ArrayLike,
    intruder_velocity: ArrayLike,
    *,
    miss_filter: bool = True,
) -> NDArray[np.bool_]:
    """Return whether pairs of aircraft are inside a well-clear volume now.

    Parameters, errors and shapes as in `conflict_interval`.
    """
    states, n, single = pair_states(own_position, own_velocity, intruder_position, intruder_velocity)
    violated = np.empty(n, dtype=np.bool_)
    kernels.violations(
        *states,
        float(volume.dthr),
        float(volume.zthr),
        float(volume.tthr),
        float(volume.tcoa),
        bool(miss_filter),
        violated,
    )
    return violated.reshape(()) if single else violated
