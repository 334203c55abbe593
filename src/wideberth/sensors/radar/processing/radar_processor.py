"""A radar's processing over a stream of frames: noise level, clutter map and counts are kept between them."""

import math
from collections import Counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wideberth.argument_checks import FINITE, FloatArray, checked
from wideberth.errors import InputError
from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.estimation.calibration import ArrayCalibration
from wideberth.sensors.radar.processing.clutter_map import ClutterMap
from wideberth.sensors.radar.processing.detection_level import searched_bins
from wideberth.sensors.radar.processing.frame import Processed, process_frame, scan_of
from wideberth.sensors.radar.processing.noise_statistics import NoiseStatistics, theoretical_noise
from wideberth.sensors.radar.processing.thresholds import false_alarm_probabilities
from wideberth.types import Scan


class RadarProcessor:
    """Turns frame after frame into scans.

    Parameters
    ----------
    radar : RadarConfig
    noise : NoiseStatistics or None
        Its level is followed from frame to frame. None: starts from the link budget's. Not used with a clutter map.
    sensor : str
        Name of the radar.
    position : ndarray, shape (3,), optional
        Local NED, m; the origin by default.
    attitude : ndarray, shape (3, 3), optional
        Rotation from the array's axes to local NED; as they are by default.
    calibration : ArrayCalibration or None

    Raises
    ------
    ValueError
        If the noise or the calibration is of another radar.

    Attributes
    ----------
    noise : NoiseStatistics or None
        As it is known now; None with a clutter map before its first frame.
    last : Processed or None
        The steps of the last frame that was processed.
    rejects : Counter of str
        What was left out since the start, by cause: as of `processing.process_frame`, and frames ``frame_unusable``,
        ``frame_out_of_order``, and ``frame_learned`` (the first one of a clutter map).
    complaint : str
        Why the last ``frame_unusable`` was; empty without one.
    """

    def __init__(
        self,
        radar: RadarConfig,
        noise: NoiseStatistics | None = None,
        *,
        sensor: str = "radar",
        position: FloatArray | None = None,
        attitude: FloatArray | None = None,
        calibration: ArrayCalibration | None = None,
    ) -> None:
        if noise is not None:
            noise.check(radar)
        if calibration is not None and len(calibration.response) != radar.channels:
            raise ValueError(
                f"the calibration is of {len(calibration.response)} channels, the radar has {radar.channels}"
            )
        self._radar, self._sensor, self._calibration = radar, sensor, calibration
        self._position = np.zeros(3) if position is None else checked("position", position, FINITE)
        self._attitude = np.eye(3) if attitude is None else checked("attitude", attitude, FINITE)
        self._map = ClutterMap(radar) if radar.processing.clutter_filter == "map" else None
        self._false_alarms = float(false_alarm_probabilities(radar)[searched_bins(radar)].mean())
        self._t = -math.inf
        self.noise = noise if self._map is None else None
        self.last: Processed | None = None
        self.rejects: Counter[str] = Counter()
        self.complaint = ""

    def step(
        self,
        t: float,
        samples: NDArray[Any],
        *,
        position: FloatArray | None = None,
        attitude: FloatArray | None = None,
    ) -> Scan | None:
        """Return the scan of a frame.

        Parameters
        ----------
        t : float
            Middle of the frame, s; later than that of the frame before.
        samples : ndarray, shape (sweeps, channels, samples_per_sweep)
            V.
        position, attitude : ndarray, optional
            Where the radar is now, if it moves.

        Returns
        -------
        Scan or None
            None for a frame that says nothing of whether there are targets; it is counted.

        Raises
        ------
        ValueError
            If the samples are not of this radar's shape or kind, or the time or the place is not finite.
        """
        now = float(checked("t", t, FINITE))
        if position is not None:
            self._position = checked("position", position, FINITE)
        if attitude is not None:
            self._attitude = checked("attitude", attitude, FINITE)
        if now <= self._t:
            self.rejects["frame_out_of_order"] += 1
            return None
        known = self._known(now)
        first = self._map is not None and known is None
        try:
            done = process_frame(self._radar, samples, known, calibration=self._calibration)
        except InputError as error:
            self.rejects["frame_unusable"] += 1
            self.complaint = str(error)
            return None
        self._t = now
        if self._map is not None:
            self._map.learn(done.powers, done.looks, done.channels)
        self.noise = self._followed(known, done)
        if first:
            self.rejects["frame_learned"] += 1
            return None
        self.last = done
        self.rejects.update(done.rejects)
        return scan_of(
            self._radar,
            done,
            t=now,
            sensor=self._sensor,
            position=self._position,
            attitude=self._attitude,
            rejects=dict(self.rejects),
        )

    def _known(self, t: float) -> NoiseStatistics | None:
        """Return the noise as it is known before a frame."""
        if self._map is not None:
            return self._map.statistics(t)
        noise = theoretical_noise(self._radar, t) if self.noise is None else self.noise
        return noise.aged(t, self._radar.processing.noise_drift_db_per_sqrt_hour)

    def _followed(self, known: NoiseStatistics | None, done: Processed) -> NoiseStatistics | None:
        """Return the noise as it is known after a frame."""
        if known is None or self._map is not None:
            return known
        searched = searched_bins(self._radar)
        return known.updated(done.powers, done.detected, searched, done.channels, done.looks, self._false_alarms)
