"""Vehicles of a fleet, and its hub, that know each other by bytes alone, flown step by step in one process."""

import numpy as np

from wideberth.simulation.fleet import COUNTERS, FleetRun
from wideberth.simulation.fleet_config import FleetConfig
from wideberth.simulation.fleet_hub import FleetHub
from wideberth.simulation.fleet_vehicle import FleetVehicle


def check_flown_alike(config: FleetConfig, run: FleetRun, tolerance: float = 0.0) -> None:
    """Check that vehicles with messages that arrive within the step fly as `run`, logged at each step, does."""
    vehicles = [FleetVehicle(config, k) for k in range(len(config.vehicles))]
    hub = FleetHub(config) if config.architecture == "centralised" else None
    for step in range(vehicles[0].steps):
        sent = [vehicle.message(step) for vehicle in vehicles]
        if hub is not None:
            for data in sent:
                if data is not None:
                    hub.take(data, step)
            for k, command in hub.act(step):
                vehicles[k].take(command, step)
        for k, vehicle in enumerate(vehicles):
            for j, data in enumerate(sent):
                if j != k and data is not None and hub is None:
                    vehicle.take(data, step)
            vehicle.act(step)
    assert run.events
    for k, vehicle in enumerate(vehicles):
        record = vehicle.record()
        counters = record.counters + (0 if hub is None else hub.counters[k])
        np.testing.assert_allclose(record.states[:-1], run.states[:, k], rtol=0, atol=tolerance)
        np.testing.assert_allclose(record.commands, run.commands[:, k], rtol=0, atol=tolerance)
        assert np.array_equal(record.reasons > 0, run.avoiding[:, k])
        assert [row[3] for row in record.events] == [e.start for e in run.events if e.vehicle == k]
        assert {name: counters[c] for c, name in enumerate(COUNTERS)} == {
            name: counts[k] for name, counts in run.counters.items()
        }
        assert not record.refused
    assert hub is None or not hub.refused
