"""An avoidance flown over MAVLink by each kind of vehicle, and what happens when something goes wrong meanwhile."""

import dataclasses
import itertools
from collections import Counter

import numpy as np
import pytest

from tests.mavlink_loop import COPTER, HOME, KINDS, PLANE, PX4_COPTER, Loop, items_of, place, sidestep, square
from wideberth.errors import InputError
from wideberth.links.mavlink.autopilot import Autopilot
from wideberth.links.mavlink.dialect import mavlink
from wideberth.links.mavlink.mission_items import same_mission, speed_change
from wideberth.links.mavlink.mission_protocol import MissionUpload
from wideberth.links.mavlink.wire import Wire

GROUND_STATION = 255


def name(kind) -> str:
    return f"{kind.family}_{kind.airframe}"


def avoiding(loop: Loop, seconds: float = 6.0, **step) -> Loop:
    """The loop in the middle of a maneuver."""
    assert loop.run(15.0, lambda x: x.link.mission() is not None and x.link.state == "monitoring"), loop.events
    loop.run(5.0)
    loop.wanted = sidestep(loop.t, loop.seen(), **step)
    assert loop.run(8.0, lambda x: any("flying the maneuver" in e for e in x.events)), loop.events
    loop.run(seconds)
    assert loop.link.state == "avoiding"
    return loop


def restored(loop: Loop, seconds: float = 20.0) -> None:
    """End the maneuver; mode and mission are as before."""
    loop.wanted = None
    assert loop.run(seconds, lambda x: x.link.state == "monitoring"), (loop.link.state, loop.events)
    assert loop.vehicle.mode == loop.kind.mission_mode
    loop.run(4.0)
    assert not loop.vehicle.mission.is_receiving
    assert not loop.link._mission.is_altered


@pytest.mark.parametrize("method", ["auto", "mission"])
@pytest.mark.parametrize("kind", KINDS, ids=name)
def test_a_maneuver_is_flown_and_the_mission_finished(kind, method: str) -> None:
    side = 600 if kind.airframe == "plane" else 400
    loop = Loop(kind, {"method": method}, square(side))
    before = list(loop.vehicle.mission.items)
    avoiding(loop, 12.0)
    assert max(p[1] for p in loop.track) > 60.0  # the way round was flown
    restored(loop)
    assert loop.vehicle.mission.items == before
    assert loop.run(250.0, lambda x: x.vehicle.complete)
    loop.run(3.0)
    assert loop.plan().index == len(loop.plan().waypoints)
    # All corners of the square were flown over.
    for north, east in ((side, 0), (side, side), (0, side), (0, 0)):
        assert min(np.hypot(p[0] - north, p[1] - east) for p in loop.track) < 31.0
    loop.link.release(loop.t)
    loop.run(1.0)
    assert loop.link.released


def test_nothing_is_commanded_without_command() -> None:
    loop = Loop(COPTER)
    loop.link._config = loop.link._config.model_copy(update={"command": False})
    loop.run(10.0)
    assert loop.link.state == "advisory"
    loop.up.log = []
    loop.wanted = sidestep(loop.t, loop.seen())
    loop.run(15.0)
    assert loop.vehicle.mode_changes == []
    sent = Wire(9, 9).receive(b"".join(loop.up.log), loop.t)
    assert {m.get_type() for m in sent} <= {
        "HEARTBEAT",
        "TIMESYNC",
        "MISSION_REQUEST_LIST",
        "MISSION_REQUEST_INT",
        "MISSION_ACK",
        "PARAM_REQUEST_READ",
        "COMMAND_LONG",
    }
    commands = {m.command for m in sent if m.get_type() == "COMMAND_LONG"}
    assert commands <= {
        mavlink.MAV_CMD_SET_MESSAGE_INTERVAL,
        mavlink.MAV_CMD_REQUEST_MESSAGE,
        mavlink.MAV_CMD_GET_HOME_POSITION,
    }


def test_a_waypoint_flown_past_in_the_maneuver_is_not_flown_back_to() -> None:
    items = [speed_change(9.0), *items_of([place(150, 0)]), speed_change(12.0), *items_of([place(900, 0)])]
    loop = Loop(COPTER, items=items)
    loop.run(5.0)
    loop.wanted = sidestep(loop.t, loop.seen(), right=40.0, ahead=150.0)
    loop.run(16.0)
    assert loop.plan().index == 2
    restored(loop)
    # Resumed with the speed change after the first waypoint: item 0 is home, 1 a speed, 2 the waypoint, 3 a speed.
    assert any("resumed at item 3" in e for e in loop.events), loop.events
    assert loop.vehicle.current == 4
    first = next(k for k, p in enumerate(loop.track) if p[0] > 170)
    assert min(p[0] for p in loop.track[first:]) > 160


