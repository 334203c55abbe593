"""R-RANSAC and ER-RANSAC as trackers: presets, tracks, the ownship, two dimensions, and input that is wrong."""

import math
from dataclasses import replace

import numpy as np
import pytest
from pydantic import ValidationError

from tests.made_plots import made_plots, straight
from wideberth.simulation.radar_plots import radar_scan
from wideberth.tracking import PLOT_TRACKERS
from wideberth.tracking.rransac.config import ErRransacConfig, RransacArticleConfig, RransacConfig
from wideberth.tracking.rransac.tracker import ErRransacTracker, RransacArticleTracker, RransacTracker
from wideberth.types import Ownship, TrackStatus

TWO = straight([[150, 80, -60], [-60, 200, -90]], [[-12, 6, -1], [14, -3, 0]], 60)
# With the gate of table 3.3, as that of table 4.5 loses tracks.
SMALL = {
    "window_scans": 15,
    "lifetime_scans": 5,
    "ransac_iterations": 10,
    "begin_ratio": 0.4,
    "end_ratio": 0.3,
    "gate_sigmas": (17.5, 3.5, 3.5),
}
TRACKERS = [
    RransacTracker(RransacConfig(preset="robust")),
    RransacTracker(RransacConfig(**SMALL)),
    RransacArticleTracker(RransacArticleConfig(**SMALL)),
    ErRransacTracker(ErRransacConfig(preset="robust")),
    ErRransacTracker(ErRransacConfig(preset="robust", hypothesis="turning")),
    ErRransacTracker(ErRransacConfig(preset="robust", hypothesis="linear")),
    RransacTracker(RransacConfig(preset="robust", update="unscented")),
    ErRransacTracker(ErRransacConfig(preset="robust", update="unscented")),
]


def turning(rate, n=150, speed=15.0):
    t = 0.1 * np.arange(n)
    return np.stack(
        [150 + speed / rate * np.sin(rate * t), 60 + speed / rate * (1 - np.cos(rate * t)), np.full(n, -70.0)], axis=1
    )[:, None]


def test_presets_are_the_tables():
    linear = RransacConfig()
    assert (linear.window_scans, linear.stored_tracks, linear.begin_ratio, linear.lifetime_scans) == (50, 10, 0.6, 40)
    assert (linear.misses_max, linear.ransac_iterations, linear.ownship_limit) == (15, 100, 0.2)
    # Q = 10e-7 (10, 10, 1, ...) and R = 10e-3 (1, 1, 1), a step of 0.1 s.
    np.testing.assert_allclose(linear.process_noise_per_s, np.array([10, 10, 1] * 3) * 10e-7 / 0.1)
    np.testing.assert_allclose(linear.pseudo_variance_m2, 10e-3)
    flight = RransacConfig(preset="flight_test")
    assert (flight.dimensions, flight.stored_tracks, flight.misses_max, flight.lifetime_scans) == (2, 20, 40, 30)
    np.testing.assert_allclose(np.multiply(flight.gate_sigmas, [0.4, 1.0, 1.0])[:2], [0.4267, 4.0], rtol=1e-3)
    np.testing.assert_allclose(
        np.array(flight.process_noise_per_s)[[0, 1, 3, 4, 6, 7]], np.array([100, 100, 166.6, 166.6, 2, 2]) * 1e-5 / 0.1
    )
    extended = ErRransacConfig()
    assert (extended.window_scans, extended.stored_tracks, extended.misses_max) == (150, 10, 15)
    assert (extended.begin_ratio, extended.end_ratio, extended.consensus_ratio) == (0.4, 0.3, 0.3)
    assert (extended.gate_sigmas, extended.ransac_iterations, extended.stop_ratio) == ((17.5, 3.5, 3.5), 10, 0.8)
    assert (extended.step_count_max, extended.step_tolerance, extended.rate_sigmas) == (30, 1e-10, None)
    assert RransacArticleConfig().model == "constant_velocity"


def test_given_keys_change_a_preset():
    config = RransacConfig(preset="robust", window_scans=30)
    assert config.window_scans == 30
    assert config.gate == "mahalanobis"
    assert RransacConfig(**config.model_dump()) == config


@pytest.mark.parametrize(
    "wrong",
    [
        {"preset": "best"},
        {"window": 10},
        {"begin_ratio": 0.2, "end_ratio": 0.4},
        {"ownship_limit": 4.0},
        {"seed": -1},
        {"update": "unscented", "dimensions": 2},
    ],
)
def test_wrong_settings_are_refused(wrong):
    with pytest.raises(ValidationError):
        RransacConfig(**wrong)


