"""Real recordings: what is counted in them agrees with rs1090's own decoding and with what is known of the files."""

import gzip
import itertools
import json
import math
import re
from pathlib import Path

import pytest
import rs1090

from wideberth.sensors.adsb.beast import BeastReader
from wideberth.sensors.adsb.decoder import ModeSDecoder
from wideberth.sensors.adsb.sources import open_traffic

FOLDER = Path(__file__).resolve().parents[2].parent / "shared/data/adsb"
pytestmark = pytest.mark.skipif(not FOLDER.is_dir(), reason=f"no recordings in {FOLDER}")
KINDS = {
    "0": "air-air replies",
    "16": "air-air replies",
    "4": "surveillance replies",
    "5": "surveillance replies",
    "11": "all-call replies",
    "20": "Comm-B replies",
    "21": "Comm-B replies",
}
SQUITTERS = {"05": "airborne positions", "06": "surface", "08": "identifications", "09": "velocities"}
SQUITTERS |= {"61": "status messages", "62": "status messages", "65": "status messages"}


def kind_by_rs1090(message):
    return KINDS.get(message["df"]) or SQUITTERS.get(message["bds"], "other extended squitters")


def read(name):
    source = open_traffic(str(FOLDER / name))
    return source, source.poll(math.inf)


@pytest.fixture(scope="module")
def flight():
    with gzip.open(FOLDER / "mode_s_one_flight.jsonl.gz", "rt") as lines:
        return [json.loads(line) for line in lines]


def by_rs1090(rows):
    times = [row["timestamp"] for row in rows]
    return times, rs1090.decode([row["frame"] for row in rows], times)


def by_us(rows):
    decoder = ModeSDecoder()
    frames = [bytes.fromhex(row["frame"]) for row in rows]
    return decoder, decoder.decode(frames, [row["timestamp"] for row in rows])


def test_positions_in_the_first_20000_frames(flight):
    decoder, reports = by_us(flight[:20000])
    _, messages = by_rs1090(flight[:20000])
    assert sum("latitude" in message for message in messages) == 2006
    assert decoder.results["positions"] == 2006
    assert sum(not math.isnan(report.latitude) for report in reports) == 2006


def test_each_kind_of_message_is_counted_like_rs1090_does(flight):
    decoder, _ = by_us(flight)
    _, messages = by_rs1090(flight)
    expected = {}
    for message in messages:
        kind = kind_by_rs1090(message)
        expected[kind] = expected.get(kind, 0) + 1
    assert {**decoder.kinds, **decoder.rejects} == expected
    assert decoder.messages == len(flight) == 57793
    assert decoder.rejects == {"surface": 1867}
    assert decoder.addresses == ("393322",)


def test_positions_are_those_of_rs1090(flight):
    _, reports = by_us(flight)
    times, messages = by_rs1090(flight)
    ours = {report.t: report for report in reports if not math.isnan(report.latitude)}
    compared = 0
    for t, message in zip(times, messages, strict=True):
        if message.get("bds") == "05" and "latitude" in message:
            assert math.degrees(ours[t].latitude) == pytest.approx(message["latitude"], abs=1e-9)
            assert math.degrees(ours[t].longitude) == pytest.approx(message["longitude"], abs=1e-9)
            assert ours[t].pressure_altitude == pytest.approx(message["altitude"] * 0.3048)
            compared += 1
    assert compared == 6352
    assert sum(not math.isnan(report.latitude) for report in reports) == 6451  # ours come back sooner after gaps


def test_velocities_are_those_of_rs1090(flight):
    _, reports = by_us(flight)
    times, messages = by_rs1090(flight)
    ours = {report.t: report for report in reports if not math.isnan(report.velocity_north)}
    compared = 0
    for t, message in zip(times, messages, strict=True):
        if message.get("bds") == "09" and "groundspeed" in message:
            report = ours[t]
            speed = math.hypot(report.velocity_north, report.velocity_east)
            assert speed == pytest.approx(message["groundspeed"] * 1852 / 3600, abs=1e-9)
            course = math.degrees(math.atan2(report.velocity_east, report.velocity_north)) % 360
            assert course == pytest.approx(message["track"], abs=1e-9)
            assert report.climb_rate == pytest.approx(message["vertical_rate"] * 0.3048 / 60)
            compared += 1
    assert compared == 6384


def test_raw_flight_as_a_source():
    source, reports = read("mode_s_one_flight.jsonl.gz")
    assert source.format == "frames"
    assert source.counters["positions"] == 6451
    assert source.counters["positions unresolved"] == 6
    last = reports[-1].info
    assert (last.callsign, last.squawk, last.nacp, last.nacv) == ("AFR34ZG", "1000", 8, 2)


