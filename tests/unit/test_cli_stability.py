"""The stability command and its report."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from wideberth.analysis.stability import eigenvalues, encounter_stability, largest_stable_delay
from wideberth.cli.main import app
from wideberth.evaluation.stability_report import critical_gain
from wideberth.units import FOOT

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


def test_an_encounter_is_linearised():
    given = ["stability", "--position", "25ft,5ft,-11ft", "--velocity=-5ft/s,1ft/s"]
    result = run(app, [*given, "--json"])
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)
    expected = encounter_stability([25 * FOOT, 5 * FOOT, -11 * FOOT], [-5 * FOOT, FOOT, 0.0], 12 * FOOT, 0.4)
    assert found["vertical_velocity_mps"] == expected.vertical_velocity
    # -1/t*, of the relative motion that is tangent.
    v = np.array([-5.0, 1.0, found["vertical_velocity_mps"] / FOOT])
    assert found["gains_1_per_s"]["K"] == pytest.approx(float(v @ v) / float(v @ [25, 5, -11]))
    assert found["laws"]["full"]["largest_stable_delay_s"] == expected.largest_stable_delay["full"]
    assert found["laws"]["non_cooperative"]["largest_stable_delay_s"] is None
    result = run(app, given)
    assert result.exit_code == 0 and "only one avoids" in result.stdout
    for wrong, words in (
        (["--position", "25ft,5ft,-11ft"], "both"),
        (["--position", "25ft,5ft", "--velocity=-5ft/s,1ft/s"], "3 values"),
        (["--position", "1ft,1ft,1ft", "--velocity=-5ft/s,1ft/s"], "no vertical velocity is tangent"),
        ([*given[1:], "--time", "5s"], "not for an encounter"),
    ):
        result = run(app, ["stability", *wrong])
        assert result.exit_code == 2
        assert words in result.output


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
