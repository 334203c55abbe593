"""What a flight does in one step, without sockets and without waiting: from what was heard to what is commanded."""

import contextlib
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from wideberth.assembly import build_pipeline
from wideberth.config import ScenarioConfig
from wideberth.errors import InputError
from wideberth.evaluation.metrics import RunMetrics
from wideberth.live.autopilot import Autopilot, AutopilotLink
from wideberth.live.clock import LiveClock
from wideberth.live.hand_over_note import HandOverNote
from wideberth.live.inputs import Input, InputLink
from wideberth.live.latency import Histogram
from wideberth.live.live_world import LiveWorld, changed
from wideberth.live.packet_queue import PacketQueue
from wideberth.live.status import health_of, status_of
from wideberth.recording import Recorder
from wideberth.types import Mission, Ownship, Scan, Snapshot


class FlightSteps:
    """The steps of a flight, and what is kept of them.

    Parameters
    ----------
    scenario : ScenarioConfig
        With an autopilot, and inputs.
    out : Path
        Folder for the recording.
    send : callable
        Hands bytes for the autopilot to the system, and returns whether it took them.
    clock : LiveClock

    Raises
    ------
    InputError
        If the scenario has no autopilot, or no input.

    Attributes
    ----------
    autopilot : Autopilot
    queue : PacketQueue
        What comes from the autopilot.
    queues : dict of str to PacketQueue
        What comes to each input, by name.
    link : AutopilotLink
    events : list of str
        What happened since `take_events`, in words.
    recording : Path or None
        The file, once there is one.
    """

    def __init__(self, scenario: ScenarioConfig, out: Path, send: Callable[[bytes], bool], clock: LiveClock) -> None:
        if scenario.autopilot is None:
            raise InputError(
                'autopilot: missing; write [autopilot] kind = "mavlink", connection = "udp:127.0.0.1:14550"'
            )
        if not scenario.inputs:
            raise InputError(
                'inputs: missing; without one nothing is seen: write [[inputs]] kind = "beast", connect = "HOST:30005"'
            )
        self._scenario = scenario
        self._out = out
        self._clock = clock
        self._frame = scenario.origin.frame() if scenario.origin is not None else None
        self.autopilot: Autopilot = scenario.autopilot.target(scenario.autopilot.config, self._frame)
        self.commands = bool(getattr(scenario.autopilot.config, "command", False))
        self._note = HandOverNote(str(getattr(scenario.autopilot.config, "connection", "")))
        self._pipeline = build_pipeline(scenario, time.thread_time, live=True)
        self.queue = PacketQueue()
        self.queues = {part.name: PacketQueue() for part in scenario.inputs}
        self.link = AutopilotLink(self.autopilot, self.queue, send, clock.now, self._keep_note)
        self._t_start = clock.now()
        self._world: LiveWorld | None = None
        self._recorder: Recorder | None = None
        self._recorded_mission: Mission | None = None
        self._metrics = RunMetrics.of(scenario.evaluation)
        self._latency, self._command_latency, self._packet_age = Histogram(), Histogram(), Histogram()
        self._snapshot: Snapshot | None = None
        self._missing = "waiting for telemetry"
        self._states: Counter[str] = Counter()
        self.events: list[str] = []
        self.recording: Path | None = None
        self._recall()

    def _recall(self) -> None:
        """Let the autopilot be given back what a program before this one had taken when it was killed."""
        recall = getattr(self.autopilot, "recall", None)
        if recall is None or not self.commands:
            return
        try:
            text = self._note.left()
            if text is not None:
                recall(text)
                self.events.append("the program before this one was ended in a maneuver: control is given back first")
        except InputError as error:
            self.events.append(f"a note of a maneuver cannot be used, the pilot must take over: {error}")

    def _keep_note(self) -> None:
        """Keep on disk what a program after this one would have to give back, before anything is commanded."""
        if self.commands and (trouble := self._note.keep(getattr(self.autopilot, "hand_over", None))):
            self.events.append(trouble)

    def take_events(self) -> list[str]:
        """Return what happened since the last call, in words."""
        events, self.events = self.events, []
        return events

    def place(self, troubles: Mapping[str, Callable[[], str]]) -> tuple[Input, ...]:
        """Make the inputs, once there is a frame to put what they hear into.

        Parameters
        ----------
        troubles : mapping of str to callable
            Say in words why nothing can come to an input, by name.

        Returns
        -------
        tuple of Input
            Those that are new.
        """
        frame = self._frame if self._frame is not None else self.autopilot.frame
        if frame is None or self._world is not None:
            return ()
        self._frame = frame
        inputs: list[Input] = []
        for part in self._scenario.inputs:
            trouble = troubles.get(part.name, _none)
            link = InputLink(self.queues[part.name], trouble, self._t_start, self.autopilot)
            inputs.append(part.target(part.config, part.name, frame, link))
        self._world = LiveWorld(self.autopilot, inputs)
        return self._world.inputs

    def step(self, t: float) -> Snapshot | None:
        """Take a step at time `t`, s; return what came of it, or None while something is missing.

        What leads to the command comes first, what can wait after it.
        """
        self.link.take()
        world = self._world
        self._missing = "waiting for telemetry" if world is None else world.missing(t)
        if world is None or self._missing:
            self._discard(t)
            self.link.pump()
            self.events += [*self._clock.watch(), *self.autopilot.events()]
            return None
        ownship, scans = world.sense(t)
        arrivals = [arrival for each in world.inputs for arrival in each.take_arrivals()]
        mission = world.mission
        snapshot = self._pipeline.step(t, ownship, scans, mission)
        world.actuate(t, snapshot.maneuver)
        sent = self.link.pump()
        taken = self._clock.now() - t
        self._latency.add(taken)
        if sent and snapshot.maneuver is not None:
            self._command_latency.add(taken)
        for arrival in arrivals:
            self._packet_age.add(t - arrival)
        self._snapshot = snapshot
        self.autopilot.report(t, snapshot)
        told = (*self._clock.watch(), *self.autopilot.events())
        self.events += [*told, *snapshot.events]
        self._states[snapshot.alert_state.name.lower()] += 1
        self._metrics.update(t, snapshot.ownship.position, snapshot.ownship.velocity, None)
        self._metrics.observe(snapshot, taken)
        self._record(snapshot, scans, ownship, mission, told)
        return snapshot

    def _discard(self, t: float) -> None:
        """Forget what was heard while it cannot be put anywhere."""
        if self._world is not None:
            self._world.discard(t)
            return
        for queue in self.queues.values():
            while queue.take() is not None:
                pass

    def _record(
        self, snapshot: Snapshot, scans: list[Scan], ownship: Ownship, mission: Mission, told: tuple[str, ...]
    ) -> None:
        with self._guarded_recording():
            if self.recording is None:
                assert self._frame is not None
                # A recording from before a restart is kept.
                self.recording = _unused(self._out / "recording.mcap")
                self._recorder = Recorder(
                    self.recording, _without_secrets(self._scenario), mission=mission, frame=self._frame, live=True
                )
                self._recorded_mission = mission
            if self._recorder is not None:
                new = mission if changed(self._recorded_mission, mission) else None
                self._recorded_mission = mission
                self._recorder.write(snapshot, scans, None, ownship, new, told)

    @contextlib.contextmanager
    def _guarded_recording(self) -> Iterator[None]:
        """Go on without a recording where the disk is full: flying matters more."""
        try:
            yield
        except InputError as error:
            self._recorder = None
            self.events.append(f"nothing is recorded any more: {error}")

    def close(self, summary: Mapping[str, Any] | None) -> None:
        """Finish the recording, with the summary where there is one."""
        with self._guarded_recording():
            if self._recorder is not None and summary is not None:
                self._recorder.write_summary(summary)
        with self._guarded_recording():
            if self._recorder is not None:
                self._recorder.close()

    def status(self, missed_steps: int) -> dict[str, Any]:
        """Return the status now, with the events since the last; see `status.status_of`."""
        t, world = self._clock.now(), self._world
        inputs = {} if world is None else {each.name: each.health(t) for each in world.inputs}
        mission = world.mission if world is not None and not self._missing else None
        health = health_of(self.autopilot.health(t))
        autopilot = {**health, "state": self.autopilot.state, "link": health["state"]}
        loop = {
            "command": self.commands,
            "missed_steps": missed_steps,
            "step_ms": self._latency.milliseconds(),
            "packet_age_ms": self._packet_age.milliseconds(),
            "host_clock_offset_s": round(self._clock.offset, 3),
            "host_clock_jumps": self._clock.jumps,
            "recording": None if self._recorder is None else str(self.recording),
        }
        return status_of(t, self._snapshot, self._missing, mission, inputs, autopilot, loop, self.take_events())

    def summary(self, missed_steps: int, links: Mapping[str, Mapping[str, int]]) -> dict[str, Any]:
        """Return the scores of the flight, JSON types only, with the counters of its links."""
        world = self._world
        live = {
            "command": self.commands,
            "released": self.autopilot.released,
            "missed_steps": missed_steps,
            "step_ms": self._latency.milliseconds(),
            "command_ms": self._command_latency.milliseconds(),
            "packet_age_ms": self._packet_age.milliseconds(),
            "alert_steps": dict(self._states),
            "host_clock_jumps": self._clock.jumps,
            "world": {} if world is None else world.counters,
            "inputs": {} if world is None else {each.name: each.counters for each in world.inputs},
            "autopilot": dict(self.autopilot.counters),
            "links": {name: dict(counters) for name, counters in links.items()},
            "recording": None if self.recording is None else self.recording.name,
        }
        return self._metrics.summary(
            seed=self._scenario.seed,
            mission=self._recorded_mission,
            mission_completed=world is not None and world.done,
            extra={
                "scenario": self._scenario.name,
                "avoidance": self._scenario.avoid,
                "live": live,
                "tracker": self._pipeline.counters,
            },
        )


def _none() -> str:
    return ""


def _unused(path: Path) -> Path:
    """Return the path, or one with a number where there is such a file."""
    number = 1
    unused = path
    while unused.exists():
        number += 1
        unused = path.with_name(f"{path.stem}-{number}{path.suffix}")
    return unused


def _without_secrets(scenario: ScenarioConfig) -> dict[str, Any]:
    """Return the resolved scenario without the key that signs messages."""
    tables = scenario.resolved()
    tables["autopilot"] = {k: v for k, v in tables["autopilot"].items() if k != "signing_key"}
    return tables
