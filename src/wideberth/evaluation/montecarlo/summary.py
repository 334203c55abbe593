"""The summary of a Monte Carlo run: what it counted, with intervals, as plain JSON types."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import pyarrow as pa

from wideberth.errors import InputError
from wideberth.evaluation.montecarlo import intervals, rows
from wideberth.evaluation.montecarlo.curves import ScoreHistogram
from wideberth.evaluation.montecarlo.detectors import detectors_summary, ideal_summary, readings
from wideberth.evaluation.montecarlo.experiment import Experiment
from wideberth.evaluation.montecarlo.histograms import ExactHistogram, PairedTally, RatioTally
from wideberth.evaluation.montecarlo.intervals import Interval
from wideberth.evaluation.montecarlo.tally import VOLUMES, BoolArray, DetectionTally, SetTally, blocks
from wideberth.evaluation.montecarlo.verdict import criteria
from wideberth.evaluation.montecarlo.worst import WorstEncounters

DEFAULT_DETECTOR = rows.DETECTORS.index("default")
_RATIOS = {
    "nmac_risk_ratio": "nmac",
    "well_clear_risk_ratio": "loss_of_self_separation",
    "well_clear_filtered_risk_ratio": "loss_of_self_separation_filtered",
    "violation_risk_ratio": "violations",
}
_DELAY_BIN_S = 0.5
_METHODS = {
    "proportions": "Wilson, 95 %; trials are intruders for events, detections, violations and losses, encounters for "
    "maneuvers",
    "counts": "the Wilson interval of the proportion times the number of trials",
    "clustered": "the same with as many trials as the encounters are worth: intruders of one encounter share the "
    "ownship (design effect of the encounters)",
    "safety_ratio": "method of variance estimates recovery from the Wilson intervals (Donner and Zou 2012)",
    "risk_ratios": "Bonett and Price 2006 for the same intruders with and without avoidance, widened by the design "
    "effect of the encounters; without any event with avoidance the upper bound is what counts; none where "
    "there is no event without avoidance",
    "means": "normal, from the spread of the values",
    "quantiles": "between two ordered values; a quantile is the least value that 95 % do not exceed",
    "maxima": "the greatest seen; there is no interval of it",
}


def summarise(
    tables: Iterable[pa.Table], experiment: Experiment, settings: Mapping[str, Any], timings: Mapping[str, Any]
) -> dict[str, Any]:
    """Return the summary of a run.

    Parameters
    ----------
    tables : iterable of pyarrow.Table
        Rows of whole encounters (`rows.SCHEMA`), in any order; each is dropped once counted.
    experiment : Experiment
    settings : mapping
        Of the run, put into the summary as they are: ``seed``, ``avoidance``, ``encounters``, ``experiment_path``,
        ``overrides`` and whatever else.
    timings : mapping
        For each number of intruders, as text: ``times_s`` of decision cycles, ``agreed`` and ``sampled`` encounters.
        May lack some or all.

    Returns
    -------
    dict
        JSON types only, None where something is undefined. `by_intruders` is a list of counts for each number of
        intruders, `pooled` the same of all; P_cd, P_fa and delays there are those of the default detector against
        algorithm 1 on true states in the twin without avoidance.

    Raises
    ------
    InputError
        If there are no rows, or they are not whole encounters.
    """
    avoidance = settings.get("avoidance") is not False
    tallies: dict[int, SetTally] = {}
    scores = [ScoreHistogram() for _ in rows.DETECTORS]
    worst = WorstEncounters(experiment, settings)
    for table in tables:
        for k, block in blocks(table):
            tallies.setdefault(k, SetTally(experiment)).add(block)
            event: BoolArray = ~np.isnan(block["t_true_s"])
            for index, histogram in enumerate(scores):
                histogram.add(block[f"score_{index}"], event)
            worst.add(k, block)
    if not tallies:
        raise InputError("there are no encounters to sum up: run some first")
    pooled = SetTally(experiment)
    sets = []
    for k in sorted(tallies):
        pooled.merge(tallies[k])
        sets.append({"intruders": k, **set_summary(tallies[k], [timings.get(str(k))], avoidance=avoidance)})
    summary: dict[str, Any] = {
        "by_intruders": sets,
        "pooled": {
            "intruders": None,
            **set_summary(pooled, [timings.get(str(k)) for k in sorted(tallies)], avoidance=avoidance),
        },
        "detectors": detectors_summary(experiment, tallies, pooled, scores),
        "ideal_detector": ideal_summary(experiment, pooled),
        "delay_histogram": _delay_histogram(pooled.detectors[DEFAULT_DETECTOR].delays),
        "miss_distances": _miss_distances(pooled),
        "worst_encounters": {
            "entered_volume": worst.entered_volume,
            "closest": worst.closest(),
            "entered": worst.entered(),
        },
        "full_tier_encounters": pooled.full_tier,
        "settings": dict(settings),
        "experiment": {
            "name": experiment.name,
            "description": experiment.description,
            "digest": experiment.digest(),
            "settings": experiment.resolved(),
        },
        "interval_methods": dict(_METHODS),
        "notes": _notes(experiment, pooled, avoidance),
    }
    summary["readings"] = readings(experiment, summary)
    summary["criteria"] = criteria(experiment, summary)
    return summary


def table_rows(summary: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return one row for each number of intruders, and one of all, with the numbers that matter most.

    Parameters
    ----------
    summary : mapping
        As `summarise` makes it.

    Returns
    -------
    list of dict
        Keys ``intruders`` (``"all"`` in the last), ``encounters``, ``true_events``, ``p_cd``, ``p_fa``, ``violations``,
        ``loss_of_self_separation``, ``nmac_risk_ratio``, ``cycle_ms``.
    """
    keys = (
        "encounters",
        "true_events",
        "p_cd",
        "p_fa",
        "violations",
        "loss_of_self_separation",
        "nmac_risk_ratio",
    )
    return [
        {
            "intruders": "all" if counts["intruders"] is None else counts["intruders"],
            **{key: counts[key] for key in keys},
            "cycle_ms": counts["cycle_time_ms"]["mean"],
        }
        for counts in [*summary["by_intruders"], summary["pooled"]]
    ]


