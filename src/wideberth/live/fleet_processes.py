"""A fleet as one process for each vehicle, and its hub, which know each other by UDP on loopback only."""

import contextlib
import multiprocessing
import socket
import time
from collections import Counter
from collections.abc import Iterator, Mapping
from functools import partial
from multiprocessing.connection import Connection
from typing import Any

import numpy as np

from wideberth.errors import InputError
from wideberth.simulation import fleet_kernels
from wideberth.simulation import fleet_message_kernels as kernels
from wideberth.simulation.fleet import COUNTERS, FleetRun, event_of, start_states
from wideberth.simulation.fleet_config import FleetConfig
from wideberth.simulation.fleet_hub import FleetHub
from wideberth.simulation.fleet_messages import controller_of, predicts
from wideberth.simulation.fleet_vehicle import FleetVehicle, VehicleRecord

MOST_PROCESSES = 10
_READY_TIME = 300.0  # s until a process has its kernels, compiled in the worst case
_LEAD = 0.3  # s from the word to start until the first step
_DATAGRAM = 2048


def fly_as_processes(
    config: FleetConfig, log_period: float = 0.1, speed_up: float = 1.0
) -> tuple[FleetRun, dict[str, int]]:
    """Fly a fleet with a process for each vehicle, and one for the hub of a centralised fleet, in real time.

    The links' delays and losses are those of the configuration, drawn alike; that of the computer itself comes on top.

    Parameters
    ----------
    config : FleetConfig
        With 2 to 10 vehicles.
    log_period : float
        s between lines of the log.
    speed_up : float
        Times real time.

    Returns
    -------
    run : FleetRun
    counts : dict of str to int
        Steps that began late by more than a step, and datagrams refused, by cause.

    Raises
    ------
    InputError
        If there are too many vehicles, a controller does not go with its prediction, or a process has ended before its
        flight.
    """
    n = len(config.vehicles)
    if n > MOST_PROCESSES:
        raise InputError(f"{n} vehicles: processes are for 2 to {MOST_PROCESSES}; fly without --processes")
    if predicts(config):
        for k in range(n):
            controller_of(config, k)  # an error is told here, not by a process
    if not speed_up > 0:
        raise InputError(f"speed-up {speed_up:g}: give a positive number")
    members = n + (config.architecture == "centralised")
    context = multiprocessing.get_context("spawn")
    with contextlib.ExitStack() as stack:
        sockets = [stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) for _ in range(members)]
        for one in sockets:
            one.bind(("127.0.0.1", 0))
        addresses = [one.getsockname() for one in sockets]
        ends, processes = [], []
        for k in range(members):
            here, there = context.Pipe()
            body = partial(_fly_one, k) if k < n else _decide_for_all
            process = context.Process(target=body, args=(config, sockets[k], addresses, there, speed_up), daemon=True)
            process.start()
            there.close()
            stack.callback(process.terminate)
            ends.append(here)
            processes.append(process)
        for k, end in enumerate(ends):
            _answer(end, k, _READY_TIME)
        start = time.monotonic() + _LEAD
        for end in ends:
            end.send(start)
        longest = config.duration_s / speed_up * 2.0 + 30.0
        answers = [_answer(end, k, longest) for k, end in enumerate(ends)]
        for process in processes:
            process.join(5.0)
    records: list[VehicleRecord] = [record for record, _ in answers[:n]]
    refused: list[Mapping[str, int]] = [record.refused for record in records]
    if members > n:
        (counters, refused_by_hub), _ = answers[n]
        records = [
            record._replace(counters=record.counters + own) for record, own in zip(records, counters, strict=True)
        ]
        refused.append(refused_by_hub)
    counts = Counter({"steps begun late": sum(late for _, late in answers)})
    for causes in refused:
        counts.update(causes)
    return _joined(config, records, log_period), dict(counts)


def _answer(end: Connection, number: int, timeout: float) -> Any:
    try:
        if end.poll(timeout):
            return end.recv()
    except EOFError:
        pass
    raise InputError(f"the process of vehicle {number} has ended or hangs")


