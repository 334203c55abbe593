"""The receiving array: where its elements stand, and the phases that a wave from some direction has there.

The sensor's axes are forward (along boresight, at right angles to the array), right and down; azimuth is clockwise from
forward in the plane of forward and right, elevation above that plane. An array that looks straight up is a sensor
whose forward axis points up: angles stay well defined around its boresight.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wideberth.argument_checks import FINITE, FloatArray, checked
from wideberth.sensors.radar.config import RadarConfig


def element_positions(config: RadarConfig) -> FloatArray:
    """Return where the receiving elements stand, around the middle of the array.

    Parameters
    ----------
    config : RadarConfig

    Returns
    -------
    ndarray, shape (channels, 3)
        Forward, right, down, m; channel ``row * columns + column``, rows from the top, columns from the left.
    """
    spacing = config.element_spacing_wavelengths * config.wavelength
    right = spacing * (np.arange(config.array_columns) - 0.5 * (config.array_columns - 1))
    down = spacing * (np.arange(config.array_rows) - 0.5 * (config.array_rows - 1))
    places = np.zeros((config.array_rows, config.array_columns, 3))
    places[..., 1], places[..., 2] = right, down[:, None]
    return places.reshape(-1, 3)


def steering_vector(config: RadarConfig, azimuth: ArrayLike, elevation: ArrayLike = 0.0) -> NDArray[np.complex128]:
    """Return the phases of a far target's echo at the elements, as factors of magnitude 1.

    An element nearer to the target receives the echo earlier, which in the beat signal of an FMCW radar, transmitted
    wave times conjugated echo, is a lag: the factor is exp(-2 pi i u.p / wavelength) with the unit vector u towards the
    target and the element's place p.

    Parameters
    ----------
    config : RadarConfig
    azimuth, elevation : array_like
        rad. They broadcast.

    Returns
    -------
    ndarray, shape (..., channels)

    Raises
    ------
    ValueError
        If an angle is not finite.
    """
    az, el = np.broadcast_arrays(checked("azimuth", azimuth, FINITE), checked("elevation", elevation, FINITE))
    towards = np.stack([np.cos(el) * np.cos(az), np.cos(el) * np.sin(az), -np.sin(el)], axis=-1)
    return np.asarray(np.exp(-2j * np.pi / config.wavelength * (towards @ element_positions(config).T)))
