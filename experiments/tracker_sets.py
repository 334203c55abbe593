"""Fresh plots for the trackers: the benchmark's flights measured anew, and flights that nothing has been set up with.

Each run has its own stream of random numbers, by the set's number and the run's; the key is used nowhere else.
"""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wideberth.frames import rotation_ned_body
from wideberth.plots import Plots
from wideberth.sensors.radar.plot_file import ONBOARD_FIELD_OF_VIEW, PlotFile, PlotTruth, read_plot_file
from wideberth.simulation.radar_plots import maneuvering_flights, radar_plots, straight_flights

FloatArray = NDArray[np.float64]
Run = tuple[Plots, PlotTruth]
Make = Callable[[np.random.Generator, np.random.Generator, int | None], Run]

KEY = 7_320_000
SCANS, STEP_S = 600, 0.1
CLUTTERED = 40
GRAVITY = 9.80665

STRAIGHT_AIMS = {
    "first_confirmed_s": (0.0, 0.55),
    "false_tracks": (0, 0),
    "switches": (0, 0),
    "track_purity": (0.995, 1.0),
    "nees_per_dof": (0.7, 1.3),
    "coverage_95_horizontal": (0.90, 0.99),
    "coverage_95_position": (0.90, 0.99),
}
MANEUVERING_AIMS = {
    "rmse_position_m": (0.0, 3.0),
    "rmse_velocity_mps": (0.0, 1.5),
    "false_tracks": (0, 0),
    "switches": (0, 0),
    "nees_per_dof": (0.5, 2.0),
    "coverage_95_horizontal": (0.90, 0.99),
    "coverage_95_position": (0.90, 0.99),
}
ONBOARD_AIMS = {
    "latest_s": (0.0, 1.0),
    "false_tracks": (0, 0),
    "over_alone": (0.0, 1.1),
    "coverage_95_horizontal": (0.90, 0.99),
    "coverage_95_position": (0.90, 0.99),
}


class PlotSet(NamedTuple):
    """Runs of one kind.

    Attributes
    ----------
    name : str
    flown : str
        What flies, in words.
    make : callable
        ``make(flights, noise, only)`` draws a run with two generators; with `only` (an aircraft's number) of that one
        alone, without false plots, so that nothing can be mistaken.
    aims : dict
        Least and largest value of what `measure` of `tracker_benchmark` returns.
    printed : int
        Runs that the printed trackers get.
    alone : int
        So many aircraft are tracked alone as well, to compare with; 0: none.
    """

    name: str
    flown: str
    make: Make
    aims: dict[str, tuple[float, float]]
    printed: int = 0
    alone: int = 0

    def run(self, number: int, k: int, only: int | None = None) -> Run:
        """Return run `k` of the set, which is the study's `number`-th."""
        flights = np.random.default_rng((KEY, number, k, 0))
        noise = flights if only is None else np.random.default_rng((KEY, number, k, 1 + only))
        return self.make(flights, noise, only)


def measured_anew(file: PlotFile, clutter_max: int) -> Make:
    """Return what measures the flights of a file with its own radar.

    Parameters
    ----------
    file : PlotFile
        With the truth.
    clutter_max : int
        Most false plots of a scan.
    """

    def make(_: np.random.Generator, noise: np.random.Generator, only: int | None) -> Run:
        truth = file.truth
        if truth is None:
            raise SystemExit(f"{file.name} has no truth")
        return _measured(
            noise,
            truth.position,
            truth.velocity,
            only,
            clutter_max=clutter_max,
            dt=file.dt,
            sigma=tuple(file.sigma[:3].tolist()),
            detection_probability=file.detection_probability,
            range_max=file.range_max,
            sensor_position=file.sensor_position,
            sensor_attitude=file.sensor_attitude,
            field_of_view=file.field_of_view,
            ownship=truth.ownship,
        )

    return make


def drawn(
    flights: Callable[..., tuple[FloatArray, FloatArray]], aircraft: int, *, clutter_max: int = 3, **rules: Any
) -> Make:
    """Return what draws flights anew in each run and measures them by the benchmark's ground radar.

    Parameters
    ----------
    flights : callable
        One of `wideberth.simulation.radar_plots`.
    aircraft, clutter_max : int
    **rules
        For `flights`.
    """

    def make(rng: np.random.Generator, noise: np.random.Generator, only: int | None) -> Run:
        return _measured(noise, *flights(rng, aircraft, SCANS, STEP_S, **rules), only, clutter_max=clutter_max)

    return make


