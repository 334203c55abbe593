"""Movies of recordings: the pictures wanted, in order, and what cannot be shown said in words."""

import itertools

import numpy as np
import pytest
from PIL import Image

from tests.made_runs import FRAME, MISSION, made_steps
from wideberth.errors import InputError
from wideberth.evaluation.flight_log import FlightLog, encounters
from wideberth.evaluation.movie import MovieSettings, Scene, frame_times, write_movie
from wideberth.recording import Recorder, read_recording

SHORT = MovieSettings(speed=20.0, frame_rate=2.0)


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    path = tmp_path_factory.mktemp("movie") / "recording.mcap"
    with Recorder(path, {"name": "made"}, mission=MISSION, frame=FRAME) as recorder:
        for snapshot, scans, truth in made_steps(600, 3):
            recorder.write(snapshot, scans, truth)
    return read_recording(path)


def test_pictures_are_evenly_spaced_over_what_is_wanted(recording):
    times = frame_times(recording, SHORT)
    assert times[0] == recording.t_start
    np.testing.assert_allclose(np.diff(times), 10.0)
    assert times[-1] <= recording.t_end < times[-1] + 10.0
    part = frame_times(recording, MovieSettings(1.0, 10.0, 20.0, 21.0))
    assert len(part) == 11
    assert part[0] == recording.t_start + 20.0


def test_a_gif_holds_them_all_and_they_differ(recording, tmp_path):
    told = []
    count = write_movie(tmp_path / "a.gif", recording, SHORT, lambda *args: told.append(args))
    with Image.open(tmp_path / "a.gif") as image:
        assert image.n_frames == count == len(frame_times(recording, SHORT))
        assert image.info["duration"] == 500
        frames = []
        for k in range(count):
            image.seek(k)
            frames.append(np.asarray(image.convert("RGB")).astype(int))
    assert all(np.abs(a - b).max() > 50 for a, b in itertools.pairwise(frames))
    assert told[-1] == (count, count)
    assert [p.name for p in tmp_path.iterdir()] == ["a.gif"]


def test_an_mp4_is_written_where_the_encoder_is_there(recording, tmp_path):
    pytest.importorskip("imageio_ffmpeg", reason="imageio-ffmpeg is not installed (the extra movie)")
    assert write_movie(tmp_path / "a.mp4", recording, SHORT) > 3
    assert (tmp_path / "a.mp4").read_bytes()[4:8] == b"ftyp"


def test_the_ownship_is_drawn_where_it_is(recording):
    log = FlightLog.of(recording.steps())
    scene = Scene(log, encounters(log), recording.mission)
    step = next(itertools.islice(recording.steps(), 300, None))
    picture = scene.draw(step.snapshot)
    assert picture.dtype == np.uint8
    assert picture.shape[0] % 2 == picture.shape[1] % 2 == 0
    head = scene._own[1].get_xydata()
    np.testing.assert_allclose(head, [[step.ownship.position[1], step.ownship.position[0]]])


@pytest.mark.parametrize(
    "settings", [{"speed": 0.0}, {"frame_rate": float("nan")}, {"speed": 1e9}, {"t_from": float("inf")}]
)
def test_settings_out_of_reason(settings):
    with pytest.raises(InputError):
        MovieSettings(**settings)


def test_what_cannot_be_shown(recording, tmp_path):
    with pytest.raises(InputError, match="lasts"):
        write_movie(tmp_path / "a.gif", recording, MovieSettings(t_from=1000.0))
    with pytest.raises(InputError, match="a movie is"):
        write_movie(tmp_path / "a.avi", recording)
    with pytest.raises(InputError, match="folder"):
        write_movie(tmp_path / "none" / "a.gif", recording)
    empty = tmp_path / "empty.mcap"
    Recorder(empty, {"name": "made"}, mission=MISSION, frame=FRAME).close()
    with pytest.raises(InputError, match="no steps"):
        write_movie(tmp_path / "a.gif", read_recording(empty))
