"""Four detectors judged side by side: how near each is to an alarm, as a score that its threshold is compared with.

Algorithm 1 on the track as it is; algorithm 2 of the ADS-B paper with its constant sigmas; algorithm 2 with the track's
covariance; and the probability of entering the volume, which is the default. Its threshold falls as the closest point
comes near: every look ahead is a chance for a false alarm, and a late one tells most. (It judges; it is not what begins
a maneuver, which has a margin of its own.)
"""

import math

import numpy as np

from wideberth._jit import jit_uncounted
from wideberth.conflict.detection_kernels import (
    band_probability,
    closest_ahead,
    detection_time,
    paper_sigma,
    relative_covariance,
    track_sigmas,
)

N_SCORES = 4
SCALE, PAPER, TRACK, PROBABILITY = 0, 1, 2, 3

# The parameters, one after the other: rules as for `detect` (m1 and m2 are not used), sigma of position, velocity,
# altitude and climb rate (the paper's constants), and how much surer the default must be the farther ahead it looks:
# up to EARLY decimal orders of probability at EARLY_TIME seconds and beyond.
RULES, NOISE, EARLY, EARLY_TIME = 0, 8, 12, 13
N_ALARM = 14

_FAR = 8.0  # sigmas beyond the volume at which it is not entered at all, and nothing is scored by them


@jit_uncounted
def separation_ahead(
    sx: float, sy: float, sz: float, vx: float, vy: float, vz: float, p: np.ndarray
) -> tuple[float, float, float]:
    """Return time and horizontal and vertical separation at the closest point that algorithms 1 and 2 judge.

    NaN where line 1 of the algorithms does not hold. `p` begins with the rules of `detect`.
    """
    first = detection_time(sx, sy, sz, vx, vy, vz, p[0], p[1], p[2], p[4], p[7])
    if math.isnan(first):
        return math.nan, math.nan, math.nan
    t_cpa = closest_ahead(sx, sy, vx, vy, p[7] + p[2])
    mx, my = sx + vx * t_cpa, sy + vy * t_cpa
    return t_cpa, math.sqrt(mx * mx + my * my), abs(sz + vz * t_cpa)


@jit_uncounted
def alarm_scores(
    i: int,
    sx: float,
    sy: float,
    sz: float,
    vx: float,
    vy: float,
    vz: float,
    covariances: np.ndarray,
    p: np.ndarray,
    scores: np.ndarray,
    own_covariance: np.ndarray,
) -> bool:
    """Write each detector's score for one intruder now; it raises an alarm where the score is below its threshold.

    Parameters
    ----------
    i : int
        The track.
    sx, sy, sz, vx, vy, vz : float
        Relative state, intruder minus ownship, m and m/s.
    covariances : ndarray, shape (n, 9, 9)
    p : ndarray, shape (N_ALARM,) or longer
        The parameters, see the constants.
    scores : ndarray, shape (N_SCORES,)
        Written: the scale of the volume (algorithm 1; threshold 1), the number of sigmas (algorithm 2, twice; threshold
        m1 = m2), the negative decimal logarithm of the probability, more by what EARLY asks.
    own_covariance : ndarray, shape (6, 6)

    Returns
    -------
    bool
        Whether line 1 of the algorithms holds; if not, nothing is written.
    """
    t_cpa, d_cpa, h_cpa = separation_ahead(sx, sy, sz, vx, vy, vz, p)
    if math.isnan(t_cpa):
        return False
    d_over, h_over = d_cpa - p[3], h_cpa - p[4]
    scores[SCALE] = max(d_cpa / p[3], h_cpa / p[4])
    paper_d = paper_sigma(p[NOISE], p[NOISE + 1], t_cpa, 1, False)
    paper_h = paper_sigma(p[NOISE + 2], p[NOISE + 3], t_cpa, 1, False)
    scores[PAPER] = max(d_over / paper_d, h_over / paper_h)
    scores[TRACK] = scores[PROBABILITY] = math.inf
    # No direction of the miss has more than the sum of both axes: most intruders are left here.
    late = t_cpa * t_cpa
    most = covariances[i, 0, 0] + 2.0 * t_cpa * covariances[i, 0, 3] + late * covariances[i, 3, 3]
    most += covariances[i, 1, 1] + 2.0 * t_cpa * covariances[i, 1, 4] + late * covariances[i, 4, 4]
    most += relative_covariance(own_covariance, own_covariance, 0, 0, t_cpa, 0.0)
    most += relative_covariance(own_covariance, own_covariance, 1, 1, t_cpa, 0.0)
    if d_over > 0.0 and d_over * d_over > _FAR * _FAR * most:
        return True
    sigma_d, sigma_h = track_sigmas(sx, sy, vx, vy, own_covariance, covariances[i], t_cpa, t_cpa)
    scores[TRACK] = max(d_over / sigma_d, h_over / sigma_h)
    if d_over < _FAR * sigma_d and h_over < _FAR * sigma_h:
        probability = band_probability(p[3], d_cpa, sigma_d) * band_probability(p[4], h_cpa, sigma_h)
        if probability > 0.0:
            early = p[EARLY] * min(t_cpa / p[EARLY_TIME], 1.0)
            scores[PROBABILITY] = early - math.log10(probability)
    return True


def warmup() -> None:
    """Compile every kernel of this module for the types it is used with."""
    parameters, covariances = np.ones(N_ALARM), np.eye(9)[None].copy()
    separation_ahead(1.0, 1.0, 1.0, -1.0, 0.0, 0.0, parameters)
    alarm_scores(0, 1.0, 1.0, 1.0, -1.0, 0.0, 0.0, covariances, parameters, np.zeros(N_SCORES), np.zeros((6, 6)))