def test_the_turning_model_needs_three_dimensions():
    with pytest.raises(ValidationError, match="dimensions must be 3"):
        ErRransacConfig(dimensions=2)


@pytest.mark.parametrize("tracker", TRACKERS)
def test_both_aircraft_are_found_and_followed(tracker):
    table = tracker.run(made_plots(TWO, seed=1))
    last = table.x[table.scan == 59]
    distance = np.linalg.norm(last[:, None, :3] - TWO[59][None], axis=2)
    assert np.all(distance.min(axis=0) < 12.0)
    assert np.all(distance.min(axis=1) < 12.0)
    assert np.all(np.linalg.eigvalsh(table.P[:, :6, :6])[:, 0] > 0)
    assert np.all((table.existence > 0) & (table.existence <= 1))


@pytest.mark.parametrize("tracker", TRACKERS)
def test_steps_are_the_run(tracker):
    plots = made_plots(TWO, seed=2)
    table = tracker.run(plots)
    stepped = type(tracker)(tracker._config)
    for k in range(plots.n_scans):
        tracks, _ = stepped.step(float(plots.t[k]), [radar_scan(plots, k)])
        rows = np.flatnonzero(table.scan == k)
        rows = rows[np.argsort(table.track_id[rows])]
        good = [track for track in tracks if track.status != TrackStatus.TENTATIVE]
        assert [track.id for track in good] == [str(i + 1) for i in table.track_id[rows]]
        for row, track in zip(rows, good, strict=True):
            np.testing.assert_allclose(np.concatenate([track.position, track.velocity]), table.x[row, :6], atol=1e-9)
            np.testing.assert_allclose(track.covariance, table.P[row], atol=1e-9)
    assert stepped.counters == tracker.counters


def test_a_seed_gives_the_same_tracks_and_another_seed_others():
    plots = made_plots(TWO, seed=3, clutter=6)
    config = {"ransac_iterations": 2, **{k: v for k, v in SMALL.items() if k != "ransac_iterations"}}
    one, again, other = (RransacTracker(RransacConfig(**config, seed=s)).run(plots) for s in (1, 1, 2))
    np.testing.assert_array_equal(one.x, again.x)
    assert one.x.shape != other.x.shape or not np.array_equal(one.x, other.x)


def test_clutter_alone_makes_no_tracks():
    tracker = RransacTracker(RransacConfig(preset="robust"))
    assert len(tracker.run(made_plots(np.zeros((200, 0, 3)), seed=5, clutter=6))) == 0


def test_a_turn_that_r_ransac_loses_is_held_by_er_ransac():
    rate = math.radians(15.0)
    plots = made_plots(turning(rate), seed=6)
    names = {}
    for tracker in (
        RransacTracker(RransacConfig(preset="robust")),
        ErRransacTracker(ErRransacConfig(preset="robust")),
    ):
        table = tracker.run(plots)
        near = np.linalg.norm(table.x[:, :3] - turning(rate)[table.scan, 0], axis=1) < 10.0
        names[type(tracker)] = len(np.unique(table.track_id[near]))
        if isinstance(tracker, ErRransacTracker):
            assert len(np.unique(table.scan[near & (table.scan >= 20)])) > 0.95 * 130
    assert names[ErRransacTracker] == 1
    assert names[RransacTracker] > 3


def with_telemetry(plots, target, velocity):
    own = np.concatenate([TWO[:, target], np.tile(velocity, (len(TWO), 1))], axis=1)
    return replace(plots, ownship=own)


@pytest.mark.parametrize("test", ["polar", "states", "chi_square"])
def test_the_ownship_is_told_from_its_telemetry(test):
    limit = 4.0 if test == "chi_square" else 0.2
    config = RransacConfig(preset="robust", ownship_test=test, ownship_limit=limit, gate_sigmas=(17.5, 3.5, 3.5))
    plots = with_telemetry(made_plots(TWO, seed=7), 1, [14.0, -3.0, 0.0])
    table = RransacTracker(config).run(plots)
    late = table.scan > 30
    own = np.linalg.norm(table.x[:, :3] - TWO[table.scan, 1], axis=1) < 20.0
    np.testing.assert_array_equal(table.is_ownship[late], own[late])
    assert own[late].sum() == 29
    assert not RransacTracker(config).run(made_plots(TWO, seed=7)).is_ownship.any()


