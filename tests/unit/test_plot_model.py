"""The plots of a radar straight from geometry: detection, errors, resolution, false alarms."""

import math

import numpy as np
import pytest
from scipy import stats

from tests.made_frames import clean_frame, noisy_frame, peak_bins
from tests.made_frames import radar as frame_radar
from wideberth.sensors.radar.config import SimulatedRadarConfig
from wideberth.sensors.radar.coverage import looks_and_gain_db, plot_probability
from wideberth.sensors.radar.estimation.plots import estimate_plots
from wideberth.sensors.radar.link_budget import averaging_gain_db, snr_db
from wideberth.sensors.radar.plot_model import HALF_POWER_WIDTH, TONE_BINS, PlotModel, even_directions, polar
from wideberth.sensors.radar.range_cells import beat_bins, bin_shares

QUIET = {"false_alarm_probability": 1e-12}
PLANE = {"channels": 16, "array_rows": 4}
LONE_BINS = {"group_bins": 1, "window": "rectangular"}
LOOKS = 1200


def model_of(plot_model=None, **settings):
    return PlotModel(SimulatedRadarConfig.model_validate({**settings, "plot_model": plot_model or {}}))


def place(distance, azimuth=0.0, elevation=0.0):
    level = math.cos(elevation)
    return distance * np.array([level * math.cos(azimuth), level * math.sin(azimuth), -math.sin(elevation)])


def looks(model, positions, rcs, rates=0.0, n=LOOKS, seed=1):
    """Plots of many looks at the same aircraft."""
    positions = np.atleast_2d(positions)
    k = len(positions)
    random = np.random.default_rng(seed)
    return [model.look(random, positions, np.full(k, rates), np.full(k, rcs)) for _ in range(n)]


@pytest.mark.parametrize(
    ("distance", "rcs", "settings"),
    [
        (400.0, 0.03, {}),
        (300.0, 0.01, {"swerling": 3}),
        (350.0, 0.03, {"swerling": 0}),
        (400.0, 0.02, {"detect_on": "beam"}),
        (400.0, 0.03, {"averaging": "coherent", "averages": 8}),
        (300.0, 0.01, {**PLANE, "averages": 4}),
    ],
)
def test_detection_has_the_probability_of_the_link_budget_over_places_in_a_bin(distance, rcs, settings):
    config = {"false_alarm_probability": 1e-5, **settings}
    model, radar = model_of({"processing_loss_db": 2.0}, **config), SimulatedRadarConfig.model_validate(config)
    azimuth, elevation = math.radians(20), math.radians(-5)
    random, found = np.random.default_rng(1), 0
    for k in range(LOOKS):
        at = place(distance + radar.range_bin * k / LOOKS, azimuth, elevation)
        z, _ = model.look(random, at[None], np.array([9.0]), np.array([rcs]))
        found += bool(len(z) and np.abs(z[:, 0] - distance).min() < 3.0)
    p = float(plot_probability(distance, rcs, 9.0, radar, azimuth=azimuth, elevation=elevation, loss_db=2.0))
    assert 0.05 < p < 0.97
    assert stats.binomtest(found, LOOKS, p).pvalue > 1e-3


def test_a_fixed_threshold_sees_or_does_not_and_has_no_false_alarms():
    model = model_of({"processing_loss_db": 0.0}, snr_threshold_db=30.0)
    config = SimulatedRadarConfig(snr_threshold_db=30.0)
    n, gain = looks_and_gain_db(config)
    for distance in np.linspace(50.0, 600.0, 40):
        share = bin_shares(config, beat_bins(config, distance, 0.0), 0.0)
        over = snr_db(distance, 1.0, config) + gain + averaging_gain_db(n) + 10.0 * np.log10(share) >= 30.0
        expected = (over[1:] & over[:-1]).any()
        for z, _ in looks(model, place(distance), 1.0, n=3):
            assert len(z) == expected


@pytest.mark.parametrize(("azimuth", "elevation"), [(0.0, 0.0), (0.7, -0.2), (-0.9, 0.15)])
def test_errors_have_the_stated_spread_and_no_bias(azimuth, elevation):
    model = model_of(range_rate=True, swerling=1, **PLANE, **QUIET)
    rows = [(z[0], v[0]) for z, v in looks(model, place(250.0, azimuth, elevation), 0.4, -8.0) if len(z)]
    z, v = (np.array(part) for part in zip(*rows, strict=True))
    error = (z - [250.0, azimuth, elevation, -8.0]) / np.sqrt(v)
    n = len(z)
    assert n > 0.7 * LOOKS
    # The squares' mean is chi-square; 99.9 % of each.
    low, high = stats.chi2.ppf([5e-4, 1 - 5e-4], n) / n
    assert ((error**2).mean(axis=0) > low).all() and ((error**2).mean(axis=0) < high).all()
    assert (np.abs(error.mean(axis=0)) < 3.5 / math.sqrt(n)).all()


