"""Whatever reports come among whatever plots: nothing is raised, all is counted, and what is told is finite."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.fusion_scene import Scene
from wideberth.simulation.radar_plots import radar_scan
from wideberth.tracking.multi_target.config import MultiTargetConfig
from wideberth.tracking.multi_target.tracker import MultiTargetTracker
from wideberth.tracking.multi_target.words import REPORT_COUNTERS
from wideberth.types import Scan, SourceInfo

wild = st.sampled_from([math.nan, math.inf, -math.inf, 0.0, 1e300, 1e6, -3e7])
element = st.one_of(st.floats(-800.0, 800.0), wild)
report = st.one_of(st.tuples(*[st.floats(-800.0, 800.0)] * 3, *[st.floats(-60.0, 60.0)] * 3), st.tuples(*[element] * 6))
late = st.sampled_from([0.0, 0.0, 0.0, 0.0, -0.2, -0.7, -2.0, -60.0, 0.4, 9.0, math.nan, math.inf])
variance = st.sampled_from([(25.0, 25.0, 9.0, 1.0, 1.0, 1.0), (1e6,) * 6, (0.0,) * 6, (-1.0,) * 6, (math.nan,) * 6])
nacp = st.sampled_from([None, 0, 5, 8, 11])
DISPOSALS = {
    "time not finite", "time in the future", "too late", "value out of range", "variance out of range",
    "address beyond the most",
} | set(list(REPORT_COUNTERS.values())[:10])  # fmt: skip
"""Each report ends in one of these."""


@st.composite
def adsb(draw, t):
    rows = draw(st.lists(st.tuples(report, st.sampled_from("abcd"), late, variance, nacp), max_size=5))
    rows = rows + rows[: draw(st.integers(0, 2))]
    z = np.array([row[0] for row in rows], float).reshape(-1, 6)
    return Scan(
        t=t,
        t_received=t,
        sensor=draw(st.sampled_from(["ears", "more ears"])),
        kind="adsb",
        z=z,
        R=np.array([np.diag(row[3]) for row in rows], float).reshape(-1, 6, 6),
        t_valid=np.array([t + row[2] for row in rows], float),
        source_ids=tuple(row[1] for row in rows),
        sources=tuple(SourceInfo(nacp=row[4]) for row in rows),
    )


SCENE = Scene(np.array([[300.0, -200.0, -150.0]]), np.array([[-20.0, 12.0, 1.0]]), 3.0, (0,))
PLOTS = [radar_scan(SCENE.plots, k) for k in range(len(SCENE.t))]
TRUE = [SCENE.reports(k) for k in range(len(SCENE.t))]


def assert_sound(tracks, tracker):
    for track in tracks:
        assert np.isfinite(track.position).all() and np.isfinite(track.velocity).all()
        assert np.isfinite(track.covariance).all()
        assert np.linalg.eigvalsh(track.covariance).min() > -1e-6 * np.trace(track.covariance)
        assert 0.0 < track.existence < 1.0
    assert len({track.id for track in tracks}) == len(tracks)
    counters = tracker.counters
    assert counters.get("reports", 0) == sum(n for words, n in counters.items() if words in DISPOSALS)


@settings(max_examples=25)
@given(st.data())
def test_any_reports_may_come_among_plots(data):
    tracker = MultiTargetTracker(MultiTargetConfig(reports={"addresses_max": data.draw(st.sampled_from([2, 100]))}))
    for k in range(12):
        t = 0.1 * k
        scans = [PLOTS[k]] if data.draw(st.booleans()) else []
        scans += [TRUE[k]] if data.draw(st.booleans()) else []
        scans += data.draw(st.lists(adsb(t), max_size=2))
        tracks, events = tracker.step(t, data.draw(st.permutations(scans)))
        assert_sound(tracks, tracker)
        assert all(isinstance(e, str) for e in events)


@settings(max_examples=15)
@given(st.lists(st.sampled_from([0.05, 0.1, 0.1, 1.0, 20.0, 70.0, -0.3, -5.0]), min_size=5, max_size=15), st.data())
def test_time_may_jump(steps, data):
    """Counters start anew where time goes back, so only soundness is asked for."""
    tracker, t = MultiTargetTracker(MultiTargetConfig()), 0.0
    for dt in steps:
        t += dt
        tracks, _ = tracker.step(t, [data.draw(adsb(t))])
        for track in tracks:
            assert np.isfinite(track.position).all() and np.isfinite(track.covariance).all()


def paths(tracks):
    """Tracks in an order that does not depend on their numbers."""
    rows = [np.concatenate([x.position, x.velocity, x.covariance.ravel()]) for x in tracks]
    return np.array(sorted(rows, key=lambda row: tuple(row[:3]))), sorted(x.label or "" for x in tracks if x.info)


SPAN = 120
BUSY = Scene(
    np.array([[300.0, -200.0, -150.0], [-250.0, 300.0, -200.0]]),
    np.array([[-20.0, 12.0, 1.0], [20.0, -15.0, 0.0]]),
    0.1 * SPAN,
    (0, 1),
    seed=3,
)
BUSY_SCANS = [[radar_scan(BUSY.plots, k), BUSY.reports(k)] for k in range(SPAN)]


def run(delays):
    """Step the busy scene with each scan handed over some steps late; return the tracks of the last ten steps."""
    tracker, waiting, last = MultiTargetTracker(MultiTargetConfig()), [], []
    for k in range(SPAN):
        for which, scan in enumerate(BUSY_SCANS[k]):
            waiting.append((k + (0 if k >= SPAN - 15 else delays[2 * k + which]), scan))
        now = [scan for due, scan in waiting if due <= k]
        waiting = [(due, scan) for due, scan in waiting if due > k]
        tracks, _ = tracker.step(0.1 * k, now)
        last.append(tracks)
    return last[-5:], tracker.counters


@pytest.mark.parametrize("seed", range(4))
def test_late_scans_and_reports_give_the_tracks_of_those_in_order(seed):
    delays = np.random.default_rng(seed).integers(0, 4, size=2 * SPAN)
    expected, _ = run(np.zeros(2 * SPAN, int))
    got, counters = run(delays)
    assert counters["scan late, put in order"] > 20 and counters["reports late, put in order"] >= 5
    for a, b in zip(expected, got, strict=True):
        (x, names), (y, others) = paths(a), paths(b)
        assert x.shape == y.shape and len(names) == len(others)
        np.testing.assert_allclose(y, x, rtol=1e-6, atol=1e-6)
