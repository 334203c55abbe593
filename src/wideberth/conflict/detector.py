"""The conflict detector of the corridor: one threat for every track."""

import math
from collections.abc import Sequence

import numpy as np

from wideberth.conflict import detection_kernels as kernels
from wideberth.conflict.config import DetectionConfig
from wideberth.conflict.detection import DetectionRules
from wideberth.conflict.uncertainty import ConstantNoise
from wideberth.conflict.well_clear import PRESETS
from wideberth.types import AlertLevel, Ownship, Threat, Track

_LEVELS = {int(level): level for level in AlertLevel}


class AdsbDetector:
    """Assesses tracks with algorithm 2 of the ADS-B paper and the exact interval inside a well-clear volume.

    Levels: *warning*, the collision volume, widened by `collision_m1`, `collision_m2` sigmas to the well-clear volume
    at most (a lost aircraft, whose sigmas grow without end, is no warning for them alone), is predicted to be entered
    within the warning time; *corrective*, loss of well clear is predicted (nominally, or by algorithm 2 with `m1`,
    `m2`) within the corrective time; *preventive*, within the look-ahead, or the aircraft is near; *unknown*, the
    track's state is not finite; else *clear*. No memory: hysteresis is the pipeline's.

    Parameters
    ----------
    config : DetectionConfig
    """

    Config = DetectionConfig

    def __init__(self, config: DetectionConfig) -> None:
        volume, collision = PRESETS[config.well_clear_volume], PRESETS[config.collision_volume]
        self._volume = np.array([volume.dthr, volume.zthr, volume.tthr, volume.tcoa])
        self._separation = DetectionRules(
            volume.dthr,
            volume.zthr,
            volume.tthr,
            volume.dthr,
            volume.zthr,
            config.lookahead_s,
            config.m1,
            config.m2,
        ).array()
        # The well-clear volume is the threshold boundary of collision detection (ADS-B paper, short-range experiment).
        self._collision = DetectionRules(
            volume.dthr,
            volume.zthr,
            volume.tthr,
            collision.dthr,
            collision.zthr,
            config.warning_time_s,
            config.collision_m1,
            config.collision_m2,
        ).array()
        self._times = np.array([config.corrective_time_s, config.warning_time_s])
        self._near = np.array([volume.dthr, volume.zthr]) * config.near_factor
        noise = ConstantNoise(
            config.position_sigma_m,
            config.velocity_sigma_mps,
            config.altitude_sigma_m,
            config.climb_rate_sigma_mps,
            config.noisy_aircraft,
        )
        self._noise, self._noisy = noise.array(), noise.noisy_aircraft
        self._source = kernels.SIGMA_TRACK if config.sigma == "track" else kernels.SIGMA_PAPER
        self._printed = config.variant == "printed"
        self._miss_filter = config.miss_filter

    @property
    def near_radius(self) -> float:
        """Horizontal distance within which an aircraft is never clear, m."""
        return float(self._near[0])

    def assess(self, t: float, ownship: Ownship, tracks: Sequence[Track]) -> tuple[Threat, ...]:
        """Return one threat for every track, in their order.

        Parameters
        ----------
        t : float
            Now, s; tracks of another time are extrapolated straight on.
        ownship : Ownship
        tracks : sequence of Track
            The ownship's own echo (`is_ownship`) is clear.
        """
        if not tracks:
            return ()
        out = np.empty((len(tracks), 7))
        kernels.assess_all(
            # Copies, as a read-only or strided array would be another type, compiled anew in flight.
            np.array(ownship.position, float),
            np.array(ownship.velocity, float),
            np.array(ownship.covariance, float),
            np.array([track.position for track in tracks]),
            np.array([track.velocity for track in tracks]),
            np.array([track.covariance for track in tracks]),
            np.array([t - track.t for track in tracks]),
            self._volume,
            self._separation,
            self._collision,
            self._times,
            self._near,
            self._noise,
            self._noisy,
            self._source,
            self._printed,
            self._miss_filter,
            out,
        )
        return tuple(_threat(track, row) for track, row in zip(tracks, out.tolist(), strict=True))


def _threat(track: Track, row: list[float]) -> Threat:
    t_cpa, d_cpa, h_cpa, t_in, t_out, probability, level = row
    if track.is_ownship:
        return Threat(track.id, math.nan, math.nan, math.nan, math.nan, (math.nan, math.nan), 0.0, AlertLevel.CLEAR)
    if not math.isfinite(d_cpa + h_cpa + probability):
        return Threat(track.id, t_cpa, d_cpa, h_cpa, t_in, (t_in, t_out), math.nan, AlertLevel.UNKNOWN)
    return Threat(track.id, t_cpa, d_cpa, h_cpa, t_in, (t_in, t_out), probability, _LEVELS[int(level)])