def test_spread_is_the_bound_with_its_floor_and_grows_off_boresight():
    model = model_of(
        {"range_floor_bins": 0.1, "direction_floor_beamwidths": 0.01},
        range_rate=True,
        **PLANE,
    )
    c = SimulatedRadarConfig(**PLANE)
    total = np.array([100.0, 1e12])
    sigma = model.sigmas(np.array([place(100.0)] * 2), total)
    assert sigma[0, 0] == pytest.approx(c.range_bin * math.hypot(TONE_BINS / 10.0, 0.1))
    width = HALF_POWER_WIDTH / (4 * 0.5)
    assert sigma[0, 1] == pytest.approx(math.hypot(math.sqrt(6 / 15) / math.pi / 10.0, 0.01 * width))
    assert sigma[1, 0] == pytest.approx(0.1 * c.range_bin) and sigma[1, 2] == pytest.approx(0.01 * width)
    assert sigma[0, 1] == sigma[0, 2]
    aside = model.sigmas(np.array([place(100.0, math.radians(60))]), total[:1])
    assert aside[0, 1] == pytest.approx(2.0 * sigma[0, 1]) and aside[0, 2] == sigma[0, 2]
    assert np.isfinite(model.sigmas(np.array([place(100.0, math.pi / 2), place(1.0, 0.0, math.pi / 2)]), total)).all()
    assert (
        model.sigmas(np.array([place(100.0)] * 2), np.array([0.0, 1.0]))[0]
        == model.sigmas(np.array([place(100.0)]), np.ones(1))
    ).all()


def test_biases_are_those_of_the_settings():
    settings = {"range_bias_bins": 2.0, "range_doppler_share": 1.0}
    model = model_of(settings, **PLANE, **QUIET)
    c = SimulatedRadarConfig(**PLANE)
    z = np.array([z[0, 0] for z, _ in looks(model, place(200.0), 1.0, -30.0, n=500) if len(z)])
    # Errata, "Radar": 1.2 m at 30 m/s, and closing targets look nearer.
    coupling = -30.0 * 10.25e9 * 2.048e-3 / 500e6
    assert -1.3 < coupling < -1.2
    assert z.mean() == pytest.approx(200.0 + 2.0 * c.range_bin + coupling, abs=0.03)


def test_a_line_array_gives_the_angle_of_a_cone_and_no_elevation():
    model = model_of(**QUIET)
    azimuth, elevation = 0.6, 0.2
    rows = [z[0] for z, _ in looks(model, place(150.0, azimuth, elevation), 1.0, n=400) if len(z)]
    z = np.array(rows)
    assert np.isnan(z[:, 2]).all() and np.isnan(z[:, 3]).all()
    assert z[:, 1].mean() == pytest.approx(math.asin(math.cos(elevation) * math.sin(azimuth)), abs=0.005)
    wild = model_of({"direction_floor_beamwidths": 5.0}, **QUIET)
    assert all((np.abs(z[:, 1]) <= math.pi / 2).all() for z, _ in looks(wild, place(150.0, 0.9), 1.0, n=200))


def test_two_aircraft_in_one_cell_give_one_plot_weighted_by_power():
    model = model_of({"resolution_bins": 2.0, "resolution_beamwidths": 1.0}, swerling=0, **PLANE, **QUIET)
    bin_length = SimulatedRadarConfig(**PLANE).range_bin

    def count(*places):
        return {len(z) for z, _ in looks(model, np.array(places), 1.0, n=20)}

    assert count(place(200.0), place(200.0 + 1.1 * bin_length, 0.1)) == {1}
    assert count(place(200.0), place(200.0 + 2.9 * bin_length, 0.1)) == {2}
    assert count(place(200.0), place(200.0, math.asin(0.7))) == {2}
    assert count(place(200.0), place(200.0, 0.05), place(200.0, 0.1), place(300.0)) == {2}
    random = np.random.default_rng(4)
    pair = np.array([place(200.0, 0.0), place(200.0, 0.2)])
    z = np.array([model.look(random, pair, np.zeros(2), np.array([1.0, 3.0]))[0][0] for _ in range(400)])
    # Three quarters of the way, but for what the element's pattern takes off the second.
    assert 0.13 < z[:, 1].mean() < 0.15


def test_the_weaker_of_two_in_one_cell_is_hidden_where_beam_or_doppler_tell_them_apart():
    model = model_of(swerling=1, **PLANE, **QUIET)
    random = np.random.default_rng(5)
    for half, rates in ((0.5, [0.0, 0.0]), (0.1, [0.0, 2.0])):
        pair = np.array([place(200.0, -half), place(200.0, half)])
        z = [model.look(random, pair, np.array(rates), np.array([1.0, 1.0]))[0] for _ in range(200)]
        rows = np.array([one[0] for one in z if len(one) == 1])
        assert len(rows) == 200
        # Not between: the mean of these two directions would be shorter than either, too.
        assert np.abs(rows[:, 0] - 200.0).max() < 0.5
        assert (np.abs(np.abs(rows[:, 1]) - half) < 0.07).all() and 0.3 < (rows[:, 1] > 0.0).mean() < 0.7


