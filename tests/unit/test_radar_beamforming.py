"""Beams and spectra over direction, against sums over steering vectors."""

import numpy as np
import pytest

from tests.made_frames import radar
from wideberth.sensors.radar.array import steering_vector
from wideberth.sensors.radar.estimation.beamforming import (
    beam_powers,
    conventional_spectrum,
    direction_grid,
    forward_backward,
    mvdr_spectrum,
    places_in_wavelengths,
    quadratic_spectrum,
    spectrum_peaks,
)

LINE, PLANE = radar(1, 4), radar(4, 16)


def waves(config):
    """Steering vectors over the grid, (down, right, channels)."""
    grid = direction_grid(config)
    places = places_in_wavelengths(config)
    turns = np.add.outer(np.outer(grid.down, places[:, 1]), np.zeros(len(grid.right)))
    return np.exp(-2j * np.pi * (turns.transpose(0, 2, 1) + np.outer(grid.right, places[:, 0])))


def covariance(config, directions, powers, coherent=False, noise=1.0):
    a = np.stack([steering_vector(config, *np.radians(d)) for d in directions], axis=1)
    amplitudes = np.sqrt(powers) * np.exp(1.0j * np.arange(len(powers)))
    of_sources = np.outer(amplitudes, amplitudes.conj()) if coherent else np.diag(powers)
    return a @ of_sources @ a.conj().T + noise * np.eye(config.channels)


@pytest.mark.parametrize("config", [LINE, PLANE, radar(4, 4), radar(2, 6), radar(1, 1)])
def test_spectra_are_sums_over_steering_vectors(config):
    n = config.channels
    rng = np.random.default_rng(1)
    x = rng.normal(size=(n, n, 2)).view(np.complex128)[..., 0]
    r, m, h = x @ x.conj().T, np.eye(n) + 0.1 * x, x[0]
    a = waves(config)
    e = a @ m.T
    np.testing.assert_allclose(quadratic_spectrum(config, r), np.einsum("dri,ij,drj->dr", a.conj(), r, a).real)
    np.testing.assert_allclose(beam_powers(config, h), np.abs(a.conj() @ h) ** 2, atol=1e-12)
    power = np.einsum("dri,ij,drj->dr", e.conj(), r, e).real / np.sum(np.abs(e) ** 2, axis=2)
    np.testing.assert_allclose(conventional_spectrum(config, r, m), power)
    np.testing.assert_allclose(conventional_spectrum(config, r), conventional_spectrum(config, r, np.eye(n)))
    inverse = np.linalg.inv(r + 0.5 * np.eye(n))
    capon = 1.0 / np.einsum("dri,ij,drj->dr", e.conj(), inverse, e).real
    np.testing.assert_allclose(mvdr_spectrum(config, r, m, loading=0.5), capon)


def test_grid_holds_what_is_ahead_or_where_beams_repeat_the_field_of_view():
    grid = direction_grid(PLANE)
    assert grid.right[0] == -1.0 and grid.right[-1] == 1.0 and 0.0 in grid.right
    assert not grid.seen[0, 0] and grid.seen[len(grid.down) // 2, 0]
    assert not grid.inside[len(grid.down) // 2, 0] and grid.inside[len(grid.down) // 2, 1]
    wide = direction_grid(radar(1, 4, element_spacing_wavelengths=1.0))
    assert wide.right[-1] == pytest.approx(np.sin(np.radians(60.0)))
    assert direction_grid(LINE).down.tolist() == [0.0]


def test_steering_vectors_are_those_of_direction_cosines():
    az, el = 0.4, -0.3
    cosines = np.cos(el) * np.sin(az), -np.sin(el)
    wave = np.exp(-2j * np.pi * (places_in_wavelengths(PLANE) @ cosines))
    np.testing.assert_allclose(wave, steering_vector(PLANE, az, el))


def test_mvdr_parts_two_targets_that_the_conventional_beam_merges():
    r = covariance(PLANE, [(-10.0, 0.0), (10.0, 0.0)], [10.0, 10.0])
    spectrum = conventional_spectrum(PLANE, r)
    merged = spectrum_peaks(PLANE, spectrum, 0.5 * spectrum.max())
    assert len(merged) == 1 and np.abs(merged[0]).max() < 0.05
    parted = spectrum_peaks(PLANE, mvdr_spectrum(PLANE, r), 1.0)
    np.testing.assert_allclose(np.sort(parted[:, 0]), np.sin(np.radians([-10.0, 10.0])), atol=0.07)
    noise = mvdr_spectrum(PLANE, np.eye(16, dtype=complex))
    np.testing.assert_allclose(noise, 1.0 / 16.0)


@pytest.mark.parametrize("config", [LINE, PLANE])
@pytest.mark.parametrize("azimuth", [-72.0, 66.0, 74.0, 89.0])
def test_the_flank_of_a_peak_is_no_second_peak_at_the_opposite_edge(config, azimuth):
    spectrum = mvdr_spectrum(config, covariance(config, [(azimuth, 0.0)], [100.0]), loading=0.3)
    peaks = spectrum_peaks(config, spectrum, 2.0 / config.channels)
    assert len(peaks) == 1
    np.testing.assert_allclose(peaks[0], [np.sin(np.radians(azimuth)), 0.0], atol=0.07)


def test_two_peaks_beside_opposite_edges_are_two():
    pair = covariance(LINE, [(-50.0, 0.0), (70.0, 0.0)], [100.0, 100.0])
    found = spectrum_peaks(LINE, mvdr_spectrum(LINE, pair), 1.0)
    np.testing.assert_allclose(np.sort(found[:, 0]), np.sin(np.radians([-50.0, 70.0])), atol=0.07)


def test_where_beams_do_not_repeat_an_edge_is_an_end():
    wide = radar(1, 4, element_spacing_wavelengths=0.4)
    spectrum = mvdr_spectrum(wide, covariance(wide, [(88.0, 0.0)], [100.0]), loading=0.3)
    (peak,) = spectrum_peaks(wide, spectrum, 2.0 / 4)
    assert peak[0] > 0.9


def test_forward_backward_averaging_recovers_coherent_targets():
    r = covariance(PLANE, [(-15.0, 0.0), (15.0, 0.0)], [100.0, 100.0], coherent=True)
    assert np.linalg.eigvalsh(r)[-2] == pytest.approx(1.0)
    even = forward_backward(r)
    assert np.linalg.eigvalsh(even)[-2] > 100.0
    blind = spectrum_peaks(PLANE, mvdr_spectrum(PLANE, r), 1.0)
    seen = spectrum_peaks(PLANE, mvdr_spectrum(PLANE, even), 1.0)
    wanted = np.sin(np.radians([-15.0, 15.0]))
    assert len(seen) >= 2
    np.testing.assert_allclose(np.sort(seen[:2, 0]), wanted, atol=0.07)
    assert mvdr_spectrum(PLANE, even).max() > 20.0 * mvdr_spectrum(PLANE, r).max() or len(blind) < 2
    alone = covariance(PLANE, [(20.0, 10.0)], [100.0])
    np.testing.assert_allclose(forward_backward(alone), alone, atol=1e-9)


def test_bad_matrices_are_refused():
    with pytest.raises(ValueError, match="shape"):
        quadratic_spectrum(LINE, np.eye(3, dtype=complex))
    with pytest.raises(ValueError, match="loading"):
        mvdr_spectrum(LINE, np.eye(4, dtype=complex), loading=-1.0)
    with pytest.raises(ValueError, match="singular"):
        mvdr_spectrum(LINE, np.zeros((4, 4), dtype=complex))
