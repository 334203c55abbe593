"""Plots made ready for a scan, and the window of those left over."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.made_windows import window_of
from wideberth.tracking.multi_target.buffers_kernels import COUNTS, PLOTS_NOT_FINITE, PLOTS_OUT_OF_RANGE, make_scratch
from wideberth.tracking.multi_target.intake_kernels import elevation_at_height, first_above, sort_by_key, take_in
from wideberth.tracking.radar_kernels import to_position

VARIANCE = np.array([0.16, 3e-4, 3e-4, np.nan])


def taken(z, attitude=None, known=math.nan, variance=VARIANCE):
    z = np.array(z, float).reshape(-1, 4)
    s, counts = make_scratch(1, max(len(z), 1), 2), np.zeros(COUNTS, np.int64)
    c = np.eye(3) if attitude is None else attitude
    n = take_in(z, np.tile(variance, (len(z), 1)), 0, len(z), np.zeros(3), c, 600.0, known, 10.0, False, counts, s)
    return n, s, counts


@given(st.lists(st.floats(-1e6, 1e6), max_size=40))
def test_sorting_and_searching(values):
    key, order = np.array([*values, 0.0]), np.arange(len(values) + 1)
    n = len(values)
    sort_by_key(key, order, n)
    assert order[:n].tolist() == sorted(range(n), key=lambda i: (key[i], i))
    for value in (*values[:3], 0.5):
        assert first_above(key, order, n, value) == int(np.searchsorted(key[order[:n]], value))


@pytest.mark.parametrize(
    ("row", "place"),
    [
        ([np.nan, 0, 0, np.nan], PLOTS_NOT_FINITE),
        ([100, np.inf, 0, np.nan], PLOTS_NOT_FINITE),
        ([100, 0, np.inf, np.nan], PLOTS_NOT_FINITE),
        ([100, 0, 0, 5.0], PLOTS_NOT_FINITE),  # a range rate without a variance
        ([-5, 0, 0, np.nan], PLOTS_OUT_OF_RANGE),
        ([0, 0, 0, np.nan], PLOTS_OUT_OF_RANGE),
        ([5000, 0, 0, np.nan], PLOTS_OUT_OF_RANGE),
        ([100, 50, 0, np.nan], PLOTS_OUT_OF_RANGE),
        ([100, 0, -50, np.nan], PLOTS_OUT_OF_RANGE),
    ],
)
def test_plots_that_cannot_be_right_are_counted(row, place):
    n, s, counts = taken([[200, 0.1, 0.2, np.nan], row, [100, 0.1, 0.2, np.nan]])
    assert n == 2 and counts[place] == 1 and counts.sum() == 1
    assert s.order[:2].tolist() == [2, 0]


def test_variances_must_be_positive():
    n, _, counts = taken([[100, 0, 0, np.nan]], variance=np.array([0.0, 1e-4, 1e-4, np.nan]))
    assert n == 0 and counts[PLOTS_OUT_OF_RANGE] == 1


@given(
    st.floats(-3.1, 3.1),
    st.floats(50.0, 600.0),
    st.floats(-0.9, 0.9),
    st.floats(-0.3, 0.3),
    st.floats(-3.0, 3.0),
)
def test_a_known_height_gives_the_elevation(azimuth, distance, share, pitch, yaw):
    cp, sp, cy, sy = math.cos(pitch), math.sin(pitch), math.cos(yaw), math.sin(yaw)
    attitude = np.array([[cp * cy, -sy, sp * cy], [cp * sy, cy, sp * sy], [-sp, 0.0, cp]])
    below = distance * share * 0.9
    elevation, variance = elevation_at_height(attitude, azimuth, distance, below, 5.0)
    out = np.zeros(3)
    to_position(np.zeros(3), attitude, distance, azimuth, elevation, out)
    assert out[2] == pytest.approx(below, abs=1e-6 * distance) or abs(below) > 0.8 * distance
    assert 0.0 < variance <= 0.25


def test_the_known_height_is_put_into_plots_without_elevation():
    n, s, _ = taken([[500, 0.5, np.nan, np.nan]], known=-100.0)
    assert n == 1 and s.z[0, 2] == pytest.approx(math.asin(0.2))
    assert math.sqrt(s.variance[0, 2]) == pytest.approx(10.0 / (500 * math.cos(math.asin(0.2))))
    n, s, _ = taken([[500, 0.5, np.nan, np.nan]])
    assert n == 1 and math.isnan(s.z[0, 2])


def test_what_the_sphere_does_not_reach_is_taken_at_the_nearest():
    elevation, variance = elevation_at_height(np.eye(3), 0.0, 100.0, -150.0, 5.0)
    assert elevation == pytest.approx(math.pi / 2) and variance == 0.25
    assert elevation_at_height(np.zeros((3, 3)), 0.0, 100.0, -150.0, 5.0) == (0.0, 0.25)


def test_a_window_sheds_evenly_and_keeps_the_newest_scans():
    row = [[100.0 + i, 0.0, 0.1, np.nan] for i in range(100)]
    window = window_of([row, row[:3]], room=10)
    assert window.filled.tolist() == [10, 3]
    steps = np.diff(window.z[0, :10, 0])
    assert steps.min() >= 9.0 and steps.max() <= 11.0