@pytest.mark.parametrize(("apart", "rate"), [(0.5, 0.0), (0.5, 2.0), (1.5, 0.0)])
def test_one_plot_of_two_echoes_is_where_the_processing_finds_it(apart, rate):
    settings = {"channels": 16, "beamformer": "conventional"}
    radar = frame_radar(4, **settings)
    u = 0.5 * apart * HALF_POWER_WIDTH / (4 * 0.5)
    echoes = [(40.3, math.asin(u), 0.0, 3.0), (40.3, -math.asin(u), 0.0, 3.0 - rate)]
    cleans, rng = [clean_frame(radar, 20, e) for e in echoes], np.random.default_rng(6)
    model = model_of(swerling=0, snr_threshold_db=-100.0, if_bandwidth_mhz=0.25, **PLANE)
    places, powers = np.array([place(40.3, math.asin(u)), place(40.3, -math.asin(u))]), (16.0, 8.0)
    found = []
    for _ in range(40):
        frame = noisy_frame(cleans, [10.0 * math.log10(p) for p in powers], rng)
        found.append(estimate_plots(radar, frame, peak_bins(radar, echoes[:1]), np.ones(16)).z[0])
    said = [model.look(rng, places, np.array([3.0, 3.0 - rate]), np.array(powers))[0] for _ in range(40)]
    assert {len(z) for z in said} == {1}
    # Medians in half the distance between the two; a pair that is one wave front is turned by its phase.
    sines = np.sin([np.median(np.array(found)[:, 1]), np.median([z[0, 1] for z in said])]) / u
    assert abs(sines[0] - sines[1]) < 0.4
    assert (sines > 0.8).all() == (apart > 1.0 or rate > 0.0)


def test_false_alarms_come_as_often_as_the_bins_and_evenly():
    settings = {
        "false_alarm_probability": 2e-3,
        "processing": LONE_BINS,
        "range_min_m": 100.0,
        "range_max_m": 400.0,
        **PLANE,
    }
    c = SimulatedRadarConfig.model_validate(settings)
    model = model_of({"false_alarm_factor": 1.5}, **settings)
    none = np.empty((0, 3))
    z = [z for z, _ in looks(model, none, 1.0, n=1500)]
    bins = math.floor(400.0 / c.range_bin) - math.ceil(100.0 / c.range_bin) + 1
    number = sum(map(len, z))
    assert stats.binomtest(number, 1500 * bins, 3e-3).pvalue > 1e-3
    rows = np.concatenate(z)
    assert stats.kstest(rows[:, 0], stats.uniform(100.0, 300.0).cdf).pvalue > 1e-3
    assert stats.kstest(rows[:, 1], stats.uniform(-math.pi / 3, 2 * math.pi / 3).cdf).pvalue > 1e-3
    top = math.sin(math.radians(15.0))
    assert stats.kstest(np.sin(rows[:, 2]), stats.uniform(-top, 2 * top).cdf).pvalue > 1e-3
    # One a bin at most, whatever the probability.
    dense = model_of({"false_alarm_factor": 10.0}, **{**settings, "false_alarm_probability": 0.5})
    full, _ = looks(dense, none, 1.0, n=1)[0]
    assert len(full) == bins and (np.diff(np.sort(np.round(full[:, 0] / c.range_bin))) == 1).all()


def test_what_is_out_of_range_or_of_the_field_of_view_or_not_there_is_not_seen():
    model = model_of(range_min_m=50.0, range_max_m=500.0, **PLANE, **QUIET)
    away = [
        place(40.0),
        place(510.0),
        place(100.0, math.radians(61)),
        place(100.0, 0.0, math.radians(16)),
        np.full(3, math.nan),
    ]
    assert not model.visible(np.array(away)).any()
    assert all(len(z) == 0 for z, _ in looks(model, np.array(away), 100.0, n=10))
    assert model.visible(np.array([place(100.0, math.radians(59), math.radians(14))])).all()


def test_one_aircraft_does_not_change_the_noise_of_another_that_is_resolved():
    model = model_of(swerling=0, **PLANE, **QUIET)
    both = np.array([place(200.0, 0.3), place(300.0)])
    apart = np.array([place(200.0, 0.3), np.full(3, math.nan)])
    a, _ = model.look(np.random.default_rng(3), both, np.zeros(2), np.ones(2))
    b, _ = model.look(np.random.default_rng(3), apart, np.zeros(2), np.ones(2))
    assert (a[a[:, 0].argmin()] == b[0]).sum() >= 3


def test_directions_are_even_and_polar_is_their_inverse():
    azimuth, elevation = even_directions(np.random.default_rng(1), 4000, (math.pi, math.pi / 2), 0.0)
    assert elevation.min() >= 0.0 and stats.kstest(np.sin(elevation), "uniform").pvalue > 1e-3
    d, a, e = polar(np.array([place(7.0, x, y) for x, y in zip(azimuth, elevation, strict=True)]))
    assert np.allclose(d, 7.0) and np.allclose(a, azimuth) and np.allclose(e, elevation)
