"""What must hold of the samples of any radar and any targets."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tests.naive import radar_sweeps as naive
from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.sweeps.config import ReceiverConfig
from wideberth.sensors.radar.sweeps.paths import Multipath, RadarTarget
from wideberth.sensors.radar.sweeps.receiver import coupling_matrix, sample_noise, saturated
from wideberth.sensors.radar.sweeps.simulate import simulate_noise, simulate_sweeps

RANGE = 0.2998 * 32.0


@st.composite
def radars(draw: st.DrawFn, /, **receiver: float) -> RadarConfig:
    rows, columns = draw(st.integers(1, 3)), draw(st.integers(1, 3))
    sweep_time = draw(st.sampled_from([0.032, 0.0321, 0.064]))
    return RadarConfig(
        carrier_frequency_ghz=draw(st.floats(1.0, 24.0)),
        bandwidth_mhz=draw(st.floats(50.0, 500.0)),
        sweep_time_ms=sweep_time,
        sweep_interval_ms=draw(st.sampled_from([None, 0.07, 0.5])),
        channels=rows * columns,
        array_rows=rows,
        element_spacing_wavelengths=draw(st.floats(0.3, 1.5)),
        sampling=draw(st.sampled_from(["real", "complex"])),
        azimuth_beamwidth_deg=draw(st.sampled_from([None, 80.0])),
        elevation_beamwidth_deg=draw(st.sampled_from([None, 18.0])),
        receiver=ReceiverConfig(**receiver),
    )


# No beat is beyond an end of the band, where the ideal filter would take it out.
targets = st.lists(
    st.builds(
        RadarTarget,
        range=st.floats(0.25 * RANGE, 0.8 * RANGE),
        azimuth=st.floats(-0.8, 0.8),
        elevation=st.floats(-0.2, 0.2),
        range_rate=st.floats(-50.0, 50.0),
        rcs=st.floats(0.1, 0.5),
        azimuth_rate=st.floats(-1.0, 1.0),
        elevation_rate=st.floats(-1.0, 1.0),
    ),
    min_size=1,
    max_size=3,
)


@given(radars(), targets, st.integers(1, 4))
def test_echoes_are_those_of_the_phase_at_every_sample(
    radar: RadarConfig, scene: list[RadarTarget], n_sweeps: int
) -> None:
    got = simulate_sweeps(radar, scene, n_sweeps, 1) - simulate_noise(radar, n_sweeps, 1)
    expected = naive.frame(radar, scene, n_sweeps)
    if radar.sampling == "real":
        expected = np.sqrt(2.0) * expected.real
    strongest = np.abs(simulate_sweeps(radar, scene, n_sweeps, 1)).max()
    np.testing.assert_allclose(got, expected, rtol=0, atol=1e-5 * strongest)


@given(radars(), targets, targets, st.floats(0.5, 5.0))
def test_echoes_of_two_scenes_add_up(
    radar: RadarConfig, one: list[RadarTarget], two: list[RadarTarget], height: float
) -> None:
    ground = Multipath(height + RANGE, -0.5)
    noise = simulate_noise(radar, 2, 1)
    first, second, both = (simulate_sweeps(radar, s, 2, 1, multipath=ground) for s in (one, two, [*one, *two]))
    np.testing.assert_allclose(both - noise, first + second - 2 * noise, rtol=0, atol=1e-5 * np.abs(both).max())


@given(radars(channel_coupling_db=-12.0))
def test_coupling_is_lossless_and_reciprocal(radar: RadarConfig) -> None:
    coupling = coupling_matrix(radar)
    np.testing.assert_allclose(coupling @ coupling.conj().T, np.eye(radar.channels), atol=1e-12)
    np.testing.assert_allclose(coupling, coupling.T, atol=1e-12)


@given(radars(adc_bits=5, noise_rms_lsb=1.5), targets)
def test_what_saturates_is_seen_and_nothing_leaves_the_converters_range(
    radar: RadarConfig, scene: list[RadarTarget]
) -> None:
    samples = simulate_sweeps(radar, scene, 2, 1)
    exact = simulate_sweeps(radar.model_copy(update={"receiver": ReceiverConfig()}), scene, 2, 1)
    step = sample_noise(radar) / radar.receiver.noise_rms_lsb
    kinds = (np.real, np.imag) if radar.sampling == "complex" else (np.real,)
    codes, wanted = (np.stack([part(values) for part in kinds]) / step for values in (samples, exact))
    np.testing.assert_allclose(codes, np.clip(wanted, -16.0, 15.0), rtol=0, atol=0.501)
    np.testing.assert_allclose(codes, np.round(codes), rtol=0, atol=1e-4)
    at_the_end = ((codes < -15.5) | (codes > 14.5)).any(axis=0)
    np.testing.assert_array_equal(saturated(radar, samples), np.count_nonzero(at_the_end, axis=-1))
