"""The plots of one look of a radar by way of its samples: echoes of all aircraft in view, then the processing."""

from collections.abc import Mapping
from functools import lru_cache
from itertools import repeat

import numpy as np
from numpy.typing import NDArray

from wideberth.sensors.radar.config import RadarConfig, SimulatedRadarConfig
from wideberth.sensors.radar.estimation.calibration import ArrayCalibration
from wideberth.sensors.radar.plot_model import FloatArray, PlotModel, plot_sigmas, polar
from wideberth.sensors.radar.processing.noise_statistics import NoiseStatistics, noise_statistics
from wideberth.sensors.radar.processing.radar_processor import RadarProcessor
from wideberth.sensors.radar.sweeps.fluctuation import draw_fluctuation
from wideberth.sensors.radar.sweeps.paths import RadarTarget
from wideberth.sensors.radar.sweeps.receiver import Samples, channel_response
from wideberth.sensors.radar.sweeps.simulate import simulate_frames, simulate_sweeps

_NOISE_SEED = 400
"""Of the noise run before the start: the same for all runs, as a radar is calibrated once."""

_NEAREST = 2.0
"""Aircraft closer than this times what they move in a frame are left out: they would fly through the radar."""


class SampledLook:
    """One unit of a radar at the level of samples; the noise level is followed from look to look.

    Parameters
    ----------
    config : SimulatedRadarConfig
    model : PlotModel
        Says which aircraft are in view, and what the plots of a burst are.
    name : str
        Of the unit.
    """

    def __init__(self, config: SimulatedRadarConfig, model: PlotModel, name: str) -> None:
        self._config, self._model = config, model
        noise = measured_noise(config, config.noise_run_frames) if config.noise_run_frames else None
        self._name, self._noise = name, noise
        self._calibration = ArrayCalibration(channel_response(config)) if config.calibrated else None
        self._processor: RadarProcessor | None = None
        self.state = "ok"

    @property
    def rejects(self) -> Mapping[str, int]:
        """What was left out since the start, by cause (see `RadarProcessor`)."""
        return {} if self._processor is None else dict(self._processor.rejects)

    def visible(self, positions: FloatArray) -> NDArray[np.bool_]:
        """Return which aircraft (k, 3), in the sensor's axes, m, are in view: an array sees nothing behind it."""
        return self._model.visible(positions) & (positions[:, 0] > 0.0)

    def samples(
        self, random: np.random.Generator, positions: FloatArray, velocities: FloatArray, rcs_m2: FloatArray
    ) -> Samples:
        """Return the samples of a look.

        Parameters
        ----------
        random : numpy.random.Generator
        positions, velocities : ndarray, shape (k, 3)
            Of the aircraft, relative to the radar in its axes forward, right, down in the middle of the frame, m and
            m/s; NaN for those that are not there.
        rcs_m2 : ndarray, shape (k,)
            Mean cross-sections.

        Returns
        -------
        ndarray, shape (averages, channels, samples_per_sweep)
            V.
        """
        config = self._config
        # Drawn for all aircraft, seen or not, so that one does not change the echo of another.
        swerling = config.swerling if config.snr_threshold_db is None else 0
        power = np.abs(draw_fluctuation(np.full(len(positions), swerling), random)) ** 2
        seed = [int(word) for word in random.integers(0, 1 << 62, 2)]
        moved = np.linalg.norm(velocities, axis=1) * config.averages * config.sweep_interval
        seen = self.visible(positions) & (np.linalg.norm(positions, axis=1) > _NEAREST * moved) & (power > 0.0)
        targets = [_target(positions[i], velocities[i], float(rcs_m2[i] * power[i])) for i in np.flatnonzero(seen)]
        return simulate_sweeps(config, targets, config.averages, seed)

    def look(
        self,
        t: float,
        random: np.random.Generator,
        positions: FloatArray,
        velocities: FloatArray,
        rcs_m2: FloatArray,
        burst: int = 0,
    ) -> tuple[FloatArray, FloatArray]:
        """Return the plots of one look.

        Parameters
        ----------
        t : float
            Middle of the frame, s.
        random, positions, velocities, rcs_m2
            As in `samples`.
        burst : int
            So many false plots besides.

        Returns
        -------
        z, variance : ndarray, shape (n, 4)
            As `PlotModel.look` gives them; no range rate where the processing cannot tell it. The variances are the
            processing's and the model's floors.
        """
        if self._processor is None:
            noise = self._noise and self._noise.dated(t)
            self._processor = RadarProcessor(self._config, noise, sensor=self._name, calibration=self._calibration)
        scan = self._processor.step(t, self.samples(random, positions, velocities, rcs_m2))
        z, variance = np.empty((0, 4)), np.empty((0, 4))
        if scan is not None:
            self.state = "ok" if scan.health is None else scan.health.state
            z, variance = scan.z.copy(), np.diagonal(scan.R, axis1=1, axis2=2).copy()
            # Aircraft are no points, and poses not exact: no plot is as good as strong echoes seem.
            floors = self._config, self._config.plot_model, z[:, 1], np.nan_to_num(z[:, 2])
            variance += plot_sigmas(*floors, np.full(len(z), np.inf)) ** 2
        if not self._config.range_rate:
            z[:, 3] = variance[:, 3] = np.nan
        if burst:
            false, spread = self._model.burst(random, burst)
            z, variance = np.concatenate([z, false]), np.concatenate([variance, spread])
        order = random.permutation(len(z))
        return z[order], variance[order]


def _target(position: FloatArray, velocity: FloatArray, rcs_m2: float) -> RadarTarget:
    (distance,), (azimuth,), (elevation,) = (values.tolist() for values in polar(position[None]))
    x, y, _ = position
    level = max(float(np.hypot(x, y)), 1e-6 * distance)
    rate = float(position @ velocity) / distance
    return RadarTarget(
        range=distance,
        azimuth=azimuth,
        elevation=elevation,
        range_rate=rate,
        rcs=rcs_m2,
        azimuth_rate=float(x * velocity[1] - y * velocity[0]) / level**2,
        elevation_rate=float(-velocity[2] - rate * np.sin(elevation)) / level,
    )


@lru_cache(maxsize=8)
def measured_noise(radar: RadarConfig, frames: int) -> NoiseStatistics:
    """Return the noise of a simulated run without targets, always the same one."""
    return noise_statistics(radar, simulate_frames(radar, repeat((), frames), radar.averages, _NOISE_SEED))
