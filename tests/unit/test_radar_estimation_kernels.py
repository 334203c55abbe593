"""Kernels of echoes against samples of whole sweeps, sums written out, and general optimizers."""

import numpy as np
import pytest
from scipy.optimize import minimize

from tests.made_echoes import BINS, DISTANCE, FIRST, HALF, RATE, SWEEPS, WAVEFORM, noise
from tests.made_frames import radar
from tests.naive import radar_estimation as naive
from wideberth.sensors.radar.estimation.beamforming import places_in_wavelengths
from wideberth.sensors.radar.estimation.direction_kernels import DIRECTION, answer, fit_direction
from wideberth.sensors.radar.estimation.echo_kernels import (
    CELLS,
    CORRELATIONS,
    TERMS,
    bin_responses,
    correlate,
    covariance_along,
    echo_slopes,
    sums_of_channels,
)
from wideberth.sensors.radar.estimation.range_rate_kernels import (
    FIT,
    fit_echo,
    fit_range_rates,
    half_bin_powers,
    search_lines,
    search_rates,
)
from wideberth.sensors.radar.estimation.waveform import frame_waveform


def modelled(distance, rate):
    slopes = np.empty((3, SWEEPS, BINS), dtype=np.complex128)
    echo_slopes(FIRST, WAVEFORM, distance, rate, slopes)
    return slopes


def used(distance, rate):
    """Return the bins that a fit uses, as a mask."""
    times = WAVEFORM[6] + WAVEFORM[5] * np.arange(SWEEPS)
    beat = WAVEFORM[0] * (distance + rate * times) * (1 - WAVEFORM[7] * rate) + WAVEFORM[1] * rate
    return np.abs(FIRST + np.arange(BINS) - np.round(beat)[:, None]) <= HALF


@pytest.mark.parametrize("q", [0.0, 0.1, -0.2, 0.35])
@pytest.mark.parametrize("delta", [0.0, 1e-6, -0.3, 0.6366, 0.637, 1.0, -2.5, 4.2, 11.0])
def test_response_of_a_bin_is_the_integral_over_the_sweep(delta, q):
    cells = np.empty((CELLS, 1))
    bin_responses(delta, np.sin(np.pi * delta), np.cos(np.pi * delta), q, 1, cells)
    value, slope = complex(*cells[:2, 0]), complex(*cells[2:, 0])
    # The fifth order of the chirp is left out.
    assert value == pytest.approx(naive.bin_response(delta, q), abs=1e-12 + 0.02 * abs(q) ** 5)
    by_delta = (naive.bin_response(delta + 1e-5, q) - naive.bin_response(delta - 1e-5, q)) / 2e-5
    assert slope == pytest.approx(by_delta, abs=1e-9 + 0.1 * abs(q) ** 5)


