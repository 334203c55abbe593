"""Raw samples from NumPy files, of a real radar or a simulated one: an array of any layout becomes frames of sweeps.

A file is an .npy, read piece by piece whatever its size, or an .npz with that array and, where there is one, an array
"t" of the start of each frame, s. What is written here is (frame, sweep, channel, sample), float32 or complex64, volts
at the receiver's input over 1 ohm.
"""

import os
import zipfile
import zlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from wideberth.errors import InputError
from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.raw.config import RawLayoutConfig

Samples = NDArray[np.float32] | NDArray[np.complex64]
_NPY = b"\x93NUMPY"
_ORDER = ("frame", "sweep", "channel", "sample", "iq")


@dataclass(frozen=True, slots=True)
class RawFrame:
    """The sweeps of one frame.

    Attributes
    ----------
    t : float
        Start of the first sweep, s.
    samples : ndarray of float32 or complex64, shape (sweeps, channels, samples)
        Volts over 1 ohm at the receiver's input.
    """

    t: float
    samples: Samples

    def middle(self, config: RadarConfig) -> float:
        """Return the time of the middle of the frame, at which a plot is valid, s."""
        sweeps = len(self.samples)
        return self.t + 0.5 * ((sweeps - 1) * config.sweep_interval + config.sweep_time_ms * 1e-3)


class RawRecording:
    """A file of raw samples, read frame by frame.

    Parameters
    ----------
    path : Path
    config : RadarConfig
        Of the radar that made it.
    layout : RawLayoutConfig, optional

    Attributes
    ----------
    n_frames : int
    n_left_over : int
        Sweeps at the end that do not fill a frame, and are left out.

    Raises
    ------
    InputError
        If there is no such file, it is damaged, or its array does not fit layout and radar.
    """

    def __init__(self, path: Path, config: RadarConfig, layout: RawLayoutConfig | None = None) -> None:
        self._config = config
        self._layout = RawLayoutConfig() if layout is None else layout
        self._name = path.name
        array, times = _read(path, self._layout.member)
        if array.dtype.kind not in "iufc":
            raise InputError(f"{self._name}: holds {array.dtype}, not numbers")
        try:
            axes = self._layout.axes_of(array.ndim)
        except ValueError as error:
            raise InputError(f"{self._name}: {error}") from None
        has_frames = "frame" in axes
        # Views only, so that a mapped file stays on disk until a frame is wanted.
        wanted = [name for name in _ORDER if name in axes]
        array = np.transpose(array, [axes.index(name) for name in wanted])
        for place, name in enumerate(_ORDER[:3]):
            if name not in axes:
                array = np.expand_dims(array, place)
        self._array = array
        self._check()
        sweeps = array.shape[1]
        self._per_frame = sweeps if has_frames else min(sweeps, config.averages)
        self.n_frames = array.shape[0] if has_frames else sweeps // self._per_frame
        self.n_left_over = 0 if has_frames else sweeps % self._per_frame
        self._has_frames = has_frames
        self._times = self._checked_times(times)

    def _check(self) -> None:
        """Raise where channels or samples are not those of the radar."""
        config, layout, shape = self._config, self._layout, self._array.shape
        if 0 in shape:
            raise InputError(f"{self._name}: the array is empty, shape {shape}")
        if self._array.ndim == 5 and shape[4] != 2:
            raise InputError(f"{self._name}: the axis iq has {shape[4]} places, not 2")
        is_complex = self._array.ndim == 5 or layout.interleaved_iq or self._array.dtype.kind == "c"
        if is_complex != (config.sampling == "complex"):
            has = "complex" if is_complex else "real"
            raise InputError(
                f"{self._name}: holds {has} samples, the radar's sampling is {config.sampling}: set sampling = "
                f'"{has}" and its if_bandwidth_mhz' + ("" if is_complex else ", or name the axis iq in [layout]")
            )
        if layout.channels is not None and max(layout.channels) >= shape[2]:
            raise InputError(f"{self._name}: channels names {max(layout.channels)}, the file has 0 to {shape[2] - 1}")
        channels = shape[2] if layout.channels is None else len(layout.channels)
        if channels != config.channels:
            raise InputError(
                f"{self._name}: {channels} channels, the radar has {config.channels} (array of shape {shape} as frame, "
                "sweep, channel, sample): set axes or channels in [layout], or channels of the radar"
            )
        if layout.interleaved_iq and shape[3] % 2:
            raise InputError(f"{self._name}: {shape[3]} values in a sweep are no pairs of in phase and quadrature")
        samples = shape[3] // (2 if layout.interleaved_iq else 1) - layout.skip_samples
        if samples != config.samples_per_sweep:
            raise InputError(
                f"{self._name}: {samples} samples in a sweep, the radar takes {config.samples_per_sweep} "
                f"({config.sampling_frequency / 1e6:g} MHz for {config.sweep_time_ms:g} ms): set if_bandwidth_mhz, "
                "sweep_time_ms or axes"
            )

    def _checked_times(self, times: NDArray[np.float64] | None) -> NDArray[np.float64] | None:
        if times is None:
            return None
        if times.shape != (self.n_frames,):
            raise InputError(f"{self._name}: t has shape {times.shape}, there are {self.n_frames} frames")
        if not np.isfinite(times).all() or np.any(np.diff(times) <= 0.0):
            raise InputError(f"{self._name}: t must be finite and rise")
        return times

    def _time(self, k: int) -> float:
        if self._times is not None:
            return float(self._times[k])
        interval = self._layout.frame_interval_s
        if interval is None:
            sweeps = self._per_frame * self._config.sweep_interval
            interval = self._config.update_interval_s if self._has_frames else sweeps
        return self._layout.t_start_s + k * interval

    def frame(self, k: int) -> RawFrame:
        """Return frame `k`, from 0.

        Raises
        ------
        IndexError
            If there is no such frame.
        """
        if not 0 <= k < self.n_frames:
            raise IndexError(f"frame {k}: there are {self.n_frames}")
        layout = self._layout
        if self._has_frames:
            part = self._array[k]
        else:
            part = self._array[0, k * self._per_frame : (k + 1) * self._per_frame]
        if layout.channels is not None:
            part = part[:, list(layout.channels)]
        samples: Samples
        if part.ndim == 4:
            samples = (part[..., 0] + 1j * part[..., 1].astype(np.float32)).astype(np.complex64)
        elif layout.interleaved_iq:
            samples = (part[..., 0::2] + 1j * part[..., 1::2].astype(np.float32)).astype(np.complex64)
        else:
            samples = part.astype(np.complex64 if part.dtype.kind == "c" else np.float32)
        samples = samples[..., layout.skip_samples :].copy()
        if layout.conjugate:
            np.conjugate(samples, out=samples)
        if layout.remove_mean:
            samples -= samples.mean(axis=-1, keepdims=True)
        if layout.volts_per_unit != 1.0:
            samples *= np.float32(layout.volts_per_unit)
        return RawFrame(self._time(k), samples)

    def frames(self) -> Iterator[RawFrame]:
        """Yield all frames in order."""
        for k in range(self.n_frames):
            yield self.frame(k)


