import itertools
import json
import math

import pytest

from tests import adsb_frames as encoder
from wideberth.sensors.adsb.beast import BeastReader
from wideberth.sensors.adsb.clock_guard import ClockGuard
from wideberth.sensors.adsb.frame_readers import NOMINAL_INTERVAL, AvrReader, JsonFrameReader
from wideberth.sensors.adsb.sbs import SbsReader
from wideberth.sensors.adsb.trajectories import TrajectoryReader
from wideberth.units import FOOT, FOOT_PER_MINUTE, KNOT

ADDRESS = 0x1A1A1A  # every byte of it must be doubled in Beast
FLIGHT = encoder.flight(ADDRESS, duration=30.0)


def read(reader, data):
    return reader.feed(data) + reader.finish()


def located(reports):
    return [r for r in reports if not math.isnan(r.latitude)]


def ticks(t):
    return int((t - 900.0) * 12e6)


def test_beast():
    stream = b"".join(encoder.beast(frame, ticks(t)) for t, frame in FLIGHT)
    reader = BeastReader()
    reports = read(reader, stream)
    assert reader.counters["positions"] == 59
    assert not reader.rejects
    assert [r.t for r in reports] == pytest.approx([t - 1000.0 for t, _ in FLIGHT], abs=1e-6)


def test_beast_finds_its_way_back():
    messages = [encoder.beast(frame, ticks(t)) for t, frame in FLIGHT]
    stream = (
        b"garbage" + messages[0] + messages[1][:12] + b"".join(messages[2:6]) + b"\x1a\x39" + b"".join(messages[6:])
    )
    reader = BeastReader()
    read(reader, stream + messages[0][:15])
    assert reader.malformed == {"Beast garbage skipped": 3, "message cut by the end": 1}
    assert reader.decoder.messages == len(FLIGHT) - 1
    assert not reader.decoder.rejects


def test_beast_byte_by_byte_is_the_same():
    stream = b"".join(encoder.beast(frame, ticks(t)) for t, frame in FLIGHT)
    whole, pieces = BeastReader(), BeastReader()
    reports = [report for k in range(len(stream)) for report in pieces.feed(stream[k : k + 1])] + pieces.finish()
    assert repr(reports) == repr(read(whole, stream))
    assert pieces.counters == whole.counters


def test_beast_other_messages_are_counted():
    reader = BeastReader()
    read(reader, encoder.beast(b"\x12\x34", 5) + b"\x1a4" + bytes(21) + encoder.beast(encoder.all_call(7), 6))
    assert reader.counters == {"messages": 3, "Mode A/C": 1, "receiver status": 1, "all-call replies": 1}


def test_beast_gps_time_is_noticed_and_runs_over_midnight():
    flight = encoder.flight(ADDRESS, duration=80.0)
    start = 86400 - 50
    messages = []
    for t, frame in flight:
        second, rest = divmod((start + t - 1000.0) % 86400, 1.0)
        messages.append(encoder.beast(frame, int(second) << 30 | int(rest * 1e9)))
    reports = read(BeastReader(), b"".join(messages))
    assert [r.t for r in reports] == pytest.approx([t - 1000.0 for t, _ in flight], abs=1e-6)
    assert read(BeastReader(gps_time=True), b"".join(messages[:20]))[-1].t == pytest.approx(4.6)


def test_a_receiver_counter_that_starts_anew_goes_on():
    later = [(t + 30.0, frame) for t, frame in encoder.flight(ADDRESS, latitude=48.014, duration=30.0)]
    stream = b"".join(encoder.beast(frame, ticks(t)) for t, frame in FLIGHT)
    stream += b"".join(encoder.beast(frame, ticks(t - 129.9)) for t, frame in later)
    reports = read(BeastReader(), stream)
    assert len(reports) == 240
    assert all(b.t >= a.t for a, b in itertools.pairwise(reports))
    assert reports[-1].t < 70.0


@pytest.mark.parametrize(
    "form", ["@{ticks:012x}{frame};", "%{ticks:012X}{frame};", "<{ticks:012x}80{frame};", "*{frame};", ":{frame};"]
)
def test_avr(form):
    lines = [form.format(ticks=ticks(t), frame=frame.hex()) + "\r\n" for t, frame in FLIGHT]
    reader = AvrReader(timed="ticks" in form)
    reports = read(reader, "".join([*lines, "nonsense\n", "*1234;\n", "\n"]).encode())
    assert reader.malformed == {"line not understood": 1, "Mode A/C": 1}
    assert len(located(reports)) == 59
    step = NOMINAL_INTERVAL if "ticks" not in form else None
    times = [(k + 1) * step for k in range(120)] if step else [t - 1000.0 for t, _ in FLIGHT]
    assert [r.t for r in reports] == pytest.approx(times, abs=1e-6)


