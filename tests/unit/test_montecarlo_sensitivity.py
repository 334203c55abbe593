"""Sensitivity: which experiments are flown, and what is made of their rows."""

from pathlib import Path

import pyarrow as pa
import pytest

from tests.made_rows import made_rows
from wideberth.errors import InputError
from wideberth.evaluation.montecarlo import intervals
from wideberth.evaluation.montecarlo.experiment import load_experiment
from wideberth.evaluation.montecarlo.sensitivity import LOSS, NACP, run_sensitivity, with_loss, with_nacp
from wideberth.evaluation.montecarlo.summary import set_summary
from wideberth.evaluation.montecarlo.tally import SetTally, blocks

EXPERIMENTS = Path(__file__).resolve().parents[2] / "experiments"


def experiment_of(*overrides):
    return load_experiment(EXPERIMENTS / "adsb_collision.toml", overrides)


class Runs:
    """Stands in for the fast tier, and remembers what it was asked."""

    def __init__(self):
        self.calls, self.tables, self.progress = [], {}, []

    def run(self, experiment, seed, intruders, first, count, avoid):
        sensor = experiment.scenario.sensor.config
        self.calls.append((sensor.nacp, sensor.loss, intruders, first, count, seed, avoid))
        table = made_rows(experiment, intruders, first, count, seed)
        self.tables.setdefault((sensor.nacp, sensor.loss, intruders), []).append(table)
        return table

    def tell(self, text, fraction):
        self.progress.append((text, fraction))


@pytest.fixture(scope="module")
def flown():
    runs = Runs()
    return runs, run_sensitivity(experiment_of(), 9, 30, runs.run, runs.tell)


def test_every_value_is_flown_with_one_and_three_intruders(flown):
    runs, results = flown
    nacp = [("nacp", float(v), k) for v in NACP for k in (1, 3)]
    loss = [("loss", v, k) for v in LOSS for k in (1, 3)]
    assert [(r["parameter"], r["value"], r["intruders"]) for r in results] == nacp + loss
    own = [(r["parameter"], r["value"]) for r in results if r["own"]]
    assert own == [("nacp", 8.0)] * 2 + [("loss", 0.15)] * 2
    # One thing at a time, on the same encounters.
    assert [c[:2] for c in runs.calls] == [(v, 0.15) for v in NACP for _ in "ab"] + [(8, v) for v in LOSS for _ in "ab"]
    assert {c[3:] for c in runs.calls} == {(0, 30, 9, True)}
    fractions = [f for _, f in runs.progress]
    assert fractions == sorted(fractions) and fractions[0] == 0.0 and fractions[-1] == 1.0
    assert "NACp 7, 1 intruder" in runs.progress[0]


def test_results_are_those_of_the_summary(flown):
    runs, results = flown
    experiment = experiment_of()
    for r in results:
        key = (int(r["value"]), 0.15) if r["parameter"] == "nacp" else (8, r["value"])
        # The value that the experiment has itself is flown for both.
        tally = SetTally(experiment)
        for _, block in blocks(runs.tables[(*key, r["intruders"])][0]):
            tally.add(block)
        counts = set_summary(tally)
        n = r["encounters"]
        assert n == 30
        for name in ("true_events", "p_cd", "p_fa", "violations", "loss_of_self_separation", "nmac_risk_ratio"):
            assert r[name] == counts[name]
        assert r["p_fa_interval"] == counts["p_fa_interval_clustered"]
        assert r["violations_per_encounter"] == counts["violations"] / n
        trials = n * r["intruders"]
        low, high = intervals.wilson(counts["loss_of_self_separation"], trials)
        assert r["losses_per_encounter_interval"] == pytest.approx([low * r["intruders"], high * r["intruders"]])
        assert r["well_clear_risk_ratio_interval"] == counts["well_clear_risk_ratio_interval"]


def test_blocks_are_small_and_cover_all():
    runs = Runs()

    def run(experiment, seed, intruders, first, count, avoid):
        runs.calls.append((first, count))
        return made_rows(experiment, intruders, first, 1)

    run_sensitivity(experiment_of("encounter.intruders=[2,4]"), 1, 1100, run, runs.tell)
    assert runs.calls == [(0, 500), (500, 500), (1000, 100)] * (len(NACP) + len(LOSS))
    # Neither one nor three intruders: the least there is.
    assert "2 intruders" in runs.progress[0][0]


def test_an_accuracy_is_told_to_sensor_and_tracker():
    experiment = experiment_of()
    for nacp, nic in ((7, 7), (8, 7), (9, 9), (10, 10), (11, 11)):
        changed = with_nacp(experiment, nacp)
        sensor, tracker = changed.scenario.sensor.config, changed.scenario.tracker.config
        assert (sensor.nacp, sensor.nic) == (nacp, nic)
        assert (sensor.noise.assumed_nacp, sensor.noise.assumed_nic) == (nacp, nic)
        assert (tracker.assumed_nacp, tracker.assumed_nic) == (nacp, nic)
        assert changed.scoring == experiment.scoring and changed.encounter == experiment.encounter
    assert with_nacp(experiment, 8).digest() == experiment.digest()
    # A bias stays a bias.
    bias = experiment_of("errors.altitude=bias")
    assert with_nacp(bias, 9).scenario.tracker.config.altitude_bias_sigma_ft == 75.9
    assert with_nacp(bias, 9).errors == bias.errors


def test_messages_are_lost_on_the_link_in_use():
    assert with_loss(experiment_of(), 0.5).scenario.sensor.config.loss_1090 == 0.5
    other = with_loss(experiment_of('sensor.link="978"'), 0.5).scenario.sensor.config
    assert (other.loss_978, other.loss_1090, other.loss) == (0.5, 0.15, 0.5)


def test_bad_numbers_are_refused():
    with pytest.raises(InputError, match="at least 1"):
        run_sensitivity(experiment_of(), 1, 0, Runs().run, Runs().tell)
    with pytest.raises(InputError, match="loss"):
        with_loss(experiment_of(), 1.5)


def test_foreign_rows_are_refused():
    with pytest.raises(InputError, match="lack the columns"):
        run_sensitivity(experiment_of(), 1, 1, lambda *_: pa.table({"intruders": [1]}), Runs().tell)
