"""Probability of detecting a target in averaged powers that are compared with a threshold.

The sum of `looks` powers of unit-mean exponential noise is Gamma distributed. With a target of a given cross-section it
is noncentral chi-square (Swerling 0, "Marcum"); over a cross-section that is drawn once for all looks, exponential
(Swerling 1) or chi-square with four degrees of freedom (Swerling 3), the integrals are closed. Nothing is approximated;
rounding stays below 1e-9 up to 4096 looks, and below 1e-7 up to 100,000.
"""

import numpy as np
from numpy.typing import ArrayLike
from scipy import special, stats

from wideberth.argument_checks import COUNT, FINITE, UNSURE, FloatArray, checked, choice

SWERLING = (0, 1, 3)
_LOWEST_DB, _HIGHEST_DB = -150.0, 250.0
_BISECTIONS = 60


def threshold(p_fa: ArrayLike, looks: ArrayLike = 1) -> FloatArray:
    """Return the threshold on the mean of powers, in units of the mean noise power (thesis 4.4 is that of one look).

    Parameters
    ----------
    p_fa : array_like
        Probability that noise alone exceeds it. The arrays broadcast.
    looks : array_like
        Number of independent powers in the mean: channels times averages.

    Returns
    -------
    ndarray
        1 is the mean noise power.

    Raises
    ------
    ValueError
        If a probability is not inside 0 to 1, or a number of looks not whole and at least 1.
    """
    n = checked("looks", looks, COUNT)
    return np.asarray(special.gammainccinv(n, checked("p_fa", p_fa, UNSURE)) / n)


def detection_probability(snr_db: ArrayLike, p_fa: ArrayLike, swerling: int = 1, *, looks: ArrayLike = 1) -> FloatArray:
    """Return the probability that the mean of powers exceeds the threshold.

    Parameters
    ----------
    snr_db : array_like
        Signal-to-noise ratio of each look, with the mean cross-section, dB. The arrays broadcast.
    p_fa : array_like
        Probability of a false alarm, which sets the threshold.
    swerling : {0, 1, 3}
        Fluctuation of the cross-section, the same in all looks.
    looks : array_like
        Number of independent powers in the mean.

    Returns
    -------
    ndarray
        From `p_fa` without a signal to 1.

    Raises
    ------
    ValueError
        If a ratio is not finite, a probability not inside 0 to 1, a number of looks not whole and at least 1, or
        `swerling` not one of the three.
    """
    choice("swerling", swerling, SWERLING)
    snr = 10.0 ** (np.clip(checked("snr_db", snr_db, FINITE), _LOWEST_DB, _HIGHEST_DB) / 10.0)
    false_alarm = checked("p_fa", p_fa, UNSURE)
    n = checked("looks", looks, COUNT)
    # Not broadcast: one threshold is usually for many ratios, and it is slow to find.
    level = special.gammainccinv(n, false_alarm)
    if swerling == 0:
        return np.asarray(_steady(snr, false_alarm, n, level))
    return np.asarray(np.clip(_fluctuating(snr, n, level, swerling), false_alarm, 1.0))


def _steady(snr: FloatArray, false_alarm: FloatArray, n: FloatArray, level: FloatArray) -> FloatArray:
    # So far beyond the threshold that the probability is 1 to the last digit; the series need not be summed there.
    mean, spread = n * (1.0 + snr), np.sqrt(n * (1.0 + 2.0 * snr))
    sure = mean - level > 40.0 * spread + 40.0
    found = stats.ncx2.sf(2.0 * level, 2.0 * n, np.where(sure, 1.0, 2.0 * n * snr))
    return np.asarray(np.where(sure, 1.0, np.clip(found, false_alarm, 1.0)))


def _fluctuating(snr: FloatArray, n: FloatArray, level: FloatArray, swerling: int) -> FloatArray:
    """Return the probability for Swerling 1 or 3.

    With m = n snr and b = m / (1 + m) that of Swerling 1 is Q(n-1, T) + g, where g = b^-(n-1) exp(-T (1-b)) P(n-1, T b)
    and P and Q are the regularized incomplete Gamma functions. Averaging over another Gamma variable of shape 2 makes
    Swerling 3 the sum of that and of its derivative by the logarithm of the mean, at half of it.
    """
    m = n * snr / (1.0 if swerling == 1 else 2.0)
    b, rest = m / (1.0 + m), 1.0 / (1.0 + m)
    few = n - 1.0  # 0 for one look, where P is 1 and Q is 0
    below = np.where(few > 0, few, 1.0)
    log_p = np.where(few > 0, _log_lower_gamma(below, level * b), 0.0)
    g = np.exp(log_p - few * np.log(b) - level * rest)
    tail = np.where(few > 0, special.gammaincc(below, level), 0.0)
    if swerling == 1:
        return np.asarray(tail + g)
    density = np.where(few > 0, np.exp(special.xlogy(few, level) - level - special.gammaln(below)), 0.0)
    return np.asarray(tail + g + rest * (g * (level * b - few) + density))


def _log_lower_gamma(a: FloatArray, x: FloatArray) -> FloatArray:
    """Return log P(a, x), also where P itself is too small for a number."""
    plain = special.gammainc(a, x)
    small = plain < 1e-280
    y = np.where(small, x, 1.0)
    # x^a exp(-x) / Gamma(a+1) * (1 + x/(a+1) + ...)
    series = (
        a * np.log(y) - y - special.gammaln(a + 1.0) + np.log(special.hyp1f1(1.0, a + 1.0, np.where(small, y, 0.0)))
    )
    return np.asarray(np.where(small, series, np.log(np.where(small, 1.0, plain))))


def required_snr_db(p_d: ArrayLike, p_fa: ArrayLike, swerling: int = 1, *, looks: ArrayLike = 1) -> FloatArray:
    """Return the signal-to-noise ratio of each look at which a target is detected with a probability.

    Parameters
    ----------
    p_d, p_fa : array_like
        Probabilities of detection and of a false alarm. The arrays broadcast.
    swerling : {0, 1, 3}
    looks : array_like
        Number of independent powers in the mean.

    Returns
    -------
    ndarray
        dB.

    Raises
    ------
    ValueError
        If a probability is not inside 0 to 1, `p_d` not above `p_fa`, or another argument wrong as in
        `detection_probability`.
    """
    wanted, false_alarm = checked("p_d", p_d, UNSURE), checked("p_fa", p_fa, UNSURE)
    if not np.all(wanted > false_alarm):
        raise ValueError("p_d must be more than p_fa")
    shape = np.broadcast_shapes(wanted.shape, false_alarm.shape, checked("looks", looks, COUNT).shape)
    low, high = np.full(shape, _LOWEST_DB), np.full(shape, _HIGHEST_DB)
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        enough = detection_probability(middle, false_alarm, swerling, looks=looks) >= wanted
        low, high = np.where(enough, low, middle), np.where(enough, middle, high)
    return np.asarray(high)
