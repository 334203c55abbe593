"""The folder of a Monte Carlo run: shards are whole, belong to the run, and say so."""

import errno
import json
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from wideberth.errors import InputError
from wideberth.evaluation.montecarlo import atomic_files
from wideberth.evaluation.montecarlo.experiment import load_experiment
from wideberth.evaluation.montecarlo.folder import RunFolder, open_folder, read_rows, shard_name
from wideberth.evaluation.montecarlo.manifest import MANIFEST, Manifest, code_hash, read_manifest
from wideberth.evaluation.montecarlo.plan import Block, Part
from wideberth.evaluation.montecarlo.rows import FLOAT_COLUMNS, SCHEMA
from wideberth.evaluation.montecarlo.timings import TimingsFile, read_timings

ROOT = Path(__file__).resolve().parents[2]
EXPERIMENT = load_experiment(ROOT / "experiments" / "adsb_collision.toml")


def made_rows(experiment: object, seed: int, intruders: int, first: int, count: int, avoid: bool) -> pa.Table:
    """Rows as a run leaves them, with random numbers that depend on nothing but what real ones depend on."""
    rows = count * intruders
    encounter = np.repeat(np.arange(first, first + count), intruders)
    values = np.array(
        [
            np.random.default_rng([seed, intruders, e, avoid]).random((intruders, len(FLOAT_COLUMNS)))
            for e in range(first, first + count)
        ]
    ).reshape(rows, len(FLOAT_COLUMNS))
    columns: dict[str, np.ndarray] = {
        "intruders": np.full(rows, intruders, np.int16),
        "encounter": encounter,
        "intruder": np.tile(np.arange(intruders, dtype=np.int16), count),
        **{name: values[:, i] for i, name in enumerate(FLOAT_COLUMNS)},
        **{name: np.zeros(rows, np.int32) for name in ("inside_alone", "inside", "maneuvers", "least_bad")},
        "full_tier": np.zeros(rows, bool),
    }
    return pa.table(columns, schema=SCHEMA)


def same(first: pa.Table, second: pa.Table) -> bool:
    """Whether two tables are the same to the last bit, NaN included."""
    return first.schema.equals(second.schema) and all(
        first.column(name).to_numpy().tobytes() == second.column(name).to_numpy().tobytes()
        for name in first.column_names
    )


def rows_of(block: Block) -> pa.Table:
    return made_rows(EXPERIMENT, 1, block.intruders, block.first, block.count, True)


ALL = Part()
MADE = Manifest.of(EXPERIMENT, 1, True, 10, (1, 2), 4)


@pytest.fixture
def folder(tmp_path: Path) -> RunFolder:
    return open_folder(tmp_path / "run", MADE, Part(), resume=False)


@pytest.fixture
def full(folder: RunFolder) -> RunFolder:
    for block in reversed(list(folder.plan)):
        folder.write(block, rows_of(block))
    return folder


def refusal(path: Path, manifest: Manifest = MADE, part: Part = ALL, *, resume: bool = True) -> str:
    """What going on in a folder is refused with; nothing in it changes."""
    before = {p: (p.read_bytes(), p.stat().st_mtime_ns) for p in path.rglob("*") if p.is_file()}
    with pytest.raises(InputError) as caught:
        opened = open_folder(path, manifest, part, resume)
        list(opened.tables())
    assert {p: (p.read_bytes(), p.stat().st_mtime_ns) for p in path.rglob("*") if p.is_file()} == before
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_rows_come_back_in_order(full: RunFolder) -> None:
    expected = pa.concat_tables([made_rows(EXPERIMENT, 1, k, 0, 10, True) for k in (1, 2)])
    assert same(read_rows(full.path), expected)
    assert pa.concat_tables(list(full.tables())).equals(expected)
    assert len(full.present()) == len(full.plan) == 3 + 5


def test_rows_so_far(folder: RunFolder) -> None:
    assert same(read_rows(folder.path), SCHEMA.empty_table())
    block = list(folder.plan)[2]
    folder.write(block, rows_of(block))
    assert same(read_rows(folder.path), rows_of(block))


