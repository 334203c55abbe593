"""All that is kept of one address: its filters (two aircraft may share it), and the last seconds for late reports."""

import bisect
import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from wideberth.tracking.config import AdsbKalmanConfig
from wideberth.tracking.delay_kernels import delay_on_path
from wideberth.tracking.filter_bank import FilterBank
from wideberth.tracking.kernels import (
    ACCEPTED,
    NACP_COUNT,
    NACV_COUNT,
    NIC_COUNT,
    RAYLEIGH_95_RADIUS,
    REJECTED,
    SWAPPED,
    nic_bound_of,
    position_sigma_of,
    velocity_sigma_of,
)
from wideberth.tracking.life_kernels import TURN_ACCELERATION, start_axis, start_horizontal, velocity_between
from wideberth.tracking.report_history import (
    ACCEPTED_OUTCOME,
    NO_POSITION_OUTCOME,
    AircraftFilter,
    Entry,
    FilterState,
    Outcome,
    Report,
    State,
    Update,
    entry_time,
)
from wideberth.types import FloatArray, SourceInfo
from wideberth.units import FOOT

_MEMORY_SECONDS = 5.0
"""How long a reported velocity or altitude may serve to start a track."""

REJECT_MEMORY_SECONDS = 10.0
"""How long a rejected position is remembered."""

_SHARED_DISTANCE = 500.0
"""Distance beyond which rejected positions are a second aircraft's, m: receivers' clocks slip by up to 1 s, which looks
like a place 250 m along the track."""

_SPEED_SIGMA = {"A1": 60.0, "A6": 150.0, "A7": 50.0, "B1": 30.0, "B2": 15.0, "B3": 40.0, "B4": 25.0, "B6": 40.0}
SPEED_SIGMA_UNKNOWN = 120.0
"""Spread of each velocity component of an aircraft of unknown velocity, by emitter category (DO-260B), m/s."""

_CLIMB_SIGMA_UNKNOWN = 8.0
"""Spread of the climb rate of an aircraft that has not reported it, m/s."""


def accuracy_of(info: SourceInfo, config: AdsbKalmanConfig) -> tuple[float, float, float]:
    """Return the sigma of position (m) and velocity (m/s) of each axis, and the bound (m) at which a track is lost.

    Assumed values stand for what the aircraft has not said, and for reserved values.
    """
    c = config
    nacp = info.nacp if info.nacp is not None and 0 <= info.nacp < NACP_COUNT else c.assumed_nacp
    nacv = info.nacv if info.nacv is not None and 0 <= info.nacv < NACV_COUNT else c.assumed_nacv
    nic = info.nic if info.nic is not None and 0 <= info.nic < NIC_COUNT else c.assumed_nic
    return position_sigma_of(nacp), velocity_sigma_of(nacv), min(max(nic_bound_of(nic), c.bound_min_m), c.bound_max_m)


