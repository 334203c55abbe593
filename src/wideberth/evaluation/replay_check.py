"""Does the pipeline decide the same again? A recording is run once more and compared to the last bit."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from wideberth.errors import InputError
from wideberth.recording import Recording
from wideberth.recording_codec import encode
from wideberth.simulation.replay import ReplayWorld
from wideberth.types import Mission, Ownship, Scan, Snapshot


class Stepper(Protocol):
    """What is checked: a pipeline, in its first state."""

    def step(self, t: float, ownship: Ownship, scans: Sequence[Scan], mission: Mission) -> Snapshot:
        """Take one step."""


@dataclass(frozen=True, slots=True)
class ReplayResult:
    """What a replay found.

    Attributes
    ----------
    steps : int
        Steps that were run; with a difference, the last of them has it.
    t : float or None
        Time of the first difference, s; None where all is identical.
    field : str
        Where in the snapshot it is, such as ``tracks[2].position``.
    recorded, replayed : str
        The two values there.
    """

    steps: int
    t: float | None = None
    field: str = ""
    recorded: str = ""
    replayed: str = ""

    @property
    def identical(self) -> bool:
        """Whether every step came out as recorded."""
        return self.t is None


def replay(recording: Recording, pipeline: Stepper, progress: Callable[[int], None] | None = None) -> ReplayResult:
    """Run a recording's inputs through a pipeline and compare each snapshot, stage times aside, bit for bit.

    Parameters
    ----------
    recording : Recording
    pipeline : Stepper
        Made from the recorded scenario, not yet stepped.
    progress : callable, optional
        Told the number of steps done.

    Raises
    ------
    InputError
        If the recording has no mission or no steps.
    """
    if recording.mission is None:
        raise InputError(f"{recording.path} holds no mission: it cannot be replayed")
    if not recording.step_count:
        raise InputError(f"{recording.path} has no steps to replay")
    world = ReplayWorld(((*step[:4], step.mission) for step in recording.steps()), recording.mission)
    count = 0
    while (t := world.next_time) is not None:
        ownship, scans = world.sense(t)
        # The world has the mission's progress once it was sensed.
        snapshot = pipeline.step(t, ownship, scans, world.mission)
        world.actuate(t, snapshot.maneuver)
        count += 1
        assert world.recorded is not None
        recorded = dataclasses.replace(world.recorded, stage_times={})
        replayed = dataclasses.replace(snapshot, stage_times={})
        if encode(recorded) != encode(replayed):
            return ReplayResult(count, t, *first_difference(recorded, replayed))
        if progress is not None:
            progress(count)
    return ReplayResult(count)


def first_difference(a: object, b: object, where: str = "") -> tuple[str, str, str]:
    """Return where two recorded values first differ and what stands there; empty texts where they do not."""
    if encode(a) == encode(b):
        return "", "", ""
    if dataclasses.is_dataclass(a) and type(a) is type(b):
        for item in dataclasses.fields(a):
            found = first_difference(getattr(a, item.name), getattr(b, item.name), f"{where}.{item.name}".lstrip("."))
            if found[0]:
                return found
    if isinstance(a, Mapping) and isinstance(b, Mapping) and list(a) == list(b):
        for key in a:
            found = first_difference(a[key], b[key], f"{where}[{key}]")
            if found[0]:
                return found
    if isinstance(a, tuple | list) and isinstance(b, tuple | list):
        if len(a) != len(b):
            return f"{where} (how many)", str(len(a)), str(len(b))
        for k, (x, y) in enumerate(zip(a, b, strict=True)):
            found = first_difference(x, y, f"{where}[{k}]")
            if found[0]:
                return found
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray) and a.shape == b.shape:
        place = np.argwhere(np.ascontiguousarray(a).view(np.int64) != np.ascontiguousarray(b).view(np.int64))[0]
        index = tuple(int(i) for i in place)
        return f"{where}[{', '.join(map(str, index))}]", repr(float(a[index])), repr(float(b[index]))
    return where or "value", _short(a), _short(b)


def _short(value: object) -> str:
    text = " ".join(repr(value).split())
    return text if len(text) <= 120 else text[:117] + "..."
