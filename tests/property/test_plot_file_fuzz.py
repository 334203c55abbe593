"""Damaged files of radar plots are read or refused in words, and nothing else."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.made_tracks import made_arrays, made_truth, save
from wideberth.errors import InputError
from wideberth.sensors.radar.plot_file import read_plot_file

ARRAYS = made_arrays(made_truth(12), seeds=1)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("plots")


@given(data=st.data())
def test_damaged_bytes(folder, data):
    content = bytearray(save(folder / "good.npz", ARRAYS).read_bytes())
    for _ in range(data.draw(st.integers(0, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    cut = data.draw(st.integers(0, len(content)) | st.just(len(content)))
    (folder / "damaged.npz").write_bytes(content[:cut])
    try:
        file = read_plot_file(folder / "damaged.npz")
    except InputError as error:
        assert "damaged.npz" in str(error)
    else:
        assert all(len(file.scans(seed).first) == len(file.t) + 1 for seed in file.seeds())


@given(
    name=st.sampled_from(sorted(ARRAYS)),
    shape=st.lists(st.integers(0, 4), max_size=3),
    kind=st.sampled_from(["f8", "i4", "u1", "?", "U3", "c16", "M8[s]"]),
)
def test_wrong_arrays(folder, name, shape, kind):
    try:
        file = read_plot_file(save(folder / "wrong.npz", ARRAYS, **{name: np.zeros(shape, dtype=kind)}))
    except InputError as error:
        assert "wrong.npz" in str(error)
    else:
        assert file.z.shape[1] == 4
