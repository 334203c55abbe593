"""The report on a file of raw samples: what each step of the processing made of it, as one page with its pictures."""

from collections.abc import Callable
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from wideberth import __version__
from wideberth.evaluation import radar_figures as figures
from wideberth.evaluation.radar_run import RadarRun
from wideberth.evaluation.radar_setup import RadarSetup
from wideberth.evaluation.report_shell import make_folder, notes_footer, number, section, shell, table, write_files
from wideberth.evaluation.report_style import png, svg
from wideberth.sensors.radar.processing.averaging import correlation_matrices
from wideberth.sensors.radar.processing.frame import Processed
from wideberth.sensors.radar.processing.frame_powers import frame_image
from wideberth.sensors.radar.processing.peak_interpolation import RangeSpread, fit_range_spread, parabola_offset
from wideberth.sensors.radar.processing.range_compression import checked_samples
from wideberth.sensors.radar.processing.sample_checks import usable_samples
from wideberth.sensors.radar.processing.thresholds import false_alarm_probabilities
from wideberth.sensors.radar.raw.recording import RawRecording
from wideberth.types import FloatArray

_FRAMES_KEPT = 2000
_SPECTRA = 3
_LEAST_OFFSETS = 50
_CLEAR_DB = 6.0
_WORDS = {
    "range_time": ("Power over range and time", "Averaged over channels and sweeps, and what is over the threshold."),
    "threshold": ("One frame", "Single bins over the threshold are dropped; peaks of groups go on to the estimator."),
    "parabola": ("Its greatest peak", "Three bins and the parabola through them, as printed (5.5)."),
    "range_doppler": ("Range and Doppler of that frame", "The spectrum over the frame's sweeps, mean of the channels."),
    "angles": ("Directions of its strongest plots", "Beams over all directions: conventional (4.5), and MVDR."),
    "noise": ("Distribution of a quiet bin", "From frame to frame, beside the laws that thresholds are made of."),
    "false_alarms": ("False alarms that are set", "By bin (5.5)."),
    "spread": ("Peaks between bins", "The parabola's offsets, and the printed correction fitted to them (5.6-5.11)."),
}


@dataclass
class Watched:
    """What is kept of a run for its pictures; as a function it takes in a frame.

    Attributes
    ----------
    times : list of float
    powers, detected : list of ndarray, shape (range_bins,)
        Of each frame, up to the first 2,000.
    offsets : list of float
        Of the parabola through each peak of a clear echo, bins.
    chosen : int
        Which frame of the file has most plots.
    """

    times: list[float] = field(default_factory=list)
    powers: list[FloatArray] = field(default_factory=list)
    detected: list[NDArray[np.bool_]] = field(default_factory=list)
    offsets: list[float] = field(default_factory=list)
    looks: float = 1.0
    best: Processed | None = None
    chosen: int = 0

    def __call__(self, k: int, t: float, processed: Processed) -> None:
        """Take in the steps of one frame."""
        if len(self.times) < _FRAMES_KEPT:
            self.times.append(t)
            self.powers.append(processed.power.astype(np.float32))
            self.detected.append(processed.detected)
            self.looks = processed.looks * float(processed.channels.sum())
            if self.best is None or len(processed.kept) > len(self.best.kept):
                self.best, self.chosen = processed, k
        magnitude = np.sqrt(processed.power)
        # Where peaks of noise lie says nothing of the parabola.
        clear = processed.kept[processed.estimates.snr_db[processed.kept] > _CLEAR_DB]
        b = np.unique(processed.peaks[processed.estimates.peak[clear]])
        b = b[(b > 0) & (b < len(magnitude) - 1)]
        self.offsets += parabola_offset(magnitude[b - 1], magnitude[b], magnitude[b + 1]).tolist()


