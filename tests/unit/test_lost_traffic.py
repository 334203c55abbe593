"""Aircraft that the tracker lost are carried on for a while."""

import math

import numpy as np
import pytest

from wideberth.tracking.lost_traffic import LostTraffic
from wideberth.types import SourceInfo, Track, TrackStatus

P = np.diag([100.0, 100, 25, 4, 4, 1, 0.5, 0.5, 0.5])
P[0, 3] = P[3, 0] = 6.0


def track(t=0.0, name="a1", status=TrackStatus.CONFIRMED):
    return Track(
        name, t, np.array([100.0, 200, -900]), np.array([50.0, -20, 1]), np.ones(3), P, status, t - 1.0, 0.8,
        info=SourceInfo(callsign="ONE"),
    )  # fmt: skip


def test_a_lost_aircraft_moves_straight_on_and_is_known_less_and_less():
    lost = LostTraffic(60.0)
    assert lost.step(0.0, [track()]) == ()
    sigmas = []
    for t in (1.0, 10.0, 30.0, 60.0):
        (ghost,) = lost.step(t, [])
        assert np.allclose(ghost.position, [100 + 50 * t, 200 - 20 * t, -900 + t])
        assert np.array_equal(ghost.velocity, [50, -20, 1]) and np.array_equal(ghost.acceleration, np.zeros(3))
        # Position variance of straight flight: p + 2 t p_v + t^2 v.
        assert ghost.covariance[0, 0] == pytest.approx(100 + 2 * t * 6 + 4 * t * t)
        assert ghost.covariance[2, 2] == pytest.approx(25 + t * t)
        assert np.all(np.linalg.eigvalsh(ghost.covariance) > -1e-9)
        assert ghost.status is TrackStatus.COASTING
        assert ghost.existence == pytest.approx(0.8 * math.exp(-t / 60))
        assert (ghost.t, ghost.t_last_update, ghost.id, ghost.label) == (t, -1.0, "a1", "ONE")
        sigmas.append(np.trace(ghost.covariance[:3, :3]))
    assert np.all(np.diff(sigmas) > 0)


def test_it_is_forgotten_for_good():
    lost = LostTraffic(10.0)
    lost.step(0.0, [track()])
    assert len(lost.step(10.0, [])) == 1
    assert lost.step(10.1, []) == () and lost.step(5.0, []) == ()


def test_what_is_tracked_is_not_lost_and_what_comes_back_is_remembered_anew():
    lost = LostTraffic(10.0)
    for t in range(20):
        assert lost.step(t, [track(t)]) == ()
    assert len(lost.step(25.0, [])) == 1
    assert lost.step(26.0, [track(26.0)]) == ()
    (ghost,) = lost.step(35.0, [])
    assert ghost.position[0] == pytest.approx(100 + 50 * 9.0)


def test_what_was_never_confirmed_is_not_kept():
    lost = LostTraffic(60.0)
    lost.step(0.0, [track(status=TrackStatus.TENTATIVE), track(name="b2", status=TrackStatus.COASTING)])
    assert [ghost.id for ghost in lost.step(1.0, [])] == ["b2"]


def test_only_the_lost_ones_are_returned():
    lost = LostTraffic(60.0)
    lost.step(0.0, [track(), track(name="b2")])
    assert [ghost.id for ghost in lost.step(1.0, [track(1.0)])] == ["b2"]


@pytest.mark.parametrize(("present", "remembered"), [(["b2"], []), ([], ["a1", "b2"])])
def test_what_became_one_with_another_is_not_lost_unless_that_one_is_gone_too(present, remembered):
    lost = LostTraffic(60.0)
    lost.step(0.0, [track(), track(name="b2")])
    tracks = [track(1.0, name) for name in present]
    assert [ghost.id for ghost in lost.step(1.0, tracks, {"a1": "b2"})] == remembered
    assert [ghost.id for ghost in lost.step(2.0, tracks)] == remembered
