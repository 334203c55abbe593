"""How the results change with the accuracy that the intruders report, and with the messages that are lost."""

from collections.abc import Callable
from typing import Any

import pyarrow as pa

from wideberth.errors import InputError
from wideberth.evaluation.montecarlo import intervals
from wideberth.evaluation.montecarlo.experiment import Experiment, build_experiment
from wideberth.evaluation.montecarlo.histograms import PairedTally
from wideberth.evaluation.montecarlo.tally import SetTally, blocks

RunBlock = Callable[[Experiment, int, int, int, int, bool], pa.Table]
"""``run(experiment, seed, intruders, first, count, avoid)`` gives the rows of encounters first..first + count - 1."""

NACP = (7, 8, 9, 10, 11)
LOSS = (0.0, 0.15, 0.3, 0.5, 0.7)
INTRUDERS = (1, 3)
BLOCK_MAX = 500

# The integrity that goes with an accuracy: its bound must hold the errors. Below NACp 9 the experiment's own NIC stays.
_NIC = {9: 9, 10: 10, 11: 11}


def with_nacp(experiment: Experiment, nacp: int) -> Experiment:
    """Return the experiment with another position accuracy of the intruders; the tracker is told.

    Parameters
    ----------
    experiment : Experiment
    nacp : int
        Navigation accuracy category for position, 0 to 11.

    Raises
    ------
    InputError
        If the experiment's sensor or tracker has no such setting.
    """
    own = _setting(experiment, "nic")
    nic = own if nacp == _setting(experiment, "nacp") else max(own, _NIC.get(nacp, own))
    tables = experiment.resolved()
    tables["sensor"] |= {"nacp": nacp, "nic": nic}
    # What the tracker assumes where nothing was reported; the intruders here do report.
    assumed = {"assumed_nacp": nacp, "assumed_nic": nic}
    if "noise" in tables["sensor"]:
        tables["sensor"]["noise"] = {**tables["sensor"]["noise"], **assumed}
    tables["tracker"] |= assumed
    return build_experiment(tables, f"NACp {nacp}")


def with_loss(experiment: Experiment, loss: float) -> Experiment:
    """Return the experiment with another fraction of messages lost on the link it uses.

    Parameters
    ----------
    experiment : Experiment
    loss : float
        0 to 1.

    Raises
    ------
    InputError
        If the experiment's sensor has no such setting.
    """
    tables = experiment.resolved()
    tables["sensor"][f"loss_{_setting(experiment, 'link')}"] = loss
    return build_experiment(tables, f"loss of {loss:g}")


def _setting(experiment: Experiment, name: str) -> Any:
    config = experiment.scenario.sensor.config
    if not hasattr(config, name):
        kind = experiment.scenario.sensor.kind
        raise InputError(f"sensitivity: the sensor {kind} has no {name}; give an experiment with the sensor adsb")
    return getattr(config, name)


def run_sensitivity(
    experiment: Experiment,
    seed: int,
    encounters: int,
    run: RunBlock,
    progress: Callable[[str, float], None],
) -> list[dict[str, Any]]:
    """Return the results for other accuracies (NACp) and other fractions of messages lost, one at a time.

    All use the same encounters. Each is flown with avoidance, and in its twin without, as always.

    Parameters
    ----------
    experiment : Experiment
    seed : int
    encounters : int
        For each value and number of intruders (one and three, or the least that the experiment has).
    run : callable
        As `tiers.run_block`.
    progress : callable
        Called with a text and the fraction done, before each block and at the end.

    Returns
    -------
    list of dict
        For each ``parameter`` (``nacp``, ``loss``), ``value`` and ``intruders``: ``encounters``, ``own`` (whether it is
        the experiment's own value), ``true_events``, ``p_cd``, ``p_fa``, ``violations``, ``violations_per_encounter``,
        ``losses_per_encounter`` (of self-separation), ``nmac_risk_ratio`` and ``well_clear_risk_ratio``, each with its
        95 % interval under ``..._interval``.

    Raises
    ------
    InputError
        If the number of encounters is not positive, or the experiment's sensor lacks the settings.
    """
    if encounters < 1:
        raise InputError(f"sensitivity: give at least 1 encounter, not {encounters}")
    counts = [k for k in INTRUDERS if k in experiment.encounter.intruders] or [min(experiment.encounter.intruders)]
    own_loss = _setting(experiment, f"loss_{_setting(experiment, 'link')}")
    cases = [("nacp", float(v), with_nacp(experiment, v), v == _setting(experiment, "nacp")) for v in NACP]
    cases += [("loss", v, with_loss(experiment, v), v == own_loss) for v in LOSS]
    results, done, total = [], 0, len(cases) * len(counts) * encounters
    for parameter, value, changed, own in cases:
        name = f"NACp {value:g}" if parameter == "nacp" else f"{100 * value:g} % of messages lost"
        for k in counts:
            tally = SetTally(changed)
            for first in range(0, encounters, BLOCK_MAX):
                size = min(BLOCK_MAX, encounters - first)
                progress(f"{name}, {k} intruder{'s' * (k > 1)}", done / total)
                for _, block in blocks(run(changed, seed, k, first, size, True)):
                    tally.add(block)
                done += size
            results.append({"parameter": parameter, "value": value, "own": own, **_result(tally, k)})
    progress("sensitivity done", 1.0)
    return results


def _result(tally: SetTally, k: int) -> dict[str, Any]:
    detection = tally.detectors[-1]
    correct, false = detection.correct, detection.false
    nmac, loss = tally.volumes["nmac"], tally.volumes["loss_of_self_separation"]
    entered = tally.volumes["violations"]
    return {
        "intruders": k,
        "encounters": tally.encounters,
        "true_events": correct.x,
        "p_cd": correct.ratio,
        "p_cd_interval": _listed(correct.clustered()),
        "p_fa": false.ratio,
        "p_fa_interval": _listed(false.clustered()),
        "violations": entered.first,
        **_per_encounter("violations_per_encounter", entered, tally.encounters),
        "loss_of_self_separation": loss.first,
        **_per_encounter("losses_per_encounter", loss, tally.encounters),
        "nmac_risk_ratio": nmac.ratio,
        "nmac_risk_ratio_interval": _listed(nmac.interval()),
        "well_clear_risk_ratio": loss.ratio,
        "well_clear_risk_ratio_interval": _listed(loss.interval()),
    }


def _per_encounter(name: str, paired: PairedTally, encounters: int) -> dict[str, Any]:
    """Return intruders inside a volume for each encounter; the interval is Wilson's of the intruders' proportion."""
    interval = intervals.wilson(paired.first, paired.trials)
    scale = paired.trials / encounters
    return {
        name: paired.first / encounters,
        f"{name}_interval": None if interval is None else [scale * bound for bound in interval],
    }


def _listed(interval: intervals.Interval | None) -> list[float] | None:
    return None if interval is None else list(interval)
