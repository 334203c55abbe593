"""The plot-level radar model fitted to the radar's samples: detection, errors, false plots, resolution of pairs.

Run: ``python -m experiments.plot_model_fit``; it prints the fitted constants and writes the page with its picture,
``docs/results/plot_model.md``.
"""

import math
from dataclasses import dataclass
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray
from scipy import optimize

from wideberth.sensors.radar.config import PlotModelConfig, SimulatedRadarConfig
from wideberth.sensors.radar.coverage import plot_probability
from wideberth.sensors.radar.link_budget import snr_db
from wideberth.sensors.radar.plot_model import HALF_POWER_WIDTH, PlotModel
from wideberth.sensors.radar.range_cells import false_plot_probability
from wideberth.sensors.radar.sampled_look import SampledLook

FloatArray = NDArray[np.float64]

PAGE = Path(__file__).resolve().parents[1] / "docs" / "results" / "plot_model.md"
LOOKS = 120
PAIRS = 40
RATE = 3.0  # m/s
GATE_BINS = 4.0  # a plot within so many range bins of an aircraft is its own
RATIOS_DB = (-12.0, -8.0, -5.0, -3.0, -1.0, 1.0, 4.0, 10.0)
"""Of one channel and sweep, on boresight."""

PLACE = (60.0, 0.2, 0.1)
"""Range, m, azimuth and elevation, rad."""

_ELEMENTS = ("range", "azimuth", "elevation", "range rate")
IDEAL = PlotModelConfig(
    range_error_factor=1.0,
    direction_error_factor=1.0,
    range_rate_error_factor=1.0,
    range_floor_bins=1e-9,
    direction_floor_beamwidths=1e-9,
    range_rate_floor_bins=1e-9,
)
"""Errors are the Cramer-Rao bounds."""

HEAD = """# The plot-level radar model beside the samples

Made by `python -m experiments.plot_model_fit`. Aircraft at 60 m, azimuth 0.2, elevation 0.1 rad, 3 m/s, each look at
another place within a range bin, are seen by the radar of table 5.1 (a line of 4 elements) and by the 4 x 4 array,
both with an eighth of their samples and no faults of the receiver, at a false alarm probability of 0.01. What the
Hann window, the place in the bin and the two bins of a plot take is computed for each look
(`range_cells.bin_shares`); the losses fitted here are what remains. The model of the tables has them; its default,
`PlotModelConfig.processing_loss_db`, is their mean. Errors are robust standard deviations over the Cramer-Rao bounds,
with the bias in standard deviations in brackets (both within 0.2 by chance, 2 sigma): the factors' defaults are 1. No
floor is seen at 25 dB, where bounds are a few thousandths of a cell: the floors of `PlotModelConfig` are not the
processing's, they stand for the extent of aircraft. False plots are groups of two bins: the model computes them
(`range_cells.false_plot_probability`), its factor is 1. Pairs are equal, at rest, 15 dB in a channel and sweep; with
other range rates (a Doppler bin apart) MVDR parts all of them. Smeared over more than three bins, where detection is
less likely than not, the model says up to 0.2 too little: it leaves out the noise that neighbours share.

![Probability of detection](plot_model.png)
"""

# An eighth of the samples of the thesis's radars: the bins are the same.
LINE = SimulatedRadarConfig.model_validate(
    {"level": "samples", "if_bandwidth_mhz": 0.125, "range_rate": True, "swerling": 0}
)
PLANE = SimulatedRadarConfig.model_validate(
    {
        **LINE.model_dump(),
        "sweep_time_ms": 2.0,
        "if_bandwidth_mhz": 0.128,
        "channels": 16,
        "array_rows": 4,
        "averages": 20,
        "azimuth_fov_deg": 180.0,
        "elevation_fov_deg": 180.0,
        "azimuth_beamwidth_deg": 360.0,
        "elevation_beamwidth_deg": 360.0,
    }
)


@dataclass(frozen=True, slots=True)
class Measured:
    """Plots of one aircraft over many looks.

    Attributes
    ----------
    detected : int
        Of how many `looks`.
    error : ndarray, shape (detected, 4)
        Plot less truth.
    variance : ndarray, shape (detected, 4)
        As stated with the plots.
    false : float
        Other plots in a look.
    """

    looks: int
    detected: int
    error: FloatArray
    variance: FloatArray
    false: float


def changed(config: SimulatedRadarConfig, **settings: object) -> SimulatedRadarConfig:
    """Return a radar with other settings."""
    return SimulatedRadarConfig.model_validate({**config.model_dump(), **settings})


