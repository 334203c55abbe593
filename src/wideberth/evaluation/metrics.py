"""What a run is scored by: losses of separation on true states, alerts, maneuvers and reversals."""

import math
from array import array
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from wideberth.conflict.well_clear import PRESETS, WellClearVolume
from wideberth.evaluation import score_kernels
from wideberth.evaluation.reversals import ReversalCounter
from wideberth.simulation.config import EvaluationConfig
from wideberth.simulation.truth import Truth
from wideberth.types import AlertLevel, Mission, Snapshot
from wideberth.units import FOOT

FloatArray = NDArray[np.float64]

NMAC_HORIZONTAL = 500 * FOOT
NMAC_VERTICAL = 100 * FOOT
# Names of the two volumes that a scenario chooses itself, in the table of each intruder.
COLLISION = "collision_volume"
WELL_CLEAR = "well_clear_volume"


class _Closest(NamedTuple):
    """A closest approach: the larger and the smaller of horizontal / 500 ft and vertical / 100 ft, s, m, m."""

    key: tuple[float, float]
    t: float
    horizontal: float
    vertical: float


class RunMetrics:
    """Score one run, step by step.

    Losses are counted on the true states at each step, one per intruder and run, whatever its length: NMAC within
    500 ft and 100 ft, each well-clear preset, and the scenario's own two volumes.

    Parameters
    ----------
    collision_volume : WellClearVolume
        The scenario's own; `violation_count` counts it.
    well_clear_volume : WellClearVolume or str
        The scenario's own or the name of a preset; `loss_of_well_clear_count` counts it.
    presets : mapping of str to WellClearVolume
        Rows of `loss_of_well_clear_by_volume`.
    horizontal_miss_filter : bool
        False: a closing pair whose modified tau is at most TTHR has lost well clear, wherever it is heading.
        True: only if its projected horizontal miss distance at the CPA is within DTHR, as WCV_TAUMOD is defined.
    """

    def __init__(
        self,
        collision_volume: WellClearVolume,
        well_clear_volume: WellClearVolume | str,
        presets: Mapping[str, WellClearVolume] = PRESETS,
        *,
        horizontal_miss_filter: bool = False,
    ) -> None:
        own = presets[well_clear_volume] if isinstance(well_clear_volume, str) else well_clear_volume
        self._well_clear_name = next((name for name, volume in presets.items() if volume == own), None)
        self.horizontal_miss_filter = horizontal_miss_filter
        self._presets = tuple(presets)
        self._volumes = {**presets, COLLISION: collision_volume, WELL_CLEAR: own}
        self._volume_rows = np.array([(v.dthr, v.zthr, v.tthr, v.tcoa) for v in self._volumes.values()])
        self._losses: dict[str, dict[str, float]] = {name: {} for name in self._volumes}
        self._nmacs: dict[str, float] = {}
        self._closest: dict[str, _Closest] = {}
        self._invalid_truths = 0
        self._truth_seen = False
        self._path_length = 0.0
        self._last_position: FloatArray | None = None
        self._t_first = self._t_last = math.nan
        self._levels: dict[str, AlertLevel] = {}
        self._alerts: list[tuple[float, str]] = []
        self._maneuver_times: list[float] = []
        self._least_bad = 0
        self._last_maneuver_t = math.nan
        self._reversals = ReversalCounter()
        self._step_times = array("d")
        self._sensors: dict[str, dict[str, Any]] = {}
        self._worst_alert = AlertLevel.CLEAR
        self._unknown_steps = 0
        self._callsigns: dict[str, str] = {}

    @classmethod
    def of(cls, config: EvaluationConfig) -> Self:
        """Return the scores that a scenario's ``evaluation`` table asks for."""
        chosen = config.collision_volume
        collision = (
            PRESETS[chosen] if isinstance(chosen, str) else WellClearVolume(chosen.radius_m, chosen.half_height_m)
        )
        return cls(collision, config.well_clear_volume, horizontal_miss_filter=config.horizontal_miss_filter)

    def update(self, t: float, own_position: FloatArray, own_velocity: FloatArray, truth: Truth | None) -> None:
        """Score the true states of one step.

        Parameters
        ----------
        t : float
            Time, s.
        own_position, own_velocity : ndarray, shape (3,)
            Of the ownship, true, local NED, m and m/s.
        truth : Truth or None
            The intruders' true states; None where nobody knows them.
        """
        if self._last_position is not None:
            moved = own_position - self._last_position
            self._path_length += math.sqrt(moved @ moved)
        self._last_position = np.array(own_position)
        if math.isnan(self._t_first):
            self._t_first = t
        self._t_last = t
        if truth is None:
            return
        self._truth_seen = True
        if truth.ids:
            self._score(t, own_position, own_velocity, truth)

    def _score(self, t: float, own_position: FloatArray, own_velocity: FloatArray, truth: Truth) -> None:
        count = len(truth.ids)
        measures = np.empty((count, score_kernels.N_MEASURES))
        inside = np.empty((count, len(self._volume_rows)), np.bool_)
        losses = score_kernels.score_states(
            np.asarray(own_position, float),
            np.asarray(own_velocity, float),
            np.ascontiguousarray(truth.positions, float),
            np.ascontiguousarray(truth.velocities, float),
            NMAC_HORIZONTAL,
            NMAC_VERTICAL,
            self._volume_rows,
            self.horizontal_miss_filter,
            measures,
            inside,
        )
        for name, (larger, smaller, horizontal, vertical) in zip(truth.ids, measures.tolist(), strict=True):
            if math.isnan(larger):
                self._invalid_truths += 1
                continue
            closest = self._closest.get(name)
            # Of equally close instants (level flight past each other) the one where the smaller ratio is least.
            key = (round(larger, 6), smaller)
            if closest is None or key < closest.key:
                self._closest[name] = _Closest(key, t, horizontal, vertical)
            if larger <= 1.0:
                self._nmacs.setdefault(name, t)
        if losses:
            volumes = list(self._volumes)
            for i, j in np.argwhere(inside).tolist():
                self._losses[volumes[j]].setdefault(truth.ids[i], t)

    def observe(self, snapshot: Snapshot, step_time: float | None = None) -> None:
        """Score what the pipeline did in one step.

        Parameters
        ----------
        snapshot : Snapshot
        step_time : float, optional
            How long the step took, s; else the sum of the snapshot's stage times.
        """
        t = snapshot.t
        levels = {threat.track_id: threat.level for threat in snapshot.threats}
        for name, level in levels.items():
            if level >= AlertLevel.CORRECTIVE > self._levels.get(name, AlertLevel.CLEAR):
                self._alerts.append((t, name))
        self._levels = levels
        self._worst_alert = max(self._worst_alert, snapshot.alert_state)
        self._unknown_steps += snapshot.alert_state == AlertLevel.UNKNOWN
        maneuver = snapshot.maneuver
        if maneuver is None:
            self._last_maneuver_t = math.nan
        elif maneuver.t != self._last_maneuver_t:
            self._last_maneuver_t = maneuver.t
            self._maneuver_times.append(t)
            self._least_bad += maneuver.least_bad
        self._reversals.update(snapshot)
        for track in snapshot.tracks:
            if track.info.callsign:
                self._callsigns[track.id] = track.info.callsign
        for name, health in snapshot.sensors.items():
            self._sensors[name] = {
                "state": health.state,
                "age_s": health.age,
                "rate_hz": health.rate,
                "rejects": {cause: int(count) for cause, count in health.rejects.items()},
            }
        taken = sum(snapshot.stage_times.values()) if step_time is None else step_time
        self._step_times.append(taken)

    @property
    def reversals(self) -> int:
        """Reversals so far; see `ReversalCounter`."""
        return self._reversals.count

    def losses(self, volume: str) -> dict[str, float]:
        """Return the time of the first loss of each intruder, for a preset, `COLLISION` or `WELL_CLEAR`."""
        return dict(self._losses[volume])

    def summary(
        self,
        *,
        seed: int,
        mission: Mission | None,
        mission_completed: bool,
        extra: Mapping[str, Any] | None = None,
    ) -> dict[str, Any]:
        """Return the run's scores: JSON types only, None where something is undefined.

        Parameters
        ----------
        seed : int
        mission : Mission or None
            Its length is the sum of its legs, in space.
        mission_completed : bool
        extra : mapping, optional
            Further keys to add, such as the counters of the decoder.
        """
        known = self._truth_seen
        mission_length = None
        if mission is not None:
            mission_length = float(np.linalg.norm(np.diff(mission.waypoints, axis=0), axis=1).sum())
        worst = min(self._closest.items(), key=lambda item: item[1].key, default=None)
        notes = []
        if not known:
            notes.append("the true states are not known: no separation is scored")
        if self._invalid_truths:
            notes.append(f"{self._invalid_truths} true states were not finite and are not scored")
        summary = {
            "intruders": len(self._closest) if known else None,
            "nmac_count": len(self._nmacs) if known else None,
            "loss_of_well_clear_count": len(self._losses[WELL_CLEAR]) if known else None,
            "loss_of_well_clear_by_volume": {
                name: len(self._losses[name]) if known else None for name in self._presets
            },
            "violation_count": len(self._losses[COLLISION]) if known else None,
            "min_horizontal_separation_m": worst[1].horizontal if worst else None,
            "min_vertical_separation_m": worst[1].vertical if worst else None,
            "alerts": len(self._alerts),
            "maneuvers": len(self._maneuver_times),
            "reversals": self._reversals.count,
            "path_length_m": self._path_length,
            "mission_path_length_m": mission_length,
            "mission_completed": bool(mission_completed),
            "step_time_ms": _milliseconds(self._step_times),
            "seed": seed,
            "well_clear_volume": self._well_clear_name or "own",
            "horizontal_miss_filter": self.horizontal_miss_filter,
            "duration_s": self._t_last - self._t_first if self._step_times or known else None,
            "start_time_s": self._t_first,
            "steps": len(self._step_times),
            "closest_intruder": worst[0] if worst else None,
            "closest_time_s": worst[1].t if worst else None,
            "worst_alert": self._worst_alert.name.lower(),
            "unknown_alert_steps": self._unknown_steps,
            "least_bad_maneuvers": self._least_bad,
            "sensors": self._sensors,
            "volumes": {
                name: {"dthr_m": v.dthr, "zthr_m": v.zthr, "tthr_s": v.tthr, "tcoa_s": v.tcoa}
                for name, v in self._volumes.items()
            },
            "rejections": {name: sensor["rejects"] for name, sensor in self._sensors.items()},
            "per_intruder": self._per_intruder(),
            "notes": notes,
            **(extra or {}),
        }
        cleaned = _without_nan(summary)
        assert isinstance(cleaned, dict)
        return cleaned

    def _per_intruder(self) -> list[dict[str, Any]]:
        """Return a row for each intruder, the closest first."""
        rows = []
        for name, closest in sorted(self._closest.items(), key=lambda item: item[1].key):
            first_losses = {v: self._losses[v][name] for v in self._volumes if name in self._losses[v]}
            rows.append(
                {
                    "id": name,
                    "callsign": self._callsigns.get(name),
                    "closest_time_s": closest.t,
                    "horizontal_separation_m": closest.horizontal,
                    "vertical_separation_m": closest.vertical,
                    "separation_ratio": closest.key[0],
                    "nmac_time_s": self._nmacs.get(name),
                    "first_loss_time_s": first_losses,
                    "alerts": sum(1 for _, alerted in self._alerts if alerted == name),
                }
            )
        return rows


def _milliseconds(seconds: Sequence[float]) -> dict[str, float | None]:
    if not seconds:
        return {"mean": None, "p95": None, "max": None}
    values = 1e3 * np.asarray(seconds)
    return {"mean": float(values.mean()), "p95": float(np.percentile(values, 95)), "max": float(values.max())}


def _without_nan(value: object) -> object:
    """Replace what JSON cannot say (NaN, infinities, numpy scalars)."""
    if isinstance(value, Mapping):
        return {str(k): _without_nan(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_without_nan(v) for v in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
