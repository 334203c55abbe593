"""`wideberth radar`: raw samples of an FMCW phased-array radar, from a file to plots."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from wideberth.cli.errors import guarded
from wideberth.errors import InputError

if TYPE_CHECKING:
    from rich.console import Console

    from wideberth.evaluation.radar_run import RadarRun
    from wideberth.sensors.radar.estimation.calibration import ArrayCalibration
    from wideberth.sensors.radar.processing.noise_statistics import NoiseStatistics

app = typer.Typer(
    name="radar",
    help="Raw samples of an FMCW phased-array radar: simulate them, and process recorded or simulated ones to plots.",
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
)

_FILE = Annotated[Path, typer.Argument(help="Raw samples, .npy or .npz.", show_default=False)]
_RADAR = Annotated[
    str, typer.Option(help="The radar: table_5_1, uplooking_4x4, onboard_unit, or a TOML file.", show_default=False)
]
_NOISE = Annotated[
    Path | None, typer.Option(help="Noise statistics, made by `wideberth radar noise`; without it the link budget's.")
]
_CALIBRATION = Annotated[Path | None, typer.Option(help="Calibration of the channels (NPZ).")]


def process(
    file: _FILE,
    radar: _RADAR,
    noise: _NOISE = None,
    calibration: _CALIBRATION = None,
    out: Annotated[
        Path, typer.Option(help="Parquet file for the plots; or .npz, as `wideberth track` reads it.")
    ] = Path("plots.parquet"),
    truth: Annotated[
        Path | None,
        typer.Option(help="The truth (NPZ) of `wideberth radar simulate`, for an .npz.", show_default=False),
    ] = None,
) -> None:
    """Turn raw samples into plots with range, direction, range rate and their variances."""
    if out.suffix not in (".parquet", ".npz"):
        raise InputError(f"--out {out}: end it in .parquet or .npz")
    if truth is not None and out.suffix != ".npz":
        raise InputError("--truth goes with --out FILE.npz")
    _check_folder(out)
    from rich.console import Console

    from wideberth.evaluation.radar_run import process_recording, write_plot_file, write_plot_table
    from wideberth.evaluation.radar_setup import load_radar
    from wideberth.sensors.radar.raw.recording import RawRecording

    setup = load_radar(radar)
    recording = RawRecording(file, setup.radar, setup.layout)
    with _bar("frames") as progress:
        run = process_recording(
            setup, recording, _noise(noise), calibration=_calibrated(calibration), progress=progress
        )
    if out.suffix == ".npz":
        write_plot_file(out, setup, run, truth)
    else:
        write_plot_table(out, run)
    console = Console(highlight=False)
    _print_run(console, file.name, run)
    console.print(f"plots: {out}", markup=False, soft_wrap=True)


def noise(
    file: _FILE,
    radar: _RADAR,
    out: Annotated[Path, typer.Option(help="NPZ file for the noise statistics.")] = Path("noise.npz"),
) -> None:
    """Measure a radar's noise in each channel and range bin, from raw samples without targets."""
    _check_folder(out)
    from wideberth.evaluation.radar_run import noise_of_recording
    from wideberth.evaluation.radar_setup import load_radar
    from wideberth.sensors.radar.link_budget import noise_power
    from wideberth.sensors.radar.raw.recording import RawRecording

    setup = load_radar(radar)
    statistics = noise_of_recording(setup, RawRecording(file, setup.radar, setup.layout))
    statistics.save(out)
    import numpy as np

    from wideberth.sensors.radar.range_cells import window_noise_gain

    expected = noise_power(setup.radar) * window_noise_gain(setup.radar.processing.window)
    level = np.median(statistics.power, axis=1) / expected
    words = ", ".join(f"{10.0 * np.log10(value):+.2f}" if value > 0.0 else "not usable" for value in level)
    typer.echo(f"{statistics.samples:.0f} sweeps of {setup.radar.channels} channels: {out}")
    typer.echo(f"noise of the channels over the link budget's, dB: {words}")
    if not 0.1 < np.median(level) < 10.0:
        typer.echo("that is far off: are the samples volts at the receiver's input (volts_per_unit in [layout])?")