@pytest.mark.parametrize("kind", [COPTER, PLANE, PX4_COPTER], ids=name)
def test_the_pilot_wins(kind) -> None:
    loop = avoiding(Loop(kind))
    loop.vehicle.set_mode(kind.loiter_mode)
    loop.run(1.0)
    assert loop.link.state == "pilot"
    changes = len(loop.vehicle.mode_changes)
    loop.run(20.0)  # the maneuver is still wanted, and not flown
    assert len(loop.vehicle.mode_changes) == changes
    assert loop.vehicle.mode == kind.loiter_mode
    assert any("by somebody else: avoidance is advisory" in e for e in loop.events)
    # He gives the mission back: the next maneuver is flown.
    loop.vehicle.set_mode(kind.mission_mode)
    loop.wanted = sidestep(loop.t, loop.seen())
    assert loop.run(5.0, lambda x: x.link.state == "avoiding")
    loop.run(3.0)
    restored(loop)


def test_a_pilot_who_sets_the_mission_mode_does_not_want_this_maneuver() -> None:
    loop = avoiding(Loop(COPTER))
    loop.vehicle.set_mode(COPTER.mission_mode)
    loop.run(10.0)
    assert loop.vehicle.mode == COPTER.mission_mode
    assert loop.link.state == "pilot"
    loop.wanted = None
    loop.run(1.0)
    assert loop.link.state == "monitoring"
    loop.wanted = sidestep(loop.t, loop.seen())
    assert loop.run(5.0, lambda x: x.link.state == "avoiding")


def test_a_pilot_who_takes_over_while_the_maneuver_is_in_the_mission_gets_his_mission_back() -> None:
    loop = Loop(PLANE, {"method": "mission"})
    before = list(loop.vehicle.mission.items)
    avoiding(loop)
    assert len(loop.vehicle.mission.items) == len(before) + 2
    loop.vehicle.set_mode(PLANE.loiter_mode)
    loop.run(10.0)
    assert loop.link.state == "pilot"
    assert loop.vehicle.mission.items == before
    assert loop.vehicle.mode == PLANE.loiter_mode


@pytest.mark.parametrize("kind", KINDS, ids=name)
def test_a_link_cut_for_ten_seconds(kind) -> None:
    loop = avoiding(Loop(kind), 3.0)
    assert loop.wanted is not None
    loop.wanted = dataclasses.replace(loop.wanted, valid_until=loop.t + 100.0)
    loop.down.cut = loop.up.cut = True
    loop.run(10.0)
    assert loop.link.state == "no link"
    assert loop.link.health(loop.t).age > 9.0
    loop.down.cut = loop.up.cut = False
    loop.wanted = None
    start = loop.t
    assert loop.run(20.0, lambda x: x.link.state in ("monitoring", "pilot")), (loop.link.state, loop.events)
    assert loop.t - start < 5.0
    # PX4 leaves OFFBOARD by its own failsafe: that is somebody else's mode, and is left alone.
    expected = kind.loiter_mode if kind.family == "px4" else kind.mission_mode
    assert loop.vehicle.mode == expected
    assert any("link lost" in e for e in loop.events)


@pytest.mark.parametrize("items_written", [1, 3])
def test_a_reboot_in_the_middle_of_an_upload(items_written: int) -> None:
    loop = Loop(PLANE, {"method": "mission"})
    before = list(loop.vehicle.mission.items)
    loop.run(10.0)
    loop.wanted = sidestep(loop.t, loop.seen())
    server = loop.vehicle.mission
    assert loop.run(5.0, lambda x: server.is_receiving and len(server._incoming) >= items_written)
    loop.vehicle.reboot(loop.t)
    loop.vehicle.set_mode(PLANE.mission_mode)
    loop.run(2.0)
    loop.wanted = None
    assert loop.run(40.0, lambda x: x.link.state == "monitoring"), (loop.link.state, loop.events)
    loop.run(3.0)
    assert same_mission(loop.vehicle.mission.items, before, home_is_item_0=True)
    assert any("rebooted" in e for e in loop.events)
    assert not loop.link._mission.is_altered


def test_another_ground_station_changes_the_mission() -> None:
    other = square(300.0)[:3]
    for method in ("auto", "mission"):
        loop = avoiding(Loop(COPTER, {"method": method, "mission_check_s": 5.0}))
        theirs = [loop.vehicle.mission.items[0], *other]
        loop.vehicle.mission.items[:] = theirs
        loop.vehicle.mission.version += 1
        loop.run(15.0)
        assert any("another ground station has changed the mission" in e for e in loop.events), loop.events
        loop.wanted = None
        assert loop.run(20.0, lambda x: x.link.state == "monitoring"), (loop.link.state, loop.events)
        loop.run(5.0)
        assert loop.vehicle.mission.items == theirs  # kept
        assert len(loop.plan().waypoints) == 4


