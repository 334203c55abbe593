"""Aircraft of JSBSim as intruders: they fly what is asked, within their own dynamics, and errors say what to do."""

import builtins
import math

import numpy as np
import pytest

from wideberth.config import build_scenario
from wideberth.errors import InputError
from wideberth.frames import LocalFrame
from wideberth.run import run_scenario
from wideberth.simulation.config import SimulatedTrafficConfig
from wideberth.simulation.jsbsim_flight import JsbsimFlight
from wideberth.simulation.legs import Leg, LegFlight
from wideberth.simulation.simulated import SimulatedTraffic

FRAME = LocalFrame(math.radians(40.25), math.radians(-111.65))
STILL = np.zeros(3)
CESSNA = {
    "address": "00000a",
    "kind": "jsbsim",
    "aircraft": "c172p",
    "position": {"north_m": 0.0, "east_m": 0.0, "altitude_m": 500.0},
    "course_deg": 30.0,
    "speed_mps": 50.0,
}


def wanted(*legs, speed=50.0, course=0.3):
    return LegFlight([0.0, 0.0, -500.0], speed, course, 0.0, legs)


@pytest.fixture
def flight():
    pytest.importorskip("jsbsim")

    def flight(asked, aircraft="c172p", wind=STILL):
        return JsbsimFlight(aircraft, asked, FRAME, np.asarray(wind, float))

    return flight


@pytest.mark.parametrize(("aircraft", "speed"), [("c172p", 50.0), ("c172p", 32.0), ("J3Cub", 30.0)])
def test_it_flies_after_what_is_asked(flight, aircraft, speed):
    turn = math.radians(4.0)
    asked = wanted(Leg(20, 0, 0, 0), Leg(20, 0, turn, 0), Leg(20, 0, 0, 0), Leg(20, 0, -turn, 0), speed=speed)
    flown = flight(asked, aircraft)
    np.testing.assert_allclose(flown.state(0.0), asked.state(0.0), atol=0.01)
    for t in np.arange(0.0, 100.0, 1.0):
        off = flown.state(t) - asked.state(t)
        assert np.hypot(off[0], off[1]) < 75.0 and abs(off[2]) < 15.0
        assert np.linalg.norm(off[3:]) < 0.35 * speed


def test_a_turn_is_flown_at_the_radius_of_a_coordinated_one(flight):
    rate = math.radians(4.0)
    flown = flight(wanted(Leg(60, 0, rate, 0)))
    states = np.array([flown.state(t) for t in np.arange(20.0, 55.0, 0.5)])
    course = np.unwrap(np.arctan2(states[:, 4], states[:, 3]))
    speed = np.hypot(states[:, 3], states[:, 4])
    # All of them at one rate: the circle that the places lie on.
    assert np.polyfit(np.arange(len(course)) * 0.5, course, 1)[0] == pytest.approx(rate, rel=0.05)
    centre = np.linalg.lstsq(
        np.column_stack([2.0 * states[:, :2], np.ones(len(states))]), (states[:, :2] ** 2).sum(axis=1), rcond=None
    )[0]
    radius = np.hypot(*(states[:, :2] - centre[:2]).T)
    assert radius.mean() == pytest.approx(speed.mean() / rate, rel=0.05) and radius.std() < 10.0


def test_wind_carries_it_and_places_do_not_depend_on_when_they_are_asked_for(flight):
    wind = [5.0, 5.0, 0.0]
    asked = wanted(course=1.0)
    flown, again = flight(asked, wind=wind), flight(asked, wind=wind)
    late = again.state(70.0)
    assert [np.hypot(*(flown.state(t) - asked.state(t))[:2]) < 40.0 for t in (10.0, 40.0, 70.0)] == [True] * 3
    np.testing.assert_array_equal(flown.state(70.0), late)
    # It came straight.
    np.testing.assert_allclose(flown.state(-2.0)[:2], flown.state(0.0)[:2] - 2.0 * flown.state(0.0)[3:5])


def test_it_is_an_intruder_of_a_scenario():
    pytest.importorskip("jsbsim")
    config = SimulatedTrafficConfig(intruders=[CESSNA])
    truth = SimulatedTraffic(config, FRAME).truth(30.0)
    expected = 1500.0 * np.array([math.cos(math.radians(30.0)), math.sin(math.radians(30.0))])
    np.testing.assert_allclose(truth.positions[0, :2], expected, atol=25.0)
    tables = {
        "name": "jsbsim",
        "origin": {"lat_deg": 40.25, "lon_deg": -111.65},
        "mission": {
            "speed_mps": 40.0,
            "waypoints": [{"north_m": n, "east_m": 0.0, "altitude_m": 500.0} for n in (0.0, 800.0)],
        },
        "traffic": {"kind": "simulated", "intruders": [CESSNA]},
    }
    assert run_scenario(build_scenario(tables, source="test"), None)["intruders"] == 1


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"aircraft": "no_such"}, "no aircraft 'no_such'"),
        ({"speed_mps": 8.0}, "cannot trim c172p at 8 m/s"),
    ],
)
def test_what_jsbsim_cannot_fly_is_refused(changes, words):
    pytest.importorskip("jsbsim")
    with pytest.raises(InputError, match=words):
        SimulatedTraffic(SimulatedTrafficConfig(intruders=[{**CESSNA, **changes}]), FRAME)


def test_without_jsbsim_the_error_says_what_to_install(monkeypatch):
    real = builtins.__import__

    def without(name, *rest, **named):
        if name == "jsbsim":
            raise ImportError(name)
        return real(name, *rest, **named)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(InputError, match=r"pip install 'wideberth\[jsbsim\]'"):
        SimulatedTraffic(SimulatedTrafficConfig(intruders=[CESSNA]), FRAME)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"aircraft": None}, "needs an aircraft"),
        ({"kind": "path"}, "goes with kind"),
        ({"aircraft": "../x y"}, "pattern"),
    ],
)
def test_kind_and_aircraft_go_together(changes, words):
    with pytest.raises(ValueError, match=words):
        SimulatedTrafficConfig(intruders=[{**CESSNA, **changes}])
