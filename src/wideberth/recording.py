"""Recordings: every step of a run in an MCAP file, exact to the bit, readable up to the last second after a crash.

The file has five channels. ``scenario`` holds one JSON message, the others one msgpack message a step: ``inputs`` (what
came in), ``snapshot`` (what was made of it) and, in simulation, ``truth``; a finished run ends with its ``summary``, in
JSON. Each channel's schema says how to read it.
"""

import contextlib
import math
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import IO, Any, NamedTuple, Self

import msgspec
import numpy as np
from mcap.records import Channel, Chunk, DataEnd, Header, Message
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.writer import CompressionType, Writer
from numpy.typing import NDArray

from wideberth import __version__
from wideberth.errors import InputError
from wideberth.frames import LocalFrame
from wideberth.recording_codec import ARRAY_TEXT, decoder, describe, encode, encode_other
from wideberth.simulation.truth import Truth
from wideberth.types import Maneuver, Mission, Ownship, Scan, SensorHealth, Snapshot, SourceInfo, Threat, Track

FloatArray = NDArray[np.float64]

# 2: inputs may hold a new mission and what happened outside the pipeline; the scenario says whether it was flown.
FORMAT_VERSION = 2
PROFILE = "wideberth"
# A chunk ends only where we say so: then it always holds whole steps.
_CHUNK_SIZE = 1 << 40
_RECORD_SIZE_MAX = 1 << 30


class RecordedStep(NamedTuple):
    """One step of a recording.

    Attributes
    ----------
    t : float
        Time, s.
    ownship : Ownship
        As it went into the pipeline.
    scans : list of Scan
        As they went into the pipeline.
    snapshot : Snapshot
        What came out.
    truth : Truth or None
        The true states, where the world knew them.
    mission : Mission or None
        Where it changed in flight: the new one.
    told : tuple of str
        What happened outside the pipeline, in words, such as on the link to the autopilot.
    """

    t: float
    ownship: Ownship
    scans: list[Scan]
    snapshot: Snapshot
    truth: Truth | None
    mission: Mission | None = None
    told: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class _Inputs:
    t: float
    ownship: Ownship
    scans: list[Scan]
    mission: Mission | None = None
    told: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class _MissionText:
    waypoints: list[list[float]]
    speeds: list[float]
    t_start: float
    index: int
    assumed: bool = False


@dataclass(frozen=True, slots=True)
class _Preamble:
    version: int
    wideberth: str
    scenario: dict[str, Any]
    mission: _MissionText | None
    origin_latitude: float
    origin_longitude: float
    live: bool = False