def test_an_upload_that_is_refused_is_said_in_words_and_the_mission_kept() -> None:
    loop = Loop(COPTER, {"method": "mission"})
    before = list(loop.vehicle.mission.items)
    loop.run(10.0)
    loop.vehicle.mission.refuse_with = mavlink.MAV_MISSION_NO_SPACE
    loop.wanted = sidestep(loop.t, loop.seen())
    loop.run(10.0)
    assert "mission upload failed: no space for so many items" in loop.events
    assert any("could not be put into the mission" in e for e in loop.events)
    loop.vehicle.mission.refuse_with = None
    loop.wanted = None
    assert loop.run(20.0, lambda x: x.link.state == "monitoring")
    assert loop.vehicle.mission.items == before


def test_gps_loss_is_said_and_not_silent() -> None:
    loop = Loop(COPTER)
    loop.run(8.0)
    assert loop.seen().state == "ok"
    loop.vehicle.telemetry.has_gps = False
    loop.run(3.0)
    own = loop.seen()
    assert own.state == "autopilot has no GPS fix"
    assert loop.t - own.t > 2.0  # what is old says so
    assert loop.link.health(loop.t).state == own.state
    loop.vehicle.telemetry.has_gps = True
    loop.run(3.0)
    assert loop.seen().state == "ok"


@pytest.mark.parametrize("jump", [3.0, -3.0])
def test_a_clock_that_jumps_is_noticed_and_made_up_for(jump: float) -> None:
    loop = Loop(COPTER)
    loop.run(10.0)
    assert 0.0 <= loop.t - loop.seen().t < 0.3
    loop.offset = jump
    loop.run(3.0)
    now = loop.t + loop.offset
    assert -1e-6 <= now - loop.seen().t < 0.3
    assert any("offset jumped" in e for e in loop.events)
    assert loop.link.state == "monitoring"


def test_no_commanded_point_goes_below_the_floor() -> None:
    loop = Loop(COPTER, {"floor_agl_m": 60.0})
    avoiding(loop, 15.0, height=-95.0)
    lowest = min(-p[2] - HOME.altitude for p in loop.track)
    assert 59.0 < lowest < 70.0
    restored(loop)


def test_a_human_approves_or_refuses() -> None:
    human = Wire(GROUND_STATION, 190)

    def answer(loop: Loop, yes: float) -> None:
        us = (loop.config.system_id, loop.config.component_id)
        human.send(mavlink.MAVLink_command_long_message(*us, mavlink.MAV_CMD_USER_1, 0, yes, 0, 0, 0, 0, 0, 0), loop.t)
        loop.link.receive(human.take(), loop.t)

    for yes, state in ((1.0, "avoiding"), (0.0, "monitoring"), (None, "monitoring")):
        loop = Loop(COPTER, {"approval": "window", "approval_window_s": 5.0})
        loop.run(8.0)
        loop.wanted = sidestep(loop.t, loop.seen())
        loop.run(2.0)
        assert loop.link.state == "approval"
        assert loop.vehicle.mode_changes == []
        if yes is not None:
            answer(loop, yes)
        loop.run(6.0)
        assert loop.link.state == state, loop.events


def test_release_gives_back_control_in_the_middle_of_a_maneuver() -> None:
    for kind in KINDS:
        loop = avoiding(Loop(kind))
        loop.link.release(loop.t)
        assert loop.run(5.0, lambda x: x.link.released), (kind, loop.link.state, loop.events)
        loop.run(2.0)
        assert loop.vehicle.mode == kind.mission_mode
        assert loop.link.state == "monitoring"


def test_signed_frames() -> None:
    loop = avoiding(Loop(COPTER, {"signing_key": "our secret"}))
    restored(loop)
    stranger = Wire(1, 1)
    loop.run(1.0)
    stranger.send(mavlink.MAVLink_heartbeat_message(2, 3, 81, 5, 4, 3), loop.t)
    loop.link.receive(stranger.take(), loop.t)
    loop.run(1.0)
    assert loop.link.state == "monitoring"
    assert loop.link.counters["signature refused"] == 1