def set_summary(
    tally: SetTally, timings: Sequence[Mapping[str, Any] | None] = (), *, avoidance: bool = True
) -> dict[str, Any]:
    """Return the counts of a set of encounters with their intervals.

    Parameters
    ----------
    tally : SetTally
    timings : sequence of (mapping or None)
        As in `summarise`.
    avoidance : bool
        Without it there is nothing to compare, and risk ratios are None.
    """
    detection = detection_summary(tally.detectors[DEFAULT_DETECTOR])
    delay = detection.pop("delay_s")
    summary: dict[str, Any] = {
        "encounters": tally.encounters,
        "intruder_count": tally.pairs,
        **detection,
        "delay_s": delay,
    }
    for name in VOLUMES:
        summary |= _volume(name, tally.volumes[name])
    for name, volume in _RATIOS.items():
        paired = tally.volumes[volume]
        summary[name] = paired.ratio if avoidance else None
        summary[f"{name}_interval"] = _listed(paired.interval()) if avoidance else None
    return {
        **summary,
        "maneuvers": _maneuvers(tally),
        "extra_path_m": _spread(tally.extra_path),
        "duration_s": _spread(tally.duration),
        "duration_alone_s": _spread(tally.duration_alone),
        "cycle_time_ms": _cycle_times(timings),
        "full_tier_encounters": tally.full_tier,
        "in_run": detection_summary(tally.in_run),
        "other_reading": detection_summary(tally.other),
    }