def test_a_shard_is_readable_without_us_and_says_what_it_is(full: RunFolder) -> None:
    block = list(full.plan)[-1]
    schema = pq.read_schema(full.shard(block))
    said = json.loads(schema.metadata[b"wideberth.montecarlo"])
    assert said == {
        "digest": EXPERIMENT.digest(),
        "seed": 1,
        "avoidance": True,
        "code": MADE.code,
        "version": MADE.version,
        "intruders": 2,
        "first": 8,
        "count": 2,
    }


def test_the_code_of_a_run_is_all_that_rows_depend_on(tmp_path: Path) -> None:
    package = tmp_path / "package"
    for name in (
        "config.py",
        "evaluation/montecarlo/tiers.py",
        "evaluation/montecarlo/fast_settings.py",
        "evaluation/montecarlo/encounter_kernels.py",
        "evaluation/montecarlo/report.py",
        "evaluation/report_map.py",
        "tracking/report_history.py",
        "cli/main.py",
    ):
        path = package / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("a = 1\n")
    before = code_hash(package)
    assert before == code_hash(package) and len(before) == 16
    for path in sorted(package.rglob("*.py")):
        name = path.relative_to(package).as_posix()
        path.write_text("a = 2\n")
        shows_only = name.startswith("cli/") or (name.startswith("evaluation/") and "report" in name)
        assert (code_hash(package) == before) == shows_only, name
        path.write_text("a = 1\n")
    (package / "config.py").rename(package / "configs.py")
    assert code_hash(package) != before
    assert MADE.code == code_hash() != before


def test_the_manifest_reads_back(folder: RunFolder) -> None:
    assert read_manifest(folder.path) == MADE
    assert json.loads((folder.path / MANIFEST).read_text())["experiment"] == EXPERIMENT.resolved()


@pytest.mark.parametrize(
    "content", [b"", b"{", b"[]", b"{}", b"\xff", b'{"format": 1}', b'{"format": 9}', b"[" * 100_000]
)
def test_damaged_manifests_are_refused(folder: RunFolder, content: bytes) -> None:
    (folder.path / MANIFEST).write_bytes(content)
    assert MANIFEST in refusal(folder.path)


@pytest.mark.parametrize("key", ["encounters", "block_rows", "intruders"])
def test_manifests_with_odd_numbers_are_refused(folder: RunFolder, key: str) -> None:
    data = json.loads((folder.path / MANIFEST).read_text())
    for value in (0, -1, 1.5, True, "7", None):
        data[key] = [value] if key == "intruders" else value
        (folder.path / MANIFEST).write_text(json.dumps(data))
        assert "damaged" in refusal(folder.path)