@pytest.mark.parametrize("method", ["guided", "mission"])
@pytest.mark.parametrize("kind", [COPTER, PLANE, PX4_COPTER], ids=name)
def test_a_program_that_was_killed_in_a_maneuver_leaves_it_to_the_next_one(kind, method: str) -> None:
    loop = Loop(kind, {"method": method})
    before = list(loop.vehicle.mission.items)
    assert loop.link.hand_over is None
    avoiding(loop, 4.0)
    left = loop.link.hand_over
    assert left is not None
    loop.link, loop.wanted = Autopilot(loop.config), None
    loop.link.recall(left)
    assert loop.run(20.0, lambda x: x.link.state in ("monitoring", "pilot") and x.link.released is False)
    loop.run(8.0)
    if kind.family == "px4" and method == "guided" and loop.vehicle.mode == kind.loiter_mode:
        assert loop.link.state == "pilot"  # its failsafe had the mode by then
        return
    assert loop.link.state == "monitoring", loop.events
    assert loop.vehicle.mode == kind.mission_mode
    assert loop.vehicle.mission.items == before
    assert loop.link.hand_over is None


def test_a_note_that_is_none_is_refused() -> None:
    for text in ("", "{}", '{"guided": 1, "seq": 2, "items": [1], "altered": []}'):
        with pytest.raises(InputError, match="no note"):
            Autopilot(Loop(COPTER).config).recall(text)


def test_without_a_home_the_height_above_it_tells_the_altitudes(monkeypatch) -> None:
    relative = [dataclasses.replace(item, frame=6, z=item.z - HOME.altitude) for item in square()]
    loop = Loop(COPTER, items=relative)
    monkeypatch.setattr(loop.vehicle.telemetry, "_home_position", lambda: None)
    assert loop.run(20.0, lambda x: x.link.mission() is not None), loop.events
    assert np.allclose(loop.plan().waypoints[1:, 2], -(HOME.altitude + 100.0), atol=0.05)


def test_terrain_that_rises_does_not_begin_the_maneuver_anew() -> None:
    loop = avoiding(Loop(COPTER, {"floor_agl_m": 50.0}), 0.0)
    ground = HOME.altitude
    for _ in range(25):
        ground += 3.0  # the hill rises to 25 m below the maneuver
        report = mavlink.MAVLink_terrain_report_message(0, 0, 100, ground, 0.0, 0, 4)
        loop.vehicle._send(report)
        loop.run(1.0)
    assert min(p[0] - q[0] for q, p in itertools.pairwise(loop.track)) > -0.1  # never back
    assert -loop.position[2] > ground + 45.0


def test_a_guided_mode_that_is_refused_leaves_the_mission_as_the_way(monkeypatch) -> None:
    loop = Loop(COPTER)
    loop.run(10.0)
    monkeypatch.setattr(loop.vehicle, "_ask_mode", lambda mode: False)
    loop.wanted = sidestep(loop.t, loop.seen(), ahead=400.0)
    assert loop.run(25.0, lambda x: "flying the maneuver as part of the mission" in x.events), loop.events
    assert any("GUIDED was not taken: denied" in e for e in loop.events)
    restored(loop)


def test_a_completed_mission_is_not_begun_anew() -> None:
    loop = Loop(COPTER, items=items_of([place(120, 0)]))
    assert loop.run(60.0, lambda x: x.vehicle.complete)
    loop.run(2.0)
    loop.wanted = sidestep(loop.t, loop.seen())
    assert loop.run(5.0, lambda x: x.link.state == "avoiding")
    loop.run(5.0)
    restored(loop)
    assert loop.vehicle.current == 1 and len(loop.vehicle.mission.items) == 2
    assert loop.run(60.0, lambda x: x.vehicle.complete)
    assert np.hypot(*(loop.position - place(120, 0))[:2]) < 6.0


def test_an_upload_of_another_ground_station_is_taken_over_soon() -> None:
    loop = Loop(COPTER)
    loop.run(10.0)
    loop.down.log = []
    station = Wire(GROUND_STATION, 190)
    theirs = [loop.vehicle.mission.items[0], *square(250.0)[:3]]
    upload = MissionUpload(lambda m: station.send(m, loop.t), (1, 1), 0.5, 5, Counter(), theirs)
    upload.start(loop.t)
    for _ in range(100):
        loop.vehicle.receive(station.take(), loop.t)
        loop.step()
        for message in station.receive(b"".join(loop.down.log), loop.t):
            if message.get_type().startswith("MISSION_") and getattr(message, "target_system", 0) == GROUND_STATION:
                upload.take(message, loop.t)
        loop.down.log.clear()
    assert upload.done
    loop.run(2.0)
    assert any("another ground station has changed the mission" in e for e in loop.events)
    assert np.allclose(loop.plan().waypoints[1], place(250, 0), atol=0.05)
    assert loop.link.state == "monitoring"