def test_the_ownship_is_told_in_steps():
    plots = made_plots(TWO, seed=7)
    tracker = RransacTracker(RransacConfig(preset="robust"))
    tracks = ()
    for k in range(40):
        own = Ownship(float(plots.t[k]), TWO[k, 0], np.array([-12.0, 6.0, -1.0]))
        tracks, _ = tracker.step(float(plots.t[k]), [radar_scan(plots, k)], own)
    (mine,) = [track for track in tracks if track.is_ownship]
    assert np.linalg.norm(mine.position - TWO[39, 0]) < 15.0


@pytest.mark.parametrize("azimuth", ["plane", "cone"])
def test_two_dimensions_at_a_known_altitude(azimuth):
    """A flight as in thesis chapter 5: a tilted array without elevation, three aircraft 30 m above it."""
    pitch = math.radians(15.0)
    c, s = math.cos(pitch), math.sin(pitch)
    attitude = np.tile(np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]]).T, (120, 1, 1))
    truth = straight([[120, -40, -30], [150, 30, -30]], [[-3, 6, 0], [-6, -4, 0]], 120)
    plots = made_plots(truth, seed=8, attitude=attitude, clutter=0)
    z = plots.z.copy()
    if azimuth == "cone":
        z[:, 1] = np.arcsin(np.cos(z[:, 2]) * np.sin(z[:, 1]))
    z[:, 2] = np.nan
    for preset in ("robust", "flight_test"):
        settings = {"preset": preset, "dimensions": 2, "known_altitude_m": 30.0, "azimuth": azimuth}
        # The printed gate of one bin is for a radar whose range has no other noise.
        table = RransacTracker(RransacConfig(**settings, gate_sigmas=(5.0, 4.0, 4.0))).run(replace(plots, z=z))
        last = table.x[table.scan == 119]
        distance = np.linalg.norm(last[:, None, :3] - truth[119][None], axis=2)
        assert np.all(distance.min(axis=0) < 6.0)
        np.testing.assert_array_equal(last[:, [2, 5, 8]], [[-30.0, 0.0, 0.0]] * len(last))
        np.testing.assert_allclose(table.P[:, 2, 2], 100.0)


def test_bad_plots_are_left_out_and_counted():
    plots = made_plots(TWO, seed=1)
    clean = RransacTracker(RransacConfig(preset="robust")).run(plots)
    first = plots.first.copy()
    first[11:] += 5
    bad = np.array([[np.nan, 0, 0, 0], [50, np.inf, 0, 0], [50, 0, np.nan, 0], [-50, 0, 0, 0], [0, 0, 0, 0]])
    at = plots.first[11]
    z = np.concatenate([plots.z[:at], bad, plots.z[at:]])
    table = RransacTracker(RransacConfig(preset="robust")).run(replace(plots, first=first, z=z))
    np.testing.assert_array_equal(table.x, clean.x)
    assert table.counters["plot not finite"] == 3
    assert table.counters["plot with range not positive"] == 2


def test_times_that_are_wrong_are_left_out_and_counted():
    plots = made_plots(TWO, seed=1)
    t = plots.t.copy()
    t[20], t[25], t[30], t[33] = t[19], t[23], np.nan, t[34]
    table = RransacTracker(RransacConfig(preset="robust")).run(replace(plots, t=t))
    assert not set(table.scan.tolist()) & {20, 25, 30, 34}
    assert table.counters["scan repeated"] == 2
    assert table.counters["scan late"] == 1
    assert table.counters["scan without time or pose"] == 1
    assert len(np.unique(table.track_id)) == 2


@pytest.mark.parametrize("jump", [-60.0, 60.0])
def test_a_jump_in_time_starts_anew(jump):
    plots = made_plots(TWO, seed=1)
    t = plots.t.copy()
    t[30:] += jump
    table = RransacTracker(RransacConfig(preset="robust")).run(replace(plots, t=t))
    assert table.counters["started anew"] == 1
    assert not set(table.track_id[table.scan < 30]) & set(table.track_id[table.scan >= 30])


def test_a_pose_that_is_not_finite_is_no_scan():
    plots = made_plots(TWO, seed=1)
    sensor = plots.sensor_position.copy()
    sensor[12] = np.nan
    table = RransacTracker(RransacConfig(preset="robust")).run(replace(plots, sensor_position=sensor))
    assert table.counters["scan without time or pose"] == 1
    assert 12 not in table.scan


