"""Why well clear was lost although it was avoided: from the recorded truth and what the pipeline knew before."""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wideberth.conflict.well_clear import PRESETS, violation
from wideberth.simulation.recorded import RecordedTraffic
from wideberth.types import AlertLevel, FloatArray, Snapshot
from wideberth.units import DEGREE, FOOT, FOOT_PER_MINUTE, NAUTICAL_MILE

BEFORE = 60.0  # s before the loss that are looked at
STRAIGHT = 30.0  # s of straight flight that the intruder is compared with
SEEN_LATE = 25.0  # s
STALE = 10.0  # s
TURN, OFF_STRAIGHT = 30.0, 150.0  # deg, m: both, or it did not matter
CLIMB_CHANGE, OFF_LEVEL = 500.0, 30.0  # ft/min, m
NEAR_RADIUS, NEAR_HEIGHT = 3 * NAUTICAL_MILE, 1500 * FOOT


@dataclass(slots=True)
class FlightLog:
    """What the pipeline knew and flew at each step; `observe` is a progress callback of `run_scenario`."""

    times: list[float] = field(default_factory=list)
    own: list[FloatArray] = field(default_factory=list)
    updates: list[dict[str, float]] = field(default_factory=list)
    alerted: list[frozenset[str]] = field(default_factory=list)
    avoided: list[frozenset[str] | None] = field(default_factory=list)
    least_bad: list[bool] = field(default_factory=list)

    def observe(self, _elapsed: float, _planned: float, snapshot: Snapshot) -> None:
        """Note one step."""
        maneuver = snapshot.maneuver
        self.times.append(snapshot.t)
        self.own.append(np.concatenate([snapshot.ownship.position, snapshot.ownship.velocity]))
        self.updates.append({track.id: track.t_last_update for track in snapshot.tracks})
        self.alerted.append(frozenset(x.track_id for x in snapshot.threats if x.level >= AlertLevel.CORRECTIVE))
        self.avoided.append(None if maneuver is None else frozenset(maneuver.threat_ids))
        self.least_bad.append(maneuver is not None and maneuver.least_bad)


@dataclass(slots=True)
class Flight:
    """A flight beside the true traffic at its steps.

    Attributes
    ----------
    log : FlightLog
    ids : tuple of str
    times : ndarray, shape (m,)
    own : ndarray, shape (m, 6)
    states : ndarray, shape (m, len(ids), 6)
        NaN where absent.
    """

    log: FlightLog
    ids: tuple[str, ...]
    times: FloatArray
    own: FloatArray
    states: FloatArray

    @staticmethod
    def of(log: FlightLog, truth: RecordedTraffic) -> "Flight":
        """Put a flight beside the truth of its recording."""
        times = np.array(log.times)
        return Flight(log, truth.ids, times, np.array(log.own), truth.truth_many(times))

    def filtered_losses(self, volume: str, addresses: list[str]) -> list[str]:
        """Return those of some aircraft that lose a volume whose modified tau counts only towards a near miss."""
        lost = []
        for address in addresses:
            states = self.states[:, self.ids.index(address)]
            present = np.all(np.isfinite(states), axis=1)
            own, other = self.own[present], states[present]
            inside = violation(PRESETS[volume], own[:, :3], own[:, 3:], other[:, :3], other[:, 3:], miss_filter=True)
            if np.any(inside):
                lost.append(address)
        return lost

    def diagnose(self, address: str, t_loss: float) -> dict[str, Any]:
        """Return what led to a loss: numbers, and the causes in words, the likeliest first."""
        log, k = self.log, max(0, int(np.searchsorted(self.times, t_loss, side="right")) - 1)
        first = int(np.searchsorted(self.times, t_loss - BEFORE))
        before = range(first, k + 1)
        ages = [self.times[i] - log.updates[i][address] for i in before if address in log.updates[i]]
        seen = k
        while seen > 0 and address in log.updates[seen - 1]:
            seen -= 1
        facts: dict[str, Any] = {
            "seen_s_before": self._since([seen] if address in log.updates[k] else [], t_loss),
            "alerted_s_before": self._since([i for i in before if address in log.alerted[i]], t_loss),
            "avoided_s_before": self._since([i for i in before if address in (log.avoided[i] or ())], t_loss),
            "oldest_position_s": round(max(ages), 1) if ages else None,
            "least_bad": any(log.least_bad[i] for i in before),
            "others_within_3_nmi": self._others(address, k),
        }
        facts |= self._motion(self.states[first : k + 1, self.ids.index(address)], self.times[first : k + 1])
        facts["causes"] = _causes(facts)
        return facts

    def _since(self, steps: list[int], t_loss: float) -> float | None:
        return round(t_loss - float(self.times[steps[0]]), 1) if steps else None

    def _others(self, address: str, k: int) -> int:
        relative = self.states[k, :, :3] - self.own[k, :3]
        with np.errstate(invalid="ignore"):
            near = (np.hypot(relative[:, 0], relative[:, 1]) <= NEAR_RADIUS) & (abs(relative[:, 2]) <= NEAR_HEIGHT)
        near[self.ids.index(address)] = False
        return int(np.count_nonzero(near))

    @staticmethod
    def _motion(states: FloatArray, times: FloatArray) -> dict[str, float | None]:
        """Return how an aircraft's flight differed from a straight one up to the last of some states."""
        present: NDArray[np.bool_] = np.all(np.isfinite(states), axis=1)
        states, times = states[present], times[present]
        if len(times) < 2:
            return {"turn_deg": None, "climb_change_fpm": None, "off_straight_m": None, "off_level_m": None}
        course = np.unwrap(np.arctan2(states[:, 4], states[:, 3]))
        start = states[np.searchsorted(times, times[-1] - STRAIGHT)]
        off = states[-1, :3] - start[:3] - start[3:] * min(STRAIGHT, times[-1] - times[0])
        return {
            "turn_deg": round(float(np.ptp(course)) / DEGREE, 0),
            "climb_change_fpm": round(float(np.ptp(states[:, 5])) / FOOT_PER_MINUTE, -1),
            "off_straight_m": round(math.hypot(off[0], off[1]), 0),
            "off_level_m": round(abs(float(off[2])), 0),
        }


def _causes(facts: dict[str, Any]) -> list[str]:
    """Return the causes in words."""
    seen, age, others = facts["seen_s_before"], facts["oldest_position_s"], facts["others_within_3_nmi"]
    causes = []
    if seen is None:
        causes.append("never seen before the loss")
    elif seen < SEEN_LATE:
        causes.append(f"first seen only {seen:.0f} s before")
    if age is not None and age >= STALE:
        causes.append(f"its last position was up to {age:.0f} s old (frozen or missing reports)")
    turn, change = facts["turn_deg"], facts["climb_change_fpm"]
    if turn is not None and turn >= TURN and facts["off_straight_m"] >= OFF_STRAIGHT:
        causes.append(
            f"it turned {turn:.0f} deg in the {BEFORE:.0f} s before"
            f" ({facts['off_straight_m']:.0f} m off its straight path of {STRAIGHT:.0f} s)"
        )
    if change is not None and change >= CLIMB_CHANGE and facts["off_level_m"] >= OFF_LEVEL:
        causes.append(
            f"its climb rate changed by {change:.0f} ft/min in the {BEFORE:.0f} s before"
            f" ({facts['off_level_m']:.0f} m off the height of steady climb)"
        )
    if others:
        causes.append(f"{others} more aircraft within 3 nmi and 1500 ft")
    if facts["least_bad"]:
        causes.append("every path was blocked for a time: the least bad was flown")
    return causes or ["none of the known causes"]
