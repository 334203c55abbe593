"""Gains, phases and coupling from echoes of known directions."""

import numpy as np
import pytest

from tests.made_frames import radar
from wideberth.errors import InputError
from wideberth.sensors.radar.array import steering_vector
from wideberth.sensors.radar.estimation.calibration import ArrayCalibration, calibrate

LINE, PLANE = radar(1, 4), radar(4, 16)


def response(channels, seed=1, coupling=0.1):
    """Gains within 1 dB, any phases, and coupling of -20 dB."""
    rng = np.random.default_rng(seed)
    n = rng.normal(size=(2, channels, channels))
    gains = 10 ** (rng.uniform(-0.05, 0.05, channels)) * np.exp(1j * rng.uniform(-np.pi, np.pi, channels))
    off = coupling * np.sqrt(0.5) * (n[0] + 1j * n[1])
    np.fill_diagonal(off, 0.0)
    full = (np.eye(channels) + off) * gains
    return full * np.exp(-1j * np.angle(full[0, 0])) / np.mean(np.abs(np.diag(full)))


def echoes(config, true, azimuth, elevation, snr_db, seed=2):
    rng = np.random.default_rng(seed)
    a = steering_vector(config, azimuth, elevation)
    strength = rng.uniform(0.5, 2.0, len(a)) * np.exp(2j * np.pi * rng.random(len(a)))
    noise = rng.normal(size=(*a.shape, 2)).view(np.complex128)[..., 0] * np.sqrt(0.5)
    return strength[:, None] * (a @ true.T) + 10 ** (-snr_db / 20) * noise


def test_response_is_found_to_its_last_digit_without_noise():
    true = response(4)
    azimuth = np.radians(np.linspace(-60, 60, 13))
    found = calibrate(LINE, echoes(LINE, true, azimuth, 0.0, 300.0), azimuth)
    np.testing.assert_allclose(found.response, true, atol=1e-6)


def test_noise_leaves_an_error_of_its_size():
    true = response(16)
    rng = np.random.default_rng(3)
    azimuth, elevation = rng.uniform(-1.0, 1.0, (2, 80))
    h = echoes(PLANE, true, azimuth, elevation, 40.0)
    found = calibrate(PLANE, h, azimuth, elevation, noise_power=1e-4).response
    a = steering_vector(PLANE, *rng.uniform(-0.9, 0.9, (2, 50)))
    wanted, had, ideal = a @ true.T, a @ found.T, a

    def mismatch(e):
        """Share of a wave's energy that is taken for something else."""
        cos2 = np.abs(np.sum(e.conj() * wanted, axis=1)) ** 2
        return 1.0 - cos2 / np.sum(np.abs(e) ** 2, axis=1) / np.sum(np.abs(wanted) ** 2, axis=1)

    assert mismatch(had).max() < 1e-3
    assert mismatch(ideal).min() > 0.1


def test_what_directions_do_not_tell_stays_uncoupled():
    # Twelve directions in a plane see four combinations of the sixteen channels.
    azimuth = np.radians(np.linspace(-50, 50, 20))
    true = np.eye(16)
    found = calibrate(PLANE, echoes(PLANE, true, azimuth, 0.0, 40.0), azimuth, noise_power=1e-4).response
    assert np.abs(found - np.diag(np.diag(found))).max() < 0.05


def test_applied_it_makes_channels_equal():
    true = response(4)
    a = steering_vector(LINE, 0.3)
    samples = np.multiply.outer(true @ a, np.arange(1.0, 4.0))
    undone = ArrayCalibration(true).apply(samples)
    np.testing.assert_allclose(undone, np.multiply.outer(a, np.arange(1.0, 4.0)))


def test_it_is_stored_and_read(tmp_path):
    file = tmp_path / "array.npz"
    ArrayCalibration(response(4)).save(file)
    np.testing.assert_array_equal(ArrayCalibration.load(file).response, response(4))
    (tmp_path / "other.npz").write_bytes(b"no archive")
    with pytest.raises(ValueError, match="is not a calibration"):
        ArrayCalibration.load(tmp_path / "other.npz")
    np.savez(tmp_path / "third.npz", other=np.eye(4))
    with pytest.raises(ValueError, match="is not a calibration"):
        ArrayCalibration.load(tmp_path / "third.npz")
    with pytest.raises(InputError, match="no such file"):
        ArrayCalibration.load(tmp_path / "none.npz")


def test_bad_echoes_are_refused():
    good = echoes(LINE, np.eye(4), np.linspace(-1, 1, 8), 0.0, 40.0)
    with pytest.raises(ValueError, match="shape"):
        calibrate(LINE, good[:, :3], np.linspace(-1, 1, 8))
    with pytest.raises(ValueError, match="at least as many"):
        calibrate(LINE, good[:3], np.linspace(-1, 1, 3))
    with pytest.raises(ValueError, match="power of an echo"):
        calibrate(LINE, 0.0 * good, np.linspace(-1, 1, 8))
    with pytest.raises(ValueError, match="finite"):
        calibrate(LINE, np.nan * good, np.linspace(-1, 1, 8))
    with pytest.raises(ValueError, match="square"):
        ArrayCalibration(np.ones((2, 3), dtype=complex))