def test_a_flipped_bit_is_seen_or_does_no_harm(full: RunFolder) -> None:
    block = next(iter(full.plan))
    path = full.shard(block)
    whole = path.read_bytes()
    refused = 0
    for i in range(0, len(whole), len(whole) // 200):
        path.write_bytes(whole[:i] + bytes([whole[i] ^ 1 << i % 8]) + whole[i + 1 :])
        try:
            assert full.read(block).equals(rows_of(block))  # statistics, and the like
        except InputError as error:
            assert str(path) in str(error)
            refused += 1
    assert refused > 100


@pytest.mark.parametrize("content", [b"", b"PAR1", b"PAR1" * 1000, b"not parquet"])
def test_what_is_no_shard_is_refused(full: RunFolder, content: bytes) -> None:
    path = full.shard(next(iter(full.plan)))
    path.write_bytes(content)
    assert f"{path}: damaged" in refusal(full.path)


def test_a_cut_shard_is_refused(full: RunFolder) -> None:
    path = full.shard(next(iter(full.plan)))
    path.write_bytes(path.read_bytes()[:-100])
    assert f"{path}: damaged" in refusal(full.path)


def test_shards_of_other_runs_are_refused(full: RunFolder, tmp_path: Path) -> None:
    block = next(iter(full.plan))
    changes: tuple[dict[str, Any], ...] = (
        {"digest": "0" * 16},
        {"seed": 2},
        {"avoidance": False},
        {"code": "1" * 16},
    )
    for change in changes:
        (key,) = change
        other = open_folder(tmp_path / key, replace(MADE, **change), Part(), resume=False)
        other.write(block, rows_of(block))
        full.shard(block).write_bytes(other.shard(block).read_bytes())
        assert f"{full.shard(block)}: a shard of another run (its {key} differ)" in refusal(full.path)


def test_shards_of_other_blocks_are_refused(full: RunFolder) -> None:
    first, second, *_ = full.plan
    full.shard(first).write_bytes(full.shard(second).read_bytes())
    assert "its first differ" in refusal(full.path)


def test_tables_without_our_words_are_refused(full: RunFolder) -> None:
    block = next(iter(full.plan))
    pq.write_table(rows_of(block), full.shard(block))
    assert "not a shard of this run" in refusal(full.path)


def test_other_rows_behind_our_words_are_refused(full: RunFolder) -> None:
    block = next(iter(full.plan))
    metadata = pq.read_schema(full.shard(block)).metadata
    for table in (
        rows_of(block).slice(1),
        rows_of(block).drop_columns(["inside"]),
        made_rows(EXPERIMENT, 1, 1, 5, 4, True),
    ):
        pq.write_table(table.replace_schema_metadata(metadata), full.shard(block))
        assert "its rows are not those of its block" in refusal(full.path)


def test_parquet_files_that_no_block_has_are_refused(full: RunFolder) -> None:
    foreign = full.path / "rows_01_000000001.parquet"
    foreign.write_bytes(full.shard(next(iter(full.plan))).read_bytes())
    assert f"{foreign}: not a shard of this run" in refusal(full.path)
    with pytest.raises(InputError, match="not a shard"):
        read_rows(full.path)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"seed": 2}, "seed 1 there, 2 here"),
        ({"avoidance": False}, "avoidance true there, false here"),
        ({"encounters": 11}, "encounters 10 there, 11 here"),
        ({"intruders": (1,)}, r"intruders [1, 2] there, [1] here"),
        ({"code": "f" * 16}, "made by other code"),
        ({"version": "9.9"}, "made by other code"),
    ],
)
def test_other_runs_do_not_go_on(full: RunFolder, change: dict[str, Any], said: str) -> None:
    text = refusal(full.path, replace(MADE, **change))
    assert said in text and "another folder" in text


def test_a_changed_experiment_is_told_key_by_key(full: RunFolder) -> None:
    changed = load_experiment(
        ROOT / "experiments" / "adsb_collision.toml", ["scoring.tau_s=30.0", "errors.start=zero", "name=other"]
    )
    text = refusal(full.path, Manifest.of(changed, 1, True, 10, (1, 2), 4))
    assert "scoring.tau_s 35.0 there, 30.0 here" in text
    assert 'errors.start "stationary" there, "zero" here' in text
    assert '"other"' not in text


def test_a_changed_name_is_no_change(full: RunFolder) -> None:
    renamed = load_experiment(ROOT / "experiments" / "adsb_collision.toml", ["name=other"])
    assert open_folder(full.path, Manifest.of(renamed, 1, True, 10, (1, 2), 4), Part(), resume=True).plan == full.plan


def test_the_block_size_of_the_folder_holds(full: RunFolder) -> None:
    assert open_folder(full.path, replace(MADE, block_rows=100), Part(), resume=True).plan == full.plan


def test_without_resume_a_run_is_left_alone(full: RunFolder) -> None:
    assert "--resume" in refusal(full.path, resume=False)


def test_folders_that_are_something_else(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_text("mine")
    with pytest.raises(InputError, match="is a file"):
        open_folder(file, MADE, Part(), resume=True)
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "notes.txt").write_text("mine")
    for resume in (True, False):
        assert f"holds no {MANIFEST}" in refusal(tmp_path / "other", resume=resume)
    (tmp_path / "empty").mkdir()
    assert open_folder(tmp_path / "empty", MADE, Part(), resume=False).present() == set()
    with pytest.raises(InputError, match=f"no {MANIFEST}"):
        read_rows(tmp_path / "nowhere")
    with pytest.raises(InputError, match="cannot be written"):
        open_folder(file / "below", MADE, Part(), resume=False)


