"""Simulated samples against the reference table of signal-to-noise ratios."""

import csv
from pathlib import Path

import numpy as np
import pytest

from wideberth.sensors.radar.link_budget import snr_db
from wideberth.sensors.radar.presets import PRESETS
from wideberth.sensors.radar.processing.range_compression import range_compress
from wideberth.sensors.radar.sweeps.paths import RadarTarget
from wideberth.sensors.radar.sweeps.simulate import simulate_noise, simulate_sweeps

TABLE = Path(__file__).resolve().parents[2].parent / "shared" / "reference" / "data" / "radar_snr.csv"


def measured_snr_db(radar, distance, rcs, azimuth=0.0):
    """Ratio of the power in the target's bin, less noise, to the noise in the bins, from samples alone."""
    bin_ = round(distance / radar.range_bin)
    target = [RadarTarget(bin_ * radar.range_bin, azimuth, rcs=rcs)]
    # The same noise with and without: what is left is the echo, through the converter.
    noise = [range_compress(radar, simulate_noise(radar, 40, seed)) for seed in (1, 2)]
    echo = range_compress(radar, simulate_sweeps(radar, target, 40, 1)) - noise[0]
    # Its phase is the same in all sweeps.
    power = np.mean(np.abs(echo[..., bin_].mean(axis=0)) ** 2)
    return 10 * np.log10(power / np.mean(np.abs(np.array(noise)[..., 1:]) ** 2))


@pytest.mark.parametrize("sampling", ["real", "complex"])
@pytest.mark.parametrize(("name", "rcs"), [("table_5_1", 0.1), ("uplooking_4x4", 0.01)])
def test_the_ratio_measured_is_that_of_the_link_budget(name, rcs, sampling):
    radar = PRESETS[name].model_copy(update={"sampling": sampling})
    for distance in (100.0, 250.0, 600.0):
        exact = round(distance / radar.range_bin) * radar.range_bin
        azimuth = 0.3
        assert measured_snr_db(radar, exact, rcs, azimuth) == pytest.approx(
            snr_db(exact, rcs, radar, azimuth=azimuth), abs=0.15
        )


def test_rows_of_the_table():
    if not TABLE.exists():
        pytest.skip(f"reference data absent: {TABLE.name}")
    radar = PRESETS["table_5_1"]
    with TABLE.open() as file:
        rows = [{k: float(v) for k, v in row.items()} for row in csv.DictReader(file)]
    rows = [row for row in rows if 50.0 <= row["range_m"] <= 600.0]
    assert len(rows) >= 8
    for row in rows:
        # Ranges of the table lie between bins; the fourth power takes them to the nearest bin's middle.
        exact = round(row["range_m"] / radar.range_bin) * radar.range_bin
        there = row["snr_1ch_1sweep_dB"] - 40 * np.log10(exact / row["range_m"])
        assert measured_snr_db(radar, exact, row["rcs_m2"]) == pytest.approx(there, abs=0.3)