@pytest.mark.parametrize("rate", [0.0, 21.7, -40.0])
@pytest.mark.parametrize("sampling", ["real", "complex"])
def test_the_model_is_the_spectrum_of_a_sweep(sampling, rate):
    config = radar(1, 2, sampling=sampling)
    slopes = np.empty((3, SWEEPS, config.range_bins), dtype=np.complex128)
    echo_slopes(0, frame_waveform(config, SWEEPS), DISTANCE, rate, slopes)
    exact = naive.echo(config, SWEEPS, DISTANCE, rate)
    at = np.abs(exact).argmax(axis=1)[SWEEPS // 2]
    around = slice(at - 8, at + 9)
    # Against a peak of 1; the sinc stands for Dirichlet's kernel.
    np.testing.assert_allclose(slopes[0][:, around], exact[:, around], atol=2e-4)


def test_slopes_are_those_of_the_model():
    slopes = modelled(DISTANCE, RATE)
    by_distance = (modelled(DISTANCE + 1e-5, RATE)[0] - modelled(DISTANCE - 1e-5, RATE)[0]) / 2e-5
    by_rate = (modelled(DISTANCE, RATE + 1e-5)[0] - modelled(DISTANCE, RATE - 1e-5)[0]) / 2e-5
    # The phase's small share of distance and the chirp's of the rate are left out.
    np.testing.assert_allclose(slopes[1], by_distance, atol=1e-3 * np.abs(by_distance).max())
    np.testing.assert_allclose(slopes[2], by_rate, atol=5e-3 * np.abs(by_rate).max())


def test_correlations_are_sums_over_the_bins_used():
    z = noise(1, SWEEPS, BINS)
    out = np.empty(CORRELATIONS)
    correlate(z, FIRST, WAVEFORM, DISTANCE, RATE, HALF, np.empty((CELLS, 2 * HALF + 1)), np.empty((CELLS, TERMS)), out)
    m, r, v = modelled(DISTANCE, RATE) * used(DISTANCE, RATE)
    sums = [np.vdot(m, z), np.vdot(r, z), np.vdot(v, z), np.vdot(m, r), np.vdot(m, v)]
    powers = [np.vdot(a, b).real for a, b in ((m, m), (r, r), (v, v), (r, v))]
    np.testing.assert_allclose(out, np.concatenate([np.array(sums).view(np.float64), powers]), rtol=1e-9, atol=1e-9)


def test_channels_are_correlated_and_averaged_alike():
    x = noise(2, SWEEPS, 2, BINS)
    sums = np.empty((SWEEPS, 2), dtype=np.complex128)
    sums_of_channels(x, FIRST, WAVEFORM, DISTANCE, RATE, HALF, sums)
    m = modelled(DISTANCE, RATE)[0]
    near = used(DISTANCE, RATE)
    np.testing.assert_allclose(sums, np.einsum("kb,kcb->kc", (m * near).conj(), x), rtol=1e-9, atol=1e-12)
    r = np.empty((2, 2), dtype=np.complex128)
    assert covariance_along(x, FIRST, WAVEFORM, DISTANCE, RATE, HALF, r) == near.sum()
    samples = x.transpose(1, 0, 2)[:, near]
    np.testing.assert_allclose(r, samples @ samples.conj().T / near.sum(), rtol=1e-9, atol=1e-12)


def test_searches_find_what_trying_all_finds():
    x = noise(3, SWEEPS, 2, BINS) * 0.3 + modelled(DISTANCE, RATE)[0][:, None, :]
    powers = np.empty((SWEEPS, 2 * BINS - 1))
    half_bin_powers(x, powers)
    np.testing.assert_allclose(powers[:, ::2], np.sum(np.abs(x) ** 2, axis=1))
    np.testing.assert_allclose(powers[:, 1::2], np.sum(np.abs(x[..., 1:] + x[..., :-1]) ** 2, axis=1) / 2)
    times = WAVEFORM[6] + WAVEFORM[5] * np.arange(SWEEPS)
    step, peak = 12.0, FIRST + 10
    rates = step * np.arange(-4, 5)
    found = search_lines(powers, FIRST, WAVEFORM, peak, 4 * step, step)
    assert found == pytest.approx(naive.best_line(powers, FIRST, WAVEFORM[0], times, peak, rates))

    z = np.ascontiguousarray(x[:, 0])
    _, rate, power = search_rates(z, FIRST, WAVEFORM, peak, RATE, 50.0)
    span = 1.0 / (WAVEFORM[3] * WAVEFORM[5])
    assert (rate - RATE) / span == pytest.approx(round((rate - RATE) / span))
    halves = np.empty((SWEEPS, 2 * BINS - 1), dtype=np.complex128)
    halves[:, ::2], halves[:, 1::2] = z, (z[:, 1:] + z[:, :-1]) / np.sqrt(2)
    for tried in RATE + span * np.arange(-10, 5):
        place = (peak - WAVEFORM[1] * tried) / WAVEFORM[0]
        turns = WAVEFORM[3] * tried * times + WAVEFORM[4] * ((place + tried * times) ** 2 - place**2)
        for j in range(-8, 9):
            at = np.floor(2.0 * (peak - FIRST) + j + 2 * WAVEFORM[0] * tried * times + 0.5).astype(int)
            if at.min() >= 0 and at.max() < halves.shape[1] and abs(tried) < 50.0:
                total = np.sum(halves[np.arange(SWEEPS), at] * np.exp(-2j * np.pi * turns))
                assert abs(total) ** 2 <= power * (1 + 1e-9)


def test_the_fit_is_the_greatest_likelihood_and_its_variance_the_curvature():
    z = 3.0 * modelled(DISTANCE, RATE)[0] + noise(4, SWEEPS, BINS) * np.sqrt(0.5)
    fit = np.empty(FIT)
    fit_echo(z, FIRST, WAVEFORM, DISTANCE + 0.01, RATE + 0.2, HALF, 30, 1e-6, 0.0, fit)
    near = used(fit[0], fit[1])

    def loss(p):
        return -naive.likelihood(z, modelled(DISTANCE + 0.01 * p[0], RATE + 0.1 * p[1])[0] * near)

    best = minimize(loss, [0.0, 0.0], method="Nelder-Mead", options={"xatol": 1e-6, "fatol": 1e-9})
    assert fit[2] == pytest.approx(-best.fun, rel=1e-5)
    sigma = np.sqrt(fit[6:8])
    # The simplest model of the slopes moves the top by a hundredth of the spread.
    assert abs(fit[0] - (DISTANCE + 0.01 * best.x[0])) < 0.03 * sigma[0]
    assert abs(fit[1] - (RATE + 0.1 * best.x[1])) < 0.03 * sigma[1]
    assert fit[9] == pytest.approx(np.sum(np.abs(z[near]) ** 2))
    assert fit[10] == near.sum()
    m, r, v = modelled(fit[0], fit[1]) * near
    a = complex(fit[3], fit[4])
    jacobian = np.stack([m, 1j * m, a * r, a * v]).reshape(4, -1)
    covariance = np.linalg.inv(2.0 * (jacobian.conj() @ jacobian.T).real)
    np.testing.assert_allclose(fit[6:9], [covariance[2, 2], covariance[3, 3], covariance[2, 3]], rtol=1e-6)


def test_a_fit_out_of_reach_stays_where_it_is():
    z = noise(5, SWEEPS, BINS)
    fit = np.empty(FIT)
    fit_echo(z, FIRST, WAVEFORM, DISTANCE, RATE, HALF, 30, 1e-6, 1e6, fit)
    assert (fit[0], fit[1]) == (DISTANCE, RATE)


@pytest.mark.parametrize(("rows", "channels"), [(1, 4), (4, 16), (4, 4)])
def test_direction_is_the_greatest_likelihood(rows, channels):
    places = places_in_wavelengths(radar(rows, channels))
    response = np.eye(channels) + 0.1 * noise(6, channels, channels)
    true = np.array([0.3 if channels > rows else 0.0, -0.2 if rows > 1 else 0.0])
    h = response @ np.exp(-2j * np.pi * (places @ true)) + 0.1 * noise(7, channels)
    fit, heard = np.empty(DIRECTION), np.empty(channels, np.complex128)
    fit_direction(h, response, places, true[0] + 0.05 * (true[0] != 0), true[1], 30, fit, heard)

    def wave(p):
        return response @ np.exp(-2j * np.pi * (places @ p))

    moving = np.flatnonzero(true)
    best = minimize(
        lambda p: -naive.likelihood(h, wave(np.where(true != 0, np.resize(p, 2) if len(moving) == 1 else p, 0.0))),
        true[moving],
        method="Nelder-Mead",
        options={"xatol": 1e-9, "fatol": 1e-12},
    )
    assert fit[2] == pytest.approx(-best.fun, rel=1e-9)
    np.testing.assert_allclose(fit[moving], best.x, atol=1e-5)
    e = wave(fit[:2])
    np.testing.assert_allclose(heard, e, atol=1e-12)
    answer(response, places, fit[0], fit[1], heard)
    np.testing.assert_allclose(heard, e, atol=1e-12)
    d = [(wave(fit[:2] + s) - wave(fit[:2] - s)) / 2e-6 for s in 1e-6 * np.eye(2)]
    a = np.vdot(e, h) / np.vdot(e, e)
    jacobian = np.stack([a * e, 1j * a * e, a * d[0], a * d[1]])
    information = 2.0 * (jacobian.conj() @ jacobian.T).real
    rest = information[2:, 2:] - information[2:, :2] @ np.linalg.solve(information[:2, :2], information[:2, 2:])
    np.testing.assert_allclose(fit[3:6], [rest[0, 0], rest[1, 1], rest[0, 1]], rtol=1e-4, atol=1e-4)


def test_range_rates_that_phases_allow_are_all_weighed():
    z = 8.0 * modelled(DISTANCE, RATE)[0] + noise(14, SWEEPS, BINS) * np.sqrt(0.5)
    span = 1.0 / (WAVEFORM[3] * WAVEFORM[5])
    fits = np.empty((20, FIT))
    start = (DISTANCE + span * WAVEFORM[1] / WAVEFORM[0], RATE - span)
    n = fit_range_rates(z, FIRST, WAVEFORM, *start, 50.0, HALF, fits)
    found = fits[:n]
    best = np.empty(FIT)
    fit_echo(z, FIRST, WAVEFORM, DISTANCE, RATE, HALF, 30, 1e-9, 0.0, best)
    assert found[0, 2] == found[:, 2].max() == pytest.approx(best[2], rel=1e-4)
    assert abs(found[0, 1] - best[1]) < 0.05 * np.sqrt(best[7])
    steps = (found[:, 1] - found[0, 1]) / span
    assert np.abs(steps - np.round(steps)).max() < 0.3 and len(set(np.round(steps))) == n
    assert fit_range_rates(z, FIRST, WAVEFORM, *start, 0.0, HALF, fits) == 1