def watch(
    config: SimulatedRadarConfig,
    ratio_db: float,
    place: tuple[float, float, float],
    rate: float,
    looks: int,
    seed: int,
) -> Measured:
    """Look at an aircraft many times, each time somewhere else within a range bin.

    Parameters
    ----------
    config : SimulatedRadarConfig
        Its level says what looks.
    ratio_db : float
        Mean signal-to-noise ratio of one channel and sweep, without losses of processing.
    place : tuple of float
        Range, m, azimuth and elevation, rad.
    rate : float
        Range rate, m/s.
    looks, seed : int
    """
    clean = config.model_copy(update={"plot_model": PlotModelConfig(processing_loss_db=0.0)})
    budget, model = PlotModel(clean), PlotModel(config)
    sampled = SampledLook(config, model, "radar") if config.level == "samples" else None
    random = np.random.default_rng(seed)
    errors, variances, false = [], [], 0
    for k in range(looks):
        distance = place[0] + config.range_bin * (random.random() - 0.5)
        towards = _towards(place[1], place[2])
        position, velocity = (distance * towards)[None], (rate * towards)[None]
        # What migration takes is the model's to lose: the ratio is that of the echo.
        rcs = 10.0 ** (ratio_db / 10.0) / budget.ratio(position, np.ones(1))
        if sampled is None:
            z, variance = model.look(random, position, np.array([rate]), rcs)
        else:
            z, variance = sampled.look(float(k), random, position, velocity, rcs)
        near = np.flatnonzero(np.abs(z[:, 0] - distance) < GATE_BINS * config.range_bin)
        angle = math.asin(towards[1]) if config.array_rows == 1 else place[1]
        if len(near):
            i = near[np.argmin(np.abs(z[near, 0] - distance))]
            errors.append(z[i] - [distance, angle, place[2], rate])
            variances.append(variance[i])
        false += len(z) - len(near)
    n = len(errors)
    return Measured(looks, n, np.reshape(errors, (n, 4)), np.reshape(variances, (n, 4)), false / looks)


def _towards(azimuth: float, elevation: float) -> FloatArray:
    level = math.cos(elevation)
    return np.array([level * math.cos(azimuth), level * math.sin(azimuth), -math.sin(elevation)])


def robust_sigma(error: FloatArray) -> FloatArray:
    """Return standard deviations (4,) about the medians, without outliers: from the middle 68 %."""
    low, high = np.nanquantile(error, [0.1587, 0.8413], axis=0)
    return np.asarray(0.5 * (high - low))


def expected(config: SimulatedRadarConfig, ratio_db: FloatArray | float, loss_db: float) -> FloatArray:
    """Return the probability that the model detects an aircraft of mean ratio, dB, with a loss of processing, dB."""
    clean = config.model_copy(update={"azimuth_beamwidth_deg": None, "elevation_beamwidth_deg": None})
    rcs = 10.0 ** ((np.asarray(ratio_db) - float(snr_db(PLACE[0], 1.0, clean))) / 10.0)
    return plot_probability(PLACE[0], rcs, RATE, clean, loss_db=loss_db)


def fitted_loss(config: SimulatedRadarConfig, shares: FloatArray) -> float:
    """Return the loss, dB, at which the model's probabilities of detection are nearest to those measured."""

    def misfit(loss: float) -> float:
        return float(((expected(config, np.array(RATIOS_DB), loss) - shares) ** 2).sum())

    return float(optimize.minimize_scalar(misfit, bounds=(-2.0, 6.0), method="bounded").x)


def separated(config: SimulatedRadarConfig, bins: float, beamwidths: float, looks: int) -> float:
    """Return in which share of looks two equal aircraft, so far apart, give two plots near them.

    They are at rest, 15 dB in a channel and sweep; the `level` of the radar says what looks.
    """
    model = PlotModel(config)
    sampled = SampledLook(config, model, "radar") if config.level == "samples" else None
    random = np.random.default_rng([round(1000 * bins), round(1000 * beamwidths)])
    width = HALF_POWER_WIDTH / (config.array_columns * config.element_spacing_wavelengths)
    two = 0
    for k in range(looks):
        first = 60.0 + config.range_bin * random.random()
        # Their phases differ at random, as the separation is not known to a wavelength.
        ranges = np.array([first, first + bins * config.range_bin + config.wavelength * random.random()])
        sines = 0.5 * beamwidths * width * np.array([-1.0, 1.0])
        places = np.stack([ranges * np.sqrt(1.0 - sines**2), ranges * sines, np.zeros(2)], axis=1)
        rcs = 10.0**1.5 / model.ratio(places, np.ones(2))
        if sampled is None:
            z, _ = model.look(random, places, np.zeros(2), rcs)
        else:
            z, _ = sampled.look(float(k), random, places, np.zeros((2, 3)), rcs)
        two += int(np.count_nonzero(np.abs(z[:, 0] - ranges.mean()) < (3.0 + bins) * config.range_bin) >= 2)
    return two / looks


def false_plots(config: SimulatedRadarConfig, p_fa: float, looks: int) -> tuple[int, float]:
    """Return how many plots looks at nothing give, and how many the model says with a factor of 1."""
    quiet = changed(config, false_alarm_probability=p_fa, processing={"max_plots": 4096})
    sampled, random = SampledLook(quiet, PlotModel(quiet), "radar"), np.random.default_rng(5)
    nothing = np.full((1, 3), np.nan)
    found = sum(len(sampled.look(float(k), random, nothing, nothing, np.ones(1))[0]) for k in range(looks))
    return found, looks * config.range_bins * false_plot_probability(quiet)