def test_ten_thousand_plots_in_a_scan_leave_the_tracks_alone():
    plots = made_plots(TWO, seed=1, clutter=0)
    rng = np.random.default_rng(3)
    flood = np.full((10_000, 4), np.nan)
    flood[:, 0], flood[:, 1], flood[:, 2] = rng.uniform(50, 600, 10_000), rng.uniform(-3, 3, 10_000), 1.2
    at = plots.first[41]
    first = plots.first.copy()
    first[41:] += 10_000
    z = np.concatenate([plots.z[:at], flood, plots.z[at:]])
    table = RransacTracker(RransacConfig(preset="robust")).run(replace(plots, first=first, z=z))
    assert table.counters["plot beyond the cap for births"] >= 10_000 - 64
    for k in (40, 41, 59):
        assert np.count_nonzero(table.scan == k) == 2


def test_empty_scans_and_none_at_all():
    plots = made_plots(np.zeros((5, 0, 3)), seed=1, clutter=0)
    assert len(RransacTracker(RransacConfig()).run(plots)) == 0
    tracker = RransacTracker(RransacConfig(preset="robust"))
    for k in range(3):
        assert tracker.step(0.1 * k, [radar_scan(plots, k)]) == ((), ())
    assert tracker.step(1.0, ()) == ((), ())


def test_a_track_dies_after_its_misses():
    truth = TWO.copy()
    plots = made_plots(truth, seed=1, clutter=0, p_d=1.0)
    first = np.minimum(plots.first, plots.first[30])
    table = RransacTracker(RransacConfig(preset="robust")).run(replace(plots, first=first))
    assert table.scan.max() == 29 + 8 - 1
    assert table.counters["tracks without inliers"] == 2


def test_steps_refuse_what_is_no_scan():
    tracker = RransacTracker(RransacConfig())
    plots = made_plots(TWO, seed=1)
    with pytest.raises(ValueError, match="not finite"):
        tracker.step(math.nan, ())
    with pytest.raises(ValueError, match=r"shape \(k, 4\)"):
        tracker.step(0.0, [replace(radar_scan(plots, 0), z=np.zeros((2, 6)))])
    tracker.step(0.0, [replace(radar_scan(plots, 0), kind="adsb")])
    assert tracker.counters["scan of another kind"] == 1
    _, events = tracker.step(0.0, [radar_scan(plots, 0), radar_scan(plots, 0)])
    assert events == ("scan repeated: 1",)


def test_two_sensors_may_look_at_once():
    plots = made_plots(TWO, seed=1, clutter=0, p_d=1.0)
    tracker = RransacTracker(RransacConfig(preset="robust"))
    tracks = ()
    for k in range(20):
        tracks, events = tracker.step(float(plots.t[k]), [radar_scan(plots, k, "left"), radar_scan(plots, k, "right")])
        assert events == ()
    assert len(tracks) == 2
    assert tracks[0].sources == ("left", "right")


@pytest.mark.parametrize("name", ["rransac", "er_rransac", "rransac_article"])
def test_trackers_go_by_name(name):
    assert PLOT_TRACKERS[name].startswith("wideberth.tracking.rransac.tracker:")


@pytest.mark.parametrize(
    ("tracker", "config", "truth"),
    [
        (RransacTracker, RransacConfig, straight([[150, 80, -60]], [[-6, 6, -1]], 150)),
        (ErRransacTracker, ErRransacConfig, turning(0.15)),
    ],
)
def test_unscented_and_tangent_updates_agree_where_plots_are_good(tracker, config, truth):
    plots = made_plots(truth, 5, clutter=0)
    tangent = tracker(config(preset="robust")).run(plots)
    unscented = tracker(config(preset="robust", update="unscented")).run(plots)
    np.testing.assert_array_equal(tangent.scan, unscented.scan)
    late = tangent.scan > 60
    apart = np.linalg.norm(tangent.x[late, :3] - unscented.x[late, :3], axis=1)
    sigma = np.sqrt(np.trace(tangent.P[late, :3, :3], axis1=1, axis2=2))
    assert np.median(apart / sigma) < 0.3
    for table in (tangent, unscented):
        assert len(table.nis) > 80
        # The mean of n chi-square variables with 3 degrees of freedom, five standard deviations.
        assert abs(table.nis.sum() / table.nis_dof.sum() - 1) < 5 * math.sqrt(2 / (3 * len(table.nis)))
