"""Missions in the local frame: places, speeds, jumps, and where to resume."""

import dataclasses
import math

import numpy as np
import pytest

from tests.mavlink_loop import FRAME, HOME, items_of, place
from wideberth.links.mavlink.dialect import mavlink
from wideberth.links.mavlink.mission_items import Item, inserted, same_mission, speed_change
from wideberth.links.mavlink.mission_path import MissionPath

A, B, C = items_of([place(100, 0), place(100, 200), place(0, 200)])


def path(items, home_is_item_0: bool = False) -> MissionPath:
    return MissionPath(items, FRAME, HOME, 12.0, home_is_item_0=home_is_item_0)


def command(number: int, *params: float, z: float = 0.0, frame: int = mavlink.MAV_FRAME_MISSION) -> Item:
    one, two = (*params, 0.0, 0.0)[:2]
    return Item(frame, number, (one, two, 0.0, 0.0), 0, 0, z)


def test_waypoints_begin_at_home_in_the_air_where_there_is_no_takeoff() -> None:
    found = path([A, B, C])
    assert np.allclose(found.waypoints, [place(0, 0), place(100, 0), place(100, 200), place(0, 200)], atol=0.02)
    assert found.seqs == [-1, 0, 1, 2]
    assert path([A, A, B], home_is_item_0=True).seqs == [-1, 1, 2]


def test_altitudes_of_each_frame() -> None:
    z = 80.0
    frames = {
        mavlink.MAV_FRAME_GLOBAL: z,
        mavlink.MAV_FRAME_GLOBAL_INT: z,
        mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT: HOME.altitude + z,
        mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT: HOME.altitude + z,
        mavlink.MAV_FRAME_GLOBAL_TERRAIN_ALT_INT: HOME.altitude + z,
    }
    for frame, altitude in frames.items():
        found = path([dataclasses.replace(A, frame=frame, z=z)])
        assert -found.waypoints[1][2] == pytest.approx(altitude)


def test_speeds_change_with_the_commands() -> None:
    found = path([A, speed_change(20.0), B, command(mavlink.MAV_CMD_DO_CHANGE_SPEED, 0, -1.0), C])
    assert found.speeds.tolist() == [12.0, 12.0, 20.0, 20.0]


def test_takeoff_without_a_place_is_above_home_and_return_leads_home() -> None:
    takeoff = command(mavlink.MAV_CMD_NAV_TAKEOFF, z=50.0, frame=mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT)
    found = path([takeoff, A, command(mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH), B])
    assert np.allclose(found.waypoints[:2], [place(0, 0, 0), place(0, 0, 50.0)], atol=0.02)
    assert np.allclose(found.waypoints[3], place(0, 0), atol=0.02)
    assert len(found) == 4  # nothing is flown after the return


def test_unknown_commands_have_no_place() -> None:
    assert path([A, command(31_999, 1.0), B]).seqs == [-1, 0, 2]


def test_jumps_are_followed_as_often_as_they_say() -> None:
    jump = command(mavlink.MAV_CMD_DO_JUMP, 0, 2)
    found = path([A, B, jump, C])
    assert found.seqs == [-1, 0, 1, 0, 1, 0, 1, 3]
    assert found.index_of(0, 1) == 1
    assert found.index_of(0, 3) == 3
    assert found.index_of(1, 3) == 4
    assert found.index_of(2, 2) == 7  # the jump item itself: what comes after it is known as current soon
    assert found.seq_to_resume(3) == 0
    endless = path([A, B, command(mavlink.MAV_CMD_DO_JUMP, 0, -1)])
    assert len(endless) == 2000
    assert len(path([A, command(mavlink.MAV_CMD_DO_JUMP, 1, -1)])) == 2  # a jump to itself
    assert len(path([A, command(mavlink.MAV_CMD_DO_JUMP, math.nan, math.nan), B])) == 3


def test_resuming_runs_the_commands_between_waypoints() -> None:
    found = path([A, speed_change(20.0), command(mavlink.MAV_CMD_DO_SET_SERVO, 1, 2), B, C])
    assert found.seq_to_resume(1) == 0
    assert found.seq_to_resume(2) == 1
    assert found.index_of(1, 1) == found.index_of(2, 1) == found.index_of(3, 1) == 2
    assert found.seq_to_resume(3) == 4
    assert found.index_of(9, 1) == len(found)


def test_a_waypoint_is_passed_across_its_leg_and_near() -> None:
    found = path([A, B])
    assert found.passed(1, place(90, 30), place(110, 30), 50.0)
    assert not found.passed(1, place(80, 30), place(90, 30), 50.0)
    assert not found.passed(1, place(90, 80), place(110, 80), 50.0)  # too far abeam
    assert not found.passed(1, place(110, 0), place(120, 0), 50.0)  # passed before


def test_jumps_lead_to_the_same_items_after_an_insertion() -> None:
    jump_back, jump_on = command(mavlink.MAV_CMD_DO_JUMP, 0, 1), command(mavlink.MAV_CMD_DO_JUMP, 3, 1)
    mission = [A, B, jump_back, C, jump_on]
    changed = inserted(mission, 1, [A, A])
    assert changed[1:3] == (A, A) and len(changed) == 7
    assert changed[4].params[0] == 0  # before the insertion: as it was
    assert changed[6].params[0] == 5  # item 3 is item 5 now
    assert changed[5] == C


def test_missions_that_fly_alike_are_the_same() -> None:
    home, moved = A, dataclasses.replace(A, x=A.x + 900)
    assert same_mission([home, B], [moved, B], home_is_item_0=True)
    assert not same_mission([home, B], [moved, B], home_is_item_0=False)
    assert same_mission([B], [dataclasses.replace(B, z=B.z + 0.005, params=(0.0, 2.0, 0.0, 0.0))], home_is_item_0=False)
    assert not same_mission([B], [dataclasses.replace(B, z=B.z + 1.0)], home_is_item_0=False)
    assert not same_mission([B], [B, C], home_is_item_0=False)
