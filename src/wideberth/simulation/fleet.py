"""A fleet of helicopters that avoid each other by messages, flown from a configuration."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wideberth.avoidance.cas.settings import REASONS, settings
from wideberth.simulation import fleet_hub_kernels, fleet_kernels
from wideberth.simulation import fleet_message_kernels as kernels
from wideberth.simulation.fleet_config import CommunicationConfig, FleetConfig
from wideberth.simulation.fleet_messages import predicts
from wideberth.simulation.predicted_fleet import PredictedFleet
from wideberth.types import FloatArray
from wideberth.vehicles.rotorcraft import parameters

COUNTERS = ("received", "lost", "duplicates", "out_of_order", "absurd", "stale", "switches", "reversals")
_BEFORE = {"silent": kernels.SILENT, "held": kernels.HELD, "straight": kernels.STRAIGHT}
_JITTERS_KEPT = 12.0  # mean jitters that the ring holds; later ones arrive at its end
_EVENTS_PER_VEHICLE = 64


@dataclass(frozen=True, slots=True)
class AvoidanceEvent:
    """One avoidance of one vehicle, for its operator (CAS thesis, 3.3).

    Attributes
    ----------
    vehicle, other : int
        Who avoids, and whom first.
    reason : str
        Why it began: one of `wideberth.avoidance.cas.settings.REASONS`.
    start, end : float
        s; the run's end where it still avoided then.
    first_rate, largest_rate : float
        Commanded velocity down at the start, and the largest, m/s.
    """

    vehicle: int
    other: int
    reason: str
    start: float
    end: float
    first_rate: float
    largest_rate: float


@dataclass(frozen=True, slots=True)
class FleetRun:
    """What came of a run.

    Attributes
    ----------
    separation, separation_time : ndarray, shape (n, n)
        Least distance of each pair, m, and when, s; infinite on the diagonal.
    drift : ndarray, shape (n, 2)
        Farthest above and below the altitude wanted, m.
    aside, late : ndarray, shape (n,)
        Farthest to the side of the straight track, and behind the place on it at that time, m.
    counters : dict of str to ndarray of int64, shape (n,)
        By the names of `COUNTERS`: messages by receiver (those to a hub that decides by sender), decisions without a
        fresh message, switches of avoidance on and off, and reversals within one.
    events : tuple of AvoidanceEvent
    events_unrecorded : int
        Avoidances that found no room.
    time : ndarray, shape (l,)
        s, of the log.
    states : ndarray, shape (l, n, 6)
        Position and velocity, NED.
    commands : ndarray, shape (l, n)
        Commanded velocity down, m/s.
    avoiding : ndarray of bool, shape (l, n)
    least : ndarray, shape (l,)
        Least distance of any pair at that time, m.
    """

    separation: FloatArray
    separation_time: FloatArray
    drift: FloatArray
    aside: FloatArray
    late: FloatArray
    counters: dict[str, NDArray[np.int64]]
    events: tuple[AvoidanceEvent, ...]
    events_unrecorded: int
    time: FloatArray
    states: FloatArray
    commands: FloatArray
    avoiding: NDArray[np.bool_]
    least: FloatArray

    @property
    def least_separation(self) -> float:
        """Least distance of any pair, m."""
        return float(self.separation.min())


class Fleet:
    """A fleet whose buffers serve many runs.

    Parameters
    ----------
    config : FleetConfig
    log_period : float or None
        s between lines of the log; None: no log.

    Raises
    ------
    InputError
        If a controller does not go with its prediction, or a table of conflict probabilities does not fit.
    """

    def __init__(self, config: FleetConfig, log_period: float | None = None) -> None:
        self.config = config
        n = len(config.vehicles)
        self._n, self._dt = n, config.step_s
        self._steps = round(config.duration_s / config.step_s)
        self._log_every = 0 if log_period is None else max(round(log_period / config.step_s), 1)
        logged = 0 if self._log_every == 0 else -(-self._steps // self._log_every)
        self._predicted = PredictedFleet(config) if predicts(config) else None
        self._p = controller_settings(config, predicted=self._predicted is not None)
        self._q, self._run = vehicle_parameters(config), run_settings(config)
        central, ring = config.architecture == "centralised", ring_length(config)
        self._buffers = kernels.make_buffers(n, ring, n + 1 if central else None)
        self._hub = fleet_hub_kernels.make_hub(n, 2 * ring if central else 1)
        self._results = kernels.make_results(n, _EVENTS_PER_VEHICLE * n, logged)
        self._ints = np.zeros((3, n), np.int64)
        self._floats, self._scratch = np.zeros(n), np.zeros(4)
        self.start, self.wanted = start_states(config)

    def fly(self, start: FloatArray | None = None, encounter: int = 0, delay: float | None = None) -> int:
        """Fly once, and return how many avoidances there were; `separation`, `drift` and `counters` hold the rest.

        Parameters
        ----------
        start : ndarray, shape (n, 6), optional
            States at the start, NED; by default the configuration's. The altitudes wanted are then those of the start.
        encounter : int
            Number of the encounter, for its noise.
        delay : float, optional
            s, at most the configuration's.

        Raises
        ------
        ValueError
            If the states have another shape or are not finite, or the delay is longer.
        """
        x = self.start if start is None else np.asarray(start, float)
        if x.shape != (self._n, 6) or not np.all(np.isfinite(x)):
            raise ValueError(f"start must be ({self._n}, 6) finite numbers")
        run = self._run.copy()
        if delay is not None:
            if not 0.0 <= delay <= self.config.communication.delay_s:
                raise ValueError(f"delay {delay} must lie between 0 and the configuration's delay_s")
            run[kernels.R_DELAY] = delay
        wanted = self.wanted if start is None else np.ascontiguousarray(x[:, 2])
        arguments = (
            x.copy(),
            np.ascontiguousarray(x),
            wanted,
            self._p,
            self._q,
            run,
            self.config.seed,
            encounter,
            self._steps,
            self._log_every,
            self._ints[0],
            self._ints[1],
            self._floats,
            self._ints[2],
            self._scratch,
            self._buffers,
        )
        if self._predicted is not None:
            return self._predicted.fly(*arguments, self._results)
        return int(fleet_kernels.fly(*arguments, self._hub, self._results))

    @property
    def separation(self) -> FloatArray:
        """Least distance of each pair (n, n) in the last run, m."""
        return self._results.separation

    @property
    def drift(self) -> FloatArray:
        """Farthest above and below the altitude wanted (n, 2) in the last run, m."""
        return self._results.drift

    @property
    def aside(self) -> FloatArray:
        """Farthest to the side of the straight track (n,) in the last run, m."""
        return self._results.aside

    @property
    def late(self) -> FloatArray:
        """Farthest behind the place on the track (n,) in the last run, m."""
        return self._results.late

    @property
    def counters(self) -> NDArray[np.int64]:
        """Counts (n, 8) of the last run, columns as `COUNTERS`."""
        return self._results.counters

    def result(self, events: int) -> FleetRun:
        """Return all of the last run, which had so many avoidances."""
        r = self._results
        rows = r.events[: min(events, len(r.events))]
        return FleetRun(
            r.separation.copy(),
            r.separation_time.copy(),
            r.drift.copy(),
            r.aside.copy(),
            r.late.copy(),
            {name: r.counters[:, c].copy() for c, name in enumerate(COUNTERS)},
            tuple(event_of(row) for row in rows),
            max(events - len(r.events), 0),
            np.arange(len(r.log), dtype=np.float64) * (self._log_every * self._dt),
            r.log[..., :6].copy(),
            r.log[..., kernels.L_COMMAND].copy(),
            r.log[..., kernels.L_REASON] > 0.0,
            r.log_separation.copy(),
        )


def fly_fleet(config: FleetConfig, log_period: float | None = 0.1) -> FleetRun:
    """Fly a fleet once, and return what came of it; `log_period` as in `Fleet`."""
    fleet = Fleet(config, log_period)
    return fleet.result(fleet.fly())


def _steps(period: float | None, step: float) -> int:
    return 1 if period is None else round(period / step)


def start_states(config: FleetConfig) -> tuple[FloatArray, FloatArray]:
    """Return the states at the start (n, 6), NED, and the positions down wanted (n,)."""
    start = np.array([[*v.position_m, *v.velocity_mps] for v in config.vehicles])
    start[:, [2, 5]] *= -1.0
    wanted = [-(v.position_m[2] if v.altitude_wanted_m is None else v.altitude_wanted_m) for v in config.vehicles]
    return start, np.array(wanted)


def controller_settings(config: FleetConfig, *, predicted: bool = False) -> FloatArray:
    """Return the settings of each vehicle's controller (n, N_SETTINGS); `predicted` as of `settings`."""
    # Once for vehicles that have the same: a threshold's table may have to be read for it.
    rows = {controller: settings(controller, predicted=predicted) for controller in set(config.controllers)}
    return np.array([rows[controller] for controller in config.controllers])


