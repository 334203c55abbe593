"""The conflict detector that knows the path: one threat for every track, judged along the waypoints to be flown."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from wideberth.conflict import cylinder_kernels, probability_kernels
from wideberth.conflict.config import PathCylinderConfig
from wideberth.conflict.curved_path import MODELS, maneuver_conflict, turning_state
from wideberth.conflict.cylinder import CheckedPath, PathConflict, path_conflicts
from wideberth.tracking import motion_kernels
from wideberth.types import AlertLevel, Maneuver, Mission, Ownship, Threat, Track

FloatArray = NDArray[np.float64]


class PathCylinderDetector:
    """Assesses tracks with algorithms 3 to 5 of the thesis (4.3), corrected, along the path that is to be flown.

    Levels: *warning*, the cylinder is entered on the path within the warning time; *corrective*, the entry counts (the
    intruder is near now, or enters within the time threshold); *preventive*, it is entered later within the look-ahead,
    or after the last waypoint; *unknown*, the track's state is not finite; else *clear*. No memory: hysteresis is the
    pipeline's, and counting detections in a row the waypoint control function's.

    Parameters
    ----------
    config : PathCylinderConfig
    """

    Config = PathCylinderConfig

    judges_path = True

    def __init__(self, config: PathCylinderConfig) -> None:
        self._config = config
        self._model = MODELS[config.motion]

    @property
    def near_radius(self) -> float:
        """Horizontal distance within which an aircraft is never clear, m."""
        return self._config.safety_radius_m

    def assess(
        self, t: float, ownship: Ownship, tracks: Sequence[Track], path: Mission | Maneuver | None = None
    ) -> tuple[Threat, ...]:
        """Return one threat for every track, in their order.

        Parameters
        ----------
        t : float
            Now, s; tracks of another time are extrapolated.
        ownship : Ownship
        tracks : sequence of Track
            The ownship's own echo (`is_ownship`) is clear.
        path : Mission or Maneuver, optional
            What is to be flown: the rest of it counts. Absent or flown: straight on at the ownship's velocity.

        Returns
        -------
        tuple of Threat
            Times along the path; `interval` is from the first entry to when the intruder is out again. Closest point
            and probability are those of straight flight of the intruder, also where `motion` says otherwise.
        """
        flown = self._path(t, ownship, path)
        threats = []
        for track in tracks:
            state = np.concatenate([track.position, track.velocity, track.acceleration]).astype(float)
            if track.is_ownship:
                threats.append(_without_state(track, 0.0, AlertLevel.CLEAR))
            elif not (np.isfinite(state).all() and np.isfinite(track.covariance).all()):
                threats.append(_without_state(track, math.nan, AlertLevel.UNKNOWN))
            else:
                threats.append(self._threat(flown, ownship, track, state, t - track.t))
        return tuple(threats)

    def conflicts(
        self, t: float, ownship: Ownship, tracks: Sequence[Track], path: Mission | Maneuver | None = None
    ) -> tuple[PathConflict, ...]:
        """Return flags and times by segment of the path for every track, whose states must be finite; see `assess`."""
        flown = self._path(t, ownship, path)
        states = (
            np.concatenate([track.position, track.velocity, track.acceleration]).astype(float) for track in tracks
        )
        return tuple(self._conflict(flown, state, t - track.t) for track, state in zip(tracks, states, strict=True))

    def _path(self, t: float, ownship: Ownship, path: Mission | Maneuver | None) -> CheckedPath:
        config = self._config
        position, velocity = np.array(ownship.position, float), np.array(ownship.velocity, float)
        points, speeds = np.empty((0, 3)), np.empty(0)
        if isinstance(path, Mission):
            points, speeds = path.waypoints[path.index :], path.speeds[path.index :]
        elif path is not None:
            ahead = path.times > t
            points = path.waypoints[ahead]
            lengths = np.linalg.norm(np.diff(points, axis=0, prepend=position[None]), axis=1)
            speeds = lengths / np.diff(path.times[ahead], prepend=t)
        if not len(points):
            speed = float(np.linalg.norm(velocity))
            ahead_of_it = velocity * config.lookahead_s if speed > 0.0 else np.array([1.0, 0.0, 0.0])
            points, speeds = (position + ahead_of_it)[None], np.array([speed])
        return CheckedPath(
            position,
            np.array(speeds, float),
            np.array(points, float, order="C"),
            config.safety_radius_m,
            0.5 * config.safety_height_m,
            (config.distance_threshold_m, config.height_threshold_m, config.time_threshold_s),
            config.beyond == "hover",
        )

    def _conflict(self, path: CheckedPath, state: FloatArray, age: float) -> PathConflict:
        config = self._config
        if config.motion == "constant_velocity":
            (conflict,) = path_conflicts(path, (state[:3] + state[3:6] * age)[None], state[None, 3:6].copy())
            return conflict
        if config.motion == "turning":
            state = turning_state(state[:3], state[3:6], state[6:])
        now = np.empty(9)
        motion_kernels.propagate(self._model, age, state, now)
        return maneuver_conflict(path, self._model, now, config.maneuver_time_s, config.lookahead_s, config.tolerance_s)

    def _threat(self, path: CheckedPath, ownship: Ownship, track: Track, state: FloatArray, age: float) -> Threat:
        config = self._config
        conflict = self._conflict(path, state, age)
        p, v = state[:3] + state[3:6] * age, state[3:6].copy()
        t_cpa, d_cpa, h_cpa = cylinder_kernels.path_closest(
            path.own_position, path.speeds, path.waypoints, p, v, config.lookahead_s
        )
        covariance = np.array(track.covariance[:6, :6], float)
        straight = np.eye(6)
        straight[:3, 3:] = age * np.eye(3)
        chance = np.empty(len(path.waypoints))
        probability_kernels.path_probabilities(
            path.own_position,
            path.speeds,
            path.waypoints,
            p,
            v,
            straight @ covariance @ straight.T + ownship.covariance,
            config.lookahead_s,
            path.radius,
            path.half_height,
            chance,
        )
        entry = conflict.first_entry_time
        leaves = _leaves(conflict)
        level = AlertLevel.CLEAR
        if entry <= config.lookahead_s or conflict.beyond_last_entry_time <= config.lookahead_s:
            level = AlertLevel.PREVENTIVE
        if conflict.first_alert_entry_time <= config.lookahead_s:
            level = AlertLevel.CORRECTIVE
        if entry <= config.warning_time_s:
            level = AlertLevel.WARNING
        if not entry <= config.lookahead_s:
            entry = leaves = math.nan
        return Threat(
            track.id, t_cpa, d_cpa, h_cpa, entry, (entry, min(leaves, config.lookahead_s)), float(chance.max()), level
        )


def _leaves(conflict: PathConflict) -> float:
    """Return when the first stay ends, which may go on over waypoints; NaN where there is none."""
    end = math.nan
    for entry, exit_ in zip(conflict.entry_time.tolist(), conflict.exit_time.tolist(), strict=True):
        if math.isnan(end) or entry <= end:
            end = exit_
    return float(end)


def _without_state(track: Track, probability: float, level: AlertLevel) -> Threat:
    return Threat(track.id, math.nan, math.nan, math.nan, math.nan, (math.nan, math.nan), probability, level)