def test_parts_share_a_folder(tmp_path: Path) -> None:
    first = open_folder(tmp_path, MADE, Part(1, 2), resume=False)
    second = open_folder(tmp_path, replace(MADE, block_rows=5), Part(2, 2), resume=False)
    assert second.plan == first.plan
    block = next(iter(first.plan))
    first.write(block, rows_of(block))
    open_folder(tmp_path, MADE, Part(2, 2), resume=False)
    assert "holds blocks of part 1/2" in refusal(tmp_path, part=Part(1, 2), resume=False)
    open_folder(tmp_path, MADE, Part(1, 2), resume=True)
    assert "seed 1 there, 3 here" in refusal(tmp_path, replace(MADE, seed=3), Part(2, 2), resume=False)


def test_of_two_manifests_at_once_one_holds(tmp_path: Path) -> None:
    assert atomic_files.create(tmp_path / "file", b"one")
    assert not atomic_files.create(tmp_path / "file", b"two")
    assert (tmp_path / "file").read_bytes() == b"one"
    assert os.listdir(tmp_path) == ["file"]


def test_file_systems_without_links(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def link(*_: object) -> None:
        raise OSError(errno.EPERM, "Operation not permitted")

    monkeypatch.setattr(os, "link", link)
    assert atomic_files.create(tmp_path / "file", b"one")
    assert not atomic_files.create(tmp_path / "file", b"two")
    assert (tmp_path / "file").read_bytes() == b"one"
    assert os.listdir(tmp_path) == ["file"]


@pytest.mark.parametrize("fails", ["fsync", "replace"])
def test_a_full_disk_leaves_nothing_half_done(folder: RunFolder, fails: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    block = next(iter(folder.plan))
    with monkeypatch.context() as patch:
        patch.setattr(os, fails, full)
        with pytest.raises(InputError, match=r"rows_01_000000000.parquet: cannot be written: No space left.*--resume"):
            folder.write(block, rows_of(block))
    assert os.listdir(folder.path) == [MANIFEST]
    folder.write(block, rows_of(block))
    assert folder.read(block).equals(rows_of(block))


def test_rows_of_another_block_are_never_written(folder: RunFolder) -> None:
    first, second, *_ = folder.plan
    with pytest.raises(ValueError, match="other rows than its own"):
        folder.write(first, rows_of(second))
    assert os.listdir(folder.path) == [MANIFEST]


def test_what_killed_runs_left_goes_once_it_is_done_anew(folder: RunFolder) -> None:
    first, second, *_ = folder.plan
    folder.write(first, rows_of(first))
    torn = {block: folder.path / f".{shard_name(block)}.0123abcd.tmp" for block in (first, second)}
    for path in torn.values():
        path.write_bytes(b"PAR1")
    again = open_folder(folder.path, MADE, Part(), resume=True)
    assert not torn[first].exists()  # its shard is there in full
    assert torn[second].exists()  # another process may be writing it
    again.write(second, rows_of(second))
    assert not torn[second].exists()
    assert read_rows(folder.path).num_rows == 8


def test_timings_survive_torn_lines_and_repeats(tmp_path: Path) -> None:
    file = TimingsFile(tmp_path, Part())
    file.append(Block(0, 1, 0, 4), 1.0, 2.0, "a")
    file.append(Block(1, 1, 4, 4), 1.0, 2.0, "a")
    with file.path.open("ab") as raw:
        raw.write(b'{"intruders": 1, "first": 8, "cou')
    TimingsFile(tmp_path, Part()).append(Block(1, 1, 4, 4), 3.0, 4.0, "b")  # run again
    TimingsFile(tmp_path, Part(2, 3)).append(Block(3, 2, 0, 2), 0.5, 0.5, "c")
    with file.path.open("ab") as raw:
        raw.write(b'[1]\n{"intruders": 1}\n\xff\n')
    assert len(list(tmp_path.glob("timings*"))) == 2
    assert read_timings(tmp_path) == {
        1: {"encounters": 8, "cpu_s": 4.0, "wall_s": 6.0},
        2: {"encounters": 2, "cpu_s": 0.5, "wall_s": 0.5},
    }