def vehicle_parameters(config: FleetConfig) -> FloatArray:
    """Return the parameters of each vehicle (n, N_PARAMS)."""
    return np.tile(parameters(config.rotorcraft), (len(config.vehicles), 1))


def ring_length(config: FleetConfig) -> int:
    """Return for how many steps messages are kept."""
    radio = config.communication
    longest = (2 if radio.hub else 1) * (radio.delay_s + _JITTERS_KEPT * max(radio.jitter_s, config.step_s))
    return math.ceil(longest / config.step_s) + 2


def event_of(row: FloatArray) -> AvoidanceEvent:
    """Return an avoidance from the kernels' row (N_EVENT,)."""
    return AvoidanceEvent(int(row[0]), int(row[1]), REASONS[int(row[2])], *map(float, row[3:]))


def run_settings(config: FleetConfig) -> FloatArray:
    """Return the settings of the run (N_RUN,)."""
    radio: CommunicationConfig = config.communication
    r = np.zeros(kernels.N_RUN)
    r[kernels.R_DT] = config.step_s
    r[kernels.R_DECIDE_EVERY] = _steps(config.decision_period_s, config.step_s)
    r[kernels.R_SEND_EVERY] = _steps(radio.period_s, config.step_s)
    r[kernels.R_DELAY], r[kernels.R_JITTER] = radio.delay_s, radio.jitter_s
    r[kernels.R_LOSS], r[kernels.R_DUPLICATE], r[kernels.R_ABSURD] = radio.loss, radio.duplicates, radio.absurd
    r[kernels.R_POSITION_SIGMA] = radio.position_sigma_m
    r[kernels.R_OUTAGE_START] = radio.outage_start_s
    r[kernels.R_OUTAGE_END] = radio.outage_start_s + radio.outage_duration_s
    r[kernels.R_OUTAGE_VEHICLE] = -1 if radio.outage_vehicle is None else radio.outage_vehicle
    r[kernels.R_HUB] = radio.hub
    r[kernels.R_BEFORE] = _BEFORE[radio.before_start]
    r[kernels.R_CENTRAL] = config.architecture == "centralised"
    r[kernels.R_SPEED_LIMIT], r[kernels.R_JUMP_LIMIT] = radio.speed_limit_mps, radio.jump_limit_m
    return r
