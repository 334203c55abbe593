"""The observability matrix against the closed forms of appendix B, naive differences, and its singular cases."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from tests.naive.radar_tracking import differences, plot_of, turning_after
from wideberth.analysis.observability import (
    STATES,
    Element,
    Model,
    looks_needed,
    observability_matrix,
)
from wideberth.frames import rotation_ned_body

FloatArray = NDArray[np.float64]

RADAR = np.array([3.0, 4.0, 5.0])  # north, east, altitude
UP = np.array([1.0, 1.0, -1.0])
TILTED = rotation_ned_body(0.3, -0.4, 2.0)


def some_states(count: int, seed: int = 1) -> FloatArray:
    rng = np.random.default_rng(seed)
    x = np.empty((count, 9))
    x[:, :3] = rng.uniform(-500.0, 500.0, (count, 3))
    x[:, 3], x[:, 4], x[:, 5] = rng.uniform(1, 40, count), rng.uniform(-3, 3, count), rng.uniform(-1.5, 1.5, count)
    x[:, 6:] = rng.normal(size=(count, 3)) * [1.0, 0.1, 0.05]
    return x


def squares(x: FloatArray, attitude: FloatArray | None = None) -> tuple[FloatArray, FloatArray]:
    """L1 and L2 (B.6), (B.7); with an attitude, L2 in the sensor's horizontal plane."""
    line = (x[..., :3] - RADAR) * UP
    if attitude is not None:
        line = line @ attitude
    return (line**2).sum(axis=-1), (line[..., :2] ** 2).sum(axis=-1)


def lie_derivative(x: FloatArray) -> FloatArray:
    """L_f h as printed (B.13)."""
    a, b, c = x[:3] - RADAR
    v, cc, sc, cg, sg = x[3], math.cos(x[4]), math.sin(x[4]), math.cos(x[5]), math.sin(x[5])
    l1, l2 = a * a + b * b + c * c, a * a + b * b
    return np.array(
        [
            (a * v * cc * cg + b * v * sc * cg + c * v * sg) / math.sqrt(l1),
            (-b * v * cc * cg + a * v * sc * cg) / l2,
            (-a * c * v * cc * cg - b * c * v * sc * cg + l2 * v * sg) / (l1 * math.sqrt(l2)),
        ]
    )


def printed_c(x: FloatArray) -> FloatArray:
    """C as printed (B.14)-(B.23)."""
    a, b, c = x[:3] - RADAR
    v, cc, sc, cg, sg = x[3], math.cos(x[4]), math.sin(x[4]), math.cos(x[5]), math.sin(x[5])
    l1, l2 = a * a + b * b + c * c, a * a + b * b
    n = [
        a * cc * cg + b * sc * cg + c * sg,
        -a * v * sc * cg + b * v * cc * cg,
        -a * v * cc * sg - b * v * sc * sg + c * v * cg,
        -b * cc * cg + a * sc * cg,
        b * v * sc * cg + a * v * cc * cg,
        b * v * cc * sg - a * v * sc * sg,
        -a * c * cc * cg - b * c * sc * cg + l2 * sg,
        a * c * v * sc * cg - b * c * v * cc * cg,
        a * c * v * cc * sg + b * c * v * sc * sg + l2 * v * cg,
    ]
    return np.array(np.reshape(n, (3, 3)) / np.array([[math.sqrt(l1)], [l2], [l1 * math.sqrt(l2)]]))


