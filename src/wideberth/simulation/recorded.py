"""Recorded traffic as truth: what the aircraft of a recording did, freed of the recording's faults.

Of each aircraft: reports on the ground are left out; a position that repeats the one before is a stale report (kept
only where the reported speed says that the aircraft hovers); a single position far off both its neighbours is left out;
gaps longer than `max_gap_s`, and jumps that nobody flies, cut the flight into segments, outside which it is absent;
altitude spikes (off the running median) are left out. Recorded times are rounded or late by some tenths of a second,
which shows as jitter along the track: positions and altitudes are smoothed by a local straight-line fit over +-3 s, but
moved by `SMOOTHING_MAX` at most. Velocities are the reported ones, from the fit where none was reported.
"""

from collections import Counter
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from wideberth.frames import LocalFrame
from wideberth.sensors.adsb.report import AdsbReport
from wideberth.simulation.kernels import states_at, states_at_many
from wideberth.simulation.truth import Truth
from wideberth.types import FloatArray

BoolArray = NDArray[np.bool_]

SMOOTHING_MAX = 20.0  # m, from the reported position
SMOOTHING_MAX_VERTICAL = 15.0  # m, two steps of the 25 ft encoding
SMOOTHING_HALF_WIDTH = 3.0  # s
SLOPE_HALF_WIDTH = 5.0  # s, for velocities from positions
HOVER_SPEED = 2.0  # m/s, below which a repeated position can be true
JUMP_SPEED, JUMP_DISTANCE = 350.0, 500.0  # m/s and m: farther between two reports is no flight
SPIKE_HEIGHT = 50.0  # m off the running median
SPIKE_SAMPLES = 15  # of the running median: a reversal of 14 m/s at 1 Hz stays below the height
CLIMB_MAX = 100.0  # m/s, for a segment's ends, where there is no median
VELOCITY_AGE_MAX = 10.0  # s, from a position to the nearest reported velocity

# Columns of a row.
_T, _LAT, _LON, _PRESSURE, _GEOMETRIC, _VN, _VE, _CLIMB = range(8)