def test_json_frames():
    lines = [json.dumps({"timestamp": t, "frame": frame.hex(), "df": "17"}) for t, frame in FLIGHT]
    lines[3:3] = ["{", '{"timestamp": 1}', '{"timestamp": "x", "frame": "8d"}', '{"timestamp": 1000, "frame": "zz"}']
    lines[9:9] = ['{"timestamp": NaN, "frame": "8d"}', '{"timestamp": 1001, "frame": "8d"}']
    reader = JsonFrameReader()
    reports = read(reader, "\n".join(lines).encode())
    assert reader.rejects == {"line not understood": 4, "time not a number": 1, "wrong length": 1}
    assert reader.counters["messages"] == 126
    assert [r.t for r in reports] == [t for t, _ in FLIGHT]


def test_a_wrong_time_hides_nothing():
    guard = ClockGuard()
    times = [0.0, 1.0, 5000.0, 2.0, -300.0, 3.0, 2.5]
    assert [t for time in times for t, _ in guard.check(time, None)] == [0.0, 1.0, 2.0, 3.0, 2.5]
    assert guard.rejects == {"time jumps ahead": 1, "time jumps back": 1}


def test_a_clock_set_back_goes_on():
    guard = ClockGuard()
    times = [*map(float, range(1000, 1010)), *map(float, range(0, 10))]
    passed = [t for time in times for t, _ in guard.check(time, None)]
    assert passed == [*range(1000, 1010), *range(1069, 1079)]
    assert not guard.rejects
    assert guard.results == {"clock set back (later times moved on)": 1}


def test_a_gap_in_a_recording_loses_nothing():
    guard = ClockGuard()
    times = [0.0, 1.0, *(10000.0 + k for k in range(7)), 20000.0]
    passed = [t for time in times for t, _ in guard.check(time, None)] + [t for t, _ in guard.finish()]
    assert passed == times
    assert guard.results == {"gaps in the recording": 1}


def sbs(kind, *, address="ABCDEF", stamp="2015/09/02,04:23:37.250", **values):
    columns = {"callsign": 10, "altitude": 11, "speed": 12, "track": 13, "lat": 14, "lon": 15, "rate": 16}
    columns |= {"squawk": 17, "emergency": 19, "ident": 20, "ground": 21}
    parts = ["MSG", str(kind), "1", "1", address, "1", *stamp.split(","), "", "", *[""] * 12]
    for name, value in values.items():
        parts[columns[name]] = str(value)
    return ",".join(parts) + "\r\n"


def test_sbs():
    lines = [
        sbs(1, callsign="AFR123  "),
        sbs(6, squawk="7700", emergency="-1", ident="1", altitude=3000),
        sbs(4, speed=100, track=90, rate=-640),
        sbs(3, altitude=3000, lat=48.5, lon=-2.25),
        sbs(3, altitude=3000, lat=0, lon=0),
        sbs(8),
        sbs(2, altitude=0, lat=48.5, lon=-2.25, speed=3),
        sbs(3, altitude=3000, lat=48.5, lon=-2.25, ground="-1"),
        sbs(9),
        sbs(3, lat="x", lon=3),
        "STA,,5,179,400AE7,10103,2008/11/28,14:58:51.153,2008/11/28,14:58:51.153,RM\n",
        "MSG,3\n",
    ]
    reader = SbsReader()
    velocity, position, altitude = read(reader, "".join(lines).encode())
    t = 1441167817.25
    assert velocity.t == position.t == t
    assert (velocity.velocity_north, velocity.velocity_east) == pytest.approx((0.0, 100 * KNOT), abs=1e-9)
    assert velocity.climb_rate == pytest.approx(-640 * FOOT_PER_MINUTE)
    assert math.degrees(position.latitude) == pytest.approx(48.5)
    assert math.degrees(position.longitude) == pytest.approx(-2.25)
    assert position.pressure_altitude == pytest.approx(3000 * FOOT)
    assert math.isnan(altitude.latitude)
    info = position.info
    assert (info.callsign, info.squawk, info.ident, info.emergency) == ("AFR123", "7700", True, "general emergency")
    assert reader.rejects == {"surface": 2, "line not understood": 3}
    assert reader.messages == len(lines)


def test_sbs_behind_a_counter():
    lines = ["START,Wed Sep 2 04:23:37 +0000 UTC 2015\n"]
    lines += [f"{k * 500_000_000}," + sbs(3, stamp=",", lat=48.5 + k / 1000, lon=2, altitude=3000) for k in range(4)]
    lines += ["\0\0\0START,Wed Sep 2 04:25:37 +0000 UTC 2015\n"]
    lines += ["500000000," + sbs(3, stamp=",", lat=48.6, lon=2)]
    reader = SbsReader()
    reports = read(reader, "".join(lines).encode())
    assert [r.t - 1441167817.0 for r in reports] == [0.0, 0.5, 1.0, 1.5, 120.5]
    assert not reader.rejects