class Recorder:
    """Write a recording; a context manager.

    A finished chunk goes to the file at least once a second of recorded time, so that a killed process loses less than
    its last second.

    Parameters
    ----------
    path : str or Path
        File to write; replaced where it exists.
    scenario : mapping
        The resolved scenario, JSON types only.
    mission : Mission or None
        What the ownship flies; replay needs it.
    frame : LocalFrame
        The local frame's origin.
    flush_period : float
        Longest recorded time between two writes to the file, s.
    live : bool
        Whether the inputs are those of a flight, not of the scenario's sensors; replay needs to know.

    Raises
    ------
    InputError
        If the file cannot be opened or, later, written (a full disk).
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        scenario: Mapping[str, Any],
        *,
        mission: Mission | None,
        frame: LocalFrame,
        flush_period: float = 1.0,
        live: bool = False,
    ) -> None:
        self.path = Path(path)
        self._flush_period = flush_period
        self._chunk_start = math.nan
        self._t = math.nan
        self._sequence = 0
        self._failed = False
        preamble = _Preamble(
            FORMAT_VERSION,
            __version__,
            dict(scenario),
            None
            if mission is None
            else _MissionText(
                mission.waypoints.tolist(),
                mission.speeds.tolist(),
                float(mission.t_start),
                int(mission.index),
                mission.assumed,
            ),
            frame.latitude,
            frame.longitude,
            live,
        )
        try:
            text = msgspec.json.encode(preamble, enc_hook=_encode_plain)
        except (TypeError, NotImplementedError) as error:
            raise InputError(f"the scenario cannot be recorded: {error}") from error
        try:
            self._file: IO[bytes] = self.path.open("wb")
        except OSError as error:
            raise self._error(error) from error
        self._writer = Writer(self._file, chunk_size=_CHUNK_SIZE, compression=CompressionType.ZSTD)
        with _Guard(self):
            self._writer.start(PROFILE, f"wideberth {__version__}")
            self._channels = {
                "scenario": self._channel("scenario", "json", "JSON: " + describe(_Preamble, _MissionText)),
                "inputs": self._channel(
                    "inputs", "msgpack", ARRAY_TEXT + describe(_Inputs, Ownship, Scan, SourceInfo, Mission)
                ),
                "snapshot": self._channel(
                    "snapshot",
                    "msgpack",
                    ARRAY_TEXT + describe(Snapshot, Ownship, Track, SourceInfo, Threat, Maneuver, SensorHealth),
                ),
                "truth": self._channel("truth", "msgpack", ARRAY_TEXT + describe(Truth)),
                "summary": self._channel("summary", "json", "JSON: the scores of the finished run, as in summary.json"),
            }
            start = 0 if mission is None else _nanoseconds(mission.t_start)
            self._writer.add_message(self._channels["scenario"], start, text, start)
            self._writer.flush()  # type: ignore[no-untyped-call]

    def _channel(self, topic: str, encoding: str, schema: str) -> int:
        schema_id = self._writer.register_schema(f"wideberth.{topic}", "text", schema.encode())
        return self._writer.register_channel(topic, encoding, schema_id)

    def write(
        self,
        snapshot: Snapshot,
        scans: list[Scan],
        truth: Truth | None = None,
        telemetry: Ownship | None = None,
        mission: Mission | None = None,
        told: tuple[str, ...] = (),
    ) -> None:
        """Add one step.

        Parameters
        ----------
        snapshot : Snapshot
            What came out.
        scans : list of Scan
            What went in.
        truth : Truth, optional
            The true states.
        telemetry : Ownship, optional
            What went in, if not the snapshot's.
        mission : Mission, optional
            What the ownship flies from now on, where that changed.
        told : tuple of str
            What happened outside the pipeline, in words.
        """
        t = snapshot.t
        ownship = snapshot.ownship if telemetry is None else telemetry
        with _Guard(self):
            self._add("inputs", t, _Inputs(t, ownship, list(scans), mission, told))
            self._add("snapshot", t, snapshot)
            if truth is not None:
                self._add("truth", t, truth)
            self._sequence += 1
            if math.isnan(self._chunk_start):
                self._chunk_start = t
            # The next step, if as long as this one, would pass the period: write now.
            step = 0.0 if math.isnan(self._t) else max(0.0, t - self._t)
            self._t = t
            if not 0 <= t + step - self._chunk_start < self._flush_period - 1e-9:
                self._writer.flush()  # type: ignore[no-untyped-call]
                self._chunk_start = math.nan

    def _add(self, topic: str, t: float, value: object) -> None:
        stamp = _nanoseconds(t)
        self._writer.add_message(self._channels[topic], stamp, encode(value), stamp, self._sequence)

    def write_summary(self, summary: Mapping[str, Any]) -> None:
        """Add the scores of the finished run, JSON types only."""
        with _Guard(self):
            stamp = 0 if math.isnan(self._t) else _nanoseconds(self._t)
            self._writer.add_message(self._channels["summary"], stamp, msgspec.json.encode(summary), stamp)

    def close(self) -> None:
        """Finish the file. Does nothing when it is closed."""
        if self._file.closed:
            return
        with _Guard(self):
            self._writer.finish()  # type: ignore[no-untyped-call]
            self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if not self._failed:
            self.close()

    def _error(self, error: OSError) -> InputError:
        return InputError(f"cannot write the recording {self.path}: {error.strerror or error}")

    def _abandon(self) -> None:
        self._failed = True
        # The buffered rest cannot be written either; the first error is the one to report.
        with contextlib.suppress(OSError):
            self._file.close()


class _Guard:
    """Turn a failed write into one clear error, and leave the file as it is."""

    def __init__(self, recorder: Recorder) -> None:
        self._recorder = recorder

    def __enter__(self) -> None:
        if self._recorder._failed:
            raise InputError(f"cannot write the recording {self._recorder.path}: an earlier write failed")

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if isinstance(error, OSError):
            self._recorder._abandon()
            raise self._recorder._error(error) from error


def _encode_plain(value: object) -> object:
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if isinstance(value, np.ndarray):
        return value.tolist()
    return encode_other(value)


def _nanoseconds(t: float) -> int:
    # MCAP stamps are unsigned; a time before zero is kept exactly inside the message.
    return max(0, round(t * 1e9))


@dataclass(frozen=True)
class Recording:
    """A recording in memory, compressed; iterating gives (t, Ownship, list of Scan, Snapshot) of each step.

    Attributes
    ----------
    path : Path
    scenario : dict
        The resolved scenario.
    mission : Mission or None
    frame : LocalFrame
    complete : bool
        False where the run was killed or the file is damaged; then everything before the damage is here.
    message : str
        How much there is, in words.
    step_count : int
    t_start, t_end : float
        Times of the first and the last step, s; NaN without steps.
    summary : dict or None
        The scores, where the run was finished.
    live : bool
        Whether the inputs are those of a flight.
    """

    path: Path
    scenario: dict[str, Any]
    mission: Mission | None
    frame: LocalFrame
    complete: bool
    message: str
    step_count: int
    t_start: float
    t_end: float
    summary: dict[str, Any] | None
    live: bool
    _chunks: list[Chunk] = field(repr=False)

    def steps(self) -> Iterator[RecordedStep]:
        """Yield every step in order, with the truth where there is one."""
        for chunk in self._chunks:
            yield from _steps(chunk, self.path)

    def __iter__(self) -> Iterator[tuple[float, Ownship, list[Scan], Snapshot]]:
        for step in self.steps():
            yield step[:4]

    def truths(self) -> Iterator[Truth]:
        """Yield the true states of each step that has them."""
        return (step.truth for step in self.steps() if step.truth is not None)


def _chunk_messages(chunk: Chunk) -> list[tuple[str, Message]]:
    topics: dict[int, str] = {}
    messages = []
    for record in breakup_chunk(chunk, validate_crc=True):
        if isinstance(record, Channel):
            topics[record.id] = record.topic
        elif isinstance(record, Message):
            messages.append((topics.get(record.channel_id, _TOPICS.get(record.channel_id, "")), record))
    return messages


# Channels are registered in this order in the first chunk only, which every later chunk relies on.
_TOPICS = {1: "scenario", 2: "inputs", 3: "snapshot", 4: "truth", 5: "summary"}
_INPUTS = decoder(_Inputs)
_SNAPSHOT = decoder(Snapshot)
_TRUTH = decoder(Truth)


def _steps(chunk: Chunk, path: Path) -> Iterator[RecordedStep]:
    by_sequence: dict[int, dict[str, bytes]] = {}
    for topic, message in _chunk_messages(chunk):
        if topic in ("inputs", "snapshot", "truth"):
            by_sequence.setdefault(message.sequence, {})[topic] = message.data
    for parts in by_sequence.values():
        try:
            inputs = _INPUTS.decode(parts["inputs"])
            snapshot = _SNAPSHOT.decode(parts["snapshot"])
            truth = _TRUTH.decode(parts["truth"]) if "truth" in parts else None
        except (KeyError, ValueError, msgspec.DecodeError) as error:
            raise InputError(f"{path} holds a step that cannot be read ({error}): made by another version?") from error
        yield RecordedStep(snapshot.t, inputs.ownship, inputs.scans, snapshot, truth, inputs.mission, inputs.told)


def read_recording(path: str | os.PathLike[str]) -> Recording:
    """Read a recording, whole or torn.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    Recording
        Everything up to the last whole chunk; `Recording.complete` and `Recording.message` say whether that is all.

    Raises
    ------
    InputError
        If the file cannot be read, is empty, is no recording, or was made by a later version.
    """
    path = Path(path)
    try:
        size = path.stat().st_size
        if size == 0:
            raise InputError(f"{path} is empty: not a recording")
        with path.open("rb") as file:
            chunks, damage = _read_chunks(file, path)
    except OSError as error:
        raise InputError(f"cannot read the recording {path}: {error.strerror or error}") from error
    preamble = _read_preamble(chunks, path)
    steps, times, summary = 0, [], None
    for chunk in chunks:
        messages = _chunk_messages(chunk)
        stamps = [m.log_time * 1e-9 for topic, m in messages if topic == "snapshot"]
        for topic, message in messages:
            summary = _json(message, path) if topic == "summary" else summary
        steps += len(stamps)
        times += [stamps[0], stamps[-1]] if stamps else []
    t_start, t_end = (times[0], times[-1]) if times else (math.nan, math.nan)
    text = f"{steps} steps, {t_end - t_start:.1f} s" if steps else "no steps"
    if damage:
        text += f"; {damage}"
    mission = preamble.mission
    return Recording(
        path,
        preamble.scenario,
        None
        if mission is None
        else Mission(
            np.array(mission.waypoints), np.array(mission.speeds), mission.t_start, mission.index, mission.assumed
        ),
        LocalFrame(preamble.origin_latitude, preamble.origin_longitude),
        not damage,
        text,
        steps,
        t_start,
        t_end,
        summary,
        preamble.live,
        chunks,
    )


def _read_chunks(file: IO[bytes], path: Path) -> tuple[list[Chunk], str]:
    """Return the sound chunks from the start on, and what ended them too early ("" if nothing did)."""
    chunks: list[Chunk] = []
    finished = False
    try:
        records = StreamReader(file, emit_chunks=True, record_size_limit=_RECORD_SIZE_MAX).records
        header = next(records)
        if not isinstance(header, Header) or header.profile != PROFILE:
            raise InputError(f"{path} is an MCAP file, but not a wideberth recording")
        for record in records:
            finished = finished or isinstance(record, DataEnd)
            if isinstance(record, Chunk):
                _chunk_messages(record)
                chunks.append(record)
        return chunks, ""
    except (InputError, OSError):
        raise
    except Exception as error:  # the MCAP and zstd readers raise many kinds on damaged bytes
        if not chunks:
            raise InputError(f"{path} is not a recording, or damaged at its very start ({error})") from error
    if finished:
        return chunks, "the index at the file's end is damaged, which loses no step"
    return chunks, f"the file is torn or damaged at byte {file.tell()}: the recording ends there"


def _json(message: Message, path: Path) -> dict[str, Any]:
    try:
        return msgspec.json.decode(message.data, type=dict[str, Any])
    except msgspec.DecodeError as error:
        raise InputError(f"{path}: the summary inside cannot be read ({error})") from error


def _read_preamble(chunks: list[Chunk], path: Path) -> _Preamble:
    messages = _chunk_messages(chunks[0]) if chunks else []
    if not messages or messages[0][0] != "scenario":
        raise InputError(f"{path} holds no scenario: not a wideberth recording")
    try:
        preamble = msgspec.json.decode(messages[0][1].data, type=_Preamble)
    except msgspec.DecodeError as error:
        raise InputError(f"{path}: the scenario inside cannot be read ({error})") from error
    if preamble.version > FORMAT_VERSION:
        raise InputError(
            f"{path} has format {preamble.version}, this wideberth reads up to {FORMAT_VERSION}: use wideberth"
            f" {preamble.wideberth} or later"
        )
    return preamble
