"""What the sensors can tell: who is silent, and whether all around is watched."""

import dataclasses
import math

import numpy as np

from wideberth.frames import rotation_ned_body
from wideberth.sensor_watch import SensorWatch
from wideberth.types import DetectionModel, Ownship, Scan, SensorHealth

SURE = DetectionModel(np.array([0.0, 600.0]), np.array([0.95, 0.95]))


def own(position=(0.0, 0.0, -100.0)):
    return Ownship(0.0, np.array(position), np.zeros(3))


def scan(t, name="radar", heading=0.0, width=math.pi, position=(0.0, 0.0, -100.0), detection=SURE, health=None):
    return Scan(
        t, t, name, "radar", np.empty((0, 4)), np.empty((0, 4, 4)), np.empty(0),
        sensor_position=np.array(position), sensor_attitude=rotation_ned_body(0.0, 0.0, math.radians(heading)),
        field_of_view=(width, math.radians(20)), detection=detection, health=health or SensorHealth(0.0, 10.0, {}),
    )  # fmt: skip


def test_without_expected_sensors_only_what_scans_say_counts():
    watch = SensorWatch({}, 200.0)
    assert watch.step(0.0, own(), []) == ({}, True, ())
    sensors, sound, events = watch.step(1.0, own(), [scan(1.0, health=SensorHealth(3.0, 0.0, {}, "silent for 3 s"))])
    assert list(sensors) == ["radar"] and not sound and events == ("sensor radar: silent for 3 s",)
    assert watch.step(2.0, own(), []) == ({}, True, ())


def test_an_expected_sensor_that_stops_is_silent_and_says_for_how_long():
    watch = SensorWatch({"radar": 0.5}, 200.0)
    told = []
    for k in range(65):
        t = 10.0 + k / 10
        scans = [scan(t)] if k % 5 == 0 and not 10 <= k < 45 else []
        sensors, sound, events = watch.step(t, own(), scans)
        told += events
        # The last scan before was at 10.5 s, three intervals are 1.5 s.
        silent = 12.05 < t < 14.45
        assert (sensors["radar"].state != "ok") is silent
        # What a radar saw once has not become a track: for as long again after its first scan it watches nothing yet.
        assert sound is (11.45 < t < 12.05 or t > 15.95)
        if silent:
            assert sensors["radar"].state == f"silent for {t - 10.5:.0f} s" and sensors["radar"].rate == 0.0
    unwatched, again = "not all around is watched by a sensor", "all around is watched again"
    assert told == [unwatched, again, "sensor radar: silent for 2 s", unwatched, "sensor radar: ok", again]


def test_a_sensor_that_never_spoke_is_silent_too_and_nothing_is_watched():
    watch = SensorWatch({"radar": 0.1}, 200.0)
    for k in range(30):
        sensors, sound, _ = watch.step(k / 10, own(), [])
        assert not sound
    assert sensors["radar"].state == "silent for 3 s" and sensors["radar"].age == math.inf


def test_one_silent_sensor_of_two_is_enough():
    watch = SensorWatch({"a": 0.1, "b": 0.1}, 100.0)
    for k in range(30):
        scans = [scan(k / 10, "a")] + ([scan(k / 10, "b")] if k < 5 else [])
        sensors, sound, _ = watch.step(k / 10, own(), scans)
    assert not sound and sensors["a"].state == "ok" and sensors["b"].state.startswith("silent")


def watched(*scans, position=(0.0, 0.0, -100.0), radius=200.0):
    watch = SensorWatch({s.sensor: 0.1 for s in scans}, radius)
    for k in range(11):
        sound = watch.step(k / 10, own(position), [dataclasses.replace(s, t=k / 10) for s in scans])[1]
        assert k == 10 or not sound
    return sound


def test_a_direction_in_which_nobody_looks_is_not_watched():
    third = math.radians(60)
    units = [scan(0.0, f"radar/{k}", 120.0 * k, third) for k in range(3)]
    assert watched(*units)
    assert not watched(*units[:2])
    # A seam that is narrower than an aircraft takes to be lost in is none, a wider one is.
    assert watched(*(scan(0.0, f"radar/{k}", 120.0 * k, third - math.radians(4)) for k in range(3)))
    assert not watched(*(scan(0.0, f"radar/{k}", 120.0 * k, third - math.radians(15)) for k in range(3)))
    assert watched(scan(0.0))


def test_beyond_a_radars_reach_nothing_is_watched():
    assert watched(scan(0.0), position=(390.0, 0.0, -100.0))
    assert not watched(scan(0.0), position=(410.0, 0.0, -100.0))
    weak = DetectionModel(np.array([0.0, 600.0]), np.array([0.9, 0.1]))
    assert watched(scan(0.0, detection=weak)) and not watched(scan(0.0, detection=weak), radius=350.0)
    # Below the ownship's height the field of view is too low.
    assert not watched(scan(0.0, position=(0.0, 0.0, 0.0)))
    assert not watched(scan(0.0), scan(0.0, "far", position=(5000.0, 0, -100.0)), position=(2500.0, 0.0, -100.0))


def test_a_scan_with_far_more_plots_than_usual_is_a_flood():
    watch = SensorWatch({"radar": 0.1}, 200.0)
    states = []
    for k in range(120):
        plots = 500 if 40 <= k < 50 else 90 if k == 80 else 6
        one = dataclasses.replace(scan(k / 10), z=np.zeros((plots, 4)))
        sensors, sound, _ = watch.step(k / 10, own(), [one])
        states.append(sensors["radar"].state)
        assert sound is (states[-1] == "ok" and k >= 10)
    # Until a second after the last; 90 plots are too few to tell.
    assert {k for k, state in enumerate(states) if state != "ok"} == set(range(40, 60))
    assert states[45] == "flooded: 500 plots in a scan"
    # A radar that always gives as many is no flood.
    watch = SensorWatch({"radar": 0.1}, 200.0)
    for k in range(20):
        one = dataclasses.replace(scan(k / 10), z=np.zeros((500, 4)))
        assert watch.step(k / 10, own(), [one])[0]["radar"].state == "ok"
