"""The link budget against the reference table for the radar of table 5.1."""

import csv
from pathlib import Path

import numpy as np
import pytest

from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.link_budget import averaging_gain_db, beamforming_gain_db, snr_db

TABLE = Path(__file__).resolve().parents[2].parent / "shared" / "reference" / "data" / "radar_snr.csv"


@pytest.fixture(scope="module")
def columns() -> dict[str, np.ndarray]:
    if not TABLE.exists():
        pytest.skip(f"reference data absent: {TABLE.name}")
    with TABLE.open() as file:
        rows = list(csv.DictReader(file))
    return {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}


def test_every_row_and_column(columns: dict[str, np.ndarray]) -> None:
    config = RadarConfig()
    single = snr_db(columns["range_m"], columns["rcs_m2"], config)
    beam = single + beamforming_gain_db(config.channels)
    assert single.shape == (28,)
    np.testing.assert_allclose(single, columns["snr_1ch_1sweep_dB"], rtol=0, atol=1e-12)
    np.testing.assert_allclose(beam, columns["snr_4ch_beamformed_dB"], rtol=0, atol=1e-12)
    averaged = columns["plus_5logN_32avg_dB"], columns["plus_10logN_32avg_dB"]
    np.testing.assert_allclose(beam + averaging_gain_db(config.averages), averaged[0], rtol=0, atol=1e-12)
    np.testing.assert_allclose(beam + averaging_gain_db(config.averages, "coherent"), averaged[1], rtol=0, atol=1e-12)
