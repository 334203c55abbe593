"""Processes of a flight on loopback: the program, and what it talks to."""

import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
PROGRAM = "from wideberth.cli.main import main; main()"
COMMAND = [sys.executable, "-c", PROGRAM]
HOST = "127.0.0.1"

Process = subprocess.Popen[Any]
Watch = Callable[[dict[str, Any]], bool]


def free_port(kind: socket.SocketKind = socket.SOCK_DGRAM) -> int:
    """Return a port of loopback that nobody has."""
    with socket.socket(socket.AF_INET, kind) as one:
        one.bind((HOST, 0))
        return int(one.getsockname()[1])


def started(*arguments: str | Path, program: str = PROGRAM) -> Process:
    """Start a command of the package (`program` is what runs it); what it says is thrown away."""
    return subprocess.Popen([sys.executable, "-c", program, *map(str, arguments)], cwd=ROOT, stderr=subprocess.DEVNULL)


@contextlib.contextmanager
def stopped_after(processes: list[Process]) -> Iterator[None]:
    """Kill the processes that are in the list at the end."""
    try:
        yield
    finally:
        for process in processes:
            with contextlib.suppress(ProcessLookupError):
                os.kill(process.pid, signal.SIGKILL)
        for process in processes:
            process.wait()


def fly(arguments: list[str], folder: Path, watch: Watch, longest: float, program: str = PROGRAM) -> None:
    """Run `wideberth fly` until `watch` says that it is enough, and let it end cleanly.

    Parameters
    ----------
    arguments : list of str
        Configuration and options.
    folder : Path
        Where it writes summary and recording.
    watch : callable
        Told each status with the process's number (`pid`), the first when the kernels are compiled; returns whether it
        is enough.
    longest : float
        s of the flight.
    program : str
        What runs the command.

    Raises
    ------
    RuntimeError
        If it ends with an error.
    """
    flight = subprocess.Popen(
        [sys.executable, "-c", program, "fly", *arguments, "--json", "--out", str(folder)], cwd=ROOT, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=os.environ | {"XDG_STATE_HOME": str(folder / "state")},
    )  # fmt: skip
    assert flight.stdout is not None
    end = None
    with stopped_after([flight]):
        for line in flight.stdout:
            end = end or time.monotonic() + longest
            if watch(json.loads(line) | {"pid": flight.pid}) or time.monotonic() > end:
                break
        flight.terminate()
        _, said = flight.communicate(timeout=60)
        if flight.returncode != 0:
            raise RuntimeError(f"the flight ended with status {flight.returncode}: {said}")


def fly_mission(
    arguments: list[str],
    folder: Path,
    longest: float,
    vehicle: Sequence[str | Path],
    sender: Sequence[str | Path],
) -> list[str]:
    """Run `wideberth fly` until its mission is flown, or too long, and return the events it told.

    Parameters
    ----------
    arguments, folder, longest
        As for `fly`.
    vehicle, sender
        Commands beside it: started once its kernels are compiled, and once it has a mission.
    """
    others: list[Process] = []
    events: list[str] = []

    def watch(status: dict[str, Any]) -> bool:
        events.extend(status["events"])
        mission = status["mission"]
        if not others:
            others.append(started(*vehicle))
        elif mission is not None and len(others) == 1:
            # Now every scan is recorded, and the first tells when the sender began.
            others.append(started(*sender))
        return mission is not None and mission["index"] >= mission["waypoints"]

    with stopped_after(others):
        fly(arguments, folder, watch, longest)
    return events


def outcome(folder: Path) -> dict[str, Any]:
    """Return what the summary of a flight in a folder says of its mission, maneuvers and latencies."""
    summary = json.loads((folder / "summary.json").read_text())
    live = summary["live"]
    return {
        "completed": summary["mission_completed"],
        "maneuvers": summary["maneuvers"],
        "reversals": summary["reversals"],
        "steps": summary["steps"],
        "missed": live["missed_steps"],
        "step_ms": live["step_ms"],
        "command_ms": live["command_ms"],
        "age_ms": live["packet_age_ms"],
    }
