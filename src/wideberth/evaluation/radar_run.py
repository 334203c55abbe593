"""A file of raw samples through a radar's processing, and the plots in a table and in the form that trackers read."""

import math
import zipfile
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from wideberth.errors import InputError
from wideberth.evaluation.radar_setup import RadarSetup
from wideberth.sensors.radar.config import PlotModelConfig, RadarConfig
from wideberth.sensors.radar.estimation.calibration import ArrayCalibration
from wideberth.sensors.radar.plot_model import plot_sigmas
from wideberth.sensors.radar.processing.frame import Processed
from wideberth.sensors.radar.processing.noise_statistics import NoiseStatistics, noise_statistics
from wideberth.sensors.radar.processing.radar_processor import RadarProcessor
from wideberth.sensors.radar.raw.recording import RawRecording
from wideberth.types import FloatArray, Scan

_COLUMNS = ("range_m", "azimuth_rad", "elevation_rad", "range_rate_mps")
_SPREAD_COLUMNS = ("range_variance_m2", "azimuth_variance_rad2", "elevation_variance_rad2", "range_rate_variance_m2ps2")


@dataclass(frozen=True, slots=True)
class RadarRun:
    """What came of a file.

    Attributes
    ----------
    scans : list of Scan
        Of the frames that could be used, in order.
    snr_db : list of ndarray
        Of each scan's plots.
    frames : int
        In the file.
    left_over : int
        Sweeps at the file's end that fill no frame.
    rejects : mapping of str to int
        What was left out, by cause.
    channel_scans : ndarray of int, shape (channels,)
        In how many scans each channel was used.
    complaint : str
        Why the last frame that could not be used was; empty without one.
    """

    scans: list[Scan]
    snr_db: list[FloatArray]
    frames: int
    left_over: int
    rejects: Mapping[str, int]
    channel_scans: NDArray[np.int64]
    complaint: str

    @property
    def plots(self) -> int:
        """How many plots there are."""
        return sum(len(scan.z) for scan in self.scans)

    def left_out(self) -> list[tuple[str, int]]:
        """Return what was left out in words, and how often: causes, channels (from 0), and sweeps at the end."""
        rows = [(cause.replace("_", " "), count) for cause, count in sorted(self.rejects.items())]
        missing = len(self.scans) - self.channel_scans
        rows += [(f"channel {c} (from 0) not used, scans", int(missing[c])) for c in np.flatnonzero(missing)]
        return [*rows, ("sweeps at the end that fill no frame", self.left_over)] if self.left_over else rows


def process_recording(
    setup: RadarSetup,
    recording: RawRecording,
    noise: NoiseStatistics | None,
    *,
    calibration: ArrayCalibration | None = None,
    progress: Callable[[int, int], None] = lambda done, total: None,
    watch: Callable[[int, float, Processed], None] = lambda k, t, processed: None,
) -> RadarRun:
    """Process all frames of a file.

    Parameters
    ----------
    setup : RadarSetup
    recording : RawRecording
    noise : NoiseStatistics or None
        None: the link budget's. One that is later than the samples, made after them or by another clock, counts as made
        when they begin.
    calibration : ArrayCalibration or None
    progress : callable
        Told how many frames are done, of how many.
    watch : callable
        Told the number, from 0, the time and the steps of each frame that was used.

    Raises
    ------
    InputError
        If the noise or the calibration is of another radar.
    """
    start = recording.frame(0).middle(setup.radar)
    try:
        processor = RadarProcessor(
            setup.radar,
            noise and noise.dated(start),
            sensor=setup.name,
            position=setup.position,
            attitude=setup.attitude,
            calibration=calibration,
        )
    except ValueError as error:
        raise InputError(str(error)) from None
    scans, snr = [], []
    used = np.zeros(setup.radar.channels, np.int64)
    for k, frame in enumerate(recording.frames(), start=1):
        scan = processor.step(frame.middle(setup.radar), frame.samples)
        if scan is not None:
            assert processor.last is not None
            scans.append(scan)
            used += processor.last.channels
            snr.append(processor.last.estimates.snr_db[processor.last.kept])
            watch(k - 1, scan.t, processor.last)
        progress(k, recording.n_frames)
    rejects = Counter(processor.rejects)
    return RadarRun(scans, snr, recording.n_frames, recording.n_left_over, rejects, used, processor.complaint)


def noise_of_recording(setup: RadarSetup, recording: RawRecording) -> NoiseStatistics:
    """Return the noise statistics of a file without targets.

    Raises
    ------
    InputError
        If no frame of it can be used.
    """
    last = recording.frame(recording.n_frames - 1)
    try:
        return noise_statistics(setup.radar, (frame.samples for frame in recording.frames()), last.middle(setup.radar))
    except ValueError as error:
        raise InputError(str(error)) from None


def write_plot_table(path: Path, run: RadarRun) -> None:
    """Write one row for each plot as Parquet: scan, time, sensor, the four elements with their variances, SNR.

    Angles are in the array's axes. NaN where an element is not measured.

    Parameters
    ----------
    path : Path
    run : RadarRun
    """
    z = np.concatenate([np.empty((0, 4)), *(scan.z for scan in run.scans)])
    variance = [np.diagonal(scan.R, axis1=1, axis2=2) for scan in run.scans]
    spread = np.concatenate([np.empty((0, 4)), *variance])
    numbers = [len(scan.z) for scan in run.scans]
    columns = {
        "scan": np.repeat(np.arange(len(run.scans)), numbers),
        "time_s": np.repeat([scan.t for scan in run.scans], numbers),
        "sensor": np.repeat([scan.sensor for scan in run.scans], numbers).astype(str),
        "kind": np.repeat([scan.kind for scan in run.scans], numbers).astype(str),
        **{name: z[:, k] for k, name in enumerate(_COLUMNS)},
        **{name: spread[:, k] for k, name in enumerate(_SPREAD_COLUMNS)},
        "snr_db": np.concatenate([np.empty(0), *run.snr_db]),
    }
    pq.write_table(pa.table(columns), path)


