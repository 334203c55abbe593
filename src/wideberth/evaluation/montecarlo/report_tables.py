"""The tables of a Monte Carlo report, the paper's numbers beside ours."""

from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from wideberth.evaluation.montecarlo import paper
from wideberth.evaluation.montecarlo.experiment import Experiment
from wideberth.evaluation.report_shell import Cell, number, table

Summary = Mapping[str, Any]
_DASH = "–"


def between(interval: Sequence[float] | None, digits: int, unit: str = "") -> Cell:
    """Return an interval in small print, nothing where there is none."""
    if interval is None:
        return ""
    low, high = (number(bound, digits=digits) for bound in interval)
    return f"<br><small>{low} to {high}{unit}</small>"


def with_interval(counts: Summary, key: str, digits: int, unit: str = "") -> Cell:
    """Return a number of a summary with its interval below."""
    return number(counts[key], unit, digits) + between(counts.get(f"{key}_interval"), digits)


def _paper(rows: Mapping[int, object], counts: Summary, name: str, unit: str, digits: int, scale: float = 1.0) -> Cell:
    """Return a number of one of the paper's tables; a dash for all sets together."""
    value = getattr(rows.get(counts["intruders"] or 0), name, None)
    return number(None if value is None else scale * value, unit, digits)


def sets(summary: Summary) -> list[tuple[str, Summary]]:
    """Return a title and the counts of each number of intruders, and of all."""
    rows = [(f"{c['intruders']} intruder{'s' * (c['intruders'] > 1)}", c) for c in summary["by_intruders"]]
    return [*rows, ("all", summary["pooled"])]


def counts_table(summary: Summary, experiment: Experiment) -> str:
    """Return the numbers of figure 8 or 9, with how many encounters and intruders there were."""
    entered = "violations" if experiment.scoring.paper == "collision" else "loss_of_self_separation"
    title = "volume entered" if experiment.scoring.paper == "collision" else "self-separation lost"
    body = [
        [
            name,
            number(c["encounters"]),
            number(c["intruder_count"]),
            with_interval(c, "true_events", 0),
            number(c["correct"]),
            number(c["missed"]),
            with_interval(c, "false_alarms", 0),
            f"{c[entered]:,}{_count_bounds(c, entered)}",
        ]
        for name, c in sets(summary)
    ]
    head = ("", "encounters", "intruders", "true events", "correct", "missed", "false alarms", title)
    return table(head, body, total=True)


def _count_bounds(counts: Summary, key: str) -> Cell:
    # Bounds of a few events are no whole numbers.
    return between(counts[f"{key}_interval"], 1 if counts[key] < 100 else 0)


def detection_table(summary: Summary, experiment: Experiment) -> str:
    """Return table 3 or 4 of the paper beside ours, twin and in-run counts."""
    theirs = paper.SETS[experiment.scoring.paper].detection
    body = []
    for name, c in sets(summary):
        run = c["in_run"]
        body.append(
            [
                name,
                _paper(theirs, c, "p_cd", "", 3),
                with_interval(c, "p_cd", 4),
                with_interval(run, "p_cd", 4),
                _paper(theirs, c, "p_fa", "", 5),
                with_interval(c, "p_fa", 5),
                with_interval(run, "p_fa", 5),
                _paper(theirs, c, "safety_ratio", "", 3),
                with_interval(c, "safety_ratio", 4),
            ]
        )
    head = (
        "",
        "P_cd paper",
        "ours",
        "ours, in run",
        "P_fa paper",
        "ours",
        "ours, in run",
        "safety ratio paper",
        "ours",
    )
    return table(head, body, total=True)


def delay_table(summary: Summary, experiment: Experiment) -> str:
    """Return table 5 or 6 of the paper beside ours, with the signed delays."""
    theirs = paper.SETS[experiment.scoring.paper].delay
    body = []
    for name, c in sets(summary):
        d = c["delay_s"]
        body.append(
            [
                name,
                _paper(theirs, c, "mean_max", " s", 2),
                with_interval(d, "mean_max", 2, " s"),
                _paper(theirs, c, "p95", " s", 1),
                with_interval(d, "p95", 1, " s"),
                _paper(theirs, c, "max", " s", 1),
                number(d["max"], " s", 1),
                with_interval(d["signed"], "mean", 2, " s"),
                number(d["signed"]["min"], " s", 1),
            ]
        )
    head = (
        "",
        "mean of longest, paper",
        "ours",
        "95 %, paper",
        "ours",
        "max., paper",
        "ours",
        "signed mean",
        "earliest",
    )
    return table(head, body, total=True)


