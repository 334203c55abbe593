"""The plan of a Monte Carlo run: every encounter once, whatever the block size and the parts."""

from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from wideberth.errors import InputError
from wideberth.evaluation.montecarlo.experiment import load_experiment
from wideberth.evaluation.montecarlo.plan import (
    Part,
    Plan,
    check_request,
    choose_block_rows,
    even_sample,
    find_experiment,
    parse_part,
    pieces,
)

ROOT = Path(__file__).resolve().parents[2]
COUNTS = st.lists(st.integers(1, 64), min_size=1, max_size=5, unique=True).map(lambda k: tuple(sorted(k)))


@given(st.integers(1, 500), COUNTS, st.integers(1, 300))
def test_every_encounter_is_in_one_block(encounters: int, intruders: tuple[int, ...], block_rows: int) -> None:
    plan = Plan(encounters, intruders, block_rows)
    blocks = list(plan)
    assert [b.index for b in blocks] == list(range(len(plan)))
    assert all(b.rows <= max(block_rows, b.intruders) for b in blocks)
    met = [(b.intruders, e) for b in blocks for e in range(b.first, b.first + b.count)]
    assert met == [(k, e) for k in intruders for e in range(encounters)]


@given(st.integers(1, 200), COUNTS, st.integers(1, 100), st.integers(1, 9))
def test_every_block_is_in_one_part(encounters: int, intruders: tuple[int, ...], block_rows: int, of: int) -> None:
    parts = [Part(i, of) for i in range(1, of + 1)]
    for block in Plan(encounters, intruders, block_rows):
        assert sum(block in part for part in parts) == 1
        assert block in Part()


def test_a_plan_of_any_size_takes_no_time() -> None:
    assert len(Plan(10**9, (1, 5), 1000)) == 10**6 + 5 * 10**6
    assert next(iter(Plan(10**9, (5,), 1000))).count == 200


def test_parts_are_parsed() -> None:
    assert parse_part("3/8") == Part(3, 8)
    assert str(parse_part("1/1")) == "1/1"


@pytest.mark.parametrize(
    "text", ["", "3", "/", "3/", "/8", "a/b", "1.5/2", "-1/2", "3/8/9", "3 of 8", "²/3", "1/9999999999"]
)
def test_malformed_parts_are_refused(text: str) -> None:
    with pytest.raises(InputError, match="write i/N") as caught:
        parse_part(text)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("text", ["0/8", "9/8", "0/0", "1/0"])
def test_parts_out_of_range_are_refused(text: str) -> None:
    with pytest.raises(InputError, match="goes from 1 to"):
        parse_part(text)


def test_experiments_are_found_by_path_or_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match="there is no experiments folder here"):
        find_experiment("mine")
    (tmp_path / "experiments").mkdir()
    file = tmp_path / "experiments" / "mine.toml"
    file.touch()
    inside = Path("experiments") / "mine.toml"
    assert find_experiment("mine") == find_experiment("mine.toml") == inside
    assert find_experiment(str(file)) == file
    assert find_experiment("./experiments/mine.toml") == inside
    with pytest.raises(InputError, match=r"yours: no such experiment.*\(mine\)"):
        find_experiment("yours")
    with pytest.raises(InputError, match="no such file"):
        find_experiment("elsewhere/mine.toml")
    with pytest.raises(InputError, match="not a file"):
        find_experiment(str(tmp_path))


def test_requests_are_checked() -> None:
    experiment = load_experiment(ROOT / "experiments" / "adsb_collision.toml")
    assert check_request(experiment, None, None) == (20_000, (1, 2, 3, 4, 5))
    assert check_request(experiment, 7, 20) == (7, (20,))
    for encounters, intruders, message in (
        (0, None, "--encounters 0: give at least 1"),
        (-5, None, "--encounters -5"),
        (10**9 + 1, None, "at most"),
        (None, 0, "--intruders 0: give at least 1"),
        (None, -1, "--intruders -1"),
        (None, 21, "more than the 20 points"),
    ):
        with pytest.raises(InputError, match=message):
            check_request(experiment, encounters, intruders)
    many_points = replace(experiment, encounter=experiment.encounter.model_copy(update={"points": 100}))
    with pytest.raises(InputError, match="at most 64"):
        check_request(many_points, None, 65)


def test_numbers_of_intruders_rise() -> None:
    experiment = load_experiment(ROOT / "experiments" / "adsb_collision.toml", ["encounter.intruders=[4, 2]"])
    assert check_request(experiment, 10, None) == (10, (2, 4))


def test_block_size_follows_the_work() -> None:
    assert choose_block_rows(0.0005, 300_000) == 2000  # one core of the collision set: 1 s
    assert choose_block_rows(0.025, 30_000) == 50
    assert choose_block_rows(0.0, 10**9) == 20_000  # memory
    assert choose_block_rows(100.0, 1000) == 1
    assert choose_block_rows(0.0005, 100) == 2  # enough blocks for several workers
    assert choose_block_rows(0.0005, 1) == 1


@given(st.integers(1, 10_000), st.integers(1, 10))
def test_samples_and_pieces(count: int, parts: int) -> None:
    sample = even_sample(count, parts)
    assert len(set(sample)) == min(count, parts)
    assert sample[0] == 0 and max(sample) < count
    cut = pieces(count, parts)
    assert [i for offset, size in cut for i in range(offset, offset + size)] == list(range(count))
    assert len(cut) <= parts
