"""Well-clear verdicts and times against the answers of an independent implementation (DAIDALUS 2.0.4)."""

import csv
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from wideberth.conflict.well_clear import PRESETS, WellClearVolume, conflict_interval, violation
from wideberth.units import FOOT

PAIRS = Path(__file__).resolve().parents[2].parent / "shared" / "reference" / "data" / "well_clear_pairs.csv"
VOLUMES = {
    "wcv450": WellClearVolume(4000 * FOOT, 450 * FOOT, 35.0),
    "wcv700": PRESETS["sarp"],
    "cyl": PRESETS["nmac"],
    "wcvstd066nmi": PRESETS["do365_phase1"],
    "wcvnoncoop2200": PRESETS["do365_noncooperative"],
    "wcvbuf1nmi_tcoa20": PRESETS["do365_buffered"],
}


@pytest.fixture(scope="module")
def columns() -> dict[str, NDArray[np.float64]]:
    if not PAIRS.exists():
        pytest.skip(f"reference data absent: {PAIRS.name}")
    with PAIRS.open() as file:
        rows = list(csv.DictReader(file))
    return {key: np.array([float(row[key]) for row in rows]) for key in rows[0] if key != "stratum"}


def states(columns: dict[str, NDArray[np.float64]]) -> list[NDArray[np.float64]]:
    return [
        np.stack([columns[f"{who}_{v}north_{u}"], columns[f"{who}_{v}east_{u}"], -columns[f"{who}_{v}up_{u}"]], axis=1)
        for who in ("own", "int")
        for v, u in (("", "m"), ("v", "mps"))
    ]


@pytest.mark.parametrize("name", VOLUMES)
def test_every_verdict_and_time_agrees(columns: dict[str, NDArray[np.float64]], name: str) -> None:
    own_p, own_v, p, v = states(columns)
    t_in, t_out = conflict_interval(VOLUMES[name], own_p, own_v, p, v, 180.0)
    expected = columns[f"{name}_conflict_180s"] == 1
    assert expected.sum() > 100
    np.testing.assert_array_equal(~np.isnan(t_in), expected)
    np.testing.assert_array_equal(np.isnan(t_in), np.isnan(t_out))
    np.testing.assert_allclose(t_in[expected], columns[f"{name}_time_in_s"][expected], rtol=0, atol=1e-6)
    np.testing.assert_allclose(t_out[expected], columns[f"{name}_time_out_s"][expected], rtol=0, atol=1e-6)


@pytest.mark.parametrize("name", VOLUMES)
def test_violation_now_agrees(columns: dict[str, NDArray[np.float64]], name: str) -> None:
    now = violation(VOLUMES[name], *states(columns))
    np.testing.assert_array_equal(now, columns[f"{name}_violation_now"] == 1)
