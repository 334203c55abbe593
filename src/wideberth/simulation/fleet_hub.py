"""The hub of a centralised fleet by itself (CAS thesis, 3.1): it knows the vehicles by their messages, as bytes."""

import math
from collections import Counter

import numpy as np

from wideberth.simulation import fleet_hub_kernels as hub_kernels
from wideberth.simulation import fleet_message_kernels as kernels
from wideberth.simulation.fleet import controller_settings, ring_length, run_settings, start_states
from wideberth.simulation.fleet_config import FleetConfig
from wideberth.simulation.fleet_messages import STATE
from wideberth.simulation.fleet_wire import opened, packed_command
from wideberth.types import FloatArray

STEPS_APART = 50
"""Steps that the clocks of processes may differ."""


class FleetHub:
    """Gathers the messages of all vehicles and decides for each; what carries them is not its business.

    At each step call `take` for each datagram that has come, and `act`.

    Parameters
    ----------
    config : FleetConfig
        Of a centralised fleet.

    Attributes
    ----------
    counters : ndarray of int64, shape (n, N_COUNTERS)
        What has become of the vehicles' messages, by sender.
    refused : Counter of str
        Datagrams by the cause of their refusal.
    """

    def __init__(self, config: FleetConfig) -> None:
        n, ring = len(config.vehicles), ring_length(config) + 2 * STEPS_APART
        self._n, self._seed, self._dt = n, config.seed, config.step_s
        self.steps = round(config.duration_s / config.step_s)
        self._start, self._wanted = start_states(config)
        self._p, self._r = controller_settings(config), run_settings(config)
        # How commands fare on their way is for the vehicles to find.
        self._sure = self._r.copy()
        self._sure[kernels.R_LOSS] = self._sure[kernels.R_DUPLICATE] = 0.0
        self._sure[kernels.R_OUTAGE_START] = math.inf
        self._b, self._hub = kernels.make_buffers(n, ring, n + 1), hub_kernels.make_hub(n, 2 * ring)
        self._results = kernels.make_results(n, 1, 0)
        kernels.reset(self._b, self._results)
        hub_kernels.reset(self._start, self._hub)
        self._every, self._scratch = int(self._r[kernels.R_DECIDE_EVERY]), np.zeros(4)
        self.counters, self.refused = self._results.counters, Counter[str]()

    def take(self, data: bytes, now: int) -> None:
        """Take a datagram that has come by step `now`; the configured link decides when it counts, if it does."""
        came = opened(data)
        if isinstance(came, str):
            self.refused[came] += 1
        elif came.command:
            self.refused["command to a hub"] += 1
        elif came.vehicle >= self._n:
            self.refused["unknown sender"] += 1
        elif not now - len(self._b.newest) + STEPS_APART < came.step < now + STEPS_APART:
            self.refused["too old or from the future"] += 1
        else:
            step, sender = came.step, came.vehicle
            self._b.sent[step % len(self._b.newest), sender] = came.values[:STATE]
            kernels.carry(
                step, now, step * self._dt, self._n, sender, self._seed, 0, self._r, self._b, self._results,
                self._scratch,
            )  # fmt: skip

    def act(self, step: int) -> list[tuple[int, bytes]]:
        """Take in what has arrived, decide where it is time, and return commands: vehicle and datagram."""
        kernels.receive(step, self._r, self._p, self._b, self._results)
        if step % self._every:
            return []
        hub_kernels.decide_for_all(
            step, step * self._dt, self._start, self._wanted, self._p, self._sure, self._seed, 0, self._scratch,
            self._b, self._hub, self._results,
        )  # fmt: skip
        self._b.newest[:, : self._n, self._n] = -1
        commands: FloatArray = self._hub.sent[step // self._every % len(self._hub.sent)]
        return [(i, packed_command(i, step, commands[i])) for i in map(int, np.flatnonzero(self._hub.known > 0.0))]
