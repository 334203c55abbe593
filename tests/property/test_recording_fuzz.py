"""Whatever is put into a recording comes out; whatever else is read as one gives a clear error."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from tests.made_runs import FRAME, MISSION, made_steps
from wideberth.errors import InputError
from wideberth.recording import Recorder, read_recording
from wideberth.recording_codec import decoder, encode
from wideberth.types import Scan

ANY = st.floats(width=64)
SCANS = decoder(Scan)


def scan_with(z, covariance):
    return Scan(0.0, 0.0, "s", "adsb", z, covariance, np.zeros(len(z)))


@given(
    z=hnp.arrays(np.float64, hnp.array_shapes(min_dims=2, max_dims=2, min_side=0, max_side=5), elements=ANY),
    covariance=hnp.arrays(np.float64, st.tuples(st.integers(0, 4), st.just(6), st.just(6)), elements=ANY),
    symmetric=st.booleans(),
)
@settings(max_examples=150, deadline=None)
def test_arrays_come_back_to_the_last_bit(z, covariance, symmetric):
    if symmetric:
        covariance = np.where(np.tri(6, dtype=bool), covariance, covariance.swapaxes(-1, -2))
    scan = SCANS.decode(encode(scan_with(z, covariance)))
    for wrote, read in ((z, scan.z), (covariance, scan.R)):
        assert read.shape == wrote.shape and read.dtype == np.float64
        assert read.tobytes() == wrote.tobytes()


@given(
    data=hnp.arrays(np.float64, (3, 4), elements=ANY),
    order=st.sampled_from(["fortran", "reversed", "strided", "big endian"]),
)
@settings(max_examples=60, deadline=None)
def test_the_layout_in_memory_does_not_matter(data, order):
    odd = {
        "fortran": np.asfortranarray(data),
        "reversed": data[::-1][::-1],
        "strided": np.repeat(data, 2, axis=1)[:, ::2],
        "big endian": data.astype(">f8"),
    }[order]
    assert encode(scan_with(odd, np.zeros((3, 6, 6)))) == encode(scan_with(data, np.zeros((3, 6, 6))))


@given(st.binary(max_size=3000))
@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_random_bytes_are_refused(tmp_path, data):
    for prefix in (b"", b"\x89MCAP0\r\n"):
        (tmp_path / "a.mcap").write_bytes(prefix + data)
        with pytest.raises(InputError, match=r"a\.mcap[^\n]*\Z"):
            read_recording(tmp_path / "a.mcap")


@given(
    edits=st.lists(st.tuples(st.integers(0, 10**6), st.integers(0, 255)), min_size=1, max_size=4),
    cut=st.integers(0, 10**6),
)
@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_damaged_recording_gives_right_steps_or_a_clear_error(tmp_path, edits, cut):
    path = tmp_path / "whole.mcap"
    steps = list(made_steps(23, 1))
    if not path.exists():
        with Recorder(path, {"name": "fuzz"}, mission=MISSION, frame=FRAME) as recorder:
            for snapshot, scans, truth in steps:
                recorder.write(snapshot, scans, truth)
    data = bytearray(path.read_bytes())
    for place, value in edits:
        data[place % len(data)] = value
    del data[len(data) - cut % (len(data) // 2) :]
    (tmp_path / "bad.mcap").write_bytes(data)
    try:
        read = [snapshot for _, _, _, snapshot in read_recording(tmp_path / "bad.mcap")]
    except InputError:
        return
    assert [encode(snapshot) for snapshot in read] == [encode(snapshot) for snapshot, _, _ in steps[: len(read)]]