def cycle_table(summary: Summary, experiment: Experiment) -> str:
    """Return table 7 or 8 of the paper beside ours."""
    theirs = paper.SETS[experiment.scoring.paper].execution
    body = []
    for name, c in sets(summary):
        t = c["cycle_time_ms"]
        agreed = f"{t['agreed']:,} of {t['sampled']:,}" if t["sampled"] else _DASH
        body.append(
            [
                name,
                _paper(theirs, c, "mean_max", " ms", 0, 1e3),
                with_interval(t, "mean", 3, " ms"),
                _paper(theirs, c, "p95", " ms", 0, 1e3),
                number(t["p95"], " ms", 3),
                _paper(theirs, c, "max", " ms", 0, 1e3),
                number(t["max"], " ms", 3),
                number(t["cycles"]),
                agreed,
            ]
        )
    head = (
        "",
        "mean of longest, paper",
        "mean, ours",
        "95 %, paper",
        "ours",
        "max., paper",
        "ours",
        "cycles timed",
        "same as fast tier",
    )
    return table(head, body, total=True)


def detectors_table(summary: Summary) -> str:
    """Return what each detector reaches at its own threshold and at given P_cd."""
    levels = list(summary["ideal_detector"]["p_fa_at_p_cd"])
    body = [
        [
            escape(d["title"]),
            f"{d['threshold']:.3g}",
            with_interval(d, "p_cd", 4),
            with_interval(d, "p_fa", 5),
            *(number(d["p_fa_at_p_cd"][level], digits=5) for level in levels),
            number(d["p_fa_at_paper_p_cd"], digits=5),
        ]
        for d in summary["detectors"]
    ]
    ideal = summary["ideal_detector"]
    body.append(
        [
            "ideal detector",
            _DASH,
            _DASH,
            _DASH,
            *(number(ideal["p_fa_at_p_cd"][level], digits=5) for level in levels),
            number(ideal["p_fa_at_paper_p_cd"], digits=5),
        ]
    )
    head = ("", "threshold", "P_cd", "P_fa", *(f"P_fa at {level}" for level in levels), "at paper's P_cd")
    return table(head, body)


def readings_table(summary: Summary, experiment: Experiment) -> str:
    """Return P_cd and P_fa by each way of counting, the nearest to the paper's pair first."""
    p_cd, p_fa = paper.SETS[experiment.scoring.paper].mean_pair()
    body = [["paper, mean of its table", "as the paper counted", f"{p_cd:.4f}", f"{p_fa:.5f}", _DASH]]
    body += [
        [
            escape(r["detector"]),
            escape(r["counted"]),
            number(r["p_cd"], digits=4),
            number(r["p_fa"], digits=5),
            number(r["distance"], digits=2),
        ]
        for r in summary["readings"]
    ]
    return table(("detector", "counted in", "P_cd", "P_fa", "distance"), body, text_columns=2)


def separation_table(summary: Summary, experiment: Experiment) -> str:
    """Return how often each volume was entered, with and without avoidance, by all intruders of each set."""
    scoring = experiment.scoring
    size = f"{scoring.violation_radius_m:,.0f} m, ±{scoring.violation_half_height_m:,.1f} m"
    names = {
        "violations": f"collision volume ({size})",
        "violations_third": "a third of it",
        "violations_aircraft": f"aircraft size ({scoring.aircraft_radius_m:.1f} m, "
        f"±{scoring.aircraft_half_height_m:.2f} m)",
        "nmac": "NMAC (500 ft, ±100 ft)",
        "loss_of_self_separation": "self-separation, SARP (4000 ft, ±700 ft, 35 s)",
        "loss_of_self_separation_filtered": "the same with the miss-distance term",
        "loss_of_astm": "ASTM F3442 (2000 ft, ±250 ft)",
    }
    all_sets = sets(summary)
    body = []
    for key, title in names.items():
        pooled = summary["pooled"]
        row = [escape(title)]
        row += [f"{c[key]:,}<br><small>of {c[f'{key}_alone']:,}</small>" for _, c in all_sets[:-1]]
        row.append(f"{pooled[key]:,}{_count_bounds(pooled, key)}")
        row.append(f"{pooled[f'{key}_alone']:,}")
        body.append(row)
    head = ("intruders inside", *(name for name, _ in all_sets[:-1]), "all", "without avoidance")
    return table(head, body)


