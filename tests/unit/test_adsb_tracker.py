"""The ADS-B tracker: life of tracks, rejections in words and numbers, late reports, shared addresses."""

import math
from collections.abc import Iterable

import numpy as np
import pytest
from numpy.typing import NDArray

from wideberth.tracking.adsb_kalman import AdsbKalmanTracker
from wideberth.tracking.config import AdsbKalmanConfig
from wideberth.types import Scan, SourceInfo, Track, TrackStatus

FloatArray = NDArray[np.float64]
NAN = math.nan
R = np.diag([16.0, 16.0, 540.0, 17.0, 17.0, 0.03])
Row = tuple[float, str, tuple[float, ...]]


def scan(t: float, rows: Iterable[Row], info: SourceInfo | None = None) -> Scan:
    rows = list(rows)
    return Scan(
        t=t,
        t_received=t,
        sensor="adsb",
        kind="adsb",
        z=np.array([row[2] for row in rows]).reshape(-1, 6),
        R=np.tile(R, (len(rows), 1, 1)),
        t_valid=np.array([row[0] for row in rows]),
        source_ids=tuple(row[1] for row in rows),
        sources=(info or SourceInfo(nacp=8, nacv=1, nic=7),) * len(rows),
    )


def straight(t: float, north: float = 0.0, east: float = 0.0, speed: float = 50.0) -> tuple[float, ...]:
    """Return a report of a level flight to the north, at `north` and `east` at time 0."""
    return (north + speed * t, east, -500.0, speed, 0.0, 0.0)


def fly(tracker: AdsbKalmanTracker, times: Iterable[float], address: str = "abc123") -> list[str]:
    events: list[str] = []
    for t in times:
        events += tracker.step(t, [scan(t, [(t, address, straight(t))])])[1]
    return events


def same(a: Iterable[Track], b: Iterable[Track]) -> bool:
    a, b = sorted(a, key=lambda x: x.id), sorted(b, key=lambda x: x.id)
    return [x.id for x in a] == [x.id for x in b] and all(
        np.allclose(x.position, y.position, rtol=1e-12, atol=1e-9)
        and np.allclose(x.velocity, y.velocity, rtol=1e-12, atol=1e-9)
        and np.allclose(x.covariance, y.covariance, rtol=1e-12, atol=1e-12)
        and (x.status, x.t_last_update, x.existence) == (y.status, y.t_last_update, y.existence)
        for x, y in zip(a, b, strict=True)
    )


def test_track_follows_and_carries_the_bias() -> None:
    tracker = AdsbKalmanTracker(AdsbKalmanConfig(latency_sigma_s=0.0))
    events = fly(tracker, np.arange(0.3, 30.0, 1.0).tolist())
    (track,), _ = tracker.step(29.55, [])
    assert events == ["track ABC123 started"]
    assert track.status is TrackStatus.CONFIRMED
    assert np.allclose(track.position, [50.0 * 29.55, 0.0, -500.0], atol=0.5)
    assert np.allclose(track.velocity, [50.0, 0.0, 0.0], atol=0.5)
    bias = (185.2 / 2.4477) ** 2 / 4  # NACp 8: half of 0.1 nmi at 95 %
    assert bias < track.covariance[0, 0] < bias + 4.0**2 * 2
    assert np.all(np.linalg.eigvalsh(track.covariance) > 0.0)
    assert track.t_last_update == pytest.approx(29.3)


def test_latency_lies_along_the_velocity() -> None:
    tracks = []
    for latency in (0.0, 0.5):
        tracker = AdsbKalmanTracker(AdsbKalmanConfig(latency_sigma_s=latency))
        fly(tracker, np.arange(0.05, 10.0, 1.0).tolist())
        tracks.append(tracker.step(10.0, [])[0][0])
    extra = tracks[1].covariance - tracks[0].covariance
    assert extra[0, 0] == pytest.approx(25.0**2, rel=0.05)
    assert abs(extra[1, 1]) < 1.0


