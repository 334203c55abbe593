"""The ADS-B error model against its stated distributions.

Statistical tests use fixed seeds and reject at p < 1e-5 each: a right model under another seed fails one of them with a
probability below 1e-3 altogether.
"""

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from pydantic import ValidationError
from scipy import stats

from tests.naive import adsb as naive
from wideberth.sensors.adsb import kernels
from wideberth.sensors.adsb.config import AdsbErrorConfig
from wideberth.sensors.adsb.simulated import SimulatedAdsb, error_parameters
from wideberth.units import FOOT, FOOT_PER_MINUTE, KNOT, NAUTICAL_MILE

FloatArray = NDArray[np.float64]
P = 1e-5
EXACT: dict[str, Any] = {
    "position_resolution_m": 0.0,
    "pressure_altitude_resolution_ft": 0.0,
    "geometric_altitude_resolution_ft": 0.0,
    "velocity_resolution_kt": 0.0,
    "climb_rate_resolution_ft_per_min": 0.0,
    "latency_s": 0.0,
    "uncompensated_latency_s": 0.0,
    "loss_1090": 0.0,
    "loss_978": 0.0,
    "velocity_swap_probability": 0.0,
}


def addresses(n: int) -> list[str]:
    return [f"{k:06x}" for k in range(n)]


def collect(
    config: AdsbErrorConfig, n: int, seconds: int, velocity: tuple[float, float, float] = (0.0, 0.0, 0.0), seed: int = 1
) -> tuple[FloatArray, FloatArray, NDArray[np.int64], SimulatedAdsb]:
    """Return errors (m, 6), times, aircraft of all messages of aircraft that fly straight on from the origin."""
    sensor = SimulatedAdsb(config, seed, addresses(n))
    v = np.tile(velocity, (n, 1)).astype(float)
    errors, times, index = [], [], []
    for t in range(seconds):
        scan = sensor.sense(float(t), v * t, v, np.asarray(velocity) * t)
        errors.append(scan.z - np.concatenate([scan.t_valid[:, None] * v[0], np.tile(v[0], (len(scan.z), 1))], axis=1))
        times.append(scan.t_valid)
        index.append([int(a, 16) for a in scan.source_ids])
    return np.concatenate(errors), np.concatenate(times), np.concatenate(index).astype(np.int64), sensor


def normal(values: FloatArray, sigma: float) -> bool:
    return bool(stats.kstest(values, stats.norm(0.0, sigma).cdf).pvalue > P)


def fraction(count: int, n: int, p: float) -> bool:
    return bool(stats.binomtest(count, n, p).pvalue > P)


def test_stationary_position_error_from_nacp() -> None:
    errors, _, index, _ = collect(AdsbErrorConfig(**EXACT), 2000, 1)
    errors = errors[np.unique(index, return_index=True)[1]]
    for axis in range(2):
        assert normal(errors[:, axis], 124.12 * FOOT)
    assert fraction(int(np.sum(np.hypot(*errors[:, :2].T) < 0.05 * NAUTICAL_MILE)), len(errors), 0.95)


def test_position_error_started_at_zero() -> None:
    errors, times, index, _ = collect(AdsbErrorConfig(**EXACT, start="zero"), 300, 40)
    first, last = errors[times < 0.0], errors[times > 38.0]
    assert np.std(first[:, :2]) < 8.0 * FOOT
    t = np.mean(times[times > 38.0]) + 0.5
    sigma = 124.12 * FOOT * math.sqrt(1 - math.exp(-2 * t / 1100.0))
    _, pick = np.unique(index[times > 38.0], return_index=True)
    variance = np.sum(last[pick, :2] ** 2) / sigma**2
    assert stats.chi2.cdf(variance, 2 * len(pick)) == pytest.approx(0.5, abs=0.5 - P)


