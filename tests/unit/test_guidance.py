"""Lines, arcs, fillets and Dubins paths."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wideberth.vehicles import guidance_kernels as gk
from wideberth.vehicles.path_manager import PathManager
from wideberth.vehicles.path_segments import dubins_segments, fillet_segments, straight_segments

SPEEDS = np.full(3, 20.0)
CORNER = np.array([[0.0, 0.0, -100.0], [1000.0, 0.0, -100.0], [1000.0, 800.0, -140.0]])


def ends(row: np.ndarray) -> tuple[np.ndarray, float, np.ndarray, float]:
    """Start, course there, end, course there."""
    turn, end = row[gk.S_TURN], row[gk.S_END_NORTH : gk.S_END_EAST + 1]
    end_course = math.atan2(row[gk.S_NORMAL_EAST], row[gk.S_NORMAL_NORTH])
    at = row[gk.S_NORTH : gk.S_EAST + 1]
    if turn == 0.0:
        return at, row[gk.S_COURSE], end, row[gk.S_COURSE]
    side = row[gk.S_COURSE] + turn * math.pi / 2
    return at - row[gk.S_RADIUS] * np.array([math.cos(side), math.sin(side)]), row[gk.S_COURSE], end, end_course


def assert_joined(segments: np.ndarray) -> None:
    for row, after in itertools.pairwise(segments):
        _, _, end, course = ends(row)
        start, start_course, _, _ = ends(after)
        assert start == pytest.approx(end, abs=1e-5)
        assert math.remainder(course - start_course, 2 * math.pi) == pytest.approx(0.0, abs=1e-6)
        assert row[gk.S_END_ALTITUDE] == pytest.approx(after[gk.S_ALTITUDE], abs=1e-6)


def test_vector_fields_point_to_their_paths() -> None:
    assert gk.line_course(0.0, 0.7, 1.0472, 0.025) == 0.7
    assert gk.line_course(1e9, 0.7, 1.0472, 0.025) == pytest.approx(0.7 - 1.0472)
    assert gk.line_course(40.0, 0.0, 1.0472, 0.025) == pytest.approx(-1.0472 / 2)
    assert gk.orbit_course(100.0, 0.3, 100.0, 1.0, 4.0) == pytest.approx(0.3 + math.pi / 2)
    assert gk.orbit_course(100.0, 0.3, 100.0, -1.0, 4.0) == pytest.approx(0.3 - math.pi / 2)
    assert gk.orbit_course(1e9, 0.3, 100.0, 1.0, 4.0) == pytest.approx(0.3 + math.pi, abs=1e-6)


def test_a_fillet_is_where_the_book_has_it() -> None:
    radius = 120.0
    line, arc, last = fillet_segments(CORNER, SPEEDS, radius)
    cut = radius / math.tan(math.radians(90.0) / 2.0)
    assert line[gk.S_END_NORTH : gk.S_END_EAST + 1] == pytest.approx([1000.0 - cut, 0.0])
    before, after = np.array([1.0, 0.0]), np.array([0.0, 1.0])
    centre = CORNER[1, :2] - (before - after) / math.sqrt(2) * radius / math.sin(math.radians(45.0))
    assert arc[gk.S_NORTH : gk.S_EAST + 1] == pytest.approx(centre)
    assert arc[gk.S_END_NORTH : gk.S_END_EAST + 1] == pytest.approx([1000.0, cut])
    assert last[gk.S_END_ALTITUDE] == 140.0
    assert_joined(np.stack([line, arc, last]))


def test_straight_legs_change_at_the_bisector() -> None:
    first, last = straight_segments(CORNER, SPEEDS)
    assert first[gk.S_NORMAL_NORTH : gk.S_NORMAL_EAST + 1] == pytest.approx([math.sqrt(0.5)] * 2)
    assert last[gk.S_NORMAL_NORTH : gk.S_NORMAL_EAST + 1] == pytest.approx([0.0, 1.0], abs=1e-12)


@given(
    st.floats(-600, 600), st.floats(-600, 600), st.floats(-math.pi, math.pi), st.floats(-math.pi, math.pi),
    st.floats(10, 150), st.floats(-50, 50),
)  # fmt: skip
def test_dubins_paths_are_joined_and_shortest(
    north: float, east: float, first: float, last: float, radius: float, climb: float
) -> None:
    if math.hypot(north, east) < 2.0:
        return
    points = np.array([[0.0, 0.0, -200.0], [north, east, -200.0 - climb]])
    segments = dubins_segments(points, np.full(2, 20.0), radius, [first, last])
    assert_joined(segments)
    start, course, _, _ = ends(segments[0])
    _, _, end, end_course = ends(segments[-1])
    assert start == pytest.approx([0.0, 0.0], abs=1e-6)
    assert end == pytest.approx([north, east], abs=1e-4)
    assert math.remainder(course - first, 2 * math.pi) == pytest.approx(0.0, abs=1e-6)
    assert math.remainder(end_course - last, 2 * math.pi) == pytest.approx(0.0, abs=1e-6)
    assert segments[-1, gk.S_END_ALTITUDE] == pytest.approx(200.0 + climb)
    total = segments[:, gk.S_LENGTH].sum()
    assert total >= math.hypot(north, east) - 1e-6
    # As long backwards: the reversed path with reversed courses is its mirror in time.
    back = dubins_segments(points[::-1], np.full(2, 20.0), radius, [last + math.pi, first + math.pi])
    assert back[:, gk.S_LENGTH].sum() == pytest.approx(total, rel=1e-6)


@given(st.floats(-math.pi, math.pi), st.floats(-1, 1), st.sampled_from([-1.0, 1.0]))
def test_an_arc_of_half_a_circle_is_not_left_at_its_start(course: float, off: float, turn: float) -> None:
    points = np.array(
        [[0.0, 0.0, -100.0], [200.0 * math.cos(course + turn * 1.57), 200.0 * math.sin(course + turn * 1.57), -100.0]]
    )
    segments = dubins_segments(points, np.full(2, 20.0), 100.0, [course, course + math.pi])
    x = np.array([off, off, -100.0, 20.0, course, 0.0, 0.0])
    left = gk.segment_left(x, segments[0])
    assert left == pytest.approx(segments[0, gk.S_LENGTH], abs=5.0) or segments[0, gk.S_LENGTH] < 5.0


def test_bad_paths_are_refused() -> None:
    for points, message in (
        (CORNER[:1], "n >= 2"),
        (CORNER * np.nan, "finite"),
        (CORNER[[0, 0, 1]], "same place"),
    ):
        with pytest.raises(ValueError, match=message):
            straight_segments(points, SPEEDS[: len(points)])
    with pytest.raises(ValueError, match="is 1000"):
        fillet_segments(CORNER, SPEEDS, 1500.0)
    with pytest.raises(ValueError, match="is 1000"):
        fillet_segments(CORNER[[0, 1, 0]], SPEEDS, 50.0)
    with pytest.raises(ValueError, match="radius"):
        dubins_segments(CORNER, SPEEDS, -1.0)
    with pytest.raises(ValueError, match="one finite course"):
        dubins_segments(CORNER, SPEEDS, 50.0, [0.0, math.nan, 0.0])
    with pytest.raises(ValueError, match="segments"):
        PathManager(np.empty((0, gk.N_COLUMNS)))
