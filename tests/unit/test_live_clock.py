"""Clocks, the grid of steps, and the histogram of durations."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.live_fakes import HandClock
from wideberth.live.clock import LiveClock, SensorClock
from wideberth.live.latency import Histogram
from wideberth.live.pacing import Pacer
from wideberth.types import Scan


def test_live_time_goes_on_whatever_is_done_to_the_hosts_clock():
    hand = HandClock(1_700_000_000.0)
    clock = LiveClock(*hand.both)
    assert clock.now() == 1_700_000_000.0 and clock.watch() == ()
    hand.advance(5.0)
    hand.wall += 3.0
    assert clock.now() == pytest.approx(1_700_000_005.0)
    (event,) = clock.watch()
    assert "jumped by +3.0 s" in event and clock.jumps == 1 and clock.offset == pytest.approx(3.0)
    assert clock.watch() == ()  # said once
    hand.wall -= 3.0
    assert "-3.0 s" in clock.watch()[0] and clock.jumps == 2
    for _ in range(100):  # a clock that is slewed has not jumped
        hand.advance(1.0)
        hand.wall += 0.01
        assert clock.watch() == ()
    assert clock.offset == pytest.approx(1.0)


def scan(t, received):
    return Scan(t, received, "radar", "radar", np.zeros((0, 4)), np.zeros((0, 4, 4)), np.zeros(0))


def test_a_sensors_clock_that_is_behind_is_told_from_single_late_scans():
    clock = SensorClock()
    assert clock.delay is None and clock.trouble() == ""
    for k in range(20):
        clock.note(scan(k * 0.1, k * 0.1 + (2.0 if k == 7 else 0.03)))
        assert clock.trouble() == ""
    assert clock.delay == pytest.approx(0.03)
    for k in range(20, 30):
        clock.note(scan(k * 0.1, k * 0.1 + 1.5))
    assert "1.5 s old" in clock.trouble()


def test_steps_start_on_the_grid_and_missed_ones_are_not_caught_up():
    pacer = Pacer(10.0, 0.1)
    assert pacer.next_start == 10.0
    pacer.finish(10.03)
    assert pacer.next_start == pytest.approx(10.1) and pacer.missed == 0
    pacer.finish(10.24)  # 40 ms late for 10.2: it starts at once
    assert pacer.next_start == pytest.approx(10.2) and pacer.missed == 0
    pacer.finish(10.37)  # too late for 10.3
    assert pacer.next_start == pytest.approx(10.4) and pacer.missed == 1
    pacer.finish(20.37)  # the machine slept
    assert pacer.next_start == pytest.approx(20.4) and pacer.missed == 100


@given(st.lists(st.floats(0.0, 0.7), min_size=1, max_size=50))
def test_every_start_is_taken_or_counted_as_missed(durations):
    pacer, now = Pacer(0.0, 0.1), 0.0
    for taken in durations:
        start = max(now, pacer.next_start)
        assert start - pacer.next_start <= 0.05 + 1e-9
        now = start + taken
        pacer.finish(now)
    assert round(pacer.next_start / 0.1) == len(durations) + pacer.missed


def test_percentiles_of_durations():
    histogram = Histogram()
    assert histogram.milliseconds() == {"count": 0, "mean": None, "p50": None, "p95": None, "p99": None, "max": None}
    assert math.isnan(histogram.percentile(0.5))
    rng = np.random.default_rng(4)
    values = rng.gamma(2.0, 0.004, 5000)
    for value in values:
        histogram.add(float(value))
    found = histogram.milliseconds()
    assert found["count"] == 5000 and found["max"] == pytest.approx(1e3 * values.max(), abs=1e-3)
    assert found["mean"] == pytest.approx(1e3 * values.mean(), abs=1e-3)
    for name, share in (("p50", 50), ("p95", 95), ("p99", 99)):
        true = 1e3 * np.percentile(values, share, method="inverted_cdf")
        assert true - 1e-9 <= found[name] <= true + 0.1 + 1e-3
    histogram.add(-1e-9)
    histogram.add(1e6)
    assert histogram.count == 5002 and histogram.percentile(1.0) == pytest.approx(10.0)
