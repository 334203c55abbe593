"""What a run is held against, and how it did, in plain words."""

from collections.abc import Mapping
from typing import Any, Literal

from wideberth.evaluation.montecarlo import paper
from wideberth.evaluation.montecarlo.experiment import Experiment

State = Literal["good", "warn", "bad"]

COLLISION_P_CD_MIN = 0.995
SELF_SEPARATION_P_CD_MIN = 0.99

IDEAL_P_FA_FACTOR_MAX = 2.0
"""P_fa of the collision set, as a multiple of the ideal detector's at the same P_cd."""

VIOLATION_RATE_MAX = 5 / 100_000
"""Collision-volume violations for each encounter; the paper's rate is 17 in 100,000."""


def criteria(experiment: Experiment, summary: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return what is wanted of the run: for each criterion the value, its limit and whether it is met.

    Parameters
    ----------
    experiment : Experiment
    summary : mapping
        With ``pooled``, ``ideal_detector`` and ``settings``.

    Returns
    -------
    list of dict
        Keys ``name``, ``value``, ``limit``, ``sense`` (``"at least"``, ``"at most"``) and ``met``: None where
        the value is not defined.
    """
    pooled, n = summary["pooled"], summary["pooled"]["encounters"]
    avoidance = summary["settings"].get("avoidance") is not False
    found: list[tuple[str, float | None, float, str]] = []
    if experiment.scoring.paper == "collision":
        found.append(("P_cd, pooled", pooled["p_cd"], COLLISION_P_CD_MIN, "at least"))
        ideal = summary["ideal_detector"]["our_p_fa_ratio"]
        found.append(("P_fa / ideal detector's at the same P_cd", ideal, IDEAL_P_FA_FACTOR_MAX, "at most"))
        if avoidance:
            rate = 1e5 * pooled["violations"] / n
            name = "violations of the collision volume in 100,000 encounters"
            found.append((name, rate, 1e5 * VIOLATION_RATE_MAX, "at most"))
            found.append(("violations of a third of it", pooled["violations_third"], 0, "at most"))
            found.append(("violations at aircraft size", pooled["violations_aircraft"], 0, "at most"))
    else:
        found.append(("P_cd, pooled", pooled["p_cd"], SELF_SEPARATION_P_CD_MIN, "at least"))
        if avoidance:
            lost = pooled["loss_of_self_separation"]
            found.append(("losses of self-separation", lost, 0, "at most"))
            filtered = pooled["loss_of_self_separation_filtered"]
            found.append(("the same with the miss-distance term", filtered, 0, "at most"))
    return [
        {
            "name": name,
            "value": value,
            "limit": limit,
            "sense": sense,
            "met": None if value is None else (value >= limit if sense == "at least" else value <= limit),
        }
        for name, value, limit, sense in found
    ]


def verdict(experiment: Experiment, summary: Mapping[str, Any]) -> tuple[State, str, str]:
    """Return how a run went: ``good``, ``warn`` or ``bad``, a headline and a sentence.

    ``bad`` is more collision-volume violations than the paper had, one at aircraft size, or, of the self-separation
    set, a near mid-air collision; ``warn`` that a criterion is not met or could not be judged, or avoidance was off.

    Parameters
    ----------
    experiment : Experiment
    summary : mapping
        As `summary.summarise` makes it.
    """
    pooled, n = summary["pooled"], summary["pooled"]["encounters"]
    collision = experiment.scoring.paper == "collision"
    avoidance = summary["settings"].get("avoidance") is not False
    what = "collision-volume violation" if collision else "loss of self-separation"
    count = pooled["violations" if collision else "loss_of_self_separation"]
    rates = f"P_cd {_share(pooled['p_cd'])}, P_fa {_share(pooled['p_fa'])}."
    if not avoidance:
        alone = f"{_counted(count, what)} in {_counted(n, 'encounter')} without avoidance"
        return "warn", alone, f"Avoidance was off. {rates}"
    met = [c["met"] for c in summary["criteria"]]
    state: State = "good" if all(m is True for m in met) else "warn"
    paper_set = paper.SETS[experiment.scoring.paper]
    if pooled["violations_aircraft" if collision else "nmac"] > 0:
        state = "bad"
    if collision and pooled["violations"] / n > paper_set.entered / paper_set.encounters:
        state = "bad"
    headline = f"{_counted(count, what)} in {_counted(n, 'encounter')}"
    paper_text = f"The paper: {paper_set.entered or 'none'} in {paper_set.encounters:,}."
    if collision:
        third, aircraft = pooled["violations_third"], pooled["violations_aircraft"]
        smaller = f"{_counted(third, '')} at a third of the volume, {_counted(aircraft, '').lower()} at aircraft size."
    else:
        smaller = f"{_counted(pooled['nmac'], 'near mid-air collision')}."
    unmet = [c["name"] for c in summary["criteria"] if not c["met"]]
    missed = f" Not met: {'; '.join(unmet)}." if unmet else ""
    return state, headline, f"{paper_text} {smaller} {rates}{missed}"


def _share(value: float | None) -> str:
    return "not defined" if value is None else f"{value:.4f}"


def _counted(count: int, what: str) -> str:
    number = f"{count:,}" if count else "No"
    if not what:
        return number if count else "None"
    plural = what.replace("loss", "losses", 1) if what.startswith("loss") else f"{what}s"
    return f"{number} {what if count == 1 else plural}"
