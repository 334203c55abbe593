"""The summary: every number against a count by hand, whatever the order and size of the blocks."""

import json
import math
import tracemalloc
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pytest

from tests.made_rows import made_rows
from wideberth.errors import InputError
from wideberth.evaluation.montecarlo import intervals, paper, rows
from wideberth.evaluation.montecarlo.experiment import load_experiment
from wideberth.evaluation.montecarlo.histograms import BinnedHistogram, ExactHistogram
from wideberth.evaluation.montecarlo.summary import summarise, table_rows
from wideberth.evaluation.montecarlo.verdict import verdict
from wideberth.evaluation.montecarlo.worst import CLOSEST_MAX, ENTERED_MAX

EXPERIMENTS = Path(__file__).resolve().parents[2] / "experiments"
SETTINGS = {"seed": 4, "avoidance": True, "encounters": 300, "experiment_path": "experiments/adsb_collision.toml"}
TIMINGS = {"1": {"times_s": [1e-3, 2e-3, 6e-3], "agreed": 2, "sampled": 3}, "3": {"times_s": [4e-3], "agreed": 1}}
COUNTS = (1, 3)


def experiment_of(name, **overrides):
    return load_experiment(EXPERIMENTS / f"{name}.toml", [f"{k}={v}" for k, v in overrides.items()])


@pytest.fixture(scope="module", params=["adsb_collision", "adsb_self_separation"])
def made(request):
    experiment = experiment_of(request.param)
    tables = [made_rows(experiment, k, first, 100) for k in COUNTS for first in (0, 100, 200)]
    return experiment, tables, summarise(tables, experiment, SETTINGS, TIMINGS)


def encounters_of(tables, k):
    """Return lists of rows, one list for each encounter."""
    found = {}
    for table in tables:
        for row in table.to_pylist():
            if k is None or row["intruders"] == k:
                found.setdefault((row["intruders"], row["encounter"]), []).append(row)
    return list(found.values())


def known(value):
    return not math.isnan(value)


def counted(encounters, true, detected):
    flat = [row for e in encounters for row in e]
    events = [r for r in flat if known(r[true])]
    correct = [r for r in events if known(r[detected])]
    others = [r for r in flat if not known(r[true])]
    false = [r for r in others if known(r[detected])]
    delays = [r[detected] - r[true] for r in correct]
    longest = []
    for e in encounters:
        mine = [r[detected] - r[true] for r in e if known(r[true]) and known(r[detected])]
        if mine:
            longest.append(max(mine))
    return events, correct, others, false, delays, longest


def check_detection(summary, encounters, true, detected):
    events, correct, others, false, delays, longest = counted(encounters, true, detected)
    assert summary["true_events"] == len(events)
    assert summary["correct"] == len(correct)
    assert summary["missed"] == len(events) - len(correct)
    assert summary["false_alarms"] == len(false)
    p_cd, p_fa = len(correct) / len(events), len(false) / len(others)
    assert summary["p_cd"] == p_cd
    assert summary["p_fa"] == p_fa
    assert summary["p_cd_interval"] == list(intervals.wilson(len(correct), len(events)))
    assert summary["p_fa_interval"] == list(intervals.wilson(len(false), len(others)))
    assert summary["safety_ratio"] == pytest.approx((1 - p_cd) / (1 - p_fa))
    low, high = summary["safety_ratio_interval"]
    assert low <= summary["safety_ratio"] <= high
    share = intervals.wilson(len(events), len(events) + len(others))
    assert summary["true_events_interval"] == pytest.approx([s * (len(events) + len(others)) for s in share])
    clipped = np.maximum(delays, 0.0)
    d = summary["delay_s"]
    assert d["mean_max"] == pytest.approx(np.mean(np.maximum(longest, 0.0)))
    assert d["p95"] == pytest.approx(np.quantile(clipped, 0.95, method="inverted_cdf"))
    assert d["max"] == pytest.approx(clipped.max())
    assert d["mean"] == pytest.approx(clipped.mean())
    assert d["p95_of_max"] == pytest.approx(np.quantile(np.maximum(longest, 0), 0.95, method="inverted_cdf"))
    assert d["signed"]["mean"] == pytest.approx(np.mean(delays))
    assert d["signed"]["mean_max"] == pytest.approx(np.mean(longest))
    assert d["signed"]["median"] == pytest.approx(np.quantile(delays, 0.5, method="inverted_cdf"))
    assert d["signed"]["p05"] == pytest.approx(np.quantile(delays, 0.05, method="inverted_cdf"))
    assert d["signed"]["min"] == pytest.approx(min(delays))
    assert d["signed"]["max"] == pytest.approx(max(delays))
    if len(longest) > 1:
        half = 1.959964 * np.std(np.maximum(longest, 0), ddof=1) / math.sqrt(len(longest))
        assert d["mean_max_interval"] == pytest.approx([d["mean_max"] - half, d["mean_max"] + half], abs=1e-6)


