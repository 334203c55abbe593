"""The default tracker as a part: steps and runs agree, bad input is counted and survived, time may come late."""

import dataclasses
import math
import os

import numpy as np
import pytest

from wideberth.plots import Plots
from wideberth.simulation.radar_plots import maneuvering_flights, radar_plots, radar_scan, straight_flights
from wideberth.tracking import PLOT_TRACKERS
from wideberth.tracking.multi_target.config import MultiTargetConfig
from wideberth.tracking.multi_target.intake import SensorLog, detection_table
from wideberth.tracking.multi_target.tracker import MultiTargetTracker
from wideberth.types import DetectionModel, Ownship, Scan, TrackStatus

# It is the only test of the scan as a whole that is quick enough without the compiler.
pytestmark = pytest.mark.kernels

PLACE, VELOCITY = np.array([250.0, 80.0, -120.0]), np.array([-12.0, 4.0, 0.0])


def tracker(**settings):
    return MultiTargetTracker(MultiTargetConfig(**settings))


def one_flight(n=60, seed=1, place=PLACE, velocity=VELOCITY, **rules) -> tuple[Plots, np.ndarray]:
    """Plots of one straight flight, and its states."""
    t = 0.1 * np.arange(n)
    position = (place + t[:, None] * velocity)[:, None]
    rules.setdefault("clutter_max", 1)
    plots, _ = radar_plots(np.random.default_rng(seed), position, np.tile(velocity, (n, 1, 1)), **rules)
    return plots, np.concatenate([position[:, 0], np.tile(velocity, (n, 1))], axis=1)


def feed(part, plots, begin=0, end=None):
    """Step through scans; return the last tracks and all events."""
    tracks, events = (), []
    for k in range(begin, plots.n_scans if end is None else end):
        tracks, told = part.step(float(plots.t[k]), [radar_scan(plots, k)])
        events.extend(told)
    return tracks, events


def confirmed(tracks):
    return [t for t in tracks if t.status is not TrackStatus.TENTATIVE]


def test_it_goes_by_name():
    assert PLOT_TRACKERS["wideberth"].endswith(":MultiTargetTracker")
    assert MultiTargetTracker.Config is MultiTargetConfig


@pytest.mark.parametrize("onboard", [False, True])
def test_steps_and_a_run_are_the_same(onboard):
    rng = np.random.default_rng(2)
    position, velocity = maneuvering_flights(rng, 3, 80)
    pose = {}
    if onboard:
        t = 0.1 * np.arange(80)
        pose = {
            "sensor_position": np.stack([12.0 * t, 3.0 * t, -100.0 + 0.0 * t], axis=1),
            "sensor_attitude": np.tile(np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]), (80, 1, 1)),
            "field_of_view": (math.pi, math.radians(60)),
        }
    plots, _ = radar_plots(rng, position, velocity, clutter_max=6, ownship=-1 if onboard else 0, **pose)
    table = tracker().run(plots)
    part, rows = tracker(), 0
    for k in range(plots.n_scans):
        own = None
        if not onboard:
            own = Ownship(float(plots.t[k]), plots.ownship[k, :3], plots.ownship[k, 3:])
        tracks, _ = part.step(float(plots.t[k]), [radar_scan(plots, k)], own)
        for track in tracks:
            at = np.flatnonzero((table.scan == k) & (table.track_id == int(track.id)))
            if track.status is not TrackStatus.CONFIRMED and not len(at):
                continue
            np.testing.assert_allclose(track.position, table.x[at[0], :3], rtol=1e-9, atol=1e-9)
            np.testing.assert_allclose(track.covariance, table.P[at[0]], rtol=1e-7, atol=1e-9)
            assert track.existence == pytest.approx(table.existence[at[0]])
            assert track.is_ownship == table.is_ownship[at[0]]
            rows += 1
    assert rows == len(table) > 150


def test_two_runs_of_one_tracker_do_not_know_of_each_other():
    plots, _ = one_flight()
    part = tracker()
    a, b = part.run(plots), part.run(plots)
    np.testing.assert_array_equal(a.x, b.x)
    np.testing.assert_array_equal(a.track_id, b.track_id)


