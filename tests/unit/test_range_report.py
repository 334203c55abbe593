"""The report of a sweep: complete, self-contained, with its numbers beside it, and open about what is missing."""

import csv
import json
import math
import re

import numpy as np
import pytest

from tests.unit.test_report import Checker
from wideberth.analysis.thesis_claims import claims
from wideberth.analysis.thesis_figures import FIGURES, sweep
from wideberth.errors import InputError
from wideberth.evaluation.range_figures import cut_off, sweep_figure
from wideberth.evaluation.range_numbers import sweep_csv, sweep_json
from wideberth.evaluation.range_report import gap_words, page, write_report
from wideberth.units import DEGREE, FOOT, KNOT

STEMS = {name: f"figure_{name.replace('.', '_')}" for name in FIGURES} | {"pilot-delay": "pilot_delay"}


def words_of(text):
    checker = Checker()
    checker.feed(text)
    assert checker.open == []
    assert all(address.startswith("#") for address in checker.fetched)
    assert not re.search(r"url\((?!#)|@import|javascript", text)
    return " ".join(" ".join(checker.words).split())


def read_rows(text):
    return list(csv.DictReader(text.splitlines()))


@pytest.mark.parametrize("name", list(FIGURES))
def test_files_and_page(name, tmp_path):
    numbers = sweep(name, points=201 if name in ("2.8", "2.12") else 25)
    path = write_report(tmp_path / "new", numbers)
    stem = STEMS[name]
    assert path == tmp_path / "new" / f"{stem}.html"
    assert {p.name for p in path.parent.iterdir()} == {f"{stem}.{end}" for end in ("html", "png", "csv", "json")}
    assert (path.parent / f"{stem}.png").read_bytes().startswith(b"\x89PNG")
    words = words_of(path.read_text(encoding="utf-8"))
    for title in (numbers.title, "Where there is no answer", "Inputs", "Numbers", f"{stem}.csv"):
        assert title in words
    for item in numbers.inputs:
        assert item.words in words
        assert item.source in words
    for claim in claims(numbers):
        assert claim.says in words
        assert claim.here in words
    for sentence in gap_words(numbers):
        assert sentence in words
    for panel in numbers.panels:
        assert not panel.letter or f"({panel.letter}) {panel.title}" in words


def test_the_csv_holds_every_point_with_its_arguments():
    numbers = sweep("2.7", points=11)
    rows = read_rows(sweep_csv(numbers))
    assert len(rows) == 11 * sum(len(panel.curves) for panel in numbers.panels)
    chosen = [
        r for r in rows if r["panel"] == "c" and r["method"] == "gvv" and float(r["safety_radius_m"]) == 500 * FOOT
    ]
    curve = next(c for c in numbers.panels[2].curves if c.method == "gvv" and c.nominal)
    np.testing.assert_allclose([float(r["ownship_speed_mps"]) for r in chosen], curve.x, rtol=1e-9)
    assert chosen[0]["distance_m"] == chosen[0]["case"] == ""
    assert chosen[0]["why_not"].startswith("ownship_speed must be positive")
    for row, distance, cpa in zip(chosen[1:], curve.values["distance"][1:], curve.values["cpa"][1:], strict=True):
        assert float(row["distance_m"]) == pytest.approx(distance, rel=1e-9)
        assert float(row["cpa_m"]) == pytest.approx(cpa, rel=1e-9)
        assert row["why_not"] == ""
        assert row["case"] in ("1", "2")


def test_a_curve_of_several_panels_is_written_once():
    rows = read_rows(sweep_csv(sweep("2.12", points=3)))
    assert len(rows) == 3 * 4 * 5
    assert {r["panel"] for r in rows if r["method"] == "tgvv"} == {"abd"}
    assert {r["panel"] for r in rows if r["method"] == "gt"} == {"abcd"}


