"""The motion model of one axis: jerk driven by white noise, jerk and acceleration dying away or not.

ADS-B paper, section "ADS-B Signal Processing" (constant jerk, after Mehrotra and Mahapatra 1997); with time constants
the acceleration and jerk decay as in Singer's model, which extrapolates far better.
"""

import math

import numpy as np

from wideberth.types import FloatArray


def axis_model(
    dt: float, spectral_density: float, acceleration_time_constant: float, jerk_time_constant: float
) -> tuple[FloatArray, FloatArray]:
    """Return the exact transition and process noise of one axis over a step (Van Loan 1978).

    Parameters
    ----------
    dt : float
        Step, s.
    spectral_density : float
        Of the white noise on the jerk's rate, m2/s7.
    acceleration_time_constant, jerk_time_constant : float
        s; infinite for the constant-jerk model as printed.

    Returns
    -------
    tuple of ndarray, shape (4, 4)
        States in the order position, velocity, acceleration, jerk.

    Raises
    ------
    ValueError
        If the step or a time constant is not positive, or the density is negative.
    """
    if not (dt > 0.0 and acceleration_time_constant > 0.0 and jerk_time_constant > 0.0 and spectral_density >= 0.0):
        raise ValueError("give a positive step, positive time constants and a density that is not negative")
    f = np.diag([1.0, 1.0, 1.0], 1)
    f[2, 2] = -1.0 / acceleration_time_constant if math.isfinite(acceleration_time_constant) else 0.0
    f[3, 3] = -1.0 / jerk_time_constant if math.isfinite(jerk_time_constant) else 0.0
    g = np.zeros((4, 4))
    g[3, 3] = spectral_density
    block = np.block([[-f, g], [np.zeros((4, 4)), f.T]]) * dt
    term = total = np.eye(8)
    n = 0
    while np.max(np.abs(term)) > 1e-20 * np.max(np.abs(total)) and n < 400:
        n += 1
        term = term @ block / n
        total = total + term
    phi = total[4:, 4:].T.copy()
    noise = phi @ total[:4, 4:]
    return phi, 0.5 * (noise + noise.T)


def model_tables(phi: FloatArray, noise: FloatArray, count: int) -> tuple[FloatArray, FloatArray]:
    """Return the transitions and process noises (count, 4, 4) of 1, 2, ..., `count` steps of the same model."""
    phis, noises = np.empty((count, 4, 4)), np.empty((count, 4, 4))
    phis[0], noises[0] = phi, noise
    for i in range(1, count):
        phis[i] = phi @ phis[i - 1]
        noises[i] = phi @ noises[i - 1] @ phi.T + noise
    return phis, noises
