"""Well-clear intervals against a sampling twin, degenerate geometry included."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.naive import conflict as naive
from wideberth.conflict.well_clear import PRESETS, WellClearVolume, conflict_interval, violation

ZERO = np.zeros(3)
position = st.tuples(st.floats(-8000, 8000), st.floats(-8000, 8000), st.floats(-500, 500)).map(np.array)
speed = st.one_of(st.just(0.0), st.floats(-1e-6, 1e-6), st.floats(-200, 200))
velocity = st.tuples(speed, speed, st.one_of(st.just(0.0), st.floats(-1e-9, 1e-9), st.floats(-15, 15))).map(np.array)
volume = st.one_of(
    st.sampled_from(sorted(PRESETS)).map(PRESETS.__getitem__),
    st.builds(WellClearVolume, st.floats(10, 3000), st.floats(10, 400), st.floats(0, 60), st.floats(0, 40)),
)


def shared(v: WellClearVolume) -> tuple[float, float, float, float]:
    return v.dthr, v.zthr, v.tthr, v.tcoa


@settings(max_examples=300, deadline=None)
@given(position, velocity, volume, st.booleans())
def test_interval_agrees_with_its_own_definition(
    s: np.ndarray, v: np.ndarray, wcv: WellClearVolume, miss_filter: bool
) -> None:
    lookahead = 120.0
    t_in, t_out = (float(t) for t in conflict_interval(wcv, s, v, ZERO, ZERO, lookahead, miss_filter=miss_filter))
    times = np.linspace(0.0, lookahead, 601)
    state = s + v * times[:, None]
    hit = naive.inside(state, np.broadcast_to(v, state.shape), shared(wcv), miss_filter)
    # Away from the bounds by the rounding of a grazing pass, every instant must agree with the definition.
    near = 1e-3
    within = (times > t_in + near) & (times < t_out - near)
    without = ~((times >= t_in - near) & (times <= t_out + near))
    graze = _grazes(s, v, wcv)
    if not graze:
        assert hit[within].all()
        assert not hit[without].any()


def _grazes(s: np.ndarray, v: np.ndarray, wcv: WellClearVolume) -> bool:
    """Whether the verdict hangs on rounding: the miss distance is the radius, or a height bound is held to rounding."""
    speed = np.hypot(v[0], v[1])
    miss = np.hypot(s[0], s[1]) if speed == 0 else abs(s[0] * v[1] - s[1] * v[0]) / speed
    # Slower than this the definition itself loses its digits in s.v.
    slow = 0 < speed < 1e-3 or 0 < abs(v[2]) < 1e-3
    # Starting on a bound and leaving is a touch of no duration, no conflict, though the bound belongs to the volume.
    touch = abs(abs(s[2]) - wcv.zthr) < 1e-6 or abs(np.hypot(s[0], s[1]) - wcv.dthr) < 1e-6
    return bool(abs(miss - wcv.dthr) < 1e-3 or slow or touch)


@settings(max_examples=300, deadline=None)
@given(position, velocity, volume, st.booleans())
def test_violation_is_where_the_interval_begins_now(
    s: np.ndarray, v: np.ndarray, wcv: WellClearVolume, miss_filter: bool
) -> None:
    t_in, t_out = conflict_interval(wcv, s, v, ZERO, ZERO, 60.0, miss_filter=miss_filter)
    assert bool(violation(wcv, s, v, ZERO, ZERO, miss_filter=miss_filter)) == (t_in == 0)
    assert np.isnan(t_in) == np.isnan(t_out)
    assert np.isnan(t_in) or 0 <= t_in <= t_out <= 60


@settings(max_examples=200, deadline=None)
@given(position, velocity, volume, st.floats(0, 2 * np.pi))
def test_interval_does_not_depend_on_frame_or_on_who_is_own(
    s: np.ndarray, v: np.ndarray, wcv: WellClearVolume, angle: float
) -> None:
    if _grazes(s, v, wcv):
        return
    c, d = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -d, 0], [d, c, 0], [0, 0, 1]])
    base = conflict_interval(wcv, s, v, ZERO, ZERO, 90.0)
    swapped = conflict_interval(wcv, ZERO, ZERO, s, v, 90.0)
    np.testing.assert_array_equal(base, swapped)
    turned = np.array(conflict_interval(wcv, turn @ s, turn @ v, ZERO, ZERO, 90.0))
    for a, b in zip(base, turned, strict=True):
        # A bound met to rounding at an end of the look-ahead may flip the verdict.
        if not (np.isnan(a) or np.isnan(b)):
            assert a == pytest.approx(b, abs=1e-4)
        else:
            assert np.isnan(a) == np.isnan(b) or np.nanmin([base[1] - base[0], turned[1] - turned[0]]) < 1e-4


def test_random_pairs_agree_with_sampling_twin() -> None:
    rng = np.random.default_rng(20)
    found = 0
    for k in range(600):
        wcv = list(PRESETS.values())[k % 6]
        miss_filter = bool(rng.integers(2))
        s = rng.normal(size=3) * [2000, 2000, 150]
        v = rng.normal(size=3) * [60, 60, 5]
        degenerate = rng.integers(8)
        if degenerate == 0:
            v[2] = 0.0
        elif degenerate == 1:
            v[:2] = 0.0
        elif degenerate == 2:
            v[:] = 0.0
        elif degenerate == 3:
            s[:2] /= 20
        got = [float(t) for t in conflict_interval(wcv, s, v, ZERO, ZERO, 180.0, miss_filter=miss_filter)]
        expected = naive.interval(s, v, shared(wcv), 180.0, miss_filter)
        if np.isnan(expected[0]):
            # Shorter than the twin's step: it may miss the visit.
            assert np.isnan(got[0]) or got[1] - got[0] < 0.05
        else:
            found += 1
            np.testing.assert_allclose(got, expected, rtol=0, atol=1e-6)
    assert found > 100
