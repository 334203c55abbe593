"""Pictures of what a radar's processing does: thesis figures 4.4 to 4.7 and 5.3 to 5.11, and spectra of one frame."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from wideberth.evaluation.report_style import FAINT, INK, LIMIT, OWNSHIP, RC, new_figure, traffic_colour
from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.estimation.beamforming import conventional_spectrum, direction_grid, mvdr_spectrum
from wideberth.sensors.radar.processing.frame import Processed
from wideberth.sensors.radar.processing.peak_interpolation import RangeSpread
from wideberth.types import FloatArray

_MOST_CELLS = 1500  # of a picture's axis; more are taken together by their largest
_ANGLE_FLOOR_DB = 20.0
_FLOOR_DB = 30.0  # below the strongest, where a picture's colours end


def decibels(power: FloatArray) -> FloatArray:
    """Return powers in dB; what is not positive becomes NaN."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(10.0 * np.log10(np.where(power > 0.0, power, np.nan)))


def range_time_figure(
    radar: RadarConfig, times: Sequence[float], powers: FloatArray, detected: NDArray[np.bool_]
) -> Figure:
    """Return figures 4.4 and 4.7: power over range and time, and what is over the threshold.

    Parameters
    ----------
    radar : RadarConfig
    times : sequence of float
        Of the frames, s.
    powers : ndarray, shape (frames, range_bins)
        W.
    detected : ndarray of bool, shape (frames, range_bins)
    """
    with rc_context(RC):
        figure = new_figure(9.6, 4.6)
        left, right = figure.subplots(1, 2, sharey=True)
        step = -(-powers.shape[1] // _MOST_CELLS)
        shown = _largest(powers, step)
        level = decibels(shown)
        extent = (times[0], times[-1] if len(times) > 1 else times[0] + 1.0, 0.0, powers.shape[1] * radar.range_bin)
        floor = float(np.nanmedian(level))
        image = left.imshow(
            level.T, origin="lower", aspect="auto", extent=extent, vmin=floor - 3.0, vmax=floor + 25.0, cmap="viridis"
        )
        figure.colorbar(image, ax=left, label="power, dBW")
        left.set_title("averaged power (4.4)")
        left.set_ylabel("range, m")
        frames, bins = np.nonzero(detected)
        right.plot(np.asarray(times)[frames], bins * radar.range_bin, ".", color=OWNSHIP, markersize=2.0)
        right.set_title("over the threshold (4.7)")
        for axes in (left, right):
            axes.set_xlabel("time, s")
            axes.grid(False)
    return figure


def threshold_figure(radar: RadarConfig, processed: Processed) -> Figure:
    """Return figures 4.6 and 5.4: the power of one frame, its threshold, groups of bins and peaks."""
    with rc_context(RC):
        figure = new_figure(9.6, 3.8)
        axes = figure.add_subplot()
        place = np.arange(len(processed.power)) * radar.range_bin
        axes.plot(place, decibels(processed.power), color=FAINT, linewidth=0.7, label="power")
        axes.plot(place, decibels(np.where(np.isfinite(processed.threshold), processed.threshold, 0.0)),
                  color=LIMIT, linewidth=1.2, label="threshold")  # fmt: skip
        over = np.flatnonzero(processed.detected)
        axes.plot(place[over], decibels(processed.power)[over], ".", color=INK, markersize=4, label="over it")
        axes.plot(place[processed.peaks], decibels(processed.power)[processed.peaks], "o", color=OWNSHIP,
                  markersize=7, markerfacecolor="none", label="peak of a group")  # fmt: skip
        axes.set_xlabel("range, m")
        axes.set_ylabel("power, dBW")
        axes.legend(ncols=4, loc="lower right", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.2)
    return figure


def false_alarm_figure(radar: RadarConfig, probabilities: FloatArray) -> Figure:
    """Return figure 5.3: the probability of a false alarm over range.

    Parameters
    ----------
    radar : RadarConfig
    probabilities : ndarray, shape (range_bins,)
    """
    with rc_context(RC):
        figure = new_figure(9.6, 2.6)
        axes = figure.add_subplot()
        axes.plot(np.arange(len(probabilities)) * radar.range_bin, probabilities, color=OWNSHIP)
        axes.set_ylim(0.0, 1.15 * float(probabilities.max()))
        axes.set_xlabel("range, m")
        axes.set_ylabel("false alarms, a bin and scan")
    return figure


def noise_figure(radar: RadarConfig, powers: FloatArray, looks: float, bin_number: int) -> Figure:
    """Return figure 4.5: how the power of one bin is distributed from frame to frame, beside the law of noise.

    Parameters
    ----------
    radar : RadarConfig
    powers : ndarray, shape (frames,)
        Of one bin, W.
    looks : float
        Independent powers in each.
    bin_number : int
    """
    from scipy import stats

    with rc_context(RC):
        figure = new_figure(9.6, 2.9)
        axes = figure.add_subplot()
        middle = float(powers.mean())
        axes.set_axisbelow(True)
        axes.hist(powers / middle, bins=min(60, max(8, len(powers) // 5)), density=True, color=FAINT, label="frames")
        x = np.linspace(0.0, max(2.0, float(powers.max() / middle)), 300)
        axes.plot(x, stats.gamma.pdf(x, looks, scale=1.0 / looks), color=OWNSHIP, label=f"Gamma, {looks:g} looks")
        axes.plot(x, np.exp(-x), color=LIMIT, linestyle="--", label="exponential, as printed")
        axes.set_xlabel(f"power of bin {bin_number} ({bin_number * radar.range_bin:.0f} m), of its mean")
        axes.set_ylabel("density")
        axes.legend()
    return figure


def range_doppler_figure(radar: RadarConfig, image: NDArray[np.complexfloating[Any, Any]]) -> Figure:
    """Return the power of a frame over range and Doppler, summed over the channels.

    Parameters
    ----------
    radar : RadarConfig
    image : ndarray of complex, shape (sweeps, channels, range_bins)
    """
    with rc_context(RC):
        figure = new_figure(9.6, 4.2)
        axes = figure.add_subplot()
        sweeps = len(image)
        window = np.hanning(sweeps + 2)[1:-1, None, None] if sweeps > 2 else 1.0
        spectrum = np.fft.fftshift(np.fft.fft(image * window, axis=0), axes=0)
        power = (np.abs(spectrum) ** 2).mean(axis=1)
        level = decibels(_largest(power, -(-power.shape[1] // _MOST_CELLS)))
        most = radar.wavelength / (4.0 * radar.sweep_interval)
        extent = (0.0, power.shape[1] * radar.range_bin, -most, most)
        floor = float(np.nanmedian(level)) - 3.0
        drawn = axes.imshow(
            level, origin="lower", aspect="auto", extent=extent, vmin=floor, vmax=floor + 40.0, cmap="viridis"
        )
        figure.colorbar(drawn, ax=axes, label="power, dBW")
        axes.set_xlabel("range, m")
        axes.set_ylabel(f"range rate, m/s (repeats every {2 * most:.1f})")
        axes.grid(False)
    return figure


def angle_figure(radar: RadarConfig, covariances: Sequence[NDArray[np.complex128]], labels: Sequence[str]) -> Figure:
    """Return the angle spectra of some detections: conventional and MVDR over direction.

    Parameters
    ----------
    radar : RadarConfig
    covariances : sequence of ndarray, shape (channels, channels)
    labels : sequence of str
    """
    grid = direction_grid(radar)
    plane = min(len(grid.right), len(grid.down)) > 1
    with rc_context(RC):
        figure = new_figure(9.6, 3.4 if not plane else 3.2 * len(covariances))
        if plane:
            panels = figure.subplots(len(covariances), 2, squeeze=False)
            for row, matrix, label in zip(panels, covariances, labels, strict=True):
                _angle_map(row[0], grid, conventional_spectrum(radar, matrix), f"{label}: conventional")
                _angle_map(row[1], grid, _mvdr(radar, matrix), "MVDR")
            return figure
        axes = figure.add_subplot()
        over = grid.right if len(grid.right) > 1 else grid.down
        angle = np.degrees(np.arcsin(np.clip(over, -1.0, 1.0)))
        for k, (matrix, label) in enumerate(zip(covariances, labels, strict=True)):
            for spectrum, style in ((conventional_spectrum(radar, matrix), "-"), (_mvdr(radar, matrix), ":")):
                level = decibels(spectrum.ravel())
                axes.plot(angle, level - np.nanmax(level), color=traffic_colour(k), linestyle=style,
                          label=f"{label}, {'conventional' if style == '-' else 'MVDR'}")  # fmt: skip
        axes.set_ylim(-_FLOOR_DB, 1.0)
        axes.set_xlabel("angle from boresight, deg")
        axes.set_ylabel("power, dB of the strongest")
        axes.legend(fontsize=8)
    return figure


def _mvdr(radar: RadarConfig, matrix: NDArray[np.complex128]) -> FloatArray:
    # Of few sweeps a covariance cannot be inverted as it is.
    return mvdr_spectrum(radar, matrix, loading=float(0.01 * np.trace(matrix).real / len(matrix)))


def _angle_map(axes: Axes, grid: Any, spectrum: FloatArray, title: str) -> None:
    level = decibels(np.where(grid.seen, spectrum, np.nan))
    level = level - float(np.nanmax(level))
    extent = (grid.right[0], grid.right[-1], grid.down[-1], grid.down[0])
    drawn = axes.imshow(level, aspect="equal", extent=extent, vmin=-_ANGLE_FLOOR_DB, vmax=0.0, cmap="viridis")
    axes.figure.colorbar(drawn, ax=axes, label="dB of the strongest")
    axes.set_title(title)
    axes.set_xlabel("direction cosine, right")
    axes.set_ylabel("down")
    axes.grid(False)


def spread_figure(offsets: FloatArray, spread: RangeSpread) -> Figure:
    """Return figures 5.6 to 5.11: where between bins the parabola's peaks lie, before and after the correction.

    Parameters
    ----------
    offsets : ndarray, shape (n,)
        Of `peak_interpolation.parabola_offset`, bins.
    spread : RangeSpread
    """
    with rc_context(RC):
        figure = new_figure(9.6, 4.6)
        panels = figure.subplots(2, 2)
        beta = 0.5 * -np.expm1(-np.abs(offsets) * spread.rate)
        drawn = (
            (offsets, "offset of the parabola (5.6)", (-0.5, 0.5)),
            (np.abs(offsets), "its magnitude (5.7)", (0.0, 0.5)),
            (beta, "as a beta distribution (5.8)", (0.0, 0.5)),
            (spread(offsets), "corrected (5.11)", (-0.5, 0.5)),
        )
        for axes, (values, title, limits) in zip(panels.ravel(), drawn, strict=True):
            axes.hist(values, bins=int(np.clip(len(offsets) // 8, 8, 40)), range=limits, color=OWNSHIP)
            axes.set_axisbelow(True)
            axes.set_title(title)
            axes.set_xlabel("bins")
            axes.set_ylabel("peaks")
    return figure


def _largest(powers: FloatArray, step: int) -> FloatArray:
    """Return the powers of `step` neighbouring bins as their largest."""
    if step <= 1:
        return powers
    rest = -powers.shape[1] % step
    padded = np.pad(powers, ((0, 0), (0, rest)))
    return np.asarray(padded.reshape(len(powers), -1, step).max(axis=2))
