"""Raw samples in NumPy files: any layout gives the same frames, and what does not fit is refused in words."""

import numpy as np
import pytest

from wideberth.errors import InputError
from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.raw.config import RawLayoutConfig
from wideberth.sensors.radar.raw.recording import RawRecording, write_raw

RADAR = RadarConfig(if_bandwidth_mhz=0.015625, averages=5)  # 64 real samples in a sweep
IQ = RadarConfig(if_bandwidth_mhz=0.015625, averages=5, sampling="complex")  # 32
REAL = np.random.default_rng(1).normal(size=(3, 5, 4, 64)).astype(np.float32)
COMPLEX = (REAL[..., ::2] + 1j * REAL[..., 1::2]).astype(np.complex64)


def recording(path, array, config=RADAR, **layout):
    np.save(path / "a.npy", array)
    return RawRecording(path / "a.npy", config, RawLayoutConfig(**layout))


def samples(found):
    return np.stack([frame.samples for frame in found.frames()])


def test_what_is_written_is_read(tmp_path):
    write_raw(tmp_path / "a.npy", iter(REAL), 3)
    found = RawRecording(tmp_path / "a.npy", RADAR)
    assert (found.n_frames, found.n_left_over) == (3, 0)
    np.testing.assert_array_equal(samples(found), REAL)
    assert [frame.t for frame in found.frames()] == pytest.approx([0.0, 0.1, 0.2])
    assert found.frame(0).middle(RADAR) == pytest.approx(2.5 * 2.048e-3)
    assert not list(tmp_path.glob("*.part"))
    with pytest.raises(IndexError):
        found.frame(3)


def test_channels_first(tmp_path):
    found = recording(tmp_path, REAL.transpose(2, 3, 0, 1), axes=("channel", "sample", "frame", "sweep"))
    np.testing.assert_array_equal(samples(found), REAL)


@pytest.mark.parametrize(
    ("array", "layout"),
    [
        (COMPLEX, {}),
        (COMPLEX.conj(), {"conjugate": True}),
        (REAL, {"interleaved_iq": True}),
        (np.stack([COMPLEX.real, COMPLEX.imag]), {"axes": ("iq", "frame", "sweep", "channel", "sample")}),
    ],
)
def test_complex_samples_in_four_ways(tmp_path, array, layout):
    found = samples(recording(tmp_path, array, IQ, **layout))
    assert found.dtype == np.complex64
    np.testing.assert_array_equal(found, COMPLEX)


def test_sweeps_without_frames_are_put_together(tmp_path):
    found = recording(tmp_path, REAL.reshape(15, 4, 64)[:13])
    assert (found.n_frames, found.n_left_over) == (2, 3)
    np.testing.assert_array_equal(samples(found), REAL[:2])
    assert found.frame(1).t == pytest.approx(5 * RADAR.sweep_interval)


def test_one_sweep_of_one_channel(tmp_path):
    found = recording(tmp_path, REAL[0, 0, 0], RadarConfig(if_bandwidth_mhz=0.015625, channels=1), axes=("sample",))
    np.testing.assert_array_equal(found.frame(0).samples[0, 0], REAL[0, 0, 0])


def test_counts_become_volts_without_their_mean(tmp_path):
    counts = np.round(REAL * 100 + 2048).astype(np.uint16)
    found = samples(recording(tmp_path, counts, volts_per_unit=1e-3, remove_mean=True))
    expected = (counts - counts.mean(axis=-1, keepdims=True)) * 1e-3
    np.testing.assert_allclose(found, expected, atol=1e-6)


def test_some_channels_in_another_order_and_settling_left_out(tmp_path):
    wide = np.concatenate([np.full((3, 5, 4, 6), 9.0, np.float32), REAL], axis=-1)
    found = recording(tmp_path, wide[:, :, [3, 0, 0, 1, 2]], channels=(1, 3, 4, 0), skip_samples=6)
    np.testing.assert_array_equal(samples(found), REAL)


def test_an_archive_may_carry_its_times(tmp_path):
    np.savez(tmp_path / "a.npz", cube=REAL, t=np.array([1.0, 1.5, 4.0]))
    found = RawRecording(tmp_path / "a.npz", RADAR)
    assert [frame.t for frame in found.frames()] == [1.0, 1.5, 4.0]
    np.savez(tmp_path / "b.npz", cube=REAL, other=REAL)
    with pytest.raises(InputError, match="member"):
        RawRecording(tmp_path / "b.npz", RADAR)
    np.savez(tmp_path / "c.npz", cube=REAL, t=np.array([1.0, 0.5, 4.0]))
    with pytest.raises(InputError, match="rise"):
        RawRecording(tmp_path / "c.npz", RADAR)


@pytest.mark.parametrize(
    ("array", "config", "layout", "words"),
    [
        (REAL[:, :, :3], RADAR, {}, "3 channels, the radar has 4"),
        (REAL[..., :60], RADAR, {}, "60 samples in a sweep, the radar takes 64"),
        (COMPLEX, RADAR, {}, "complex samples"),
        (REAL[..., :32], IQ, {}, "real samples"),
        (REAL[None], RADAR, {}, "5 dimensions"),
        (REAL[:0], RADAR, {}, "empty"),
        (REAL, RADAR, {"channels": (0, 1, 2, 4)}, "channels names 4"),
        (REAL, RADAR, {"axes": ("sweep", "channel", "sample")}, "4 dimensions, axes names 3"),
        (np.array([["a"]]), RADAR, {}, "not numbers"),
        (REAL[..., :63], IQ, {"interleaved_iq": True}, "no pairs"),
    ],
)
def test_what_does_not_fit_is_said(tmp_path, array, config, layout, words):
    with pytest.raises(InputError, match=words):
        recording(tmp_path, array, config, **layout)


@pytest.mark.parametrize(
    ("layout", "words"),
    [
        ({"axes": ("sweep", "channel")}, "sample"),
        ({"axes": ("sample", "sample")}, "at most once"),
        ({"axes": ("iq", "sample"), "interleaved_iq": True}, "without an axis iq"),
        ({"channels": (1, 1)}, "at most once"),
    ],
)
def test_layouts_that_contradict_themselves(layout, words):
    with pytest.raises(ValueError, match=words):
        RawLayoutConfig(**layout)


def test_damaged_and_missing_files(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        RawRecording(tmp_path / "none.npy", RADAR)
    with pytest.raises(InputError, match="not a file"):
        RawRecording(tmp_path, RADAR)
    for name in ("a.npy", "a.npz"):
        (tmp_path / name).write_bytes(b"nothing of the kind")
        with pytest.raises(InputError, match="not a NumPy file"):
            RawRecording(tmp_path / name, RADAR)
    np.save(tmp_path / "pickled.npy", np.array([{}]), allow_pickle=True)
    with pytest.raises(InputError, match="cannot be read"):
        RawRecording(tmp_path / "pickled.npy", RADAR)


def test_frames_that_differ_are_not_written(tmp_path):
    for frames in ([REAL[0], REAL[1, :4]], [REAL[0]], [REAL[0]] * 3):
        with pytest.raises(ValueError, match="frame"):
            write_raw(tmp_path / "a.npy", frames, 2)
        assert not list(tmp_path.iterdir())