class RecordedTraffic:
    """The true states of recorded aircraft at any time.

    Parameters
    ----------
    reports : iterable of AdsbReport
        Of all aircraft, in any order.
    frame : LocalFrame
        Local frame of the states.
    max_gap_s : float
        An aircraft without a new position for longer is absent in between.

    Attributes
    ----------
    ids : tuple of str
        Addresses of all aircraft that are ever present.
    t_start, t_end : float
        First and last time at which any is present, Unix s; NaN for none.
    counters : dict of str to int
        What was used and what was left out, by cause.
    """

    def __init__(self, reports: Iterable[AdsbReport], frame: LocalFrame, max_gap_s: float = 30.0) -> None:
        if not max_gap_s > 0:
            raise ValueError(f"max_gap_s is {max_gap_s}: give a positive number of seconds")
        self.counters: Counter[str] = Counter()
        rows: dict[str, list[tuple[float, ...]]] = {}
        for r in reports:
            self.counters["reports"] += 1
            if r.on_ground:
                self.counters["on the ground"] += 1
                continue
            rows.setdefault(r.address, []).append(
                (
                    r.t,
                    r.latitude,
                    r.longitude,
                    r.pressure_altitude,
                    r.geometric_altitude,
                    r.velocity_north,
                    r.velocity_east,
                    r.climb_rate,
                )
            )
        ids: list[str] = []
        aircraft: list[int] = []
        segments: list[FloatArray] = []
        for address, own in rows.items():
            found = list(self._segments(np.array(own), frame, max_gap_s))
            if found:
                aircraft += [len(ids)] * len(found)
                segments += found
                ids.append(address)
            else:
                self.counters["aircraft without a usable flight"] += 1
        self.counters["aircraft"] = len(ids)
        self.ids = tuple(ids)
        knots = np.concatenate(segments) if segments else np.empty((0, 7))
        self._times = np.ascontiguousarray(knots[:, 0])
        self._states = np.ascontiguousarray(knots[:, 1:])
        self._offsets = np.cumsum([0, *(len(s) for s in segments)], dtype=np.int64)
        self._aircraft = np.array(aircraft, np.int64)
        self._out = np.empty((len(aircraft), 6))
        self._present = np.empty(len(aircraft), np.int64)
        self.t_start = float(self._times.min()) if len(knots) else float("nan")
        self.t_end = float(self._times.max()) if len(knots) else float("nan")

    def truth(self, t: float) -> Truth:
        """Return the states of all aircraft present at time `t`, Unix s."""
        k = states_at(t, self._offsets, self._aircraft, self._times, self._states, self._out, self._present)
        ids = self.ids
        return Truth(
            t, tuple([ids[i] for i in self._present[:k].tolist()]), self._out[:k, :3].copy(), self._out[:k, 3:].copy()
        )

    def truth_many(self, times: FloatArray) -> FloatArray:
        """Return the states (m, len(ids), 6) at many times: position and velocity, NED; NaN where absent.

        Parameters
        ----------
        times : ndarray, shape (m,)
            Rising, Unix s.

        Raises
        ------
        ValueError
            If the times do not rise.
        """
        at = np.ascontiguousarray(times, float)
        if np.any(np.diff(at) < 0):
            raise ValueError("the times must rise: sort them")
        out = np.empty((len(at), len(self.ids), 6))
        states_at_many(at, self._offsets, self._aircraft, self._times, self._states, out)
        return out

    def _segments(self, rows: FloatArray, frame: LocalFrame, max_gap: float) -> Iterable[FloatArray]:
        """Yield the segments (k, 7) of one aircraft: time, position, velocity."""
        rows = rows[np.isfinite(rows[:, _T])]
        rows = rows[np.argsort(rows[:, _T], kind="stable")]
        located = np.isfinite(rows[:, _LAT]) & np.isfinite(rows[:, _LON])
        stale = np.zeros(len(rows), bool)
        stale[located] = _repeats(rows[located])
        self.counters["repeated positions"] += int(stale.sum())
        rows, located = rows[~stale], located[~stale]
        if not located.any():
            return
        t, p = rows[located, _T], frame.to_ned(rows[located, _LAT], rows[located, _LON], 0.0)[:, :2]
        good = ~_outliers(t, p)
        self.counters["position outliers"] += int((~good).sum())
        index = np.flatnonzero(located)[good]
        t, p = t[good], p[good]
        gaps = np.diff(t) > max_gap
        jumps = _jump(t[:-1], p[:-1], t[1:], p[1:])
        self.counters["gaps"] += int(gaps.sum())
        self.counters["position jumps"] += int((jumps & ~gaps).sum())
        # The altitude and velocity series hold rows without positions too: those between a segment's own rows.
        for own in np.split(index, np.flatnonzero(gaps | jumps) + 1):
            if len(own) < 2:
                self.counters["positions standing alone"] += len(own)
                continue
            segment = self._segment(rows[own[0] : own[-1] + 1], own - own[0], frame, max_gap)
            if len(segment) >= 2:
                self.counters["positions used"] += len(segment)
                yield segment

    def _segment(self, rows: FloatArray, own: NDArray[np.intp], frame: LocalFrame, max_gap: float) -> FloatArray:
        t, lat, lon = rows[own, _T], rows[own, _LAT], rows[own, _LON]
        altitude_t, altitude = self._altitudes(rows)
        if not len(altitude):
            self.counters["positions without altitude"] += len(own)
            return np.empty((0, 7))
        near = _nearest_distance(t, altitude_t) <= max_gap
        self.counters["positions without altitude"] += int((~near).sum())
        t, lat, lon = t[near], lat[near], lon[near]
        if len(t) < 2:
            return np.empty((0, 7))
        raw = frame.to_ned(lat, lon, np.interp(t, altitude_t, altitude))
        smooth, _ = _line_fit(t, raw, SMOOTHING_HALF_WIDTH)
        move = smooth - raw
        length = np.hypot(move[:, 0], move[:, 1])
        move[:, :2] *= np.minimum(1.0, SMOOTHING_MAX / np.maximum(length, 1e-9))[:, None]
        move[:, 2] = np.clip(move[:, 2], -SMOOTHING_MAX_VERTICAL, SMOOTHING_MAX_VERTICAL)
        _, velocity = _line_fit(t, raw, SLOPE_HALF_WIDTH)
        known = np.isfinite(rows[:, _VN]) & np.isfinite(rows[:, _VE])
        if known.any():
            reported = np.zeros((len(t), 3))
            for column, source in ((0, _VN), (1, _VE)):
                reported[:, column] = np.interp(t, rows[known, _T], rows[known, source])
            reported = frame.velocity_to_ned(lat, lon, reported)
            use = _nearest_distance(t, rows[known, _T]) <= VELOCITY_AGE_MAX
            velocity[use, :2] = reported[use, :2]
        known = np.isfinite(rows[:, _CLIMB])
        if known.any():
            use = _nearest_distance(t, rows[known, _T]) <= VELOCITY_AGE_MAX
            velocity[use, 2] = -np.interp(t[use], rows[known, _T], rows[known, _CLIMB])
        return np.column_stack([t, raw + move, velocity])

    def _altitudes(self, rows: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return times and altitudes of a segment without spikes; geometric only where there is no pressure one."""
        column = _PRESSURE if np.isfinite(rows[:, _PRESSURE]).any() else _GEOMETRIC
        known = np.isfinite(rows[:, column])
        t, altitude = rows[known, _T], rows[known, column]
        if not len(t):
            return t, altitude
        half = SPIKE_SAMPLES // 2
        windows = np.lib.stride_tricks.sliding_window_view(np.pad(altitude, half, mode="edge"), SPIKE_SAMPLES)
        good = np.abs(altitude - np.median(windows, axis=-1)) <= SPIKE_HEIGHT
        self.counters["altitude spikes"] += int((~good).sum())
        t, altitude = t[good], altitude[good]
        # The padding makes the median blind at the ends: there the climb must be possible.
        low, high = 0, len(t) - 1
        while low < high and abs(altitude[low + 1] - altitude[low]) > SPIKE_HEIGHT + CLIMB_MAX * (t[low + 1] - t[low]):
            low += 1
        while high > low and abs(altitude[high] - altitude[high - 1]) > SPIKE_HEIGHT + CLIMB_MAX * (
            t[high] - t[high - 1]
        ):
            high -= 1
        self.counters["altitude spikes"] += len(t) - (high - low + 1)
        return t[low : high + 1], altitude[low : high + 1]


def _repeats(rows: FloatArray) -> BoolArray:
    """Return which located rows say nothing new: the position before again, or no later time."""
    repeat = np.zeros(len(rows), bool)
    same = (np.diff(rows[:, _LAT]) == 0) & (np.diff(rows[:, _LON]) == 0)
    hover = np.hypot(rows[1:, _VN], rows[1:, _VE]) < HOVER_SPEED  # False where the speed is unknown
    repeat[1:] = (same & ~hover) | (np.diff(rows[:, _T]) <= 0)
    return repeat


def _jump(t0: FloatArray, p0: FloatArray, t1: FloatArray, p1: FloatArray) -> BoolArray:
    d = p1 - p0
    far: BoolArray = np.hypot(d[:, 0], d[:, 1]) > JUMP_DISTANCE + JUMP_SPEED * (t1 - t0)
    return far


def _outliers(t: FloatArray, p: FloatArray) -> BoolArray:
    """Return which positions are far off both neighbours, which agree with each other."""
    out = np.zeros(len(t), bool)
    if len(t) >= 3:
        step = _jump(t[:-1], p[:-1], t[1:], p[1:])
        out[1:-1] = step[:-1] & step[1:] & ~_jump(t[:-2], p[:-2], t[2:], p[2:])
    return out


def _nearest_distance(t: FloatArray, samples: FloatArray) -> FloatArray:
    """Return the distance in time of each `t` to the nearest of the rising `samples`."""
    after = np.clip(np.searchsorted(samples, t), 0, len(samples) - 1)
    before = np.maximum(after - 1, 0)
    distance: FloatArray = np.minimum(np.abs(samples[after] - t), np.abs(t - samples[before]))
    return distance


def _line_fit(t: FloatArray, values: FloatArray, half_width: float) -> tuple[FloatArray, FloatArray]:
    """Return value and slope (n, m) at each time of straight lines through the neighbours, weighted by a triangle.

    Where nobody is near, the value is kept and the slope taken from the next neighbours.
    """
    n = len(t)
    s0, s1, s2 = np.ones(n), np.zeros(n), np.zeros(n)
    v0, v1 = values.copy(), np.zeros_like(values)
    for offset in range(1, n):
        dt = t[offset:] - t[:-offset]
        weight = np.maximum(1.0 - dt / half_width, 0.0)
        if not weight.any():
            break
        for here, there, sign in (
            (slice(None, -offset), slice(offset, None), 1.0),
            (slice(offset, None), slice(None, -offset), -1.0),
        ):
            s0[here] += weight
            s1[here] += sign * weight * dt
            s2[here] += weight * dt * dt
            v0[here] += weight[:, None] * values[there]
            v1[here] += (sign * weight * dt)[:, None] * values[there]
    slope = np.gradient(values, t, axis=0)
    value = values.copy()
    determinant = s0 * s2 - s1 * s1
    fit = determinant > 1e-3
    d = determinant[fit, None]
    value[fit] = (s2[fit, None] * v0[fit] - s1[fit, None] * v1[fit]) / d
    slope[fit] = (s0[fit, None] * v1[fit] - s1[fit, None] * v0[fit]) / d
    return value, slope
