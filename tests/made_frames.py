"""Range-compressed frames with echoes of known signal-to-noise ratio, in units of the noise of a bin."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.estimation.calibration import ArrayCalibration
from wideberth.sensors.radar.link_budget import noise_power, snr_db
from wideberth.sensors.radar.processing.config import ProcessingConfig
from wideberth.sensors.radar.processing.range_compression import range_compress
from wideberth.sensors.radar.sweeps.paths import RadarTarget
from wideberth.sensors.radar.sweeps.simulate import simulate_sweeps

Echo = tuple[float, float, float, float]
"""Range m, azimuth and elevation rad, range rate m/s."""

_CLEAN_DB = 90.0


def radar(rows: int, channels: int, beamformer: str = "conventional", **keys: object) -> RadarConfig:
    """Return a radar of few range bins whose elements see everywhere alike."""
    return RadarConfig.model_validate(
        {
            "channels": channels,
            "array_rows": rows,
            "sweep_time_ms": 2.0,
            "averages": 20,
            "if_bandwidth_mhz": 0.25,
            "azimuth_beamwidth_deg": None,
            "elevation_beamwidth_deg": None,
            "processing": ProcessingConfig.model_validate({"beamformer": beamformer}),
            **keys,
        }
    )


def clean_frame(config: RadarConfig, sweeps: int, echo: Echo) -> NDArray[np.complex64]:
    """Return an echo that has the power 1 in a bin's middle, with hardly any noise."""
    rcs = 10.0 ** ((_CLEAN_DB - float(snr_db(echo[0], 1.0, config))) / 10.0)
    target = RadarTarget(*echo, rcs=rcs)
    scale = np.float32(10.0 ** (-_CLEAN_DB / 20.0) / np.sqrt(noise_power(config)))
    return range_compress(config, simulate_sweeps(config, [target], sweeps, 1)) * scale


def noisy_frame(
    cleans: Sequence[NDArray[np.complex64]],
    snrs_db: Sequence[float],
    rng: np.random.Generator,
    response: ArrayCalibration | None = None,
) -> NDArray[np.complex64]:
    """Return echoes of random phases in noise of power 1; `response` is what the channels make of them."""
    frame = sum(
        c * np.complex64(10.0 ** (snr / 20.0) * np.exp(2j * np.pi * rng.random()))
        for c, snr in zip(cleans, snrs_db, strict=True)
    )
    if response is not None:
        frame = np.einsum("ij,kjb->kib", response.response, frame)
    noise = rng.standard_normal((*cleans[0].shape, 2), dtype=np.float32).view(np.complex64)[..., 0]
    return np.asarray(frame + np.float32(np.sqrt(0.5)) * noise, dtype=np.complex64)


def peak_bins(config: RadarConfig, echoes: Sequence[Echo]) -> NDArray[np.intp]:
    """Return the bins of the echoes' beats in the middle of the frame."""
    coupling = config.carrier_frequency_ghz * config.sweep_time_ms / config.bandwidth_mhz
    return np.array([round((e[0] + e[3] * coupling) / config.range_bin) for e in echoes], dtype=np.intp)
