"""Which track is the ownship: the kernels against their naive twin and rule by rule, and the identifier's events."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import chi2

from tests.naive.ownship import NaiveIdentifier
from wideberth.tracking import ownship_kernels as kernels
from wideberth.tracking.config import OwnshipConfig
from wideberth.tracking.ownship import OwnshipIdentifier, ownship_test, telemetry_covariance
from wideberth.types import Ownship, Track, TrackStatus

FloatArray = NDArray[np.float64]

TEST = ownship_test(OwnshipConfig())
COVARIANCE = telemetry_covariance(OwnshipConfig())
OWN = np.array([100.0, 50.0, -80.0, 12.0, -3.0, 0.5])
SHARP = np.diag([1.0, 1.0, 1.0, 0.04, 0.04, 0.04])


def run(
    tracks: list[FloatArray], p: list[FloatArray] | None = None, seconds: float = 2.0
) -> tuple[list[int], FloatArray]:
    """Feed constant tracks and return the choices and the states."""
    n = len(tracks)
    states, work = np.zeros((n, kernels.STATE_WIDTH)), np.zeros((kernels.WORK_ROWS, 6))
    x, covariances = np.array(tracks), np.array(p if p is not None else [SHARP] * n)
    chosen = [
        kernels.identify(n, 0.1, x, covariances, OWN, COVARIANCE, TEST, states, work)
        for _ in range(round(seconds * 10))
    ]
    return chosen, states


def moved(*offset: float) -> FloatArray:
    return np.array(OWN + np.pad(np.array(offset), (0, 6 - len(offset))))


def test_equals_the_naive_twin() -> None:
    rng = np.random.default_rng(1)
    seen = set()
    for case in range(27):
        n = 1 + case % 3
        naive, states = NaiveIdentifier(n, TEST), np.zeros((n, kernels.STATE_WIDTH))
        work = np.zeros((kernels.WORK_ROWS, 6))
        near = np.where(np.arange(n) == case // 3 % n, 0.1, rng.choice([2.0, 10.0], n))
        offset = rng.normal(0.0, 1.0, (n, 6)) * [3.0, 3.0, 3.0, 0.6, 0.6, 0.6] * near[:, None]
        for k in range(60):
            offset += rng.normal(0.0, 0.05, (n, 6))
            dt = float(rng.uniform(0.05, 0.3))
            a = rng.normal(size=(n, 9, 9))
            p = (a @ a.transpose(0, 2, 1) / 9 + 0.05 * np.eye(9)) * (0.2 + 5.0 / (1 + k))
            x = np.concatenate([OWN + offset, np.zeros((n, 3))], axis=1)
            telemetry = np.full(6, math.nan) if k % 17 == 16 else OWN
            chosen = kernels.identify(n, dt, x, p, telemetry, COVARIANCE, TEST, states, work)
            expected, evidence = naive.step(dt, x, p, telemetry, COVARIANCE)
            assert chosen == expected, (case, k)
            assert states[:, kernels.FLAG].sum() == (chosen >= 0)
            if math.isfinite(telemetry[0]):
                assert np.allclose(states[:, kernels.EVIDENCE], evidence, rtol=1e-9, atol=1e-9)
            seen.add(chosen)
    assert seen == {-1, 0, 1, 2}


def test_the_ownship_is_found_once_it_has_been_watched() -> None:
    chosen, states = run([moved(0.5, 0.5, 0.5), moved(60.0)])
    settle = round(OwnshipConfig().settle_s * 10)
    assert chosen[: settle - 1] == [-1] * (settle - 1)
    assert set(chosen[settle:]) == {0}
    assert states[:, kernels.FLAG].tolist() == [1.0, 0.0]


@pytest.mark.parametrize("offset", [(30.0,), (0.0, 0.0, 25.0), (0.0, 0.0, 0.0, 4.0), (0.0, 0.0, 0.0, 0.0, 0.0, 4.0)])
def test_neither_place_nor_velocity_alone_is_enough(offset: tuple[float, ...]) -> None:
    assert set(run([moved(*offset)])[0]) == {-1}


def test_a_track_too_vague_to_tell_is_not_taken() -> None:
    vague = np.diag([100.0, 100.0, 100.0, 400.0, 400.0, 25.0])
    assert set(run([moved()], [vague])[0]) == {-1}


def test_two_that_cannot_be_told_apart_are_both_intruders() -> None:
    assert set(run([moved(0.5), moved(-0.5)])[0]) == {-1}


def test_once_found_a_second_like_it_changes_nothing() -> None:
    states, work = np.zeros((2, kernels.STATE_WIDTH)), np.zeros((kernels.WORK_ROWS, 6))
    x, p = np.array([moved(2.0), moved(500.0)]), np.array([SHARP, SHARP])
    for _ in range(20):
        chosen = kernels.identify(2, 0.1, x, p, OWN, COVARIANCE, TEST, states, work)
    assert chosen == 0
    x[1] = moved(0.0)
    choices = {kernels.identify(2, 0.1, x, p, OWN, COVARIANCE, TEST, states, work) for _ in range(100)}
    assert choices == {0}
    # When it no longer fits, the other takes its place: never both.
    x[0] = moved(40.0)
    choices_then = [kernels.identify(2, 0.1, x, p, OWN, COVARIANCE, TEST, states, work) for _ in range(10)]
    assert choices_then[-1] == 1
    assert 0 not in choices_then


def test_what_telemetry_does_not_explain_is_dropped_at_once() -> None:
    states, work = np.zeros((1, kernels.STATE_WIDTH)), np.zeros((kernels.WORK_ROWS, 6))
    x, p = np.array([moved()]), np.array([SHARP])
    for _ in range(50):
        chosen = kernels.identify(1, 0.1, x, p, OWN, COVARIANCE, TEST, states, work)
    assert chosen == 0
    x[0] = moved(0.0, 0.0, 0.0, 5.0)
    assert kernels.identify(1, 0.1, x, p, OWN, COVARIANCE, TEST, states, work) == -1
    # And comes back within a few seconds, however far off it was.
    x[0] = moved(1e6)
    for _ in range(100):
        kernels.identify(1, 0.1, x, p, OWN, COVARIANCE, TEST, states, work)
    x[0] = moved()
    back = [kernels.identify(1, 0.1, x, p, OWN, COVARIANCE, TEST, states, work) for _ in range(60)]
    assert 0 in back


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_without_telemetry_nothing_is_the_ownship(bad: float) -> None:
    states, work = np.zeros((1, kernels.STATE_WIDTH)), np.zeros((kernels.WORK_ROWS, 6))
    x, p, telemetry = np.array([moved()]), np.array([SHARP]), OWN.copy()
    for _ in range(20):
        kernels.identify(1, 0.1, x, p, OWN, COVARIANCE, TEST, states, work)
    telemetry[4] = bad
    assert kernels.identify(1, 0.1, x, p, telemetry, COVARIANCE, TEST, states, work) == -1
    assert states[0, kernels.FLAG] == 0.0
    assert kernels.identify(1, 0.1, x, p, OWN, np.full((6, 6), bad), TEST, states, work) == -1
    assert kernels.identify(1, 0.1, x, p, OWN, COVARIANCE, TEST, states, work) == 0


def test_a_track_that_is_not_finite_starts_again() -> None:
    states, work = np.zeros((2, kernels.STATE_WIDTH)), np.zeros((kernels.WORK_ROWS, 6))
    x, p = np.array([moved(), moved(300.0)]), np.array([SHARP, SHARP])
    for _ in range(20):
        chosen = kernels.identify(2, 0.1, x, p, OWN, COVARIANCE, TEST, states, work)
    assert chosen == 0
    for broken in ("x", "p"):
        y, r = x.copy(), p.copy()
        (y if broken == "x" else r)[0] = math.nan
        assert kernels.identify(2, 0.1, y, r, OWN, COVARIANCE, TEST, states, work) == -1
        assert not states[0].any()
    assert kernels.identify(0, 0.1, x, p, OWN, COVARIANCE, TEST, states, work) == -1


def test_the_numbers_of_the_test_are_the_stated_rates() -> None:
    config = OwnshipConfig(miss_rate=1e-3, false_alarm_rate=1e-5, traffic_radius_m=10.0)
    test = ownship_test(config)
    assert math.isclose(chi2.sf(test.mean_limit, 6), 1e-3, rel_tol=1e-9)
    assert math.isclose(chi2.sf(test.look_limit, 6), 1e-5, rel_tol=1e-9)
    assert math.isclose(test.margin, math.log(0.999 / 1e-5))
    # The density of traffic: one aircraft in the sphere, its velocity normal about the ownship's.
    peak = 1.0 / (4.0 / 3.0 * math.pi * 1e3) / ((2.0 * math.pi) ** 1.5 * 10.0 * 10.0 * 3.0)
    assert math.isclose(test.log_density, math.log(peak))


def test_filters_that_err_as_they_say_are_seldom_dropped() -> None:
    """Single looks alone: the miss rate of the mean is an upper bound, as errors last."""
    rng = np.random.default_rng(5)
    states, work, p = np.zeros((1, kernels.STATE_WIDTH)), np.zeros((kernels.WORK_ROWS, 6)), SHARP[None]
    root, decay, draws = np.linalg.cholesky(SHARP + COVARIANCE), math.exp(-0.1 / 2.0), 3000
    error, missed = rng.normal(size=6), 0
    for _ in range(draws):
        error = decay * error + math.sqrt(1.0 - decay**2) * rng.normal(size=6)
        kernels.look(0.1, OWN + root @ error, p[0], OWN, COVARIANCE, TEST, states[0], work)
        missed += not kernels.explained(TEST, states[0])
    assert missed == 0


# --- the printed rule -------------------------------------------------------------------------------------------------


def test_the_printed_gate_is_in_range_and_angles() -> None:
    sensor, attitude, work = np.zeros(3), np.eye(3), np.zeros((3, 3))
    gate = np.array([1.0, math.radians(2.5), math.radians(2.5)])
    own = np.array([100.0, 0.0, -50.0])

    def inside(n: float, e: float, d: float) -> bool:
        return kernels.inside_plot_gate(own + np.array([n, e, d]), own, sensor, attitude, gate, work)

    assert inside(0.0, 4.0, 0.0)
    assert not inside(0.0, 5.0, 0.0)
    assert not inside(1.5, 0.0, 0.0)
    assert not inside(3.0, 0.0, 6.0)
    # Behind the sensor, across the cut of the azimuth.
    behind = np.array([-100.0, 1.0, -50.0])
    assert kernels.inside_plot_gate(behind * [1.0, -1.0, 1.0], behind, sensor, attitude, gate, work)


def test_the_gate_of_states() -> None:
    gate = np.array([20.0, 20.0, 20.0, 10.0, 10.0, 10.0])
    assert kernels.inside_state_gate(moved(19.0, -19.0, 19.0, 9.0, -9.0, 9.0), OWN, gate)
    for i in range(6):
        assert not kernels.inside_state_gate(moved(*[0.0] * i, 1.01 * gate[i]), OWN, gate)


def test_the_printed_ratio_is_that_of_the_last_n_looks() -> None:
    rng = np.random.default_rng(2)
    ring, counts, history = np.zeros(7, np.uint8), np.zeros(2, np.int64), []
    for _ in range(40):
        history.append(bool(rng.random() < 0.5))
        ratio = kernels.count_inlier(history[-1], ring, counts)
        assert math.isclose(ratio, sum(history[-7:]) / 7)


# --- the identifier ---------------------------------------------------------------------------------------------------


def track(identity: str, t: float, x: FloatArray, p: FloatArray = SHARP) -> Track:
    covariance = np.eye(9)
    covariance[:6, :6] = p
    return Track(identity, t, x[:3], x[3:], np.zeros(3), covariance, TrackStatus.CONFIRMED, t)


def flying(t: float) -> FloatArray:
    return np.concatenate([OWN[:3] + t * OWN[3:], OWN[3:]])


def telemetry(t: float, covariance: FloatArray = COVARIANCE) -> Ownship:
    x = flying(t)
    return Ownship(t, x[:3], x[3:], covariance=covariance)


def test_the_identifier_says_what_changes() -> None:
    identifier, said = OwnshipIdentifier(), []
    for k in range(100):
        t = 0.1 * k
        latest = telemetry(t) if k < 40 or k >= 70 else telemetry(3.93)
        tracks = [track("7", t, flying(t)), track("9", t, flying(t) + np.array([0, 30.0, 0, 0, 5.0, 0]))]
        if k % 2:
            tracks.reverse()
        flagged, events = identifier.step(t, tracks, latest)
        said += [(k, e) for e in events]
        if 10 <= k < 40 or k >= 75:
            assert flagged == "7"
        if 52 <= k < 70:
            assert flagged is None
    assert [e for _, e in said] == [
        "track 7 is the ownship",
        "no ownship telemetry (1.1 s old): no track is taken as the ownship",
        "track 7 is no longer taken as the ownship",
        "ownship telemetry is back",
        "track 7 is the ownship",
    ]
    assert said[1][0] == 50


def test_the_identifier_extrapolates_late_telemetry() -> None:
    identifier = OwnshipIdentifier()
    for k in range(30):
        t = 0.1 * k
        flagged, _ = identifier.step(t, [track("1", t, flying(t))], telemetry(t - 0.5))
    assert flagged == "1"
    older, newer = telemetry_covariance(identifier.config, age_s=0.5), telemetry_covariance(identifier.config)
    assert (np.diag(older) > np.diag(newer)).all()
    assert math.isclose(older[3, 3] - newer[3, 3], (0.5 * 2.0) ** 2)


def test_the_identifier_without_telemetry() -> None:
    identifier = OwnshipIdentifier()
    assert identifier.step(0.0, [track("1", 0.0, OWN)], None) == (
        None,
        ("no ownship telemetry (none received): no track is taken as the ownship",),
    )
    assert identifier.step(0.1, [track("1", 0.1, OWN)], None) == (None, ())
    ahead = OwnshipIdentifier().step(0.0, [], telemetry(5.0))
    assert ahead[0] is None
    assert ahead[1][0].startswith("no ownship telemetry (its time is 5.0 s ahead of the scan)")
    timeless = OwnshipIdentifier().step(0.0, [], Ownship(math.nan, OWN[:3], OWN[3:]))
    assert "without a time" in timeless[1][0]
    with pytest.raises(ValueError, match="before the last scan"):
        identifier.step(0.0, [], None)


def test_a_reported_covariance_is_used_where_it_is_one() -> None:
    config = OwnshipConfig()
    assert np.array_equal(telemetry_covariance(config, 2.0 * COVARIANCE), 2.0 * COVARIANCE)
    for none in (np.zeros((6, 6)), np.full((6, 6), math.nan)):
        assert np.array_equal(telemetry_covariance(config, none), COVARIANCE)
