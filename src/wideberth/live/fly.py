"""A flight in real time: links, and steps on a fixed grid, until somebody ends it and control is given back."""

import asyncio
import contextlib
import gc
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from wideberth.config import ScenarioConfig
from wideberth.errors import InputError
from wideberth.live.addresses import parse_address
from wideberth.live.clock import LiveClock
from wideberth.live.flight_steps import FlightSteps
from wideberth.live.pacing import Pacer
from wideberth.live.transports import Endpoint, make_endpoint

PUMP_PERIOD = 0.05
"""The autopilot's link is served at least so often, s."""

RELEASE_MAX = 5.0
"""How long giving back control may take, s."""

STATUS_PERIOD = 1.0
COLLECT_EVERY = 60
"""Statuses from one full garbage collection to the next."""

AUTOPILOT = "autopilot link"

Show = Callable[[dict[str, Any]], None]


class Flight:
    """One flight.

    Parameters
    ----------
    scenario : ScenarioConfig
        With an autopilot, and inputs.
    out : Path
        Folder for recording and summary.
    show : callable, optional
        Told the status once a second; must return at once.
    clock : LiveClock, optional

    Raises
    ------
    InputError
        If the scenario has no autopilot, or no input.

    Attributes
    ----------
    steps : FlightSteps
    endpoints : dict of str to Endpoint
        The open ends of links by the names of the inputs, and `AUTOPILOT`.
    """

    def __init__(
        self, scenario: ScenarioConfig, out: Path, show: Show | None = None, clock: LiveClock | None = None
    ) -> None:
        self._clock = clock if clock is not None else LiveClock()
        self.steps = FlightSteps(scenario, out, self._send, self._clock)
        self.endpoints: dict[str, Endpoint] = {}
        self._scenario = scenario
        self._out = out
        self._show = show
        self._pacer = Pacer(self._clock.now(), scenario.step_s)
        self._stopping = asyncio.Event()
        self._statuses = 0

    def stop(self, reason: str) -> None:
        """Ask the flight to end: control is given back first."""
        if not self._stopping.is_set():
            self.steps.events.append(reason)
        self._stopping.set()

    async def run(self, duration: float | None = None) -> dict[str, Any]:
        """Fly until `stop`, or for `duration` seconds, and return the summary.

        Raises
        ------
        InputError
            If a link cannot be opened, or the folder not be written.
        """
        try:
            self._out.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"{self._out}: cannot be made a folder: {error.strerror}") from error
        summary: dict[str, Any] | None = None
        pump: asyncio.Task[None] | None = None
        try:
            await self._open()
            pump = asyncio.create_task(self._pump())
            with _few_collections():
                try:
                    await self._loop(duration)
                finally:
                    # Also where something failed: the vehicle must not stay in our hands.
                    await self._release()
            links = {name: endpoint.counters for name, endpoint in self.endpoints.items()}
            summary = self.steps.summary(self._pacer.missed, links)
        finally:
            if pump is not None:
                pump.cancel()
            for endpoint in self.endpoints.values():
                endpoint.close()
            self.steps.close(summary)
        try:
            (self._out / "summary.json").write_text(json.dumps(summary, indent=2, allow_nan=False) + "\n")
        except OSError as error:
            raise InputError(f"{self._out / 'summary.json'}: cannot be written: {error.strerror}") from error
        return summary

    async def _open(self) -> None:
        assert self._scenario.autopilot is not None
        now, queues = self._clock.now, self.steps.queues
        for part in self._scenario.inputs:
            if transport := str(getattr(part.target, "transport", "")):
                self.endpoints[part.name] = make_endpoint(part.config.address(transport), queues[part.name], now)
        address = parse_address(self._scenario.autopilot.config.connection)
        self.endpoints[AUTOPILOT] = make_endpoint(address, self.steps.queue, now)
        for endpoint in self.endpoints.values():
            await endpoint.open()
        self.steps.queue.on_arrival = _soon(self._serve)

    def _send(self, data: bytes) -> bool:
        endpoint = self.endpoints.get(AUTOPILOT)
        return endpoint is not None and endpoint.send(data)

    def _serve(self) -> bool:
        self.steps.link.pump()
        return False

    async def _pump(self) -> None:
        while True:
            self.steps.link.pump()
            await asyncio.sleep(PUMP_PERIOD)

    async def _loop(self, duration: float | None) -> None:
        now = self._clock.now
        end = now() + duration if duration is not None else float("inf")
        status_due = now()
        pacer = self._pacer = Pacer(now() + self._scenario.step_s, self._scenario.step_s)
        while now() < end:
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(self._stopping.wait(), max(pacer.next_start - now(), 0.0))
                return
            self._place()
            self.steps.step(now())
            if now() >= status_due:
                status_due += max(STATUS_PERIOD, now() - status_due)
                self._tell()
            pacer.finish(now())

    def _place(self) -> None:
        troubles = {name: endpoint.trouble for name, endpoint in self.endpoints.items()}
        for each in self.steps.place(troubles):
            # Read between the steps, so that a step finds little left to read.
            self.steps.queues[each.name].on_arrival = _soon(each.drain)

    def _tell(self) -> None:
        """Show the status, and look after the memory while there is time."""
        self._statuses += 1
        gc.collect(2 if self._statuses % COLLECT_EVERY == 0 else 1)
        status = self.steps.status(self._pacer.missed)
        if self._show is not None:
            self._show(status)

    async def _release(self) -> None:
        """Give back control, for as long as that may take."""
        autopilot, events = self.steps.autopilot, self.steps.events
        autopilot.release(self._clock.now())
        end = self._clock.now() + RELEASE_MAX
        while True:
            self.steps.link.pump()
            if autopilot.released or self._clock.now() >= end:
                break
            await asyncio.sleep(PUMP_PERIOD)
        events += autopilot.events()
        if not autopilot.released:
            events.append(f"control could not be given back within {RELEASE_MAX:.0f} s: the pilot must take it")
        self._tell()


def _soon(call: Callable[[], bool]) -> Callable[[], None]:
    """Return what makes the loop call `call` on its next turn, once however often it is asked.

    While `call` returns True it is called again, one turn of the loop later.
    """
    loop = asyncio.get_running_loop()
    waiting = False

    def run() -> None:
        nonlocal waiting
        waiting = False
        if call():
            ask()

    def ask() -> None:
        nonlocal waiting
        if not waiting:
            waiting = True
            loop.call_soon(run)

    return ask


@contextlib.contextmanager
def _few_collections() -> Iterator[None]:
    """Collect garbage only when it is asked for: what is there before the first step stays."""
    gc.collect()
    gc.freeze()
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
        gc.unfreeze()
