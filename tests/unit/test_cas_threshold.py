"""What counts as a conflict: alerting thresholds against sampling, the Monte Carlo table, and guaranteed distances."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.interpolate import RegularGridInterpolator
from scipy.stats import norm

from tests.naive import cas as naive_cas
from tests.naive import cas_parts as naive
from wideberth.avoidance.cas import pair_kernels as pair
from wideberth.avoidance.cas import probability_table_kernels as table_kernels
from wideberth.avoidance.cas import threshold_kernels as threshold
from wideberth.avoidance.cas.config import CasConfig, ThresholdConfig
from wideberth.avoidance.cas.probability_table import ConflictTable, TableModel, build_table, load_table
from wideberth.avoidance.cas.settings import REASONS, PairController, settings
from wideberth.errors import InputError

D = 16 * 0.3048  # separation and margin of the defaults
SMALL = TableModel(D, 0.5, 0.1, times=4, misses=17, speeds=3, samples=400, seed=7)


def with_threshold(**changes: Any) -> Any:
    return settings(CasConfig(threshold=ThresholdConfig(**changes)))


@pytest.mark.parametrize("alert", [0.5, 0.1, 0.01, 1e-4])
@given(st.floats(-4, 1))
def test_a_miss_at_the_widened_separation_is_as_probable_as_the_threshold(alert: float, exponent: float) -> None:
    p, sigma = with_threshold(kind="probability", alert_probability=alert), D * 10**exponent
    m = threshold.widened_by_spread(D, sigma, p)
    probability = norm.cdf((D - m) / sigma) - norm.cdf((-D - m) / sigma)
    if m > D:
        assert probability == pytest.approx(alert, rel=0.03, abs=1e-4)
    else:
        assert m == D and probability <= alert * 1.03 + 1e-4


def test_the_wanted_separation_grows_with_time_age_and_variance_and_never_beyond_the_distance_now() -> None:
    p = with_threshold(kind="probability", acceleration_density_m2ps3=0.01)

    def needed(x: float, age: float = 0.0, variance: float = 0.0) -> float:
        return threshold.needed_separation(D, x, 0.0, 0.0, -1.0, 0.0, 0.0, age, variance, p)

    assert D < needed(20.0) < needed(30.0) < needed(30.0, 2.0)
    assert needed(30.0, 0.0, 4.0) == pytest.approx(D + 1.6449 * 2.0, abs=0.01)
    assert needed(6.0, 0.0, 9.0) == pytest.approx(0.98 * 6.0)
    assert needed(3.0, 0.0, 9.0) == D


@pytest.mark.parametrize("bounds", [(1.0, 0.0, 0.0), (0.5, 0.2, 0.0), (0.3, 0.1, 0.02)])
def test_nothing_within_the_bounds_comes_nearer_than_guaranteed(bounds: tuple[float, float, float]) -> None:
    p = with_threshold(
        kind="guaranteed", position_bound_m=bounds[0], velocity_bound_mps=bounds[1], acceleration_bound_mps2=bounds[2]
    )
    random = np.random.default_rng(2)
    times = np.linspace(0.0, 15.0, 301)
    for _ in range(40):
        s, v = random.normal(size=3) * 25, random.normal(size=3)
        _, nominal = naive.closest_of(s + v * times[:, None], times)
        guaranteed = nominal - threshold.guaranteed_shortfall(s[0], s[1], s[2], v[0], v[1], v[2], 0.0, p)
        least = math.inf
        for _ in range(60):
            # Corners of the boxes, where the nearest motions are.
            e = [bound * random.choice([-1.0, 1.0], 3) for bound in bounds]
            moved = s + e[0] + (v + e[1]) * times[:, None] + e[2] * times[:, None] ** 2 / 2
            least = min(least, naive.closest_of(moved, times)[1])
        assert least >= guaranteed - 0.02
        # Turns at any time within the acceleration's bound, by kicks that change.
        a = random.uniform(-1, 1, (301, 3)) * bounds[2]
        kicked = s + v * times[:, None] + np.cumsum(np.cumsum(a, axis=0), axis=0) * 0.05**2
        assert naive.closest_of(kicked, times)[1] >= guaranteed - 0.05


def test_a_turn_is_an_acceleration_and_age_widens_all() -> None:
    turning = CasConfig(threshold=ThresholdConfig(kind="guaranteed", turn_rate_bound_radps=0.1), speed_max_mps=1.5)
    assert settings(turning)[threshold.P_ACCELERATION_BOUND] == pytest.approx(0.15)
    p = settings(turning)
    fresh, old = (threshold.guaranteed_shortfall(40.0, 0, 0, -1.0, 0, 0, age, p) for age in (0.0, 2.0))
    assert 0 < fresh < old


def alerts(config: CasConfig, own: Any, other: Any) -> bool:
    return PairController(config, first=True).decide(own, other, own[2]).avoid


@pytest.mark.parametrize("controller", ["continuous", "bang_bang"])
@pytest.mark.parametrize(
    ("threshold_keys", "expected"),
    [
        ({}, False),
        ({"kind": "probability"}, True),
        ({"kind": "probability", "relative_position_sigma_m": 0.05, "relative_velocity_sigma_mps": 0.0}, False),
        ({"kind": "guaranteed"}, True),
        ({"kind": "guaranteed", "position_bound_m": 0.1, "velocity_bound_mps": 0.0}, False),
    ],
    ids=str,
)
def test_the_threshold_decides_what_is_a_conflict(controller: str, threshold_keys: Any, expected: bool) -> None:
    # Passes 0.3 m outside the separation, 2.5 s ahead (bang-bang has 1.6 s of rise).
    own, other = np.array([0.0, D + 0.3, -15, 1.0, 0, 0]), np.array([5.0, 0, -15, -1.0, 0, 0])
    config = CasConfig(controller=controller, threshold=ThresholdConfig(**threshold_keys))
    assert alerts(config, own, other) == expected


@pytest.mark.parametrize("controller", ["continuous", "bang_bang"])
@given(st.integers(0, 10**6), st.floats(0.1, 3.0), st.booleans())
def test_a_controller_keeps_the_widened_separation_like_its_twin(
    controller: Any, seed: int, sigma: float, avoiding: bool
) -> None:
    keys = {"kind": "probability", "relative_position_sigma_m": sigma, "alert_probability": 0.1}
    config = CasConfig(controller=controller, threshold=ThresholdConfig(**keys))
    random = np.random.default_rng(seed)
    own, other = random.normal(size=(2, 6)) * [15, 15, 3, 0.5, 0.5, 0.3] + [0, 0, -25, 0, 0, 0]
    other[3:5] = own[3:5] + (own[:2] - other[:2]) * random.uniform(0.02, 0.2)
    p, v = own[:3] - other[:3], own[3:] - other[3:]
    t, d = naive_cas.closest(p, v)
    spread = math.sqrt(sigma**2 + (t * config.threshold.relative_velocity_sigma_mps) ** 2)
    needed = naive.widened_separation(D, spread, 0.1)
    needed = max(D, min(needed, 0.98 * float(np.linalg.norm(p))))
    same = config.model_copy(update={"separation_m": needed - config.margin_m})
    back = np.array([*v[:2], naive_cas.guidance(own[2], own[2], config) - other[5]])
    for edge in (float(np.linalg.norm(p)), d, naive_cas.closest(p, back)[1]):
        assume(abs(edge - needed) > 0.02)
    before, rate = int(avoiding), config.sink_rate_max_mps if avoiding else 0.0
    reasons, commands, out = np.array([before]), np.array([rate]), np.empty((1, 2))
    pair.decide_pairs(own[None], other[None], own[2:3], np.ones(1), settings(config), reasons, commands, out)
    twin = (
        naive_cas.continuous(own, other, own[2], avoiding, True, same)
        if controller == "continuous"
        else naive_cas.bang_bang(own, other, own[2], avoiding, rate, True, same)
    )
    assert REASONS[reasons[0]] == twin[0]
    assert commands[0] == pytest.approx(twin[1], abs=0.02)


def test_the_hypothesis_test_waits_for_certainty_but_not_too_long() -> None:
    def begun(sigma: float, **changes: Any) -> float:
        keys = {"relative_position_sigma_m": 0.3, "relative_velocity_sigma_mps": sigma, "start": "hypothesis_test"}
        config = CasConfig(controller="bang_bang", threshold=ThresholdConfig(**{**keys, **changes}))
        control = PairController(config, first=True)
        for k in range(600):
            x = -30.0 + 0.05 * k
            own, other = np.array([x, 3.0, -15, 1.0, 0, 0]), np.array([-x, 0, -14.8, -1.0, 0, 0])
            if control.decide(own, other, -15.0).avoid:
                return -x  # seconds before the closest point
        return 0.0

    latest = begun(0.3, start="latest")
    certain, unsure = begun(0.01), begun(0.3)
    assert certain > unsure > 0 and certain > latest
    # Without tolerance for failures the avoidance starts while it may still prove needless.
    assert begun(0.3, missed_probability=1e-4, alert_probability=0.02) > unsure
    # A false alarm that does not matter: as soon as a conflict is probable at all.
    assert begun(0.3, false_alarm_probability=0.95, alert_probability=0.05) > unsure


def test_the_hypothesis_test_is_the_two_probabilities() -> None:
    p = with_threshold(alert_probability=0.1, false_alarm_probability=0.2, missed_probability=0.05)
    random = np.random.default_rng(1)
    for _ in range(300):
        miss, turned = random.uniform(0, 2 * D, 2)
        s0, s1 = random.uniform(0.1, D, 2)
        conflict = norm.cdf((D - miss) / s0) - norm.cdf((-D - miss) / s0)
        failure = norm.cdf((D - turned) / s1) - norm.cdf((-D - turned) / s1)
        expected = conflict >= 0.1 and (conflict >= 0.8 or failure >= 0.05)
        assert threshold.begins_by_test(D, miss, s0, turned, s1, p) == expected


def test_only_bang_bang_starts_by_a_test_and_only_a_table_has_a_file() -> None:
    with pytest.raises(ValueError, match="interval corrects itself"):
        CasConfig(threshold=ThresholdConfig(start="hypothesis_test"))
    with pytest.raises(ValueError, match="altitudes knows only"):
        CasConfig(controller="altitudes", threshold=ThresholdConfig(kind="probability"))
    with pytest.raises(ValueError, match="give both or neither"):
        ThresholdConfig(kind="table")
    with pytest.raises(ValueError, match="give both or neither"):
        ThresholdConfig(table_file=Path("x"))


@pytest.fixture(scope="module")
def table() -> ConflictTable:
    return build_table(SMALL)


@pytest.mark.parametrize("density", [0.0, 0.01])
@pytest.mark.parametrize(("t", "miss", "speed"), [(10.0, 3.0, 2.0), (10.0, 5.0, 4.0), (25.0, 6.0, 1.0)])
def test_the_runs_of_a_table_agree_with_drawing(density: float, t: float, miss: float, speed: float) -> None:
    n, counts, random = 700, np.empty(1), np.random.default_rng(4)
    steps = 16 if density else 1
    table_kernels.violations(t, speed, np.array([miss]), t + 5.0, steps, 0.5, 0.1, density, D, 3, 1, n, counts)
    drawn = naive.drawn_violations(t, miss, speed, (0.5, 0.1), density, t + 5.0, D, 4000, random)
    # 4.5 standard errors of the difference; steps of white acceleration cost 0.02 at most.
    slack = 0.02 if density else 0.0
    assert drawn == pytest.approx(counts[0] / n, abs=4.5 * math.sqrt(0.25 * (1 / n + 1 / 4000)) + slack)


def test_the_table_of_certain_states_is_the_zone(table: ConflictTable) -> None:
    certain = build_table(TableModel(D, 0.0, 0.0, times=3, misses=9, speeds=3, samples=1))
    _, misses, _ = certain.model.axes()
    assert (certain.values == (misses < D)[None, :, None]).all()
    # Probabilities fall with the miss distance: the same draws serve all of them.
    assert (np.diff(table.values, axis=1) <= 0).all()
    # A cell is what its run gives.
    counts = np.empty(17)
    times, misses, speeds = SMALL.axes()
    table_kernels.violations(
        times[2], speeds[1], misses, times[2] + 5.0, 1, 0.5, 0.1, 0.0, D, 7, 2 * 3 + 1, 400, counts
    )
    assert np.array_equal(table.values[2, :, 1], counts / 400)


@given(st.floats(0, 40), st.floats(0, 25), st.floats(0, 6))
def test_probabilities_are_interpolated(table_point_t: float, miss: float, speed: float) -> None:
    values = np.random.default_rng(1).uniform(size=(4, 17, 3))
    table = ConflictTable(SMALL, values)
    axes = SMALL.axes()
    clipped = [min(x, axis[-1]) for x, axis in zip((table_point_t, miss, speed), axes, strict=True)]
    assert table.probability(table_point_t, miss, speed) == pytest.approx(
        RegularGridInterpolator(axes, values)(clipped)[0], abs=1e-12
    )


def test_alert_distances_have_that_probability(table: ConflictTable) -> None:
    distances = table.alert_distances(0.1)
    times, _, speeds = table.model.axes()
    found = table.probability(times[:, None], distances, speeds[None, :])
    assert found == pytest.approx(np.full(found.shape, 0.1), abs=1e-9)
    with pytest.raises(ValueError, match="larger miss distances"):
        build_table(TableModel(D, 5.0, 1.0, times=2, misses=3, speeds=2, miss_max_m=5.0, samples=50)).alert_distances(
            0.1
        )


def test_the_number_of_workers_changes_nothing(table: ConflictTable) -> None:
    assert np.array_equal(build_table(SMALL, workers=2).values, table.values)


def test_a_table_is_read_back_and_used(tmp_path: Path, table: ConflictTable) -> None:
    path = tmp_path / "table.npz"
    table.save(path)
    assert np.array_equal(load_table(path, SMALL).values, table.values)
    config = ThresholdConfig(kind="table", table_file=path, alert_probability=0.1)
    p = settings(CasConfig(threshold=config))
    times, _, speeds = SMALL.axes()
    for i, t in enumerate(times):
        for j, v in enumerate(speeds[1:], 1):
            got = threshold.needed_separation(D, -v * t, 40.0, 0.0, v, 0.0, 0.0, 0.0, 0.0, p)
            assert got == pytest.approx(max(D, table.alert_distances(0.1)[i, j]), rel=0.02)
    own, other = np.array([0.0, D + 0.3, -15, 1.0, 0, 0]), np.array([5.0, 0, -15, -1.0, 0, 0])
    assert alerts(CasConfig(controller="continuous", threshold=config), own, other)
    with pytest.raises(ValueError, match="made for a separation"):
        settings(CasConfig(margin_m=0.0, threshold=config))


@pytest.mark.parametrize("harm", ["text", "cut", "bit", "missing", "foreign", "other model", "shape"])
def test_a_damaged_or_foreign_table_is_refused(tmp_path: Path, table: ConflictTable, harm: str) -> None:
    path = tmp_path / "table.npz"
    table.save(path)
    data = path.read_bytes()
    model, words = None, "cannot be read|damaged"
    if harm == "text":
        path.write_text("not a table")
    elif harm == "cut":
        path.write_bytes(data[: len(data) // 2])
    elif harm == "bit":
        path.write_bytes(data[: len(data) // 2] + bytes([data[len(data) // 2] ^ 1]) + data[len(data) // 2 + 1 :])
    elif harm == "missing":
        path.unlink()
    elif harm == "foreign":
        np.savez(path, a=np.zeros(3))
    elif harm == "shape":
        with np.load(path) as file:
            np.savez(path, model=file["model"], digest=file["digest"], values=file["values"][:2])
    else:
        model, words = TableModel(D, 0.6, 0.1), "made for other values of .*position_sigma_m"
    with pytest.raises(InputError, match=words):
        load_table(path, model)
    if model is None:
        with pytest.raises(InputError, match=words):
            settings(CasConfig(threshold=ThresholdConfig(kind="table", table_file=path)))


@pytest.mark.parametrize(
    "changes", [{"separation_m": 0.0}, {"position_sigma_m": -1.0}, {"samples": 0}, {"times": 1}, {"seed": math.nan}]
)
def test_a_model_that_makes_no_sense_is_refused(changes: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="must be"):
        TableModel(**{"separation_m": D, "position_sigma_m": 1.0, "velocity_sigma_mps": 0.1, **changes})


def test_where_nobody_predicts_other_predictions_are_refused() -> None:
    with pytest.raises(InputError, match="VehicleController"):
        settings(CasConfig(prediction={"kind": "kalman"}))