def test_beast():
    source, reports = read("beast_one_aircraft.bin")
    assert source.format == "beast"
    data = (FOLDER / "beast_one_aircraft.bin").read_bytes()
    bodies = re.findall(
        rb"\x1a[23]((?:[^\x1a]|\x1a\x1a){14}|(?:[^\x1a]|\x1a\x1a){21})(?=\x1a[^\x1a]|\Z)", data, re.DOTALL
    )
    frames = [body.replace(b"\x1a\x1a", b"\x1a")[7:] for body in bodies]
    messages = rs1090.decode([frame.hex() for frame in frames])
    squitters = [m for m, f in zip(messages, frames, strict=True) if f[0] >> 3 == 17]
    counters = source.counters
    assert counters["messages"] == len(frames) == 239
    assert counters["airborne positions"] == sum(m is not None and m["bds"] == "05" for m in squitters)
    assert counters["velocities"] == sum(m is not None and m["bds"] == "09" for m in squitters)
    assert counters["identifications"] == sum(m is not None and m["bds"] == "08" for m in squitters)
    assert counters["positions"] == sum(not math.isnan(report.latitude) for report in reports)
    assert len({report.address for report in reports}) == 1
    assert reports[-1].t - reports[0].t == pytest.approx(20.8, abs=0.1)
    results = counters["messages"] + counters["positions"] + counters["positions unresolved"]
    assert sum(counters.values()) - results == 239


def test_beast_cut_inside_a_frame():
    data = (FOLDER / "beast_one_aircraft.bin").read_bytes()
    reader = BeastReader()
    reader.feed(data[:-3])
    reader.finish()
    assert reader.counters["messages"] == 239
    assert reader.rejects["message cut by the end"] == 1


def test_sbs():
    source, reports = read("sbs_44_aircraft.log.gz")
    assert source.format == "sbs"
    assert source.counters["messages"] == 44478  # one of them is damaged
    assert source.health(math.inf).rejects == {"surface": 448, "line not understood": 1}
    assert len(source.addresses) == 216
    located = [report for report in reports if not math.isnan(report.latitude)]
    assert len({report.address for report in located}) == 44
    assert len(located) == source.counters["positions"] == 1766
    assert source.counters["clock set back (later times moved on)"] == 2


def test_trajectories():
    source, reports = read("trajectories_213_aircraft.json.gz")
    with gzip.open(FOLDER / "trajectories_213_aircraft.json.gz") as file:
        rows = json.load(file)
    counters = source.counters
    assert counters["messages"] == len(rows) == 284505
    assert counters["surface"] == sum(row["onground"] is True for row in rows) == 55371
    assert len({report.address for report in reports}) == 213
    located = sum(not math.isnan(report.latitude) for report in reports)
    assert located == counters["positions"] == 213008
    assert located + counters["repeated positions"] + counters["surface"] == len(rows)
    assert all(b.t >= a.t for a, b in itertools.pairwise(reports))


def test_fire_fighting_aircraft():
    source, reports = read("trajectories_calfire.json.gz")
    counters = source.counters
    assert counters["messages"] == 9955
    assert counters["positions"] + counters["repeated positions"] + counters["position jumps"] == 9955
    assert counters["times that jump back (sorted)"] == 60
    assert len({report.address for report in reports}) == 45
    assert sum(not math.isnan(report.geometric_altitude) for report in reports) > 9000


def test_uat_recording_has_seven_aircraft():
    source, reports = read("uat_7_aircraft.log")
    assert source.format == "uat"
    counters = source.counters
    assert counters["messages"] == 303 + 383
    assert counters["ground uplinks (not used)"] == 383
    assert counters["TIS-B reports"] == counters["positions"] == len(reports) == 303
    assert source.health(math.inf).rejects == {}
    by_aircraft: dict = {}
    for report in reports:
        by_aircraft.setdefault(report.address, []).append(report)
    assert len(by_aircraft) == 7
    assert reports[-1].t - reports[0].t == pytest.approx(203.0, abs=3.0)
    said, flown = [], []
    for mine in by_aircraft.values():
        assert all(0.0 < report.pressure_altitude < 3000.0 for report in mine)
        for a, b in itertools.pairwise(mine):
            if 0.5 < b.t - a.t < 5.0:
                said.append(0.5 * (a.velocity_north + b.velocity_north) + 0.5j * (a.velocity_east + b.velocity_east))
                east = math.cos(a.latitude) * (b.longitude - a.longitude)
                flown.append(6_371_000.0 * complex(b.latitude - a.latitude, east) / (b.t - a.t))
    # TIS-B comes from radars: velocities lag behind in turns, and positions are smoothed.
    errors = sorted(abs(x - y) for x, y in zip(said, flown, strict=True))
    assert errors[len(errors) // 2] < 15.0 < 50.0 < sorted(map(abs, said))[len(said) // 2]