def test_the_blocks_are_those_of_appendix_b() -> None:
    x = some_states(200)
    o = observability_matrix(x, RADAR).matrix
    l1, l2 = squares(x)
    assert not o[:, :3, 3:].any()
    assert not o[:, 3:6, 6:].any()
    a, c, f = o[:, :3, :3], o[:, 3:6, 3:6], o[:, 6:, 6:]
    assert np.allclose(np.linalg.det(a), 1.0 / np.sqrt(l1 * l2), rtol=1e-9, atol=0.0)  # (B.12)
    expected = x[:, 3] ** 2 * np.cos(x[:, 5]) / np.sqrt(l1 * l2)
    assert np.allclose(np.linalg.det(c), expected, rtol=1e-9, atol=0.0)  # (B.24)
    assert np.allclose(np.linalg.det(f), expected, rtol=1e-9, atol=0.0)  # (B.36)
    assert np.allclose(c, f, rtol=1e-10, atol=1e-13)
    for state, block in zip(x, c, strict=True):
        assert np.allclose(block, printed_c(state), rtol=1e-9, atol=1e-12)


def test_the_determinant_is_that_of_appendix_b() -> None:
    x = some_states(200)
    result = observability_matrix(x, RADAR)
    l1, l2 = squares(x)
    expected = x[:, 3] ** 4 * np.cos(x[:, 5]) ** 2 / (l1 * l2) ** 1.5  # (B.37)
    assert np.allclose(result.determinant, expected, rtol=1e-9, atol=0.0)
    assert result.observable.all()
    assert (result.rank == 9).all()
    assert not result.singular.any.any()
    assert result.singular.names() == []
    assert np.isfinite(result.condition).all()


@pytest.mark.parametrize("attitude", [TILTED, rotation_ned_body(math.pi, 0.0, 0.0), rotation_ned_body(0.0, 1.5, -3.0)])
def test_in_any_pose_the_azimuth_plane_takes_the_place_of_the_horizontal_one(attitude: FloatArray) -> None:
    """The thesis assumes this; the determinant shows it: only L2 knows of the attitude."""
    x = some_states(100)
    result = observability_matrix(x, RADAR, attitude=attitude)
    l1, l2 = squares(x, attitude)
    expected = x[:, 3] ** 4 * np.cos(x[:, 5]) ** 2 / (l1 * l2) ** 1.5
    assert np.allclose(result.determinant, expected, rtol=1e-9, atol=0.0)
    assert result.observable.all()


@pytest.mark.parametrize("attitude", [np.eye(3), TILTED])
def test_every_row_equals_naive_differences(attitude: FloatArray) -> None:
    def measured(x: FloatArray) -> FloatArray:
        return plot_of(RADAR * UP, attitude, x[:3] * UP)

    def along(x: FloatArray, t: float) -> FloatArray:
        ned = np.concatenate([x[:3] * UP, x[3:]])
        after = turning_after(ned, t) if t else ned
        return measured(np.concatenate([after[:3] * UP, after[3:]]))

    def rate(x: FloatArray) -> FloatArray:
        return differences(lambda t: along(x, float(t[0])), np.zeros(1), np.array([0.05]))[:, 0]

    def second(x: FloatArray) -> FloatArray:
        t = 0.1
        near, far = along(x, t) + along(x, -t), along(x, 2 * t) + along(x, -2 * t)
        return (16 * near - far - 30 * along(x, 0.0)) / (12 * t * t)

    steps = np.array([0.5, 0.5, 0.5, 0.1, 0.01, 0.01, 0.1, 0.01, 0.01])
    for x in some_states(2, seed=5):
        o = observability_matrix(x, RADAR, attitude=attitude).matrix
        # The scale of a row's elements in SI: angles' rows are smaller by the distance.
        for rows, function, tolerance in ((0, measured, 1e-8), (3, rate, 1e-6), (6, second, 1e-4)):
            naive = differences(function, x, steps)
            size = np.abs(o[rows : rows + 3]).max(axis=1, keepdims=True)
            assert (np.abs(o[rows : rows + 3] - naive) < tolerance * size).all()


def test_the_rates_equal_the_printed_ones() -> None:
    for x in some_states(5, seed=6):
        o = observability_matrix(x, RADAR).matrix[3:6]
        naive = differences(lie_derivative, x, np.array([0.1, 0.1, 0.1, 0.01, 1e-3, 1e-3, 0.01, 1e-3, 1e-3]))
        assert np.allclose(o, naive, rtol=1e-7, atol=1e-9)


