"""A fleet whose vehicles predict each other's courses (CAS thesis, 4.1.1, 4.1.2, 6.2.2), flown step by step.

What messages go through and how vehicles move are the kernels of the compiled loop, `fleet_kernels.fly`.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth.avoidance.cas import pair_kernels as pair
from wideberth.avoidance.cas.settings import REASONS
from wideberth.avoidance.cas.vehicle_controller import CONTROLLERS, VehicleController
from wideberth.avoidance.cas.vehicle_message import Health, VehicleMessage
from wideberth.errors import InputError
from wideberth.simulation import fleet_kernels
from wideberth.simulation import fleet_message_kernels as kernels
from wideberth.simulation.fleet_config import FleetConfig
from wideberth.types import FloatArray

IntArray = NDArray[np.int64]

_BEYOND = "controller.prediction, communication.velocities and vehicles.health"
_RETURN = 10.0  # s, after which a vehicle intends to be back at its altitude
_COUNTED = {
    kernels.RECEIVED: ("taken", "identity collision"),
    kernels.DUPLICATES: ("duplicate",),
    kernels.OUT_OF_ORDER: ("out of order",),
    kernels.ABSURD: ("absurd", "jump", "from the future"),
    kernels.STALE: ("stale",),
}
"""What a traffic picture counts, by the column of a fleet's counters."""


def predicts(config: FleetConfig) -> bool:
    """Return whether the compiled loop, which takes states as received, does not fly this fleet."""
    return not (_tells_states_only(config) and all(c.prediction.as_received for c in config.controllers))


def _tells_states_only(config: FleetConfig) -> bool:
    return config.communication.velocities and all(v.health == "nominal" for v in config.vehicles)


