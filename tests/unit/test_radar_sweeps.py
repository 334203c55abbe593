import itertools
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from tests.naive import radar_sweeps as naive
from wideberth.analysis.sizing_config import load_sensor
from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.presets import PRESETS
from wideberth.sensors.radar.sweeps.fluctuation import draw_fluctuation
from wideberth.sensors.radar.sweeps.paths import RadarTarget
from wideberth.sensors.radar.sweeps.simulate import simulate_frames, simulate_noise, simulate_sweeps

SIZING = Path(__file__).resolve().parents[2] / "sizing"
LINE = RadarConfig()
COMPLEX = RadarConfig(sampling="complex")
PLANE = RadarConfig(sweep_time_ms=0.25, channels=6, array_rows=2, sweep_interval_ms=0.3)
SPEED = 30.0
SHIFT = SPEED * 10.25e9 * 2.048e-3 / 500e6


def echoes(radar, targets, n_sweeps, **kwargs):
    """Samples without the noise; nothing else is random."""
    return simulate_sweeps(radar, targets, n_sweeps, 7, **kwargs) - simulate_noise(radar, n_sweeps, 7)


def fine_range(radar, sweep):
    """Apparent range of the greatest peak of one channel, by a spectrum with 64 times as many points."""
    spectrum = np.abs(np.fft.fft(sweep * np.hanning(len(sweep)), 64 * len(sweep)))[: 64 * radar.range_bins]
    return spectrum.argmax() / 64 * radar.range_bin


@pytest.mark.parametrize("radar", [LINE, COMPLEX, PLANE, PLANE.model_copy(update={"sampling": "complex"})])
def test_against_the_phase_at_every_sample(radar):
    targets = [
        RadarTarget(20.0, 0.3, -0.05, 25.0, 2e3, azimuth_rate=0.4, elevation_rate=-0.3),
        RadarTarget(55.0, -0.2, 0.1, -70.0, 1e5),
    ]
    expected = naive.frame(radar, targets, 5)
    if radar.sampling == "real":
        expected = np.sqrt(2.0) * expected.real
    np.testing.assert_allclose(echoes(radar, targets, 5), expected, rtol=0, atol=3e-6 * np.abs(expected).max())


def test_shape_and_kind_of_samples():
    assert simulate_noise(LINE, 2, 1).shape == (2, 4, 4096)
    assert simulate_noise(LINE, 2, 1).dtype == np.float32
    assert simulate_noise(COMPLEX, 2, 1).shape == (2, 4, 2048)
    assert simulate_noise(COMPLEX, 2, 1).dtype == np.complex64


@pytest.mark.parametrize("radar", [LINE, COMPLEX])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_an_opening_target_seems_farther_and_a_closing_one_nearer(radar, sign):
    (sweep,) = echoes(radar, [RadarTarget(100.0, range_rate=sign * SPEED, rcs=100.0)], 1)
    assert pytest.approx(1.2595, abs=1e-4) == SHIFT
    assert fine_range(radar, sweep[0]) - 100.0 == pytest.approx(sign * SHIFT, abs=0.01)


def test_four_bins_are_crossed_within_twenty_sweeps():
    frame = echoes(LINE, [RadarTarget(100.0, range_rate=SPEED, rcs=100.0)], 20)[:, 0]
    places = np.array([fine_range(LINE, sweep) for sweep in frame])
    step = SPEED * LINE.sweep_interval
    np.testing.assert_allclose(places - SHIFT - 100.0, step * (np.arange(20) - 9.5), atol=0.01)
    assert (places[-1] - places[0]) / LINE.range_bin == pytest.approx(3.9, abs=0.05)


def test_the_phase_turns_from_sweep_to_sweep_by_the_doppler_frequency():
    frame = echoes(COMPLEX, [RadarTarget(100.0, range_rate=1.5, rcs=1e3)], 6)[:, 0, 0]
    first_frequency = 10e9
    turn = 2 * np.pi * 2 * 1.5 / naive.C * first_frequency * COMPLEX.sweep_interval
    difference = np.angle(frame[1:] / frame[:-1] * np.exp(-1j * turn))
    np.testing.assert_allclose(difference, 0.0, atol=2e-3)


def test_two_targets_in_one_cell_add_up_with_their_phases():
    # A quarter of a wavelength apart, or a half: phases there and back are opposite, or the same.
    quarter = COMPLEX.wavelength / 4
    power = [
        np.mean(np.abs(echoes(COMPLEX, [RadarTarget(100.0, rcs=1e3), RadarTarget(r, rcs=1e3)], 1)) ** 2)
        for r in (100.0 + quarter, 100.0 + 2 * quarter)
    ]
    alone = np.mean(np.abs(echoes(COMPLEX, [RadarTarget(100.0, rcs=1e3)], 1)) ** 2)
    assert power[0] < 0.01 * alone
    assert power[1] == pytest.approx(4 * alone, rel=0.01)


def test_a_target_beyond_the_instrumented_range_is_stopped_by_the_filter_or_folds():
    far = [RadarTarget(640.0, rcs=1e5)]
    assert np.abs(echoes(LINE, far, 1)).max() == 0.0
    with_filter = LINE.model_copy(
        update={"receiver": LINE.receiver.model_copy(update={"if_filter_order": 5})},
    )
    folded = echoes(with_filter, far, 1)[0, 0]
    assert fine_range(LINE, folded) == pytest.approx(2 * LINE.instrumented_range - 640.0, abs=0.05)
    ratio = np.mean(folded**2) / naive.received_power(LINE, 640.0, far[0])
    assert 10 * np.log10(ratio) == pytest.approx(-10 * np.log10(1 + (640.0 / LINE.instrumented_range) ** 10), abs=0.05)


