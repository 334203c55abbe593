"""Echoes taken out of the samples around another, against spectra of whole sweeps and plain sums."""

import numpy as np
import pytest

from tests.made_echoes import BINS, COMPLEX, DISTANCE, FIRST, HALF, RATE, SWEEPS, WAVEFORM, noise
from tests.made_frames import radar
from tests.naive import radar_estimation as naive
from wideberth.sensors.radar.estimation.beamforming import places_in_wavelengths
from wideberth.sensors.radar.estimation.direction_kernels import DIRECTION, answer, fit_direction
from wideberth.sensors.radar.estimation.echo_fit_kernels import beam_towards, fit_in_channels
from wideberth.sensors.radar.estimation.echo_kernels import sums_of_channels
from wideberth.sensors.radar.estimation.range_rate_kernels import FIT, fit_range_rates
from wideberth.sensors.radar.estimation.removal_kernels import (
    amplitudes_of_channels,
    beam_of_rest,
    responses_of_terms,
    take_out,
    terms_of_others,
    whiten,
)
from wideberth.sensors.radar.estimation.window import Window


@pytest.mark.parametrize("rate", [0.0, 21.7, -45.0])
@pytest.mark.parametrize("away", [-60, 0, 30, 200])
def test_near_and_far_an_echo_is_removed_as_the_spectrum_of_its_sweeps(rate, away):
    exact = naive.echo(COMPLEX, SWEEPS, DISTANCE, rate)
    first = FIRST + away
    responses = np.empty((1, SWEEPS, BINS), np.complex128)
    responses_of_terms(first, WAVEFORM, np.array([[DISTANCE, rate]]), responses)
    # Against a peak of 1; far off, against side lobes of a hundredth.
    np.testing.assert_allclose(responses[0], exact[:, first : first + BINS], atol=1e-4 if away else 1e-3)


def test_terms_are_taken_out_of_samples_beams_and_correlations_alike():
    x, weights = noise(1, SWEEPS, 2, BINS), noise(2, 2)
    paths, amplitudes = np.array([[DISTANCE + 0.4, 5.0], [-DISTANCE, -RATE], [DISTANCE + 30.0, 0.0]]), noise(3, 3, 2)
    window = Window.of(x, FIRST, WAVEFORM).less(paths[:2], amplitudes[:2]).less(paths[2:], amplitudes[2:])
    responses = np.empty((3, SWEEPS, BINS), np.complex128)
    responses_of_terms(FIRST, WAVEFORM, paths, responses)
    np.testing.assert_array_equal(window.responses, responses)
    left = x - np.einsum("ekb,ec->kcb", responses, amplitudes)
    taken = x.copy()
    take_out(taken.view(np.float64), responses, amplitudes)
    np.testing.assert_allclose(taken, left, atol=1e-12)
    freed = window.freed()
    np.testing.assert_allclose(freed.samples, left, atol=1e-12)
    assert not len(freed.responses) and freed.freed() is freed
    z = np.empty((SWEEPS, BINS), np.complex128)
    beam_of_rest(x, weights, responses, amplitudes, z.view(np.float64))
    np.testing.assert_allclose(z, np.einsum("c,kcb->kb", weights, left), atol=1e-12)
    np.testing.assert_allclose(window.beam(weights), z, atol=1e-12)
    h, sums = np.empty(2, np.complex128), np.empty((SWEEPS, 2), np.complex128)
    amplitudes_of_channels(x, FIRST, WAVEFORM, DISTANCE, RATE, HALF, responses, amplitudes, h)
    sums_of_channels(left, FIRST, WAVEFORM, DISTANCE, RATE, HALF, sums)
    np.testing.assert_allclose(h, sums.sum(axis=0), atol=1e-9)


