"""Bounds against the information of all samples, by differences."""

import numpy as np
import pytest

from tests.made_frames import radar
from tests.naive.radar_estimation import echo
from wideberth.sensors.radar.array import steering_vector
from wideberth.sensors.radar.estimation.cramer_rao import bounds


@pytest.mark.parametrize(("rows", "channels"), [(4, 16), (1, 4), (2, 6)])
def test_bounds_are_those_of_all_samples(rows, channels):
    config = radar(rows, channels, sampling="complex", if_bandwidth_mhz=0.05)
    sweeps, snr, at, steps = 5, 100.0, np.array([6.0, 0.3, -0.2, 3.0]), np.array([1e-4, 1e-4, 1e-4, 1e-4])
    if rows == 1:
        at[2] = 0.0

    def samples(p):
        wave = steering_vector(config, p[1], p[2])
        return (echo(config, sweeps, p[0], p[3])[:, None] * wave[:, None]).ravel()

    columns = [(samples(at + s) - samples(at - s)) / (2 * s.sum()) for s in np.diag(steps)]
    if rows == 1:
        del columns[2]
    j = np.stack([samples(at), 1j * samples(at), *columns])
    exact = np.sqrt(np.diag(np.linalg.inv(2 * snr * (j.conj() @ j.T).real))[2:])
    found = bounds(config, 20.0, azimuth=at[1], elevation=at[2], sweeps=sweeps)
    np.testing.assert_allclose(found[np.isfinite(found)], exact, rtol=0.01)
    assert np.isinf(found[2]) == (rows == 1)


def test_a_known_rate_helps_and_one_sweep_tells_no_range_without_it():
    config = radar(4, 16)
    assert np.isinf(bounds(config, 20.0, sweeps=1)[[0, 3]]).all()
    known = bounds(config, [10.0, 20.0], sweeps=1, rate_known=True)
    assert known.shape == (2, 4)
    sigma = config.range_bin * np.sqrt(6.0 / (4 * np.pi**2 * 16 * 100.0))
    assert known[1, 0] == pytest.approx(sigma)
    assert known[0, 0] == pytest.approx(sigma * np.sqrt(10.0))
    with pytest.raises(ValueError, match="snr_db"):
        bounds(config, np.nan)
    with pytest.raises(ValueError, match="sweeps"):
        bounds(config, 10.0, sweeps=0)
