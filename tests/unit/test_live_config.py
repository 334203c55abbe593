"""The tables `[autopilot]` and `[[inputs]]` of a scenario."""

import pytest

from tests.live_fakes import FakeAutopilot, tables
from wideberth.assembly import build_pipeline
from wideberth.config import build_scenario, read_toml
from wideberth.errors import InputError
from wideberth.live.fly import Flight
from wideberth.live.radar_input import RadarUdpInput
from wideberth.live.session import read_flight
from wideberth.run import run_scenario
from wideberth.toml_text import to_toml

PLOTS = {"units": [{"radar_id": 1, "name": "west"}, {"radar_id": 2, "name": "east", "update_interval_s": 0.5}]}


def test_autopilot_and_inputs_are_chosen_by_kind_and_named():
    made = tables(14550)
    made["inputs"] += [
        {"kind": "beast", "connect": "receiver:30005"},
        {"kind": "sbs", "name": "second", "listen": "30003", "range_max_m": 9000.0},
        {"kind": "autopilot"},
    ]
    scenario = build_scenario(made)
    assert scenario.autopilot.target is FakeAutopilot and not scenario.autopilot.config.command
    assert [part.name for part in scenario.inputs] == ["radar", "beast", "second", "autopilot"]
    assert scenario.inputs[0].target is RadarUdpInput and scenario.sensors == ()
    assert [str(part.config.address(part.target.transport)) for part in scenario.inputs[:3]] == [
        "udp:127.0.0.1:0", "tcp:receiver:30005", "tcpin:127.0.0.1:30003",
    ]  # fmt: skip
    again = build_scenario(scenario.resolved())
    assert again == scenario


def test_the_resolved_scenario_survives_toml(tmp_path):
    scenario = build_scenario(tables(14550))
    (tmp_path / "a.toml").write_text(to_toml(scenario.resolved()))
    assert build_scenario(read_toml(tmp_path / "a.toml")) == scenario


def test_a_scenario_may_be_simulated_and_flown():
    both = build_scenario(tables(14550, sensor={"kind": "radar"}, traffic={"kind": "simulated"}))
    assert [s.name for s in both.sensors] == ["radar"] and [i.name for i in both.inputs] == ["radar"]


def test_radars_that_are_inputs_are_watched_each_at_its_own_rate():
    made = tables(14550)
    made["inputs"][0] |= PLOTS
    (part,) = build_scenario(made).inputs
    assert part.unit_names == ("west", "east") and part.look_intervals == {"west": 0.1, "east": 0.5}
    build_pipeline(build_scenario(made), lambda: 0.0, live=True)


def test_a_flights_scenario_is_not_simulated_blindly(tmp_path):
    with pytest.raises(InputError, match="sensor: missing; this scenario has inputs of a flight only"):
        run_scenario(build_scenario(tables(14550, mission=MISSION)), None)


MISSION = {
    "speed_mps": 13.0,
    "waypoints": [
        {"lat_deg": 40.0, "lon_deg": -111.0, "altitude_m": 200.0},
        {"lat_deg": 40.1, "lon_deg": -111.0, "altitude_m": 200.0},
    ],
}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda t: t.pop("autopilot"), "autopilot: missing; write \\[autopilot\\] kind"),
        (lambda t: t.pop("inputs"), "inputs: missing; without one nothing is seen"),
        (lambda t: t.update(inputs={}), "inputs: must be a list with a table for each input"),
        (lambda t: t["autopilot"].update(kind="pigeon"), "autopilot.kind: there is no 'pigeon' \\(known: mavlink"),
        (lambda t: t["autopilot"].update(port=3), "autopilot.port: unknown key"),
        (lambda t: t["inputs"][0].pop("listen"), "inputs.0: give either listen"),
        (lambda t: t["inputs"][0].update(connect="a:1"), "inputs.0: give either listen"),
        (lambda t: t["inputs"][0].update(kind="sonar"), "inputs.0.kind: there is no 'sonar'"),
        (lambda t: t["inputs"][0].update(listen="here"), "inputs.0: 'here' is no address: write udp:HOST:PORT"),
        (lambda t: t["inputs"].append(t["inputs"][0]), "inputs.1.name: inputs.0 is called 'radar' as well"),
        (lambda t: t["inputs"][0].update(name=3), "inputs.0.name: must be a text"),
        (lambda t: t.update(tracker={"kind": "adsb_kalman"}), "tracker.kind: adsb_kalman does not hear radar plots"),
    ],
)
def test_what_a_flight_needs_is_said(tmp_path, change, message):
    made = tables(14550)
    change(made)
    (tmp_path / "f.toml").write_text(to_toml(made))
    with pytest.raises(InputError, match=message):
        Flight(read_flight(tmp_path / "f.toml", command=False), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_only_the_command_line_lets_anything_be_commanded(tmp_path):
    made = tables(14550)
    made["autopilot"]["command"] = True
    (tmp_path / "f.toml").write_text(to_toml(made))
    assert Flight(read_flight(tmp_path / "f.toml", command=False), tmp_path).steps.commands is False
    made["autopilot"]["command"] = False
    (tmp_path / "f.toml").write_text(to_toml(made))
    assert Flight(read_flight(tmp_path / "f.toml", command=True), tmp_path).steps.commands is True