class PredictedFleet:
    """Flies a fleet with a `VehicleController` for each vehicle that predicts.

    Vehicles that take states as received, or never avoid, decide as in the compiled loop. Intent is to keep to the
    straight track at the altitude wanted; one's own is not looked at, as the controller decides it.

    Parameters
    ----------
    config : FleetConfig

    Raises
    ------
    InputError
        If a vehicle's controller does not go with a prediction, or the fleet is centralised.
    """

    def __init__(self, config: FleetConfig) -> None:
        self._config = config
        self._velocities, self._plain = config.communication.velocities, _tells_states_only(config)
        self._health = [Health[v.health.upper()] for v in config.vehicles]
        self._lookahead = max(c.prediction.lookahead_s for c in config.controllers)
        self._intent = any(c.prediction.intent for c in config.controllers)
        self._start, self._wanted = np.zeros((0, 6)), np.zeros(0)
        self._made()

    def _made(self) -> list[VehicleController | None]:
        """Return new controllers; None for vehicles that need none."""
        if self._config.architecture == "centralised":
            raise InputError(
                "architecture: a hub that decides for all takes states as received; use 'distributed', or "
                f"leave out {_BEYOND}"
            )
        controls: list[VehicleController | None] = []
        for i, c in enumerate(self._config.controllers):
            if c.disable or c.controller == "none" or (self._plain and c.prediction.as_received):
                controls.append(None)
                continue
            if c.controller not in CONTROLLERS:
                raise InputError(
                    f"vehicle {i}: controller '{c.controller}' takes states as received; use one of "
                    f"{', '.join(CONTROLLERS)}, or leave out {_BEYOND}"
                )
            if c.delay_compensation != "timestamp":
                raise InputError(
                    f"vehicle {i}: delay_compensation '{c.delay_compensation}' takes states as received, a prediction "
                    f"moves them on by their age; use 'timestamp', or leave out {_BEYOND}"
                )
            controls.append(VehicleController(c, i))
        return controls

    def fly(
        self,
        x: FloatArray,
        start: FloatArray,
        wanted: FloatArray,
        p: FloatArray,
        q: FloatArray,
        r: FloatArray,
        seed: int,
        encounter: int,
        steps: int,
        log_every: int,
        reasons: IntArray,
        targets: IntArray,
        commands: FloatArray,
        open_events: IntArray,
        scratch: FloatArray,
        b: kernels.Buffers,
        results: kernels.Results,
    ) -> int:
        """Fly the fleet, and return how many avoidances there were; parameters as of `fleet_kernels.fly`."""
        n, dt, ring, events = len(x), float(r[kernels.R_DT]), len(b.newest), 0
        decide_every, send_every = int(r[kernels.R_DECIDE_EVERY]), int(r[kernels.R_SEND_EVERY])
        kernels.reset(b, results)
        self._start, self._wanted = start, wanted
        reasons[:], targets[:], commands[:], open_events[:] = pair.NO_REASON, -1, 0.0, -1
        b.level[:] = start[:, 3:5]
        told = np.full((ring, n), math.nan)  # what avoidance commanded, by step, for messages
        controls = self._made()
        self._begin(controls, r)
        least = fleet_kernels.measure(0.0, x, start, wanted, results)
        for k in range(steps):
            t, sends, decides = k * dt, k % send_every == 0, k % decide_every == 0
            if decides or sends:
                kernels.navigate(k, t, x, wanted, p, r, seed, encounter, scratch, b)
            if sends:
                told[k % ring] = np.where(reasons == pair.NO_REASON, math.nan, commands)
                kernels.send(k, t, seed, encounter, r, b, results, scratch)
            self._deliver(controls, k, t, b, told)
            kernels.receive(k, r, p, b, results)
            for i, control in enumerate(controls if decides else ()):
                if control is None:
                    events = fleet_kernels.avoid(
                        i, t, start, wanted, p, r, reasons, targets, commands, open_events, events, b, results
                    )
                    continue
                before, rate = int(reasons[i]), float(commands[i])
                decision = control.decide(t, b.known[i, :6], float(wanted[i]))
                reasons[i], commands[i] = REASONS.index(decision.reason), decision.rate
                targets[i] = -1 if control.target is None else control.target
                events = fleet_kernels.settle(
                    i, t, before, rate, reasons, targets, commands, open_events, events, results
                )
            if log_every > 0 and k % log_every == 0:
                line = k // log_every
                results.log[line, :, :6], results.log_separation[line] = x, least
                results.log[line, :, kernels.L_COMMAND], results.log[line, :, kernels.L_REASON] = commands, reasons
            for i in range(n):
                fleet_kernels.move(i, x, start, commands, q, dt, scratch, b)
            least = fleet_kernels.measure((k + 1) * dt, x, start, wanted, results)
        results.events[open_events[open_events >= 0], kernels.E_END] = steps * dt
        for i, control in enumerate(controls):
            if control is not None:
                for column, causes in _COUNTED.items():
                    results.counters[i, column] += sum(control.picture.counts[cause] for cause in causes)
        return events

    def _begin(self, controls: list[VehicleController | None], r: FloatArray) -> None:
        """Tell each vehicle of the others' straight flight before the start, by a message that arrives then."""
        if r[kernels.R_BEFORE] == kernels.SILENT:
            return
        sent = -max(float(r[kernels.R_DELAY]), float(r[kernels.R_DT]))
        for i, control in enumerate(controls):
            if control is None:
                continue
            for j, state in enumerate(self._start):
                if i != j:
                    before = np.concatenate([state[:3] + sent * state[3:], state[3:], [self._wanted[j], sent]])
                    control.take(self._message(j, before, math.nan), 0.0)
            control.picture.counts.clear()  # of messages flown with

    def _deliver(
        self, controls: list[VehicleController | None], k: int, t: float, b: kernels.Buffers, told: FloatArray
    ) -> None:
        """Give vehicles that predict the messages that arrive at step `k`, and take these off the ring."""
        ring = len(b.newest)
        arriving = b.newest[k % ring]
        for i, control in enumerate(controls):
            if control is None:
                continue
            for j in map(int, np.flatnonzero(arriving[i] >= 0)):
                slot = int(arriving[i, j]) % ring
                control.take(self._message(j, b.sent[slot, j], told[slot, j]), t)
            arriving[i] = -1

    def _message(self, sender: int, sent: FloatArray, rate: float) -> VehicleMessage:
        """Return a message from what the kernels carry: position, velocity, altitude wanted (down), time."""
        time = float(sent[7])
        return VehicleMessage(
            sender,
            time,
            sent[:3],
            sent[3:6] if self._velocities else None,
            waypoints=self._track(sender, time) if self._intent else None,
            z_wanted=float(sent[6]),
            health=self._health[sender],
            avoidance_rate=None if math.isnan(rate) else float(rate),
        )

    def _track(self, i: int, t: float) -> FloatArray:
        """Return what vehicle `i` intends at `t`, (2, 4): back at its altitude, and then along its straight track."""
        times = t + _RETURN + np.array([[0.0], [self._lookahead]])
        level = self._start[i, :2] + times * self._start[i, 3:5]
        return np.hstack([times, level, np.full((2, 1), self._wanted[i])])
