"""MAVLink frames in a stream: cutting, garbage, signatures, logs."""

import io
import random

import pytest

from wideberth.links.mavlink.dialect import mavlink
from wideberth.links.mavlink.telemetry_log import tlog_record
from wideberth.links.mavlink.vehicle import Vehicle
from wideberth.links.mavlink.wire import Wire, signing_key, split_frames

T = 1_700_000_000.0


def heartbeat(mode: int = 3):
    return mavlink.MAVLink_heartbeat_message(2, 3, 209, mode, 4, 3)


def sent(n: int = 1, **options) -> bytes:
    wire = Wire(1, 1, **options)
    for k in range(n):
        wire.send(heartbeat(k), T)
    return wire.take()


@pytest.mark.parametrize("size", [1, 2, 7, 20, 1000])
def test_frames_come_whole_however_they_are_cut(size: int) -> None:
    data, wire = sent(20), Wire(2, 1)
    got = [m for k in range(0, len(data), size) for m in wire.receive(data[k : k + size], T)]
    assert [m.custom_mode for m in got] == list(range(20))
    assert wire.counts["lost"] == 0


def test_garbage_costs_only_itself() -> None:
    noise = random.Random(2)
    wire = Wire(2, 1)
    got = []
    for frame in split_frames(sent(200)):
        # Markers in the noise promise frames that never come.
        got += wire.receive(noise.randbytes(30) + b"\xfd\xff" + frame, T)
    got += wire.receive(bytes(300), T)
    assert [m.custom_mode for m in got] == list(range(200))
    assert wire.counts["not a frame"] > 0


def test_a_damaged_frame_is_counted_and_the_next_taken() -> None:
    first, second = split_frames(sent(2))
    wire = Wire(2, 1)
    damaged = first[:12] + bytes([first[12] ^ 1]) + first[13:]
    assert [m.custom_mode for m in wire.receive(damaged + second, T)] == [1]
    assert wire.counts["not a frame"] >= 1


def test_lost_repeated_and_late_frames_are_counted() -> None:
    frames = split_frames(sent(6))
    wire = Wire(2, 1)
    for frame in (frames[0], frames[3], frames[3], frames[2], frames[5]):
        wire.receive(frame, T)
    assert wire.counts["lost"] == 3
    assert wire.counts["repeated"] == 1
    assert wire.counts["out of order"] == 1


def test_mavlink_1_is_understood() -> None:
    codec = mavlink.MAVLink(None, 1, 1)
    assert Wire(2, 1).receive(bytes(heartbeat(7).pack(codec, force_mavlink1=True)), T)[0].custom_mode == 7


def test_only_what_is_signed_with_the_key_is_taken() -> None:
    key = signing_key("secret")
    assert signing_key("ab" * 32) == bytes.fromhex("ab" * 32)
    good, unsigned, other = sent(key=key, link_id=3), sent(), sent(key=signing_key("else"))
    wire = Wire(2, 1, key)
    assert len(wire.receive(good, T)) == 1
    assert wire.receive(unsigned, T) == []
    assert wire.receive(other, T) == []
    assert wire.receive(good, T) == []  # played again
    assert wire.counts["signature refused"] >= 3
    assert len(Wire(2, 1, key, allow_unsigned=True).receive(unsigned, T)) == 1
    # Without a key signatures are not looked at.
    assert len(Wire(2, 1).receive(good, T)) == 1


def test_signatures_from_long_ago_are_refused() -> None:
    key = signing_key("secret")
    wire = Wire(2, 1, key)
    assert wire.receive(sent(key=key), T + 3600.0) == []


def test_what_does_not_fit_its_fields_is_refused() -> None:
    wire = Wire(1, 1)
    wire.send(mavlink.MAVLink_mission_count_message(1, 1, 70_000, 0), T)
    assert wire.take() == b""
    assert wire.counts["could not be packed"] == 1


def test_pymavlinks_own_reader_reads_our_log(tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("MAVLINK20", "1")
    mavutil = pytest.importorskip("pymavlink.mavutil")
    log = io.BytesIO()
    for k, frame in enumerate(split_frames(sent(5))):
        log.write(tlog_record(frame, T + k))
    path = tmp_path / "flight.tlog"
    path.write_bytes(log.getvalue())
    reader = mavutil.mavlink_connection(str(path), dialect="ardupilotmega")
    read = []
    while (message := reader.recv_match(blocking=False)) is not None:
        read.append((message.get_type(), message.custom_mode, message._timestamp))
    assert read == [("HEARTBEAT", k, T + k) for k in range(5)]


@pytest.mark.parametrize("first", [0, 100, 127, 128, 200, 255])
def test_the_mode_is_known_from_the_first_heartbeat_whatever_its_number(first: int) -> None:
    vehicle = Vehicle(None)
    for k in range(300):
        message = heartbeat(k % 7)
        message._header = mavlink.MAVLink_header(message.id, seq=(first + k) % 256, srcSystem=1, srcComponent=1)
        vehicle.take(message, T + k)
        assert vehicle.mode == k % 7
