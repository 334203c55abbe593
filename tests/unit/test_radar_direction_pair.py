"""Two waves fitted to one wave front, against a search over all pairs; and what the estimator makes of it."""

import numpy as np
import pytest
from scipy.optimize import minimize

from tests.made_echoes import noise
from tests.made_frames import radar
from wideberth.sensors.radar.estimation.beamforming import places_in_wavelengths
from wideberth.sensors.radar.estimation.direction_pair import direction_pair, single_misfit


def left_by(h, waves):
    rest = h - waves @ np.linalg.lstsq(waves, h, rcond=None)[0]
    return np.vdot(rest, rest).real


@pytest.mark.parametrize("phase", [0.0, 0.5, 1.6, 3.0])
@pytest.mark.parametrize(("rows", "channels"), [(1, 4), (4, 16), (3, 6), (4, 4)])
def test_the_pair_explains_most_of_the_wave_front(rows, channels, phase):
    config = radar(rows, channels)
    places = places_in_wavelengths(config)
    response = np.eye(channels) + 0.05 * noise(1, channels, channels)
    wide, high = channels > rows, rows > 1
    true = np.array([[-0.18 * wide, 0.2 * high], [0.2 * wide, -0.15 * high]])
    waves = response @ np.exp(-2j * np.pi * (places @ true.T))
    h = 200.0 * waves @ [1.0, np.exp(1j * phase)] + noise(2, channels) * np.sqrt(0.5)
    found, amplitudes, left = direction_pair(config, h, response, np.zeros(2))
    assert np.all(found[:, [not wide, not high]] == 0.0)

    def loss(p):
        cosines = np.zeros((2, 2))
        cosines[:, np.flatnonzero([wide, high])] = p.reshape(2, -1)
        return left_by(h, response @ np.exp(-2j * np.pi * (places @ cosines.T)))

    best = minimize(
        loss,
        true[:, np.flatnonzero([wide, high])].ravel(),
        method="Nelder-Mead",
        options={"xatol": 1e-8, "fatol": 1e-9},
    )
    assert left <= best.fun * (1.0 + 1e-6) + 1e-9
    fitted = response @ np.exp(-2j * np.pi * (places @ found.T))
    assert left == pytest.approx(np.sum(np.abs(h - fitted @ amplitudes) ** 2))
    # One wave explains less, and the directions are the true ones as well as noise lets them be.
    assert single_misfit(h, response.sum(axis=1)) > left
    order = np.argsort(found @ (1.0, -1.0))
    np.testing.assert_allclose(found[order], true, atol=0.08)


def test_of_one_wave_nothing_is_left():
    h = noise(3, 5)
    assert single_misfit(2j * h, h) == pytest.approx(0.0, abs=1e-12)
