"""The simulated world: mission, maneuvers, sub-steps, sensors; and the worlds' helpers."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from wideberth.frames import LocalFrame
from wideberth.simulation.clock import SimClock, WallClock
from wideberth.simulation.config import SimulatedTrafficConfig
from wideberth.simulation.modelled_sensors import ModelledSensor
from wideberth.simulation.replay import ReplayWorld
from wideberth.simulation.simulated import SimulatedTraffic
from wideberth.simulation.truth import Truth
from wideberth.simulation.world import SimWorld
from wideberth.types import AlertLevel, Maneuver, Mission, Ownship, Scan, Snapshot
from wideberth.vehicles.config import PointMassConfig
from wideberth.vehicles.point_mass import PointMass

FloatArray = NDArray[np.float64]
FRAME = LocalFrame(0.85, 0.04)
MISSION = Mission(
    np.array([[0.0, 0.0, -300.0], [6000.0, 0.0, -300.0], [6000.0, 6000.0, -400.0]]), np.full(3, 41.0), 1000.0
)
EMPTY = SimulatedTraffic(SimulatedTrafficConfig(), FRAME)


class Log:
    def __init__(self) -> None:
        self.rows: list[tuple[float, FloatArray, FloatArray, Truth]] = []

    def __call__(self, t: float, position: FloatArray, velocity: FloatArray, truth: Truth) -> None:
        self.rows.append((t, position, velocity, truth))

    @property
    def path(self) -> FloatArray:
        return np.array([row[1] for row in self.rows])


def world(log: Log | None = None, mission: Mission = MISSION, wind: FloatArray | None = None) -> SimWorld:
    return SimWorld(mission, PointMass(PointMassConfig(), wind), EMPTY, [], log)


def maneuver(*waypoints: tuple[float, float, float], t: float = 1050.0, until: float = 2000.0) -> Maneuver:
    """Waypoints as north, east and the time they are to be reached."""
    return Maneuver(
        t, np.array([[n, e, -300.0] for n, e, _ in waypoints]), np.array([w[2] for w in waypoints]), "test", until
    )


def run(w: SimWorld, start: float, end: float, what: Maneuver | None = None, step: float = 1.0) -> None:
    t = start
    while t < end and not w.done:
        w.sense(t)
        w.actuate(t, what)
        t += step


def test_mission_is_flown_and_completed() -> None:
    log = Log()
    w = world(log)
    run(w, 1000.0, 1400.0)
    assert w.done and w.mission.index == 3
    assert np.allclose(log.path[0], [0, 0, -300])
    for waypoint in MISSION.waypoints:
        assert np.linalg.norm(log.path - waypoint, axis=1).min() < 150.0
    direct = 6000 + math.hypot(6000, 100)
    assert direct - 300 < w.path_length < direct + 50
    lengths = np.linalg.norm(np.diff(log.path, axis=0), axis=1)
    assert w.path_length == pytest.approx(lengths.sum())


@pytest.mark.parametrize("step", [0.1, 0.25, 1.0, 2.0])
def test_motion_and_scoring_run_in_sub_steps_whatever_the_step(step: float) -> None:
    log = Log()
    w = world(log)
    run(w, 1000.0, 1100.0 + step / 2, step=step)
    times = np.array([row[0] for row in log.rows])
    assert times[0] == 1000.0 and times[-1] == pytest.approx(1100.0)
    assert np.diff(times).max() <= 0.1 + 1e-6 and np.diff(times).min() > 0.05
    assert np.allclose(log.path[-1], [4100.0, 0.0, -300.0], atol=0.5)


def test_step_does_not_change_the_flight() -> None:
    logs = Log(), Log()
    for log, step in zip(logs, (0.1, 1.0), strict=True):
        run(world(log), 1000.0, 1200.5, step=step)
    # The waypoints are switched in sub-steps, so only rounding differs.
    n = min(len(log.rows) for log in logs)
    assert n > 1900
    assert np.abs(logs[0].path[:n] - logs[1].path[:n]).max() < 1e-3


def test_maneuver_is_flown_in_its_times_then_the_mission_is_rejoined_and_completed() -> None:
    log = Log()
    w = world(log)
    run(w, 1000.0, 1050.0)
    avoid = maneuver((3000, 900, 1082.0), (4200, 900, 1112.0))
    run(w, 1050.0, 1112.0, avoid)
    path, times = log.path, np.array([row[0] for row in log.rows])
    for (north, east), t in (((3000, 900), 1082.0), ((4200, 900), 1112.0)):
        near = np.argmin(np.hypot(path[:, 0] - north, path[:, 1] - east))
        assert math.hypot(path[near, 0] - north, path[near, 1] - east) < 100.0
        assert times[near] == pytest.approx(t, abs=4.0)
    assert w.mission.index == 1
    run(w, 1112.0, 1500.0)
    assert w.done
    for waypoint in MISSION.waypoints:
        assert np.linalg.norm(log.path - waypoint, axis=1).min() < 150.0


def test_maneuver_given_again_goes_on() -> None:
    logs = Log(), Log()
    for log, copy in zip(logs, (False, True), strict=True):
        w = world(log)
        run(w, 1000.0, 1050.0)
        avoid = maneuver((3000, 900, 1082.0), (4200, 900, 1112.0), (5000, 0, 1147.0))
        for k in range(60):
            w.sense(1050.0 + k)
            w.actuate(1050.0 + k, replace(avoid, waypoints=avoid.waypoints.copy()) if copy else avoid)
    assert np.array_equal(logs[0].path, logs[1].path)
    assert logs[0].path[:, 1].max() > 850.0


def test_waypoint_flown_past_during_a_maneuver_counts_and_one_missed_by_far_is_flown_back_to() -> None:
    w = world()
    run(w, 1000.0, 1050.0)
    run(w, 1050.0, 1155.0, maneuver((6500, 300, 1155.0)))
    assert w.mission.index == 2

    log = Log()
    w = world(log)
    run(w, 1000.0, 1050.0)
    far = maneuver((3500, -3000, 1130.0), (7000, -3000, 1220.0))
    run(w, 1050.0, 1215.0, far)
    assert w.mission.index == 1 and not w.done
    run(w, 1215.0, 1700.0)
    assert w.done
    for waypoint in MISSION.waypoints:
        assert np.linalg.norm(log.path - waypoint, axis=1).min() < 501.0


def test_maneuver_is_not_flown_after_its_validity() -> None:
    log = Log()
    w = world(log)
    run(w, 1000.0, 1050.0)
    run(w, 1050.0, 1120.0, maneuver((3000, 2000, 1090.0), (9000, 2000, 1250.0), until=1060.0))
    assert log.path[:, 1].max() < 700.0 and abs(log.path[-1, 1]) < 50.0


def test_mission_is_completed_in_wind() -> None:
    log = Log()
    w = world(log, wind=np.array([-8.0, 6.0, 0.0]))
    run(w, 1000.0, 1500.0)
    assert w.done
    assert np.linalg.norm(log.path - MISSION.waypoints[2], axis=1).min() < 60.0


def test_times_must_rise() -> None:
    w = world()
    w.sense(1010.0)
    for t in (1009.0, math.nan):
        with pytest.raises(ValueError, match="time cannot run back"):
            w.sense(t)
    with pytest.raises(ValueError, match="time cannot run back"):
        world().sense(0.0)


@pytest.mark.parametrize(
    ("waypoints", "times"),
    [(np.empty((0, 3)), np.empty(0)), (np.zeros((2, 3)), np.zeros(1)), (np.full((1, 3), np.nan), np.zeros(1))],
)
def test_bad_maneuver_is_refused(waypoints: FloatArray, times: FloatArray) -> None:
    with pytest.raises(ValueError, match="maneuver"):
        world().actuate(1000.0, Maneuver(1000.0, waypoints, times, "bad", 2000.0))


def test_bad_mission_is_refused() -> None:
    for change in ({"waypoints": np.zeros((1, 3))}, {"waypoints": np.full((3, 3), np.nan)}, {"speeds": np.zeros(3)}):
        with pytest.raises(ValueError, match="mission"):
            world(mission=replace(MISSION, **change))


def scan(t: float, positions: FloatArray) -> Scan:
    k = len(positions)
    return Scan(t, t, "test", "position", positions, np.zeros((k, 3, 3)), np.full(k, t))


class SeesAll:
    def sense(self, t: float, positions: FloatArray, velocities: FloatArray, own_position: FloatArray) -> Scan:
        return scan(t, positions - own_position)


CROSSING = SimulatedTrafficConfig.model_validate(
    {
        "intruders": [
            {
                "address": "ABCDEF",
                "position": {"north_m": 5000, "east_m": 0, "altitude_m": 300},
                "course_deg": 180,
                "speed_mps": 60,
                "climb_rate_mps": 2,
            },
            {
                "address": "abcde0",
                "speed_mps": 50,
                "waypoints": [
                    {"north_m": 5000, "east_m": 0, "altitude_m": 300},
                    {"north_m": 5000, "east_m": 9000, "altitude_m": 600},
                    {"north_m": 0, "east_m": 9000, "altitude_m": 600, "speed_mps": 60},
                ],
            },
        ]
    }
)


def test_intruders_fly_as_configured() -> None:
    traffic = SimulatedTraffic(CROSSING, FRAME, 100.0)
    assert traffic.ids == ("abcdef", "abcde0")
    truth = traffic.truth(150.0)
    assert np.allclose(truth.positions[0], [2000, 0, -400]) and np.allclose(truth.velocities[0], [-60, 0, -2])
    assert np.allclose(truth.positions[1], [5000, 2500, -300 - 2500 / 30], atol=1.0)
    assert np.allclose(truth.velocities[1], [0, 50, -50 / 30], atol=0.05)
    path = np.array([traffic.truth(100.0 + k).positions[1] for k in range(350)])
    assert np.hypot(path[:, 0] - 5000, path[:, 1] - 9000).min() < 250
    assert np.linalg.norm(path - [0, 9000, -600], axis=1).min() < 40
    assert np.allclose(traffic.truth(400.0).velocities[1], [-60, 0, 0], atol=0.1)
    before = traffic.truth(90.0)
    assert np.allclose(before.positions[:, :2], [[5600, 0], [5000, -500]], atol=0.5)


def test_intruders_do_not_depend_on_when_they_are_asked() -> None:
    a, b = SimulatedTraffic(CROSSING, FRAME), SimulatedTraffic(CROSSING, FRAME)
    b.truth(500.0)
    for t in (0.0, 33.33, 177.7, 61.0):
        assert np.array_equal(a.truth(t).positions, b.truth(t).positions)
        assert np.array_equal(a.truth(t).velocities, b.truth(t).velocities)


def test_intruder_velocity_is_the_change_of_position() -> None:
    traffic = SimulatedTraffic(CROSSING, FRAME, wind=np.array([5.0, -4.0, 0.0]))
    for t in np.arange(1.0, 300.0, 7.3):
        step = (traffic.truth(t + 0.2).positions - traffic.truth(t - 0.2).positions) / 0.4
        assert np.allclose(step, traffic.truth(t).velocities, atol=1.5)


def test_sensors_see_the_traffic() -> None:
    traffic = SimulatedTraffic(CROSSING, FRAME, 1000.0)
    log = Log()
    w = SimWorld(MISSION, PointMass(PointMassConfig()), traffic, [ModelledSensor(SeesAll(), traffic)], log)
    ownship, scans = w.sense(1010.0)
    assert len(scans) == 1
    assert np.allclose(scans[0].z + ownship.position, w.truth(1010.0).positions)
    assert log.rows[-1][3].ids == traffic.ids


def test_no_traffic_is_an_empty_truth() -> None:
    truth = EMPTY.truth(5.0)
    assert truth.ids == () and truth.positions.shape == truth.velocities.shape == (0, 3)


def recorded_step(
    t: float, index: int, mission: Mission | None = None
) -> tuple[float, Ownship, list[Scan], Snapshot, Mission | None]:
    own = Ownship(t, np.array([t, 0.0, 0.0]), np.zeros(3))
    snapshot = Snapshot(t, own, (), (), None, AlertLevel.CLEAR, index, {}, {})
    return t, own, [scan(t, np.zeros((1, 3)))], snapshot, mission


def test_replay_gives_back_what_was_recorded() -> None:
    steps = [recorded_step(10.0, 1), recorded_step(10.5, 1), recorded_step(11.0, 2)]
    w = ReplayWorld(iter(steps), MISSION)
    assert w.mission is MISSION and w.recorded is None
    seen: list[tuple[Ownship, list[Scan], int]] = []
    while (t := w.next_time) is not None:
        assert not w.done
        ownship, scans = w.sense(t)
        w.actuate(t, None)
        assert w.recorded is steps[len(seen)][3]
        seen.append((ownship, scans, w.mission.index))
    assert w.done
    assert [s[0] for s in seen] == [s[1] for s in steps] and [s[2] for s in seen] == [1, 1, 2]
    with pytest.raises(ValueError, match="ended"):
        w.sense(12.0)


def test_replay_flies_the_mission_that_came_in_flight() -> None:
    other = Mission(MISSION.waypoints + 5.0, MISSION.speeds, 11.0)
    w = ReplayWorld([recorded_step(10.0, 1), recorded_step(11.0, 2, other), recorded_step(12.0, 2)], MISSION)
    flown = []
    while (t := w.next_time) is not None:
        w.sense(t)
        flown.append((w.mission.index, bool((w.mission.waypoints == other.waypoints).all())))
    assert flown == [(1, False), (2, True), (2, True)]


def test_replay_refuses_other_times() -> None:
    w = ReplayWorld([recorded_step(10.0, 1)], MISSION)
    with pytest.raises(ValueError, match="next recorded step"):
        w.sense(10.1)


def test_simulation_clock_never_waits_nor_runs_back() -> None:
    clock = SimClock(5.0)
    clock.wait_until(1e9)
    assert clock.now == 1e9
    with pytest.raises(ValueError, match="run back"):
        clock.wait_until(5.0)


def test_wall_clock_waits() -> None:
    clock = WallClock()
    wanted = clock.now + 0.02
    clock.wait_until(wanted)
    assert clock.now >= wanted
    clock.wait_until(0.0)
