"""Digital beamforming: power over direction from the channels' covariance, conventional (thesis 4.5) and MVDR.

Directions are given as direction cosines, right and down: a plane array's beams have the same shape over these at all
angles. A spectrum is a trigonometric polynomial whose coefficients are sums of the matrix over pairs of elements that
are equally far apart, which makes it cheap on a grid.
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from wideberth.argument_checks import NOT_NEGATIVE, FloatArray, checked
from wideberth.sensors.radar.array import element_positions
from wideberth.sensors.radar.config import RadarConfig

ComplexArray = NDArray[np.complex128]

_POINTS_A_BEAM = 8


@dataclass(frozen=True, slots=True)
class DirectionGrid:
    """Direction cosines on which spectra are had.

    Attributes
    ----------
    right, down : ndarray, shape (n,) and (m,)
        A single 0 where the array has no extent.
    seen : ndarray of bool, shape (m, n)
        Where the cosines are those of a direction.
    inside : ndarray of bool, shape (m, n)
        The same without the edge: with elements half a wavelength apart a wave from there is one from opposite as well.
    """

    right: FloatArray
    down: FloatArray
    seen: NDArray[np.bool_]
    inside: NDArray[np.bool_]


@lru_cache(maxsize=16)
def direction_grid(config: RadarConfig, points_a_beam: int = _POINTS_A_BEAM) -> DirectionGrid:
    """Return the grid of a radar: an eighth of a beam apart, or as many points a beam as are asked for.

    With elements up to half a wavelength apart it holds all directions ahead; farther apart, where beams repeat, those
    in the field of view.
    """
    wide = config.element_spacing_wavelengths > 0.5
    axes = []
    for elements, field_of_view in (
        (config.array_columns, config.azimuth_fov_deg),
        (config.array_rows, config.elevation_fov_deg),
    ):
        limit = np.sin(np.radians(min(0.5 * field_of_view, 90.0))) if wide else 1.0
        steps = int(np.ceil(limit * elements * config.element_spacing_wavelengths * points_a_beam))
        axes.append(np.linspace(-limit, limit, 2 * steps + 1) if elements > 1 else np.zeros(1))
    right, down = axes
    square = np.add.outer(down**2, right**2)
    return DirectionGrid(right, down, square <= 1.0, square < 1.0)


@lru_cache(maxsize=16)
def _lags(config: RadarConfig, points_a_beam: int) -> tuple[NDArray[np.intp], ComplexArray, ComplexArray]:
    """Return the number of each pair's lag, and the phases of lags along rows and columns on the grid."""
    rows, columns = config.array_rows, config.array_columns
    row, column = np.divmod(np.arange(config.channels), columns)
    lag = (row[:, None] - row + rows - 1) * (2 * columns - 1) + (column[:, None] - column + columns - 1)
    grid, turn = direction_grid(config, points_a_beam), 2j * np.pi * config.element_spacing_wavelengths
    down = np.exp(turn * np.outer(grid.down, np.arange(1 - rows, rows)))
    right = np.exp(turn * np.outer(np.arange(1 - columns, columns), grid.right))
    return lag.ravel(), down, right


def quadratic_spectrum(config: RadarConfig, matrix: ComplexArray, points_a_beam: int = _POINTS_A_BEAM) -> FloatArray:
    """Return a^H Q a over the grid for a Hermitian matrix Q and steering vectors a.

    Parameters
    ----------
    config : RadarConfig
    matrix : ndarray of complex, shape (channels, channels)
    points_a_beam : int
        Of the grid.

    Returns
    -------
    ndarray, shape (down, right) of `direction_grid`

    Raises
    ------
    ValueError
        If the shape is another.
    """
    if matrix.shape != (config.channels, config.channels):
        raise ValueError(f"matrix must have the shape ({config.channels}, {config.channels}), got {matrix.shape}")
    lag, down, right = _lags(config, points_a_beam)
    n = (2 * config.array_rows - 1) * (2 * config.array_columns - 1)
    flat = matrix.ravel()
    sums = np.bincount(lag, flat.real, n) + 1j * np.bincount(lag, flat.imag, n)
    return np.asarray((down @ sums.reshape(2 * config.array_rows - 1, -1) @ right).real)