def test_position_error_moves_528_ft_a_second() -> None:
    errors, times, index, _ = collect(AdsbErrorConfig(**EXACT, interval_jitter_s=0.0), 50, 100)
    order = np.lexsort((times, index))
    e, i = errors[order, :2], index[order]
    same = i[1:] == i[:-1]
    moved = (e[1:] - math.exp(-1 / 1100.0) * e[:-1])[same]
    assert normal(moved.ravel(), 5.28 * FOOT * 124.12 / 124.0)


def test_velocity_error_from_nacv() -> None:
    errors, _, _, _ = collect(AdsbErrorConfig(**EXACT), 100, 60, (40.0, -30.0, 0.0))
    for axis in (3, 4):
        assert normal(errors[:, axis], 7.942 * KNOT)
    assert fraction(int(np.sum(np.hypot(*errors[:, 3:5].T) < 10.0)), len(errors), 0.95)


@pytest.mark.parametrize(("kind", "sigma"), [("pressure", 75.9), ("geometric", 89.8)])
def test_altitude_error(kind: Any, sigma: float) -> None:
    errors, _, index, _ = collect(AdsbErrorConfig(**EXACT, altitude_kind=kind), 100, 30)
    assert normal(errors[:, 2], sigma * FOOT)
    errors, _, index, _ = collect(AdsbErrorConfig(**EXACT, altitude_kind=kind, altitude_error="bias"), 1500, 2)
    _, pick = np.unique(index, return_index=True)
    assert normal(errors[pick, 2], sigma * FOOT)
    for i in range(5):
        assert np.ptp(errors[index == i, 2]) < 1e-9


@pytest.mark.parametrize(
    ("climb", "sigma"), [(0.0, 27.96), (-499.0, 27.96), (501.0, 501 * 0.05 / 1.645), (2000.0, 2000 * 0.05 / 1.645)]
)
def test_climb_rate_error_has_two_regimes(climb: float, sigma: float) -> None:
    errors, _, _, _ = collect(AdsbErrorConfig(**EXACT), 100, 30, (0.0, 0.0, -climb * FOOT_PER_MINUTE))
    assert normal(errors[:, 5], sigma * FOOT_PER_MINUTE)


def test_categories_set_the_errors() -> None:
    config = AdsbErrorConfig(**EXACT, nacp=10, nacv=3, nic=10)
    errors, _, _, sensor = collect(config, 1500, 1)
    assert normal(errors[:, 0], 10.0 / 2.4477)
    assert normal(errors[:, 3], 1.0 / 2.4477)
    info = sensor.sense(1.0, np.zeros((1500, 3)), np.zeros((1500, 3)), np.zeros(3)).sources[0]
    assert (info.nacp, info.nacv, info.nic, info.sil, info.sda) == (10, 3, 10, 3, 2)


def test_resolution_of_the_encoding() -> None:
    sensor = SimulatedAdsb(AdsbErrorConfig(), 3, addresses(200))
    scan = sensor.sense(0.0, np.zeros((200, 3)), np.zeros((200, 3)), np.zeros(3))
    for column, step in ((0, 5.0), (1, 5.0), (2, 25 * FOOT), (3, KNOT), (4, KNOT), (5, 64 * FOOT_PER_MINUTE)):
        multiples = scan.z[:, column] / step
        assert np.allclose(multiples, np.rint(multiples), atol=1e-6)
        assert len(np.unique(np.rint(multiples))) > 2
    geometric = SimulatedAdsb(AdsbErrorConfig(altitude_kind="geometric"), 3, addresses(200))
    z = geometric.sense(0.0, np.zeros((200, 3)), np.zeros((200, 3)), np.zeros(3)).z[:, 2] / (45 * FOOT)
    assert np.allclose(z, np.rint(z), atol=1e-6)


