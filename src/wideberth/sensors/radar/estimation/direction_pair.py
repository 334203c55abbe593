"""Two directions in the amplitudes of the channels of what range and range rate show as one echo.

Two echoes of the same range and range rate keep their phase to each other, and make one wave front, which is that of
neither. Averaging forward and backward over the array gives MVDR a second direction but for phases between them near
none and half a turn. The wave front itself is then the only witness: the pair of waves of most likelihood is fitted to
it, as it stands, which needs channels that are known well.
"""

import numpy as np
from numpy.typing import NDArray

from wideberth.argument_checks import FloatArray
from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.estimation.beamforming import direction_grid, places_in_wavelengths

ComplexArray = NDArray[np.complex128]

_STEPS, _HALVINGS = 20, 5
_WITHIN = 1.2  # beamwidths from the single direction in which the pair is looked for
_LONGEST = 0.1  # step of a direction cosine
_ALIKE = 0.999  # of two waves, from which on they are one
_SETTLED = 1e-7


def single_misfit(h: ComplexArray, wave: ComplexArray) -> float:
    """Return the energy in the channels' amplitudes `h` (channels,) that a wave leaves unexplained."""
    return float(np.vdot(h, h).real - abs(np.vdot(wave, h)) ** 2 / np.vdot(wave, wave).real)


def direction_pair(
    config: RadarConfig, h: ComplexArray, response: ComplexArray, single: FloatArray
) -> tuple[FloatArray, ComplexArray, float]:
    """Return the two directions that explain most of the channels' amplitudes, and the energy that they leave.

    Parameters
    ----------
    config : RadarConfig
    h : ndarray of complex, shape (channels,)
        With the same noise in all channels.
    response : ndarray of complex, shape (channels, channels)
        Of the channels to the phases of a wave.
    single : ndarray, shape (2,)
        Direction cosines (right, down) of the one wave that explains most: the pair is looked for around it.

    Returns
    -------
    directions : ndarray, shape (2, 2)
        Direction cosines right and down of each.
    amplitudes : ndarray of complex, shape (2,)
    left : float
        In units of `h` squared.
    """
    start = _best_on_grid(config, h, response, single)
    axes = [k for k, n in enumerate((config.array_columns, config.array_rows)) if n > 1]
    places = places_in_wavelengths(config)
    found, left, gradient, curvature = _fitted(h, response, places, start, axes)
    for _ in range(_STEPS):
        step = np.linalg.lstsq(curvature, gradient, rcond=1e-12)[0]
        step *= min(1.0, _LONGEST / max(float(np.abs(step).max()), 1e-300))
        for _ in range(_HALVINGS):
            tried = found.copy()
            tried[:, axes] += step.reshape(2, -1)
            if np.all(np.square(tried).sum(axis=1) < 1.0):
                _, after, *rest = _fitted(h, response, places, tried, axes)
                if after < left:
                    break
            step = 0.5 * step
        else:
            break
        found, left, (gradient, curvature) = tried, after, rest
        if np.abs(step).max() < _SETTLED:
            break
    waves = response @ np.exp(-2j * np.pi * (places @ found.T))
    amplitudes: ComplexArray = np.linalg.lstsq(waves, h, rcond=None)[0].astype(np.complex128)
    return found, amplitudes, left


def _best_on_grid(config: RadarConfig, h: ComplexArray, response: ComplexArray, single: FloatArray) -> FloatArray:
    """Return the pair on a grid, a quarter of a beam apart, with most of the energy."""
    grid = direction_grid(config)
    cosines = []
    for axis, middle, n in (
        (grid.right, single[0], config.array_columns),
        (grid.down, single[1], config.array_rows),
    ):
        near = axis[np.abs(axis - middle) <= _WITHIN / (n * config.element_spacing_wavelengths)] if n > 1 else axis
        cosines.append(near[::2] if config.array_rows > 1 and config.array_columns > 1 else near)
    right, down = (c.ravel() for c in np.meshgrid(*cosines))
    seen = right**2 + down**2 < 1.0
    points = np.stack([right[seen], down[seen]], axis=1)
    waves = response @ np.exp(-2j * np.pi * (places_in_wavelengths(config) @ points.T))
    g, cross = waves.conj().T @ h, waves.conj().T @ waves
    size = cross.diagonal().real
    i, j = np.triu_indices(len(points), 1)
    own, shared = size[i] * size[j], np.abs(cross[i, j]) ** 2
    energy = np.abs(g[i]) ** 2 * size[j] + np.abs(g[j]) ** 2 * size[i] - 2.0 * (g[i].conj() * cross[i, j] * g[j]).real
    apart = shared < _ALIKE * own
    best = int(np.argmax(np.where(apart, energy / np.where(apart, own - shared, 1.0), -1.0)))
    return points[[i[best], j[best]]]


def _fitted(
    h: ComplexArray, response: ComplexArray, places: FloatArray, cosines: FloatArray, axes: list[int]
) -> tuple[FloatArray, float, FloatArray, FloatArray]:
    """Return the cosines, what is left of `h`, and gradient and curvature of that by the cosines that can vary."""
    phases = np.exp(-2j * np.pi * (places @ cosines.T))
    waves = response @ phases
    amplitudes = np.linalg.lstsq(waves, h, rcond=None)[0]
    rest = h - waves @ amplitudes
    slopes = [response @ (-2j * np.pi * places[:, a] * phases[:, k]) * amplitudes[k] for k in (0, 1) for a in axes]
    slope = np.stack(slopes, axis=1)
    slope -= waves @ np.linalg.lstsq(waves, slope, rcond=None)[0]
    left = float(np.vdot(rest, rest).real)
    return cosines, left, (slope.conj().T @ rest).real, (slope.conj().T @ slope).real
