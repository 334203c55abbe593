"""`wideberth track`: rows, numbers, report, and refusals in one line."""

import json

import numpy as np
import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

from tests.made_tracks import MadeTracker, made_arrays, made_truth, save
from wideberth.cli.main import app
from wideberth.tracking import PLOT_TRACKERS

MADE = "tests.made_tracks:MadeTracker"
COLUMNS = [
    *("seed", "scan", "time", "track_id", "north_m", "east_m", "up_m", "vnorth_mps", "veast_mps", "vup_mps"),
    *("var_north_m2", "var_east_m2", "var_up_m2", "is_ownship"),
]


@pytest.fixture
def truth(monkeypatch):
    truth = made_truth()
    monkeypatch.setattr(MadeTracker, "truth", truth, raising=False)
    monkeypatch.setattr(MadeTracker, "seen", [])
    return truth


@pytest.fixture
def plots(tmp_path, truth):
    return save(tmp_path / "plots.npz", made_arrays(truth))


def run(*arguments):
    return CliRunner().invoke(app, ["track", *map(str, arguments)], env={"COLUMNS": "120"})


def test_rows(plots, tmp_path, truth):
    out = tmp_path / "out.parquet"
    result = run(plots, "--tracker", MADE, "--out", out)
    assert result.exit_code == 0, result.output
    table = pq.read_table(out)
    assert table.column_names == COLUMNS
    assert table.schema.field("vup_mps").metadata[b"unit"] == b"m/s"
    rows = {name: np.array(table[name]) for name in COLUMNS}
    assert sorted(set(rows["seed"])) == [0, 1]
    mine = (rows["seed"] == 1) & (rows["track_id"] == 1)
    scan = rows["scan"][mine]
    np.testing.assert_array_equal(scan, np.arange(5, 150))
    np.testing.assert_allclose(rows["time"][mine], 0.1 * scan)
    np.testing.assert_allclose(rows["north_m"][mine], truth.position[scan, 0, 0], atol=6)
    np.testing.assert_allclose(rows["up_m"][mine], -truth.position[scan, 0, 2], atol=6)
    np.testing.assert_allclose(rows["vnorth_mps"][mine], truth.velocity[scan, 0, 0], atol=2)
    climbing = rows["track_id"] == 2
    np.testing.assert_allclose(rows["vup_mps"][climbing], -1.0, atol=2)
    assert set(rows["var_up_m2"]) == {1.0}
    np.testing.assert_array_equal(rows["is_ownship"], rows["track_id"] == 1)


def test_the_table_has_units(plots, tmp_path):
    result = run(plots, "--tracker", MADE, "--out", tmp_path / "out.parquet")
    lines = result.output.splitlines()
    for name, unit in (("OSPA (c = 50 m, p = 2)", "m"), ("RMSE of velocity", "m/s"), ("CPU time a scan", "ms")):
        line = next(line for line in lines if name in line)
        assert line.rstrip("│ ").split()[-1] == unit
    assert "worst seed" in result.output
    assert "2 seeds" in result.output
    assert f"rows written to {tmp_path / 'out.parquet'}" in result.output


def test_one_seed_in_json(plots, tmp_path):
    result = run(plots, "--tracker", MADE, "--seed", 1, "--json", "--out", tmp_path / "out.parquet")
    summary = json.loads(result.output)
    assert (summary["seeds"], summary["tracker"], summary["file"]) == ([1], MADE, "plots.npz")
    assert summary["metrics"] == summary["metrics_by_seed"][0]
    assert summary["metrics"]["first_confirmed_s"] == pytest.approx(0.5)
    assert 1.0 < summary["metrics"]["ospa_m"] < 2.5
    assert summary["metrics"]["ownship_identified"] == 1.0
    assert summary["counters"] == {"plots that are not finite": 0}
    assert summary["cpu_ms_per_scan"] >= 0.0
    assert set(np.array(pq.read_table(tmp_path / "out.parquet")["seed"])) == {1}
    # Once over the first scans, to compile, and once over all.
    assert [plots.n_scans for plots in MadeTracker.seen] == [5, 150]


