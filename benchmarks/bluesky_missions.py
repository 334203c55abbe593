"""Missions among aircraft that fly straight on, flown by BlueSky from true states; run in a process of its own.

The ownship flies a route of one leg and keeps clear by BlueSky's modified voltage potential; its limits are those of
the drone it is compared with. Only the stepping counts as time.
"""

import contextlib
import json
import math
import sys
import tempfile
import time
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from benchmarks.bluesky_encounters import AIRCRAFT_TYPE, EARTH_RADIUS, SETTINGS, run_apart, start
from wideberth.units import FOOT, NAUTICAL_MILE

LONGEST_S = 400.0
OWNSHIP = "OWNSHIP"
# It steers along the edge of its zone and crosses it by centimetres; of the margins tried these serve it best.
ZONE_FACTOR = 1.11
RESOLUTION_FACTOR = 1.2


class Limits(NamedTuple):
    """What the ownship can fly, and how it is kept clear."""

    speed_min_mps: float
    speed_max_mps: float
    bank_max_deg: float
    capture_m: float
    radius_m: float
    half_height_m: float
    step_s: float


class Mission(NamedTuple):
    """A leg to the north at a speed, and the aircraft there, each with north, east, up and their rates, m and m/s."""

    length_m: float
    speed_mps: float
    altitude_m: float
    intruders: list[list[float]]


class FlownMission(NamedTuple):
    """What came of a mission."""

    completed: bool
    violated: bool
    path_ratio: float
    times_real_time: float


def fly_apart(missions: Sequence[Mission], limits: Limits) -> list[FlownMission]:
    """Fly missions in a new process.

    Raises
    ------
    RuntimeError
        If that process fails.
    """
    flown = run_apart("benchmarks.bluesky_missions", {"missions": missions, "limits": limits})
    return [FlownMission(*numbers) for numbers in flown]


def fly_one(bluesky: Any, mission: Mission, limits: Limits) -> FlownMission:
    """Fly one mission until its end is passed, or it takes too long."""
    traffic, simulation = bluesky.traf, bluesky.sim
    set_up(bluesky, mission, limits)
    spent, length, violated = 0.0, 0.0, False
    own = places(traffic)[0]
    while simulation.simt < LONGEST_S and own[0] < mission.length_m:
        begin = time.process_time()
        simulation.step()
        spent += time.process_time() - begin
        now = places(traffic)
        length += float(np.linalg.norm(now[0] - own))
        own = now[0]
        apart = now[1:] - own
        near = np.hypot(apart[:, 0], apart[:, 1]) <= limits.radius_m
        violated = violated or bool((near & (np.abs(apart[:, 2]) <= limits.half_height_m)).any())
    completed = own[0] >= mission.length_m and abs(own[1]) <= limits.capture_m
    return FlownMission(bool(completed), violated, length / mission.length_m, simulation.simt / spent)


def places(traffic: Any) -> Any:
    """Return where all aircraft are, north, east and up of the mission's start, m, shape (n, 3)."""
    north, east = (np.radians(np.asarray(angle)) * EARTH_RADIUS for angle in (traffic.lat, traffic.lon))
    return np.column_stack([north, east, traffic.alt])


def set_up(bluesky: Any, mission: Mission, limits: Limits) -> None:
    """Begin anew with the ownship on its leg and all intruders."""
    from bluesky.tools.aero import vtas2cas

    bluesky.sim.reset()
    run(bluesky, "CDMETHOD CSTATEBASED", "RESO MVP")
    states = np.array([[0.0, 0.0, mission.altitude_m, mission.speed_mps, 0.0, 0.0], *mission.intruders])
    names = [OWNSHIP, *(f"INTRUDER{i}" for i in range(len(mission.intruders)))]
    degrees = np.degrees(states[:, :2] / EARTH_RADIUS)
    courses = np.degrees(np.arctan2(states[:, 4], states[:, 3])) % 360.0
    speeds = np.hypot(states[:, 3], states[:, 4])
    bluesky.traf.cre(
        names, AIRCRAFT_TYPE, degrees[:, 0], degrees[:, 1], courses, states[:, 2], vtas2cas(speeds, states[:, 2])
    )
    traffic = bluesky.traf
    traffic.perf.vmin[:], traffic.perf.vmax[:] = 0.0, 300.0
    traffic.perf.vmin[0], traffic.perf.vmax[0] = limits.speed_min_mps, limits.speed_max_mps
    traffic.ap.bankdef[0] = math.radians(limits.bank_max_deg)
    end = math.degrees(mission.length_m / EARTH_RADIUS)
    # Beyond the end, so that the route is not over before it is reached.
    beyond = math.degrees((mission.length_m + 1000.0) / EARTH_RADIUS)
    run(
        bluesky,
        *(f"ADDWPT {OWNSHIP} {lat:.9f},0.0" for lat in (end, beyond)),
        f"LNAV {OWNSHIP} ON",
        *(f"RESOOFF {name}" for name in names[1:]),
        *(
            f"ALT {name} {(state[2] + 1000.0 * np.sign(state[5])) / FOOT} {abs(state[5]) / FOOT * 60.0}"
            for name, state in zip(names[1:], states[1:], strict=True)
            if state[5] != 0.0
        ),
    )


def run(bluesky: Any, *commands: str) -> None:
    """Carry out commands of BlueSky's."""
    for command in commands:
        bluesky.stack.stack(command)
    bluesky.stack.simstack.process()


def main() -> None:
    """Read missions and limits from standard input, and write what came of them to standard output."""
    task = json.load(sys.stdin)
    missions, limits = [Mission(*numbers) for numbers in task["missions"]], Limits(*task["limits"])
    settings = SETTINGS | {
        "asas_pzr": ZONE_FACTOR * limits.radius_m / NAUTICAL_MILE,
        "asas_pzh": limits.half_height_m / FOOT,
        "asas_marh": RESOLUTION_FACTOR,
        "asas_dt": limits.step_s,
    }
    with contextlib.redirect_stdout(sys.stderr), tempfile.TemporaryDirectory() as folder:
        bluesky = start(folder, settings)
        bluesky.settings.simdt = limits.step_s
        fly_one(bluesky, missions[0], limits)  # what is only done once should not count
        flown = [fly_one(bluesky, mission, limits) for mission in missions]
    print(json.dumps(flown))


if __name__ == "__main__":
    main()