def test_sbs_without_any_time_comes_at_a_nominal_rate():
    lines = [sbs(3, stamp=",", lat=48.5 + k / 1e5, lon=2, altitude=3000) for k in range(3)]
    assert [r.t for r in read(SbsReader(), "".join(lines).encode())] == pytest.approx([0.02, 0.04, 0.06])


def row(k, **changes):
    values = {"timestamp": 1633608773000 + 1000 * k, "icao24": "ABCDEF", "latitude": 48 + k / 1e3, "longitude": 2.0}
    values |= {"altitude": 3000.0 + k, "groundspeed": 100.0, "track": 90.0, "vertical_rate": 640.0}
    values |= {"onground": False, "callsign": "TEST1 ", "squawk": "1000"}
    values |= changes
    return {name: value for name, value in values.items() if value != "missing"}


def trajectories(*rows):
    reader = TrajectoryReader()
    assert reader.feed(json.dumps(rows).encode()) == []
    return reader, reader.finish()


def test_trajectories():
    reader, reports = trajectories(row(1), row(0, geoaltitude=3300.0))
    assert [r.t for r in reports] == [1633608773.0, 1633608774.0]
    first = reports[0]
    assert first.address == "abcdef"
    assert first.pressure_altitude == pytest.approx(3000 * FOOT)
    assert first.geometric_altitude == pytest.approx(3300 * FOOT)
    assert (first.velocity_north, first.velocity_east) == pytest.approx((0.0, 100 * KNOT), abs=1e-9)
    assert first.climb_rate == pytest.approx(640 * FOOT_PER_MINUTE)
    assert (first.info.callsign, first.info.squawk) == ("TEST1", "1000")
    assert reader.results["times that jump back (sorted)"] == 1


def test_trajectories_with_gaps():
    nan = math.nan
    reader, reports = trajectories(
        row(0, altitude=None, track="missing"),
        row(1, latitude=nan),
        row(2, latitude=91.0),
        row(3, onground=True),
        row(3),
        row(3),
        row(4, timestamp=None),
        row(5, icao24=None),
        7,
        row(6, latitude=None, longitude=None, altitude=None, groundspeed=None, vertical_rate=None),
    )
    assert reader.messages == 10
    assert reader.rejects == {
        "surface": 1, "duplicate rows": 2, "time not a number": 1, "row without address": 1, "row not understood": 1,
        "position off the Earth": 1,
    }  # fmt: skip
    assert len(reports) == 3
    assert math.isnan(reports[0].pressure_altitude)
    assert math.isnan(reports[0].velocity_north)
    assert math.isfinite(reports[0].latitude)
    assert all(math.isnan(r.latitude) and math.isfinite(r.pressure_altitude) for r in reports[1:])


def test_repeated_positions_are_stale():
    still = {"latitude": 48.0, "altitude": 3000.0}
    reader, reports = trajectories(
        row(0, **still), row(1, **still), row(2, latitude=48.0, altitude=3025.0), row(3, **still), row(4)
    )
    assert [math.isnan(r.latitude) for r in reports] == [False, True, True, False]
    changed = reports[1]
    assert changed.pressure_altitude == pytest.approx(3025 * FOOT)
    assert math.isnan(changed.velocity_north)
    assert math.isnan(changed.climb_rate)
    assert reader.results["repeated positions"] == 3


def test_trajectories_of_two_aircraft_with_one_address():
    rows = [row(k, latitude=48.0 + k / 1e3 + (k % 2)) for k in range(30)]
    reader, reports = trajectories(*rows)
    assert reader.results["addresses used by two aircraft"] == 1
    places = {name: [math.degrees(r.latitude) for r in reports if r.address == name] for name in ("abcdef", "abcdef#2")}
    assert all(len(p) > 10 and max(p) - min(p) < 0.1 for p in places.values())
    assert reader.rejects == {"position jumps": 2}


def test_trajectories_of_two_aircraft_with_one_address_at_the_same_times():
    rows = [row(k, latitude=48.0 + k / 1e3 + n) for k in range(30) for n in (0, 1)]
    reader, reports = trajectories(*rows)
    assert "duplicate rows" not in reader.rejects
    counts = [sum(r.address == name for r in reports) for name in ("abcdef", "abcdef#2")]
    assert min(counts) > 25


def test_a_cut_file_of_trajectories_keeps_what_is_there():
    data = json.dumps([row(k) for k in range(10)]).encode()
    reader = TrajectoryReader()
    reader.feed(data[: len(data) - 30])
    assert len(reader.finish()) == 9
    assert reader.rejects == {"file cut or damaged": 1}
