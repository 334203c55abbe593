"""Recordings: exact round trip, crash safety, bad files."""

import dataclasses
import itertools
import math
import os
import signal
import subprocess
import sys
import textwrap
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader

from tests.made_runs import FRAME, MISSION, made_steps
from wideberth.errors import InputError
from wideberth.recording import Recorder, read_recording
from wideberth.recording_codec import encode
from wideberth.types import AlertLevel


def write(path: Path, count: int, aircraft: int = 3) -> list:
    steps = list(made_steps(count, aircraft))
    with Recorder(path, {"name": "made", "seed": 5}, mission=MISSION, frame=FRAME) as recorder:
        for snapshot, scans, truth in steps:
            recorder.write(snapshot, scans, truth)
    return steps


def test_every_step_comes_back_to_the_last_bit(tmp_path):
    steps = write(tmp_path / "a.mcap", 47)
    recording = read_recording(tmp_path / "a.mcap")
    assert recording.complete and recording.step_count == 47
    assert recording.scenario == {"name": "made", "seed": 5}
    assert encode(recording.mission) == encode(MISSION)
    assert (recording.frame.latitude, recording.frame.longitude) == (FRAME.latitude, FRAME.longitude)
    assert recording.t_start == steps[0][0].t
    assert recording.t_end == pytest.approx(steps[-1][0].t, abs=1e-9)
    for (t, ownship, scans, snapshot), (wrote, wrote_scans, _) in zip(recording, steps, strict=True):
        assert t == wrote.t
        assert encode(snapshot) == encode(wrote)
        assert encode(ownship) == encode(wrote.ownship)
        assert encode(scans) == encode(wrote_scans)
        assert isinstance(snapshot.alert_state, AlertLevel) and isinstance(snapshot.tracks, tuple)
        for old, new in zip(wrote.tracks, snapshot.tracks, strict=True):
            assert np.array_equal(old.covariance.view(np.int64), new.covariance.view(np.int64))
            assert new.covariance.flags.writeable and new.covariance.flags.aligned
            assert old.info == new.info
    for truth, (_, _, wrote_truth) in zip(recording.truths(), steps, strict=True):
        assert truth.ids == wrote_truth.ids
        assert np.array_equal(truth.positions, wrote_truth.positions)


def test_the_summary_of_a_finished_run_comes_back(tmp_path):
    summary = {"nmac_count": 0, "min_horizontal_separation_m": 123.456789012345678, "notes": ["a"], "x": None}
    with Recorder(tmp_path / "a.mcap", {}, mission=None, frame=FRAME) as recorder:
        for snapshot, scans, truth in made_steps(25, 1):
            recorder.write(snapshot, scans, truth)
        recorder.write_summary(summary)
    recording = read_recording(tmp_path / "a.mcap")
    assert recording.summary == summary and recording.step_count == 25
    write(tmp_path / "b.mcap", 5)
    assert read_recording(tmp_path / "b.mcap").summary is None


def test_a_flight_keeps_its_new_mission_and_what_happened_around_it(tmp_path):
    other = dataclasses.replace(MISSION, waypoints=MISSION.waypoints + 1.0, index=2)
    first, second = itertools.islice(made_steps(2, 1), 2)
    with Recorder(tmp_path / "a.mcap", {}, mission=MISSION, frame=FRAME, live=True) as recorder:
        recorder.write(first[0], first[1])
        recorder.write(second[0], second[1], mission=other, told=("link lost", "clock jumped"))
    recording = read_recording(tmp_path / "a.mcap")
    before, after = recording.steps()
    assert recording.live and before.mission is None and before.told == ()
    assert encode(after.mission) == encode(other) and after.told == ("link lost", "clock jumped")
    write(tmp_path / "b.mcap", 1)
    assert not read_recording(tmp_path / "b.mcap").live


def test_infinities_nan_and_signs_of_zero_survive(tmp_path):
    snapshot, scans, _ = next(iter(made_steps(1, 2)))
    odd = np.array([[-0.0, math.nan, math.inf], [0.0, 5e-324, -math.inf], [1.0, math.nan, 1e308]])
    scan = dataclasses.replace(scans[0], z=odd, R=np.full((3, 2, 2), math.nan), t_valid=np.zeros(3))
    with Recorder(tmp_path / "a.mcap", {}, mission=None, frame=FRAME) as recorder:
        recorder.write(snapshot, [scan], None)
    (step,) = read_recording(tmp_path / "a.mcap").steps()
    assert np.array_equal(step.scans[0].z.view(np.int64), odd.view(np.int64))
    assert step.scans[0].R.shape == (3, 2, 2) and np.isnan(step.scans[0].R).all()
    assert step.truth is None


def test_empty_scans_keep_their_shapes(tmp_path):
    snapshot, scans, _ = next(iter(made_steps(1, 2)))
    scan = dataclasses.replace(scans[0], z=np.zeros((0, 6)), R=np.zeros((0, 6, 6)), t_valid=np.zeros(0), source_ids=())
    with Recorder(tmp_path / "a.mcap", {}, mission=None, frame=FRAME) as recorder:
        recorder.write(snapshot, [scan])
    (step,) = read_recording(tmp_path / "a.mcap").steps()
    assert step.scans[0].z.shape == (0, 6) and step.scans[0].R.shape == (0, 6, 6)