def write_plot_file(path: Path, setup: RadarSetup, run: RadarRun, truth: Path | None = None) -> None:
    """Write the plots as the NPZ that `wideberth track` reads, in the array's axes with the array's pose.

    Parameters
    ----------
    path : Path
    setup : RadarSetup
    run : RadarRun
    truth : Path or None
        As `wideberth radar simulate` writes it: goes with the plots, and says where a radar on board was.

    Raises
    ------
    InputError
        If there is no scan, the radar does not measure both angles, or the truth is not of these scans.
    """
    if not run.scans:
        raise InputError("no frame could be used: there are no scans for a tracker")
    if run.scans[0].kind != "radar":
        raise InputError("an array of one row or column measures one angle: a plot file for trackers needs both")
    rows = np.concatenate([np.empty((0, 4)), *(scan.z for scan in run.scans)])
    variance = np.concatenate([np.empty((0, 4)), *(np.diagonal(scan.R, axis1=1, axis2=2) for scan in run.scans)])
    number = np.repeat(np.arange(len(run.scans)), [len(scan.z) for scan in run.scans])
    t = np.array([scan.t for scan in run.scans])
    steps = np.diff(t)
    dt = float(np.median(steps)) if len(steps) else setup.radar.update_interval_s
    detection = run.scans[0].detection
    assert detection is not None
    place = setup.position * [1.0, 1.0, -1.0]
    each = _of_aircraft(np.sqrt(variance), rows, setup.radar)
    sigma = _typical(each, setup.radar)
    measured = bool(np.isfinite(rows[:, 3]).any())
    more: dict[str, Any] = {"sigma_range_rate": sigma[3]} if measured else {}
    if truth is not None:
        more |= _truth_at(truth, t, 0.5 * dt)
    with path.open("wb") as file:
        np.savez_compressed(
            file,
            meas_seed=np.zeros(len(rows), np.int64),
            meas_scan=number,
            meas_time=t[number],
            meas_range=rows[:, 0],
            meas_az=rows[:, 1],
            meas_el=rows[:, 2],
            meas_range_rate=rows[:, 3],
            meas_sigma=each,
            time=t,
            dt=dt,
            sigma=sigma[:3],
            p_d=min(0.999, max(0.05, float(np.mean(detection.probabilities)))),
            r_max=setup.radar.range_limit,
            radar_pos=place,
            radar_att=setup.angles,
            field_of_view=_field_of_view(run.scans[0]),
            **more,
        )


def _truth_at(path: Path, t: FloatArray, slack: float) -> dict[str, Any]:
    """Return the truth's arrays at the times of scans."""
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        times = np.asarray(arrays.pop("time"), dtype=np.float64)
        after = np.clip(np.searchsorted(times, t), 1, max(len(times) - 1, 1))
        rows = np.where(t - times[after - 1] < times[after] - t, after - 1, after) if len(times) > 1 else 0 * after
        if np.any(np.abs(times[rows] - t) > slack):
            raise InputError(f"{path}: the truth is not of the times of these scans")
        return {name: array[rows] if array.ndim else array for name, array in arrays.items()}
    except InputError:
        raise
    except (
        OSError,
        KeyError,
        ValueError,
        TypeError,
        IndexError,
        EOFError,
        AttributeError,
        zipfile.BadZipFile,
    ) as error:
        raise InputError(f"{path}: no truth can be read from it ({error})") from error


def _of_aircraft(sigma: FloatArray, rows: FloatArray, radar: RadarConfig) -> FloatArray:
    """Return standard deviations (n, 4) of plots of aircraft, which are no points: a strong echo's are far smaller."""
    spread, rate = radar.processing.echo_spread_m, radar.processing.echo_rate_spread_mps
    across = spread / np.maximum(rows[:, 0], spread)
    level = np.maximum(np.cos(rows[:, 2]), across)
    least = np.stack([np.full(len(rows), spread), across / level, across, np.full(len(rows), rate)], axis=1)
    return np.asarray(np.hypot(sigma, least))


def _typical(sigma: FloatArray, radar: RadarConfig) -> FloatArray:
    """Return standard deviations (4,) for trackers that do not tell the plots of a file apart.

    Nine plots of ten have no greater ones: those in the direction of the array's plane have many times the others'. To
    them come the floors of the plots' model, for with one number for all no plot may count as a strong echo's.
    """
    floors = plot_sigmas(radar, PlotModelConfig(), np.zeros(1), np.zeros(1), np.full(1, np.inf))[0]
    most = [np.quantile(column[known], 0.9) if (known := np.isfinite(column)).any() else 0.0 for column in sigma.T]
    return np.asarray(np.hypot(most, floors))


def _field_of_view(scan: Scan) -> FloatArray:
    azimuth, elevation = scan.field_of_view
    return np.array([min(azimuth, math.pi), min(elevation, math.pi / 2)])
