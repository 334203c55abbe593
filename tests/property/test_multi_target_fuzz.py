"""Whatever scans the default tracker is given: it raises nothing, and what it reports is finite and sound."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wideberth.tracking.multi_target.config import MultiTargetConfig
from wideberth.tracking.multi_target.tracker import MultiTargetTracker
from wideberth.types import DetectionModel, Scan

pytestmark = pytest.mark.kernels

wild = st.one_of(st.floats(-700.0, 700.0), st.sampled_from([math.nan, math.inf, -math.inf, 0.0, 1e300, -1e-300]))
tame = st.tuples(st.floats(1.0, 600.0), st.floats(-3.2, 3.2), st.floats(-1.7, 1.7), st.floats(-50.0, 50.0))
rows = st.lists(st.one_of(tame, st.tuples(wild, wild, wild, wild)), max_size=6)


@st.composite
def scans(draw, index):
    z = np.array(draw(rows), float).reshape(-1, 4)
    sigma = draw(st.sampled_from([(0.4, 0.02, 0.02, 0.3), (5.0, 0.2, math.nan, math.nan), (0.0, 0.1, 0.1, 0.1)]))
    t = 0.1 * index + draw(st.sampled_from([0.0, 0.0, 0.0, -0.2, -0.4, 3.0, -60.0, math.nan]))
    return Scan(
        t=t,
        t_received=t,
        sensor=draw(st.sampled_from(["a", "b"])),
        kind=draw(st.sampled_from(["radar", "radar", "radar", "adsb"])),
        z=z,
        R=np.tile(np.diag(np.square(sigma)), (len(z), 1, 1)),
        t_valid=np.full(len(z), t),
        sensor_position=np.array(draw(st.sampled_from([(0.0, 0.0, 0.0), (2.0, 1.0, 0.0), (9e9, 0.0, 0.0)]))),
        field_of_view=draw(st.sampled_from([(math.pi, math.pi / 2), (1.0, 0.5)])),
        detection=draw(st.sampled_from([None, DetectionModel(np.array([600.0]), np.array([1.0]))])),
    )


@settings(max_examples=30)
@given(st.data())
def test_anything_may_come(data):
    tracker = MultiTargetTracker(MultiTargetConfig(known_altitude_m=data.draw(st.sampled_from([None, 100.0]))))
    for index in range(12):
        given_scans = data.draw(st.lists(scans(index), max_size=2))
        t = 0.1 * index + data.draw(st.sampled_from([0.0, 0.0, 0.05, 100.0, -100.0]))
        tracks, events = tracker.step(t, given_scans)
        for track in tracks:
            assert np.isfinite(track.position).all() and np.isfinite(track.velocity).all()
            assert np.linalg.eigvalsh(track.covariance).min() > -1e-6 * np.trace(track.covariance)
            assert 0.0 < track.existence < 1.0
        assert len({track.id for track in tracks}) == len(tracks)
        assert all(isinstance(e, str) for e in events)
    assert all(n > 0 for n in tracker.counters.values())


@settings(max_examples=20)
@given(st.integers(0, 2**32 - 1), st.integers(1, 8))
def test_crowds_in_one_place_stay_sound(seed, n):
    """Many plots of the same place: clusters beyond enumeration, merges, and no covariance breaks."""
    rng = np.random.default_rng(seed)
    tracker = MultiTargetTracker(MultiTargetConfig(event_limit=20))
    for k in range(15):
        z = np.column_stack(
            [200.0 + rng.normal(size=n), 0.02 * rng.normal(size=n), 0.3 + 0.02 * rng.normal(size=n), np.full(n, np.nan)]
        )
        scan = Scan(
            t=0.1 * k,
            t_received=0.1 * k,
            sensor="a",
            kind="radar",
            z=z,
            R=np.tile(np.diag([0.16, 3e-4, 3e-4, np.nan]), (n, 1, 1)),
            t_valid=np.full(n, 0.1 * k),
            detection=DetectionModel(np.array([600.0]), np.array([0.8])),
        )
        tracks, _ = tracker.step(0.1 * k, [scan])
        for track in tracks:
            assert np.linalg.eigvalsh(track.covariance).min() > -1e-9
