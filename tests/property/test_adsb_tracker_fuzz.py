"""The ADS-B tracker under arbitrary reports: never an exception, never a broken track, every report accounted for."""

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from wideberth.tracking.adsb_kalman import AdsbKalmanTracker
from wideberth.tracking.config import AdsbKalmanConfig
from wideberth.types import Scan, SourceInfo

VALUE = st.one_of(st.floats(-1e5, 1e5), st.sampled_from([math.nan, math.inf, -math.inf, 0.0, 1e300, -1e300, 5e-324]))
ROW = st.tuples(
    st.floats(-20.0, 20.0) | st.sampled_from([math.nan, math.inf, 0.0, 1e12, -1e12]),
    st.sampled_from(["abc123", "def456", ""]),
    st.tuples(*[VALUE] * 6),
    st.sampled_from([1.0, 16.0, 1e6, 0.0, math.nan, -1.0, math.inf]),
    st.sampled_from([None, 0, 8, 11, 15, -1]),
)
STEP = st.tuples(st.sampled_from([0.0, 0.1, 1.0, 7.0, 4000.0, -0.5, -5.0, -1e5]), st.lists(ROW, max_size=6))


@settings(max_examples=60, deadline=None)
@given(st.lists(STEP, max_size=12))
def test_anything_may_come(
    steps: list[tuple[float, list[tuple[float, str, tuple[float, ...], float, int | None]]]],
) -> None:
    tracker = AdsbKalmanTracker(AdsbKalmanConfig())
    t = 1e6
    given_reports = 0
    for dt, rows in steps:
        t += dt
        k = len(rows)
        given_reports += k
        scan = Scan(
            t=t,
            t_received=t,
            sensor="adsb",
            kind="adsb",
            z=np.array([row[2] for row in rows]).reshape(k, 6),
            R=np.array([np.diag([row[3]] * 6) for row in rows]).reshape(k, 6, 6),
            t_valid=np.array([t + row[0] for row in rows]),
            source_ids=tuple(row[1] for row in rows),
            sources=tuple(SourceInfo(nacp=row[4], nacv=row[4], nic=row[4]) for row in rows),
        )
        tracks, events = tracker.step(t, [scan])
        assert all(isinstance(event, str) and event for event in events)
        for track in tracks:
            assert np.all(np.isfinite(track.position))
            assert np.all(np.isfinite(track.velocity))
            assert np.all(np.isfinite(track.covariance))
            assert np.all(np.diag(track.covariance) > 0.0)
    counters = tracker.counters
    assert counters.get("reports", 0) == given_reports
    fates = (
        "time not finite",
        "time in the future",
        "too late",
        "value out of range",
        "variance out of range",
        "position accepted",
        "position outside the gate",
        "position not new",
        "no position yet",
        "no altitude yet",
        "report without position used",
        "report without position of a shared address",
        "altitude outside the gate",
        "climb rate outside the gate",
    )
    assert sum(counters.get(fate, 0) for fate in fates) >= given_reports
    assert all(n > 0 for n in counters.values())


@settings(max_examples=40, deadline=None)
@given(st.permutations(range(12)), st.integers(0, 2**32 - 1))
def test_order_of_arrival_does_not_matter(order: list[int], seed: int) -> None:
    """Twelve reports within the time that late reports are accepted: any order of arrival gives the same track."""
    rng = np.random.default_rng(seed)
    times = np.sort(rng.uniform(0.0, 2.9, 12))
    z = np.zeros((12, 6))
    z[:, :3] = np.array([50.0, -20.0, 0.0]) * times[:, None] + rng.normal(size=(12, 3)) * 6.0 + [0.0, 0.0, -500.0]
    z[:, 3:] = np.array([50.0, -20.0, 0.0])
    z[rng.random(12) < 0.2, :2] += 900.0
    z[rng.random(12) < 0.2, :2] = math.nan
    covariance = np.diag([16.0, 16.0, 500.0, 17.0, 17.0, 0.03])

    def scan(t: float, rows: list[int]) -> Scan:
        k = len(rows)
        return Scan(t, t, "adsb", "adsb", z[rows], np.tile(covariance, (k, 1, 1)), times[rows], ("a1b2c3",) * k)

    trackers = [AdsbKalmanTracker(AdsbKalmanConfig()) for _ in range(2)]
    for tracker, sequence in zip(trackers, (range(12), order), strict=True):
        for i in sequence:
            tracker.step(2.95, [scan(2.95, [i])])
    first, second = (tracker.step(2.95, [])[0] for tracker in trackers)
    assert [track.id for track in first] == [track.id for track in second]
    for a, b in zip(first, second, strict=True):
        assert np.allclose(a.position, b.position, rtol=1e-10, atol=1e-7)
        assert np.allclose(a.velocity, b.velocity, rtol=1e-10, atol=1e-7)
        assert np.allclose(a.covariance, b.covariance, rtol=1e-9, atol=1e-9)
        assert (a.status, a.t_last_update) == (b.status, b.t_last_update)