def test_a_track_is_confirmed_found_and_told():
    plots, truth = one_flight()
    tracks, events = feed(tracker(), plots)
    (track,) = confirmed(tracks)
    assert f"track {track.id} confirmed" in events
    assert np.linalg.norm(track.position - truth[-1, :3]) < 12.0
    assert track.sources == ("radar",) and track.existence > 0.999
    assert np.linalg.eigvalsh(track.covariance).min() > 0.0


def test_nothing_in_nothing_out_and_only_time_may_raise():
    part = tracker()
    assert part.step(0.0, []) == ((), ())
    for t in (math.nan, math.inf):
        with pytest.raises(ValueError, match="not finite"):
            part.step(t, [])


def test_misses_coast_and_then_lose_the_track():
    plots, _ = one_flight(detection_probability=0.9)
    part = tracker()
    tracks, _ = feed(part, plots)
    (track,) = confirmed(tracks)
    statuses, events = [], []
    for k in range(1, 60):
        t = float(plots.t[-1]) + 0.1 * k
        empty = dataclasses.replace(radar_scan(plots, 59), t=t, z=np.zeros((0, 4)), R=np.zeros((0, 4, 4)))
        tracks, told = part.step(t, [empty])
        statuses.extend(x.status for x in tracks if x.id == track.id)
        events.extend(told)
    assert f"track {track.id} lost: no longer seen" in events and 5 <= len(statuses) < 20


def test_outside_the_field_of_view_it_coasts_and_keeps_its_number():
    view = {"field_of_view": (math.radians(30), math.radians(45)), "clutter_max": 0}
    n = 220
    angle = np.radians(28.0 + 8.0 * np.sin(np.linspace(0.0, 2.2 * math.pi, n)))
    position = 300.0 * np.stack([np.cos(angle), np.sin(angle), -0.3 * np.ones(n)], axis=1)[:, None]
    velocity = np.gradient(position, 0.1, axis=0)
    plots, truth = radar_plots(np.random.default_rng(3), position, velocity, **view)
    gone = np.flatnonzero(~truth.visible[:, 0])
    assert len(gone) > 20
    part, ids, coasting = tracker(), set(), 0
    for k in range(n):
        tracks, _ = part.step(float(plots.t[k]), [radar_scan(plots, k)])
        ids |= {t.id for t in confirmed(tracks)}
        coasting += any(t.status is TrackStatus.COASTING for t in tracks) and k in gone
    assert len(ids) == 1 and coasting > 10


def test_no_scan_for_long_drops_everything():
    plots, _ = one_flight()
    part = tracker()
    feed(part, plots)
    tracks, events = part.step(6.0 + 20.0, [])
    assert confirmed(tracks)[0].status is TrackStatus.COASTING and not events
    tracks, events = part.step(6.0 + 40.0, [])
    assert not tracks and any("no scan for too long" in e for e in events)
    # A clock that leaps is no reason to hang.
    late = dataclasses.replace(radar_scan(plots, 59), t=1e7)
    assert part.step(1e7, [late])[0] == ()


def broken(scan, **changes):
    return dataclasses.replace(scan, **changes)


@pytest.mark.parametrize(
    ("change", "counter"),
    [
        (lambda s: {"z": np.full((3, 4), np.nan), "R": np.tile(np.eye(4), (3, 1, 1))}, "plot not finite"),
        (lambda s: {"z": np.array([[-50.0, 0, 0, np.nan]]), "R": np.eye(4)[None]}, "plot out of range"),
        (lambda s: {"z": np.zeros((2, 3))}, "scan of a wrong shape"),
        (lambda s: {"R": np.zeros((1, 3, 3))}, "scan of a wrong shape"),
        (lambda s: {"t": math.nan}, "scan time not finite"),
        (lambda s: {"t": s.t + 100.0}, "scan time in the future"),
        (lambda s: {"t": s.t - 5.0}, "scan too late"),
        (lambda s: {"sensor_position": s.sensor_position + 1e4}, "sensor jumped"),
        (lambda s: {"sensor_position": np.full(3, np.nan)}, "sensor pose not finite"),
        (lambda s: {"sensor_position": np.zeros(2)}, "sensor pose of a wrong shape"),
        (lambda s: {"sensor_attitude": 2.0 * np.eye(3)}, "sensor attitude is no rotation"),
        (lambda s: {"field_of_view": (0.0, 1.0)}, "field of view out of range"),
        (lambda s: {"kind": "sonar"}, "scan of another kind"),
        (lambda s: {"kind": "adsb", "z": np.zeros((2, 3))}, "scan of a wrong shape"),
    ],
)
def test_bad_scans_are_counted_and_tracks_survive(change, counter):
    plots, _ = one_flight(n=70, clutter_max=0)
    part = tracker()
    tracks, _ = feed(part, plots, 0, 60)
    (track,) = confirmed(tracks)
    good = radar_scan(plots, 60)
    _, events = part.step(good.t, [broken(good, **change(good))])
    assert part.counters[counter] >= 1
    if counter.startswith(("scan", "sensor", "field")) and counter != "scan of another kind":
        assert any(counter in e for e in events)
    tracks, _ = feed(part, plots, 61)
    assert track.id in [t.id for t in confirmed(tracks)]