def _fly_one(
    number: int,
    config: FleetConfig,
    own: socket.socket,
    addresses: list[tuple[str, int]],
    end: Connection,
    speed_up: float,
) -> None:
    """Fly one vehicle: the body of its process."""
    # What is called first is loaded or compiled, on a vehicle that is then thrown away.
    first = FleetVehicle(config, number)
    data = first.message(0)
    first.take(data or b"", 0)
    first.act(0)
    vehicle = FleetVehicle(config, number)
    others = (
        addresses[-1:] if len(addresses) > len(config.vehicles) else [a for k, a in enumerate(addresses) if k != number]
    )
    start, late = _started(own, end), 0
    for step in range(vehicle.steps):
        late += _begun_late(start, step, config.step_s / speed_up)
        data = vehicle.message(step)
        if data is not None:
            for address in others:
                _send(own, data, address)
        for data in _received(own):
            vehicle.take(data, step)
        vehicle.act(step)
    end.send((vehicle.record(), late))
    end.close()


def _decide_for_all(
    config: FleetConfig,
    own: socket.socket,
    addresses: list[tuple[str, int]],
    end: Connection,
    speed_up: float,
) -> None:
    """Decide for a centralised fleet: the body of its hub's process."""
    FleetHub(config).act(0)  # loaded or compiled, on a hub that is then thrown away
    hub = FleetHub(config)
    start, late = _started(own, end), 0
    for step in range(hub.steps):
        late += _begun_late(start, step, config.step_s / speed_up)
        for data in _received(own):
            hub.take(data, step)
        for vehicle, command in hub.act(step):
            _send(own, command, addresses[vehicle])
    end.send(((hub.counters, dict(hub.refused)), late))
    end.close()


def _started(own: socket.socket, end: Connection) -> float:
    """Say that the process is ready, and return when all start."""
    own.setblocking(False)
    end.send("ready")
    return float(end.recv())


def _begun_late(start: float, step: int, period: float) -> bool:
    """Wait until a step begins, and return whether it begins late by more than a step."""
    wait = start + step * period - time.monotonic()
    if wait > 0.0:
        time.sleep(wait)
    return wait < -period


def _send(own: socket.socket, data: bytes, address: tuple[str, int]) -> None:
    # A full buffer is a lost message, as on any radio.
    with contextlib.suppress(BlockingIOError):
        own.sendto(data, address)


def _received(own: socket.socket) -> Iterator[bytes]:
    with contextlib.suppress(BlockingIOError):
        while True:
            yield own.recv(_DATAGRAM)


def _joined(config: FleetConfig, records: list[VehicleRecord], log_period: float) -> FleetRun:
    """Return the run that the vehicles' records make together."""
    start, wanted = start_states(config)
    n, steps, dt = len(records), len(records[0].commands), config.step_s
    results = kernels.make_results(n, 1, 0)
    kernels.reset(kernels.make_buffers(n, 2), results)
    states = np.ascontiguousarray(np.stack([record.states for record in records], axis=1))
    least = np.array([fleet_kernels.measure(k * dt, states[k], start, wanted, results) for k in range(steps + 1)])
    lines = slice(0, steps, max(round(log_period / dt), 1))
    events = sorted((event_of(row) for record in records for row in record.events), key=lambda e: (e.start, e.vehicle))
    return FleetRun(
        results.separation,
        results.separation_time,
        results.drift,
        results.aside,
        results.late,
        {name: np.array([record.counters[c] for record in records]) for c, name in enumerate(COUNTERS)},
        tuple(events),
        sum(record.events_unrecorded for record in records),
        np.arange(steps, dtype=np.float64)[lines] * dt,
        states[:-1][lines],
        np.stack([record.commands for record in records], axis=1)[lines],
        np.stack([record.reasons for record in records], axis=1)[lines] > 0.0,
        least[:-1][lines],
    )