@pytest.mark.parametrize(("total", "uncompensated"), [(0.6, 0.6), (2.0, 0.6), (1.0, 0.0)])
def test_latency(total: float, uncompensated: float) -> None:
    quiet = {**EXACT, "latency_s": total, "uncompensated_latency_s": uncompensated}
    config = AdsbErrorConfig(
        **quiet, nacp=11, pressure_altitude_sigma_ft=0.0, climb_rate_sigma_ft_per_min=0.0, climb_rate_fraction_95=0.0
    )
    errors, _, _, _ = collect(config, 300, 5, (80.0, 0.0, -5.0))
    assert np.mean(errors[:, 0]) == pytest.approx(-80.0 * uncompensated, abs=0.5)
    assert np.allclose(errors[:, 2], 5.0 * total)


@pytest.mark.parametrize(("link", "loss"), [("1090", 0.15), ("978", 0.10)])
def test_loss_by_link(link: Any, loss: float) -> None:
    _, _, _, sensor = collect(AdsbErrorConfig(link=link), 100, 100)
    c = sensor.counters
    assert c["received"] + c["lost"] == c["broadcasts"]
    assert fraction(c["lost"], c["broadcasts"], loss)


def test_integrity_errors_lie_beyond_the_nic_bound() -> None:
    config = AdsbErrorConfig(**EXACT, sil=1, sda=3, nacp=11, gross_error_scale=20.0)
    errors, _, _, sensor = collect(config, 100, 100)
    wrong = np.hypot(*errors[:, :2].T) > 200.0
    assert fraction(int(np.sum(wrong)), len(errors), 20.0 * 1e-3)
    assert sensor.counters["gross errors"] == np.sum(wrong)
    size = np.hypot(*errors[wrong, :2].T)
    assert size.min() > 370.4 - 10.0
    assert size.max() < 3 * 370.4 + 10.0


def test_integrity_errors_per_hour() -> None:
    rate = error_parameters(AdsbErrorConfig(sil=2, sil_per="hour"))[kernels.SIL_PROBABILITY]
    assert rate == pytest.approx(1e-5 / 3600)
    assert error_parameters(AdsbErrorConfig())[kernels.SIL_PROBABILITY] == pytest.approx(1e-7)


def test_system_faults_last_and_stay_in_place() -> None:
    config = AdsbErrorConfig(**EXACT, sda=1, nacp=11, gross_error_scale=3600.0, gross_error_duration_s=5.0)
    errors, times, index, _ = collect(config, 200, 100)
    wrong = np.hypot(*errors[:, :2].T) > 200.0
    order = np.lexsort((times, index))
    i, w = index[order], wrong[order]
    begins = w & ~np.r_[False, w[:-1] & (i[1:] == i[:-1])]
    chances = int(np.sum(~w) + np.sum(begins))
    assert fraction(int(np.sum(begins)), chances, 1e-3)
    k = int(np.flatnonzero(begins)[0])
    run = errors[order][k : k + 5]
    assert np.all(np.hypot(*run[:, :2].T) > 360.0)
    assert np.max(np.ptp(run[:, :2], axis=0)) < 20.0


def test_velocities_are_swapped_now_and_then() -> None:
    config = AdsbErrorConfig(**{**EXACT, "velocity_swap_probability": 0.02})
    errors, _, _, sensor = collect(config, 100, 60, (100.0, 0.0, 0.0))
    swapped = errors[:, 3] < -50.0
    assert fraction(int(np.sum(swapped)), len(errors), 0.02)
    assert sensor.counters["velocities swapped"] == np.sum(swapped)


def test_each_aircraft_has_its_own_phase() -> None:
    _, times, index, _ = collect(AdsbErrorConfig(**EXACT), 1000, 4)
    first = times[np.unique(index, return_index=True)[1]]
    assert stats.kstest(np.mod(first, 1.0), stats.uniform.cdf).pvalue > P
    gaps = np.concatenate([np.diff(times[index == i]) for i in range(200)])
    assert np.all(np.abs(gaps - 1.0) <= 0.1)
    assert np.std(gaps) == pytest.approx(0.05 * math.sqrt(2 / 3), rel=0.15)