def show(
    file: _FILE,
    radar: _RADAR,
    noise: _NOISE = None,
    calibration: _CALIBRATION = None,
    out: Annotated[Path, typer.Option(help="Folder for report.html and its pictures.")] = Path("out/radar"),
) -> None:
    """Draw what each step of the processing makes of raw samples: powers, thresholds, detections, spectra."""
    if out.exists() and not out.is_dir():
        raise InputError(f"--out {out} is a file: give a folder")
    from wideberth.evaluation.radar_report import Watched, write_radar_report
    from wideberth.evaluation.radar_run import process_recording
    from wideberth.evaluation.radar_setup import load_radar
    from wideberth.sensors.radar.raw.recording import RawRecording

    setup = load_radar(radar)
    recording = RawRecording(file, setup.radar, setup.layout)
    watched = Watched()
    with _bar("frames") as progress:
        run = process_recording(
            setup,
            recording,
            _noise(noise),
            calibration=_calibrated(calibration),
            progress=progress,
            watch=watched,
        )
    page = write_radar_report(out, setup, recording, run, watched)
    from rich.console import Console

    console = Console(highlight=False)
    _print_run(console, file.name, run)
    console.print(f"report: {page}", markup=False, soft_wrap=True)


def simulate(
    scenario: Annotated[Path, typer.Argument(help="Scenario file (TOML) with a radar.", show_default=False)],
    out: Annotated[Path, typer.Option(help="File for the samples, .npy.")] = Path("raw.npy"),
    seed: Annotated[int | None, typer.Option(help="Seed instead of the scenario's.")] = None,
    duration: Annotated[
        str | None, typer.Option(help="How long, such as 20s; the mission's time by default.", show_default=False)
    ] = None,
    noise_frames: Annotated[int, typer.Option(help="Frames of a run without targets besides; 0: none.", min=0)] = 0,
    set_: Annotated[
        list[str] | None, typer.Option("--set", help="Set one key, such as sensor.averages=10; repeatable.")
    ] = None,
) -> None:
    """Write what a scenario's first radar samples while its mission is flown without avoidance.

    Beside raw.npy there will be raw.toml (the radar), raw_truth.npz and, with --noise-frames, raw_noise.npy.
    """
    if out.suffix != ".npy":
        raise InputError(f"--out {out}: end it in .npy")
    _check_folder(out)
    from wideberth.cli.errors import quantity
    from wideberth.config import apply_override, build_scenario, read_toml
    from wideberth.evaluation.radar_simulation import simulate_recording

    seconds = None if duration is None else quantity("--duration", duration, "time")
    if seconds is not None and seconds < 0.0:
        raise InputError(f"--duration {duration}: give 0 s or more")
    tables = read_toml(scenario)
    if seed is not None:
        tables["seed"] = seed
    for override in set_ or ():
        apply_override(tables, override)
    checked = build_scenario(tables, source=str(scenario), folder=scenario.parent)
    with _bar("frames") as progress:
        files = simulate_recording(checked, out, duration=seconds, noise_frames=noise_frames, progress=progress)
    typer.echo(f"{files.frames} frames: {files.raw}\nradar: {files.radar}\ntruth: {files.truth}")
    if files.noise is not None:
        typer.echo(f"noise: {files.noise}")


for _command in (simulate, process, noise, show):
    app.command(_command.__name__)(guarded(_command))


def _check_folder(out: Path) -> None:
    if not out.parent.is_dir():
        raise InputError(f"folder '{out.parent}' does not exist: create it, or give another --out")


def _noise(path: Path | None) -> "NoiseStatistics | None":
    from wideberth.sensors.radar.processing.noise_statistics import NoiseStatistics

    return None if path is None else NoiseStatistics.load(path)


def _calibrated(path: Path | None) -> "ArrayCalibration | None":
    from wideberth.sensors.radar.estimation.calibration import ArrayCalibration

    return None if path is None else ArrayCalibration.load(path)


@contextmanager
def _bar(what: str) -> Iterator[Callable[[int, int], None]]:
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(what, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


def _print_run(console: "Console", name: str, run: "RadarRun") -> None:
    """Print what a run used and left out, and why the last frame was that could not be used."""
    from rich.table import Table

    table = Table(title=name, title_justify="left")
    table.add_column("what")
    table.add_column("count", justify="right")
    table.add_row("frames", f"{run.frames:,}")
    table.add_row("frames used", f"{len(run.scans):,}")
    table.add_row("plots", f"{run.plots:,}")
    for cause, count in run.left_out():
        table.add_row(cause, f"{count:,}")
    console.print(table)
    if run.complaint:
        console.print(f"frame unusable: {run.complaint}", markup=False, soft_wrap=True)
