"""No bytes whatever bring a decoder down, and every message is counted exactly once."""

import gzip
import json
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests import adsb_frames as encoder
from wideberth.errors import InputError
from wideberth.sensors.adsb.beast import BeastReader
from wideberth.sensors.adsb.clock_guard import ClockGuard
from wideberth.sensors.adsb.decoder import ModeSDecoder
from wideberth.sensors.adsb.frame_readers import AvrReader, JsonFrameReader
from wideberth.sensors.adsb.sbs import SbsReader
from wideberth.sensors.adsb.sources import open_traffic
from wideberth.sensors.adsb.trajectories import TrajectoryReader

FLIGHT = encoder.flight(0x393322, duration=10.0)
BEAST = b"".join(encoder.beast(frame, int((t - 900) * 12e6)) for t, frame in FLIGHT)
AVR = "".join(f"@{int((t - 900) * 12e6):012x}{frame.hex()};\n" for t, frame in FLIGHT).encode()
JSON = "".join(json.dumps({"timestamp": t, "frame": frame.hex()}) + "\n" for t, frame in FLIGHT).encode()
SBS = b"".join(
    f"MSG,{3 + k % 2},1,1,ABCDEF,1,2015/09/02,04:23:{k:02d}.500,,,,3000,120,90,48.{k},2.1,64,,0,0,0,0\r\n".encode()
    for k in range(40)
)
ROWS = json.dumps(
    [
        {"timestamp": 1633608773000 + 1000 * k, "icao24": "abcdef", "latitude": 48 + k / 1e3, "longitude": 2.0}
        | {"altitude": 3000.0, "groundspeed": 100.0, "track": 10.0, "vertical_rate": 64.0, "onground": False}
        for k in range(30)
    ]
).encode()
STREAMS = {
    BeastReader: BEAST,
    AvrReader: AVR,
    JsonFrameReader: JSON,
    SbsReader: SBS,
    TrajectoryReader: ROWS,
}
MANY = settings(max_examples=100, deadline=None, derandomize=True)

frames = st.binary(max_size=16) | st.sampled_from([frame for _, frame in FLIGHT])
long_frames = st.builds(
    lambda me, df, control: encoder.squitter(0x393322, me, df, control),
    st.integers(0, 2**56 - 1),
    st.sampled_from([17, 18]),
    st.integers(0, 7),
)
replies = st.builds(
    lambda df, header, message: encoder.reply(0x393322, df, header, message if df >= 16 else 0),
    st.sampled_from([0, 4, 5, 16, 20, 21, 24]),
    st.integers(0, 2**27 - 1),
    st.integers(0, 2**56 - 1),
)


def check(reports):
    for report in reports:
        assert math.isfinite(report.t)
        assert math.isnan(report.latitude) or abs(report.latitude) <= math.pi / 2
        assert math.isnan(report.longitude) or abs(report.longitude) <= math.pi
        assert math.isnan(report.latitude) == math.isnan(report.longitude)
        assert not report.on_ground
        for value in (report.pressure_altitude, report.velocity_north, report.velocity_east, report.climb_rate):
            assert not math.isinf(value)


@MANY
@given(st.lists(frames | long_frames | replies, max_size=40), st.data())
def test_frames(given_frames, data):
    decoder = ModeSDecoder()
    decoder.decode([encoder.all_call(0x393322)], [0.0])
    times = data.draw(st.lists(st.floats(0, 100), min_size=len(given_frames), max_size=len(given_frames)))
    check(decoder.decode(given_frames, times))
    assert decoder.kinds.total() + decoder.rejects.total() == decoder.messages == len(given_frames) + 1
    positions = ("positions", "positions unresolved", "position jumps")
    assert sum(decoder.results[name] for name in positions) == decoder.kinds["airborne positions"]


