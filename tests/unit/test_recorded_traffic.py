"""Recorded traffic as truth: a known flight with each fault of real recordings put in."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.naive import vehicles as naive
from wideberth.frames import LocalFrame
from wideberth.sensors.adsb.report import AdsbReport
from wideberth.simulation.kernels import states_at, states_at_many
from wideberth.simulation.recorded import RecordedTraffic

FRAME = LocalFrame(math.radians(48.7), math.radians(2.3))
T0 = 1_633_608_000.0
SPEED, CLIMB = 80.0, 5.0


def position(t: float) -> tuple[float, float, float]:
    """Flies east at 80 m/s, climbs with 5 m/s from 500 m."""
    lat, lon, alt = FRAME.to_geodetic(np.array([2000.0, -4000.0 + SPEED * t, -500.0 - CLIMB * t]))
    return float(lat), float(lon), float(alt)


def report(t: float, address: str = "abc123") -> AdsbReport:
    lat, lon, alt = position(t)
    north, east, _ = FRAME.velocity_from_ned(lat, lon, [0.0, SPEED, 0.0])
    return AdsbReport(T0 + t, address, lat, lon, alt, alt + 40.0, float(north), float(east), CLIMB)


def flight(n: int = 120, change: Callable[[float, AdsbReport], AdsbReport | None] | None = None) -> list[AdsbReport]:
    reports = [report(float(k)) for k in range(n)]
    if change is None:
        return reports
    return [r for k, r in enumerate(change(float(k), r) for k, r in enumerate(reports)) if r is not None]


def error(traffic: RecordedTraffic, t: float) -> NDArray[np.float64]:
    truth = traffic.truth(T0 + t)
    assert truth.ids == ("abc123",)
    expected = np.array([2000.0, -4000.0 + SPEED * t, -500.0 - CLIMB * t])
    difference: NDArray[np.float64] = truth.positions[0] - expected
    return difference


def absent(traffic: RecordedTraffic, t: float) -> bool:
    truth = traffic.truth(T0 + t)
    return truth.ids == () and truth.positions.shape == (0, 3)


def test_clean_flight_is_given_back() -> None:
    traffic = RecordedTraffic(flight(), FRAME)
    for t in (0.0, 0.4, 30.0, 77.77, 119.0):
        assert np.abs(error(traffic, t)).max() < 0.1
        assert np.allclose(traffic.truth(T0 + t).velocities, [[0.0, SPEED, -CLIMB]], atol=1e-6)
    assert absent(traffic, -0.1) and absent(traffic, 119.1)
    assert (traffic.t_start, traffic.t_end) == (T0, T0 + 119)


def test_order_of_the_reports_does_not_matter() -> None:
    reports = flight()
    shuffled = [reports[i] for i in np.random.default_rng(1).permutation(len(reports))]
    a, b = (RecordedTraffic(r, FRAME).truth(T0 + 55.5) for r in (reports, shuffled))
    assert np.array_equal(a.positions, b.positions) and np.array_equal(a.velocities, b.velocities)


def test_short_freeze_is_bridged() -> None:
    frozen = report(40.0)
    traffic = RecordedTraffic(flight(change=lambda t, r: replace(frozen, t=r.t) if 40 < t <= 60 else r), FRAME)
    assert traffic.counters["repeated positions"] == 20
    assert np.abs(error(traffic, 50.0)).max() < 0.5


def test_aircraft_is_absent_in_a_long_freeze() -> None:
    frozen = report(30.0)
    traffic = RecordedTraffic(flight(change=lambda t, r: replace(frozen, t=r.t) if 30 < t <= 80 else r), FRAME)
    assert traffic.counters["gaps"] == 1
    assert absent(traffic, 30.5) and absent(traffic, 55.0) and absent(traffic, 80.5)
    assert np.abs(error(traffic, 29.0)).max() < 0.5 and np.abs(error(traffic, 82.0)).max() < 0.5
    shorter = RecordedTraffic(flight(change=lambda t, r: replace(frozen, t=r.t) if 30 < t <= 80 else r), FRAME, 60.0)
    assert np.abs(error(shorter, 55.0)).max() < 0.5


def test_hovering_is_no_freeze() -> None:
    still = replace(report(10.0), velocity_north=0.5, velocity_east=0.0, climb_rate=0.0)
    traffic = RecordedTraffic([replace(still, t=T0 + k) for k in range(100)], FRAME)
    assert traffic.counters["repeated positions"] == 0
    assert traffic.truth(T0 + 50.3).ids == ("abc123",)


def test_altitude_spikes_are_left_out_and_real_climbs_kept() -> None:
    def spiked(t: float, r: AdsbReport) -> AdsbReport:
        high = {0.0, 20.0, 50.0, 51.0, 52.0, 90.0, 119.0}
        return replace(r, pressure_altitude=r.pressure_altitude + (8000.0 if t in high else 0.0))

    traffic = RecordedTraffic(flight(change=spiked), FRAME)
    assert traffic.counters["altitude spikes"] == 7
    assert max(abs(error(traffic, t)[2]) for t in np.arange(1.0, 118.0, 0.5)) < 2.5

    def zoom(t: float, r: AdsbReport) -> AdsbReport:  # 14 m/s up, then down, within 20 s
        return replace(r, pressure_altitude=500.0 + 14.0 * max(0.0, 10.0 - abs(t - 60.0)), climb_rate=math.nan)

    traffic = RecordedTraffic(flight(change=zoom), FRAME)
    assert traffic.truth(T0 + 60.0).positions[0, 2] < -620.0
    assert traffic.truth(T0 + 55.0).velocities[0, 2] == pytest.approx(-14.0, abs=0.5)


def test_rows_without_altitude_take_it_from_their_neighbours() -> None:
    def bare(t: float, r: AdsbReport) -> AdsbReport:
        return replace(r, pressure_altitude=math.nan, geometric_altitude=math.nan) if 20 <= t < 35 else r

    traffic = RecordedTraffic(flight(change=bare), FRAME)
    assert abs(error(traffic, 27.0)[2]) < 0.5


def test_geometric_altitude_only_where_there_is_no_pressure_altitude() -> None:
    traffic = RecordedTraffic(flight(change=lambda t, r: replace(r, pressure_altitude=math.nan)), FRAME)
    assert error(traffic, 50.0)[2] == pytest.approx(-40.0, abs=0.1)
    mixed = flight(change=lambda t, r: replace(r, pressure_altitude=math.nan) if t % 2 else r)
    assert abs(error(RecordedTraffic(mixed, FRAME), 51.0)[2]) < 0.1


def test_aircraft_without_any_altitude_is_counted_and_absent() -> None:
    nothing = flight(change=lambda t, r: replace(r, pressure_altitude=math.nan, geometric_altitude=math.nan))
    traffic = RecordedTraffic(nothing, FRAME)
    assert traffic.counters["positions without altitude"] == 120
    assert traffic.counters["aircraft without a usable flight"] == 1
    assert absent(traffic, 50.0) and traffic.ids == ()


def test_surface_reports_are_left_out() -> None:
    traffic = RecordedTraffic(flight(change=lambda t, r: replace(r, on_ground=t < 40)), FRAME)
    assert traffic.counters["on the ground"] == 40
    assert absent(traffic, 20.0) and np.abs(error(traffic, 41.0)).max() < 0.5


def test_single_far_position_is_left_out() -> None:
    def thrown(t: float, r: AdsbReport) -> AdsbReport:
        return replace(r, latitude=r.latitude + 0.01) if t == 60 else r

    traffic = RecordedTraffic(flight(change=thrown), FRAME)
    assert traffic.counters["position outliers"] == 1
    assert np.abs(error(traffic, 60.0)).max() < 0.5


def test_jump_cuts_the_flight() -> None:
    def moved(t: float, r: AdsbReport) -> AdsbReport:
        return replace(r, latitude=r.latitude + 0.01) if t >= 60 else r

    traffic = RecordedTraffic(flight(change=moved), FRAME)
    assert traffic.counters["position jumps"] == 1
    assert absent(traffic, 59.5)
    assert np.abs(error(traffic, 58.0)).max() < 0.5
    assert traffic.truth(T0 + 60.0).positions[0, 0] > 60_000


def test_two_aircraft_with_one_address_are_never_joined() -> None:
    def moved(t: float, r: AdsbReport) -> AdsbReport:
        return replace(r, latitude=r.latitude + 0.01) if t % 2 else r

    traffic = RecordedTraffic(flight(change=moved), FRAME)
    for t in np.arange(0.0, 119.0, 0.5):
        truth = traffic.truth(T0 + t)
        if truth.ids:  # then at one of the two, not between
            assert min(abs(truth.positions[0, 0] - 2000.0), abs(truth.positions[0, 0] - 65_700.0)) < 1500.0
    assert traffic.counters["position jumps"] + traffic.counters["position outliers"] > 50


def test_jitter_of_the_times_is_smoothed_within_its_bound() -> None:
    late = np.random.default_rng(3).uniform(0.0, 0.4, 200)

    def jittered(t: float, r: AdsbReport) -> AdsbReport:
        lat, lon, alt = position(t - late[int(t)])
        return replace(r, latitude=lat, longitude=lon, pressure_altitude=alt)

    reports = flight(200, jittered)
    traffic = RecordedTraffic(reports, FRAME)
    raw = FRAME.to_ned([r.latitude for r in reports], [r.longitude for r in reports], 0.0)
    moved, east = [], []
    for k, r in enumerate(reports):
        p = traffic.truth(r.t).positions[0]
        moved.append(math.dist(p[:2], raw[k, :2]))
        east.append(p[1])
    assert 1.0 < max(moved) <= 20.0 + 1e-6
    # Steps agree with the velocity far better than the raw ones do.
    assert np.std(np.diff(east)) < 0.4 * np.std(np.diff(raw[:, 1]))


def test_positions_and_velocities_in_different_messages() -> None:
    def split(t: float, r: AdsbReport) -> AdsbReport:
        if t % 2:
            return replace(r, latitude=math.nan, longitude=math.nan, pressure_altitude=math.nan)
        return replace(r, velocity_north=math.nan, velocity_east=math.nan, climb_rate=math.nan)

    traffic = RecordedTraffic(flight(change=split), FRAME)
    assert np.abs(error(traffic, 61.0)).max() < 0.5
    assert np.allclose(traffic.truth(T0 + 61.0).velocities, [[0.0, SPEED, -CLIMB]], atol=1e-3)


def test_velocity_from_positions_where_none_is_reported() -> None:
    def bare(t: float, r: AdsbReport) -> AdsbReport:
        return replace(r, velocity_north=math.nan, velocity_east=math.nan, climb_rate=math.nan)

    traffic = RecordedTraffic(flight(change=bare), FRAME)
    for t in (0.0, 3.3, 60.0, 119.0):
        assert np.allclose(traffic.truth(T0 + t).velocities, [[0.0, SPEED, -CLIMB]], atol=0.01)


def test_nothing_recorded_is_an_empty_sky() -> None:
    traffic = RecordedTraffic([], FRAME)
    assert absent(traffic, 0.0) and math.isnan(traffic.t_start)
    assert traffic.truth_many(np.array([0.0, 1.0])).shape == (2, 0, 6)


def test_bad_gap_is_refused() -> None:
    with pytest.raises(ValueError, match="max_gap_s"):
        RecordedTraffic([], FRAME, 0.0)


def test_many_times_equal_single_ones() -> None:
    two = flight() + [replace(report(k, "00beef"), t=T0 + 3 * k) for k in np.arange(20.0)]
    traffic = RecordedTraffic(two, FRAME)
    times = T0 + np.arange(-5.0, 130.0, 0.7)
    many = traffic.truth_many(times)
    seen = 0
    for k, t in enumerate(times):
        truth = traffic.truth(t)
        present = [traffic.ids[i] for i in np.flatnonzero(np.isfinite(many[k, :, 0]))]
        assert sorted(present) == sorted(truth.ids)
        for name, p, v in zip(truth.ids, truth.positions, truth.velocities, strict=True):
            assert np.allclose(many[k, traffic.ids.index(name)], np.concatenate([p, v]), rtol=0, atol=1e-9)
            seen += 1
    assert seen > 200
    with pytest.raises(ValueError, match="rise"):
        traffic.truth_many(times[::-1])


def test_look_up_equals_its_naive_twin() -> None:
    random = np.random.default_rng(5)
    segments = []
    for s in range(12):
        times = np.sort(random.uniform(0, 100, int(random.integers(2, 9)))) + 100.0 * (s % 3)
        segments.append((s // 3, times, random.normal(0, 100, (len(times), 6))))
    offsets = np.cumsum([0, *(len(t) for _, t, _ in segments)])
    aircraft = np.array([a for a, _, _ in segments])
    times = np.concatenate([t for _, t, _ in segments])
    states = np.concatenate([x for _, _, x in segments])
    at = np.concatenate([np.linspace(-5, 305, 400), times])
    at.sort()
    many = np.empty((len(at), 4, 6))
    states_at_many(at, offsets, aircraft, times, states, many)
    out, present = np.empty((12, 6)), np.empty(12, np.int64)
    for k, t in enumerate(at):
        expected = naive.states_at(t, segments)
        count = states_at(t, offsets, aircraft, times, states, out, present)
        assert set(present[:count].tolist()) == set(expected)
        for i in range(count):
            assert np.allclose(out[i], expected[int(present[i])])
        for a in range(4):
            assert (a in expected) == bool(np.isfinite(many[k, a]).all())
            if a in expected:
                assert np.allclose(many[k, a], expected[a])
