"""Section 2.2 of the thesis, sentence by sentence, and its nominal case against independently computed values."""

import csv
from pathlib import Path

import numpy as np
import pytest

from wideberth.analysis.range_samples import sample
from wideberth.analysis.thesis_claims import claims
from wideberth.analysis.thesis_figures import FIGURES, sweep
from wideberth.units import DEGREE, FOOT, KNOT, NAUTICAL_MILE

DATA = Path(__file__).resolve().parents[2].parent / "shared" / "reference" / "data"
STATEMENTS = {"2.7": 5, "2.8": 6, "2.9": 5, "2.10": 4, "2.11": 4, "2.12": 4, "pilot-delay": 0}
METHODS = ("tgvv", "gvv", "tt", "gt")


def rows(name):
    path = DATA / name
    if not path.exists():
        pytest.skip(f"reference data absent: {name}")
    with path.open() as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize("name", list(FIGURES))
def test_every_statement_holds(name):
    stated = claims(sweep(name))
    assert len(stated) == STATEMENTS[name]
    assert [claim for claim in stated if not claim.holds] == []


def test_statements_are_told_apart_from_what_they_are_not():
    # With other inputs, or fewer points than they are checked at, nothing is claimed.
    assert claims(sweep("2.7", {"max_bank": 20 * DEGREE}, points=21)) == []
    assert claims(sweep("2.7", points=21)) == []
    assert claims(sweep("2.8", stop=30.0)) == []


@pytest.mark.parametrize(
    ("method", "distance_ft", "cpa_ft", "t_cpa"),
    [("tgvv", 5209, 500, 18.9), ("gvv", 4942, 456, 17.9), ("tt", None, 243, 12.9), ("gt", None, 116, 9.9)],
)
def test_figure_2_8(method, distance_ft, cpa_ft, t_cpa):
    (panel,) = sweep("2.8").panels
    curve = next(c for c in panel.curves if c.method == method)
    if distance_ft is not None:
        assert round(curve.values["range"][0] / FOOT) == distance_ft
    assert round(curve.marks[0].y / FOOT) == cpa_ft
    assert round(curve.marks[0].x, 1) == t_cpa


def test_figure_2_12():
    panels = sweep("2.12").panels
    fast = [c for c in panels[3].curves if c.method == "tgvv"]
    for curve in fast:
        assert curve.values["cpa"][1:] == pytest.approx(0.75 * NAUTICAL_MILE, rel=1e-7)
        assert round(curve.values["maneuver_time"][-1]) == 57
    errors = np.array([c.values["error"][1:] for c in panels[2].curves if c.method == "gvv"])
    assert errors.min() > 0 and errors.max() < 0.01


@pytest.mark.parametrize("name", ["2.7", "2.9"])
def test_the_common_level_is_the_nominal_table(name):
    table = rows("detection_range_nominal.csv")
    numbers = sweep(name, start=5 * KNOT, stop=300 * KNOT, points=60)
    at = [round(float(row["v_o_kt"]) / 5) - 1 for row in table]
    for panel in numbers.panels[1:]:
        for method in METHODS:
            curve = next(c for c in panel.curves if c.method == method and c.nominal)
            np.testing.assert_allclose(curve.x[at] / KNOT, [float(row["v_o_kt"]) for row in table])
            for quantity, key in (("distance", "d"), ("cpa", "cpa")):
                told = [float(row[f"{key}_{method.upper()}_ft"]) for row in table]
                np.testing.assert_allclose(curve.values[quantity][at] / FOOT, told, atol=6e-5, rtol=1e-8)
            if method in ("tgvv", "gvv"):
                assert [str(c) for c in curve.case[at]] == [row[f"{method}_case"] for row in table]


def test_random_encounters():
    table = rows("detection_range.csv")
    column = {key: np.array([float(row[key]) for row in table]) for key in table[0] if not key.endswith("_case")}
    names = {
        "ownship_speed": "v_o",
        "intruder_speed": "v_i",
        "safety_radius": "R_s",
        "max_bank": "phi_max",
        "computation_time": "t_c",
        "turn_angle": "chi_t",
        "max_bank_rate": "phidot_max",
        "roll_time_constant": "tau",
    }
    x = np.arange(len(table), dtype=np.float64)
    found = sample(METHODS, x, {ours: column[theirs] for ours, theirs in names.items()}, {})
    for method in METHODS:
        values, upper = found[method].values, method.upper()
        assert found[method].gaps == ()
        np.testing.assert_allclose(values["distance"], column[f"d_{upper}"], rtol=1e-8)
        np.testing.assert_allclose(values["maneuver_time"], column[f"tm_{upper}"], rtol=1e-7)
        np.testing.assert_allclose(values["cpa"], column[f"cpa_{upper}"], rtol=1e-6, atol=1e-4)
        errors = 1.0 - column[f"d_{upper}"] / column["d_TGVV"]
        np.testing.assert_allclose(values["error"], errors, atol=1e-7)