def draw(setup: RadarSetup, recording: RawRecording, watched: Watched) -> dict[str, Figure]:
    """Return the pictures of a run by name; fewer where there is nothing to draw.

    Parameters
    ----------
    setup : RadarSetup
    recording : RawRecording
    watched : Watched
    """
    radar = setup.radar
    drawn: dict[str, Figure] = {}
    if watched.best is None:
        return drawn
    powers, detected = np.array(watched.powers, dtype=np.float64), np.array(watched.detected)
    drawn["range_time"] = figures.range_time_figure(radar, watched.times, powers, detected)
    drawn["threshold"] = figures.threshold_figure(radar, watched.best)
    parabola = figures.parabola_figure(radar, watched.best)
    if parabola is not None:
        drawn["parabola"] = parabola
    used = watched.best.channels
    samples = checked_samples(radar, recording.frame(watched.chosen).samples)
    image = frame_image(radar, samples[usable_samples(radar, samples).sweeps])
    image = np.where(used[:, None], image, np.complex64(0.0))
    if len(image) > 1:
        drawn["range_doppler"] = figures.range_doppler_figure(radar, image[:, used])
    estimates, kept = watched.best.estimates, watched.best.kept
    strongest = kept[np.argsort(-estimates.snr_db[kept], kind="stable")[:_SPECTRA]]
    if len(strongest) and radar.channels > 1:
        bins = watched.best.peaks[estimates.peak[strongest]]
        labels = [f"{estimates.z[i, 0]:.1f} m" for i in strongest]
        drawn["angles"] = figures.angle_figure(radar, list(correlation_matrices(image, bins)), labels, used)
    quiet = np.flatnonzero(~detected.any(axis=0) & np.isfinite(watched.best.threshold))
    if len(powers) >= 20 and len(quiet):
        chosen = int(quiet[len(quiet) // 2])
        drawn["noise"] = figures.noise_figure(radar, powers[:, chosen], watched.looks, chosen)
    drawn["false_alarms"] = figures.false_alarm_figure(radar, false_alarm_probabilities(radar))
    offsets = np.array(watched.offsets)
    if len(offsets) >= _LEAST_OFFSETS and np.any(offsets):
        drawn["spread"] = figures.spread_figure(offsets, fit_range_spread(offsets))
    return drawn


def write_radar_report(
    out: Path,
    setup: RadarSetup,
    recording: RawRecording,
    run: RadarRun,
    watched: Watched,
    progress: Callable[[str], None] = lambda name: None,
) -> Path:
    """Write ``report.html`` and its pictures.

    Parameters
    ----------
    out : Path
        A folder, made where it does not exist.
    setup : RadarSetup
    recording : RawRecording
    run : RadarRun
    watched : Watched
    progress : callable
        Told which picture is being drawn.

    Returns
    -------
    Path
        Of the page.

    Raises
    ------
    InputError
        If the folder cannot be written.
    """
    make_folder(out)
    drawn = draw(setup, recording, watched)
    files: dict[str, str | bytes] = {}
    left_out = [[escape(cause), f"{count:,}"] for cause, count in run.left_out()]
    body = section("What was left out", run.complaint, table(["cause", "count"], left_out)) if left_out else ""
    for name, figure in drawn.items():
        progress(name)
        title, text = _WORDS[name]
        extra = _fitted(np.array(watched.offsets)) if name == "spread" else ""
        body += section(title, text, svg(figure, title) + extra)
        files[f"{name}.png"] = png(figure)
    body += section("Plots", "The strongest of all frames.", _plots(run))
    state = "good" if run.scans and not run.rejects.get("frame_unusable") else "warn"
    headline = f"{run.plots:,} plots in {len(run.scans):,} of {run.frames:,} frames"
    sentence = f", {run.plots / max(len(run.scans), 1):.1f} a frame"
    notes = [f"wideberth {__version__}, radar {setup.name}. Directions are in the array's axes."]
    page = shell(f"Radar {setup.name}", "raw samples to plots", state, headline, sentence, body + notes_footer(notes))
    write_files(out, {**files, "report.html": page})
    return out / "report.html"


def _plots(run: RadarRun) -> str:
    rows: list[tuple[float, list[Any]]] = []
    for scan, snr in zip(run.scans, run.snr_db, strict=True):
        for z, level in zip(scan.z, snr, strict=True):
            rows.append((float(level), [scan.t, *z]))
    rows.sort(key=lambda row: -row[0])
    cells = [
        [
            number(float(row[0]), digits=3),
            number(float(row[1]), digits=2),
            _degrees(row[2]),
            _degrees(row[3]),
            number(None if np.isnan(row[4]) else float(row[4]), digits=2),
            number(level, digits=1),
        ]
        for level, row in rows[:15]
    ]
    head = ["time, s", "range, m", "azimuth, deg", "elevation, deg", "range rate, m/s", "SNR, dB"]
    return table(head, cells, text_columns=0) if cells else "<p>none</p>"


def _degrees(angle: float) -> str:
    return number(None if np.isnan(angle) else float(np.degrees(angle)), digits=1)


def _fitted(offsets: FloatArray) -> str:
    found, printed = fit_range_spread(offsets), RangeSpread()
    rows = [
        ["fitted here", *(f"{value:.3g}" for value in (found.rate, found.alpha, found.beta))],
        ["the thesis", *(f"{value:.3g}" for value in (printed.rate, printed.alpha, printed.beta))],
    ]
    return table(["", "rate, 1/bin", "alpha", "beta"], rows)