@pytest.mark.parametrize(("model", "power"), [("constant_velocity", 2), ("constant_acceleration", 3)])
def test_linear_models(model: Model, power: int) -> None:
    """Each look adds a block A of its own: det A to the power of the looks."""
    x = some_states(50)[:, : STATES[model]]
    result = observability_matrix(x, RADAR, model=model, attitude=TILTED)
    l1, l2 = squares(x, TILTED)
    assert np.allclose(result.determinant, (l1 * l2) ** (-power / 2), rtol=1e-9, atol=0.0)
    assert result.observable.all()
    # At rest, a linear model is as observable as in motion.
    x[:, 3:] = 0.0
    assert observability_matrix(x, RADAR, model=model).observable.all()


def test_looks_that_are_needed() -> None:
    assert looks_needed("turning") == 3  # thesis 3.3.3
    assert looks_needed("constant_velocity") == 2
    assert looks_needed("constant_acceleration") == 3
    assert looks_needed("constant_velocity", ("range", "azimuth", "elevation", "range_rate")) == 2
    # A radar without elevation needs one look more: the height shows in how the range changes.
    assert looks_needed("constant_velocity", ("range", "azimuth")) == 3
    assert looks_needed("turning", ("range", "azimuth")) == 5
    # Bearings alone leave the size open, ranges alone the direction.
    for elements in (("azimuth", "elevation"), ("range", "range_rate")):
        with pytest.raises(ValueError, match="do not determine"):
            looks_needed("constant_velocity", elements)
    fewer = observability_matrix(some_states(3), RADAR, looks=2)
    assert np.isnan(fewer.determinant).all()
    assert (fewer.rank == 6).all()
    assert np.isinf(fewer.condition).all()


def singular_state(**changes: float) -> FloatArray:
    x = {"n": 100.0, "e": 50.0, "h": 80.0, "v": 15.0, "chi": 0.5, "gamma": 0.1}
    x |= {"vd": 0.5, "chid": 0.1, "gammad": -0.05}
    return np.array(list((x | changes).values()))


@pytest.mark.parametrize(
    ("changes", "name", "rank"),
    [
        # No speed: neither angle shows, but in the second look their rates turn nothing either: two and two lost.
        ({"v": 0.0, "vd": 0.0}, "no_speed", 5),
        # An acceleration gives the path a direction after all; its change remains hidden.
        ({"v": 0.0}, "no_speed", 7),
        # The course of a vertical path does not show, unless the path bends away from the vertical.
        ({"gamma": math.pi / 2, "gammad": 0.0}, "vertical_path", 7),
        ({"gamma": -math.pi / 2, "gammad": 0.0}, "vertical_path", 7),
        ({"gamma": math.pi / 2}, "vertical_path", 8),
        ({"n": RADAR[0], "e": RADAR[1]}, "above_radar", 3),
        ({"n": RADAR[0], "e": RADAR[1], "h": -80.0}, "above_radar", 3),
        ({"n": RADAR[0], "e": RADAR[1], "h": RADAR[2]}, "at_radar", 0),
    ],
)
def test_singular_cases_have_names(changes: dict[str, float], name: str, rank: int) -> None:
    result = observability_matrix(singular_state(**changes), RADAR)
    assert result.singular.names() == [name]
    assert int(result.rank) == rank
    assert not result.observable
    assert np.isinf(result.condition)
    if name in {"no_speed", "vertical_path"}:
        assert abs(result.determinant) < 1e-25
    else:
        assert np.isnan(result.determinant)  # (B.37) grows without bound: there are no derivatives


