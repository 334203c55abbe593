import numpy as np
import pytest

from tests.naive import radar_sweeps as naive
from wideberth.sensors.radar.sweeps.sweep_kernels import LANES, add_echoes, chirp_samples, digitize


@pytest.mark.parametrize("curvature", [0.0, 1e-8, -3e-6])
def test_chirps_against_the_twin(curvature):
    real, imag = np.empty((2, 64 * LANES), dtype=np.float32)
    chirp_samples(0.3, 0.217, curvature, np.empty((4, LANES)), real, imag)
    np.testing.assert_allclose(real + 1j * imag, naive.chirp(0.3, 0.217, curvature, 64 * LANES), atol=2e-7)


@pytest.mark.parametrize("parts", [1, 2])
def test_echoes_add_up_to_what_is_there(parts):
    rng = np.random.default_rng(1)
    sweeps, echoes, channels, n = 3, 4, 5, 100
    phases = rng.uniform(-0.5, 0.5, (sweeps, echoes, 3)) * [1.0, 1.0, 1e-5]
    gains = (rng.standard_normal((sweeps, echoes, channels, 2)) @ [1, 1j]).astype(np.complex64)
    gains[:, 2] = 0.0
    before = rng.standard_normal((sweeps, channels, n, parts)).astype(np.float32)
    out = before.copy()
    room = np.empty((2, 2 * LANES), np.float32)
    add_echoes(phases, gains.real.copy(), gains.imag.copy(), np.empty((4, LANES)), room, out)
    tones = np.array([[naive.chirp(*p, n) for p in sweep] for sweep in phases])
    echo = np.einsum("skc,skn->scn", gains, tones)
    np.testing.assert_allclose(out - before, np.stack([echo.real, echo.imag][:parts], axis=-1), atol=5e-6)


def test_the_converter_against_the_twin():
    values = np.random.default_rng(2).normal(0.0, 3.0, 500).astype(np.float32)
    expected = naive.digitized(values, 2.5, 0.25, -8.0, 7.0, 0.5)
    assert min(expected) == -4.0 and max(expected) == 3.5
    digitize(values, 2.5, 0.25, -8.0, 7.0, 0.5)
    np.testing.assert_array_equal(values, expected)
