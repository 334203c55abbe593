"""Ground clutter of a radar at rest: scatterers all round it, the same in every frame."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from wideberth.argument_checks import FINITE, NOT_NEGATIVE, POSITIVE, PROBABILITY, FloatArray, checked
from wideberth.sensors.radar.array import steering_vector
from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.link_budget import pattern_loss_db
from wideberth.sensors.radar.sweeps.beats import amplitude_at_a_metre
from wideberth.sensors.radar.sweeps.paths import levelling
from wideberth.sensors.radar.sweeps.receiver import Samples, channel_response, if_response

_PER_BIN = 4  # places of scatterers in a range bin
_PER_PLACE = 2  # scatterers in each, at any azimuths


@dataclass(frozen=True)
class GroundClutter:
    """Flat ground by the constant-gamma model: a square metre has the cross-section gamma times sin(grazing angle).

    Many scatterers in a cell make amplitudes Rayleigh distributed, which a Gamma distributed texture turns into the K
    distribution. Elements hear the ground through the lobe of the link budget, which has no side lobes.

    Attributes
    ----------
    radar_height : float
        Above the ground, m.
    gamma_db : float
        dBsm a square metre at normal incidence. At 10 GHz farmland has about -15, wooded hills -10, and desert or
        roads -20 (Barton, "Modern Radar System Analysis", 1988, chapter 3).
    texture_shape : float or None
        Shape of the Gamma distribution of the mean power of a range bin (1 is spiky, 10 nearly even); None: even.
    moving_share : float
        Share of each scatterer's power that moves in the wind.
    moving_speed : float
        Standard deviation of radial speeds of what moves, m/s: about 0.1 in light air, 0.3 in a gale.
    seed : int
        The ground: the same seed is the same ground.

    Raises
    ------
    ValueError
        If a number is not finite, or outside of what is said above.
    """

    radar_height: float
    gamma_db: float = -15.0
    texture_shape: float | None = None
    moving_share: float = 0.0
    moving_speed: float = 0.1
    seed: int = 0

    def __post_init__(self) -> None:
        checked("radar_height", self.radar_height, POSITIVE)
        checked("gamma_db", self.gamma_db, FINITE)
        if self.texture_shape is not None:
            checked("texture_shape", self.texture_shape, POSITIVE)
        checked("moving_share", self.moving_share, PROBABILITY)
        checked("moving_speed", self.moving_speed, NOT_NEGATIVE)


@dataclass(frozen=True)
class _Ground:
    """Scatterers: amplitudes (places, scatterers, channels), V, phases, cycles, and radial speeds of what moves."""

    amplitude: NDArray[np.complex64]
    phase: FloatArray
    speed: FloatArray


def clutter_samples(config: RadarConfig, clutter: GroundClutter, start_time: float, n_sweeps: int) -> Samples:
    """Return the beat signals of the ground behind coupling and IF filter.

    Scatterers stand at every quarter of a range bin, as far as the instrumented range; what moves does so from sweep
    to sweep.

    Parameters
    ----------
    config : RadarConfig
    clutter : GroundClutter
    start_time : float
        Of the first sweep, s.
    n_sweeps : int

    Returns
    -------
    ndarray of float32 or complex64, shape (n_sweeps, channels, samples), or (1, channels, samples) if nothing moves
        V.
    """
    if clutter.moving_share == 0.0 or clutter.moving_speed == 0.0:
        return _still_samples(config, clutter)
    ground = _ground(config, clutter)
    still, moving = np.sqrt(1.0 - clutter.moving_share), np.sqrt(clutter.moving_share)
    sweeps = []
    for sweep in range(n_sweeps):
        t = start_time + sweep * config.sweep_interval
        turned = np.exp(2j * np.pi * (ground.phase + 2.0 * t / config.wavelength * ground.speed))
        factor = (still + moving * turned).astype(np.complex64)
        sweeps.append(_samples(config, np.einsum("ps,psc->cp", factor, ground.amplitude)))
    return np.stack(sweeps)


@lru_cache(maxsize=4)
def _still_samples(config: RadarConfig, clutter: GroundClutter) -> Samples:
    samples = _samples(config, _ground(config, clutter).amplitude.sum(axis=1).T)
    samples.flags.writeable = False  # it is kept, and the same for everybody
    return samples[None]


def _samples(config: RadarConfig, spectrum: NDArray[np.complex64]) -> Samples:
    """Return the samples (channels, n) of beats at quarters of a bin (channels, places)."""
    n = config.samples_per_sweep
    long = _PER_BIN * n
    if config.sampling == "real":
        # A beat of power P is a cosine of amplitude sqrt(2 P).
        return np.asarray(fft.irfft(spectrum, long, axis=-1)[:, :n] * np.float32(long / np.sqrt(2.0)), dtype=np.float32)
    return np.asarray(fft.ifft(spectrum, long, axis=-1)[:, :n] * np.float32(long), dtype=np.complex64)


@lru_cache(maxsize=4)
def _ground(config: RadarConfig, clutter: GroundClutter) -> _Ground:
    rng = np.random.default_rng(clutter.seed)
    places = _PER_BIN * config.range_bins
    shape = (places, _PER_PLACE)
    distance = np.arange(places) * (config.range_bin / _PER_BIN)
    texture = np.ones(config.range_bins)
    if clutter.texture_shape is not None:
        texture = rng.gamma(clutter.texture_shape, 1.0 / clutter.texture_shape, config.range_bins)
    around = rng.uniform(-np.pi, np.pi, shape)
    scatter = (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2.0)
    phase, speed = rng.random(shape), clutter.moving_speed * rng.standard_normal(shape)

    seen = distance > clutter.radar_height
    sine = clutter.radar_height / np.where(seen, distance, np.inf)
    # The ground within a step of range is a ring of area 2 pi r dr, whatever the height.
    area = 2.0 * np.pi * distance * config.range_bin / _PER_BIN
    rcs = 10.0 ** (clutter.gamma_db / 10.0) * sine * area / _PER_PLACE * np.repeat(texture, _PER_BIN)
    cosine = np.sqrt(1.0 - sine**2)[:, None]
    level = np.stack([cosine * np.cos(around), cosine * np.sin(around), np.broadcast_to(sine[:, None], shape)], axis=-1)
    towards = level @ levelling(np.radians(config.boresight_elevation_deg))
    azimuth, elevation = np.arctan2(towards[..., 1], towards[..., 0]), np.arcsin(np.clip(-towards[..., 2], -1.0, 1.0))
    strength = amplitude_at_a_metre(config) * np.sqrt(rcs) / np.where(seen, distance, np.inf) ** 2
    strength = strength * if_response(config, distance / config.range_bin / (config.sweep_time_ms * 1e-3))
    strength = strength[:, None] * 10.0 ** (-pattern_loss_db(azimuth, elevation, config) / 10.0)
    amplitude = (strength * scatter)[..., None] * (
        steering_vector(config, azimuth, elevation) @ channel_response(config).T
    )
    return _Ground(amplitude.astype(np.complex64), phase, speed)