def test_a_repeated_scan_is_taken_once():
    plots, _ = one_flight(n=40)
    part, twin = tracker(), tracker()
    feed(part, plots, 0, 30)
    feed(twin, plots, 0, 30)
    scan = radar_scan(plots, 30)
    a, events = part.step(scan.t, [scan, scan])
    b, _ = twin.step(scan.t, [scan])
    assert part.counters["scan repeated"] == 1 and any("repeated" in e for e in events)
    np.testing.assert_array_equal(a[0].covariance, b[0].covariance)


def test_a_sensor_that_stays_at_its_new_place_is_believed():
    plots, truth = one_flight(n=70, clutter_max=0)
    part = tracker()
    feed(part, plots, 0, 40)
    shift = np.array([5000.0, 0.0, 0.0])
    for k in range(40, 70):
        scan = radar_scan(plots, k)
        part.step(scan.t, [broken(scan, sensor_position=scan.sensor_position + shift)])
    assert part.counters["sensor jumped"] == 2
    tracks, _ = part.step(float(plots.t[-1]), [])
    near = [t for t in confirmed(tracks) if np.linalg.norm(t.position - truth[-1, :3] - shift) < 40.0]
    assert len(near) == 1


def test_time_that_goes_back_starts_again():
    plots, _ = one_flight()
    part = tracker()
    feed(part, plots)
    tracks, events = part.step(0.0, [])
    assert tracks == () and "time went back" in events[0] and part.counters["time went back"] == 1
    assert confirmed(feed(part, plots)[0])


def test_late_scans_are_put_in_order():
    plots, _ = one_flight(n=60, clutter_max=3)
    part, twin = tracker(), tracker()
    feed(twin, plots)
    order = list(range(60))
    for k in range(10, 55, 7):
        order[k], order[k + 2] = order[k + 2], order[k]
    now = 0.0
    for k in order:
        now = max(now, float(plots.t[k]))
        part.step(now, [radar_scan(plots, k)])
    assert part.counters["scan late, put in order"] == 14
    a, b = part.step(5.9, [])[0], twin.step(5.9, [])[0]
    assert len(confirmed(a)) == len(confirmed(b)) == 1
    np.testing.assert_allclose(confirmed(a)[0].position, confirmed(b)[0].position, atol=1e-9)
    np.testing.assert_allclose(confirmed(a)[0].covariance, confirmed(b)[0].covariance, atol=1e-9)


def test_a_run_counts_what_it_leaves_out():
    plots, _ = one_flight(n=50)
    t, z = plots.t.copy(), plots.z.copy()
    t[20], t[30] = 1.0, np.nan
    z[plots.first[40] : plots.first[41], 0] = -1.0
    counters = tracker().run(dataclasses.replace(plots, t=t, z=z)).counters
    assert counters["scan too late"] == 1 and counters["scan time not finite"] == 1
    rows = plots.first[41] - plots.first[40]
    assert counters.get("plot out of range", 0) == rows