def test_other_swept_quantities_have_their_column():
    assert float(read_rows(sweep_csv(sweep("2.8", points=3)))[2]["time_s"]) == 25.0
    delayed = read_rows(sweep_csv(sweep("pilot-delay", points=3)))
    assert [float(r["computation_time_s"]) - float(r["pilot_delay_s"]) for r in delayed] == [5.0] * len(delayed)
    roll = [r for r in read_rows(sweep_csv(sweep("2.10", points=3))) if r["panel"] == "a"]
    rates = [float(r["max_bank_rate_rad_per_s"]) / DEGREE for r in roll[:3]]
    assert rates == pytest.approx([math.inf, 60.0, 30.0])


def test_the_json_names_inputs_gaps_and_changes_of_the_case():
    numbers = sweep("2.7")
    told = json.loads(sweep_json(numbers, "figure_2_7.csv"))
    assert told["numbers"] == "figure_2_7.csv"
    radius = next(i for i in told["inputs"] if i["name"] == "safety radius")
    assert (radius["si"], radius["si_unit"], radius["source"]) == ([500 * FOOT], "m", "table 2.3")
    assert len(told["no_answer"]) == len(numbers.gaps)
    assert all(claim["holds"] for claim in told["thesis"])
    marks = [m for m in told["marks"] if m["method"] == "gvv" and m["level"] == "500 ft"]
    assert [m["what"] for m in marks] == ["1 to 2"]
    assert marks[0]["at"] / KNOT == pytest.approx(55.32, abs=0.01)


def test_gaps_are_told_with_their_reason_and_who_has_them():
    numbers = sweep("2.7", {"max_bank": 60 * DEGREE}, start=10 * KNOT, points=11)
    why = "max_bank must be at least 1e-6 and below pi/2 (rad)"
    assert gap_words(numbers) == [f"No answer from 10 to 200 kt (TGVV, GVV, TT, GT; panel d; 90 deg): {why}."]
    roll = sweep("2.10", {"turn_angle": math.pi, "ownship_speed": 20 * KNOT}, points=11)
    assert gap_words(roll)[0].startswith("No answer from 30 to ∞ deg/s (GVV; panel a): turn_angle: a half turn")
    words = words_of(page(roll, "<svg></svg>", "x"))
    assert f"{len(gap_words(roll)) - 2} more gaps are listed below" in words
    assert all(sentence.split(": ", 1)[1].rstrip(".") in words for sentence in gap_words(roll))


def test_the_picture_breaks_where_there_is_no_answer_and_says_where_all_is_missing():
    numbers = sweep("2.10", {"turn_angle": math.pi, "ownship_speed": 20 * KNOT}, points=41)
    figure = sweep_figure(numbers)
    first, second = figure.axes[:2]
    assert [t.get_text() for t in first.texts] == ["no answer here: the report says why"]
    assert len(second.texts) == 0
    line = next(iter(second.get_lines()))
    assert 0 < np.isnan(line.get_ydata()).sum() < 41


def test_what_leaves_the_picture_is_told():
    numbers = sweep("2.7", points=201)
    cut = cut_off(numbers.panels[2])
    assert cut is not None
    shown = np.array([c.values["distance"] for c in numbers.panels[2].curves])
    x = numbers.panels[2].curves[0].x
    assert not (shown[:, x > cut[1]] > cut[0]).any()
    assert (shown[:, np.isclose(x, cut[1])] > cut[0]).any()
    assert f"(c) up to {cut[1] / KNOT:.3g} kt" in words_of(page(numbers, "", "x"))
    assert cut_off(sweep("2.7", start=40 * KNOT, points=21).panels[2]) is None
    assert cut_off(sweep("2.9", points=21).panels[2]) is None


def test_the_verdict():
    assert "5 of 5 statements of the thesis hold" in words_of(page(sweep("2.7"), "", "x"))
    assert "With values or an interval given" in words_of(page(sweep("2.7", start=1.0, points=11), "", "x"))


def test_a_folder_that_cannot_be_written(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot write the report"):
        write_report(tmp_path / "file", sweep("2.8", points=3))
