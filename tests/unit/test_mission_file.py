"""Mission files: what is read, what is merged or ignored with a message, what is refused and how."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from wideberth.errors import InputError
from wideberth.frames import LocalFrame
from wideberth.simulation.mission import read_mission_file

HEADER = "lat_deg,lon_deg,altitude_m,speed_mps,start_time_s\n"
FRAME = LocalFrame(math.radians(48.7), math.radians(2.3))


def written(folder: Path, text: str | bytes) -> Path:
    path = folder / "mission.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def test_mission_is_read(tmp_path: Path) -> None:
    path = written(tmp_path, HEADER + "48.7,2.3,300,41,1633610000\n48.8,2.3,400,38,\n48.8,2.5,400,38,1633610000.0\n")
    config, messages = read_mission_file(path)
    mission = config.mission(FRAME)
    assert messages == ()
    assert mission.t_start == 1633610000.0
    assert mission.waypoints.shape == (3, 3) and list(mission.speeds) == [41, 38, 38]
    assert np.allclose(mission.waypoints[0], [0, 0, -300], atol=1e-6)
    assert mission.waypoints[1, 0] == pytest.approx(11_120, abs=10)


def test_mark_blanks_order_and_blank_lines_are_tolerated(tmp_path: Path) -> None:
    text = "\ufeff Speed_mps , lat_deg,lon_deg, altitude_m,start_time_s\r\n\r\n"
    text += " 41 , 48.7 ,2.3, 300, 5 \r\n40,48.8,2.3,300\r\n"
    config, messages = read_mission_file(written(tmp_path, text))
    assert messages == ()
    assert [w.speed_mps for w in config.waypoints] == [41, 40] and config.start_time_s == 5


def test_messages_of_what_is_merged_and_ignored(tmp_path: Path) -> None:
    text = HEADER.replace("\n", ",name\n") + "48.7,2.3,300,41,100,a\n48.7,2.3,300,41,100,b\n48.8,2.3,300,41,260,c\n"
    config, messages = read_mission_file(written(tmp_path, text))
    assert len(config.waypoints) == 2
    assert len(messages) == 3
    assert "name" in messages[0] and "line 3" in messages[1] and "merged" in messages[1]
    assert "line 4" in messages[2] and "260" in messages[2]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "empty"),
        ("\n\n", "empty"),
        ("lat_deg,lon_deg\n1,2\n", "missing columns altitude_m, speed_mps, start_time_s"),
        ("lat_deg;lon_deg;altitude_m;speed_mps;start_time_s\n", "separated by commas"),
        ("lat_deg," + HEADER, "twice"),
        (HEADER, "at least two"),
        (HEADER + "48.7,2.3,300,41,5\n", "at least two"),
        (HEADER + "48.7,2.3,300,41,5\n48.7,2.3,300,41,5\n", "at least two different"),
        (HEADER + "91,2.3,300,41,5\n48.7,2.3,300,41,5\n", "line 2: lat_deg is 91"),
        (HEADER + "48,181,300,41,5\n48.7,2.3,300,41,5\n", "line 2: lon_deg is 181"),
        (HEADER + "48,2,300,41,5\nnan,2.3,300,41,5\n", "line 3: lat_deg is nan"),
        (HEADER + "48,2,inf,41,5\n48.7,2.3,300,41,5\n", "altitude_m is inf"),
        (HEADER + "48,2,300,0,5\n48.7,2.3,300,41,5\n", "speed_mps is 0: give a speed above 0"),
        (HEADER + "48,2,300,-3,5\n48.7,2.3,300,41,5\n", "speed_mps"),
        (HEADER + "48,2,300,41,\n48.7,2.3,300,41,5\n", "line 2: start_time_s is empty"),
        (HEADER + "48,2,300,41,noon\n48.7,2.3,300,41,5\n", "'noon' is not a number"),
        (HEADER + "48,2,300,fast,5\n48.7,2.3,300,41,5\n", "'fast' is not a number"),
        (HEADER + "48,2,300,41,5,7\n48.7,2.3,300,41,5\n", "6 values for 5 columns"),
        (b"\x1f\x8b\x08\x00\xff\xfe\x80", "not a text file"),
    ],
)
def test_bad_files_are_refused_in_words(tmp_path: Path, text: str | bytes, words: str) -> None:
    with pytest.raises(InputError, match=words) as refused:
        read_mission_file(written(tmp_path, text))
    assert "mission.csv" in str(refused.value) and "\n" not in str(refused.value)


def test_missing_file_and_folder(tmp_path: Path) -> None:
    for path in (tmp_path / "none.csv", tmp_path):
        with pytest.raises(InputError, match="cannot read the mission"):
            read_mission_file(path)


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.one_of(st.binary(max_size=300), st.text(max_size=200).map(str.encode)), st.booleans())
def test_anything_is_read_or_refused(tmp_path: Path, data: bytes, headed: bool) -> None:
    path = written(tmp_path, (HEADER.encode() if headed else b"") + data)
    try:
        config, _ = read_mission_file(path)
    except InputError:
        return
    assert len(config.waypoints) >= 2
