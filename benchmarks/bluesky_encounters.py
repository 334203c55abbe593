"""Two-aircraft encounters flown by BlueSky, for comparison; run in a process of its own.

BlueSky keeps one world in each process, prints as it works and wants a working folder. Several encounters in its world
would conflict with one another, so they are flown one after the other. Everything is set for speed: compiled
detection, no plugins, one detection a second (its default), and only the stepping counts as time.
"""

import contextlib
import json
import math
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, NamedTuple

from wideberth.units import FOOT, KNOT, NAUTICAL_MILE

PACKAGE = "bluesky-simulator"
OWN_SPEED = 80 * KNOT
ALTITUDE = 1500.0
LONGEST_S = 180.0
EARTH_RADIUS = 6_371_000.0  # BlueSky's
# Protected zone and look-ahead: the well-clear volume that triggers ours, and the experiment's 60 s.
SETTINGS = {
    "asas_pzr": 4000 * FOOT / NAUTICAL_MILE,
    "asas_pzh": 700.0,
    "asas_dtlookahead": 60.0,
    "asas_dt": 1.0,
    "performance_dt": 1.0,
    "enabled_plugins": [],
}
# Any type does: its limits are widened, for it must fly 39 to 250 kt.
AIRCRAFT_TYPE = "EC35"
ALIGNED_DEG = math.degrees(0.1)  # as in the fast tier


class Encounter(NamedTuple):
    """Where the intruder starts, from an ownship that flies north, and how it flies."""

    north_m: float
    east_m: float
    height_m: float
    velocity_north_mps: float
    velocity_east_mps: float


class Way(NamedTuple):
    """How to fly: the time step, and whether an encounter ends once it has passed, as ours do, or always at 180 s."""

    step_s: float
    until_passed: bool


class Flown(NamedTuple):
    """What flying encounters took."""

    cpu_s: float
    simulated_s: float
    maneuvered: int


def installed_version() -> str | None:
    """Return BlueSky's version, or None where it is not installed."""
    try:
        return version(PACKAGE)
    except PackageNotFoundError:
        return None


def fly_apart(encounters: Sequence[Encounter], ways: Sequence[Way]) -> list[Flown]:
    """Fly encounters in a new process, in each of the ways.

    Raises
    ------
    RuntimeError
        If that process fails.
    """
    task = {"encounters": encounters, "ways": ways}
    return [Flown(*numbers) for numbers in run_apart("benchmarks.bluesky_encounters", task)]


def run_apart(module: str, task: Mapping[str, object]) -> Any:
    """Run a module in a new process with a task on its standard input, and return its answer, both JSON.

    Raises
    ------
    RuntimeError
        If that process fails.
    """
    done = subprocess.run(
        [sys.executable, "-m", module],
        input=json.dumps(task),
        capture_output=True,
        text=True,
        cwd=Path(__file__).resolve().parents[1],
    )
    if done.returncode != 0:
        lines = done.stderr.strip().splitlines()
        raise RuntimeError(lines[-1] if lines else f"exit status {done.returncode}")
    return json.loads(done.stdout)


def start(folder: str, settings: Mapping[str, object]) -> Any:
    """Start BlueSky's world with its settings, without network and display, and return its package."""
    import bluesky

    default = Path(bluesky.__file__).with_name("resources") / "default.cfg"
    lines = [default.read_text(), *(f"{name} = {value!r}" for name, value in settings.items())]
    Path(folder, "settings.cfg").write_text("\n".join(lines) + "\n")

    bluesky.init(mode="sim", detached=True, workdir=folder)
    # A reset would read the navigation data again, which nothing here uses.
    bluesky.navdb.reset = lambda: None
    return bluesky


def fly(bluesky: Any, encounters: Sequence[Encounter], way: Way) -> Flown:
    """Fly encounters one after the other."""
    bluesky.settings.simdt = way.step_s
    fly_one(bluesky, encounters[0], way)  # what is only done once should not count
    flown = [fly_one(bluesky, encounter, way) for encounter in encounters]
    return Flown(sum(f.cpu_s for f in flown), sum(f.simulated_s for f in flown), sum(f.maneuvered for f in flown))


def fly_one(bluesky: Any, encounter: Encounter, way: Way) -> Flown:
    """Fly one encounter: the ownship avoids, the intruder flies straight on."""
    traffic, simulation = bluesky.traf, bluesky.sim
    set_up(bluesky, encounter)
    spent, maneuvered = 0.0, False
    while simulation.simt < LONGEST_S - 1e-6 and not (way.until_passed and has_passed(traffic)):
        begin = time.process_time()
        simulation.step()
        spent += time.process_time() - begin
        maneuvered = maneuvered or bool(traffic.cr.active[0])
    return Flown(spent, simulation.simt, int(maneuvered))


def set_up(bluesky: Any, encounter: Encounter) -> None:
    """Begin anew with the ownship and the intruder of an encounter."""
    import numpy as np
    from bluesky.tools.aero import vtas2cas
    from bluesky.traffic.asas import ConflictDetection, ConflictResolution

    bluesky.sim.reset()
    for command in ("CDMETHOD CSTATEBASED", "RESO MVP"):
        bluesky.stack.stack(command)
    bluesky.stack.simstack.process()
    chosen = ConflictDetection.selected().__name__, ConflictResolution.selected().__name__
    if chosen != ("CStateBased", "MVP"):
        raise RuntimeError(f"BlueSky detects with {chosen[0]} and resolves with {chosen[1]}")
    north, east = encounter.velocity_north_mps, encounter.velocity_east_mps
    altitudes = np.array([ALTITUDE, ALTITUDE + encounter.height_m])
    speeds = np.array([OWN_SPEED, math.hypot(north, east)])
    bluesky.traf.cre(
        ["OWNSHIP", "INTRUDER"],
        AIRCRAFT_TYPE,
        np.degrees(np.array([0.0, encounter.north_m]) / EARTH_RADIUS),
        np.degrees(np.array([0.0, encounter.east_m]) / EARTH_RADIUS),
        np.array([0.0, math.degrees(math.atan2(east, north)) % 360.0]),
        altitudes,
        vtas2cas(speeds, altitudes),
    )
    bluesky.traf.perf.vmin[:], bluesky.traf.perf.vmax[:] = 0.0, 300.0
    bluesky.stack.stack("RESOOFF INTRUDER")
    bluesky.stack.simstack.process()


def has_passed(traffic: Any) -> bool:
    """Return whether the intruder moves away from the ownship, which flies north again, and would from one that did."""
    dx, dy = float(traffic.lat[1] - traffic.lat[0]), float(traffic.lon[1] - traffic.lon[0])
    north, east = float(traffic.gsnorth[1]), float(traffic.gseast[1])
    own_north, own_east = float(traffic.gsnorth[0]), float(traffic.gseast[0])
    return (
        dx * (north - own_north) + dy * (east - own_east) >= 0.0
        and dx * (north - OWN_SPEED) + dy * east >= 0.0
        and not traffic.cr.active[0]
        and abs((float(traffic.hdg[0]) + 180.0) % 360.0 - 180.0) < ALIGNED_DEG
    )


def main() -> None:
    """Read encounters and ways to fly them from standard input, and write what they took to standard output."""
    task = json.load(sys.stdin)
    encounters = [Encounter(*numbers) for numbers in task["encounters"]]
    with contextlib.redirect_stdout(sys.stderr), tempfile.TemporaryDirectory() as folder:
        bluesky = start(folder, SETTINGS)
        flown = [fly(bluesky, encounters, Way(*way)) for way in task["ways"]]
    print(json.dumps(flown))


if __name__ == "__main__":
    main()
