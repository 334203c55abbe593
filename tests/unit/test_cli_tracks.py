import json
import math
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

from tests import adsb_frames as encoder
from wideberth.cli.main import app
from wideberth.cli.tracks import COLUMNS

ISSUE = [
    "time_s",
    "icao",
    "callsign",
    "lat_deg",
    "lon_deg",
    "altitude_m",
    "vnorth_mps",
    "veast_mps",
    "vup_mps",
    "sigma_h_m",
    "sigma_v_m",
    "status",
]


def run(*arguments):
    result = CliRunner().invoke(app, ["tracks", *map(str, arguments)])
    assert "Traceback" not in result.output
    return result


def recording(path, *flights):
    frames = sorted(frame for flight in flights for frame in flight)
    path.write_text("".join(json.dumps({"timestamp": t, "frame": frame.hex()}) + "\n" for t, frame in frames))
    return path


def test_a_row_per_track_and_second(tmp_path):
    callsign = encoder.squitter(0x393322, encoder.identification("AFR12"))
    first = [*encoder.flight(0x393322, north_kt=120, east_kt=90, duration=60.0), (1000.05, callsign)]
    second = encoder.flight(
        0x4840D6, latitude=49.5, longitude=3.0, altitude_ft=5000, north_kt=0, east_kt=-200, t0=1020.0
    )
    damaged = [(1002.0, first[0][1][:-1] + b"\0")]
    out = tmp_path / "tracks.parquet"
    result = run(recording(tmp_path / "frames", first, second, damaged), "--out", out)
    assert result.exit_code == 0
    words = " ".join(result.output.replace("│", " ").split())
    for line in ("airborne positions 160", "aircraft heard 2", "tracks 2", "left out: crc failed 1", "positions 158"):
        assert line in words
    table = pq.read_table(out)
    assert table.schema.names == ISSUE == [name for name, *_ in COLUMNS]
    assert table.schema.field("sigma_h_m").metadata[b"unit"] == b"m"
    rows = table.to_pylist()
    times = [row["time_s"] for row in rows if row["icao"] == "393322"]
    assert times == [float(t) for t in range(int(times[0]), int(times[-1]) + 1)]
    assert times[0] <= 1002.0
    assert times[-1] >= 1059.0
    row = next(row for row in rows if row["time_s"] == 1050.0 and row["icao"] == "393322")
    assert row["callsign"] == "AFR12"
    assert row["status"] == "confirmed"
    assert row["lat_deg"] == pytest.approx(48.0 + 120 * 50 / 216000, abs=3e-4)
    assert row["lon_deg"] == pytest.approx(2.0 + 90 * 50 / 216000 / math.cos(math.radians(48)), abs=4e-4)
    assert row["altitude_m"] == pytest.approx(914.4, abs=10.0)
    assert row["vnorth_mps"] == pytest.approx(61.7, abs=3.0)
    assert row["veast_mps"] == pytest.approx(46.3, abs=3.0)
    assert row["vup_mps"] == pytest.approx(0.0, abs=1.0)
    assert 0 < row["sigma_h_m"] < 200
    assert 0 < row["sigma_v_m"] < 50
    assert next(row for row in rows if row["icao"] == "4840d6")["callsign"] is None
    assert list(tmp_path.glob("*.partial")) == []


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["missing"], "does not exist"),
        (["beast://localhost:30005"], "live receiver"),
        (["x", "--out", "nowhere/tracks.parquet"], "folder 'nowhere' does not exist"),
        (["x", "--out", "."], "is a folder"),
    ],
)
def test_wrong_arguments_are_one_line(tmp_path, monkeypatch, arguments, message):
    monkeypatch.chdir(tmp_path)
    result = run(*arguments)
    assert result.exit_code == 2
    assert message in result.output
    assert len(result.output.strip().splitlines()) == 1


SHARED = Path(__file__).resolve().parents[2].parent / "shared" / "data" / "adsb"


@pytest.mark.parametrize(
    ("name", "aircraft", "positions", "rows"),
    [
        ("mode_s_one_flight.jsonl.gz", 1, 6451, 3000),
        ("sbs_44_aircraft.log.gz", 44, 1766, 5000),
        ("beast_one_aircraft.bin", 1, 3, 10),
        ("uat_7_aircraft.log", 7, 303, 800),
    ],
)
def test_one_track_for_every_recorded_aircraft(tmp_path, name, aircraft, positions, rows):
    if not (SHARED / name).exists():
        pytest.skip(f"no recording {SHARED / name}")
    result = run(SHARED / name, "--out", tmp_path / "tracks.parquet")
    assert result.exit_code == 0
    words = " ".join(result.output.replace("│", " ").split())
    assert f"aircraft with positions {aircraft} positions given to the tracker {positions} tracks {aircraft} " in words
    table = pq.read_table(tmp_path / "tracks.parquet")
    assert len(set(table["icao"].to_pylist())) == aircraft
    assert table.num_rows > rows


def test_a_recording_without_positions_says_so(tmp_path):
    path = recording(tmp_path / "frames", [(t, frame) for t, frame in encoder.flight(0x393322) if frame[4] >> 3 == 19])
    result = run(path, "--out", tmp_path / "tracks.parquet")
    assert result.exit_code == 2
    assert "no aircraft in" in result.output
    assert "velocities 40" in result.output.replace("\n", " ")
    assert not (tmp_path / "tracks.parquet").exists()