@pytest.mark.parametrize("k", [*COUNTS, None])
def test_detection_is_counted_as_by_hand(made, k):
    _, tables, summary = made
    encounters = encounters_of(tables, k)
    counts = summary["pooled"] if k is None else next(c for c in summary["by_intruders"] if c["intruders"] == k)
    assert counts["encounters"] == len(encounters) == 300 * (2 if k is None else 1)
    assert counts["intruder_count"] == sum(len(e) for e in encounters)
    check_detection(counts, encounters, "t_true_s", "t_3_s")
    check_detection(counts["in_run"], encounters, "t_true_in_run_s", "t_detected_in_run_s")
    check_detection(counts["other_reading"], encounters, "t_true_other_s", "t_3_s")


@pytest.mark.parametrize("k", [*COUNTS, None])
def test_volumes_and_maneuvers_are_counted_as_by_hand(made, k):
    experiment, tables, summary = made
    encounters = encounters_of(tables, k)
    flat = [row for e in encounters for row in e]
    counts = summary["pooled"] if k is None else next(c for c in summary["by_intruders"] if c["intruders"] == k)
    bits = {
        "violations": rows.VOLUME_FULL,
        "violations_third": rows.VOLUME_THIRD,
        "violations_aircraft": rows.VOLUME_AIRCRAFT,
        "nmac": rows.NMAC,
        "loss_of_self_separation": rows.LOSS,
        "loss_of_self_separation_filtered": rows.LOSS_FILTERED,
        "loss_of_astm": rows.ASTM,
    }
    for name, bit in bits.items():
        flown, alone = (sum(bool(r[c] & bit) for r in flat) for c in ("inside", "inside_alone"))
        assert counts[name] == flown
        assert counts[f"{name}_alone"] == alone
        low, high = counts[f"{name}_interval"]
        assert low <= flown <= high
        assert [low, high] == pytest.approx([b * len(flat) for b in intervals.wilson(flown, len(flat))])
    for name, volume in (("nmac_risk_ratio", "nmac"), ("well_clear_risk_ratio", "loss_of_self_separation")):
        if counts[f"{volume}_alone"] == 0:
            assert counts[name] is None and counts[f"{name}_interval"] is None
        else:
            assert counts[name] == counts[volume] / counts[f"{volume}_alone"]
            low, high = counts[f"{name}_interval"]
            assert 0.0 <= low <= counts[name] <= high
    needed = rows.NMAC if experiment.scoring.paper == "collision" else rows.LOSS
    flew = [e for e in encounters if known(e[0]["t_maneuver_s"])]
    unnecessary = [e for e in flew if not any(r["inside_alone"] & needed for r in e)]
    m = counts["maneuvers"]
    assert m["encounters"] == len(flew)
    assert m["share"] == len(flew) / len(encounters)
    assert m["unnecessary"] == len(unnecessary)
    assert m["unnecessary_share"] == len(unnecessary) / len(flew)
    assert m["unnecessary_share_interval"] == list(intervals.wilson(len(unnecessary), len(flew)))
    assert m["per_encounter"] == pytest.approx(np.mean([e[0]["maneuvers"] for e in encounters]))
    assert m["least_bad"] == sum(e[0]["least_bad"] for e in encounters)
    path = np.array([e[0]["extra_path_m"] for e in flew])
    assert counts["extra_path_m"]["mean"] == pytest.approx(path.mean(), abs=0.05)
    assert counts["extra_path_m"]["max"] == pytest.approx(path.max(), abs=0.05)
    assert counts["extra_path_m"]["p95"] == pytest.approx(np.quantile(path, 0.95, method="inverted_cdf"), abs=0.051)
    for key, column in (("duration_s", "duration_s"), ("duration_alone_s", "duration_alone_s")):
        times = np.array([e[0][column] for e in encounters])
        assert counts[key]["mean"] == pytest.approx(times.mean())
        assert counts[key]["max"] == pytest.approx(times.max())
    assert counts["full_tier_encounters"] == sum(e[0]["full_tier"] for e in encounters)


