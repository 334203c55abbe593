"""Sensors of the simulated world: models and receivers bound to the traffic that they sense."""

import dataclasses
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from wideberth.sensors.radar.simulated import SimulatedRadar
from wideberth.simulation.world import TruthSource
from wideberth.types import FloatArray, Ownship, Scan


class TruthScanner(Protocol):
    """A sensor model that makes measurements from true states and needs of the ownship only the place."""

    def sense(self, t: float, positions: FloatArray, velocities: FloatArray, own_position: FloatArray) -> Scan:
        """Return what it measures of aircraft at `positions` with `velocities`, both (k, 3), always the same ones."""


class Receiver(Protocol):
    """What receives something that is not simulated."""

    def sense(self, t: float, own_position: FloatArray) -> Scan:
        """Return what it received since the last call; the ownship is at `own_position` (3,), NED, m."""


class ModelledSensor:
    """A sensor model bound to the traffic that it sees.

    Parameters
    ----------
    model : TruthScanner
    traffic : TruthSource
        Always the same aircraft, in the same order.
    name : str, optional
        What to call it in place of what the model calls itself.
    heard : ndarray of int64, shape (k,), optional
        Which of the aircraft the model is of; by default all.
    """

    def __init__(
        self,
        model: TruthScanner,
        traffic: TruthSource,
        name: str | None = None,
        heard: NDArray[np.int64] | None = None,
    ) -> None:
        self._model, self._traffic, self._name = model, traffic, name
        self._heard = slice(None) if heard is None else heard

    def sense(self, t: float, ownship: Ownship) -> tuple[Scan]:
        """Return what the model measures at time `t`, s."""
        truth = self._traffic.truth(t)
        scan = self._model.sense(t, truth.positions[self._heard], truth.velocities[self._heard], ownship.position)
        return (scan if self._name is None else dataclasses.replace(scan, sensor=self._name),)


class ModelledRadar:
    """A simulated radar bound to the traffic that it sees.

    Parameters
    ----------
    radar : SimulatedRadar
    traffic : TruthSource
        Always the same aircraft, in the same order.
    """

    def __init__(self, radar: SimulatedRadar, traffic: TruthSource) -> None:
        self._radar, self._traffic = radar, traffic

    def sense(self, t: float, ownship: Ownship) -> list[Scan]:
        """Return the radar's scans up to time `t`, s."""
        return self._radar.sense(t, self._states, ownship)

    def _states(self, t: float) -> tuple[FloatArray, FloatArray]:
        truth = self._traffic.truth(t)
        return truth.positions, truth.velocities


class ReceivedTraffic:
    """A receiver of real reports in the simulated world.

    Parameters
    ----------
    receiver : Receiver
    """

    def __init__(self, receiver: Receiver) -> None:
        self._receiver = receiver

    def sense(self, t: float, ownship: Ownship) -> tuple[Scan]:
        """Return what was received up to time `t`, s."""
        return (self._receiver.sense(t, ownship.position),)
