"""The stability command and its report."""

import json

import pytest
from typer.testing import CliRunner

from wideberth.analysis.stability import eigenvalues, largest_stable_delay
from wideberth.cli.main import app
from wideberth.evaluation.stability_report import critical_gain

run = CliRunner().invoke


def test_numbers_are_those_of_the_analysis():
    result = run(app, ["stability", "--time", "3s", "--lag", "200ms", "--pade", "2", "--json"])
    assert result.exit_code == 0
    (row,) = json.loads(result.stdout)
    assert row["t_star_s"] == 3.0
    found = row["largest_stable_delay_s"]["shared"]
    assert found["exact"] == largest_stable_delay(3.0, 0.2, "shared")
    assert found["pade_2"] == largest_stable_delay(3.0, 0.2, "shared", 2)


def test_the_report(tmp_path):
    result = run(app, ["stability", "--out", str(tmp_path / "out")])
    assert result.exit_code == 0, result.output
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert names == {"report.html", "gain.png", "root_locus.png", "delay.png", "limit_cycle.png"}
    page = (tmp_path / "out" / "report.html").read_text()
    assert "tolerates 2.75 s" in page
    assert "6.25" in page  # 1/tau^2 of table 5.2 as printed


@pytest.mark.parametrize("law", ["full", "shared", "shared_corrected", "non_cooperative"])
def test_the_loop_oscillates_below_the_critical_gain(law):
    k = critical_gain(0.4, law)
    assert abs(eigenvalues(0.999 * k, 0.4, law).imag).max() == 0.0
    assert abs(eigenvalues(1.001 * k, 0.4, law).imag).max() > 0.0
    if law != "shared_corrected":
        printed = critical_gain(0.4, law, as_printed=True)
        assert abs(eigenvalues(1.001 * printed, 0.4, law, as_printed=True).imag).max() > 0.0


@pytest.mark.parametrize(
    ("arguments", "words"),
    [(["--time", "3"], "--time"), (["--time", "0s"], "t_star"), (["--lag", "1m"], "--lag"), (["--pade", "99"], "pade")],
)
def test_wrong_options(arguments, words):
    result = run(app, ["stability", *arguments])
    assert result.exit_code == 2
    assert words in result.output