def detection_summary(tally: DetectionTally) -> dict[str, Any]:
    """Return P_cd, P_fa, safety ratio and delays by one way of counting.

    P_cd = correct / true events, P_fa = false alarms / intruders that are no event, safety ratio
    (1 - P_cd) / (1 - P_fa); ADS-B paper, "Simulation results". The delay is t_detected - t_true of correct detections,
    not below 0, as the paper's cannot be; `signed` has those that are early as well.

    Parameters
    ----------
    tally : DetectionTally
    """
    correct, false = tally.correct, tally.false
    p_cd, p_fa = correct.ratio, false.ratio
    cd, fa = correct.wilson(), false.wilson()
    safety, safety_interval = None, None
    if p_cd is not None and p_fa is not None and cd is not None and fa is not None:
        safety = (1 - p_cd) / (1 - p_fa) if p_fa < 1 else None
        safety_interval = intervals.ratio_of_proportions(
            1 - p_cd, (1 - cd[1], 1 - cd[0]), 1 - p_fa, (1 - fa[1], 1 - fa[0])
        )
    total = correct.x + false.x
    return {
        "true_events": correct.x,
        "true_events_interval": _count_interval(correct.x, total),
        "correct": correct.y,
        "missed": correct.x - correct.y,
        "false_alarms": false.y,
        "false_alarms_interval": _count_interval(false.y, false.x),
        "p_cd": p_cd,
        "p_cd_interval": _listed(cd),
        "p_cd_interval_clustered": _listed(correct.clustered()),
        "p_fa": p_fa,
        "p_fa_interval": _listed(fa),
        "p_fa_interval_clustered": _listed(false.clustered()),
        "safety_ratio": safety,
        "safety_ratio_interval": _listed(safety_interval),
        "delay_s": _delays(tally),
    }


def _delays(tally: DetectionTally) -> dict[str, Any]:
    late, longest = tally.delays.not_negative(), tally.longest_delays.not_negative()
    signed = tally.delays
    least, most = signed.extremes()
    return {
        "mean_max": longest.mean(),
        "mean_max_interval": _listed(longest.mean_interval()),
        "p95": late.quantile(0.95),
        "p95_interval": _listed(late.quantile_interval(0.95)),
        "max": late.extremes()[1],
        "p95_of_max": longest.quantile(0.95),
        "mean": late.mean(),
        "mean_interval": _listed(late.mean_interval()),
        "signed": {
            "mean_max": tally.longest_delays.mean(),
            "mean_max_interval": _listed(tally.longest_delays.mean_interval()),
            "mean": signed.mean(),
            "mean_interval": _listed(signed.mean_interval()),
            "p05": signed.quantile(0.05),
            "median": signed.quantile(0.5),
            "p95": signed.quantile(0.95),
            "p95_interval": _listed(signed.quantile_interval(0.95)),
            "min": least,
            "max": most,
        },
    }


def _volume(name: str, paired: PairedTally) -> dict[str, Any]:
    return {
        name: paired.first,
        f"{name}_interval": _count_interval(paired.first, paired.trials),
        f"{name}_alone": paired.second,
        f"{name}_alone_interval": _count_interval(paired.second, paired.trials),
    }


def _maneuvers(tally: SetTally) -> dict[str, Any]:
    unnecessary: RatioTally = tally.unnecessary
    return {
        "encounters": tally.maneuvered.y,
        "share": tally.maneuvered.ratio,
        "share_interval": _listed(tally.maneuvered.wilson()),
        "per_encounter": tally.maneuvers.mean(),
        "per_encounter_interval": _listed(tally.maneuvers.mean_interval()),
        "unnecessary": unnecessary.y,
        "unnecessary_share": unnecessary.ratio,
        "unnecessary_share_interval": _listed(unnecessary.wilson()),
        "least_bad": tally.least_bad,
    }


