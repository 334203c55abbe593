"""Detection ranges and closest approaches against independently computed values."""

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from wideberth.analysis.detection_range import COLLISION_AVOIDANCE, METHODS, minimum_detection_range, simulate_cpa
from wideberth.units import FOOT, KNOT

DATA = Path(__file__).resolve().parents[2].parent / "shared" / "reference" / "data"
CASES = {"A": "A", "B": "B", "1": 1, "2": 2}


def columns(name: str) -> dict[str, NDArray[Any]]:
    path = DATA / name
    if not path.exists():
        pytest.skip(f"reference data absent: {name}")
    with path.open() as file:
        rows = list(csv.DictReader(file))
    table: dict[str, NDArray[Any]] = {}
    for key in rows[0]:
        values = [CASES.get(row[key], row[key]) if key.endswith("_case") else float(row[key]) for row in rows]
        table[key] = np.array(values)
    return table


@pytest.fixture(scope="module")
def sample() -> dict[str, NDArray[Any]]:
    return columns("detection_range.csv")


def arguments(sample: dict[str, NDArray[Any]]) -> dict[str, Any]:
    names = {
        "ownship_speed": "v_o",
        "intruder_speed": "v_i",
        "max_bank": "phi_max",
        "computation_time": "t_c",
        "turn_angle": "chi_t",
        "max_bank_rate": "phidot_max",
        "roll_time_constant": "tau",
    }
    return {ours: sample[theirs] for ours, theirs in names.items()}


@pytest.mark.parametrize("method", METHODS)
def test_distance_time_and_case(sample: dict[str, NDArray[Any]], method: Any) -> None:
    found = minimum_detection_range(method=method, safety_radius=sample["R_s"], **arguments(sample))
    np.testing.assert_allclose(found.distance, sample[f"d_{method.upper()}"], rtol=1e-8)
    np.testing.assert_allclose(found.maneuver_time, sample[f"tm_{method.upper()}"], rtol=1e-7)
    if method in ("tgvv", "gvv"):
        np.testing.assert_array_equal(np.asarray(found.case), sample[f"{method}_case"])
    else:
        assert found.case is None


@pytest.mark.parametrize("method", METHODS)
def test_closest_approach_of_the_printed_range(sample: dict[str, NDArray[Any]], method: str) -> None:
    found = simulate_cpa(sample[f"d_{method.upper()}"], **arguments(sample))
    np.testing.assert_allclose(found.cpa, sample[f"cpa_{method.upper()}"], rtol=1e-6)
    np.testing.assert_allclose(found.t_cpa, sample[f"tcpa_{method.upper()}"], rtol=1e-6)


@pytest.mark.parametrize("method", METHODS)
def test_nominal_values(method: Any) -> None:
    sample = columns("detection_range_nominal.csv")
    speed = sample["v_o_kt"] * KNOT
    found = minimum_detection_range(method=method, ownship_speed=speed, **COLLISION_AVOIDANCE)
    flown = {name: value for name, value in COLLISION_AVOIDANCE.items() if name != "safety_radius"}
    reached: Any = simulate_cpa(found.distance, ownship_speed=speed, **flown)  # type: ignore[arg-type]
    np.testing.assert_allclose(np.asarray(found.distance) / FOOT, sample[f"d_{method.upper()}_ft"], atol=6e-5)
    np.testing.assert_allclose(reached.cpa / FOOT, sample[f"cpa_{method.upper()}_ft"], atol=6e-4)
    if f"{method}_case" in sample:
        np.testing.assert_array_equal(np.asarray(found.case), sample[f"{method}_case"])
