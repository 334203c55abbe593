"""Before and around a flight: its configuration, its kernels, and the signals that end it."""

import asyncio
import contextlib
import dataclasses
import os
import signal
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numba

from wideberth import kernel_modules
from wideberth.config import ScenarioConfig, apply_override, build_scenario, read_toml
from wideberth.live.fly import Flight, Show

_ENDING = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP)

_NICENESS = -15


def read_flight(path: Path, overrides: Sequence[str] = (), *, command: bool) -> ScenarioConfig:
    """Return the scenario of a flight.

    Parameters
    ----------
    path : Path
    overrides : sequence of str
        ``table.key=value`` each.
    command : bool
        Whether the vehicle is commanded; the scenario does not decide that.

    Raises
    ------
    InputError
        If it cannot be read, or with one line for each thing that is wrong.
    """
    tables = read_toml(path)
    for override in overrides:
        apply_override(tables, override)
    scenario = build_scenario(tables, source=str(path), folder=path.parent)
    if scenario.autopilot is None:
        return scenario
    config = scenario.autopilot.config.model_copy(update={"command": command})
    return dataclasses.replace(scenario, autopilot=dataclasses.replace(scenario.autopilot, config=config))


def prepare(scenario: ScenarioConfig, out: Path, show: Show | None = None) -> Flight:
    """Return a flight whose kernels are compiled, so that none of its steps waits for the compiler; see `Flight`."""
    flight = Flight(scenario, out, show)
    if not vars(numba.config)["DISABLE_JIT"]:
        for name in kernel_modules.loaded():
            kernel_modules.warm_up(name)
    return flight


async def serve(flight: Flight, duration: float | None = None) -> dict[str, Any]:
    """Run a flight until it ends or a signal asks it to, and return the summary."""
    _take_precedence()
    loop = asyncio.get_running_loop()
    for number in _ENDING:
        loop.add_signal_handler(number, flight.stop, f"{signal.Signals(number).name}: control is given back")
    return await flight.run(duration)


def _take_precedence() -> None:
    """Ask the system to let this thread run as soon as it has to: a step needs some milliseconds, but then at once.

    That takes a privilege (CAP_SYS_NICE); without it, it runs as everybody does.
    """
    with contextlib.suppress(OSError):
        if hasattr(os, "sched_setscheduler"):
            # Before all that is not real-time; the kernel leaves them a share even if this one never rested.
            os.sched_setscheduler(0, os.SCHED_RR | os.SCHED_RESET_ON_FORK, os.sched_param(1))
        else:
            os.setpriority(os.PRIO_PROCESS, 0, _NICENESS)
