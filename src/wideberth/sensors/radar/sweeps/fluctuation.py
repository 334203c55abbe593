"""Fluctuation of a radar cross-section from scan to scan (Swerling 1 and 3)."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wideberth.argument_checks import choice
from wideberth.sensors.radar.detection import SWERLING


def draw_fluctuation(swerling: ArrayLike, rng: np.random.Generator) -> NDArray[np.complex128]:
    """Return one factor of the echo's amplitude for each target, which holds for all sweeps of a scan.

    The power of the factor is 1 on average: always 1 without fluctuation (0), exponential for many equal scatterers
    (1), Gamma distributed with shape 2 for one large scatterer among small ones (3). An echo that fluctuates has a
    random phase, too.

    Parameters
    ----------
    swerling : array_like of {0, 1, 3}, shape (n,)
    rng : numpy.random.Generator
        What a target gets does not depend on those after it, nor on their models.

    Returns
    -------
    ndarray, shape (n,)

    Raises
    ------
    ValueError
        If `swerling` is not one of the three.
    """
    models = np.asarray(swerling)
    for model in models.flat:
        choice("swerling", model, SWERLING)
    drawn = rng.random((*models.shape, 3))
    parts = -np.log1p(-drawn[..., :2])  # exponential
    power = np.where(models == 1, parts[..., 0], 0.5 * parts.sum(axis=-1))
    return np.asarray(np.where(models == 0, 1.0, np.sqrt(power) * np.exp(2j * np.pi * drawn[..., 2])))
