"""What the vehicles of a fleet tell each other (CAS thesis, 4.1.1), and the controllers of those that predict."""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth.avoidance.cas.vehicle_controller import CONTROLLERS, VehicleController
from wideberth.avoidance.cas.vehicle_message import Health, VehicleMessage
from wideberth.errors import InputError
from wideberth.simulation import fleet_message_kernels as kernels
from wideberth.simulation.fleet_config import FleetConfig
from wideberth.types import FloatArray

STATE = 8
"""Numbers of a message that the compiled loop carries: position, velocity, altitude wanted (down), time."""
TOLD = 18
"""Numbers of a whole message: the state, the avoidance's velocity down, health and intent (2 x 4); NaN where untold."""

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


def controller_of(config: FleetConfig, i: int) -> VehicleController | None:
    """Return a new controller of vehicle `i` on what it predicts; None where it takes states as received, or none acts.

    Raises
    ------
    InputError
        If the vehicle's controller does not go with a prediction, or the fleet is centralised.
    """
    if config.architecture == "centralised":
        raise InputError(
            "architecture: a hub that decides for all takes states as received; use 'distributed', or "
            f"leave out {_BEYOND}"
        )
    c = config.controllers[i]
    if c.disable or c.controller == "none" or (_tells_states_only(config) and c.prediction.as_received):
        return None
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
    return VehicleController(c, i)


class FleetMessages:
    """Makes the messages of a fleet's vehicles.

    Intent is to keep to the straight track at the altitude wanted.

    Parameters
    ----------
    config : FleetConfig
    start : ndarray, shape (n, 6)
        NED.
    wanted : ndarray, shape (n,)
        Positions down that guidance wants, m.
    """

    def __init__(self, config: FleetConfig, start: FloatArray, wanted: FloatArray) -> None:
        self._start, self._wanted = start, wanted
        self._velocities = config.communication.velocities
        self._health = [int(Health[v.health.upper()]) for v in config.vehicles]
        self._lookahead = max(c.prediction.lookahead_s for c in config.controllers)
        self._intent = any(c.prediction.intent for c in config.controllers)

    def told(self, sender: int, sent: FloatArray, rate: float) -> FloatArray:
        """Return a message (TOLD,) of the state `sent` (STATE,) and the `rate` of its avoidance, NaN for none."""
        row = np.full(TOLD, math.nan)
        row[:STATE] = sent
        if not self._velocities:
            row[3:6] = math.nan
        row[STATE], row[STATE + 1] = rate, self._health[sender]
        if self._intent:
            # Back at its altitude, and then along the straight track.
            times = sent[7] + _RETURN + np.array([[0.0], [self._lookahead]])
            level = self._start[sender, :2] + times * self._start[sender, 3:5]
            row[STATE + 2 :] = np.hstack([times, level, np.full((2, 1), self._wanted[sender])]).ravel()
        return row

    def tell_starts(self, i: int, control: VehicleController, r: FloatArray) -> None:
        """Tell vehicle `i` of the others' straight flight before the start, by a message that arrives then."""
        if r[kernels.R_BEFORE] == kernels.SILENT:
            return
        sent = -max(float(r[kernels.R_DELAY]), float(r[kernels.R_DT]))
        for j, state in enumerate(self._start):
            if i != j:
                before = np.concatenate([state[:3] + sent * state[3:], state[3:], [self._wanted[j], sent]])
                control.take(message_of(j, self.told(j, before, math.nan)), 0.0)
        control.picture.counts.clear()  # of messages flown with


def message_of(sender: int, row: FloatArray) -> VehicleMessage:
    """Return the message that `row` (TOLD,) carries; a health that is none counts as failed."""
    rate, health = float(row[STATE]), row[STATE + 1]
    return VehicleMessage(
        sender,
        float(row[7]),
        row[:3],
        None if np.isnan(row[3:6]).all() else row[3:6],
        waypoints=None if np.isnan(row[STATE + 2 :]).all() else row[STATE + 2 :].reshape(2, 4),
        z_wanted=float(row[6]),
        health=Health(int(health)) if health in (0.0, 1.0, 2.0) else Health.FAILED,
        avoidance_rate=None if math.isnan(rate) else rate,
    )


def deliver(
    i: int,
    control: VehicleController,
    k: int,
    t: float,
    newest: NDArray[np.int64],
    told: FloatArray,
) -> None:
    """Give vehicle `i` the messages that arrive at step `k`, and take these off the ring.

    Parameters
    ----------
    i : int
    control : VehicleController
    k : int
    t : float
        Of the step, s.
    newest : ndarray of int64, shape (ring, n, n)
        Steps of the messages that arrive, by step, receiver and sender; -1 where none does.
    told : ndarray, shape (ring, n, TOLD)
        Messages by step and sender.
    """
    ring = len(newest)
    arriving = newest[k % ring, i]
    for j in map(int, np.flatnonzero(arriving >= 0)):
        control.take(message_of(j, told[int(arriving[j]) % ring, j]), t)
    arriving[:] = -1


def count_taken(i: int, control: VehicleController, counters: NDArray[np.int64]) -> None:
    """Add to `counters` (n, N_COUNTERS) what the vehicle's traffic picture has counted."""
    for column, causes in _COUNTED.items():
        counters[i, column] += sum(control.picture.counts[cause] for cause in causes)
