"""The report of a Monte Carlo run: complete, self-contained, the paper's numbers beside ours."""

import re
from pathlib import Path

import numpy as np
import pytest

from tests.made_rows import made_rows
from tests.unit.test_report import Checker
from wideberth.errors import InputError
from wideberth.evaluation.montecarlo import paper
from wideberth.evaluation.montecarlo.experiment import load_experiment
from wideberth.evaluation.montecarlo.report import page, write_report
from wideberth.evaluation.montecarlo.sensitivity import run_sensitivity
from wideberth.evaluation.montecarlo.summary import summarise

EXPERIMENTS = Path(__file__).resolve().parents[2] / "experiments"
TIMINGS = {"1": {"times_s": [0.001, 0.004], "agreed": 3, "sampled": 3}}


def made(name, counts=(1, 3, 5), encounters=100, avoid=True, overrides=()):
    experiment = load_experiment(EXPERIMENTS / f"{name}.toml", overrides)
    settings = {"seed": 1, "avoidance": avoid, "encounters": encounters, "experiment_path": f"experiments/{name}.toml"}
    tables = [made_rows(experiment, k, 0, encounters, avoid=avoid) for k in counts]
    return experiment, summarise(tables, experiment, settings, TIMINGS)


def checked(text):
    checker = Checker()
    checker.feed(text)
    assert checker.open == []
    # Nothing is fetched: only places within the pictures are referred to.
    assert all(address.startswith("#") for address in checker.fetched)
    assert not re.search(r"url\((?!#)|@import|javascript", text)
    return " ".join(" ".join(checker.words).split())


@pytest.fixture(scope="module", params=["adsb_collision", "adsb_self_separation"])
def report(request, tmp_path_factory):
    experiment, summary = made(request.param)
    path = write_report(tmp_path_factory.mktemp("out") / "new", summary, experiment)
    assert path.name == "report.html"
    text = path.read_text(encoding="utf-8")
    return experiment, summary, text, checked(text)


def test_the_papers_tables_stand_beside_ours(report):
    experiment, summary, text, words = report
    theirs = paper.SETS[experiment.scoring.paper]
    for number in theirs.tables:
        assert f"(table {number})" in words
    assert f"the paper's figure {theirs.figure}" in words
    for k in (1, 3, 5):
        detection, delay, execution = theirs.detection[k], theirs.delay[k], theirs.execution[k]
        for cell in (
            f"{detection.p_cd:.3f}",
            f"{detection.p_fa:.5f}",
            f"{delay.mean_max:.2f} s",
            f"{delay.p95:.1f} s",
            f"{delay.max:.1f} s",
            f"{1e3 * execution.max:,.0f} ms",
        ):
            assert f">{cell}<" in text
        ours = next(c for c in summary["by_intruders"] if c["intruders"] == k)
        assert f">{ours['p_cd']:.4f}<" in text
        assert f">{ours['p_fa']:.5f}<" in text
        assert f">{ours['delay_s']['max']:.1f} s<" in text
    assert f">{summary['pooled']['true_events']:,}<" in text
    if experiment.scoring.paper == "collision":
        told = "10 of 1,928 in the volume, 1 in a third of it, 0 at aircraft size; 17 in all 100,000 encounters"
    else:
        told = "The paper lost self-separation in none of 10,000 encounters"
    assert told in words


def test_every_section_is_there(report):
    experiment, summary, text, words = report
    for title in (
        "What is wanted",
        "Detectors",
        "The reading nearest to the paper",
        "Volumes entered",
        "Risk ratios",
        "Maneuvers",
        "Worst encounters",
        "Sensitivity to accuracy and to message loss",
        "Settings and readings",
    ):
        assert title in words
    assert text.count("<svg role=") == 4
    assert "Give --sensitivity N" in words
    for detector in summary["detectors"]:
        assert detector["title"].replace("'", "&#x27;") in text
    for encounter in summary["worst_encounters"]["closest"] + summary["worst_encounters"]["entered"]:
        assert f"<code>{encounter['command']}</code>" in text
    assert experiment.digest() in words
    # The colours follow the page, light or dark.
    assert "prefers-color-scheme:dark" in text and "var(--c" in text
    # Nothing undefined shows; "None at a third of the volume" is a sentence.
    assert not re.search(r"\bnan\b|\binf\b|\bNone\b(?! at)", words)


def test_sensitivity_is_drawn_where_it_was_measured():
    experiment, summary = made("adsb_collision", counts=(1,), encounters=40)
    summary["sensitivity"] = run_sensitivity(
        experiment,
        1,
        20,
        lambda changed, seed, k, first, count, avoid: made_rows(changed, k, first, count, seed, avoid),
        lambda text, fraction: None,
    )
    text = page(summary, experiment)
    words = checked(text)
    assert text.count("<svg role=") == 5
    assert "Give --sensitivity" not in words
    assert "NACp 11" in words and "70 % lost" in words and "this experiment" in words


def test_a_run_without_avoidance():
    experiment, summary = made("adsb_collision", counts=(2,), encounters=30, avoid=False)
    words = checked(page(summary, experiment))
    assert "Avoidance was off" in words
    assert "in 30 encounters without avoidance" in words


def test_one_encounter_is_a_report_too():
    experiment, summary = made("adsb_collision", counts=(1,), encounters=1, overrides=["errors.altitude=bias"])
    assert summary["pooled"]["true_events"] == 0
    words = checked(page(summary, experiment))
    assert "no event was detected" in words
    assert "one value for each aircraft" in words
    assert "too few events to tell" in words


def test_names_are_escaped():
    experiment, summary = made("adsb_collision", counts=(1,), encounters=5, overrides=['name="a <b> & c"'])
    text = page(summary, experiment)
    checked(text)
    assert "a &lt;b&gt; &amp; c" in text and "<b> &" not in text


def test_a_folder_that_cannot_be_written_is_named(tmp_path):
    experiment, summary = made("adsb_collision", counts=(1,), encounters=5)
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot write the report into"):
        write_report(tmp_path / "file", summary, experiment)


def test_the_papers_numbers():
    sets = paper.SETS
    assert np.mean([d.mean_max for d in sets["collision"].delay.values()]) == pytest.approx(2.224, abs=5e-4)
    assert max(d.max for d in sets["collision"].delay.values()) == 35.9
    assert np.mean([t.mean_max for t in sets["self_separation"].execution.values()]) == pytest.approx(0.445, abs=5e-4)
    assert max(t.max for t in sets["self_separation"].execution.values()) == 2.403
    assert np.mean([t.mean_max for t in sets["collision"].execution.values()]) == pytest.approx(0.064, abs=5e-4)
    assert max(t.max for t in sets["collision"].execution.values()) == 0.878
    for one in sets.values():
        for row in one.detection.values():
            # The safety ratio follows from the other two, but for rounding.
            assert (1 - row.p_cd) / (1 - row.p_fa) == pytest.approx(row.safety_ratio, abs=1.5e-3)
