"""The ownship's own reports, heard back, are no threat; and which tracks have ended by being one with another."""

import math
import os

import numpy as np
import pytest

from tests.fusion_scene import Scene, follow
from wideberth.simulation.radar_plots import radar_scan
from wideberth.tracking.lost_traffic import LostTraffic
from wideberth.tracking.multi_target.config import MultiTargetConfig
from wideberth.tracking.multi_target.tracker import MultiTargetTracker
from wideberth.types import Ownship

pytestmark = pytest.mark.skipif(
    os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="thousands of reports: minutes without the compiler"
)


def hear(scene, own=0, stop=math.inf):
    """Step a scene without radar; telemetry is that of one aircraft."""
    tracker, steps = MultiTargetTracker(MultiTargetConfig()), []
    for k, t in enumerate(scene.t.tolist()):
        ownship = Ownship(t, scene.truth[k, own], scene.speeds[k, own]) if t < stop else None
        steps.append(tracker.step(t, [scene.reports(k)], ownship)[0])
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
