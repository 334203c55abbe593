"""Estimates of any peaks of any frame: finite and sane, or refused."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.made_frames import clean_frame, noisy_frame, radar
from wideberth.sensors.radar.estimation.plots import estimate_plots

SHAPES = st.sampled_from([(1, 1), (1, 2), (1, 4), (4, 4), (2, 6), (4, 16)])


@settings(max_examples=60)
@given(
    shape=SHAPES,
    sweeps=st.integers(1, 9),
    beamformer=st.sampled_from(["conventional", "mvdr"]),
    sampling=st.sampled_from(["real", "complex"]),
    spacing=st.sampled_from([0.5, 0.7, 1.5]),
    echoes=st.lists(
        st.tuples(st.floats(0.5, 29.0), st.floats(-1.4, 1.4), st.floats(-1.4, 1.4), st.floats(-9.0, 9.0)), max_size=3
    ),
    snrs=st.lists(st.floats(-10.0, 70.0), min_size=3, max_size=3),
    peaks=st.lists(st.integers(0, 101), max_size=6),
    seed=st.integers(0, 1000),
)
def test_plots_are_sane(shape, sweeps, beamformer, sampling, spacing, echoes, snrs, peaks, seed):
    config = radar(
        *shape, beamformer, if_bandwidth_mhz=0.051, sampling=sampling, element_spacing_wavelengths=spacing, averages=9
    )
    rng = np.random.default_rng(seed)
    cleans = [clean_frame(config, sweeps, e) for e in echoes]
    silent = np.zeros((sweeps, config.channels, config.range_bins), np.complex64)
    frame = noisy_frame([*cleans, silent], [*snrs[: len(cleans)], 0.0], rng)
    found = estimate_plots(config, frame, np.array(peaks, dtype=int), np.ones(config.channels))
    n = len(found.z)
    assert found.z.shape == found.variance.shape == (n, 4)
    assert set(found.peak.tolist()) <= set(range(len(peaks)))
    assert np.isfinite(found.z[:, 0]).all() and np.isfinite(found.snr_db).all()
    assert (found.variance > 0.0).all()
    assert np.isfinite(found.variance[:, [0, 3]]).all()
    rates = found.z[:, 3]
    # A fit may climb a little beyond the range rates that are searched.
    assert (np.isnan(rates) | (np.abs(rates) < 60.0)).all()
    for column, exists in ((1, config.array_columns > 1), (2, config.array_rows > 1)):
        assert np.isfinite(found.z[:, column]).all() if exists else np.isnan(found.z[:, column]).all()
        if exists:
            assert (np.abs(found.z[:, column]) <= np.pi / 2).all()
        else:
            assert np.isinf(found.variance[:, column]).all()


@settings(max_examples=20)
@given(turn=st.floats(-3.0, 3.0), loud=st.floats(1e-8, 1e8), order=st.permutations([0, 1, 2]))
def test_units_phase_and_order_of_peaks_do_not_matter(turn, loud, order):
    config = radar(4, 16, if_bandwidth_mhz=0.051, sampling="complex")
    rng = np.random.default_rng(1)
    echoes = [(6.0, 0.1, 0.2, 5.0), (13.0, -0.4, 0.0, -3.0), (25.0, 0.0, -0.3, 8.0)]
    frame = noisy_frame([clean_frame(config, 4, e) for e in echoes], [20.0, 15.0, 18.0], rng).astype(np.complex128)
    peaks = np.array([21, 43, 84])
    one = estimate_plots(config, frame, peaks, np.ones(16))
    other = estimate_plots(config, frame * loud * np.exp(1j * turn), peaks[order], np.full(16, loud**2))
    back = np.argsort(np.array(order)[other.peak])
    np.testing.assert_allclose(other.z[back], one.z, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(other.snr_db[back], one.snr_db, atol=1e-4)
