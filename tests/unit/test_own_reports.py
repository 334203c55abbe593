"""The ownship's own reports, heard back, are no threat; and which tracks have ended by being one with another."""

import math
import os

import numpy as np
import pytest

from tests.fusion_scene import Scene, follow
from wideberth.simulation.radar_plots import radar_scan
from wideberth.tracking.lost_traffic import LostTraffic
from wideberth.tracking.multi_target.config import MultiTargetConfig, ReportsConfig
from wideberth.tracking.multi_target.tracker import MultiTargetTracker
from wideberth.types import Ownship

pytestmark = pytest.mark.skipif(
    os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="thousands of reports: minutes without the compiler"
)


def hear(scene, own=0, stop=math.inf, radar=False, told=None, **known):
    """Step a scene, without radar as a rule; telemetry is that of one aircraft; `known` is told of its ADS-B."""
    known = known or {"ownship_broadcasts": True}
    tracker, steps = MultiTargetTracker(MultiTargetConfig(reports=ReportsConfig(**known))), []
    for k, t in enumerate(scene.t.tolist()):
        ownship = Ownship(t, scene.truth[k, own], scene.speeds[k, own]) if t < stop else None
        scans = [scene.reports(k), *([radar_scan(scene.plots, k)] if radar else [])]
        tracks, events = tracker.step(t, scans, ownship)
        steps.append(tracks)
        if told is not None:
            told.extend(events)
    return steps


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_our_own_reports_are_known_and_those_of_others_are_not(seed):
    place = np.array([[0.0, 0, -100.0], [900.0, 50.0, -120.0]])
    steps = hear(Scene(place, np.array([[20.0, 5, 0], [-20.0, 0, 0]]), 20.0, (0, 1), seed=seed))
    last = [x for x in steps[-1] if x.is_ownship]
    assert [x.label for x in last] == ["CALL0"] and len(steps[-1]) == 2
    assert not any(x.is_ownship and x.label == "CALL1" for tracks in steps for x in tracks)


def test_without_telemetry_and_with_two_that_cannot_be_told_apart_none_is_the_ownship():
    for stop, own in ((math.inf, True), (15.0, False)):
        one = Scene(np.array([[0.0, 0, -100.0]]), np.array([[20.0, 5, 0]]), 20.0, (0,))
        assert hear(one, stop=stop)[-1][0].is_ownship is own
    pair = Scene(np.array([[0.0, 0, -100.0], [5.0, 5.0, -100.0]]), np.tile([20.0, 5, 0], (2, 1)), 20.0, (0, 1))
    assert not any(x.is_ownship for x in hear(pair)[-1])


FORMATION = np.array([[0.0, 0.0, -100.0], [15.0, 10.0, -100.0]]), np.tile([20.0, 5.0, 0.0], (2, 1))


@pytest.mark.parametrize("radar", [False, True])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_an_aircraft_beside_a_silent_ownship_is_never_taken_for_it(seed, radar):
    """It is heard and gives no echo; a radar, where there is one, sees the ownship alone."""
    scene = Scene(*FORMATION, 30.0, (1,), seed=seed, echoes=(0,), radar={"range_max": 1500.0})
    told = []
    steps = hear(scene, radar=radar, told=told, ownship_broadcasts=False)
    for tracks in steps[100:]:
        heard = [x for x in tracks if "adsb" in " ".join(x.sources)]
        assert [x.label for x in heard] == ["CALL1"] and not heard[0].is_ownship
        # The radar's track is the ownship's, and has no address.
        assert [x.is_ownship for x in tracks if x not in heard] == [True] * radar
    assert any("set reports.ownship_address" in e for e in told)


def test_by_default_the_ownship_is_taken_to_be_silent():
    assert ReportsConfig().ownship_broadcasts is False and ReportsConfig().ownship_address is None


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_by_its_address_the_ownship_is_known_beside_another(seed):
    """Two that telemetry cannot tell apart: the address does, whatever its case."""
    scene, told = Scene(*FORMATION, 30.0, (0, 1), seed=seed), []
    steps = hear(scene, told=told, ownship_address="A00000")
    assert {x.label: x.is_ownship for x in steps[-1]} == {"CALL0": True, "CALL1": False}
    assert not any(x.is_ownship and x.label == "CALL1" for tracks in steps for x in tracks)
    assert sum("is taken for the ownship" in e for e in told) == 1


def test_the_ownships_address_where_the_ownship_is_not_is_another_aircraft():
    scene, told = Scene(np.array([[0.0, 0.0, -100.0], [600.0, 300.0, -100.0]]), FORMATION[1], 30.0, (1,)), []
    steps = hear(scene, told=told, ownship_address="a00001")
    assert not any(x.is_ownship for tracks in steps for x in tracks)
    assert sum("has the ownship's address and flies elsewhere" in e for e in told) == 1


def test_the_number_that_ended_is_said_and_not_carried_on():
    """Heard from far away and then seen by the radar: the radar's younger track becomes that of the reports."""
    scene = Scene(np.array([[-900.0, 100.0, -150.0]]), np.array([[30.0, 0.0, 0.0]]), 40.0, (0,))
    tracker, lost, said = MultiTargetTracker(MultiTargetConfig()), LostTraffic(60.0), {}
    for k, t in enumerate(scene.t.tolist()):
        tracks, events = tracker.step(t, [radar_scan(scene.plots, k), scene.reports(k)])
        said |= tracker.absorbed
        assert bool(tracker.absorbed) == any("ended: the same aircraft" in e for e in events)
        assert lost.step(t, tracks, tracker.absorbed) == ()
        assert not set(tracker.absorbed) & {x.id for x in tracks}
        assert set(tracker.absorbed.values()) <= {x.id for x in tracks}
    assert len(said) == 1
    log = follow(Scene(scene.place, scene.velocity, 40.0, (0,)))
    assert len(log.told("ended: the same aircraft")) == 1