def conventional_spectrum(
    config: RadarConfig,
    covariance: ComplexArray,
    response: ComplexArray | None = None,
    *,
    points_a_beam: int = _POINTS_A_BEAM,
) -> FloatArray:
    """Return the power w^H R w of beams with weights of unit length matched to each direction (4.5).

    Parameters
    ----------
    config : RadarConfig
    covariance : ndarray of complex, shape (channels, channels)
        The averaged correlation matrix R.
    response : ndarray of complex, shape (channels, channels), optional
        Of the channels, `calibration.ArrayCalibration`; without it they are equal and do not couple.
    points_a_beam : int
        Of the grid.

    Returns
    -------
    ndarray, shape (down, right) of `direction_grid`
        Noise alone has its power in one channel.
    """
    if response is None:
        return quadratic_spectrum(config, covariance, points_a_beam) / config.channels
    turned = response.conj().T
    norm = quadratic_spectrum(config, turned @ response, points_a_beam)
    return quadratic_spectrum(config, turned @ covariance @ response, points_a_beam) / norm


def beam_powers(config: RadarConfig, amplitudes: ComplexArray) -> FloatArray:
    """Return |a^H h|^2 over the grid for the channels' amplitudes h of one echo and steering vectors a.

    Parameters
    ----------
    config : RadarConfig
    amplitudes : ndarray of complex, shape (channels,)

    Returns
    -------
    ndarray, shape (down, right) of `direction_grid`
    """
    # Lag 0 is in the middle of the phases of lags; those of elements are the lags from 0 on.
    _, down, right = _lags(config, _POINTS_A_BEAM)
    h = amplitudes.reshape(config.array_rows, config.array_columns)
    beams = down[:, config.array_rows - 1 :] @ h @ right[config.array_columns - 1 :]
    return np.asarray(beams.real**2 + beams.imag**2)


def mvdr_spectrum(
    config: RadarConfig,
    covariance: ComplexArray,
    response: ComplexArray | None = None,
    *,
    loading: float = 0.0,
    points_a_beam: int = _POINTS_A_BEAM,
) -> FloatArray:
    """Return the power of beams that hold each direction at gain one and let least of all else through (Capon).

    Parameters
    ----------
    config : RadarConfig
    covariance, response, points_a_beam
        As for `conventional_spectrum`.
    loading : float
        Power added to the diagonal: the beams stay steady with few samples and small errors of the response.

    Returns
    -------
    ndarray, shape (down, right) of `direction_grid`
        1 / (a^H R^-1 a): an echo has its power in one channel, noise alone this over the number of channels.

    Raises
    ------
    ValueError
        If the loaded covariance is singular (load it more), or the loading negative.
    """
    loaded = covariance + float(checked("loading", loading, NOT_NEGATIVE)) * np.eye(len(covariance))
    try:
        inverse = np.linalg.inv(loaded)
    except np.linalg.LinAlgError as error:
        raise ValueError("the covariance is singular: average more samples, or give it some loading") from error
    if response is not None:
        inverse = np.asarray(response.conj().T @ inverse @ response, dtype=np.complex128)
    quadratic = quadratic_spectrum(config, np.asarray(inverse, dtype=np.complex128), points_a_beam)
    return 1.0 / np.maximum(quadratic, np.finfo(np.float64).tiny)