def test_status_from_tentative_to_lost_and_back() -> None:
    tracker = AdsbKalmanTracker(AdsbKalmanConfig())
    seen = []
    for t in (0.5, 1.5, 2.5):
        (track,), _ = tracker.step(t, [scan(t, [(t, "abc123", straight(t))])])
        seen.append(track.status)
    assert seen == [TrackStatus.TENTATIVE, TrackStatus.TENTATIVE, TrackStatus.CONFIRMED]
    (track,), _ = tracker.step(6.0, [])
    assert track.status is TrackStatus.COASTING
    spread = []
    events: tuple[str, ...] = ()
    t = 6.0
    while not events:
        t += 1.0
        tracks, events = tracker.step(t, [])
        spread += [math.sqrt(track.covariance[1, 1]) for track in tracks]
    assert np.all(np.diff(spread) > 0.0)
    assert events == (f"track ABC123 lost: no position for {t - 2.5:.0f} s, uncertainty above 370 m",)
    assert tracks == ()
    assert tracker.counters["track lost"] == 1
    assert fly(tracker, [t + 1.5]) == ["track ABC123 again"]


def test_silence_of_a_tentative_track_ends_it() -> None:
    tracker = AdsbKalmanTracker(AdsbKalmanConfig(bound_min_m=1852.0))
    fly(tracker, [0.5])
    assert tracker.step(14.0, [])[0]
    _, events = tracker.step(16.0, [])
    assert events == ("track ABC123 lost: no position for 16 s",)


def test_one_wild_position_is_rejected() -> None:
    tracker = AdsbKalmanTracker(AdsbKalmanConfig())
    fly(tracker, np.arange(0.5, 10.0).tolist())
    (before,), _ = tracker.step(10.4, [])
    z = (500.0 + 900.0, 900.0, -500.0, 50.0, 0.0, 0.0)
    (after,), events = tracker.step(10.4, [scan(10.4, [(10.3, "abc123", z)])])
    assert events == ()
    assert tracker.counters["position outside the gate"] == 1
    assert np.allclose(before.position, after.position)
    assert after.t_last_update == before.t_last_update


def test_altitude_has_its_own_gate_and_is_taken_anew_when_it_stays() -> None:
    tracker = AdsbKalmanTracker(AdsbKalmanConfig())
    fly(tracker, np.arange(0.5, 10.0).tolist())
    events: list[str] = []
    for k in range(6):
        t = 10.5 + k
        z = (*straight(t)[:2], -2000.0, 50.0, 0.0, 0.0)
        (track,), told = tracker.step(t, [scan(t, [(t, "abc123", z)])])
        events += told
        if k == 0:
            assert track.position[2] == pytest.approx(-500.0, abs=5.0)
            assert track.t_last_update == t
    assert events == ["track ABC123: altitude taken anew after repeated rejections"]
    assert track.position[2] == pytest.approx(-2000.0, abs=30.0)
    assert tracker.counters["altitude outside the gate"] == 5


def test_frozen_position_is_no_new_position() -> None:
    tracker = AdsbKalmanTracker(AdsbKalmanConfig())
    fly(tracker, np.arange(0.5, 10.0).tolist())
    frozen = straight(9.5)
    events: list[str] = []
    statuses = []
    for t in np.arange(10.5, 80.0):
        tracks, told = tracker.step(t, [scan(t, [(t, "abc123", frozen)])])
        events += told
        statuses += [track.status for track in tracks]
    assert TrackStatus.COASTING in statuses
    assert len(events) == 1
    assert "lost: no position for" in events[0]
    assert tracker.counters["position not new"] == 70
    assert fly(tracker, [80.5]) == ["track ABC123 again"]


def test_hovering_is_not_frozen() -> None:
    tracker = AdsbKalmanTracker(AdsbKalmanConfig())
    for t in np.arange(0.5, 60.0):
        tracks, _ = tracker.step(t, [scan(t, [(t, "abc123", (100.0, 200.0, -300.0, 0.5, 0.0, 0.0))])])
    assert tracks[0].status is TrackStatus.CONFIRMED
    assert np.allclose(tracks[0].position, [100.0, 200.0, -300.0], atol=1.0)


def test_swapped_velocity_at_the_start_is_put_right_by_the_second_position() -> None:
    tracker = AdsbKalmanTracker(AdsbKalmanConfig())
    for t in (0.5, 1.5, 2.5, 3.5):
        z = (*straight(t, speed=100.0)[:3], 0.0, 100.0, 0.0)
        (track,), events = tracker.step(t, [scan(t, [(t, "abc123", z)])])
    assert events == ()
    assert np.allclose(track.velocity, [100.0, 0.0, 0.0], atol=5.0)