@pytest.mark.parametrize("mirrored", [False, True])
def test_others_go_where_they_matter_and_mirrored_where_samples_are_real(mirrored):
    scale, at = np.array([1.0, 2.0]), round(WAVEFORM[0] * DISTANCE)
    paths = np.array([[DISTANCE, RATE], [DISTANCE + 0.6, -3.0], [DISTANCE, 1.0], [DISTANCE + 30.0, 0.0]])
    heard, modelled = 3.0 * noise(12, 4, 2), 3.0 * noise(13, 4, 2)
    heard[3] *= 1e-6  # too weak to matter
    kinds = np.array([0, 1, 2, 0])
    terms, amplitudes = np.empty((8, 2)), np.empty((8, 2), np.complex128)
    n, removed = terms_of_others(
        at, 10, FIRST, BINS, SWEEPS, WAVEFORM, paths, heard, modelled, kinds, scale, mirrored, 1e-4, terms, amplitudes
    )
    expected = [(paths[0], heard[0] / scale), (paths[1], modelled[1] / scale)]
    if mirrored:
        expected += [(-path, h.conj() / scale) for path, h in zip(paths[:3], heard[:3], strict=True)]
    found = sorted([(*terms[i], *amplitudes[i]) for i in range(n)], key=lambda row: (row[0], row[1]))
    expected.sort(key=lambda row: tuple(row[0]))
    np.testing.assert_allclose(found, [(*path, *a) for path, a in expected])
    taken = 0.0
    for path, h in ((paths[0], heard[0]), (paths[1], modelled[1])):
        off = abs(WAVEFORM[0] * path[0] + WAVEFORM[1] * path[1] - at)
        off -= 0.5 * WAVEFORM[0] * abs(path[1]) * SWEEPS * WAVEFORM[5] + 1.0
        taken += np.sum(np.abs(h / scale) ** 2) / max(off, 1.0) ** 2
    assert removed == pytest.approx(SWEEPS * taken)


@pytest.mark.parametrize("value", [1.0, np.nan, np.inf])
def test_samples_are_put_to_unit_noise_and_looked_at(value):
    image = noise(4, 3, 2, 9).astype(np.complex64)
    image[2, 1, 5] *= value
    phases, scale = np.exp(1j * np.arange(6)), np.array([0.5, 2.0])
    x = np.empty((3, 2, 6), np.complex128)
    with np.errstate(invalid="ignore"):  # where it is not compiled
        assert whiten(image[:, :, 2:8], phases, scale, x) == np.isfinite(value)
    good = np.isfinite(image[:, :, 2:8])
    with np.errstate(invalid="ignore"):
        expected = image[:, :, 2:8] * (phases / scale[:, None])
    np.testing.assert_allclose(x[good], expected[good], rtol=1e-6)


def test_the_whole_fit_is_its_parts_one_after_the_other():
    config = radar(1, 4, sampling="complex")
    places, response = places_in_wavelengths(config), np.eye(4) + 0.1 * noise(6, 4, 4)
    model = np.empty((1, SWEEPS, BINS), np.complex128)
    responses_of_terms(FIRST, WAVEFORM, np.array([[DISTANCE, RATE]]), model)
    wave = response @ np.exp(-2j * np.pi * places[:, 0] * 0.2)
    x = 5.0 * wave[:, None] * model[0][:, None] + noise(7, SWEEPS, 4, BINS)
    other = np.empty((1, SWEEPS, BINS), np.complex128)
    responses_of_terms(FIRST, WAVEFORM, np.array([[DISTANCE + 0.5, 0.0]]), other)
    amplitudes = noise(8, 1, 4)
    left = x - amplitudes[0][:, None] * other[0][:, None]

    z = np.empty((SWEEPS, BINS), np.complex128)
    beam_towards(x, other, amplitudes, response, places, 0.2, 0.0, z.view(np.float64))
    unit = np.empty(4, np.complex128)
    answer(response, places, 0.2, 0.0, unit)
    np.testing.assert_allclose(z, np.einsum("c,kcb->kb", unit.conj() / np.linalg.norm(unit), left), atol=1e-12)

    fits, direction = np.empty((20, FIT)), np.empty(DIRECTION)
    heard, modelled = np.empty(4, np.complex128), np.empty(4, np.complex128)
    start = (DISTANCE, RATE, 0.2, 0.0, 50.0, HALF)
    n = fit_in_channels(
        x, z, FIRST, WAVEFORM, other, amplitudes, response, places, *start, fits, direction, heard, modelled
    )
    alone = np.empty((20, FIT))
    assert n == fit_range_rates(z, FIRST, WAVEFORM, DISTANCE, RATE, 50.0, HALF, alone)
    np.testing.assert_allclose(fits[:n], alone[:n])
    sums = np.empty((SWEEPS, 4), np.complex128)
    sums_of_channels(left, FIRST, WAVEFORM, fits[0, 0], fits[0, 1], HALF, sums)
    h = sums.sum(axis=0) / fits[0, 5]
    np.testing.assert_allclose(heard, h, atol=1e-9)
    expected, wave = np.empty(DIRECTION), np.empty(4, np.complex128)
    fit_direction(h, response, places, 0.2, 0.0, 20, expected, wave)
    np.testing.assert_allclose(direction, expected, rtol=1e-9)
    np.testing.assert_allclose(modelled, np.vdot(wave, h) / np.vdot(wave, wave) * wave, atol=1e-9)