@pytest.mark.parametrize(("power", "nmi"), [("A0", 10.0), ("A1", 20.0), ("A2", 40.0), ("A3", 90.0)])
def test_range_by_power_class(power: Any, nmi: float) -> None:
    sensor = SimulatedAdsb(AdsbErrorConfig(**EXACT, power_class=power), 1, addresses(2))
    p = np.array([[(nmi - 0.1) * NAUTICAL_MILE, 0.0, 0.0], [0.0, (nmi + 0.1) * NAUTICAL_MILE, 0.0]])
    heard = [a for t in range(10) for a in sensor.sense(float(t), p, np.zeros((2, 3)), np.zeros(3)).source_ids]
    assert set(heard) == {"000000"}
    assert len(heard) in (9, 10, 11)
    assert sensor.counters["out of range"] in (9, 10, 11)


def test_noise_depends_on_neither_the_others_nor_the_steps() -> None:
    p = np.array([[1000.0, 0.0, -500.0], [0.0, 2000.0, -300.0], [3000.0, 0.0, 0.0]])
    v = np.array([[50.0, 10.0, 1.0], [-60.0, 0.0, 0.0], [0.0, 30.0, 0.0]])

    def reports(ids: list[str], pick: list[int], dt: float) -> dict[tuple[str, float], tuple[float, ...]]:
        sensor = SimulatedAdsb(AdsbErrorConfig(), 7, ids)
        found = {}
        for k in range(round(20.0 / dt) + 1):
            t = k * dt
            scan = sensor.sense(t, p[pick] + v[pick] * t, v[pick], np.zeros(3))
            for address, time, z in zip(scan.source_ids, scan.t_valid, scan.z, strict=True):
                found[address, round(float(time), 9)] = tuple(np.round(z, 6))
        return found

    everything = reports(["aaaaaa", "bbbbbb", "cccccc"], [0, 1, 2], 1.0)
    assert len(everything) > 40
    assert reports(["cccccc", "aaaaaa", "bbbbbb"], [2, 0, 1], 1.0) == everything
    assert reports(["aaaaaa", "bbbbbb", "cccccc"], [0, 1, 2], 0.1) == everything
    assert reports(["aaaaaa", "bbbbbb", "cccccc"], [0, 1, 2], 5.0) == everything
    alone = reports(["bbbbbb"], [1], 1.0)
    assert alone == {key: z for key, z in everything.items() if key[0] == "bbbbbb"}
    other = SimulatedAdsb(AdsbErrorConfig(), 8, ["bbbbbb"]).sense(0.0, p[1:2], v[1:2], np.zeros(3))
    assert not set(other.t_valid.tolist()) & {key[1] for key in alone}


def test_two_aircraft_with_one_address_have_noise_of_their_own() -> None:
    sensor = SimulatedAdsb(AdsbErrorConfig(**EXACT), 1, ["aaaaaa", "aaaaaa"])
    scan = sensor.sense(0.0, np.zeros((2, 3)), np.zeros((2, 3)), np.zeros(3))
    assert scan.source_ids == ("aaaaaa", "aaaaaa")
    assert scan.t_valid[0] != scan.t_valid[1]


def test_aircraft_that_are_not_there_send_nothing() -> None:
    sensor = SimulatedAdsb(AdsbErrorConfig(**EXACT), 1, addresses(2))
    p = np.array([[0.0, 0.0, 0.0], [np.nan] * 3])
    counts = []
    for t in range(6):
        if t == 3:
            p = p[::-1]
        scan = sensor.sense(float(t), p, np.zeros((2, 3)), np.zeros(3))
        assert np.all(np.isfinite(scan.z))
        counts.append(scan.source_ids)
    assert counts == [("000000",)] * 3 + [("000001",)] * 3