def test_reported_velocity_is_used_only_when_asked() -> None:
    velocities = []
    for use in (False, True):
        tracker = AdsbKalmanTracker(AdsbKalmanConfig(use_reported_velocity=use))
        for t in np.arange(0.5, 20.0):
            z = (*straight(t)[:3], 50.0, 4.0, 0.0)
            (track,), _ = tracker.step(t, [scan(t, [(t, "abc123", z)])])
        velocities.append(track.velocity[1])
        swapped = (*straight(20.5)[:3], 4.0, 50.0, 0.0)
        tracker.step(20.5, [scan(20.5, [(20.5, "abc123", swapped)])])
        assert tracker.counters.get("north and east velocity swapped", 0) == int(use)
    assert abs(velocities[0]) < 0.2
    assert velocities[1] > 0.3


def test_start_without_reported_velocity() -> None:
    for info in (SourceInfo(category="A1"), SourceInfo()):
        tracker = AdsbKalmanTracker(AdsbKalmanConfig())
        for t in (0.5, 1.5, 2.5, 3.5):
            z = (*straight(t, speed=100.0)[:3], NAN, NAN, NAN)
            (track,), _ = tracker.step(t, [scan(t, [(t, "abc123", z)], info)])
        assert track.status is TrackStatus.CONFIRMED
        assert np.allclose(track.velocity, [100.0, 0.0, 0.0], atol=6.0)


def test_position_and_velocity_in_messages_of_their_own() -> None:
    tracker = AdsbKalmanTracker(AdsbKalmanConfig())
    for t in np.arange(0.5, 12.0):
        p, v = straight(t)[:3], straight(t)[3:]
        rows = [(t - 0.3, "abc123", (NAN, NAN, NAN, *v)), (t, "abc123", (*p, NAN, NAN, NAN))]
        tracks, _ = tracker.step(t, [scan(t, rows)])
    assert np.allclose(tracks[0].velocity, [50.0, 0.0, 0.0], atol=0.5)
    assert tracker.counters["no position yet"] == 1


def test_aircraft_without_altitude_is_counted() -> None:
    tracker = AdsbKalmanTracker(AdsbKalmanConfig())
    tracks, _ = tracker.step(1.5, [scan(1.5, [(1.5, "abc123", (0.0, 0.0, NAN, 50.0, 0.0, 0.0))])])
    assert tracks == ()
    assert tracker.counters["no altitude yet"] == 1


def test_late_reports_change_nothing() -> None:
    rng = np.random.default_rng(8)
    rows = []
    for address, east in (("abc123", 0.0), ("def456", 3000.0)):
        for t in np.arange(0.3, 20.0) + rng.uniform(-0.2, 0.2, 20):
            z = np.array(straight(float(t), east=east))
            z[:3] += rng.normal(size=3) * 4.0
            if rng.random() < 0.1:
                z[0] += 3000.0  # rejected
            rows.append((float(t), address, tuple(z.tolist())))
    rows.sort()
    ordered, shuffled = AdsbKalmanTracker(AdsbKalmanConfig()), AdsbKalmanTracker(AdsbKalmanConfig())
    received = [(t + rng.uniform(0.0, 2.5), (t, address, z)) for t, address, z in rows]
    for t in np.arange(1.0, 24.0):
        ordered.step(t, [scan(t, [row for row in rows if t - 1 < row[0] <= t])])
        shuffled.step(t, [scan(t, [row for at, row in received if t - 1 < at <= t])])
    assert same(ordered.step(24.5, [])[0], shuffled.step(24.5, [])[0])
    late = shuffled.counters.pop("late, put in order", 0)
    a, b = ordered.counters, shuffled.counters
    for counters in (a, b):
        counters.pop("late, put in order", None)
        counters.pop("late", None)
    assert late > 0
    assert a == b


def test_reports_of_one_scan_may_come_in_any_order() -> None:
    rows = [(t, "abc123", straight(t)) for t in (0.5, 1.5, 2.5)]
    a, b = AdsbKalmanTracker(AdsbKalmanConfig()), AdsbKalmanTracker(AdsbKalmanConfig())
    assert same(a.step(3.0, [scan(3.0, rows)])[0], b.step(3.0, [scan(3.0, rows[::-1])])[0])