@dataclass(slots=True)
class AdsbAircraft:
    """Filters of one address.

    Parameters
    ----------
    address : str
    bank : FilterBank
    config : AdsbKalmanConfig
    """

    address: str
    bank: FilterBank
    config: AdsbKalmanConfig
    info: SourceInfo = field(default_factory=SourceInfo)
    sensor: str = ""
    heard: float = -math.inf
    lost_before: bool = False
    told_late: bool = False
    filters: list[AircraftFilter] = field(default_factory=list)
    position_sigma: float = 0.0
    velocity_sigma: float = 0.0
    bound: float = 0.0
    _last_position: tuple[float, float] | None = None
    _velocity: tuple[int, float, float] | None = None
    _velocity_before: tuple[int, float, float] | None = None
    _altitude: tuple[int, float] | None = None
    _rejected: tuple[tuple[int, float, float], ...] = ()
    _consecutive: int = 0
    _history: list[Entry] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._begin_history(-math.inf)
        self.set_info(self.info)

    @property
    def label(self) -> str:
        """What to call the aircraft in front of people."""
        return self.info.callsign or self.address.upper()

    def name(self, number: int) -> str:
        """Return the label of one of the aircraft with this address."""
        return self.label if number == 1 else f"{self.label}#{number}"

    def set_info(self, info: SourceInfo) -> None:
        """Take over what the aircraft says of its accuracy; assumed values stand for what is missing or reserved."""
        self.info = info
        self.position_sigma, self.velocity_sigma, self.bound = accuracy_of(info, self.config)
        for f in self.filters:
            self._set_bias(f.slot)

    def _set_bias(self, slot: int) -> None:
        self.bank.bias[slot, 0] = self.position_sigma**2
        self.bank.bias[slot, 1] = (self.config.altitude_bias_sigma_ft * FOOT) ** 2

    # The order of reports

    def in_order(self, report: Report) -> bool:
        """Whether no report of later validity has been used."""
        return report.t >= self._history[-1].t

    def handle(self, report: Report) -> tuple[list[Outcome], list[Outcome]]:
        """Use a report in the order of validity: the filters go back and run again where it is late.

        Returns
        -------
        tuple of list of Outcome
            What became of this report and of those run again; and the earlier outcomes that these replace.
        """
        history = self._history
        if self.in_order(report):
            return [self._use(report)], []
        index = bisect.bisect_right(history, report.t, key=entry_time)
        if index == 0:
            return [Outcome(("too late",))], []
        again = history[index:]
        del history[index:]
        self._restore(history[-1].state)
        reports = [report, *(entry.report for entry in again if entry.report is not None)]
        return [self._use(r) for r in reports], [entry.outcome for entry in again if entry.outcome is not None]

    def _use(self, report: Report) -> Outcome:
        update = self.before(report)
        if isinstance(update, Outcome):
            return update
        slot = update.filter.slot
        outcome, _ = self.bank.update([slot], [report.step], [report.z], [report.r], [update.use], [report.time_sigma])
        return self.after(
            update.filter, report, outcome[0].tolist(), self.bank.x[slot].copy(), self.bank.p[slot].copy()
        )

    def before(self, report: Report) -> Update | Outcome:
        """Decide what a report in order is for: the filter to update, or what became of it without an update."""
        z, step = report.z, report.step
        has_position = z[0] == z[0] and z[1] == z[1]
        has_velocity = z[3] == z[3] and z[4] == z[4]
        has_altitude = z[2] == z[2]
        outcome = None
        if has_position:
            position = (z[0], z[1])
            if position == self._last_position and not (
                has_velocity and math.hypot(z[3], z[4]) < self.config.hover_speed_mps
            ):
                outcome = Outcome(("position not new",))
            self._last_position = position
        if outcome is None:
            if has_velocity:
                self._velocity_before, self._velocity = self._velocity, (step, z[3], z[4])
            if has_altitude:
                self._altitude = (step, z[2])
            if not self.filters:
                outcome = self._start(report, has_position)
            elif has_position or len(self.filters) == 1:
                f = self.filters[0] if len(self.filters) == 1 else self._nearest(report)
                with_velocity = has_velocity and self.config.use_reported_velocity
                return Update(f, (has_position, has_altitude, z[5] == z[5], with_velocity))
            else:
                outcome = Outcome(("report without position of a shared address",))
        self._remember(report, outcome)
        return outcome

    def after(self, f: AircraftFilter, report: Report, codes: Sequence[int], x: FloatArray, p: FloatArray) -> Outcome:
        """Draw the consequences of an update.

        Parameters
        ----------
        f : AircraftFilter
        report : Report
        codes : sequence of int
            What became of position, altitude, climb rate, velocity.
        x, p : ndarray, shape (3, 4) and (3, 4, 4)
            Copies of the updated state and covariance.
        """
        if max(codes) <= ACCEPTED:
            outcome = NO_POSITION_OUTCOME
            if codes[0] == ACCEPTED:
                f.accepted += 1
                f.t_position = report.t
                f.fix = (report.step, report.z[0], report.z[1])
                self._consecutive = 0
                outcome = ACCEPTED_OUTCOME
            if codes[1] == ACCEPTED:
                f.vertical_rejects = 0
            if len(self.filters) == 1:
                self._remember(report, outcome, self._state_of(f, x, p, report.step))
                return outcome
        else:
            outcome = self._judge(f, report, codes)
        self._remember(report, outcome)
        return outcome

    def _remember(self, report: Report, outcome: Outcome, single: FilterState | None = None) -> None:
        history = self._history
        filters = tuple(self._filter_state(f) for f in self.filters) if single is None else (single,)
        state = State(filters, self._last_position, self._velocity, self._altitude, self._rejected, self._consecutive)
        history.append(Entry(report.t, report, outcome, state))
        if len(history) > 10:
            horizon = report.t - self.config.late_max_s
            kept_from = bisect.bisect_left(history, horizon, key=entry_time) - 1
            if kept_from > 0:
                del history[:kept_from]

    def _filter_state(self, f: AircraftFilter) -> FilterState:
        bank, slot = self.bank, f.slot
        return self._state_of(f, bank.x[slot].copy(), bank.p[slot].copy(), int(bank.last[slot]))

    @staticmethod
    def _state_of(f: AircraftFilter, x: FloatArray, p: FloatArray, last: int) -> FilterState:
        return FilterState(f.number, f.accepted, f.t_position, f.fix, f.vertical_rejects, x, p, last)

    def _restore(self, state: State) -> None:
        for f in self.filters:
            self.bank.release(f.slot)
        self.filters = []
        for kept in state.filters:
            slot = self.bank.allocate()
            self.bank.x[slot], self.bank.p[slot], self.bank.last[slot] = kept.x, kept.p, kept.last
            self._set_bias(slot)
            self.filters.append(
                AircraftFilter(slot, kept.number, kept.accepted, kept.t_position, kept.fix, kept.vertical_rejects)
            )
        _, self._last_position, self._velocity, self._altitude, self._rejected, self._consecutive = state

    def drop(self, f: AircraftFilter, t: float) -> None:
        """Forget a filter at time `t`; reports of before cannot bring it back."""
        self.bank.release(f.slot)
        self.filters.remove(f)
        self.lost_before = True
        self._rejected = ()
        self._consecutive = 0
        self._begin_history(max(t, self._history[-1].t))

    def _begin_history(self, t: float) -> None:
        filters = tuple(self._filter_state(f) for f in self.filters)
        state = State(filters, self._last_position, self._velocity, self._altitude, self._rejected, self._consecutive)
        self._history = [Entry(t, None, None, state)]

    # One report

    def _judge(self, f: AircraftFilter, report: Report, codes: Sequence[int]) -> Outcome:
        position, altitude, climb, velocity = codes
        counts: list[str] = []
        events: list[str] = []
        if position == ACCEPTED:
            counts.append("position accepted")
            f.accepted += 1
            f.t_position = report.t
            f.fix = (report.step, report.z[0], report.z[1])
            self._consecutive = 0
        elif position == REJECTED:
            counts.append("position outside the gate")
            self._consecutive += 1
            horizon = report.step - round(REJECT_MEMORY_SECONDS / self.bank.dt)
            self._rejected = (
                *(kept for kept in self._rejected[-8:] if kept[0] >= horizon),
                (report.step, report.z[0], report.z[1]),
            )
            events.extend(self._after_reject(f, report, counts))
        if altitude == ACCEPTED:
            f.vertical_rejects = 0
        elif altitude == REJECTED:
            counts.append("altitude outside the gate")
            f.vertical_rejects += 1
            if f.vertical_rejects >= self.config.restart_rejects:
                self._start_vertical(f.slot, report.z, report.r)
                f.vertical_rejects = 0
                counts.append("altitude restarted")
                events.append(f"track {self.name(f.number)}: altitude taken anew after repeated rejections")
        if climb == REJECTED:
            counts.append("climb rate outside the gate")
        if velocity == REJECTED:
            counts.append("velocity outside the gate")
        elif velocity == SWAPPED:
            counts.append("north and east velocity swapped")
        return Outcome(tuple(counts), tuple(events))

    def _nearest(self, report: Report) -> AircraftFilter:
        z, r = report.z, report.r
        distances = [self.bank.distance(f.slot, report.step, z[0], z[1], r[0], report.time_sigma) for f in self.filters]
        return self.filters[distances.index(min(distances))]

    # Starting, starting again

    def _recent_altitude(self, report: Report) -> float:
        if self._altitude is None or report.step - self._altitude[0] > _MEMORY_SECONDS / self.bank.dt:
            return math.nan
        return self._altitude[1]

    def _start(self, report: Report, has_position: bool) -> Outcome:
        if not has_position:
            return Outcome(("no position yet",))
        altitude = self._recent_altitude(report)
        if not math.isfinite(altitude):
            return Outcome(("no altitude yet",))
        self._add(report, altitude, None)
        again = "again" if self.lost_before else "started"
        return Outcome(("position accepted", "track started"), (f"track {self.label} {again}",))

    def _add(self, report: Report, altitude: float, velocity: tuple[float, float, float] | None) -> AircraftFilter:
        used = {f.number for f in self.filters}
        number = next(n for n in range(1, len(used) + 2) if n not in used)
        f = AircraftFilter(self.bank.allocate(), number, 1, report.t, (report.step, report.z[0], report.z[1]))
        self._set_bias(f.slot)
        self.filters.append(f)
        self._start_horizontal(f.slot, report, velocity)
        self._start_vertical(f.slot, (*report.z[:2], altitude, *report.z[3:]), report.r)
        return f

    def _start_horizontal(self, slot: int, report: Report, velocity: tuple[float, float, float] | None) -> None:
        """Set the horizontal axes; `velocity` is north, east and sigma from positions, None: as reported."""
        c, bank = self.config, self.bank
        if velocity is not None:
            north, east, sigma = velocity
        elif c.initialise_from_reported_velocity and self._velocity_is_recent(report.step):
            assert self._velocity is not None  # recent
            _, north, east = self._velocity
            sigma = math.hypot(self.velocity_sigma, c.initial_velocity_sigma_mps)
        else:
            north, east, sigma = 0.0, 0.0, _SPEED_SIGMA.get(self.info.category or "", SPEED_SIGMA_UNKNOWN)
        bank.last[slot] = report.step
        start_horizontal(
            bank.x[slot],
            bank.p[slot],
            np.array(report.z),
            np.array(report.r),
            north,
            east,
            sigma,
            report.time_sigma,
            c.initial_acceleration_sigma_mps2,
            c.initial_jerk_sigma_mps3,
        )

    def _start_vertical(self, slot: int, z: tuple[float, ...], r: tuple[float, ...]) -> None:
        c, bank = self.config, self.bank
        climbing = z[5] == z[5]
        start_axis(
            bank.x[slot, 2],
            bank.p[slot, 2],
            z[2],
            z[5] if climbing else 0.0,
            r[2],
            r[5] if climbing else _CLIMB_SIGMA_UNKNOWN**2,
            c.initial_acceleration_sigma_mps2,
            c.initial_jerk_sigma_mps3,
        )

    def _velocity_is_recent(self, step: int) -> bool:
        return self._velocity is not None and step - self._velocity[0] <= _MEMORY_SECONDS / self.bank.dt

    def _after_reject(self, f: AircraftFilter, report: Report, counts: list[str]) -> list[str]:
        """Decide what a rejected position means: a wrong start, a late one, another aircraft, or a wrong track."""
        if f.accepted < self.config.confirm_positions and len(self.filters) == 1:
            velocity = self._velocity_between(f.fix, (report.step, report.z[0], report.z[1]), report)
            if velocity is not None:
                self._restart(f, report, velocity)
                return []
        agreeing = self._three_agree(report)
        if agreeing is not None:
            first = self._rejected[-3][0]
            fed = [other for other in self.filters if other.fix[0] > first]
            if len(fed) == len(self.filters) == 1:
                delay = self._delay(f, report, agreeing)
                if delay >= 0.0:
                    return self._leave_late(f, counts)
                if delay < 0.0:
                    return self._restart_visibly(f, report, agreeing, "reports that came late")
            altitude = self._recent_altitude(report)
            far = all(self._away(other, report) > _SHARED_DISTANCE for other in self.filters)
            if far and len(fed) == len(self.filters) and math.isfinite(altitude):
                other = self._add(report, altitude, agreeing)
                self._rejected = ()
                return [
                    f"address {self.address.upper()} is used by two aircraft: track {self.name(other.number)} started"
                ]
            oldest = min(self.filters, key=lambda other: other.fix[0])
            return self._restart_visibly(oldest, report, agreeing, "3 rejected positions that agree")
        if self._consecutive >= self.config.restart_rejects:
            oldest = min(self.filters, key=lambda other: other.fix[0])
            return self._restart_visibly(oldest, report, None, f"{self._consecutive} rejected positions")
        return []

    def _leave_late(self, f: AircraftFilter, counts: list[str]) -> list[str]:
        """Count a late position, and tell of the first."""
        self._rejected = self._rejected[-2:]
        counts.append("position late: where its aircraft was")
        told, self.told_late = self.told_late, True
        return [] if told else [f"some reports of {self.name(f.number)} come seconds late: they are not used"]

    def _delay(self, f: AircraftFilter, report: Report, velocity: tuple[float, float, float]) -> float:
        """Return how late rejected positions are that go on with `velocity`, s; NaN: they are another aircraft's."""
        north, east = self._offset(f, report)
        v_north, v_east, _ = velocity
        track = self.bank.x[f.slot, :2, 1].copy()
        if self._velocity is not None and self._velocity_is_recent(report.step):
            _, v_north, v_east = self._velocity
            if self._velocity_before is not None:
                # A track that late positions have spoilt may lead anywhere.
                track[:] = self._velocity_before[1:]
        margin = RAYLEIGH_95_RADIUS * 2.0 * math.sqrt(report.r[0])
        return delay_on_path(north, east, v_north, v_east, track, margin)

    def _away(self, f: AircraftFilter, report: Report) -> float:
        """Return how far a position lies from where a filter expects it, m."""
        return math.hypot(*self._offset(f, report))

    def _offset(self, f: AircraftFilter, report: Report) -> tuple[float, float]:
        """Return where a position lies from where a filter expects it, north and east, m."""
        x, dt = self.bank.x[f.slot], (report.step - int(self.bank.last[f.slot])) * self.bank.dt
        return report.z[0] - x[0, 0] - x[0, 1] * dt, report.z[1] - x[1, 0] - x[1, 1] * dt

    def _restart_visibly(
        self, f: AircraftFilter, report: Report, velocity: tuple[float, float, float] | None, why: str
    ) -> list[str]:
        away = self._away(f, report)
        self._restart(f, report, velocity)
        return [f"track {self.name(f.number)} restarted {away:.0f} m from where it was expected after {why}"]

    def _restart(self, f: AircraftFilter, report: Report, velocity: tuple[float, float, float] | None) -> None:
        self._start_horizontal(f.slot, report, velocity)
        altitude = self._recent_altitude(report)
        if math.isfinite(altitude):
            self._start_vertical(f.slot, (*report.z[:2], altitude, *report.z[3:]), report.r)
        f.accepted = 2 if velocity is not None else 1
        f.t_position = report.t
        f.fix = (report.step, report.z[0], report.z[1])
        self._rejected = ()
        self._consecutive = 0

    def _velocity_between(
        self, first: tuple[int, float, float], last: tuple[int, float, float], report: Report
    ) -> tuple[float, float, float] | None:
        """Return north, east and standard deviation of the velocity from two fixes; None if no aircraft flies so."""
        dt = (last[0] - first[0]) * self.bank.dt
        north, east = last[1] - first[1], last[2] - first[2]
        velocity = velocity_between(dt, north, east, report.r[0], report.time_sigma, self.config.speed_max_mps)
        return None if math.isnan(velocity[0]) else velocity

    def _three_agree(self, report: Report) -> tuple[float, float, float] | None:
        """Return the velocity through the last three rejected positions if one aircraft could have sent them."""
        if len(self._rejected) < 3:
            return None
        a, b, c = self._rejected[-3:]
        first, second = self._velocity_between(a, b, report), self._velocity_between(b, c, report)
        if first is None or second is None:
            return None
        dt = (c[0] - b[0]) * self.bank.dt
        miss = math.hypot(second[0] - first[0], second[1] - first[1]) * dt
        span = (c[0] - a[0]) * self.bank.dt
        noise = RAYLEIGH_95_RADIUS * 2.0 * dt * math.hypot(first[2], second[2])
        if miss > TURN_ACCELERATION * dt * span + noise:
            return None
        return self._velocity_between(a, c, report)