def test_a_flood_of_plots_is_shed_and_tracks_survive():
    rng = np.random.default_rng(4)
    plots, truth = one_flight(n=70)
    k, n = 50, 10_000
    flood = np.full((n, 4), np.nan)
    flood[:, 0], flood[:, 1] = 600 * rng.random(n) ** (1 / 3), rng.uniform(-math.pi, math.pi, n)
    flood[:, 2] = np.arcsin(rng.random(n))
    first = plots.first.copy()
    first[k + 1 :] += n
    table = tracker().run(dataclasses.replace(plots, z=np.insert(plots.z, plots.first[k], flood, axis=0), first=first))
    assert table.counters["plot shed"] > 9000
    last = table.x[table.scan == 69]
    assert len(last) == 1 and np.linalg.norm(last[0, :3] - truth[-1, :3]) < 10.0


@pytest.mark.compiled
def test_many_tracks_grow_the_bank_and_the_table():
    rng = np.random.default_rng(5)
    plots, _ = radar_plots(rng, *straight_flights(rng, 60, 30, extent=2.0), range_max=1500.0)
    table = tracker().run(plots)
    assert len(np.unique(table.track_id[table.scan == 29])) == pytest.approx(60, abs=1)
    tracks, _ = feed(tracker(), plots)
    assert len(confirmed(tracks)) == np.sum(table.scan == 29)


def test_the_ownship_is_found_and_others_are_not():
    rng = np.random.default_rng(6)
    plots, truth = radar_plots(rng, *straight_flights(rng, 3, 100), ownship=1)
    table = tracker().run(plots)
    late = table.scan > 60
    for target in range(3):
        near = np.linalg.norm(table.x[late, :3] - truth.position[table.scan[late], target], axis=1) < 20.0
        assert table.is_ownship[late][near].mean() == pytest.approx(float(target == 1), abs=0.1)


def test_two_sensors_of_different_poses_and_rates_feed_one_track():
    truth = [PLACE + VELOCITY * 0.1 * k for k in range(80)]
    position, velocity = np.array(truth)[:, None], np.tile(VELOCITY, (80, 1, 1))
    turned = np.tile(np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]), (80, 1, 1))
    beside = np.tile([100.0, 300.0, 0.0], (80, 1))
    one, _ = radar_plots(np.random.default_rng(7), position, velocity, clutter_max=2)
    two, _ = radar_plots(
        np.random.default_rng(8), position, velocity, clutter_max=2, sensor_position=beside, sensor_attitude=turned
    )
    part, alone = tracker(), tracker()
    for k in range(80):
        scans = [radar_scan(one, k, "north")]
        if k % 3 == 0:
            scans.append(radar_scan(two, k, "east"))
        tracks, _ = part.step(0.1 * k, scans)
        single, _ = alone.step(0.1 * k, scans[:1])
    (both,), (first,) = confirmed(tracks), confirmed(single)
    assert set(both.sources) == {"north", "east"}
    assert np.linalg.norm(both.position - truth[-1]) < 6.0
    assert np.trace(both.covariance[:3, :3]) < np.trace(first.covariance[:3, :3])


def flat(plots):
    z = plots.z.copy()
    z[:, 2] = math.nan
    return dataclasses.replace(plots, z=z, sigma=np.array([*plots.sigma[:2], np.nan, np.nan]))


def test_a_2d_radar_with_a_known_altitude_tracks_in_three_dimensions():
    plots, truth = one_flight(n=100)
    table = tracker(known_altitude_m=120.0, known_altitude_sigma_m=5.0).run(flat(plots))
    last = table.x[table.scan == 99]
    assert len(last) == 1
    assert np.linalg.norm(last[0, :3] - truth[-1, :3]) < 8.0 and abs(last[0, 2] + 120.0) < 6.0


def test_a_2d_radar_without_one_tracks_in_its_plane_and_says_that_it_knows_no_height():
    plots, truth = one_flight(n=100, place=np.array([400.0, 80.0, -30.0]))
    table = tracker().run(flat(plots))
    rows = table.scan == 99
    assert rows.sum() == 1
    assert np.linalg.norm(table.x[rows][0, :2] - truth[-1, :2]) < 25.0
    assert math.sqrt(table.P[rows][0, 2, 2]) > 30.0


