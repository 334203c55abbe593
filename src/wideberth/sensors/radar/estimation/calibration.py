"""What the receiving channels really make of a wave: gains, phases and coupling, from echoes of known directions.

Channels that couple (thesis table 5.1: about -20 dB) answer a wave of the phases a, `array.steering_vector`, with C a
and not with a. The matrix C has the gains and phases of the channels in its diagonal. Its scale is not observable.
"""

import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wideberth.argument_checks import FINITE, POSITIVE, checked
from wideberth.errors import InputError
from wideberth.sensors.radar.array import steering_vector
from wideberth.sensors.radar.config import RadarConfig

ComplexArray = NDArray[np.complex128]

_ITERATIONS = 200
_TOLERANCE = 1e-12


@dataclass(frozen=True, slots=True)
class ArrayCalibration:
    """The response of the channels.

    Attributes
    ----------
    response : ndarray of complex, shape (channels, channels)
        The channels' samples are `response` times the steering vector of an echo.
    """

    response: ComplexArray

    def __post_init__(self) -> None:
        shape = self.response.shape
        if len(shape) != 2 or shape[0] != shape[1] or not np.isfinite(self.response).all():
            raise ValueError(f"response must be a square matrix of finite numbers, got shape {shape}")

    @classmethod
    def ideal(cls, channels: int) -> Self:
        """Return that of equal channels that do not couple."""
        return cls(np.eye(channels, dtype=np.complex128))

    def apply(self, samples: NDArray[np.complexfloating]) -> ComplexArray:
        """Return the samples that equal channels without coupling would have.

        Parameters
        ----------
        samples : ndarray of complex, shape (channels, ...)

        Returns
        -------
        ndarray, of the same shape
        """
        flat = np.asarray(samples, dtype=np.complex128).reshape(len(samples), -1)
        return np.asarray(np.linalg.solve(self.response, flat).reshape(samples.shape), dtype=np.complex128)

    def save(self, path: Path) -> None:
        """Write the calibration to an npz file."""
        with path.open("wb") as file:
            np.savez(file, response=self.response)

    @classmethod
    def load(cls, path: Path) -> Self:
        """Read a calibration that `save` wrote.

        Raises
        ------
        InputError
            If there is no such file, or it is no such calibration.
        """
        if not path.is_file():
            raise InputError(f"{path}: no such file")
        try:
            with np.load(path, allow_pickle=False) as file:
                return cls(np.asarray(file["response"], dtype=np.complex128))
        except (OSError, KeyError, TypeError, ValueError, EOFError, AttributeError, zipfile.BadZipFile) as error:
            raise InputError(
                f"{path} is not a calibration of an array: write one with ArrayCalibration.save"
            ) from error


def calibrate(
    config: RadarConfig,
    amplitudes: NDArray[np.complexfloating],
    azimuth: ArrayLike,
    elevation: ArrayLike = 0.0,
    *,
    noise_power: float = 0.0,
    coupling_db: float = -20.0,
) -> ArrayCalibration:
    """Estimate gains, phases and coupling from echoes of known directions and of unknown strength and phase.

    Least squares, in turn over the response and over the echoes' amplitudes. Directions that do not span all
    steering vectors leave parts of the coupling open: those stay at zero, as each coefficient of the coupling is held
    towards zero as far as the noise asks.

    Parameters
    ----------
    config : RadarConfig
    amplitudes : ndarray of complex, shape (echoes, channels)
        Of each echo in the channels, from as many directions as there are channels at least.
    azimuth, elevation : array_like, shape (echoes,)
        Their directions, rad.
    noise_power : float
        Of the noise in `amplitudes`.
    coupling_db : float
        Power of the coupling between two channels that is expected.

    Returns
    -------
    ArrayCalibration
        The mean magnitude of the diagonal is 1, and the first channel's phase 0.

    Raises
    ------
    ValueError
        If the shapes do not fit, a number is not finite, or the echoes are too few.
    """
    h = np.asarray(amplitudes, dtype=np.complex128)
    if h.ndim != 2 or h.shape[1] != config.channels or not np.isfinite(h).all():
        raise ValueError(f"amplitudes must be finite, of shape (echoes, {config.channels}), got {h.shape}")
    if len(h) < config.channels:
        raise ValueError(f"{len(h)} echoes do not calibrate {config.channels} channels: give at least as many echoes")
    a = np.broadcast_to(steering_vector(config, azimuth, elevation), h.shape)
    off = checked("noise_power", noise_power, FINITE) / 10.0 ** (coupling_db / 10.0)
    checked("power of an echo", np.mean(np.abs(h) ** 2, axis=1), POSITIVE)
    strength = np.einsum("ij,ij->i", a.conj(), h) / config.channels
    response = np.eye(config.channels, dtype=np.complex128)
    for _ in range(_ITERATIONS):
        model = strength[:, None] * a
        gram = model.conj().T @ model
        power = np.trace(gram).real / config.channels
        before, response = response, np.empty_like(response)
        for c in range(config.channels):
            held = np.full(config.channels, off + 1e-9 * power)
            held[c] = 0.0
            response[c] = np.linalg.solve(gram + np.diag(held), model.conj().T @ h[:, c])
        response *= np.exp(-1j * np.angle(response[0, 0])) / np.mean(np.abs(np.diag(response)))
        e = a @ response.T
        strength = np.einsum("ij,ij->i", e.conj(), h) / np.einsum("ij,ij->i", e.conj(), e).real
        if np.max(np.abs(response - before)) < _TOLERANCE:
            break
    return ArrayCalibration(response)
