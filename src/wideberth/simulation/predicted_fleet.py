"""A fleet whose vehicles predict each other's courses (CAS thesis, 4.1.1, 4.1.2, 6.2.2), flown step by step.

What messages go through and how vehicles move are the kernels of the compiled loop, `fleet_kernels.fly`.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth.avoidance.cas import pair_kernels as pair
from wideberth.avoidance.cas.settings import REASONS
from wideberth.avoidance.cas.vehicle_controller import VehicleController
from wideberth.simulation import fleet_kernels
from wideberth.simulation import fleet_message_kernels as kernels
from wideberth.simulation.fleet_config import FleetConfig
from wideberth.simulation.fleet_messages import TOLD, FleetMessages, controller_of, count_taken, deliver
from wideberth.types import FloatArray

IntArray = NDArray[np.int64]


class PredictedFleet:
    """Flies a fleet with a `VehicleController` for each vehicle that predicts.

    Vehicles that take states as received, or never avoid, decide as in the compiled loop. One's own intent is not
    looked at, as the controller decides it.

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
        self._made()

    def _made(self) -> list[VehicleController | None]:
        """Return new controllers; None for vehicles that need none."""
        return [controller_of(self._config, i) for i in range(len(self._config.vehicles))]

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
        reasons[:], targets[:], commands[:], open_events[:] = pair.NO_REASON, -1, 0.0, -1
        b.level[:] = start[:, 3:5]
        messages, told = FleetMessages(self._config, start, wanted), np.empty((ring, n, TOLD))
        controls = self._made()
        for i, control in enumerate(controls):
            if control is not None:
                messages.tell_starts(i, control, r)
        least = fleet_kernels.measure(0.0, x, start, wanted, results)
        for k in range(steps):
            t, sends, decides = k * dt, k % send_every == 0, k % decide_every == 0
            if decides or sends:
                kernels.navigate(k, t, x, wanted, p, r, seed, encounter, scratch, b)
            if sends:
                kernels.send(k, t, seed, encounter, r, b, results, scratch)
                for j in range(n):
                    rate = math.nan if reasons[j] == pair.NO_REASON else float(commands[j])
                    told[k % ring, j] = messages.told(j, b.sent[k % ring, j], rate)
            for i, control in enumerate(controls):
                if control is not None:
                    deliver(i, control, k, t, b.newest, told)
            kernels.receive(k, r, p, b, results)
            for i, control in enumerate(controls if decides else ()):
                if control is None:
                    events = fleet_kernels.avoid(
                        i, t, start, wanted, p, r, reasons, targets, commands, open_events, events, b, results
                    )
                else:
                    events = decide(i, control, t, wanted, reasons, targets, commands, open_events, events, b, results)
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
                count_taken(i, control, results.counters)
        return events


def decide(
    i: int,
    control: VehicleController,
    t: float,
    wanted: FloatArray,
    reasons: IntArray,
    targets: IntArray,
    commands: FloatArray,
    open_events: IntArray,
    events: int,
    b: kernels.Buffers,
    results: kernels.Results,
) -> int:
    """Let vehicle `i` decide on what it predicts, and return how many avoidances there were.

    Parameters as of `fleet_kernels.avoid`, but for the controller.
    """
    before, rate = int(reasons[i]), float(commands[i])
    decision = control.decide(t, b.known[i, :6], float(wanted[i]))
    reasons[i], commands[i] = REASONS.index(decision.reason), decision.rate
    targets[i] = -1 if control.target is None else control.target
    return fleet_kernels.settle(i, t, before, rate, reasons, targets, commands, open_events, events, results)
