"""Which radar track is the ownship: settings, the numbers of the test, and the identifier for tracks of one scan.

See `ownship_kernels` for the test itself.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from wideberth.tracking.config import OwnshipConfig
from wideberth.tracking.ownship_kernels import (
    STATE_WIDTH,
    WORK_ROWS,
    OwnshipTest,
    identify,
)
from wideberth.types import Ownship, Track

FloatArray = NDArray[np.float64]

_SINGLE_LOOK = 1e-2
"""A single look may be off this much more rarely than the mean: there are many looks in a window."""


def ownship_test(config: OwnshipConfig) -> OwnshipTest:
    """Return the numbers that the kernels test with.

    Parameters
    ----------
    config : OwnshipConfig

    Returns
    -------
    OwnshipTest
    """
    miss, false_alarm = config.miss_rate, config.false_alarm_rate
    volume = 4.0 / 3.0 * math.pi * config.traffic_radius_m**3
    spread = config.traffic_speed_sigma_mps**2 * config.traffic_vertical_speed_sigma_mps
    return OwnshipTest(
        window_s=config.window_s,
        settle_s=config.settle_s,
        mean_limit=float(chi2.isf(miss, 6)),
        look_limit=float(chi2.isf(miss * _SINGLE_LOOK, 6)),
        # Wald's upper limit for the two rates.
        margin=math.log((1.0 - miss) / false_alarm),
        log_density=-math.log(volume) - 1.5 * math.log(2.0 * math.pi) - math.log(spread),
    )


def telemetry_covariance(config: OwnshipConfig, reported: FloatArray | None = None, age_s: float = 0.0) -> FloatArray:
    """Return the covariance (6, 6) of telemetry's position and velocity, NED.

    Parameters
    ----------
    config : OwnshipConfig
    reported : ndarray, shape (6, 6), optional
        The telemetry's own; the configured sigmas stand in where its diagonal is zero, and for all of it if it is not
        finite or has a negative variance.
    age_s : float
        Age of the telemetry, s, over which it was extrapolated.

    Returns
    -------
    ndarray, shape (6, 6)
    """
    h, v = config.position_sigma_m, config.altitude_sigma_m
    sh, sv = config.velocity_sigma_mps, config.vertical_velocity_sigma_mps
    covariance = np.zeros((6, 6))
    covariance.reshape(36)[::7] = h * h, h * h, v * v, sh * sh, sh * sh, sv * sv
    # All zero it says nothing, as simulated telemetry without error.
    if reported is not None and reported.any() and np.isfinite(reported).all() and (reported.diagonal() >= 0.0).all():
        unsaid = reported.diagonal() == 0.0
        covariance = np.where(unsaid[:, None] | unsaid, covariance, reported)
    if age_s:
        f = np.eye(6)
        f[:3, 3:] = age_s * np.eye(3)
        g = np.vstack([0.5 * age_s**2 * np.eye(3), age_s * np.eye(3)])
        covariance = f @ covariance @ f.T + config.acceleration_sigma_mps2**2 * g @ g.T
    return covariance


class OwnshipIdentifier:
    """Tells which of a radar's tracks is the ownship, scan by scan.

    Parameters
    ----------
    config : OwnshipConfig, optional
    """

    def __init__(self, config: OwnshipConfig | None = None) -> None:
        self.config = config if config is not None else OwnshipConfig()
        self.test = ownship_test(self.config)
        self._states: dict[str, FloatArray] = {}
        self._t = math.nan
        self._flagged: str | None = None
        self._had_telemetry = True
        self._work = np.zeros((WORK_ROWS, 6))

    def step(self, t: float, tracks: Sequence[Track], ownship: Ownship | None) -> tuple[str | None, tuple[str, ...]]:
        """Compare the tracks of a scan with telemetry.

        Parameters
        ----------
        t : float
            Time of the tracks, s; not before the last call's.
        tracks : sequence of Track
            All live tracks, intruders' and the ownship's.
        ownship : Ownship or None
            The latest telemetry, of `t` or before; None: there is none.

        Returns
        -------
        flagged : str or None
            The id of the track that is the ownship.
        events : tuple of str
            What changed: telemetry lost or back, a track found to be the ownship or no longer.

        Raises
        ------
        ValueError
            Where time runs backwards.
        """
        if t < self._t:
            raise ValueError(f"t: {t} s is before the last scan's {self._t} s: give scans in order")
        dt = t - self._t if math.isfinite(self._t) else 0.0
        self._t = t
        events: list[str] = []
        telemetry, covariance, missing = self._telemetry(t, ownship)
        if missing and self._had_telemetry:
            events.append(f"no ownship telemetry ({missing}): no track is taken as the ownship")
        elif not missing and not self._had_telemetry:
            events.append("ownship telemetry is back")
        self._had_telemetry = not missing

        n = len(tracks)
        x, p, states = np.empty((n, 6)), np.empty((n, 6, 6)), np.zeros((n, STATE_WIDTH))
        for i, track in enumerate(tracks):
            x[i, :3], x[i, 3:] = track.position, track.velocity
            p[i] = track.covariance[:6, :6]
            if track.id in self._states:
                states[i] = self._states[track.id]
        chosen = identify(n, dt, x, p, telemetry, covariance, self.test, states, self._work)
        self._states = {track.id: states[i] for i, track in enumerate(tracks)}
        flagged = tracks[chosen].id if chosen >= 0 else None
        if flagged != self._flagged:
            if self._flagged is not None:
                events.append(f"track {self._flagged} is no longer taken as the ownship")
            if flagged is not None:
                events.append(f"track {flagged} is the ownship")
        self._flagged = flagged
        return flagged, tuple(events)

    def _telemetry(self, t: float, ownship: Ownship | None) -> tuple[FloatArray, FloatArray, str]:
        """Return telemetry at `t`, its covariance, and why there is none."""
        nothing = np.full(6, math.nan), np.full((6, 6), math.nan)
        if ownship is None:
            return *nothing, "none received"
        age = t - ownship.t
        if not math.isfinite(age):
            return *nothing, "without a time"
        if age < -self.config.stale_after_s:
            return *nothing, f"its time is {-age:.1f} s ahead of the scan"
        if age > self.config.stale_after_s:
            return *nothing, f"{age:.1f} s old"
        state = np.concatenate([ownship.position + age * ownship.velocity, ownship.velocity])
        if not np.isfinite(state).all():
            return *nothing, "not finite"
        return state, telemetry_covariance(self.config, ownship.covariance, abs(age)), ""