def main() -> None:
    """Fit, print, write the page and its picture."""
    lines = [HEAD]
    figure, axes = plt.subplots(1, 2, figsize=(11, 4.2), layout="constrained", sharey=True)
    for (name, base), axis in zip((("line of 4", LINE), ("4 x 4", PLANE)), axes, strict=True):
        lines += [f"## {name}", ""]
        shares: dict[int, FloatArray] = {}
        losses: dict[int, float] = {}
        for swerling in (0, 1, 3):
            config = changed(base, swerling=swerling)
            runs = [watch(config, ratio, PLACE, RATE, LOOKS, 100 + k) for k, ratio in enumerate(RATIOS_DB)]
            shares[swerling] = np.array([run.detected / run.looks for run in runs])
            losses[swerling] = fitted_loss(config, shares[swerling])
            fine = np.linspace(RATIOS_DB[0], RATIOS_DB[-1], 200)
            (line,) = axis.plot(fine, expected(config, fine, losses[swerling]), label=f"Swerling {swerling}, model")
            axis.plot(RATIOS_DB, shares[swerling], "o", color=line.get_color(), label=f"Swerling {swerling}, samples")
        axis.set(title=name, xlabel="signal-to-noise ratio of one channel and sweep, dB", ylim=(-0.02, 1.02))
        axis.grid(alpha=0.3)
        lines += [
            "| SNR, dB | " + " | ".join(f"Swerling {s}: samples | model" for s in shares) + " |",
            "|" + "---|" * 7,
        ]
        for k, ratio in enumerate(RATIOS_DB):
            pairs = (
                f"{share[k]:.2f} | {float(expected(changed(base, swerling=s), ratio, losses[s])):.2f}"
                for s, share in shares.items()
            )
            lines.append(f"| {ratio:g} | " + " | ".join(pairs) + " |")
        words = ", ".join(f"{loss:.1f} dB (Swerling {s})" for s, loss in losses.items())
        lines += ["", f"Fitted losses of processing: {words}.", ""]
        lines += ["| SNR, dB | azimuth, deg | " + " | ".join(_ELEMENTS) + " |", "|" + "---|" * 6]
        ratios, offsets = [], []
        for ratio in (2.0, 10.0, 25.0):
            for azimuth in (0.0, 0.5, 1.0):
                run = watch(base, ratio, (PLACE[0], azimuth, PLACE[2]), RATE, LOOKS, 7 + round(azimuth * 10))
                sigma, bias = robust_sigma(run.error), np.nanmedian(run.error, axis=0)
                ideal = changed(base, plot_model=IDEAL)
                place = PLACE[0] * _towards(azimuth, PLACE[2])[None]
                total = np.array([base.channels * base.averages * 10.0 ** (ratio / 10.0)])
                bound = PlotModel(ideal).sigmas(place, total)[0]
                cells = (
                    "-" if np.isnan(s) else f"{s / b:.2f} ({m / s:+.2f})"
                    for s, b, m in zip(sigma, bound, bias, strict=True)
                )
                lines.append(f"| {ratio:g} | {math.degrees(azimuth):.0f} | " + " | ".join(cells) + " |")
                ratios.append(sigma / bound)
                offsets.append(bias / sigma)
        mean = np.nanmean(ratios, axis=0)
        words = ", ".join(
            f"{name} {m:.2f} ({o:+.2f})"
            for name, m, o in zip(_ELEMENTS, mean, np.nanmean(offsets, axis=0), strict=True)
            if np.isfinite(m)
        )
        lines += ["", f"Means: {words}.", ""]
        lines += ["| false alarm probability | looks | false plots: samples | model |", "|---|---|---|---|"]
        for p, n in ((1e-3, 600), (1e-2, 200), (1e-1, 30)):
            found, said = false_plots(base, p, n)
            lines.append(f"| {p:g} | {n} | {found} | {said:.0f} |")
        for former in ("conventional", "mvdr"):
            pair = changed(base, processing={"beamformer": former})
            model = changed(pair, level="plots")
            lines += ["", f"| beamformer {former}: apart, range bins | samples | model |", "|---|---|---|"]
            lines += [
                f"| {b:g} | {separated(pair, b, 0.0, PAIRS):.2f} | {separated(model, b, 0.0, PAIRS):.2f} |"
                for b in (0.25, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0)
            ]
            lines += ["", f"| {former}: same range, apart, beamwidths | samples | model |", "|---|---|---|"]
            lines += [
                f"| {w:g} | {separated(pair, 0.0, w, PAIRS):.2f} | {separated(model, 0.0, w, PAIRS):.2f} |"
                for w in (0.25, 0.5, 0.75, 1.0, 2.0)
            ]
        lines.append("")
    axes[0].set_ylabel("probability of detection")
    axes[0].legend()
    PAGE.parent.mkdir(exist_ok=True)
    figure.savefig(PAGE.with_suffix(".png"), dpi=110)
    text = "\n".join(lines)
    PAGE.write_text(text)
    print(text)


if __name__ == "__main__":
    main()