def _read(path: Path, member: str | None) -> tuple[NDArray[np.generic], NDArray[np.float64] | None]:
    if not path.is_file():
        raise InputError(f"{path}: {'not a file' if path.exists() else 'no such file'}")
    with path.open("rb") as file:
        start = file.read(len(_NPY))
    if start != _NPY and not zipfile.is_zipfile(path):
        raise InputError(f"{path.name}: not a NumPy file: write the samples with numpy.save or numpy.savez")
    try:
        if path.suffix != ".npz":
            return np.load(path, mmap_mode="r", allow_pickle=False), None
        with np.load(path, allow_pickle=False) as archive:
            names = [name for name in archive.files if name != "t"]
            if member is None:
                member = "samples" if "samples" in names else names[0] if len(names) == 1 else None
            if member not in archive.files:
                raise InputError(
                    f"{path.name}: holds {', '.join(archive.files) or 'nothing'}: name one by member in [layout]"
                )
            times = np.asarray(archive["t"], dtype=np.float64) if "t" in archive.files and member != "t" else None
            return archive[member], times
    except (ValueError, EOFError, OSError, zipfile.BadZipFile, zlib.error, KeyError, NotImplementedError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{path.name}: cannot be read as a NumPy file: {error}") from None


def write_raw(path: Path, frames: Iterable[NDArray[np.float32 | np.complex64]], n_frames: int) -> None:
    """Write frames of one shape to an .npy, one by one.

    Parameters
    ----------
    path : Path
        Replaced once all is written.
    frames : iterable of ndarray, shape (sweeps, channels, samples)
    n_frames : int
        How many come.

    Raises
    ------
    ValueError
        If there are none, fewer or more, or their shapes or types differ.
    OSError
        If the file cannot be written.
    """
    partial = path.with_name(path.name + ".part")
    file = None
    count = 0
    try:
        for count, frame in enumerate(frames, start=1):
            if file is None:
                shape = (n_frames, *frame.shape)
                file = np.lib.format.open_memmap(partial, mode="w+", dtype=frame.dtype, shape=shape)
            if count > n_frames or frame.shape != file.shape[1:] or frame.dtype != file.dtype:
                raise ValueError(f"frame {count} of {n_frames}: {frame.dtype} {frame.shape}, expected {file.shape[1:]}")
            file[count - 1] = frame
        if file is None or count != n_frames:
            raise ValueError(f"{count} frames came, {n_frames} were announced")
        file.flush()
        del file
        os.replace(partial, path)
    finally:
        partial.unlink(missing_ok=True)
