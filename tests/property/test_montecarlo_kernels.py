"""The Monte Carlo's kernels: encounters as the paper draws them, volumes, alarms and the life of a track by twins."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.naive import montecarlo as naive
from wideberth.conflict import alarm_kernels as ak
from wideberth.evaluation.montecarlo import geometry_kernels as gk
from wideberth.evaluation.montecarlo import separation_kernels as pk
from wideberth.evaluation.montecarlo.experiment import load_experiment
from wideberth.evaluation.montecarlo.fast_settings import geometry_array, run_settings, scoring_array
from wideberth.tracking import life_kernels as lk
from wideberth.tracking.adsb_aircraft import AdsbAircraft
from wideberth.tracking.filter_bank import FilterBank
from wideberth.tracking.report_history import Report

EXPERIMENT = load_experiment(Path(__file__).resolve().parents[2] / "experiments" / "adsb_collision.toml")
SCORING = scoring_array(EXPERIMENT)
SEEDS = st.integers(0, 2**63 - 1)
POSITION = st.tuples(st.floats(-900, 900), st.floats(-900, 900), st.floats(-120, 120)).map(np.array)


def drawn(seed: int, intruders: int, encounter: int, geometry: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    positions, velocities = np.full((intruders, 3), np.nan), np.full((intruders, 3), np.nan)
    assert gk.draw_encounter(seed, intruders, encounter, geometry, positions, velocities)
    return positions, velocities


def points_of(positions, geometry):
    """The points of the circle that intruders start at, which they must be at."""
    n = geometry[gk.POINTS]
    angle = np.arctan2(positions[:, 1], positions[:, 0]) / (2 * np.pi) * n
    assert np.abs(angle - np.round(angle)).max() < 1e-6
    return np.round(angle).astype(int) % int(n)


@given(SEEDS, st.integers(1, 20), st.integers(0, 2**40), st.booleans())
def test_encounters_are_as_the_paper_draws_them(seed, intruders, encounter, redraw):
    geometry = geometry_array(EXPERIMENT)
    geometry[gk.REDRAW_SPEED] = redraw
    positions, velocities = drawn(seed, intruders, encounter, geometry)
    np.testing.assert_allclose(np.hypot(positions[:, 0], positions[:, 1]), geometry[gk.RADIUS], rtol=1e-12)
    assert np.abs(positions[:, 2]).max() <= geometry[gk.HEIGHT_OFFSET]
    speed = np.hypot(velocities[:, 0], velocities[:, 1])
    assert (speed > geometry[gk.SPEED_MIN] - 1e-9).all() and (speed < geometry[gk.SPEED_MAX] + 1e-9).all()
    assert (velocities[:, 2] == 0.0).all()
    relative = velocities[:, :2] - [geometry[gk.OWN_SPEED], 0.0]
    assert ((relative * positions[:, :2]).sum(axis=1) < 0.0).all()  # into the circle
    points = points_of(positions, geometry)
    assert points[0] == encounter % int(geometry[gk.POINTS])
    assert len(set(points.tolist())) == intruders


def test_encounters_fill_what_they_are_drawn_from():
    geometry = geometry_array(EXPERIMENT)
    both = [drawn(1, 2, encounter, geometry) for encounter in range(400)]
    positions, velocities = np.array([b[0] for b in both]), np.array([b[1] for b in both])
    assert len(np.unique(points_of(positions[:, 1], geometry))) == geometry[gk.POINTS]
    heights = positions[:, :, 2] / geometry[gk.HEIGHT_OFFSET]
    assert heights.min() < -0.98 and heights.max() > 0.98 and abs(heights.mean()) < 5 / math.sqrt(3 * heights.size)
    speed = np.hypot(velocities[:, :, 0], velocities[:, :, 1])
    span = geometry[gk.SPEED_MAX] - geometry[gk.SPEED_MIN]
    assert speed.min() < geometry[gk.SPEED_MIN] + 0.05 * span and speed.max() > geometry[gk.SPEED_MAX] - 0.05 * span


def test_a_circle_that_nobody_can_enter_is_refused(monkeypatch):
    if not hasattr(gk.draw_encounter, "py_func"):
        monkeypatch.setattr(gk, "_TRIES", 20)  # without the compiler ten thousand take long
    geometry = geometry_array(EXPERIMENT)
    geometry[gk.SPEED_MIN], geometry[gk.SPEED_MAX] = 1.0, 2.0  # behind an ownship that is faster
    n = int(geometry[gk.POINTS]) // 2
    assert not gk.draw_encounter(1, 1, n, geometry, np.empty((1, 3)), np.empty((1, 3)))


@given(POSITION, POSITION, st.floats(20, 500), st.floats(5, 100))
def test_a_way_enters_a_cylinder_where_its_samples_do(a, b, radius, half):
    entered = pk.segment_inside(*a, *(b - a), radius, half)
    places = naive.way(a, b)
    if naive.enters(places, radius - 1e-9, half - 1e-9):
        assert entered
    if entered:  # between samples, at most half a step away
        step = np.linalg.norm(b - a) / (len(places) - 1)
        assert naive.enters(places, radius + step + 1e-9, half + step + 1e-9)


@pytest.mark.parametrize(
    ("a", "d", "entered"),
    [
        ((-9.0, 0.0, 0.0), (18.0, 0.0, 0.0), True),
        ((-9.0, 4.999, 0.0), (18.0, 0.0, 0.0), True),
        ((-9.0, 5.0, 0.0), (18.0, 0.0, 0.0), False),  # along the bound
        ((-9.0, 0.0, 2.0), (18.0, 0.0, 0.0), False),  # along the top
        ((1.0, 1.0, -9.0), (0.0, 0.0, 18.0), True),
        ((5.0, 0.0, -9.0), (0.0, 0.0, 18.0), False),
        ((1.0, 1.0, 1.0), (0.0, 0.0, 0.0), True),
        ((-9.0, 0.0, 0.0), (4.0, 0.0, 0.0), False),  # up to the bound
        ((5.0, 0.0, 0.0), (9.0, 0.0, 0.0), False),  # away from it
        ((1.0, 1.0, 3.0), (0.0, 0.0, 4.0), False),
        ((1.0, 1.0, 3.0), (0.0, 0.0, -0.9), False),
    ],
)
def test_ways_that_only_touch_do_not_enter(a, d, entered):
    assert pk.segment_inside(*a, *d, 5.0, 2.0) == entered


@given(POSITION, st.tuples(st.floats(-150, 150), st.floats(-150, 150), st.just(0.0)).map(np.array))
def test_a_flight_scored_step_by_step(a, v):
    """Twenty seconds of level flight: the closest approach and the volumes entered are those of a fine sampling."""
    sizes = SCORING[-pk.N_SIZES :]
    closest = np.full((1, pk.N_CLOSEST), np.inf)
    bits = pk.score_step(0, *a, *a, *v, sizes, closest)
    for k in range(40):
        before, after = a + 0.5 * k * v, a + 0.5 * (k + 1) * v
        bits |= pk.score_step(0, *before, *after, *v, sizes, closest)
    places = naive.way(a, a + 20.0 * v, 8001)
    radius, half = sizes[pk.RADIUS], sizes[pk.HALF_HEIGHT]
    sampled = naive.ratios(places, radius, half).min()
    step = float(np.linalg.norm(v)) * 20.0 / 8000
    assert sampled - step / radius - 1e-6 <= closest[0, pk.WORSE] <= sampled + 1e-6
    # Also where the height decides: among equals the nearest counts.
    assert closest[0, pk.HORIZONTAL] == pytest.approx(np.hypot(places[:, 0], places[:, 1]).min(), abs=step + 1e-6)
    assert closest[0, pk.VERTICAL] == pytest.approx(abs(a[2]))
    volumes = (
        (pk.FULL, radius, half),
        (pk.THIRD, radius / 3.0, half / 3.0),
        (pk.AIRCRAFT, sizes[pk.AIRCRAFT_RADIUS], sizes[pk.AIRCRAFT_HALF_HEIGHT]),
        (pk.NMAC, pk.NMAC_RADIUS, pk.NMAC_HALF_HEIGHT),
        (pk.ASTM, sizes[pk.ASTM_RADIUS], sizes[pk.ASTM_HALF_HEIGHT]),
    )
    for bit, r, h in volumes:
        if naive.enters(places, r - 1e-6, h - 1e-6):
            assert bits & bit
        if bits & bit:
            assert naive.enters(places, r + step + 1e-6, h + 1e-6)


@given(
    st.tuples(st.floats(-3000, 3000), st.floats(-3000, 3000), st.floats(-150, 150)).map(np.array),
    st.tuples(st.floats(-200, 200), st.floats(-200, 200), st.floats(-10, 10)).map(np.array),
    st.integers(0, 2**32 - 1),
    st.floats(0.1, 30.0),
)
def test_alarm_scores_equal_their_twin(s, v, seed, spread):
    root = np.random.default_rng(seed).normal(size=(9, 9)) * (np.repeat([3.0, 1.0, 0.2], 3) * spread)[:, None]
    covariance, scores = (root @ root.T)[None], np.full(ak.N_SCORES, np.nan)
    holds = ak.alarm_scores(0, *s, *v, covariance, SCORING, scores, np.zeros((6, 6)))
    t_cpa, d_cpa, h_cpa = ak.separation_ahead(*s, *v, SCORING)
    assert holds == (not math.isnan(t_cpa))
    if not holds:
        assert np.isnan(scores).all()
        return
    miss = s + v * t_cpa
    assert (d_cpa, h_cpa) == pytest.approx((math.hypot(miss[0], miss[1]), abs(miss[2])))
    if d_cpa < 1e-3 or math.hypot(v[0], v[1]) < 1e-3:
        return  # the direction of the miss is rounding
    volume = (float(SCORING[3]), float(SCORING[4]))
    noise = tuple(SCORING[ak.NOISE : ak.NOISE + 4].tolist())
    early, early_time = float(SCORING[ak.EARLY]), float(SCORING[ak.EARLY_TIME])
    latest = float(SCORING[7] + SCORING[2])
    scale, paper, track, probability = naive.alarm_scores(s, v, covariance[0], volume, latest, noise, early, early_time)
    assert scores[: ak.TRACK].tolist() == pytest.approx([scale, paper], rel=1e-9, abs=1e-9)
    if math.isinf(scores[ak.TRACK]):  # not looked at: eight sigmas away in any direction
        assert track > 8.0
    else:
        assert scores[ak.TRACK] == pytest.approx(track, rel=1e-6, abs=1e-9)
    if math.isinf(scores[ak.PROBABILITY]):
        assert probability > 12.0
    elif probability < 12.0:  # beyond, the twin's differences have no digits left
        assert scores[ak.PROBABILITY] == pytest.approx(probability, abs=1e-3)


RUN = run_settings(EXPERIMENT)
JUMP = st.sampled_from([0.0, 0.0, 0.0, 0.0, 0.0, 60.0, 400.0, -4000.0, 90000.0])
REPORTS = st.lists(
    st.tuples(st.sampled_from([0.4, 0.5, 1.0, 1.0, 1.03, 3.0, 12.0]), JUMP, JUMP, st.integers(0, 9)), max_size=30
)


@settings(max_examples=60 if hasattr(lk.take_report, "py_func") else 20)
@given(REPORTS, st.integers(0, 2**32 - 1), st.booleans(), st.sampled_from([0.0, 60.0]))
def test_a_track_lives_as_in_the_full_tracker(reports, seed, reported, speed):
    """Report for report the same filter and the same memory as `AdsbAircraft`, until the kernel asks for more."""
    rng = np.random.default_rng(seed)
    config = EXPERIMENT.scenario.tracker.config.model_copy(update={"initialise_from_reported_velocity": reported})
    track = RUN.sensing.track.copy()
    track[lk.START_REPORTED] = reported
    full = AdsbAircraft("abc123", FilterBank(config), config)
    full.velocity_sigma = math.sqrt(track[lk.VELOCITY_SIGMA] ** 2 - config.initial_velocity_sigma_mps**2)
    x, p, last = np.zeros((1, 3, 4)), np.zeros((1, 3, 4, 4)), np.zeros(1, np.int64)
    floats, integers = np.zeros(lk.N_FLOATS), np.zeros(lk.N_INTEGERS, np.int64)
    buffers = (
        np.zeros(1, np.int64), np.zeros(1, np.int64), np.zeros((1, 4), np.bool_), np.zeros(1),
        np.zeros((1, 4), np.int64), np.zeros((1, 4)),
    )  # fmt: skip
    r, t, z = RUN.sensing.variances.copy(), 0.5, np.zeros((1, 6))
    for dt, aside, above, repeat in reports:
        t += dt
        if repeat > 0:  # else the position is that of before
            z = np.array([[speed * t + aside, 0.0, -900.0 + above / 10, speed, 0.0, 0.0]])
            z = z + rng.normal(size=(1, 6)) * np.sqrt(r) * [1.0, 1.0, 1.0, 0.1, 0.1, 1.0]
        sigma = config.whole_second_sigma_s if math.floor(t) == t else config.time_sigma_s
        step = round(t / config.step_s)
        became = lk.take_report(
            t, z, r, x, p, last, floats, integers, RUN.sensing.phi, RUN.sensing.q, track, *buffers
        )  # fmt: skip
        if became == lk.NEEDS_MORE:
            return
        outcomes, _ = full.handle(Report(t, step, tuple(z[0].tolist()), tuple(r[0].tolist()), sigma))
        assert (became == lk.NOT_NEW) == ("position not new" in outcomes[0].counts)
        (f,) = full.filters
        np.testing.assert_array_equal(x[0], full.bank.x[f.slot])
        np.testing.assert_array_equal(p[0], full.bank.p[f.slot])
        assert last[0] == full.bank.last[f.slot]
        assert (integers[lk.ACCEPTED_COUNT], integers[lk.FIX_STEP]) == (f.accepted, f.fix[0])
        assert (floats[lk.T_POSITION], floats[lk.FIX_NORTH], floats[lk.FIX_EAST]) == (f.t_position, *f.fix[1:])
        assert integers[lk.VERTICAL_REJECTS] == f.vertical_rejects


@pytest.mark.parametrize(
    ("dt", "move", "speed"), [(1.0, (60.0, 80.0), 100.0), (0.0, (1.0, 1.0), None), (1.0, (9e3, 0.0), None)]
)
def test_velocity_from_two_fixes(dt, move, speed):
    north, east, sigma = lk.velocity_between(dt, *move, 16.0, 0.1, 400.0)
    if speed is None:
        assert all(math.isnan(value) for value in (north, east, sigma))
    else:
        assert (north, east) == move
        # Two positions of 4 m and 0.1 s along the way each, and half a second of turning.
        assert sigma == pytest.approx(math.sqrt(2 * (16.0 + (0.1 * speed) ** 2) + (0.5 * lk.TURN_ACCELERATION) ** 2))