def test_above_a_tilted_radar_is_along_its_own_axis() -> None:
    along = singular_state()
    along[:3] = RADAR + UP * (-70.0 * TILTED[:, 2])
    result = observability_matrix(along, RADAR, attitude=TILTED)
    assert result.singular.names() == ["above_radar"]
    straight_up = singular_state(n=RADAR[0], e=RADAR[1])
    assert observability_matrix(straight_up, RADAR, attitude=TILTED).observable


def test_towards_the_zenith_the_condition_grows() -> None:
    x = np.array([singular_state(n=RADAR[0] + d, e=RADAR[1]) for d in (50.0, 5.0, 0.5)])
    condition = observability_matrix(x, RADAR).condition
    assert (np.diff(condition) > 0.0).all()


def test_shapes_and_scales() -> None:
    x = some_states(6).reshape(2, 3, 9)
    sizes = np.array([0.4, 0.017, 0.017])
    result = observability_matrix(x, RADAR, element_scale=sizes, state_scale=np.arange(1.0, 10.0), time_scale_s=2.0)
    assert result.matrix.shape == (2, 3, 9, 9)
    assert result.singular_values.shape == (2, 3, 9)
    assert result.determinant.shape == result.condition.shape == result.rank.shape == (2, 3)
    rows = (2.0 ** np.arange(3)[:, None] / sizes).ravel()
    scaled = result.matrix * rows[:, None] * np.arange(1.0, 10.0)
    assert np.allclose(result.singular_values, np.linalg.svd(scaled, compute_uv=False))
    assert np.allclose(result.condition, np.linalg.cond(scaled))
    one = observability_matrix(x[1, 2], RADAR)
    assert one.matrix.shape == (9, 9)
    assert np.array_equal(one.matrix, result.matrix[1, 2])
    empty = observability_matrix(np.zeros((0, 9)), RADAR)
    assert empty.matrix.shape == (0, 9, 9)


def test_range_rate_is_the_range_a_look_later() -> None:
    x = some_states(5)
    elements: tuple[Element, ...] = ("range", "range_rate")
    o = observability_matrix(x, RADAR, elements=elements, looks=3).matrix
    assert np.allclose(o[:, 1], o[:, 2])
    assert np.allclose(o[:, 3], o[:, 4])


@given(st.integers(0, 2**32 - 1), st.floats(1e-2, 1e3))
def test_units_do_not_change_the_rank(seed: int, size: float) -> None:
    """A geometry made larger, its speeds with it, looks the same."""
    x = some_states(1, seed)[0]
    larger = x.copy()
    larger[:3] = RADAR + size * (x[:3] - RADAR)
    larger[[3, 6]] *= size
    a, b = observability_matrix(x, RADAR), observability_matrix(larger, RADAR)
    assert int(a.rank) == int(b.rank) == 9
    # det scales with the range rows and the columns of positions and speeds.
    assert math.isclose(float(b.determinant) * size**2, float(a.determinant), rel_tol=1e-6)


@pytest.mark.parametrize(
    ("arguments", "match"),
    [
        ({"state": np.zeros(8)}, "state: the turning model has 9 states"),
        ({"state": np.full(9, math.nan)}, "state: not finite"),
        ({"radar_position": [0.0, 0.0]}, "radar_position: the shape"),
        ({"radar_position": [0.0, 0.0, math.inf]}, "radar_position: not finite"),
        ({"attitude": np.ones((3, 3))}, "attitude: not a rotation"),
        ({"model": "linear"}, "model: 'linear' is not known"),
        ({"elements": ("range", "doppler")}, "elements:"),
        ({"elements": ()}, "elements:"),
        ({"looks": 0}, "looks: 0"),
        ({"time_scale_s": 0.0}, "positive"),
        ({"state_scale": np.ones(6)}, "state_scale: the shape"),
    ],
)
def test_what_makes_no_sense_is_refused(arguments: dict[str, object], match: str) -> None:
    given = {"state": np.ones(9), "radar_position": RADAR} | arguments
    with pytest.raises(ValueError, match=match):
        observability_matrix(**given)  # type: ignore[arg-type]