def test_what_is_too_late_is_counted() -> None:
    tracker = AdsbKalmanTracker(AdsbKalmanConfig())
    fly(tracker, np.arange(0.5, 30.0).tolist())
    (before,), _ = tracker.step(29.6, [])
    (after,), _ = tracker.step(29.6, [scan(29.6, [(22.0, "abc123", straight(22.0))])])
    assert tracker.counters["too late"] == 1
    assert same([before], [after])


def test_two_aircraft_with_one_address() -> None:
    tracker = AdsbKalmanTracker(AdsbKalmanConfig())
    fly(tracker, np.arange(0.5, 10.0).tolist())
    events: list[str] = []
    for k in range(20):
        t = 10.5 + k
        other = (5000.0 - 60.0 * (t - 0.4), 4000.0, -800.0, -60.0, 0.0, 0.0)
        tracks, told = tracker.step(t, [scan(t, [(t - 0.4, "abc123", other), (t, "abc123", straight(t))])])
        events += told
    assert events == ["address ABC123 is used by two aircraft: track ABC123#2 started"]
    first, second = tracks
    assert (first.id, second.id) == ("abc123", "abc123#2")
    assert np.allclose(first.position, straight(29.5)[:3], atol=3.0)
    assert np.allclose(first.velocity, [50.0, 0.0, 0.0], atol=1.0)
    assert np.allclose(second.position, [5000.0 - 60.0 * 29.5, 4000.0, -800.0], atol=3.0)
    assert np.allclose(second.velocity, [-60.0, 0.0, 0.0], atol=2.0)
    assert tracker.counters["position outside the gate"] == 3


def test_a_receiver_clock_that_slips_makes_no_second_aircraft() -> None:
    tracker = AdsbKalmanTracker(AdsbKalmanConfig())
    speed = 220.0
    events: list[str] = []
    for t in np.arange(0.5, 200.0, 0.5):
        slip = 0.7 if t % 48.0 < 2.0 else 0.0  # stamps are late for two seconds
        tracks, told = tracker.step(t, [scan(t, [(t, "abc123", straight(t - slip, speed=speed))])])
        events += told
        assert len(tracks) == 1
    assert not any("two aircraft" in event or "lost" in event for event in events)
    assert tracker.counters["position outside the gate"] > 0
    assert np.allclose(tracks[0].position, straight(199.5, speed=speed)[:3], atol=20.0)


def test_track_starts_again_where_its_positions_agree() -> None:
    tracker = AdsbKalmanTracker(AdsbKalmanConfig())
    fly(tracker, np.arange(0.5, 10.0).tolist())
    events: list[str] = []
    for t in np.arange(10.5, 16.0):
        tracks, told = tracker.step(t, [scan(t, [(t, "abc123", straight(t, north=2000.0))])])
        events += told
    assert events == ["track ABC123 restarted 2000 m from where it was expected after 3 rejected positions that agree"]
    assert np.allclose(tracks[0].position, straight(15.5, north=2000.0)[:3], atol=3.0)
    assert len(tracks) == 1


def test_track_starts_again_after_many_wild_positions() -> None:
    tracker = AdsbKalmanTracker(AdsbKalmanConfig())
    fly(tracker, np.arange(0.5, 10.0).tolist())
    rng = np.random.default_rng(2)
    events: list[str] = []
    for t in np.arange(10.5, 15.0):
        z = (*(rng.uniform(-40e3, 40e3, 2)).tolist(), -500.0, 50.0, 0.0, 0.0)
        tracks, told = tracker.step(t, [scan(t, [(t, "abc123", z)])])
        events += told
    assert len(events) == 1
    assert events[0].endswith("after 5 rejected positions")
    assert np.allclose(tracks[0].position[:2], z[:2])
    assert tracks[0].status is TrackStatus.TENTATIVE


