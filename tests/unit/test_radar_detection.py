"""Detection probabilities: against sampling, quadrature and values of the textbooks."""

import math

import numpy as np
import pytest
from scipy import integrate, special, stats

from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.detection import detection_probability, required_snr_db, threshold
from wideberth.sensors.radar.link_budget import migration_loss_db

SAMPLES = 100_000


def cross_sections(swerling: int, rng: np.random.Generator) -> np.ndarray:
    """Cross-sections of mean 1."""
    drawn = {0: np.ones(SAMPLES), 1: rng.exponential(size=SAMPLES), 3: rng.gamma(2.0, 0.5, SAMPLES)}
    return drawn[swerling]


@pytest.mark.parametrize("swerling", [0, 1, 3])
@pytest.mark.parametrize("looks", [1, 4, 32])
@pytest.mark.parametrize("snr_db", [-10.0, 0.0, 8.0])
def test_against_sampled_voltages(swerling, looks, snr_db):
    rng = np.random.default_rng([swerling, looks, int(snr_db) + 100])
    amplitude = np.sqrt(10 ** (snr_db / 10) * cross_sections(swerling, rng))
    power = np.zeros(SAMPLES)
    for _ in range(looks):
        i, q = rng.normal(scale=math.sqrt(0.5), size=(2, SAMPLES))
        power += (i + amplitude) ** 2 + q**2
    for p_fa in (0.01, 0.001):
        expected = detection_probability(snr_db, p_fa, swerling, looks=looks)
        sampled = np.mean(power / looks > threshold(p_fa, looks))
        assert sampled == pytest.approx(expected, abs=4.5 * math.sqrt(expected * (1 - expected) / SAMPLES) + 1e-5)


@pytest.mark.parametrize("looks", [1, 4, 128])
def test_the_false_alarm_rate_is_what_was_asked_for(looks):
    rng = np.random.default_rng(looks)
    power = rng.gamma(looks, 1.0 / looks, 1_000_000)
    assert np.mean(power > threshold(0.01, looks)) == pytest.approx(0.01, abs=5e-4)


def test_the_exponential_threshold_holds_for_one_look_only():
    assert threshold(0.01) == pytest.approx(math.log(100.0))
    # Put to the mean of 128 powers it would hardly ever be exceeded (errata, "Radar").
    assert special.gammaincc(128, 128 * math.log(100.0)) < 1e-100


@pytest.mark.parametrize("shape", [1, 2])
@pytest.mark.parametrize("looks", [1, 3, 128])
@pytest.mark.parametrize("snr_db", [-40.0, -12.0, 0.0, 15.0])
def test_closed_forms_against_quadrature_over_the_cross_section(shape, looks, snr_db):
    snr, level = 10 ** (snr_db / 10), 2 * looks * threshold(1e-3, looks)

    def integrand(u: float) -> float:
        rcs = stats.gamma.ppf(u, shape, scale=1 / shape)
        return float(stats.ncx2.sf(level, 2 * looks, 2 * looks * snr * rcs))

    expected, _ = integrate.quad(integrand, 0.0, 1.0, epsabs=1e-10, limit=400)
    swerling = {1: 1, 2: 3}[shape]
    assert detection_probability(snr_db, 1e-3, swerling, looks=looks) == pytest.approx(expected, abs=1e-8)


@pytest.mark.parametrize(("swerling", "expected"), [(0, 13.2), (1, 21.1), (3, 17.2)])
def test_the_ratio_for_nine_in_ten_at_one_false_alarm_in_a_million(swerling, expected):
    assert required_snr_db(0.9, 1e-6, swerling) == pytest.approx(expected, abs=0.15)


def test_albersheim():
    # A rule for a steady target; below even odds it is worse.
    for looks in (1, 8, 128):
        for p_fa in (1e-7, 1e-5, 1e-3):
            for p_d in (0.5, 0.7, 0.9):
                a, b = math.log(0.62 / p_fa), math.log(p_d / (1 - p_d))
                rule = (6.2 + 4.54 / math.sqrt(looks + 0.44)) * math.log10(a + 0.12 * a * b + 1.7 * b)
                expected = -5 * math.log10(looks) + rule
                assert required_snr_db(p_d, p_fa, 0, looks=looks) == pytest.approx(expected, abs=0.35)


def test_a_target_in_the_bin_for_a_share_of_the_sweeps():
    radar = RadarConfig()
    rng = np.random.default_rng(5)
    sweeps, inside, snr_db = radar.averages, 8, 3.0
    speed = radar.range_bin / (inside * radar.sweep_time_ms * 1e-3)
    power = np.zeros(SAMPLES)
    for k in range(sweeps):
        i, q = rng.normal(scale=math.sqrt(0.5), size=(2, SAMPLES))
        power += (i + (math.sqrt(10 ** (snr_db / 10)) if k < inside else 0.0)) ** 2 + q**2
    expected = detection_probability(snr_db - migration_loss_db(speed, radar), 1e-3, 0, looks=sweeps)
    assert 0.1 < expected < 0.9999
    assert np.mean(power / sweeps > threshold(1e-3, sweeps)) == pytest.approx(expected, abs=0.008)


@pytest.mark.parametrize("swerling", [0, 1, 3])
@pytest.mark.parametrize("looks", [1, 2, 128, 4096])
def test_extreme_ratios(swerling, looks):
    levels = np.linspace(-1000.0, 1000.0, 501)
    for p_fa in (1e-15, 0.01, 0.5):
        p = detection_probability(levels, p_fa, swerling, looks=looks)
        assert np.all((p >= p_fa * (1 - 1e-12)) & (p <= 1.0))
        assert np.all(np.diff(p) >= -1e-9)
        assert p[0] == pytest.approx(p_fa, rel=1e-6) and p[-1] == pytest.approx(1.0, abs=1e-12)


def test_arguments_broadcast():
    assert detection_probability([0.0, 10.0], [[0.01], [0.1], [0.2]], looks=[4, 8]).shape == (3, 2)
    assert required_snr_db([0.5, 0.9], [[0.01], [0.1]]).shape == (2, 2)


def test_bad_arguments_are_refused_by_name():
    for wrong in (0.0, 1.0, -0.1, math.nan, "often"):
        with pytest.raises(ValueError, match="p_fa must be"):
            detection_probability(10.0, wrong)
        with pytest.raises(ValueError, match="p_fa must be"):
            threshold(wrong)
        with pytest.raises(ValueError, match="p_d must be"):
            required_snr_db(wrong, 0.01)
    for wrong in (0, 1.5, -3, math.nan):
        with pytest.raises(ValueError, match="looks must be"):
            detection_probability(10.0, 0.01, looks=wrong)
    with pytest.raises(ValueError, match="swerling must be one of 0, 1, 3, not 2"):
        detection_probability(10.0, 0.01, 2)
    with pytest.raises(ValueError, match="snr_db must be finite"):
        detection_probability(math.nan, 0.01)
    with pytest.raises(ValueError, match="p_d must be more than p_fa"):
        required_snr_db(0.01, 0.01)