def test_health_and_empty_scan() -> None:
    sensor = SimulatedAdsb(AdsbErrorConfig(**EXACT), 1, addresses(4))
    assert math.isinf(sensor.health(0.0).age)
    far = np.full((4, 3), 1e6)
    scan = sensor.sense(0.0, far, np.zeros((4, 3)), np.zeros(3))
    assert scan.z.shape == (0, 6)
    assert scan.R.shape == (0, 6, 6)
    assert sensor.counters["broadcasts"] == sensor.counters["out of range"] > 0
    for t in range(1, 21):
        sensor.sense(float(t), np.zeros((4, 3)), np.zeros((4, 3)), np.zeros(3))
    health = sensor.health(20.0)
    assert health.age < 1.1
    assert health.rate == pytest.approx(4.0, abs=0.5)
    assert health.rejects["out of range"] == sensor.counters["out of range"]
    assert health.state == "ok"


def test_bad_calls_are_refused() -> None:
    sensor = SimulatedAdsb(AdsbErrorConfig(), 1, addresses(2))
    zero = np.zeros((2, 3))
    sensor.sense(5.0, zero, zero, np.zeros(3))
    with pytest.raises(ValueError, match="before the last"):
        sensor.sense(4.0, zero, zero, np.zeros(3))
    with pytest.raises(ValueError, match="finite"):
        sensor.sense(math.nan, zero, zero, np.zeros(3))
    with pytest.raises(ValueError, match="shape"):
        sensor.sense(6.0, zero[:1], zero, np.zeros(3))
    for wrong in ({"uncompensated_latency_s": 1.0}, {"interval_jitter_s": 0.5}, {"nacp": 12}, {"latency_s": 3.0}):
        with pytest.raises(ValidationError):
            AdsbErrorConfig(**wrong)


def test_truth_between_states_equals_its_twin() -> None:
    rng = np.random.default_rng(6)
    for t in (-0.7, 0.0, 0.3, 0.999, 1.0, 1.2):
        states = [rng.normal(size=3) * 100.0 for _ in range(4)]
        for first in (states[0], np.full(3, np.nan)):
            position, velocity = np.empty(3), np.empty(3)
            v0, p1, v1 = states[1:]
            kernels.truth_at(t, 0.0, 1.0, first, v0, p1, v1, position, velocity)
            expected = naive.truth(t, 0.0, 1.0, first, v0, p1, v1)
            assert np.allclose(position, expected[0], atol=1e-9)
            assert np.allclose(velocity, expected[1], atol=1e-9)


def test_report_equals_its_twin() -> None:
    rng = np.random.default_rng(7)
    params = error_parameters(AdsbErrorConfig())
    for swapped in (False, True):
        for _ in range(50):
            position, velocity = rng.normal(size=3) * 1000.0, rng.normal(size=3) * [50.0, 50.0, 4.0]
            error, gross, n = rng.normal(size=2) * 40.0, rng.normal(size=2) * 500.0, rng.normal(size=6)
            z = np.empty(6)
            kernels.report_state(position, velocity, error, 0.0, gross, swapped, n, params, z)
            assert np.allclose(z, naive.report(position, velocity, error, gross, swapped, n), atol=1e-9)


def test_callsigns_and_health_travel_with_the_scan():
    sensor = SimulatedAdsb(AdsbErrorConfig(**EXACT), 1, ["aaaaaa", "bbbbbb"], ["HEADON", None])
    p, v = np.array([[1000.0, 0.0, -500.0], [2000.0, 0.0, -500.0]]), np.zeros((2, 3))
    scan = sensor.sense(0.0, p, v, np.zeros(3))
    named = dict(zip(scan.source_ids, (info.callsign for info in scan.sources), strict=True))
    assert named == {"aaaaaa": "HEADON", "bbbbbb": None}
    assert scan.health == sensor.health(0.0)
    assert scan.health.state == "ok" and scan.health.age < 1.0
    with pytest.raises(ValueError, match="1 callsigns for 2 addresses"):
        SimulatedAdsb(AdsbErrorConfig(), 1, ["aaaaaa", "bbbbbb"], ["HEADON"])
