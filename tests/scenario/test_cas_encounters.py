"""Random encounters of helicopters: the study on small counts, and what it is meant to show."""

import os
from pathlib import Path

import numpy as np
import pytest

from experiments.cas_encounters import ARCHITECTURES, SEPARATION, Part, fly_part, found_in, keep_part
from experiments.cas_encounters_page import aims_of, page_of

pytestmark = pytest.mark.skipif(
    os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="flies for minutes without the compiler"
)


def violated(kind: str, controller: str, size: int, label: str = "") -> int:
    radio = ARCHITECTURES.get(label, {})
    return int(np.count_nonzero(fly_part(Part(kind, label, controller, radio, 77, 0, size))["violated"]))


@pytest.mark.parametrize("label", ["distributed", "centralised"])
def test_whoever_decides_all_keep_apart(label: str) -> None:
    # With a violation in 1 of 100, 300 encounters without one have a chance of 5 %; one of 400 is far below that.
    assert violated("pairs", "interval", 300, label) == 0
    assert violated("layers", "interval", 20, label) == 0


def test_an_outage_shorter_than_messages_are_believed_does_no_harm() -> None:
    # With 10 s instead of 20 it was 1 in 8: 100 without one then had a chance of 1 in 600,000.
    assert violated("pairs", "interval", 100, "distributed, outage") == 0


def test_the_roundabout_keeps_ten_apart() -> None:
    # 40 with 3 at most: a chance of 0.5 % with the 25 % of going round everybody, of 99 % with the 2 % of today.
    assert violated("layers", "roundabout", 40) <= 3


def test_the_study_is_kept_part_by_part_and_goes_on(tmp_path: Path) -> None:
    parts = [
        Part(kind, name, name, {}, 5, first, 2)
        for kind in ("pairs", "cubes", "layers")
        for name in ("none", "bang_bang", "interval")
        for first in (0, 2)
    ]
    parts += [Part(kind, "distributed", "interval", {}, 5, 0, 2) for kind in ("pairs", "cubes", "layers")]
    for part in parts:
        keep_part(part, tmp_path)
    file = parts[0].file(tmp_path)
    before = file.stat().st_mtime_ns
    keep_part(parts[0], tmp_path)
    assert file.stat().st_mtime_ns == before
    assert not list(tmp_path.glob("*.tmp*"))
    found = found_in(parts, tmp_path)
    one = fly_part(parts[0]._replace(size=4))
    for name, values in one.items():
        assert np.array_equal(found["pairs"]["none"][name], values)
    assert (found["pairs"]["none"]["least"] < SEPARATION).any()
    page = page_of(found, {"interval": (None, 40.0)}, 5)
    assert "4 pairs that would meet" in page and "### Cubes, 2" in page
    assert "in 0 of those that `bang_bang` keeps apart" in aims_of(found)[0]
