"""A scenario's mission along fillets and Dubins paths."""

import dataclasses
import math

import numpy as np
import pytest
from pydantic import ValidationError

from wideberth.assembly import build_traffic, build_world
from wideberth.config import build_scenario
from wideberth.errors import InputError
from wideberth.types import Maneuver
from wideberth.vehicles.config import FixedWingConfig

RADIUS = 60.0
CORNERS = np.array([[0.0, 0.0], [600.0, 0.0], [600.0, 500.0], [100.0, 500.0]])


def world(manager, rows, corners=CORNERS, **keys):
    arcs = {} if manager == "straight" else {"path_manager": manager, "turn_radius_m": RADIUS}
    scenario = build_scenario(
        {
            "name": "corners",
            "origin": {"lat_deg": 40.0, "lon_deg": -111.0},
            "ownship": {"kind": "fixed_wing", "aircraft": "zagi", "waypoint_capture_m": 60.0, **arcs, **keys},
            "mission": {
                "speed_mps": 13.0,
                "waypoints": [{"north_m": n, "east_m": e, "altitude_m": 100.0} for n, e in corners.tolist()],
            },
            "traffic": {"kind": "simulated", "intruders": []},
        },
        source="test",
    )
    mission = scenario.mission.mission(scenario.frame())
    traffic = build_traffic(scenario, mission, scenario.frame(), 600.0)
    # No sensor looks: the flight is what counts here.
    traffic = dataclasses.replace(traffic, sensors=())

    def note(t, position, velocity, truth):
        rows.append(position)

    return build_world(scenario, mission, traffic, note), mission.t_start


def fly(made, start, first=0, most=2500):
    for k in range(first, most):
        made.sense(start + 0.1 * k)
        if made.done:
            return k
    raise AssertionError("not completed")


def distance_to_corner(path, corner):
    return np.hypot(*(path[:, :2] - corner).T).min()


@pytest.mark.parametrize(("manager", "nearest"), [("fillet", RADIUS * (math.sqrt(2.0) - 1.0)), ("dubins", 0.0)])
def test_the_mission_is_flown_along_its_arcs(manager, nearest):
    rows: list = []
    made, start = world(manager, rows)
    fly(made, start)
    path = np.array(rows)
    for corner in CORNERS[1:3]:
        assert distance_to_corner(path, corner) == pytest.approx(nearest, abs=6.0)
    # Fillets cut each corner by 2 R tan(45 deg) - R pi / 2 and no more.
    legs = np.hypot(*np.diff(CORNERS, axis=0).T).sum()
    if manager == "fillet":
        assert made.path_length == pytest.approx(legs - 2 * RADIUS * (2.0 - math.pi / 2), rel=0.01)
    else:
        assert made.path_length > legs


def test_a_waypoint_is_passed_in_the_middle_of_its_arc():
    rows: list = []
    made, start = world("fillet", rows)
    k = 0
    while made.mission.index == 1:
        made.sense(start + 0.1 * k)
        k += 1
    assert np.hypot(*(rows[-1][:2] - CORNERS[1])) < RADIUS * (math.sqrt(2.0) - 1.0) + 6.0
    assert made.mission.index == 2


def test_after_a_maneuver_the_leg_is_rejoined_and_the_path_goes_on():
    rows: list = []
    made, start = world("fillet", rows)
    for k in range(100):
        made.sense(start + 0.1 * k)
    aside = np.array([[250.0, -120.0, -100.0], [400.0, -60.0, -100.0]])
    times = start + np.array([22.0, 35.0])
    made.actuate(start + 9.9, Maneuver(start + 9.9, aside, times, "test", start + 35.0))
    for k in range(100, 350):
        made.sense(start + 0.1 * k)
    made.actuate(start + 34.9, None)
    assert made.mission.index == 1
    fly(made, start, 350)
    path = np.array(rows)
    assert path[:, 1].min() < -60.0
    # The corner after the one that was flown to anew has its arc again.
    assert distance_to_corner(path, CORNERS[2]) == pytest.approx(RADIUS * (math.sqrt(2.0) - 1.0), abs=6.0)


def test_straight_legs_are_the_default():
    assert FixedWingConfig().path_manager == "straight"
    rows: list = []
    made, start = world("straight", rows)
    fly(made, start)
    assert distance_to_corner(np.array(rows), CORNERS[1]) < RADIUS * (math.sqrt(2.0) - 1.0) - 3.0


def test_arcs_that_cannot_be_flown_are_refused():
    for changes in ({"path_manager": "fillet"}, {"turn_radius_m": 60.0}, {"path_manager": "loops"}):
        with pytest.raises(ValidationError):
            FixedWingConfig.model_validate(changes)
    with pytest.raises(InputError, match="fillets of radius"):
        world("fillet", [], np.array([[0.0, 0.0], [100.0, 0.0], [100.0, 100.0], [0.0, 100.0]]))
    with pytest.raises(InputError, match="turn_radius_m 20 is too small: at 13 m/s a bank of 35 deg turns at 25 m"):
        world("dubins", [], turn_radius_m=20.0)