def _spread(histogram: ExactHistogram) -> dict[str, Any]:
    return {
        "mean": histogram.mean(),
        "mean_interval": _listed(histogram.mean_interval()),
        "p95": histogram.quantile(0.95),
        "p95_interval": _listed(histogram.quantile_interval(0.95)),
        "max": histogram.extremes()[1],
    }


def _cycle_times(timings: Sequence[Mapping[str, Any] | None]) -> dict[str, Any]:
    """Return the CPU time of decision cycles, ms, and how many sampled encounters both tiers agreed on."""
    known = [t for t in timings if t]
    values = 1e3 * np.array([time for t in known for time in t.get("times_s", ())], float)
    summary: dict[str, Any] = {"mean": None, "mean_interval": None, "p95": None, "max": None, "cycles": len(values)}
    if len(values):
        summary["mean"] = float(values.mean())
        summary["p95"] = float(np.quantile(values, 0.95, method="inverted_cdf"))
        summary["max"] = float(values.max())
        if len(values) > 1:
            deviation = float(values.std(ddof=1))
            summary["mean_interval"] = _listed(intervals.mean(summary["mean"], deviation, len(values)))
    for key in ("agreed", "sampled"):
        summary[key] = sum(int(t.get(key, 0)) for t in known)
    return summary


def _delay_histogram(delays: ExactHistogram) -> dict[str, list[float] | list[int]]:
    """Return the signed delays in wider bins: the lower edges that occur, and the counts."""
    keys, counts = delays.table()
    per_bin = round(_DELAY_BIN_S / delays.step)
    wide: dict[int, int] = {}
    for key, count in zip(keys.tolist(), counts.tolist(), strict=True):
        wide[key // per_bin] = wide.get(key // per_bin, 0) + count
    return {"from_s": [_DELAY_BIN_S * k for k in sorted(wide)], "counts": [wide[k] for k in sorted(wide)]}


def _miss_distances(tally: SetTally) -> dict[str, Any]:
    """Return the histograms of the closest approaches, of all intruders and of those that are events."""
    d = tally.distances
    return {
        "ratio_edges": [float(f"{edge:.6g}") for edge in d["ratio"].edges],
        "ratio": d["ratio"].counts.tolist(),
        "ratio_alone": d["ratio_alone"].counts.tolist(),
        "ratio_of_events": d["ratio_of_events"].counts.tolist(),
        "horizontal_edges_m": [float(f"{edge:.9g}") for edge in d["horizontal"].edges],
        "horizontal": d["horizontal"].counts.tolist(),
        "horizontal_alone": d["horizontal_alone"].counts.tolist(),
    }


def _notes(experiment: Experiment, tally: SetTally, avoidance: bool) -> list[str]:
    notes = [
        "Events, detections and violations count intruders; encounters are runs.",
        "P_cd, P_fa and delays compare with algorithm 1 on true states in the twin run without avoidance, with the "
        "same noise; in_run counts in the run with avoidance, as the paper may have done.",
        "The separation ratio is the larger of horizontal / radius and vertical / half-height of the collision volume.",
        "The first and last bins of histograms hold what lies outside as well.",
    ]
    if experiment.scoring.paper == "collision":
        notes.append("A maneuver was unnecessary where no intruder would have come within 500 ft and 100 ft.")
    else:
        notes.append(
            "A maneuver was unnecessary where self-separation would not have been lost (without the "
            "miss-distance term)."
        )
    if not avoidance:
        notes.append("Avoidance was off: there is no risk ratio, and both runs are the same.")
    if tally.full_tier:
        notes.append(f"{tally.full_tier} encounters needed the full tier, as a track was lost or started anew.")
    return notes


def _count_interval(count: int, trials: int) -> list[float] | None:
    """Return the interval of an expected count, from the proportion's."""
    interval = intervals.wilson(count, trials)
    return None if interval is None else [interval[0] * trials, interval[1] * trials]


def _listed(interval: Interval | None) -> list[float] | None:
    return None if interval is None else [float(interval[0]), float(interval[1])]