@pytest.mark.parametrize(
    ("t", "z", "variance", "key"),
    [
        (NAN, straight(5.0), 1.0, "time not finite"),
        (math.inf, straight(5.0), 1.0, "time not finite"),
        (9000.0, straight(5.0), 1.0, "time in the future"),
        (-9000.0, straight(5.0), 1.0, "too late"),
        (5.0, (math.inf, 0.0, 0.0, 0.0, 0.0, 0.0), 1.0, "value out of range"),
        (5.0, straight(5.0), NAN, "variance out of range"),
        (5.0, straight(5.0), 0.0, "variance out of range"),
    ],
)
def test_what_cannot_be_used_is_counted(t: float, z: tuple[float, ...], variance: float, key: str) -> None:
    tracker = AdsbKalmanTracker(AdsbKalmanConfig())
    s = scan(5.0, [(t, "abc123", z)])
    s.R[:] *= variance
    assert tracker.step(5.0, [s]) == ((), ())
    assert tracker.counters == {"reports": 1, key: 1}


def test_row_of_nothing_but_nan_is_counted() -> None:
    tracker = AdsbKalmanTracker(AdsbKalmanConfig())
    tracker.step(1.0, [scan(1.0, [(1.0, "abc123", (NAN,) * 6)])])
    assert tracker.counters == {"reports": 1, "no position yet": 1}


def test_jump_back_in_time_drops_all_tracks() -> None:
    tracker = AdsbKalmanTracker(AdsbKalmanConfig())
    fly(tracker, np.arange(7200.5, 7210.0).tolist())
    tracks, events = tracker.step(3600.5, [scan(3600.5, [(3600.5, "abc123", straight(3600.5))])])
    assert events == ("time went back by 3609 s: 1 tracks dropped", "track ABC123 started")
    assert tracks[0].t == 3600.5


def test_jump_forward_loses_the_track() -> None:
    tracker = AdsbKalmanTracker(AdsbKalmanConfig())
    fly(tracker, np.arange(0.5, 10.0).tolist())
    tracks, events = tracker.step(10809.5, [])
    assert tracks == ()
    assert events == ("track ABC123 lost: no position for 10800 s, uncertainty above 370 m",)
    assert math.isfinite(float(tracker.nis["position"][1]))


def test_time_must_be_finite() -> None:
    with pytest.raises(ValueError, match="not finite"):
        AdsbKalmanTracker(AdsbKalmanConfig()).step(NAN, [])


def test_other_scans_are_counted() -> None:
    tracker = AdsbKalmanTracker(AdsbKalmanConfig())
    empty = Scan(0.0, 0.0, "radar", "radar", np.zeros((0, 3)), np.zeros((0, 3, 3)), np.zeros(0))
    assert tracker.step(0.0, [empty]) == ((), ())
    assert tracker.counters == {"scan of another kind": 1}


def test_reported_categories_change_the_covariance_and_the_bound() -> None:
    sizes = []
    for info in (SourceInfo(nacp=10), SourceInfo(), SourceInfo(nacp=15), SourceInfo(nacp=6)):
        tracker = AdsbKalmanTracker(AdsbKalmanConfig())
        for t in np.arange(0.5, 10.0):
            (track,), _ = tracker.step(t, [scan(t, [(t, "abc123", straight(t))], info)])
        sizes.append(track.covariance[1, 1])
    assert sizes[0] < sizes[1] < sizes[3]
    assert sizes[1] == pytest.approx(sizes[2])  # 15 is reserved: as if it had not been said


def test_step_length_does_not_matter() -> None:
    rows = [(float(t), "abc123", straight(float(t))) for t in np.arange(0.33, 20.0)]
    results = []
    for dt in (0.1, 1.0, 5.0):
        tracker = AdsbKalmanTracker(AdsbKalmanConfig())
        for k in range(1, round(20.0 / dt) + 1):
            t = k * dt
            tracks, _ = tracker.step(t, [scan(t, [row for row in rows if t - dt < row[0] <= t])])
        results.append(tracks)
    assert same(results[0], results[1])
    assert same(results[0], results[2])


def test_many_tracks_and_freed_slots() -> None:
    tracker = AdsbKalmanTracker(AdsbKalmanConfig())
    for round_ in range(3):
        base = 200.0 * round_
        for t in (base + 0.5, base + 1.5, base + 2.5):
            rows = [(t, f"{k:06x}", straight(t, east=100.0 * k)) for k in range(100)]
            tracks, _ = tracker.step(t, [scan(t, rows)])
        assert len(tracks) == 100
        assert all(np.allclose(track.position, straight(t, east=100.0 * k)[:3]) for k, track in enumerate(tracks))
    assert tracker.counters["track lost"] == 200
    assert tracker.counters["track started"] == 300