def test_bad_plots_are_counted_and_not_refused(tmp_path, truth):
    arrays = made_arrays(truth)
    arrays["meas_range"][[3, 4]] = np.nan
    path = save(tmp_path / "plots.npz", arrays)
    result = run(path, "--tracker", MADE, "--seed", 0, "--json", "--out", tmp_path / "out.parquet")
    assert json.loads(result.output)["counters"] == {"plots that are not finite": 2}


def test_without_truth_nothing_is_scored_and_it_says_so(tmp_path, truth):
    without = ("truth_pos", "truth_vel", "truth_visible", "ownship_id")
    path = save(tmp_path / "plots.npz", made_arrays(truth), without=without)
    result = run(path, "--tracker", MADE, "--out", tmp_path / "out.parquet", "--report", tmp_path / "report")
    assert result.exit_code == 0, result.output
    assert "plots.npz has no truth (truth_pos): nothing to score the tracks by" in result.output
    assert "OSPA" not in result.output
    assert (tmp_path / "report" / "report.html").exists()
    assert json.loads(run(path, "--tracker", MADE, "--json", "--out", tmp_path / "b.parquet").output)["metrics"] is None


def test_no_track_at_all_is_a_result(plots, tmp_path):
    result = run(plots, "--tracker", "tests.made_tracks:NoTracks", "--out", tmp_path / "out.parquet")
    assert result.exit_code == 0, result.output
    assert pq.read_table(tmp_path / "out.parquet").num_rows == 0
    assert "targets never confirmed" in result.output


def test_the_field_of_view_can_be_given(plots, tmp_path):
    run(plots, "--tracker", MADE, "--elevation-half-width", "45deg", "--out", tmp_path / "out.parquet")
    assert MadeTracker.seen[-1].field_of_view == pytest.approx((np.pi, np.pi / 4))


def test_list_names_all_trackers():
    result = run("--list")
    assert result.exit_code == 0
    assert [line.split(":")[0].removesuffix(" (default)") for line in result.output.splitlines()] == list(PLOT_TRACKERS)
    assert result.output.startswith("wideberth (default): ")


def test_the_two_commands_are_told_apart():
    for command, other in (("track", "wideberth tracks"), ("tracks", "wideberth track")):
        text = CliRunner().invoke(app, [command, "--help"], env={"COLUMNS": "200"}).output
        assert other in text
        assert ("radar plots" in text.split("Options")[0]) and ("ADS-B" in text.split("Options")[0])


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ([], "give a file of radar plots"),
        (["none.npz", "--tracker", MADE], "none.npz does not exist"),
        (["PLOTS", "--tracker", "jpda"], "there is no tracker 'jpda' (known: wideberth, rransac"),
        (["PLOTS", "--tracker", "tests.made_tracks:Nothing"], "cannot load tests.made_tracks:Nothing"),
        (["PLOTS", "--tracker", "pathlib:Path"], "is not a class with a model Config and a method run(plots)"),
        (["PLOTS", "--tracker", MADE, "--seed", "7"], "plots.npz has no seed 7: it has 0, 1"),
        (["PLOTS", "--tracker", MADE, "--out", "none/out.parquet"], "folder 'none' does not exist"),
        (["PLOTS", "--tracker", MADE, "--out", "."], "is a folder: give a file name"),
        (["PLOTS", "--tracker", MADE, "--elevation-half-width", "2"], "--elevation-half-width"),
    ],
)
def test_refusals_are_one_line(plots, arguments, says, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    result = run(*(plots if argument == "PLOTS" else argument for argument in arguments))
    assert result.exit_code == 2
    assert says in result.output
    assert len(result.output.strip().splitlines()) == 1
    assert not list(tmp_path.glob("*.parquet"))


@pytest.mark.parametrize("name", PLOT_TRACKERS)
def test_every_tracker_is_found_by_its_name(name):
    from wideberth.evaluation.plot_run import load_tracker

    pytest.importorskip(PLOT_TRACKERS[name].partition(":")[0], reason=f"tracker {name} is not there yet")
    assert load_tracker(name)().run