def risk_table(summary: Summary) -> str:
    """Return the risk ratios."""
    body = [
        [
            name,
            with_interval(c, "nmac_risk_ratio", 4),
            with_interval(c, "violation_risk_ratio", 4),
            with_interval(c, "well_clear_risk_ratio", 4),
            with_interval(c, "well_clear_filtered_risk_ratio", 4),
        ]
        for name, c in sets(summary)
    ]
    head = ("", "NMAC", "collision volume", "well clear lost (SARP)", "with the miss-distance term")
    return table(head, body, total=True)


def maneuvers_table(summary: Summary) -> str:
    """Return how often the ownship maneuvered, and what it cost."""
    body = []
    for name, c in sets(summary):
        m, path, duration = c["maneuvers"], c["extra_path_m"], c["duration_s"]
        body.append(
            [
                name,
                _percent(m["share"], m["share_interval"]),
                with_interval(m, "per_encounter", 3),
                _percent(m["unnecessary_share"], m["unnecessary_share_interval"]),
                number(m["least_bad"]),
                with_interval(path, "mean", 0, " m"),
                number(path["p95"], " m"),
                number(path["max"], " m"),
                f"{number(duration['mean'], ' s', 1)}<br><small>alone "
                f"{number(c['duration_alone_s']['mean'], ' s', 1)}</small>",
            ]
        )
    head = (
        "",
        "maneuvered",
        "maneuvers each",
        "unnecessary",
        "least bad",
        "extra path, mean",
        "95 %",
        "max.",
        "duration",
    )
    return table(head, body, total=True)


def _percent(share: float | None, interval: Sequence[float] | None) -> Cell:
    if share is None:
        return _DASH
    return number(100 * share, " %", 1) + between(interval and [100 * bound for bound in interval], 1)


def worst_table(encounters: Sequence[Summary]) -> str:
    """Return encounters, each with the command that replays it."""
    body = [
        [
            f"{e['intruders']}-{e['encounter']}",
            f"{e['separation_ratio']:.3f}",
            f"{number(e['horizontal_m'], ' m')}, {number(e['vertical_m'], ' m', 1)}<br><small>alone "
            f"{number(e['horizontal_alone_m'], ' m')}, {number(e['vertical_alone_m'], ' m', 1)}</small>",
            number(e["t_maneuver_s"], " s", 1),
            f"<code>{escape(e['command'])}</code>",
        ]
        for e in encounters
    ]
    return table(("encounter", "ratio", "horizontal, vertical", "maneuver at", "replay"), body)


def sensitivity_table(results: Sequence[Summary]) -> str:
    """Return the numbers of the sensitivity figure."""
    body = [
        [
            f"NACp {r['value']:g}" if r["parameter"] == "nacp" else f"{100 * r['value']:g} % lost",
            f"{r['intruders']}{', this experiment' if r['own'] else ''}",
            number(r["encounters"]),
            with_interval(r, "p_cd", 4),
            with_interval(r, "p_fa", 5),
            with_interval(r, "violations_per_encounter", 5),
            with_interval(r, "losses_per_encounter", 5),
            with_interval(r, "nmac_risk_ratio", 4),
            with_interval(r, "well_clear_risk_ratio", 4),
        ]
        for r in results
    ]
    head = (
        "",
        "intruders",
        "encounters",
        "P_cd",
        "P_fa",
        "violations each",
        "losses each",
        "NMAC risk ratio",
        "well-clear risk ratio",
    )
    return table(head, body, text_columns=2)


def criteria_table(summary: Summary) -> str:
    """Return what is wanted of the run and what it reached."""
    marks = {True: "met", False: "not met", None: "cannot be said"}
    body = [
        [
            escape(c["name"]),
            f"{c['sense']} {c['limit']:g}",
            _DASH if c["value"] is None else f"{c['value']:.4g}",
            marks[c["met"]] if c["met"] is not False else f'<b style="color:var(--bad)">{marks[False]}</b>',
        ]
        for c in summary["criteria"]
    ]
    return table(("", "wanted", "reached", ""), body, text_columns=2)


def settings_table(rows: Sequence[tuple[str, str]]) -> str:
    """Return names and values; plain text."""
    return table(("setting", "value"), [[escape(a), escape(b)] for a, b in rows], text_columns=2)
