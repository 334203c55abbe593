"""One vehicle of a fleet by itself: it knows the others by their messages only, as bytes."""

import struct
import zlib
from collections import Counter
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wideberth.avoidance.cas import pair_kernels as pair
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
from wideberth.types import FloatArray

_MAGIC = b"WBF1"
# Magic, sender, step; position, velocity, altitude wanted (down) and time; CRC-32 of all before.
_MESSAGE = struct.Struct("<4sHI8d")
_CHECK = struct.Struct("<I")
MESSAGE_BYTES = _MESSAGE.size + _CHECK.size
_MARGIN = 50  # steps that clocks and scheduling may differ


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
    """

    def __init__(self, config: FleetConfig, number: int) -> None:
        n = len(config.vehicles)
        self.number, self._n, self._seed = number, n, config.seed
        self.steps, self._dt = round(config.duration_s / config.step_s), config.step_s
        self._start, self._wanted = start_states(config)
        self._x = self._start.copy()
        self._p, self._q, self._r = controller_settings(config), vehicle_parameters(config), run_settings(config)
        self._b = kernels.make_buffers(n, ring_length(config) + 2 * _MARGIN)
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
        body = _MESSAGE.pack(_MAGIC, self.number, step, *self._b.sent[step % len(self._b.newest), self.number])
        return body + _CHECK.pack(zlib.crc32(body))

    def take(self, data: bytes, now: int) -> None:
        """Take a datagram that has come by step `now`; the configured link decides when it counts, if it does."""
        if len(data) != MESSAGE_BYTES:
            self.refused["wrong length"] += 1
            return
        body = data[: _MESSAGE.size]
        if _CHECK.unpack_from(data, _MESSAGE.size)[0] != zlib.crc32(body):
            self.refused["wrong check sum"] += 1
            return
        magic, sender, step, *values = _MESSAGE.unpack(body)
        if magic != _MAGIC:
            self.refused["no message of a fleet"] += 1
        elif sender >= self._n:
            self.refused["unknown sender"] += 1
        elif sender == self.number:
            self.refused["own number: two vehicles have it"] += 1
        elif not now - len(self._b.newest) + _MARGIN < step < now + _MARGIN:
            self.refused["too old or from the future"] += 1
        else:
            self._b.sent[step % len(self._b.newest), sender] = values
            kernels.carry(
                step, now, step * self._dt, self.number, sender, self._seed, 0, self._r, self._b, self._results,
                self._scratch,
            )  # fmt: skip

    def act(self, step: int) -> None:
        """Take in what has arrived, decide where it is time, and fly on by one step."""
        i = self.number
        kernels.receive(step, self._r, self._p, self._b, self._results)
        if step % self._decide_every == 0:
            self._events = fleet_kernels.avoid(
                i, step * self._dt, self._start, self._wanted, self._p, self._r, self._reasons, self._targets,
                self._commands, self._open, self._events, self._b, self._results,
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
        return VehicleRecord(
            self._states,
            self._flown[:, 0].copy(),
            self._flown[:, 1].copy(),
            rows[: min(self._events, len(rows))].copy(),
            max(self._events - len(rows), 0),
            self._results.counters[i].copy(),
            dict(self.refused),
        )