def forward_backward(covariance: ComplexArray) -> ComplexArray:
    """Return the mean of a covariance and of that of the array turned end to end.

    Two echoes that keep their phases to each other look like one wave from neither direction; turned around, the phase
    between them is another, and in the mean they are two again, unless that phase is 0 or half a turn. For channels
    that are equal and do not couple (`ArrayCalibration.apply` makes them so).

    Parameters
    ----------
    covariance : ndarray of complex, shape (channels, channels)

    Returns
    -------
    ndarray, of the same shape
    """
    return 0.5 * (covariance + covariance[::-1, ::-1].conj())


def spectrum_peaks(config: RadarConfig, spectrum: FloatArray, least: float) -> FloatArray:
    """Return where a spectrum is greater than all around it and than `least`, highest first.

    With elements half a wavelength apart the spectrum goes on from one edge of the grid at the other, where it is that
    of the same waves: the flank of a peak beside one edge is no peak at the other.

    Parameters
    ----------
    config : RadarConfig
    spectrum : ndarray, shape (down, right) of `direction_grid`
    least : float

    Returns
    -------
    ndarray, shape (peaks, 2)
        Direction cosines, right and down. A peak that noise took a little beyond all directions is given at the
        direction beside it.
    """
    grid = direction_grid(config)
    m, n = spectrum.shape
    goes_on = [_is_period(config, axis) for axis in (grid.down, grid.right)]
    padded = np.full((m + 2, n + 2), -np.inf)
    padded[1:-1, 1:-1] = spectrum
    # First and last are one place: what lies before the first is the last but one.
    if goes_on[0]:
        padded[0], padded[-1] = padded[-3], padded[2]
    if goes_on[1]:
        padded[:, 0], padded[:, -1] = padded[:, -3], padded[:, 2]
    around = [padded[1 + i : 1 + i + m, 1 + j : 1 + j + n] for i in (-1, 0, 1) for j in (-1, 0, 1) if (i, j) != (0, 0)]
    peaks = (spectrum > np.max(around, axis=0)) & (spectrum >= least)
    if goes_on[0]:
        peaks[-1] = False
    if goes_on[1]:
        peaks[:, -1] = False
    found = np.argwhere(peaks)
    found = found[np.argsort(-spectrum[peaks])]
    seen = [_direction_beside(grid, spectrum, i, j, goes_on) for i, j in found.tolist()]
    return np.array([place for place in seen if place is not None], np.float64).reshape(-1, 2)


def _is_period(config: RadarConfig, axis: FloatArray) -> bool:
    """Return whether beams repeat from one end of an axis of the grid to the other."""
    return len(axis) > 1 and math.isclose((axis[-1] - axis[0]) * config.element_spacing_wavelengths, 1.0)


def _direction_beside(
    grid: DirectionGrid, spectrum: FloatArray, i: int, j: int, goes_on: list[bool]
) -> tuple[float, float] | None:
    """Return the cosines, right and down, of a peak, or of the direction at most half a beam beside it, if any."""
    if grid.inside[i, j]:
        return float(grid.right[j]), float(grid.down[i])
    away = []
    for k, size, periodic in ((i, len(grid.down), goes_on[0]), (j, len(grid.right), goes_on[1])):
        steps = np.abs(np.arange(size) - k)
        away.append(np.minimum(steps, size - 1 - steps) if periodic else steps)
    distance = np.where(grid.inside, np.hypot(away[0][:, None], away[1]), np.inf)
    nearest = float(distance.min())
    if nearest > 0.5 * _POINTS_A_BEAM:
        return None
    # On either side of the grid's edge: the higher is on the side of the echo.
    beside = np.where(distance <= nearest + 0.5, spectrum, -np.inf)
    down, right = np.unravel_index(int(np.argmax(beside)), beside.shape)
    return float(grid.right[right]), float(grid.down[down])


@lru_cache(maxsize=16)
def places_in_wavelengths(config: RadarConfig) -> FloatArray:
    """Return where the elements stand, right and down in wavelengths, shape (channels, 2)."""
    return np.ascontiguousarray(element_positions(config)[:, 1:] / config.wavelength)
