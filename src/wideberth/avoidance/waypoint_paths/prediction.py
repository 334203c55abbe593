"""Tracks as what the planners expect of them: rows of `intruder_kernels`."""

import dataclasses
import functools
import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from wideberth.avoidance.position_spread import position_variances
from wideberth.avoidance.sound_tracks import SoundTracks
from wideberth.avoidance.waypoint_paths import intruder_kernels as ik
from wideberth.avoidance.waypoint_paths.config import AStarConfig
from wideberth.avoidance.waypoint_paths.reacquired import without_repeats
from wideberth.conflict.kernels import horizontal_cpa
from wideberth.types import FloatArray, Ownship, Track

_TURN_SPEED_MIN = 1.0  # m/s: slower than this nothing is said to turn
_LEVEL = 0.1  # m/s: who climbs or sinks no faster than this is level


@dataclasses.dataclass(frozen=True)
class Prediction:
    """Expected motion of the intruders that matter.

    Attributes
    ----------
    rows : ndarray, shape (m, intruder_kernels.N_INTRUDER)
        With cylinders of the size that is to be kept, without margins.
    owners : tuple of Track
        Whose each row is.
    doubts : ndarray of bool, shape (m,)
        Rows that are no more than possible: paths keep clear of them, but they are no reason for a maneuver.
    find_spreads : callable
        Returns `spreads`: most decisions plan nothing and need none.
    """

    rows: FloatArray
    owners: tuple[Track, ...]
    doubts: NDArray[np.bool_]
    find_spreads: Callable[[], FloatArray]

    @functools.cached_property
    def spreads(self) -> FloatArray:
        """What plans add to each radius and half-height for how little is known of where it passes, m, (m, 2)."""
        return self.find_spreads()

    def widened(self, margin: float, spread: float = 1.0) -> FloatArray:
        """Return the rows as plans keep clear of them: larger by a fraction, and by so much of the spreads."""
        rows = self.rows.copy()
        sizes = [ik.RADIUS, ik.HALF_HEIGHT]
        rows[:, sizes] = (1.0 + margin) * rows[:, sizes] + spread * self.spreads
        return rows

    def sigmas_at(self, i: int, t: float) -> tuple[float, float]:
        """Return how well it is known where row `i` will be in `t` seconds: horizontally (per axis), vertically, m."""
        north, east, down = position_variances(self.owners[i], t)
        return math.sqrt(max(0.5 * (north + east), 0.0)), math.sqrt(max(down, 0.0))


