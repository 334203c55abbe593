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
        if not tracks:
            return ()
        flown = self._path(t, ownship, path)
        threats: list[Threat | None] = []
        judged: list[tuple[Track, FloatArray]] = []
        doubts: list[FloatArray] = []
        states, covariances = _states_of(tracks), _covariances_of(tracks)
        known = np.logical_and(np.isfinite(states).all(axis=1), np.isfinite(covariances).all(axis=(1, 2)))
        for i, track in enumerate(tracks):
            if track.is_ownship:
                threats.append(_without_state(track, 0.0, AlertLevel.CLEAR))
            elif not known[i]:
                threats.append(_without_state(track, math.nan, AlertLevel.UNKNOWN))
            else:
                threats.append(None)
                judged.append((track, states[i]))
                doubts.append(_covariance_at(t, track.t, covariances[i]))
        found = iter(self._threats(t, flown, ownship, judged, doubts) if judged else ())
        return tuple(next(found) if threat is None else threat for threat in threats)

    def conflicts(
        self, t: float, ownship: Ownship, tracks: Sequence[Track], path: Mission | Maneuver | None = None
    ) -> tuple[PathConflict, ...]:
        """Return flags and times by segment of the path for every track, whose states must be finite; see `assess`."""
        flown = self._path(t, ownship, path)
        judged = list(zip(tracks, _states_of(tracks), strict=True))
        return tuple(self._conflicts(t, flown, judged, *_straight_on(t, judged))) if judged else ()

    def _path(self, t: float, ownship: Ownship, path: Mission | Maneuver | None) -> CheckedPath:
        config = self._config
        position, velocity = np.array(ownship.position, float), np.array(ownship.velocity, float)
        points, speeds = np.empty((0, 3)), np.empty(0)
        if isinstance(path, Mission):
            points, speeds = path.waypoints[path.index :], path.speeds[path.index :]
        elif path is not None:
            ahead = path.times > t
            points, times = path.waypoints[ahead], path.times[ahead]
            legs, durations = np.array(points, float), np.array(times, float)
            legs[:1] -= position
            legs[1:] -= points[:-1]
            durations[:1] -= t
            durations[1:] -= times[:-1]
            speeds = np.sqrt((legs * legs).sum(axis=1)) / durations
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

    def _conflicts(
        self,
        t: float,
        path: CheckedPath,
        judged: Sequence[tuple[Track, FloatArray]],
        positions: FloatArray,
        velocities: FloatArray,
    ) -> list[PathConflict]:
        """Return flags and times of tracks with their states (9,), and those at `t` of straight flight."""
        config = self._config
        if config.motion == "constant_velocity":
            return path_conflicts(path, positions, velocities)
        found = []
        for track, state in judged:
            begin = turning_state(state[:3], state[3:6], state[6:]) if config.motion == "turning" else state
            now = np.empty(9)
            motion_kernels.propagate(self._model, t - track.t, begin, now)
            found.append(
                maneuver_conflict(
                    path, self._model, now, config.maneuver_time_s, config.lookahead_s, config.tolerance_s
                )
            )
        return found

    def _threats(
        self,
        t: float,
        path: CheckedPath,
        ownship: Ownship,
        judged: Sequence[tuple[Track, FloatArray]],
        doubts: Sequence[FloatArray],
    ) -> list[Threat]:
        config = self._config
        positions, velocities = _straight_on(t, judged)
        conflicts = self._conflicts(t, path, judged, positions, velocities)
        closest, chances = np.empty((len(judged), 3)), np.empty(len(judged))
        cylinder_kernels.path_closest_all(
            path.own_position, path.speeds, path.waypoints, positions, velocities, config.lookahead_s, closest
        )
        probability_kernels.largest_path_probabilities(
            path.own_position,
            path.speeds,
            path.waypoints,
            positions,
            velocities,
            np.array(doubts) + ownship.covariance,
            config.lookahead_s,
            path.radius,
            path.half_height,
            chances,
        )
        return [
            self._threat(track, conflict, t_cpa, d_cpa, h_cpa, chance)
            for (track, _), conflict, (t_cpa, d_cpa, h_cpa), chance in zip(
                judged, conflicts, closest.tolist(), chances.tolist(), strict=True
            )
        ]

    def _threat(
        self, track: Track, conflict: PathConflict, t_cpa: float, d_cpa: float, h_cpa: float, chance: float
    ) -> Threat:
        config = self._config
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
        return Threat(track.id, t_cpa, d_cpa, h_cpa, entry, (entry, min(leaves, config.lookahead_s)), chance, level)


def _states_of(tracks: Sequence[Track]) -> FloatArray:
    """Return position, velocity and acceleration of each, (k, 9)."""
    if not tracks:
        return np.empty((0, 9))
    parts = [part for track in tracks for part in (track.position, track.velocity, track.acceleration)]
    return np.concatenate(parts, dtype=np.float64).reshape(len(tracks), 9)


def _covariances_of(tracks: Sequence[Track]) -> FloatArray:
    """Return the covariance of each, (k, 9, 9)."""
    return np.array([track.covariance for track in tracks], np.float64).reshape(-1, 9, 9)


def _straight_on(t: float, judged: Sequence[tuple[Track, FloatArray]]) -> tuple[FloatArray, FloatArray]:
    """Return positions and velocities (k, 3) at `t` of tracks with their states."""
    states = np.array([state for _, state in judged])
    ages = np.array([t - track.t for track, _ in judged])
    return states[:, :3] + states[:, 3:6] * ages[:, None], states[:, 3:6].copy()


def _covariance_at(t: float, t_track: float, covariance: FloatArray) -> FloatArray:
    """Return the covariance (6, 6) of position and velocity at `t` of a track with such a one (9, 9)."""
    covariance = covariance[:6, :6]
    if t_track == t:
        return covariance
    straight = np.eye(6)
    straight[:3, 3:] = (t - t_track) * np.eye(3)
    return np.asarray(straight @ covariance @ straight.T)


def _leaves(conflict: PathConflict) -> float:
    """Return when the first stay ends, which may go on over waypoints; NaN where there is none."""
    end = math.nan
    for entry, exit_ in zip(conflict.entry_time.tolist(), conflict.exit_time.tolist(), strict=True):
        if math.isnan(end) or entry <= end:
            end = exit_
    return float(end)


def _without_state(track: Track, probability: float, level: AlertLevel) -> Threat:
    return Threat(track.id, math.nan, math.nan, math.nan, math.nan, (math.nan, math.nan), probability, level)