def test_cycle_times_and_pooling(made):
    _, _, summary = made
    one, three = summary["by_intruders"]
    assert one["cycle_time_ms"]["mean"] == pytest.approx(3.0)
    assert one["cycle_time_ms"]["p95"] == one["cycle_time_ms"]["max"] == pytest.approx(6.0)
    assert (one["cycle_time_ms"]["agreed"], one["cycle_time_ms"]["sampled"]) == (2, 3)
    assert three["cycle_time_ms"]["mean"] == pytest.approx(4.0)
    assert three["cycle_time_ms"]["mean_interval"] is None
    assert summary["pooled"]["cycle_time_ms"]["mean"] == pytest.approx(13 / 4)
    assert summary["pooled"]["cycle_time_ms"]["cycles"] == 4
    for key in ("true_events", "correct", "false_alarms", "violations", "loss_of_self_separation"):
        assert summary["pooled"][key] == one[key] + three[key]
    assert summary["full_tier_encounters"] == summary["pooled"]["full_tier_encounters"]


def test_detectors_and_their_curves(made):
    experiment, tables, summary = made
    flat = [row for e in encounters_of(tables, None) for row in e]
    events = [r for r in flat if known(r["t_true_s"])]
    others = [r for r in flat if not known(r["t_true_s"])]
    assert [d["name"] for d in summary["detectors"]] == list(rows.DETECTORS)
    scoring = experiment.scoring
    nominal = [1.0, scoring.m1, scoring.m1, -math.log10(scoring.alarm_probability)]
    for i, detector in enumerate(summary["detectors"]):
        assert detector["threshold"] == nominal[i]
        assert detector["p_cd"] == sum(known(r[f"t_{i}_s"]) for r in events) / len(events)
        assert detector["p_fa"] == sum(known(r[f"t_{i}_s"]) for r in others) / len(others)
        assert sum(c["correct"] for c in detector["by_intruders"]) == detector["correct"]
        curve = detector["curve"]
        assert 10 <= len(curve) <= 60
        for point in curve:
            p_cd = np.mean([r[f"score_{i}"] < point["threshold"] for r in events])
            p_fa = np.mean([r[f"score_{i}"] < point["threshold"] for r in others])
            assert (point["p_cd"], point["p_fa"]) == (pytest.approx(p_cd), pytest.approx(p_fa))
        thresholds = [p["threshold"] for p in curve]
        assert thresholds == sorted(thresholds)
        # The first threshold, in thousandths, that detects enough.
        for level in (0.99, 0.995, 0.999):
            scores = sorted(r[f"score_{i}"] for r in events)
            needed = scores[math.ceil(level * len(scores) - 1e-9) - 1]
            expected = None
            if math.isfinite(needed):
                # 80 and more counts as never.
                edge = (math.floor(needed * 1000 + 1e-6) + 1) / 1000
                expected = np.mean([r[f"score_{i}"] < edge for r in others])
            found = detector["p_fa_at_p_cd"][f"{level:g}"]
            assert found == (None if expected is None else pytest.approx(expected))


def test_the_worst_encounters_and_how_to_replay_them(made):
    experiment, tables, summary = made
    scoring = experiment.scoring
    worst = summary["worst_encounters"]
    bit = rows.VOLUME_FULL if scoring.paper == "collision" else rows.LOSS
    for k in COUNTS:
        ratios = []
        for e in encounters_of(tables, k):
            inside = [r for r in e if r["inside"] & bit] or e
            ratio = [
                max(r["horizontal_m"] / scoring.violation_radius_m, r["vertical_m"] / scoring.violation_half_height_m)
                for r in inside
            ]
            ratios.append((min(ratio), e[0]["encounter"]))
        closest = [w for w in worst["closest"] if w["intruders"] == k]
        assert [(w["separation_ratio"], w["encounter"]) for w in closest] == sorted(ratios)[:CLOSEST_MAX]
        entered = sorted(e[0]["encounter"] for e in encounters_of(tables, k) if any(r["inside"] & bit for r in e))
        assert len(entered) <= ENTERED_MAX
        assert sorted(w["encounter"] for w in worst["entered"] if w["intruders"] == k) == entered
    first = worst["closest"][0]
    name = f"1-{first['encounter']}"
    assert first["command"] == (
        f"wideberth run --encounter experiments/adsb_collision.toml:{name} --out out/{name} --seed 4"
    )


