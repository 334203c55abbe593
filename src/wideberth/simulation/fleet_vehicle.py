"""One vehicle of a fleet by itself: it knows the others by their messages only, as bytes."""

import math
from collections import Counter
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wideberth.avoidance.cas import pair_kernels as pair
from wideberth.simulation import fleet_hub_kernels as hub_kernels
from wideberth.simulation import fleet_kernels
from wideberth.simulation import fleet_message_kernels as kernels
from wideberth.simulation.fleet import (
    controller_settings,
    ring_length,
    run_settings,
    start_states,
    vehicle_parameters,
)
from wideberth.simulation.fleet_config import FleetConfig
from wideberth.simulation.fleet_hub import STEPS_APART
from wideberth.simulation.fleet_messages import (
    STATE,
    TOLD,
    FleetMessages,
    controller_of,
    count_taken,
    deliver,
    predicts,
)
from wideberth.simulation.fleet_wire import opened, packed_message
from wideberth.simulation.predicted_fleet import decide
from wideberth.types import FloatArray


class VehicleRecord(NamedTuple):
    """What a vehicle knows of its own flight.

    Attributes
    ----------
    states : ndarray, shape (steps + 1, 6)
        NED.
    commands, reasons : ndarray, shape (steps,)
    events : ndarray, shape (e, N_EVENT)
    events_unrecorded : int
    counters : ndarray of int64, shape (N_COUNTERS,)
    refused : dict of str to int
        Datagrams by the cause of their refusal.
    """

    states: FloatArray
    commands: FloatArray
    reasons: FloatArray
    events: FloatArray
    events_unrecorded: int
    counters: NDArray[np.int64]
    refused: dict[str, int]


