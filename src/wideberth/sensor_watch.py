"""What the sensors can tell at all: who has fallen silent, and whether the sky around the ownship is watched.

An alert state of clear is a statement about the sky, and needs sensors behind it. Silence is never clear, and neither
is a direction into which no radar looks. What aircraft say of themselves watches nothing: it is about those who do.
"""

import dataclasses
import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from wideberth.types import FloatArray, Ownship, Scan, SensorHealth

SILENT_INTERVALS, SILENT_LEAST = 3.0, 1.0
"""A sensor without a scan for so many of its intervals, and for so many seconds, is silent. For as long after its first
scan it watches nothing yet: what it saw once has not become a track."""

WATCHED_PROBABILITY = 0.5
"""A place is watched where an aircraft is seen in at least this share of the looks."""

FLOOD_FACTOR, FLOOD_LEAST = 10.0, 100
"""A scan with so many times the usual plots of its sensor, and at least so many, is a flood: jamming, rain, a fault.
What is seen in it is not known to be all."""

_USUAL_WEIGHT = 0.02  # of a scan in what is usual
_DIRECTIONS = 24
_SEAM = math.radians(5.0)
"""Between the fields of view of two sensors: an aircraft does not get lost in a gap that narrow."""


class SensorWatch:
    """The health of the sensors, those that say nothing included, and what they watch.

    Parameters
    ----------
    intervals : mapping of str to float
        Sensors that are to be heard and that look around, and how often they do, s. Of others only what their scans say
        is known. With none there is nothing to be watched by.
    radius : float
        All around is watched if every point of a level circle of this radius about the ownship is, m.
    """

    def __init__(self, intervals: Mapping[str, float], radius: float) -> None:
        self._intervals = dict(intervals)
        turn = 2.0 * math.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
        self._circle = radius * np.stack([np.cos(turn), np.sin(turn), np.zeros(_DIRECTIONS)], axis=1)
        self._start = math.nan
        self._last: dict[str, Scan] = {}
        self._heard_from: dict[str, float] = {}
        self._usual: dict[str, float] = {}
        self._floods: dict[str, tuple[float, int]] = {}
        self._states: dict[str, str] = {}
        self._watched = True

    def step(
        self, t: float, ownship: Ownship, scans: Sequence[Scan]
    ) -> tuple[dict[str, SensorHealth], bool, tuple[str, ...]]:
        """Take note of a step's scans.

        Parameters
        ----------
        t : float
            Now, s.
        ownship : Ownship
        scans : sequence of Scan

        Returns
        -------
        sensors : dict of str to SensorHealth
        sound : bool
            Whether all sensors are well and all around the ownship is watched.
        events : tuple of str
            What has changed, in words.
        """
        if math.isnan(self._start):
            self._start = t
        sensors = {scan.sensor: scan.health for scan in scans if scan.health is not None}
        for scan in scans:
            if scan.sensor in self._intervals:
                last = self._last.get(scan.sensor)
                if last is None or scan.t - last.t > self._patience(scan.sensor):
                    self._heard_from[scan.sensor] = scan.t
                self._last[scan.sensor] = scan
                self._weigh(scan)
        for name in self._intervals:
            if name not in sensors:
                sensors[name] = self._unheard(t, name)
            since, plots = self._floods.get(name, (-math.inf, 0))
            if t - since <= self._patience(name) and sensors[name].state == "ok":
                sensors[name] = dataclasses.replace(sensors[name], state=f"flooded: {plots} plots in a scan")
        events = self._changes(sensors)
        watched = self._is_watched(t, ownship, sensors)
        if watched is not self._watched:
            events.append("all around is watched again" if watched else "not all around is watched by a sensor")
            self._watched = watched
        return sensors, watched and all(health.state == "ok" for health in sensors.values()), tuple(events)

    def _weigh(self, scan: Scan) -> None:
        """Note whether a scan is a flood; what is no flood is what is usual."""
        name, plots = scan.sensor, len(scan.z)
        usual = self._usual.setdefault(name, float(plots))
        if plots >= FLOOD_LEAST and plots > FLOOD_FACTOR * usual:
            self._floods[name] = (scan.t, plots)
        else:
            self._usual[name] = usual + _USUAL_WEIGHT * (plots - usual)

    def _patience(self, name: str) -> float:
        """Return how long a sensor may say nothing, s."""
        return max(SILENT_INTERVALS * self._intervals[name], SILENT_LEAST)

    def _unheard(self, t: float, name: str) -> SensorHealth:
        """Return the health of a sensor without a scan in this step."""
        scan = self._last.get(name)
        since = self._start if scan is None else scan.t
        known = scan.health if scan is not None and scan.health is not None else SensorHealth(math.inf, 0.0, {})
        age = math.inf if scan is None else t - scan.t
        if t - since <= self._patience(name):
            return dataclasses.replace(known, age=age)
        return dataclasses.replace(known, age=age, rate=0.0, state=f"silent for {t - since:.0f} s")

    def _changes(self, sensors: Mapping[str, SensorHealth]) -> list[str]:
        changes = []
        for name, health in sensors.items():
            before = self._states.get(name, "ok")
            if health.state != before:
                # "silent for 12 s" is no news every second.
                if without_digits(health.state) != without_digits(before):
                    changes.append(f"sensor {name}: {health.state}")
                self._states[name] = health.state
        return changes

    def _is_watched(self, t: float, ownship: Ownship, sensors: Mapping[str, SensorHealth]) -> bool:
        """Return whether the sensors that are well, and have been heard for long enough, watch the whole circle."""
        if not self._intervals:
            return True
        points = ownship.position + self._circle
        missing = np.ones(len(points), np.bool_)
        for name, scan in self._last.items():
            # Times are sums of tenths.
            settled = t - self._heard_from[name] >= self._patience(name) - 1e-6
            if settled and sensors[name].state == "ok":
                missing &= ~_watches(scan, points)
        return not missing.any()


def without_digits(words: str) -> str:
    """Return words without their numbers."""
    return "".join(c for c in words if not c.isdigit())


def _watches(scan: Scan, points: FloatArray) -> NDArray[np.bool_]:
    """Return which points (k, 3) lie in the field of view of a scan, where its sensor sees well enough, shape (k,)."""
    seen = (points - scan.sensor_position) @ scan.sensor_attitude
    azimuth = np.arctan2(seen[:, 1], seen[:, 0])
    elevation = np.arctan2(-seen[:, 2], np.hypot(seen[:, 0], seen[:, 1]))
    inside = (np.abs(azimuth) <= scan.field_of_view[0] + _SEAM) & (np.abs(elevation) <= scan.field_of_view[1] + _SEAM)
    if scan.detection is not None:
        distance = np.sqrt((seen**2).sum(axis=1))
        probability = np.interp(distance, scan.detection.ranges, scan.detection.probabilities, right=0.0)
        inside &= probability >= WATCHED_PROBABILITY
    return np.asarray(inside)
