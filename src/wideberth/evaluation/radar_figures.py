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
from wideberth.sensors.radar.processing.peak_interpolation import RangeSpread, parabola_offset
from wideberth.types import FloatArray

_MOST_CELLS = 1500  # of a picture's axis; more are taken together by their largest
_ANGLE_FLOOR_DB = 20.0
_POINTS_A_BEAM = 32
_NOT_USED = 1e6  # noise that takes a channel out of MVDR beams, over the mean power
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
        half = 0.5 * (float(np.median(np.diff(times))) if len(times) > 1 else radar.update_interval_s)
        extent = (times[0] - half, times[-1] + half, *_edges(powers.shape[1], radar.range_bin))
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
            axes.set_xlim(extent[:2])
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
    """Return the power of a frame over range and Doppler, mean of the channels.

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
        first, last = _edges(sweeps, 2.0 * most / sweeps)
        middle = (sweeps // 2) * 2.0 * most / sweeps  # where the transform has zero
        extent = (*_edges(power.shape[1], radar.range_bin), first - middle, last - middle)
        floor = float(np.nanmedian(level)) - 3.0
        drawn = axes.imshow(
            level, origin="lower", aspect="auto", extent=extent, vmin=floor, vmax=floor + 40.0, cmap="viridis"
        )
        figure.colorbar(drawn, ax=axes, label="power, dBW")
        axes.set_xlabel("range, m")
        axes.set_ylabel(f"range rate, m/s (repeats every {2 * most:.1f})")
        axes.grid(False)
    return figure


def angle_figure(
    radar: RadarConfig,
    covariances: Sequence[NDArray[np.complex128]],
    labels: Sequence[str],
    channels: NDArray[np.bool_],
) -> Figure:
    """Return the angle spectra of some detections: conventional and MVDR over direction.

    Parameters
    ----------
    radar : RadarConfig
    covariances : sequence of ndarray, shape (channels, channels)
        0 where a channel was not used.
    labels : sequence of str
    channels : ndarray of bool, shape (channels,)
        Those that were used.
    """
    grid = direction_grid(radar, _POINTS_A_BEAM)
    plane = min(len(grid.right), len(grid.down)) > 1
    with rc_context(RC):
        figure = new_figure(9.6, 3.4 if not plane else 3.2 * len(covariances))
        if plane:
            panels = figure.subplots(len(covariances), 2, squeeze=False)
            for row, matrix, label in zip(panels, covariances, labels, strict=True):
                _angle_map(row[0], grid, _conventional(radar, matrix), f"{label}: conventional")
                _angle_map(row[1], grid, _mvdr(radar, matrix, channels), "MVDR")
            return figure
        axes = figure.add_subplot()
        over = grid.right if len(grid.right) > 1 else grid.down
        angle = np.degrees(np.arcsin(np.clip(over, -1.0, 1.0)))
        for k, (matrix, label) in enumerate(zip(covariances, labels, strict=True)):
            for spectrum, style in ((_conventional(radar, matrix), "-"), (_mvdr(radar, matrix, channels), ":")):
                level = decibels(spectrum.ravel())
                axes.plot(angle, level - np.nanmax(level), color=traffic_colour(k), linestyle=style,
                          label=f"{label}, {'conventional' if style == '-' else 'MVDR'}")  # fmt: skip
        axes.set_ylim(-_FLOOR_DB, 1.0)
        axes.set_xlabel("angle from boresight, deg")
        axes.set_ylabel("power, dB of the strongest")
        axes.legend(ncols=3, fontsize=8, loc="lower right", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.2)
    return figure


def _conventional(radar: RadarConfig, matrix: NDArray[np.complex128]) -> FloatArray:
    return conventional_spectrum(radar, matrix, points_a_beam=_POINTS_A_BEAM)


def _mvdr(radar: RadarConfig, matrix: NDArray[np.complex128], channels: NDArray[np.bool_]) -> FloatArray:
    power = float(np.trace(matrix).real) / len(matrix)
    heard = matrix + np.diag(np.where(channels, 0.0, _NOT_USED * power))
    # Of few sweeps a covariance cannot be inverted as it is.
    return mvdr_spectrum(radar, heard, loading=0.01 * power, points_a_beam=_POINTS_A_BEAM)


def _angle_map(axes: Axes, grid: Any, spectrum: FloatArray, title: str) -> None:
    level = decibels(np.where(grid.seen, spectrum, np.nan))
    level = level - float(np.nanmax(level))
    extent = (grid.right[0], grid.right[-1], grid.down[-1], grid.down[0])
    drawn = axes.imshow(level, aspect="equal", extent=extent, vmin=-_ANGLE_FLOOR_DB, vmax=0.0, cmap="viridis")
    axes.figure.colorbar(drawn, ax=axes, label="dB of the strongest")
    axes.set_title(title)
    axes.set_xlabel("direction cosine, right")
    axes.set_ylabel("direction cosine, down")
    axes.grid(False)


def parabola_figure(radar: RadarConfig, processed: Processed) -> Figure | None:
    """Return figure 5.5, the parabola through the greatest peak of a frame and the bins beside it; None without one."""
    magnitude = np.sqrt(processed.power)
    inner = processed.peaks[(processed.peaks > 0) & (processed.peaks < len(magnitude) - 1)]
    if not len(inner):
        return None
    b = int(inner[np.argmax(magnitude[inner])])
    left, center, right = magnitude[b - 1 : b + 2] / magnitude[b]
    offset = float(parabola_offset(left, center, right))
    with rc_context(RC):
        figure = new_figure(9.6, 2.9)
        axes = figure.add_subplot()
        bins = np.arange(max(b - 4, 0), min(b + 5, len(magnitude)))
        axes.vlines(bins, 0.0, magnitude[bins] / magnitude[b], color=FAINT)
        axes.plot(bins, magnitude[bins] / magnitude[b], ".", color=INK, markersize=7, label="magnitude")
        x = np.linspace(-1.0, 1.0, 101)
        curve = center + 0.5 * (right - left) * x + (0.5 * (left + right) - center) * x**2
        axes.plot(b + x, curve, color=OWNSHIP, label="parabola (5.6)")
        axes.axvline(b + offset, color=LIMIT, linestyle="--", label=f"its top: bin {b + offset:.2f}")
        axes.set_ylim(0.0, 1.15 * max(1.0, float(curve.max())))
        axes.set_xlabel(f"range bin, of {radar.range_bin:.3g} m")
        axes.set_ylabel("magnitude over the peak's")
        axes.legend()
    return figure


def spread_figure(offsets: FloatArray, spread: RangeSpread) -> Figure:
    """Return figures 5.6 to 5.11: where between bins the parabola's peaks lie, before and after the correction.

    Parameters
    ----------
    offsets : ndarray, shape (n,)
        Of `peak_interpolation.parabola_offset`, bins.
    spread : RangeSpread
    """
    with rc_context(RC):
        figure = new_figure(9.6, 4.8)
        panels = figure.subplots(2, 3)
        drawn = {
            (0, 0): (offsets, "offset of the parabola (5.6)", (-0.5, 0.5)),
            (0, 1): (np.abs(offsets), "its magnitude (5.7)", (0.0, 0.5)),
            (0, 2): (spread.to_beta(offsets), "beta distributed (5.8)", (0.0, 0.5)),
            (1, 1): (np.abs(spread(offsets)), "uniform (5.10)", (0.0, 0.5)),
            (1, 2): (spread(offsets), "corrected (5.11)", (-0.5, 0.5)),
        }
        for place, (values, title, limits) in drawn.items():
            axes = panels[place]
            axes.hist(values, bins=int(np.clip(len(offsets) // 8, 8, 40)), range=limits, color=OWNSHIP)
            axes.set_axisbelow(True)
            axes.set_title(title)
            axes.set_xlabel("bins")
            axes.set_ylabel("peaks")
        x = np.linspace(0.0, 0.5, 201)
        table = panels[1, 0]
        table.plot(x, spread.from_beta(x), color=OWNSHIP)
        table.set_title("lookup table (5.9)")
        table.set_xlabel("beta distributed, bins")
        table.set_ylabel("uniform, bins")
    return figure


def _edges(cells: int, width: float) -> tuple[float, float]:
    """Return where a picture of cells with their middles at 0, `width`, ... begins and ends."""
    return -0.5 * width, (cells - 0.5) * width


def _largest(powers: FloatArray, step: int) -> FloatArray:
    """Return the powers of `step` neighbouring bins as their largest."""
    if step <= 1:
        return powers
    rest = -powers.shape[1] % step
    padded = np.pad(powers, ((0, 0), (0, rest)))
    return np.asarray(padded.reshape(len(powers), -1, step).max(axis=2))