class FleetVehicle:
    """A vehicle that flies, sends and decides; what carries its messages is not its business.

    At each step call `message`, `take` for each datagram that has come, and `act`.

    Parameters
    ----------
    config : FleetConfig
    number : int
        Which of the fleet's vehicles.

    Raises
    ------
    InputError
        If the controller does not go with its prediction.
    """

    def __init__(self, config: FleetConfig, number: int) -> None:
        n = len(config.vehicles)
        self.number, self._n, self._seed = number, n, config.seed
        self.steps, self._dt = round(config.duration_s / config.step_s), config.step_s
        self._start, self._wanted = start_states(config)
        self._x = self._start.copy()
        predicted = predicts(config)
        self._control = controller_of(config, number) if predicted else None
        self._p = controller_settings(config, predicted=predicted)
        self._q, self._r = vehicle_parameters(config), run_settings(config)
        central, ring = config.architecture == "centralised", ring_length(config) + 2 * STEPS_APART
        self._b = kernels.make_buffers(n, ring, n + 1 if central else None)
        self._hub = hub_kernels.make_hub(n, 2 * ring) if central else None
        self._messages = FleetMessages(config, self._start, self._wanted)
        self._told = np.empty((len(self._b.newest), n, TOLD))
        if self._control is not None:
            self._messages.tell_starts(number, self._control, self._r)
        self._results = kernels.make_results(n, 64, 0)
        kernels.reset(self._b, self._results)
        self._reasons, self._targets = np.full(n, pair.NO_REASON), np.full(n, -1)
        self._open, self._commands, self._scratch = np.full(n, -1), np.zeros(n), np.zeros(4)
        self._b.level[:] = self._start[:, 3:5]
        self._events = 0
        self._decide_every = int(self._r[kernels.R_DECIDE_EVERY])
        self._send_every = int(self._r[kernels.R_SEND_EVERY])
        self._states = np.empty((self.steps + 1, 6))
        self._flown = np.zeros((self.steps, 2))
        self.refused: Counter[str] = Counter()

    def message(self, step: int) -> bytes | None:
        """Return the message of this step, None where none is due; call it first in each step."""
        sends = step % self._send_every == 0
        if sends or step % self._decide_every == 0:
            kernels.navigate(
                step, step * self._dt, self._x, self._wanted, self._p, self._r, self._seed, 0, self._scratch, self._b
            )
        if not sends:
            return None
        i = self.number
        rate = math.nan if self._reasons[i] == pair.NO_REASON else float(self._commands[i])
        return packed_message(i, step, self._messages.told(i, self._b.sent[step % len(self._b.newest), i], rate))

    def take(self, data: bytes, now: int) -> None:
        """Take a datagram that has come by step `now`; the configured link decides when it counts, if it does."""
        came, i, ring = opened(data), self.number, len(self._b.newest)
        central = self._hub is not None
        if isinstance(came, str):
            self.refused[came] += 1
        elif came.command != central:
            self.refused["not for a vehicle of this fleet"] += 1
        elif came.vehicle >= self._n:
            self.refused["unknown sender"] += 1
        elif central and came.vehicle != i:
            self.refused["command to another vehicle"] += 1
        elif not central and came.vehicle == i:
            self.refused["own number: two vehicles have it"] += 1
        elif not now - ring + STEPS_APART < came.step < now + STEPS_APART:
            self.refused["too old or from the future"] += 1
        else:
            sender = came.vehicle
            if self._hub is not None:
                sender = self._n
                self._hub.sent[came.step // self._decide_every % len(self._hub.sent), i] = came.values
            else:
                self._told[came.step % ring, sender] = came.values
                state = self._b.sent[came.step % ring, sender]
                state[:] = came.values[:STATE]
                if np.isnan(state[3:6]).all():
                    state[3:6] = 0.0  # untold; the compiled checks want one
            kernels.carry(
                came.step, now, came.step * self._dt, i, sender, self._seed, 0, self._r, self._b, self._results,
                self._scratch,
            )  # fmt: skip

    def act(self, step: int) -> None:
        """Take in what has arrived, decide where it is time, and fly on by one step."""
        i, t = self.number, step * self._dt
        if self._control is not None:
            deliver(i, self._control, step, t, self._b.newest, self._told)
        kernels.receive(step, self._r, self._p, self._b, self._results)
        if self._hub is not None:
            before, rate = int(self._reasons[i]), float(self._commands[i])
            hub_kernels.obey(
                i, step, self._start[i], self._wanted[i], self._p[i], self._r, self._reasons, self._targets,
                self._commands, self._b, self._hub, self._results,
            )  # fmt: skip
            self._events = fleet_kernels.settle(
                i, t, before, rate, self._reasons, self._targets, self._commands, self._open, self._events,
                self._results,
            )  # fmt: skip
        elif step % self._decide_every == 0 and self._control is not None:
            self._events = decide(
                i, self._control, t, self._wanted, self._reasons, self._targets, self._commands, self._open,
                self._events, self._b, self._results,
            )  # fmt: skip
        elif step % self._decide_every == 0:
            self._events = fleet_kernels.avoid(
                i, t, self._start, self._wanted, self._p, self._r, self._reasons, self._targets, self._commands,
                self._open, self._events, self._b, self._results,
            )  # fmt: skip
        self._states[step] = self._x[i]
        self._flown[step] = self._commands[i], self._reasons[i]
        fleet_kernels.move(i, self._x, self._start, self._commands, self._q, self._dt, self._scratch, self._b)
        self._states[step + 1] = self._x[i]

    def record(self) -> VehicleRecord:
        """Return the flight, after its last step."""
        i, rows = self.number, self._results.events
        if self._open[i] >= 0:
            rows[self._open[i], kernels.E_END] = self.steps * self._dt
        counters = self._results.counters.copy()
        if self._control is not None:
            count_taken(i, self._control, counters)
        return VehicleRecord(
            self._states,
            self._flown[:, 0].copy(),
            self._flown[:, 1].copy(),
            rows[: min(self._events, len(rows))].copy(),
            max(self._events - len(rows), 0),
            counters[i],
            dict(self.refused),
        )