@MANY
@given(st.integers(0, len(FLIGHT) - 1), st.integers(0, 111))
def test_a_flipped_bit_is_a_failed_check(k, bit):
    frame = bytearray(FLIGHT[k][1])
    frame[bit // 8] ^= 0x80 >> bit % 8
    decoder = ModeSDecoder()
    assert decoder.decode([bytes(frame)], [0.0]) == []
    assert decoder.rejects.total() == 1


@pytest.mark.parametrize("reader", STREAMS)
@MANY
@given(data=st.data())
def test_damaged_streams(reader, data):
    stream = bytearray(STREAMS[reader])
    for _ in range(data.draw(st.integers(0, 5))):
        position = data.draw(st.integers(0, len(stream) - 1))
        action = data.draw(st.sampled_from(["change", "insert", "delete"]))
        if action == "change":
            stream[position] = data.draw(st.integers(0, 255))
        elif action == "insert":
            stream[position:position] = data.draw(st.binary(max_size=30))
        else:
            del stream[position : position + data.draw(st.integers(1, 40))]
    stream = stream[: data.draw(st.integers(0, len(stream)))]
    whole = reader()
    reports = whole.feed(bytes(stream)) + whole.finish()
    check(reports)
    assert set(whole.rejects) <= set(whole.counters)
    counts(whole)
    # Cut anywhere, the stream gives the same.
    pieces, cut = reader(), data.draw(st.lists(st.integers(0, len(stream)), max_size=4).map(sorted))
    again = []
    for start, end in zip([0, *cut], [*cut, len(stream)], strict=True):
        again += pieces.feed(bytes(stream[start:end]))
    again += pieces.finish()
    assert repr(again) == repr(reports)
    if reader is not BeastReader:  # garbage is counted once a piece
        assert pieces.counters == whole.counters


def counts(reader):
    counters = reader.counters
    decoder = getattr(reader, "decoder", None)
    if decoder is not None:
        assert decoder.kinds.total() + decoder.rejects.total() == decoder.messages
        lost = reader.malformed.total() + reader.clock.rejects.total()
        assert counters["messages"] == decoder.messages + lost
    else:
        known = sum(reader.kinds.values()) + sum(
            count for name, count in reader.rejects.items() if name not in reader.results and "damaged" not in name
        )
        assert counters["messages"] == known


@pytest.mark.parametrize("reader", STREAMS)
@MANY
@given(data=st.binary(max_size=3000))
def test_random_bytes(reader, data):
    one = reader()
    check(one.feed(data) + one.finish())
    counts(one)


json_values = st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=8)
keys = st.sampled_from(["timestamp", "icao24", "latitude", "longitude", "altitude", "onground", "callsign", "track"])


@MANY
@given(st.lists(st.dictionaries(keys, json_values) | json_values, max_size=20))
def test_rows_of_anything(rows):
    reader = TrajectoryReader()
    reader.feed(json.dumps(rows).encode())
    check(reader.finish())
    counts(reader)


@MANY
@given(st.lists(st.fixed_dictionaries({}, optional={"timestamp": json_values, "frame": json_values}), max_size=20))
def test_json_frames_of_anything(rows):
    reader = JsonFrameReader()
    reader.feed("".join(json.dumps(row) + "\n" for row in rows).encode())
    check(reader.finish())
    counts(reader)


@MANY
@given(st.lists(st.floats() | st.floats(0, 5000), max_size=60))
def test_every_time_passes_or_is_counted(times):
    guard = ClockGuard()
    passed = [item for k, t in enumerate(times) for item in guard.check(t, k)] + guard.finish()
    assert len(passed) + guard.rejects.total() == len(times)
    assert [k for _, k in passed] == sorted(k for _, k in passed)
    newest = -math.inf
    for t, _ in passed:
        assert t >= newest - ClockGuard.LATE
        newest = max(t, newest)


@MANY
@given(data=st.binary(max_size=2000), fmt=st.sampled_from(["auto", "beast", "avr", "sbs", "frames", "trajectories"]))
def test_files_of_random_bytes(tmp_path_factory, data, fmt):
    path = tmp_path_factory.getbasetemp() / "random.bin"
    path.write_bytes(data)
    with pytest.raises(InputError) as error:
        open_traffic(str(path), fmt)
    assert "\n" not in str(error.value)


@MANY
@given(st.integers(0, 400), st.sampled_from([BEAST, AVR, JSON, SBS]))
def test_truncated_gzip_keeps_what_came_before(tmp_path_factory, lost, stream):
    packed = gzip.compress(stream, mtime=0)
    path = tmp_path_factory.getbasetemp() / "cut.gz"
    path.write_bytes(packed[: max(len(packed) - 1 - lost, 0)])
    try:
        source = open_traffic(str(path))
    except InputError as error:
        assert "truncated" in str(error) or "empty" in str(error) or "none of the known" in str(error)
        return
    check(source.poll(math.inf))
    assert source.exhausted
    assert source.counters["truncated gzip"] == 1
