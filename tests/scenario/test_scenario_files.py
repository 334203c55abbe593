"""The scenarios that come with the project are valid."""

import tomllib
from pathlib import Path

import pytest

from wideberth.config import build_scenario, load_scenario
from wideberth.simulation.fleet_config import load_fleet
from wideberth.toml_text import to_toml

SCENARIOS = Path(__file__).resolve().parents[2] / "scenarios"
FLEETS = sorted(SCENARIOS.glob("cas_*.toml"))
FILES = sorted(set(SCENARIOS.glob("*.toml")) - set(FLEETS))


def test_there_are_scenarios() -> None:
    assert {"adsb_crossing.toml", "real_traffic.toml"} <= {f.name for f in FILES}


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.name)
def test_scenario_is_valid_and_its_resolved_configuration_reads_back(path: Path) -> None:
    scenario = load_scenario(path)
    assert scenario.name
    assert scenario.description
    assert build_scenario(tomllib.loads(to_toml(scenario.resolved()))) == scenario


@pytest.mark.parametrize("path", FLEETS, ids=lambda p: p.name)
def test_fleet_is_valid(path: Path) -> None:
    fleet = load_fleet(path)
    assert fleet.name
    assert fleet.description