class Predictor:
    """Makes predictions.

    A track that is not finite is avoided where its stand-in of `SoundTracks` is, with a cylinder as wide as uncertainty
    may make it. What could not be used is counted.

    Parameters
    ----------
    config : AStarConfig
    """

    def __init__(self, config: AStarConfig) -> None:
        self._config = config
        self._tracks = SoundTracks(config.ghost_s, config.tentative)
        self._left_out = 0

    @property
    def counters(self) -> dict[str, int]:
        """What could not be used, or was left out."""
        return {**self._tracks.counters, "left_out": self._left_out}

    def predict(self, t: float, ownship: Ownship, tracks: Sequence[Track]) -> tuple[Prediction, tuple[str, ...]]:
        """Return what the intruders are expected to do from time `t`, s, and what was wrong with tracks, in words."""
        config = self._config
        rows: list[FloatArray] = []
        owners: list[Track] = []
        doubts: list[bool] = []
        usable, events = self._tracks.step(t, tracks)
        once = {track.id for track in without_repeats([track for track, _ in usable])}
        for used, sound in usable:
            if used.id not in once:
                continue
            expected = self._hypotheses(t, used, 0.0 if sound else config.sigma_cap, ownship)
            possible = self._climb_doubts(used, expected[0])
            rows += [*expected, *possible]
            owners += [used] * (len(expected) + len(possible))
            doubts += [False] * len(expected) + [True] * len(possible)
        return self._soonest(ownship, rows, owners, doubts), tuple(events)

    def _hypotheses(self, t: float, track: Track, doubt: float, ownship: Ownship) -> list[FloatArray]:
        config = self._config
        row = np.zeros(ik.N_INTRUDER)
        # A track of another time is carried on straight.
        row[:3] = track.position + track.velocity * (t - track.t)
        row[3:6] = track.velocity
        covariance = track.covariance
        sigma_h = math.sqrt(max(0.5 * (covariance[0, 0] + covariance[1, 1]), 0.0))
        sigma_v = math.sqrt(max(covariance[2, 2], 0.0))
        for index, size, sigma in (
            (ik.RADIUS, config.separation_radius_m, sigma_h),
            (ik.HALF_HEIGHT, 0.5 * config.separation_height_m, sigma_v),
        ):
            row[index] = size * (1.0 + max(doubt, min(config.sigmas * sigma / size, config.sigma_cap)))
        if config.constant_altitude:
            row[ik.DOWN], row[ik.V_DOWN] = ownship.position[2], 0.0
        rows = [row]
        if config.turn_hypothesis:
            rate = self._turn_rate(track)
            if rate != 0.0:
                turning = row.copy()
                turning[ik.TURN_RATE], turning[ik.TURN_TIME] = rate, config.turn_time_s
                rows.append(turning)
        if config.level_hypothesis and abs(row[ik.V_DOWN]) > _LEVEL:
            rows.append(_level(row))
        if not config.constant_altitude:
            rows += _climbing(row, config.climb_hypothesis_mps)
        return rows

    def _climb_doubts(self, track: Track, row: FloatArray) -> list[FloatArray]:
        """Return the rows of climb rates that are possible too; none once the climb rate is known well enough."""
        config = self._config
        if config.constant_altitude or config.climb_sigmas == 0.0:
            return []
        sigma = math.sqrt(max(float(track.covariance[5, 5]), 0.0))
        rows = []
        if _LEVEL < abs(row[ik.V_DOWN]) < config.climb_significance * sigma:
            rows.append(_level(row))
        down = position_variances(track, config.decide_by_s)[2]
        if down > (config.doubt_share * 0.5 * config.separation_height_m) ** 2:
            rows += _climbing(row, config.climb_sigmas * sigma)
        return rows

    def _turn_rate(self, track: Track) -> float:
        """Return the turn rate (rad/s, positive clockwise from above) that the track's acceleration shows, if any."""
        (vn, ve, _), (an, ae, _) = track.velocity, track.acceleration
        speed = math.hypot(vn, ve)
        if speed < _TURN_SPEED_MIN:
            return 0.0
        lateral = (vn * ae - ve * an) / speed
        sigma = math.sqrt(max(0.5 * (track.covariance[6, 6] + track.covariance[7, 7]), 0.0))
        return lateral / speed if abs(lateral) > self._config.turn_significance * sigma else 0.0

    def _soonest(self, ownship: Ownship, rows: list[FloatArray], owners: list[Track], doubts: list[bool]) -> Prediction:
        most = self._config.intruders_max
        array = np.array(rows).reshape(-1, ik.N_INTRUDER)
        if len(rows) > most:
            distance = np.hypot(*(array[:, :2] - ownship.position[:2]).T) - array[:, ik.RADIUS]
            closing = np.hypot(array[:, 3], array[:, 4]) + math.hypot(*ownship.velocity[:2])
            order = np.argsort(distance / np.maximum(closing, 1e-3), kind="stable")[:most]
            self._left_out += len(rows) - most
            array, owners, doubts = array[order], [owners[i] for i in order], [doubts[i] for i in order]

        def find_spreads() -> FloatArray:
            spreads = [self._spread(ownship, *pair) for pair in zip(array, owners, strict=True)]
            return np.array(spreads, float).reshape(-1, 2)

        return Prediction(array, tuple(owners), np.array(doubts, bool), find_spreads)

    def _spread(self, ownship: Ownship, row: FloatArray, track: Track) -> tuple[float, float]:
        """Return what is added to radius and half-height for not knowing where the intruder passes the ownship, m."""
        config = self._config
        north, east, _, v_north, v_east = row[:5].tolist()
        (own_north, own_east, _), (own_v_north, own_v_east, _) = ownship.position, ownship.velocity
        t, _ = horizontal_cpa(north - own_north, east - own_east, v_north - own_v_north, v_east - own_v_east)
        # Who does not come nearer now is met later, by a path that turns to it.
        t = min(t, config.detection_time_s) if t > 0.0 else config.decide_by_s
        north, east, down = position_variances(track, t)
        level, vertical = math.sqrt(max(0.5 * (north + east), 0.0)), math.sqrt(max(down, 0.0))
        if config.constant_altitude:
            vertical = 0.0
        return (
            min(config.plan_sigmas * level, config.plan_sigma_cap * config.separation_radius_m),
            min(config.plan_sigmas * vertical, config.plan_height_sigma_cap * 0.5 * config.separation_height_m),
        )


def _level(row: FloatArray) -> FloatArray:
    """Return a row that neither climbs nor sinks."""
    level = row.copy()
    level[ik.V_DOWN] = 0.0
    return level


def _climbing(row: FloatArray, change: float) -> list[FloatArray]:
    """Return a row with a climb rate higher and one with a lower one, if there is a change (m/s)."""
    if change <= 0.0:
        return []
    rows = []
    for sign in (-1.0, 1.0):
        climbing = row.copy()
        climbing[ik.V_DOWN] += sign * change
        rows.append(climbing)
    return rows