def test_commands_repeat_what_the_run_was_told():
    experiment = experiment_of("adsb_collision")
    settings = {"avoidance": False, "experiment_path": "my files/a.toml", "seed": 1, "overrides": ["errors.start=zero"]}
    summary = summarise([made_rows(experiment, 1, 0, 5, avoid=False)], experiment, settings, {})
    command = summary["worst_encounters"]["closest"][0]["command"]
    assert command.startswith("wideberth run --encounter 'my files/a.toml:1-")
    assert command.endswith(" --seed 1 --no-avoidance --set errors.start=zero")


def test_the_order_and_size_of_blocks_do_not_matter(made):
    experiment, tables, summary = made
    whole = pa.concat_tables(tables)
    # By encounter within each number of intruders, in odd pieces, in reverse.
    pieces = []
    for k in COUNTS:
        mine = whole.filter(pc.equal(whole["intruders"], k))
        pieces += [mine.slice(k * first, k * 37) for first in range(0, 300, 37)]
    assert summarise(reversed(pieces), experiment, SETTINGS, TIMINGS) == summary
    # Several numbers of intruders in one table.
    assert summarise([whole], experiment, SETTINGS, TIMINGS) == summary


def test_json_says_it_all(made):
    _, _, summary = made
    assert json.loads(json.dumps(summary, allow_nan=False)) == summary


def test_readings_come_nearest_first(made):
    experiment, _, summary = made
    distances = [r["distance"] for r in summary["readings"]]
    assert len(distances) == 6 and distances == sorted(distances)
    best = summary["readings"][0]
    p_cd, p_fa = paper.SETS[experiment.scoring.paper].mean_pair()
    expected = abs(math.log10((1 - best["p_cd"] + 1e-4) / (1 - p_cd + 1e-4)))
    expected += abs(math.log10((best["p_fa"] + 1e-6) / (p_fa + 1e-6)))
    assert best["distance"] == pytest.approx(expected)


def test_miss_distances_hold_every_intruder(made):
    _, tables, summary = made
    d = summary["miss_distances"]
    flat = [row for e in encounters_of(tables, None) for row in e]
    events = sum(known(r["t_true_s"]) for r in flat)
    assert sum(d["ratio"]) == sum(d["ratio_alone"]) == sum(d["horizontal"]) == len(flat)
    assert sum(d["ratio_of_events"]) == events
    edges = d["horizontal_edges_m"]
    third = sum(edges[2] <= r["horizontal_alone_m"] < edges[3] for r in flat)
    assert d["horizontal_alone"][2] == third


def test_the_delay_histogram_holds_every_correct_detection(made):
    _, tables, summary = made
    delays = [
        r["t_3_s"] - r["t_true_s"]
        for e in encounters_of(tables, None)
        for r in e
        if known(r["t_true_s"]) and known(r["t_3_s"])
    ]
    h = summary["delay_histogram"]
    bins = {}
    for delay in delays:
        start = round(10 * delay) // 5 * 0.5
        bins[start] = bins.get(start, 0) + 1
    assert dict(zip(h["from_s"], h["counts"], strict=True)) == bins


def test_closing_table(made):
    _, _, summary = made
    table = table_rows(summary)
    assert [r["intruders"] for r in table] == [1, 3, "all"]
    assert table[0]["cycle_ms"] == pytest.approx(3.0)
    assert table[2]["true_events"] == summary["pooled"]["true_events"]


def empty_of(experiment, **changes):
    """Rows of encounters in which nothing happens, with some columns changed."""
    table = made_rows(experiment, 1, 0, 20, avoid=False)
    nothing = {c: np.full(20, np.nan) for c in table.column_names if c.startswith("t_") and c != "t_cpa_s"}
    nothing |= {"inside": np.zeros(20, np.int32), "inside_alone": np.zeros(20, np.int32)}
    for name, values in (nothing | changes).items():
        table = table.set_column(table.column_names.index(name), name, pa.array(values, rows.SCHEMA.field(name).type))
    return table


def test_where_nothing_happened_much_is_undefined():
    experiment = experiment_of("adsb_collision")
    summary = summarise([empty_of(experiment)], experiment, {"avoidance": True}, {})
    p = summary["pooled"]
    for key in ("p_cd", "p_cd_interval", "safety_ratio", "safety_ratio_interval", "nmac_risk_ratio"):
        assert p[key] is None
    assert p["p_fa"] == 0.0 and p["p_fa_interval"][1] > 0.1
    assert p["delay_s"]["mean_max"] is p["delay_s"]["p95"] is p["delay_s"]["max"] is None
    assert p["cycle_time_ms"]["mean"] is None
    assert p["extra_path_m"]["max"] is None
    assert summary["delay_histogram"] == {"from_s": [], "counts": []}
    assert summary["readings"][0]["distance"] is None
    json.dumps(summary, allow_nan=False)


