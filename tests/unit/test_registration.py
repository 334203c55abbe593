"""Biases of radars, recovered from what they see together: consistent with the covariance that is stated."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.stats import chi2

from tests.made_radars import (
    PLACES,
    drawn_biases,
    finished,
    known_track,
    registered,
    sites_with,
    wandering,
)
from wideberth.simulation.radar_network import simulate_plots
from wideberth.tracking.bias_correction import prior_sigma
from wideberth.tracking.config import RegistrationConfig
from wideberth.tracking.registration import Registration
from wideberth.tracking.registration_observability import unobservable
from wideberth.types import FloatArray, Scan, TrackStatus

OFFSETS = RegistrationConfig()
WHITE = RegistrationConfig(reference_correlation_s=0.0)
SEEDS = range(12)

CASES = {
    "two radars": (OFFSETS, 2, (), None),
    "three radars": (OFFSETS, 3, (), None),
    "two radars, reference": (WHITE, 2, (), 2.0),
    "one of two without elevation": (OFFSETS, 2, (1,), None),
    "tilt and scale, reference": (
        WHITE.model_copy(update={"roll_sigma_deg": 2.0, "pitch_sigma_deg": 2.0, "range_scale_sigma": 0.01}), 2, (), 2.0,
    ),
    "place and clock, reference": (
        WHITE.model_copy(update={"position_sigma_m": 20.0, "clock_sigma_s": 0.2}), 2, (), 2.0,
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_errors_are_as_large_as_stated(case: str) -> None:
    """Over biases drawn from the prior: NEES within its two-sided 99.9 % bounds (six cases: 99.4 % together)."""
    config, n, flat, reference = CASES[case]
    total, count, largest = 0.0, 0, 0.0
    for seed in SEEDS:
        biases = drawn_biases(config, seed, n)
        for i in flat:
            biases[i][3] = 0.0
        run = registered(config, sites_with(biases, flat=flat), seed, reference_sigma=reference)
        total, count = total + run.nees, count + len(run.error)
        largest = max(largest, float(np.abs(run.error / np.sqrt(run.covariance.diagonal())).max()))
    low, high = chi2.ppf([0.0005, 0.9995], count)
    assert low < total < high, (total / count, largest)


def test_each_bias_within_three_sigma_and_much_smaller_than_before() -> None:
    """Of 6 biases in each of 12 runs 0.2 are expected beyond three sigma; two or more have a chance of 2 %."""
    beyond, sigmas = 0, []
    for seed in SEEDS:
        run = registered(OFFSETS, sites_with(drawn_biases(OFFSETS, seed, 2)), seed)
        sigma = np.sqrt(run.covariance.diagonal())
        beyond += int((np.abs(run.error) > 3.0 * sigma).sum())
        sigmas.append(sigma)
    assert beyond <= 1
    share = np.mean(sigmas, axis=0) / np.tile(prior_sigma(OFFSETS)[[0, 2, 3]], 2)
    assert (share < [0.25, 0.05, 0.3] * 2).all()


def test_a_false_first_comparison_does_not_make_a_bias_known() -> None:
    """The first pair here has a false plot in it; if it were believed, none of the true ones would fit."""
    run = registered(OFFSETS, sites_with(drawn_biases(OFFSETS, 150, 2), clutter=10.0), 150)
    assert run.nees < chi2.ppf(0.999, 6)
    assert run.registration.counters["first comparisons: not agreed"] > 0
    assert run.registration.counters["pair: used"] > 100


def test_a_reference_takes_away_what_pairs_leave_open() -> None:
    biases = drawn_biases(OFFSETS, 1, 2)
    alone, white, slow = (
        registered(config, sites_with(biases), 1, reference_sigma=sigma)
        for config, sigma in ((OFFSETS, None), (WHITE, 2.0), (OFFSETS, 2.0))
    )
    a, w, s = (np.sqrt(run.covariance.diagonal()) for run in (alone, white, slow))
    # A reference whose errors last says less than one with white errors, and more than none.
    assert (w < s).all() and (s < a).all() and (w < 0.8 * a).all()


def test_one_radar_alone_learns_only_from_a_reference() -> None:
    biases = drawn_biases(OFFSETS, 2, 1)
    alone = registered(OFFSETS, sites_with(biases), 2)
    assert np.sqrt(alone.covariance.diagonal()) == pytest.approx(prior_sigma(OFFSETS)[[0, 2, 3]])
    assert len(alone.registration.unobserved()) == 3
    helped = registered(WHITE, sites_with(biases), 2, reference_sigma=2.0)
    assert helped.registration.unobserved() == []
    assert (np.abs(helped.error) < 4.0 * np.sqrt(helped.covariance.diagonal())).all()


def test_radars_without_elevation_are_not_compared_with_each_other() -> None:
    run = registered(OFFSETS, sites_with([np.zeros(10)] * 2, flat=(0, 1)), 3)
    counters = run.registration.counters
    assert counters["pair: used"] == 0 and counters["pair: no height"] > 50
    assert run.registration.estimate("west").prior_sigma[3] == 0.0


def test_nothing_is_learnt_without_tracks() -> None:
    run = registered(OFFSETS, sites_with([np.zeros(10)] * 2), 4, with_tracks=False)
    assert run.registration.counters["pair: used"] == 0 and not run.error.any()


def test_what_is_not_observed_stays_within_what_was_expected() -> None:
    """Radars at one place: their common turn shows in no pair, and the drift does not carry it away."""
    config = RegistrationConfig(drift_time_constant_h=0.01)
    sites = [dataclasses.replace(site, position=np.zeros(3)) for site in sites_with([np.zeros(10)] * 2)]
    run = registered(config, sites, 5)
    prior = np.tile(prior_sigma(config)[[0, 2, 3]], 2)
    assert (np.sqrt(run.covariance.diagonal()) <= prior * (1 + 1e-9)).all()
    hidden = run.registration.unobserved()
    assert len(hidden) == 3
    # Each is the same for both radars.
    for direction in hidden:
        assert direction[:10] == pytest.approx(direction[10:], abs=0.1)


POSES = np.array(PLACES), np.tile(np.eye(3), (3, 1, 1))


@pytest.mark.parametrize(
    ("settings", "hidden"),
    [
        # Hidden combinations: two radars, three, three with one course and speed, all at one place.
        ({}, (0, 0, 0, 3)),
        ({"range_scale_sigma": 0.01}, (0, 0, 0, 4)),
        ({"roll_sigma_deg": 1.0, "pitch_sigma_deg": 1.0}, (1, 0, 0, 5)),
        ({"position_sigma_m": 20.0}, (3, 3, 3, 5)),
        ({"position_sigma_m": 20.0, "height_sigma_m": 20.0}, (4, 4, 4, 6)),
        ({"clock_sigma_s": 0.1}, (1, 1, 1, 4)),
        ({"clock_sigma_s": 0.1, "position_sigma_m": 20.0}, (4, 4, 6, 6)),
    ],
)
def test_what_pairs_cannot_tell(settings: dict[str, float], hidden: tuple[int, ...]) -> None:
    sigma = prior_sigma(RegistrationConfig(**settings))
    rng = np.random.default_rng(0)
    positions = rng.uniform([-1500, -1500, -400], [1500, 1500, -50], (30, 3))
    velocities, one_way = rng.normal(0.0, 20.0, (30, 3)), np.tile([0.0, 25.0, 0.0], (30, 1))
    places, attitudes = POSES
    found = (
        unobservable(places[:2], attitudes[:2], positions, velocities, sigma),
        unobservable(places, attitudes, positions, velocities, sigma),
        unobservable(places, attitudes, positions, one_way, sigma),
        unobservable(0.0 * places, attitudes, positions, velocities, sigma),
    )
    assert tuple(len(f) for f in found) == hidden
    assert len(unobservable(places, attitudes, positions, velocities, sigma, references=range(30))) == 0


def test_a_turn_of_the_whole_network_is_hidden_once_places_may_be_wrong() -> None:
    sigma = prior_sigma(RegistrationConfig(position_sigma_m=20.0))
    rng = np.random.default_rng(1)
    positions = rng.uniform([-1500, -1500, -400], [1500, 1500, -50], (30, 3))
    hidden = unobservable(*POSES, positions, np.zeros((30, 3)), sigma)
    turn = np.zeros((3, 10))
    turn[:, 2] = 0.01
    # Azimuths too large by 0.01 carry what is measured clockwise about each radar; true places, told ones turned back.
    turn[:, 6], turn[:, 7] = 0.01 * POSES[0][:, 1], -0.01 * POSES[0][:, 0]
    scaled = np.divide(turn, sigma, where=sigma > 0.0, out=np.zeros_like(turn)).ravel()
    assert hidden.T @ (hidden @ scaled) == pytest.approx(scaled, abs=1e-9)


def test_the_wrong_arguments_are_named() -> None:
    sigma, places = prior_sigma(OFFSETS), POSES[0]
    with pytest.raises(ValueError, match="attitudes must have shape"):
        unobservable(places, np.eye(3), np.zeros((1, 3)), np.zeros((1, 3)), sigma)
    with pytest.raises(ValueError, match="references"):
        unobservable(*POSES, np.ones((1, 3)), np.zeros((1, 3)), sigma, references=[1])
    with pytest.raises(ValueError, match="prior_sigma must have shape"):
        unobservable(*POSES, np.ones((1, 3)), np.zeros((1, 3)), sigma[:3])


def scan(z: FloatArray, **changes) -> Scan:
    z = np.atleast_2d(z)
    noise = np.tile(np.diag([25.0, 1e-4, 2e-4, 1.0]), (len(z), 1, 1))
    return dataclasses.replace(Scan(1.0, 1.0, "west", "radar", z, noise, np.full(len(z), 1.0)), **changes)


GOOD = np.array([800.0, 0.3, 0.2, -5.0])


def test_correct_takes_off_the_biases_and_adds_their_uncertainty() -> None:
    config = RegistrationConfig(position_sigma_m=5.0, roll_sigma_deg=1.0)
    biases = drawn_biases(config, 6, 2)
    run = registered(
        config.model_copy(update={"reference_correlation_s": 0.0}), sites_with(biases), 6, reference_sigma=1.0
    )
    t = np.array([0.0, 1.0])
    positions, velocities = wandering(t, 6, 4)
    quiet = [
        dataclasses.replace(site, sigma=(1e-6, 1e-9, 1e-9, 1e-6), clutter=0.0, phase_s=0.0)
        for site in sites_with(biases)
    ]
    raw = simulate_plots(quiet, t, positions, velocities, 6)[0]
    for before in raw:
        after = run.registration.correct(before)
        plain = run.registration.correct(before, inflate=False)
        assert np.array_equal(plain.R, before.R) and np.array_equal(after.z, plain.z)
        assert (np.diagonal(after.R, axis1=1, axis2=2)[:, :3] > np.diagonal(before.R, axis1=1, axis2=2)[:, :3]).all()
        assert np.array_equal(after.z[:, 3], before.z[:, 3])
        for z in after.z:
            ground, drop = z[0] * math.cos(z[2]), -z[0] * math.sin(z[2])
            seen = np.array([ground * math.cos(z[1]), ground * math.sin(z[1]), drop])
            place = after.sensor_position + after.sensor_attitude @ seen
            error = place - positions[0, np.argmin(np.linalg.norm(positions[0] - place, axis=1))]
            p = run.registration.position_covariance(before.sensor, place, np.zeros(3))
            # Three degrees of freedom; 30 is beyond their 99.9999 % point.
            assert error @ np.linalg.solve(p, error) < 30.0


def test_correct_leaves_other_kinds_alone_and_gives_a_new_radar_the_prior() -> None:
    registration = Registration(OFFSETS)
    other = scan(GOOD, kind="adsb")
    assert registration.correct(other) is other
    new = registration.correct(scan(GOOD))
    assert new.z == pytest.approx(GOOD[None])
    added = np.diagonal(new.R[0] - scan(GOOD).R[0])
    assert added == pytest.approx([*(prior_sigma(OFFSETS)[[0, 2, 3]] ** 2), 0.0])


def test_a_plot_nearer_than_the_range_offset_is_left_out() -> None:
    run = registered(WHITE, sites_with([np.eye(10)[0] * 30.0]), 7, reference_sigma=1.0)
    after = run.registration.correct(scan(np.array([[20.0, 0.0, 0.1, 0.0], GOOD])))
    assert after.z.shape == (1, 4) and after.R.shape == (1, 4, 4) and after.t_valid.shape == (1,)
    assert after.z[0, 0] == pytest.approx(770.0, abs=4.0)


def test_unknown_radars_and_times_are_refused() -> None:
    registration = Registration(OFFSETS)
    with pytest.raises(ValueError, match="no scan of a radar 'west' has come; known radars: none yet"):
        registration.estimate("west")
    registration.step(1.0, [scan(GOOD)], ())
    with pytest.raises(ValueError, match="known radars: west"):
        registration.position_covariance("east", np.zeros(3), np.zeros(3))
    with pytest.raises(ValueError, match="known radars: west"):
        registration.restart("north")
    with pytest.raises(ValueError, match="time nan is not finite"):
        registration.step(math.nan, (), ())


@pytest.mark.parametrize(
    ("column", "value", "cause"),
    [
        (0, math.nan, "range not positive"),
        (0, -5.0, "range not positive"),
        (1, math.inf, "azimuth not within"),
        (1, math.nan, "azimuth not within"),
        (2, 2.0, "elevation beyond"),
    ],
)
def test_bad_plots_are_counted(column: int, value: float, cause: str) -> None:
    registration = Registration(OFFSETS)
    z = np.array([GOOD, GOOD])
    z[0, column] = value
    registration.step(1.0, [scan(z)], ())
    assert sum(n for key, n in registration.counters.items() if cause in key) == 1


def test_bad_scans_and_tracks_are_counted() -> None:
    registration = Registration(OFFSETS)
    rng = np.random.default_rng(0)
    track = known_track("1", 1.0, np.full(3, math.nan), np.zeros(3), 1.0, rng)
    bad_noise = scan(GOOD, R=np.full((1, 4, 4), math.nan))
    late = scan(GOOD, t_valid=np.array([math.nan]))
    future = scan(GOOD, t_valid=np.array([9.0]))
    no_pose = scan(GOOD, sensor_position=np.array([0.0, math.nan, 0.0]))
    registration.step(1.0, [bad_noise, late, future, no_pose, scan(GOOD), scan(GOOD, kind="adsb")], [track])
    assert dict(registration.counters) == {
        "plot: variance not positive and finite": 1,
        "plot: time not finite": 1,
        "plot: time in the future": 1,
        "scan: pose not finite": 1,
        "track not finite": 1,
    }


def test_tentative_tracks_are_no_evidence() -> None:
    t = np.array([0.0, 0.25, 0.5])
    positions, velocities = wandering(t, 8, 3)
    sites = [dataclasses.replace(s, clutter=0.0, phase_s=0.0) for s in sites_with([np.zeros(10)] * 2)]
    scans = simulate_plots(sites, t, positions, velocities, 8)
    rng = np.random.default_rng(0)
    tracks = [known_track(str(k), 0.0, positions[0, k], velocities[0, k], 5.0, rng) for k in range(3)]
    for status, used in ((TrackStatus.TENTATIVE, False), (TrackStatus.COASTING, True)):
        registration = Registration(OFFSETS)
        registration.step(0.0, scans[0], [dataclasses.replace(track, status=status) for track in tracks])
        assert (registration.counters["pair: used"] > 0) == used


def test_a_pose_jump_starts_a_fixed_radar_again_but_not_a_moving_one() -> None:
    biases = drawn_biases(WHITE, 9, 2)
    for moving in ((), ("west",)):
        config = WHITE.model_copy(update={"moving_radars": moving})
        run = registered(config, sites_with(biases), 9, reference_sigma=2.0)
        registration = run.registration
        before = registration.estimate("west")
        events = registration.step(
            41.0, [scan(GOOD, sensor_position=np.array([0.0, 20.0, 0.0]), t_valid=np.array([41.0]))], ()
        )
        after = registration.estimate("west")
        if moving:
            assert events == () and after.sigma == pytest.approx(before.sigma, rel=1e-2)
        else:
            assert "radar west: its pose has changed by 20.0 m and 0.0 deg" in events[0]
            assert after.sigma == pytest.approx(prior_sigma(WHITE)) and not after.value.any()
            assert registration.estimate("east").sigma[2] < 0.1 * prior_sigma(WHITE)[2]


def test_time_going_back_forgets_plots_but_keeps_biases() -> None:
    run = registered(WHITE, sites_with(drawn_biases(WHITE, 10, 2)), 10, reference_sigma=2.0)
    before = run.registration.estimate("east")
    events = run.registration.step(5.0, (), ())
    assert events == ("registration: time went back by 35 s, plots forgotten, biases kept",)
    assert np.array_equal(run.registration.estimate("east").value, before.value)


def test_the_same_input_gives_the_same_estimate() -> None:
    sites = sites_with(drawn_biases(OFFSETS, 11, 2))
    first, second = (registered(OFFSETS, sites, 11) for _ in range(2))
    assert np.array_equal(first.covariance, second.covariance) and np.array_equal(first.error, second.error)
    assert finished(first.registration, sites, 40.0, []).nees == first.nees