def test_an_asymmetric_matrix_is_kept_whole(tmp_path):
    snapshot, scans, _ = next(iter(made_steps(1, 1)))
    covariance = snapshot.tracks[0].covariance.copy()
    covariance[0, 1] = np.nextafter(covariance[1, 0], np.inf)
    snapshot = dataclasses.replace(snapshot, tracks=(dataclasses.replace(snapshot.tracks[0], covariance=covariance),))
    with Recorder(tmp_path / "a.mcap", {}, mission=None, frame=FRAME) as recorder:
        recorder.write(snapshot, scans)
    (step,) = read_recording(tmp_path / "a.mcap").steps()
    assert np.array_equal(step.snapshot.tracks[0].covariance, covariance)


def test_other_mcap_readers_see_channels_and_schemas(tmp_path):
    write(tmp_path / "a.mcap", 12)
    with (tmp_path / "a.mcap").open("rb") as file:
        summary = make_reader(file).get_summary()
    assert {c.topic for c in summary.channels.values()} == {"scenario", "inputs", "snapshot", "truth", "summary"}
    texts = {s.name: s.data.decode() for s in summary.schemas.values()}
    assert "covariance: array of float64" in texts["wideberth.snapshot"]
    assert "little-endian float64" in texts["wideberth.inputs"]


@pytest.mark.parametrize("cut", [1, 9, 100, 3000])
def test_a_torn_file_gives_its_whole_chunks(tmp_path, cut):
    steps = write(tmp_path / "a.mcap", 47)
    data = (tmp_path / "a.mcap").read_bytes()
    (tmp_path / "torn.mcap").write_bytes(data[:-cut])
    recording = read_recording(tmp_path / "torn.mcap")
    assert not recording.complete and "; the" in recording.message
    assert recording.step_count >= 30
    for step, (wrote, _, _) in zip(recording.steps(), steps, strict=False):
        assert encode(step.snapshot) == encode(wrote)


def test_every_cut_is_a_recording_or_a_clear_error(tmp_path):
    write(tmp_path / "a.mcap", 25, aircraft=1)
    data = (tmp_path / "a.mcap").read_bytes()
    counts = []
    for cut in range(0, len(data), 397):
        (tmp_path / "torn.mcap").write_bytes(data[:cut])
        try:
            recording = read_recording(tmp_path / "torn.mcap")
        except InputError:
            counts.append(-1)
        else:
            assert not recording.complete
            counts.append(recording.step_count)
            assert sum(1 for _ in recording) == recording.step_count
    assert counts == sorted(counts) and counts[0] == -1 and counts[-1] >= 20


def test_a_flipped_byte_never_gives_wrong_data(tmp_path):
    steps = write(tmp_path / "a.mcap", 25, aircraft=1)
    data = bytearray((tmp_path / "a.mcap").read_bytes())
    for place in range(30, len(data), 611):
        bad = bytearray(data)
        bad[place] ^= 0x10
        (tmp_path / "bad.mcap").write_bytes(bad)
        try:
            read = list(read_recording(tmp_path / "bad.mcap"))
        except InputError:
            continue
        for (_, _, _, snapshot), (wrote, _, _) in zip(read, steps, strict=False):
            assert encode(snapshot) == encode(wrote)


def test_kill_9_loses_less_than_a_second(tmp_path):
    script = textwrap.dedent(
        """
        import os, signal, sys
        from tests.made_runs import FRAME, MISSION, made_steps
        from wideberth.recording import Recorder
        with Recorder(sys.argv[1], {}, mission=MISSION, frame=FRAME) as recorder:
            for k, (snapshot, scans, truth) in enumerate(made_steps(100, 2)):
                recorder.write(snapshot, scans, truth)
                if k == 56:
                    os.kill(os.getpid(), signal.SIGKILL)
        """
    )
    root = Path(__file__).resolve().parents[2]
    done = subprocess.run([sys.executable, "-c", script, tmp_path / "a.mcap"], cwd=root, check=False)
    assert done.returncode == -signal.SIGKILL
    recording = read_recording(tmp_path / "a.mcap")
    killed_at = list(made_steps(57, 2))[-1][0].t
    assert not recording.complete
    assert killed_at - recording.t_end < 1.0
    assert recording.step_count >= 47


@pytest.mark.parametrize(
    "content", [b"", b"hello", os.urandom(20000), b"\x89MCAP0\r\n", b"\x89MCAP0\r\n" + os.urandom(5000)]
)
def test_what_is_no_recording_is_refused_in_one_line(tmp_path, content):
    (tmp_path / "a.mcap").write_bytes(content)
    with pytest.raises(InputError, match="recording") as caught:
        read_recording(tmp_path / "a.mcap")
    assert "\n" not in str(caught.value) and "a.mcap" in str(caught.value)


def test_a_missing_file_and_a_folder_are_refused(tmp_path):
    with pytest.raises(InputError, match="cannot read the recording"):
        read_recording(tmp_path / "none.mcap")
    with pytest.raises(InputError, match="cannot read the recording"):
        read_recording(tmp_path)


def test_a_place_that_cannot_be_written_is_refused(tmp_path):
    with pytest.raises(InputError, match="cannot write the recording"):
        Recorder(tmp_path / "none" / "a.mcap", {}, mission=None, frame=FRAME)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full on this system")
def test_a_full_disk_is_one_clear_error():
    with (
        pytest.raises(InputError, match="No space left"),
        Recorder("/dev/full", {}, mission=None, frame=FRAME) as recorder,
    ):
        for snapshot, scans, truth in made_steps(30, 3):
            recorder.write(snapshot, scans, truth)


def test_a_scenario_that_is_no_json_is_refused(tmp_path):
    with pytest.raises(InputError, match="scenario cannot be recorded"):
        Recorder(tmp_path / "a.mcap", {"x": object()}, mission=None, frame=FRAME)