def test_without_avoidance_there_is_no_risk_ratio():
    experiment = experiment_of("adsb_collision")
    table = made_rows(experiment, 3, 0, 200, avoid=False)
    p = summarise([table], experiment, {"avoidance": False}, {})["pooled"]
    assert p["nmac_alone"] > 0 and p["nmac_risk_ratio"] is None and p["nmac_risk_ratio_interval"] is None


def test_a_risk_ratio_of_none_has_an_upper_bound():
    experiment = experiment_of("adsb_collision")
    table = empty_of(experiment, inside_alone=np.array([rows.NMAC] * 8 + [0] * 12))
    p = summarise([table], experiment, {"avoidance": True}, {})["pooled"]
    assert p["nmac_risk_ratio"] == 0.0
    assert p["nmac_risk_ratio_interval"] == list(intervals.paired_ratio(0, 0, 8))
    assert 0.2 < p["nmac_risk_ratio_interval"][1] < 0.6


@pytest.mark.parametrize(
    ("table", "message"),
    [
        (lambda t: t.slice(1), "not whole"),
        (lambda t: pa.concat_tables([t, t]), "not whole"),
        (lambda t: t.drop_columns(["score_3"]), "lack the columns score_3"),
        (lambda t: t.slice(0, 0), "no encounters"),
    ],
)
def test_rows_that_are_not_whole_encounters_are_refused(table, message):
    experiment = experiment_of("adsb_collision")
    with pytest.raises(InputError, match=message):
        summarise([table(made_rows(experiment, 3, 0, 4))], experiment, SETTINGS, {})


def test_verdicts():
    experiment = experiment_of("adsb_collision")
    events = np.full(20, np.nan)
    events[:10] = 1.0
    perfect = {"t_true_s": events, "t_3_s": events}

    def of(settings=SETTINGS, **changes):
        summary = summarise([empty_of(experiment, **{**perfect, **changes})], experiment, settings, {})
        return verdict(experiment, summary)

    state, headline, sentence = of()
    assert (state, headline) == ("good", "No collision-volume violations in 20 encounters")
    assert "P_cd 1.0000, P_fa 0.0000" in sentence and "The paper: 17 in 100,000" in sentence
    late = events.copy()
    late[0] = np.nan
    state, _, sentence = of(t_3_s=late)
    assert state == "warn" and "Not met: P_cd, pooled." in sentence
    one = np.array([rows.VOLUME_FULL] + [0] * 19)
    state, headline, _ = of(inside=one)
    assert (state, headline) == ("bad", "1 collision-volume violation in 20 encounters")
    state, headline, _ = of(settings={"avoidance": False}, inside=one)
    assert (state, headline) == ("warn", "1 collision-volume violation in 20 encounters without avoidance")


def test_memory_does_not_grow_with_the_rows():
    experiment = experiment_of("adsb_collision")
    table = made_rows(experiment, 2, 0, 500)
    column = table.column_names.index("encounter")

    def many(count):
        for i in range(count):
            numbers = pc.add(table["encounter"], 500 * i)
            yield table.set_column(column, "encounter", numbers)

    def peak(count):
        tracemalloc.start()
        summarise(many(count), experiment, SETTINGS, {})
        value = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return value

    peak(2)
    assert peak(60) < 1.1 * peak(6)


def test_an_exact_histogram_is_exact():
    h = ExactHistogram(0.1)
    h.add([0.1, 0.2, 0.30000000000000004, 0.3, -0.5])
    h.add([])
    assert h.count == 5
    assert h.quantile(0.8) == 0.3 and h.extremes() == (-0.5, 0.3)
    assert h.mean() == pytest.approx(0.08)
    assert h.not_negative().extremes() == (0.0, 0.3)
    assert (
        ExactHistogram(1.0).quantile(0.5) is ExactHistogram(1.0).mean() is ExactHistogram(1.0).mean_interval() is None
    )


def test_a_binned_histogram_keeps_what_lies_outside():
    h = BinnedHistogram([0.0, 1.0, 2.0])
    h.add([-5.0, 0.0, 1.0, 1.999, 2.0, 77.0, np.inf, np.nan])
    assert h.counts.tolist() == [2, 6]
