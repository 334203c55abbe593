"""Four detectors judged side by side: how near each is to an alarm, as a score that its threshold is compared with.

Algorithm 1 on the track as it is; algorithm 2 of the ADS-B paper with its constant sigmas; algorithm 2 with the track's
covariance; and the probability of entering the volume, which is the default.
"""

import math

import numpy as np

from wideberth._jit import jit
from wideberth.conflict.detection_kernels import (
    SIGMA_TRACK,
    band_probability,
    detect,
    detection_time,
    paper_sigma,
    relative_covariance,
)
from wideberth.conflict.kernels import horizontal_cpa

N_SCORES = 4
SCALE, PAPER, TRACK, PROBABILITY = 0, 1, 2, 3

_FAR = 8.0  # sigmas beyond the volume at which it is not entered at all, and nothing is scored by them


@jit
def alarm_scores(
    s: np.ndarray,
    v: np.ndarray,
    covariance: np.ndarray,
    rules: np.ndarray,
    noise: np.ndarray,
    alarm_tau: float,
    row: np.ndarray,
    own_covariance: np.ndarray,
    out: np.ndarray,
) -> bool:
    """Write each detector's score for one intruder now; it raises an alarm where the score is below its threshold.

    Parameters
    ----------
    s, v : ndarray, shape (3,)
        Relative state, intruder minus ownship, m and m/s.
    covariance : ndarray, shape (9, 9)
        Of the track.
    rules : ndarray, shape (8,)
        As for `detect`; m1 and m2 are not used.
    noise : ndarray, shape (4,)
        The paper's constants: sigma of position, velocity, altitude, climb rate.
    alarm_tau : float
        The default looks no farther ahead than this, s.
    row, own_covariance : ndarray, shape (7,), (6, 6)
        Buffer, and the covariance of the ownship.
    out : ndarray, shape (N_SCORES,)
        Written: the scale of the volume (algorithm 1; threshold 1), the number of sigmas (algorithm 2, twice;
        threshold m1 = m2), the negative decimal logarithm of the probability.

    Returns
    -------
    bool
        Whether line 1 of the algorithms holds; if not, all scores are infinite.
    """
    out[:] = math.inf
    first = detection_time(s[0], s[1], s[2], v[0], v[1], v[2], rules[0], rules[1], rules[2], rules[4], rules[7])
    if math.isnan(first):
        return False
    t_cpa, _ = horizontal_cpa(s[0], s[1], v[0], v[1])
    t_cpa = min(max(t_cpa, 0.0), rules[7] + rules[2])
    mx, my = s[0] + v[0] * t_cpa, s[1] + v[1] * t_cpa
    d_cpa, h_cpa = math.sqrt(mx * mx + my * my), abs(s[2] + v[2] * t_cpa)
    d_over, h_over = d_cpa - rules[3], h_cpa - rules[4]
    out[SCALE] = max(d_cpa / rules[3], h_cpa / rules[4])
    paper_d = paper_sigma(noise[0], noise[1], t_cpa, 1, False)
    paper_h = paper_sigma(noise[2], noise[3], t_cpa, 1, False)
    out[PAPER] = max(d_over / paper_d, h_over / paper_h)
    # No direction of the miss has more than the sum of both axes: most intruders are left here.
    most = relative_covariance(own_covariance, covariance, 0, 0, t_cpa, t_cpa)
    most += relative_covariance(own_covariance, covariance, 1, 1, t_cpa, t_cpa)
    if d_over > 0.0 and d_over * d_over > _FAR * _FAR * most:
        return True
    detect(s, v, own_covariance, covariance, 0.0, rules, noise, 1, SIGMA_TRACK, False, row)
    sigma_d, sigma_h = row[5], row[6]
    out[TRACK] = max(d_over / sigma_d, h_over / sigma_h)
    if t_cpa <= alarm_tau and d_over < _FAR * sigma_d and h_over < _FAR * sigma_h:
        probability = band_probability(rules[3], d_cpa, sigma_d) * band_probability(rules[4], h_cpa, sigma_h)
        if probability > 0.0:
            out[PROBABILITY] = -math.log10(probability)
    return True


def warmup() -> None:
    """Compile every kernel of this module for the types it is used with."""
    alarm_scores(
        np.ones(3), -np.ones(3), np.eye(9), np.ones(8), np.ones(4), 60.0, np.empty(7), np.zeros((6, 6)), np.empty(4)
    )