def test_seeds():
    target = [RadarTarget(50.0, swerling=1)]
    np.testing.assert_array_equal(simulate_sweeps(LINE, target, 2, 3), simulate_sweeps(LINE, target, 2, 3))
    assert not np.array_equal(simulate_noise(LINE, 2, 3), simulate_noise(LINE, 2, 4))
    assert not np.array_equal(simulate_noise(LINE, 2, 3), simulate_noise(LINE, 2, (3, 0)))
    # The noise is that of the seed with any targets, and the fluctuation of one is not that of another.
    both = echoes(LINE, [*target, RadarTarget(70.0, swerling=1)], 2)
    second = both - echoes(LINE, target, 2)
    assert fine_range(LINE, second[0, 0]) == pytest.approx(70.0, abs=0.02)


def test_frames_are_those_of_single_calls_and_are_made_one_by_one():
    scenes = itertools.cycle([[RadarTarget(50.0, rcs=100.0, swerling=3)], []])
    frames = simulate_frames(LINE, scenes, 2, 5)
    first, second = next(frames), next(frames)
    np.testing.assert_array_equal(first, simulate_sweeps(LINE, next(scenes), 2, (5, 0)))
    np.testing.assert_array_equal(second, simulate_noise(LINE, 2, (5, 1)))


def test_fluctuation_has_the_distributions_of_swerling():
    rng = np.random.default_rng(11)
    for swerling, law in ((1, stats.expon()), (3, stats.gamma(2.0, scale=0.5))):
        factor = draw_fluctuation(np.full(20_000, swerling), rng)
        assert stats.kstest(np.abs(factor) ** 2, law.cdf).pvalue > 0.001
        assert stats.kstest(np.angle(factor), stats.uniform(-np.pi, 2 * np.pi).cdf).pvalue > 0.001
    np.testing.assert_array_equal(draw_fluctuation([0, 0], rng), 1.0)


def test_a_cross_section_holds_for_a_frame_and_changes_from_one_to_the_next():
    radar = RadarConfig(sweep_time_ms=0.064, channels=1)
    target = [RadarTarget(15.0, rcs=10.0, swerling=1)]
    power = np.array([np.mean(f**2, axis=(1, 2)) for f in simulate_frames(radar, itertools.repeat(target, 300), 3, 1)])
    np.testing.assert_allclose(power / power.mean(axis=1, keepdims=True), 1.0, atol=0.2)
    law = stats.expon(scale=naive.received_power(radar, 15.0, target[0]))
    assert stats.kstest(power.mean(axis=1), law.cdf).pvalue > 0.001


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"n_sweeps": 0}, "n_sweeps must be a whole number"),
        ({"n_sweeps": 2.5}, "n_sweeps must be a whole number"),
        ({"seed": -1}, "seed must be a whole number"),
        ({"seed": 0.5}, "seed must be a whole number"),
        ({"seed": ()}, "seed must be a whole number"),
        ({"start_time": np.nan}, "start_time must be finite"),
        ({"targets": [RadarTarget(1.0, range_rate=-100.0, rcs=1e-6)]}, "passes through the radar"),
        ({"targets": [RadarTarget(0.1, rcs=10.0)]}, "more power than is sent"),
    ],
)
def test_bad_arguments(change, words):
    arguments = {"targets": [], "n_sweeps": 10, "seed": 1, **change}
    with pytest.raises(ValueError, match=words):
        simulate_sweeps(LINE, **arguments)


@pytest.mark.parametrize("name", ["range", "azimuth", "elevation", "range_rate", "rcs", "azimuth_rate"])
def test_targets_are_numbers(name):
    with pytest.raises(ValueError, match=f"{name} must be"):
        RadarTarget(**{"range": 10.0, name: np.nan})


def test_targets_have_a_range_a_section_and_a_known_model():
    for values in (
        {"range": 5.0, "range_rate": 2e5},
        {"range": 0.0},
        {"range": -5.0},
        {"range": 5.0, "rcs": 0.0},
        {"range": 5.0, "swerling": 2},
    ):
        with pytest.raises(ValueError, match="must be"):
            RadarTarget(**values)


def test_presets_have_the_coupling_of_the_table_and_a_converter():
    assert set(PRESETS) == {"table_5_1", "uplooking_4x4", "onboard_unit"}
    for radar in PRESETS.values():
        assert radar.receiver.channel_coupling_db == -20.0
        assert radar.receiver.adc_bits == 12
    assert PRESETS["onboard_unit"].boresight_azimuths_deg == (0.0, 120.0, 240.0)
    assert PRESETS["uplooking_4x4"].array_columns == PRESETS["uplooking_4x4"].array_rows == 4


@pytest.mark.parametrize(("preset", "file"), [("table_5_1", "radar_table_5_1"), ("uplooking_4x4", "ground_radar")])
def test_presets_agree_with_the_sensors_of_sizing(preset, file):
    sized = load_sensor(SIZING / f"{file}.toml")
    # What sizing has nothing to do with.
    other = {"kind", "array_rows", "receiver", "ceiling_m"}
    radar = PRESETS[preset]
    assert radar.model_dump(exclude=other) == sized.model_dump(exclude=other)