def drawn_onboard(rng: np.random.Generator, noise: np.random.Generator, only: int | None) -> Run:
    """Draw three maneuvering aircraft, and one with a radar that weaves among them: 12 to 18 m/s, 1 to 4 deg/s."""
    flights = maneuvering_flights(rng, 3, SCANS, STEP_S)
    speed, course, rate = rng.uniform(12.0, 18.0), rng.uniform(-math.pi, math.pi), math.radians(rng.uniform(1.0, 4.0))
    period, phase = rng.uniform(10.0, 40.0), rng.uniform(0.0, 1.0)
    t = STEP_S * np.arange(SCANS)
    turn = np.where((t / period + phase) % 1.0 < 0.5, rate, -rate)
    yaw = course + np.concatenate([[0.0], np.cumsum(STEP_S * turn)[:-1]])
    velocity = speed * np.stack([np.cos(yaw), np.sin(yaw), np.zeros(SCANS)], axis=1)
    position = np.concatenate([np.zeros((1, 3)), np.cumsum(STEP_S * velocity, axis=0)[:-1]])
    # Half of the minute before the middle: in the midst of the traffic then.
    position += [*rng.uniform(-150.0, 150.0, 2), -200.0] - position[SCANS // 2]
    roll = np.arctan(speed * turn / GRAVITY)
    attitude = np.array([rotation_ned_body(r, math.radians(2.0), y) for r, y in zip(roll, yaw, strict=True)])
    view: dict[str, Any] = {
        "sensor_position": position,
        "sensor_attitude": attitude,
        "field_of_view": ONBOARD_FIELD_OF_VIEW,
    }
    return _measured(noise, *flights, only, range_max=1000.0, **view)


def _measured(
    rng: np.random.Generator, position: FloatArray, velocity: FloatArray, only: int | None, **rules: Any
) -> Run:
    if only is None:
        return radar_plots(rng, position, velocity, **rules)
    one = slice(only, only + 1)
    return radar_plots(rng, position[:, one], velocity[:, one], **(rules | {"clutter_max": 0, "ownship": -1}))


def sets(folder: Path) -> tuple[PlotSet, ...]:
    """Return all sets.

    Parameters
    ----------
    folder : Path
        Of the benchmark's files; its sets are left out where it is not there.
    """
    three = STRAIGHT_AIMS | {"ospa_m": (0.0, 0.75), "cpu_ms": (0.0, 0.03)}
    five = STRAIGHT_AIMS | {"ospa_m": (0.0, 1.10), "cpu_ms": (0.0, 0.04)}
    clutter = STRAIGHT_AIMS | {"ospa_m": (0.0, 1.10), "cpu_ms": (0.0, 0.15)}
    files: tuple[tuple[str, int, str, dict[str, tuple[float, float]]], ...] = (
        ("bench_3", 3, "the file's flights", three),
        ("bench_5", 3, "the file's flights", five),
        ("bench_5_c20", CLUTTERED, "the file's flights", clutter),
        ("bench_man", 3, "the file's flights", MANEUVERING_AIMS),
        ("bench_onboard", 3, "the file's flights", ONBOARD_AIMS),
    )
    known = []
    for name, most, flown, aims in files:
        path = folder / f"{name}.npz"
        if path.is_file():
            make = measured_anew(read_plot_file(path), most)
            # With 20 false plots a scan the printed trackers take up to 15 ms for each.
            printed = 1 if most == CLUTTERED else 3
            known.append(PlotSet(name, flown, make, aims, printed, 3 if name == "bench_onboard" else 0))
    usual, short, long = (5.0, 20.0), (2.0, 6.0), (20.0, 40.0)
    slow, fast = (3.0, 8.0), (8.0, 15.0)
    man = MANEUVERING_AIMS
    return (
        *known,
        PlotSet("straight_3", "3 straight", drawn(straight_flights, 3), three),
        PlotSet("straight_5", "5 straight", drawn(straight_flights, 5), five),
        PlotSet("straight_5_c20", "5 straight", drawn(straight_flights, 5, clutter_max=CLUTTERED), clutter),
        PlotSet("man", "3, legs of 5 to 20 s, turns of 3 to 8 deg/s", drawn(maneuvering_flights, 3), man),
        PlotSet(
            "man_short",
            "3, legs of 2 to 6 s, turns of 3 to 8 deg/s",
            drawn(maneuvering_flights, 3, leg_s=short, turn_deg_per_s=slow),
            man,
            alone=3,
        ),
        PlotSet(
            "man_long",
            "3, legs of 20 to 40 s, turns of 3 to 8 deg/s",
            drawn(maneuvering_flights, 3, leg_s=long, turn_deg_per_s=slow),
            man,
        ),
        PlotSet(
            "man_fast",
            "3, legs of 5 to 20 s, turns of 8 to 15 deg/s",
            drawn(maneuvering_flights, 3, leg_s=usual, turn_deg_per_s=fast),
            man,
            alone=3,
        ),
        PlotSet("onboard", "3 as in man, the radar weaves at 1 to 4 deg/s", drawn_onboard, ONBOARD_AIMS, alone=3),
    )