def test_range_rates_are_used():
    plots, truth = one_flight(n=12, clutter_max=0, detection_probability=1.0)
    direction = truth[:, :3] / np.linalg.norm(truth[:, :3], axis=1)[:, None]
    z = plots.z.copy()
    z[:, 3] = (direction * VELOCITY).sum(axis=1)
    rated = dataclasses.replace(plots, z=z, sigma=np.array([*plots.sigma[:3], 0.2]))
    spreads = []
    for p in (plots, rated):
        table = tracker().run(p)
        (row,) = np.flatnonzero(table.scan == 11)
        spreads.append(direction[-1] @ table.P[row, 3:6, 3:6] @ direction[-1])
    assert spreads[1] < 0.2 * spreads[0]


def test_the_order_of_plots_in_a_scan_does_not_matter():
    rng = np.random.default_rng(9)
    plots, _ = radar_plots(rng, *straight_flights(rng, 5, 60), clutter_max=10)
    z = plots.z.copy()
    for a, b in zip(plots.first[:-1], plots.first[1:], strict=True):
        z[a:b] = z[a:b][::-1]
    one, two = tracker().run(plots), tracker().run(dataclasses.replace(plots, z=z))
    np.testing.assert_array_equal(one.scan, two.scan)
    np.testing.assert_allclose(one.x, two.x, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("angle", [0.7, 2.5])
def test_the_scene_may_be_turned_about_the_sensor(angle):
    """The plots stay as they are and the sensor's heading turns: the tracks turn with it."""
    rng = np.random.default_rng(10)
    plots, _ = radar_plots(rng, *maneuvering_flights(rng, 3, 60), clutter_max=3)
    c, s = math.cos(angle), math.sin(angle)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    turned = dataclasses.replace(plots, sensor_attitude=np.tile(turn, (60, 1, 1)))
    one, two = tracker().run(plots), tracker().run(turned)
    np.testing.assert_array_equal(one.track_id, two.track_id)
    np.testing.assert_allclose(two.x[:, :3], one.x[:, :3] @ turn.T, atol=1e-6)
    np.testing.assert_allclose(two.P[:, 3:6, 3:6], turn @ one.P[:, 3:6, 3:6] @ turn.T, atol=1e-6)


def test_a_radar_that_sees_less_than_it_says_keeps_its_tracks():
    plots, _ = one_flight(n=300, seed=12, detection_probability=0.5, place=np.array([250.0, 80.0, -120.0]))
    table = tracker().run(dataclasses.replace(plots, detection_probability=0.95))
    assert len(np.unique(table.track_id[table.scan > 100])) == 1
    assert len(np.unique(table.scan[table.scan > 100])) == 199


def test_bad_poses_in_a_file_are_counted():
    plots, _ = one_flight(n=60)
    position, attitude = plots.sensor_position.copy(), plots.sensor_attitude.copy()
    position[30] = np.nan
    attitude[31] = 0.0
    position[32] = 1e5
    table = tracker().run(dataclasses.replace(plots, sensor_position=position, sensor_attitude=attitude))
    assert table.counters["sensor pose not finite"] == 1
    assert table.counters["sensor attitude is no rotation"] == 1
    assert table.counters["sensor jumped"] == 1
    assert len(np.unique(table.track_id[table.scan > 20])) == 1


def test_detection_tables():
    config = MultiTargetConfig()
    ranges, probabilities = detection_table(None, config)
    assert ranges[-1] == config.assumed_range_max_m and probabilities[0] == config.assumed_detection_probability
    many = DetectionModel(np.linspace(1.0, 500.0, 100), np.linspace(1.0, 0.0, 100))
    ranges, probabilities = detection_table(many, config)
    assert ranges[-1] == 500.0 and probabilities[0] == 0.999 and probabilities[-1] == 0.0
    np.testing.assert_allclose(np.interp([50.0, 333.0], ranges, probabilities), [1 - 49 / 499, 1 - 332 / 499])


def test_a_sensor_log_takes_velocity_from_places():
    log = SensorLog(0)
    assert log.moves_to(0.0, np.zeros(3), 400.0)
    assert log.moves_to(0.5, np.array([10.0, 0.0, 0.0]), 400.0)
    np.testing.assert_allclose(log.velocity, [20.0, 0.0, 0.0])
    assert log.moves_to(0.2, np.array([4.0, 0.0, 0.0]), 400.0)
    assert not log.moves_to(0.6, np.array([1e4, 0.0, 0.0]), 400.0)


@pytest.mark.compiled
def test_the_state_does_not_grow_with_time():
    """Traffic that comes and goes: buffers, histories and notes stay as they are after the first lap."""
    rng = np.random.default_rng(11)
    plots, _ = radar_plots(rng, *straight_flights(rng, 3, 150), clutter_max=5)
    part = tracker()
    sizes = []
    for lap in range(3):
        for k in range(150):
            scan = radar_scan(plots, k)
            t = scan.t + 30.0 * lap
            part.step(t, [dataclasses.replace(scan, t=t)])
        state, history = part._state, part._history
        arrays = sum(a.nbytes for a in (*state.bank, *state.window, state.clutter))
        log = part._logs["radar"]
        sizes.append((arrays, len(history._scans) < 20, len(history._snapshots) < 6, len(log.recent) <= 20))
    assert len(set(sizes[1:])) == 1 and all(sizes[-1][1:])
    assert len(part._told) < 1000


def test_a_run_keeps_the_nis_and_it_is_that_of_a_consistent_filter():
    """Per degree of freedom 1 on straight flight: within 5 sigma of the mean of some 350 looks of 3 elements."""
    plots, _ = one_flight(n=400)
    table = tracker().run(plots)
    assert len(table.nis) == len(table.nis_dof) > 250 and set(table.nis_dof.tolist()) == {3.0}
    assert 0.75 < table.nis.sum() / table.nis_dof.sum() < 1.25


def test_tracks_born_again_by_a_late_scan_keep_their_numbers():
    """Births of the first half second are run again four times as scans come out of order."""
    plots, truth = one_flight(n=40, detection_probability=0.95)
    order = [0, 1, 2, 4, 5, 3, 7, 8, 6, 10, 9, *range(11, 40)]
    part, seen = tracker(), {}
    for count, k in enumerate(order):
        t = float(plots.t[max(order[: count + 1])])
        tracks, _ = part.step(t, [radar_scan(plots, k)])
        for x in tracks:
            if np.linalg.norm(x.position - truth[max(order[: count + 1])][:3]) < 30.0:
                seen.setdefault(x.id, []).append(t)
    assert part.counters["scan late, put in order"] == 3
    confirmed_now = [x for x in tracks if x.status is not TrackStatus.TENTATIVE]
    assert len(confirmed_now) == 1
    assert list(seen) == [confirmed_now[0].id]


@pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="10,000 filters: minutes without the compiler")
def test_ten_thousand_plots_and_reports_in_one_step_are_taken_in_and_counted():
    """What is beyond the limits is shed and counted, and the track lives; the reports each begin a track."""
    rng = np.random.default_rng(9)
    plots, _ = one_flight(n=40)
    part, n = tracker(reports={"addresses_max": 6000}), 10_000
    feed(part, plots, 0, 39)
    scan = radar_scan(plots, 39)
    z = np.full((n, 4), np.nan)
    z[:, 0], z[:, 1] = 600 * rng.random(n) ** (1 / 3), rng.uniform(-math.pi, math.pi, n)
    z[:, 2] = np.arcsin(rng.random(n))
    z = np.concatenate([scan.z, z])
    flood = dataclasses.replace(scan, z=z, R=np.tile(scan.R[0], (len(z), 1, 1)), t_valid=np.full(len(z), scan.t))
    told = np.concatenate([rng.uniform(-3e4, 3e4, (n, 3)), rng.uniform(-50, 50, (n, 3))], axis=1)
    reports = Scan(
        t=scan.t,
        t_received=scan.t,
        sensor="ears",
        kind="adsb",
        z=told,
        R=np.tile(np.diag([25.0, 25, 100, 1, 1, 1]), (n, 1, 1)),
        t_valid=np.full(n, scan.t),
        source_ids=tuple(f"{k:06x}" for k in range(n)),
    )
    tracks, _ = part.step(scan.t, [flood, reports])
    assert part.counters["plot shed"] > 9000 and part.counters["address beyond the most"] == 4000
    assert part.counters["track started by a report"] == 6000 and len(tracks) >= 6001
    assert sum(x.status is not TrackStatus.TENTATIVE for x in tracks) == 1
