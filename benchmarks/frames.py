"""Mode S frames a second: our stateful decoder against rs1090 alone, without state, on the same frames."""

import gzip
import json
from pathlib import Path

import rs1090

from benchmarks.timing import cpu_seconds
from tests.adsb_frames import flight
from wideberth.sensors.adsb.decoder import ModeSDecoder

RECORDING = Path(__file__).resolve().parents[2] / "shared" / "data" / "adsb" / "mode_s_one_flight.jsonl.gz"
FRAMES = 20_000


def recorded_frames() -> tuple[list[float], list[bytes]]:
    """Return times and frames of the recorded flight."""
    with gzip.open(RECORDING, "rt") as lines:
        messages = [json.loads(line) for _, line in zip(range(FRAMES), lines, strict=False)]
    return [m["timestamp"] for m in messages], [bytes.fromhex(m["frame"]) for m in messages]


def made_frames() -> tuple[list[float], list[bytes]]:
    """Return times and frames of 50 made flights."""
    flights = [flight(0x400000 + k, latitude=48 + k / 100, duration=100.0) for k in range(50)]
    messages = sorted((t + k / 1000, frame) for k, frames in enumerate(flights) for t, frame in frames)
    return [t for t, _ in messages], [frame for _, frame in messages]


def measure() -> dict[str, float | str]:
    """Return frames a second of both ways and the ratio."""
    recorded = RECORDING.exists()
    times, frames = recorded_frames() if recorded else made_frames()
    texts = [frame.hex() for frame in frames]
    ours = cpu_seconds(lambda: ModeSDecoder().decode(frames, times), repeats=5)
    bare = cpu_seconds(lambda: rs1090.decode(texts, batch=1000), repeats=5)
    return {
        "frames": f"{len(frames)} {'recorded' if recorded else 'made'}",
        "frames_per_cpu_second": len(frames) / ours,
        "rs1090_frames_per_cpu_second": len(frames) / bare,
        "ratio_to_rs1090": bare / ours,
    }
