"""The four detectors, the ideal one, and which reading of the counts comes nearest to the paper's numbers."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from wideberth.evaluation.montecarlo import paper, rows
from wideberth.evaluation.montecarlo.curves import DetectorCurve, ScoreHistogram
from wideberth.evaluation.montecarlo.experiment import Experiment
from wideberth.evaluation.montecarlo.ideal_detector import ideal_curve
from wideberth.evaluation.montecarlo.tally import SetTally

TITLES = {
    "algorithm_1": "algorithm 1 on the track",
    "algorithm_2_printed": "algorithm 2 as printed",
    "algorithm_2_track": "algorithm 2, track's covariance",
    "default": "default, probability of entry",
}
P_CD_LEVELS = (0.99, 0.995, 0.999)

IDEAL_SAMPLES = 1_000_000
_IDEAL_SEED = 1
# So few sampled events are missed above this P_cd that the ideal curve says nothing there.
_IDEAL_P_CD_MAX = 0.9999


def nominal_thresholds(experiment: Experiment) -> dict[str, float]:
    """Return the threshold of each detector below which a score is an alarm.

    Parameters
    ----------
    experiment : Experiment
    """
    scoring = experiment.scoring
    return {
        "algorithm_1": 1.0,
        "algorithm_2_printed": scoring.m1,
        "algorithm_2_track": scoring.m1,
        "default": -math.log10(scoring.alarm_probability),
    }


def detectors_summary(
    experiment: Experiment, tallies: Mapping[int, SetTally], pooled: SetTally, scores: Sequence[ScoreHistogram]
) -> list[dict[str, Any]]:
    """Return counts and curve of each detector.

    Parameters
    ----------
    experiment : Experiment
    tallies : mapping of int to SetTally
        By number of intruders.
    pooled : SetTally
    scores : sequence of ScoreHistogram
        Of all intruders, one for each detector.
    """
    thresholds, paper_p_cd = nominal_thresholds(experiment), paper.SETS[experiment.scoring.paper].mean_pair()[0]
    summaries = []
    for index, name in enumerate(rows.DETECTORS):
        curve = scores[index].curve()
        bounds = {p_cd: curve.p_fa_interval_at(p_cd) for p_cd in P_CD_LEVELS}
        summaries.append(
            {
                "name": name,
                "title": TITLES[name],
                "threshold": thresholds[name],
                **_counts(pooled, index),
                "by_intruders": [{"intruders": k, **_counts(tally, index)} for k, tally in sorted(tallies.items())],
                "p_fa_at_p_cd": _at_levels(curve),
                "p_fa_at_p_cd_interval": {f"{p_cd:g}": bound and list(bound) for p_cd, bound in bounds.items()},
                "p_fa_at_paper_p_cd": curve.p_fa_at(paper_p_cd),
                "curve": curve.points(),
            }
        )
    return summaries


def _counts(tally: SetTally, index: int) -> dict[str, Any]:
    correct, false = tally.detectors[index].correct, tally.detectors[index].false
    cd, fa = correct.wilson(), false.wilson()
    return {
        "correct": correct.y,
        "missed": correct.x - correct.y,
        "false_alarms": false.y,
        "p_cd": correct.ratio,
        "p_cd_interval": None if cd is None else list(cd),
        "p_fa": false.ratio,
        "p_fa_interval": None if fa is None else list(fa),
    }


def _at_levels(curve: DetectorCurve) -> dict[str, float | None]:
    return {f"{p_cd:g}": curve.p_fa_at(p_cd) for p_cd in P_CD_LEVELS}


def ideal_summary(experiment: Experiment, pooled: SetTally, samples: int = IDEAL_SAMPLES) -> dict[str, Any]:
    """Return the curve of the ideal detector, and its P_fa where it detects as much as the default one.

    Parameters
    ----------
    experiment : Experiment
    pooled : SetTally
    samples : int
    """
    ideal = ideal_curve(experiment, samples, _IDEAL_SEED)
    ours = pooled.detectors[rows.DETECTORS.index("default")]
    p_cd, p_fa = ours.correct.ratio, ours.false.ratio
    same = None if p_cd is None else ideal.curve.p_fa_at(min(p_cd, _IDEAL_P_CD_MAX))
    return {
        "samples": ideal.samples,
        "position_sigma_m": ideal.position_sigma_m,
        "altitude_sigma_m": ideal.altitude_sigma_m,
        "event_share": ideal.curve.events / ideal.samples,
        "p_fa_at_p_cd": _at_levels(ideal.curve),
        "p_fa_at_paper_p_cd": ideal.curve.p_fa_at(paper.SETS[experiment.scoring.paper].mean_pair()[0]),
        "p_fa_at_our_p_cd": same,
        "our_p_fa_ratio": p_fa / same if p_fa is not None and same else None,
        "curve": ideal.curve.points(),
    }


def readings(experiment: Experiment, summary: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return P_cd and P_fa by each reading of what was counted, the nearest to the paper's pair first.

    The paper's pair is the mean over its numbers of intruders. `distance` is the sum of the factors, in powers of ten,
    between the fractions missed and between P_fa; a fraction of 1e-4 is added to the former, as the paper's pair is
    rounded to three digits.

    Parameters
    ----------
    experiment : Experiment
    summary : mapping
        With ``detectors`` and ``pooled``.
    """
    pooled = summary["pooled"]
    candidates = [(d["title"], "twin without avoidance", d) for d in summary["detectors"]]
    default = TITLES["default"]
    candidates.append((default, "run with avoidance", pooled["in_run"]))
    candidates.append((default, "twin, the other reading of the volume", pooled["other_reading"]))
    paper_cd, paper_fa = paper.SETS[experiment.scoring.paper].mean_pair()
    found = []
    for title, counted, numbers in candidates:
        p_cd, p_fa = numbers["p_cd"], numbers["p_fa"]
        distance = None
        if p_cd is not None and p_fa is not None:
            missed = math.log10((1 - p_cd + 1e-4) / (1 - paper_cd + 1e-4))
            distance = abs(missed) + abs(math.log10((p_fa + 1e-6) / (paper_fa + 1e-6)))
        found.append({"detector": title, "counted": counted, "p_cd": p_cd, "p_fa": p_fa, "distance": distance})
    return sorted(found, key=lambda r: math.inf if r["distance"] is None else r["distance"])
