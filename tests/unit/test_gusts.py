"""Dryden gusts: exact discretisation, variance, spectrum."""

import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.signal import welch

from wideberth.vehicles import gust_kernels as gk
from wideberth.vehicles.gusts import TURBULENCE, DrydenGusts


@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize("x", [0.0, 1e-9, 1e-3, 0.5, 0.999, 1.0, 7.0, 60.0])
def test_moments_are_the_integrals(order: int, x: float) -> None:
    expected = quad(lambda s: s**order * math.exp(-x * s), 0.0, 1.0, epsabs=1e-14)[0]
    assert gk.decay_moment(order, x) == pytest.approx(expected, rel=1e-9)


def series(n: int, dt: float, seed: int, speed: float = 25.0) -> np.ndarray:
    gusts = DrydenGusts("low_moderate", seed)
    normals = gusts.normals(n)
    return np.array([gk.dryden_step(gusts.state, speed, dt, row, gusts.parameters) for row in normals])


def test_variance_is_that_of_the_table_at_any_step() -> None:
    # u forgets in L / V = 8 s, so 20 000 s hold some 1250 independent values: 2 % in sigma, 4 standard errors are 8 %.
    for dt, n in ((0.5, 40_000), (4.0, 5_000)):
        found = series(n, dt, 1)[200:].std(axis=0)
        assert found == pytest.approx(TURBULENCE["low_moderate"][3:], rel=0.08)


def test_spectrum_is_drydens() -> None:
    dt, speed, (lu, lv, lw, su, sv, sw) = 0.1, 25.0, TURBULENCE["low_moderate"]
    u, v, w = series(60_000, dt, 2)[500:].T
    for gust, length, sigma, lateral in ((u, lu, su, False), (v, lv, sv, True), (w, lw, sw, True)):
        frequency, density = welch(gust, 1.0 / dt, nperseg=2048)
        s = 2 * math.pi * frequency * length / speed
        if lateral:
            expected = 2 * sigma**2 * length / speed * (1 + 3 * s**2) / (1 + s**2) ** 2
        else:
            expected = 4 * sigma**2 * length / speed / (1 + s**2)
        # About 57 windows each; averaged over 30 frequencies and more the error is a few per cent.
        for low, high in ((0.02, 0.1), (0.1, 0.4), (0.4, 1.5)):
            band = (frequency > low) & (frequency < high)
            assert density[band].sum() == pytest.approx(expected[band].sum(), rel=0.2)


def test_calm_air_and_unknown_names() -> None:
    assert DrydenGusts("none", 0).normals(5).shape == (0, 5)
    with pytest.raises(ValueError, match="severe"):
        DrydenGusts("severe", 0)
