"""Reports that come seconds late without saying so are counted and told, and make no second aircraft."""

import math
import os
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.naive import tracking as naive
from wideberth.tracking.adsb_kalman import AdsbKalmanTracker
from wideberth.tracking.config import AdsbKalmanConfig
from wideberth.tracking.delay_kernels import LATEST, TURN_RATE, delay_on_path
from wideberth.tracking.multi_target.config import MultiTargetConfig
from wideberth.tracking.multi_target.tracker import MultiTargetTracker
from wideberth.types import FloatArray, Scan, SourceInfo

ADDRESS = "a00001"
COUNTED = "position late: where its aircraft was"
number = st.floats(-300.0, 300.0)
INTERPRETED = os.environ.get("NUMBA_DISABLE_JIT") == "1"


@given(st.floats(-4000.0, 4000.0), number, number, number, number, number, st.floats(0.0, 300.0))
def test_the_delay_is_that_of_the_naive_twin(north, east, v_north, v_east, t_north, t_east, margin) -> None:
    track = np.array([t_north, t_east])
    found = delay_on_path(north, east, v_north, v_east, track, margin)
    offset, velocity = np.array([north, east]), np.array([v_north, v_east])
    # Close to where it is decided, the twin's steps decide another way.
    looser = naive.delay_on_path(offset, velocity, track * 1.0001, margin + 2.0, LATEST + 0.01, TURN_RATE)
    tighter = naive.delay_on_path(offset, velocity, track, max(margin - 2.0, 0.0), LATEST - 0.01, TURN_RATE)
    if math.isnan(found):
        assert tighter is None or math.hypot(v_north, v_east) < 1.0001 or margin < 2.0
    elif looser is not None:
        assert found == pytest.approx(looser, abs=0.01)
    else:
        assert math.hypot(*velocity) < 1.0001 or velocity @ track == pytest.approx(
            0.5 * math.hypot(*velocity) * math.hypot(*track), rel=1e-3
        )


def test_where_an_aircraft_was_five_seconds_ago() -> None:
    track = np.array([60.0, 0.0])
    assert delay_on_path(-300.0, 20.0, 60.0, 0.0, track, 100.0) == pytest.approx(5.0)
    assert delay_on_path(300.0, 20.0, 60.0, 0.0, track, 100.0) == pytest.approx(-5.0)
    for north, east, v_north in ((-300.0, 400.0, 60.0), (-700.0, 0.0, 60.0), (-300.0, 0.0, -60.0), (-300.0, 0.0, 0.0)):
        assert math.isnan(delay_on_path(north, east, v_north, 0.0, track, 100.0))


def scan(t: float, rows: list[FloatArray]) -> list[Scan]:
    if not rows:
        return []
    k = len(rows)
    r = np.tile(np.diag([25.0, 25.0, 400.0, 4.0, 4.0, 1.0]), (k, 1, 1))
    info = SourceInfo(nic=8, nacp=9, nacv=2)
    return [Scan(t, t, "adsb", "adsb", np.array(rows), r, np.full(k, t), (ADDRESS,) * k, (info,) * k)]


def fly(tracker: Any, speed: float, share: float, turn: float) -> tuple[int, list[str]]:
    """Send a report a second, a share of them 5 s late; return the most tracks at a time, and what was told."""
    rng = np.random.default_rng([7, int(speed), int(100 * share)])
    coming: dict[int, list[FloatArray]] = {}
    most, told = 0, []
    for k in range(0, 700 if not INTERPRETED else 400):
        t = 0.1 * k
        if k % 10 == 0:
            course = math.radians(turn) * t
            radius = speed / math.radians(turn) if turn else math.inf
            place = [radius * math.sin(course), radius * (1.0 - math.cos(course))] if turn else [speed * t, 0.0]
            row = [*(place + rng.normal(0.0, 3.0, 2)), -900.0, speed * math.cos(course), speed * math.sin(course), 0.0]
            when = k + (50 if rng.random() < share and k > 100 else 0)
            coming.setdefault(when, []).append(np.array(row))
        tracks, events = tracker.step(1e9 + t, scan(1e9 + t, coming.pop(k, [])))
        most = max(most, len(tracks))
        told += events
    return most, told


@pytest.mark.parametrize("turn", [0.0, 3.0])
@pytest.mark.parametrize("speed", [45.0, 120.0, 220.0])
@pytest.mark.parametrize("kind", ["adsb_kalman", "wideberth"])
def test_messages_five_seconds_late_make_no_second_aircraft(kind, speed, turn) -> None:
    if INTERPRETED and (kind, speed) != ("wideberth", 120.0):
        pytest.skip("takes long without the compiler")
    shares = (0.4,) if INTERPRETED else (0.1, 0.4, 0.9)
    late = 0
    for share in shares:
        config = (
            AdsbKalmanTracker(AdsbKalmanConfig()) if kind == "adsb_kalman" else MultiTargetTracker(MultiTargetConfig())
        )
        most, told = fly(config, speed, share, turn)
        assert most == 1
        assert not any("two aircraft" in event or "#2" in event for event in told)
        late += config.counters.get(COUNTED, 0)
        assert sum("come seconds late" in event for event in told) <= 1
        assert config.counters["position outside the gate"] > 0
    assert late > 0 or INTERPRETED
