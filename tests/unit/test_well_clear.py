"""Public behaviour of the well-clear functions: bounds, shapes, refusals."""

import math

import numpy as np
import pytest

from wideberth.conflict.well_clear import PRESETS, WellClearVolume, conflict_interval, violation

ZERO = np.zeros(3)
CYLINDER = WellClearVolume(100.0, 50.0)


def test_presets_are_the_published_thresholds() -> None:
    assert set(PRESETS) == {"sarp", "do365_phase1", "do365_buffered", "do365_noncooperative", "astm_f3442", "nmac"}
    assert PRESETS["sarp"].dthr == pytest.approx(1219.2)
    assert PRESETS["sarp"].zthr == pytest.approx(213.36)
    assert PRESETS["do365_buffered"].tcoa == 20.0
    assert PRESETS["nmac"].zthr == pytest.approx(30.48)


def test_known_crossing() -> None:
    # 1000 m ahead, closing with 10 m/s, 60 m above, sinking with 1 m/s: right height at 10 s, the circle at 90 s.
    t_in, t_out = conflict_interval(CYLINDER, [0, 0, 0], [10, 0, 0], [1000, 0, -60], [0, 0, 1], 200)
    assert t_in.shape == ()
    assert float(t_in) == pytest.approx(90.0)
    assert float(t_out) == pytest.approx(110.0)


def test_modified_tau_enters_before_the_circle() -> None:
    wcv = WellClearVolume(100.0, 50.0, 35.0)
    t_in, t_out = conflict_interval(wcv, ZERO, [10, 0, 0], [1000, 0, 0], ZERO, 200)
    # tau_mod = (1e4 - r^2) / (-10 r) = 35 s where r^2 - 350 r - 1e4 = 0.
    r = 175 + math.sqrt(175**2 + 1e4)
    assert float(t_in) == pytest.approx((1000 - r) / 10)
    assert float(t_out) == pytest.approx(110.0)


def test_miss_filter_drops_a_wide_pass() -> None:
    wcv = WellClearVolume(100.0, 50.0, 35.0)
    own = ([0, 0, 0], [10, 0, 0], [1000, 150, 0], [0, 0, 0])
    assert np.isnan(conflict_interval(wcv, *own, 200)[0])
    t_in, t_out = conflict_interval(wcv, *own, 200, miss_filter=False)
    assert 0 < t_in < t_out < 100


@pytest.mark.parametrize(
    ("s", "v", "expected"),
    [
        ([100, 0, 0], [0, 0, 0], True),  # at rest on the bound
        ([100, 0, 0], [-1, 0, 0], True),  # on the bound, entering
        ([100, 0, 0], [1, 0, 0], False),  # on the bound, leaving at this instant
        ([100, 0, 0], [0, 1, 0], False),  # grazing
        ([0, 0, 50], [0, 0, 0], True),
        ([0, 0, 50], [0, 0, -1], True),
        ([0, 0, 50], [0, 0, 1], False),
        ([0, 0, -50], [0, 0, -1], False),
        ([0, 0, 0], [0, 0, 0], True),
        ([100.001, 0, 0], [0, 0, 0], False),
        ([0, 0, 50.001], [0, 0, 0], False),
    ],
)
def test_bounds(s: list[float], v: list[float], expected: bool) -> None:
    assert bool(violation(CYLINDER, s, v, ZERO, ZERO)) is expected
    t_in, t_out = conflict_interval(CYLINDER, s, v, ZERO, ZERO, 10.0)
    assert (t_in == 0) == expected
    if expected:
        assert t_out > 0


def test_stationary_inside_is_cut_at_the_lookahead() -> None:
    t_in, t_out = conflict_interval(CYLINDER, ZERO, ZERO, [10, 0, 0], ZERO, 42.0)
    assert (float(t_in), float(t_out)) == (0.0, 42.0)


def test_entry_after_the_lookahead_is_no_conflict() -> None:
    assert np.isnan(conflict_interval(CYLINDER, ZERO, [10, 0, 0], [1000, 0, 0], ZERO, 89.0)[0])


def test_one_ownship_serves_many_intruders_and_none() -> None:
    rng = np.random.default_rng(3)
    p, v = rng.normal(size=(50, 3)) * 500, rng.normal(size=(50, 3)) * 20
    one = conflict_interval(PRESETS["sarp"], [1, 2, 3], [4, 5, 6], p, v, 60)
    each = conflict_interval(PRESETS["sarp"], np.tile([1, 2, 3], (50, 1)), np.tile([4, 5, 6], (50, 1)), p, v, 60)
    np.testing.assert_array_equal(one, each)
    assert one[0].shape == (50,)
    none = conflict_interval(PRESETS["sarp"], ZERO, ZERO, np.zeros((0, 3)), np.zeros((0, 3)), 60)
    assert none[0].shape == (0,)
    single_row = conflict_interval(PRESETS["sarp"], ZERO, ZERO, np.ones((1, 3)), np.zeros((1, 3)), 60)
    assert single_row[0].shape == (1,)


@pytest.mark.parametrize("position", range(4))
@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_non_finite_input_is_refused_by_name(position: int, bad: float) -> None:
    names = ["own_position", "own_velocity", "intruder_position", "intruder_velocity"]
    states = [np.zeros((4, 3)) for _ in names]
    states[position][2, 1] = bad
    own_p, own_v, p, v = states
    with pytest.raises(ValueError, match=names[position]):
        conflict_interval(CYLINDER, own_p, own_v, p, v, 60)
    with pytest.raises(ValueError, match=names[position]):
        violation(CYLINDER, own_p, own_v, p, v)


@pytest.mark.parametrize("lookahead", [math.nan, math.inf, -1.0])
def test_bad_lookahead_is_refused(lookahead: float) -> None:
    with pytest.raises(ValueError, match="lookahead"):
        conflict_interval(CYLINDER, ZERO, ZERO, ZERO, ZERO, lookahead)


@pytest.mark.parametrize("shape", [(2,), (4, 2), (2, 2, 3), ()])
def test_wrong_shapes_are_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match="intruder_position must have shape"):
        conflict_interval(CYLINDER, ZERO, ZERO, np.zeros(shape), ZERO, 60)


def test_different_counts_and_text_are_refused() -> None:
    with pytest.raises(ValueError, match="3 rows but own_position has 2"):
        conflict_interval(CYLINDER, np.zeros((2, 3)), ZERO, np.zeros((3, 3)), ZERO, 60)
    with pytest.raises(ValueError, match="own_velocity must be numbers"):
        conflict_interval(CYLINDER, ZERO, ["a", "b", "c"], ZERO, ZERO, 60)


@pytest.mark.parametrize(
    "bad", [(-1, 1), (math.nan, 1), (1, math.inf), (0, 1), (1, 0), (1, 1, -1), (1, 1, 0, math.nan)]
)
def test_bad_volume_is_refused(bad: tuple[float, ...]) -> None:
    with pytest.raises(ValueError, match="well-clear volume"):
        WellClearVolume(*bad)
