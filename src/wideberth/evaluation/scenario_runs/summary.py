"""What came of the runs of a study, with 95 % intervals, as numbers and as a page."""

import shlex
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context

from wideberth import __version__
from wideberth.evaluation.montecarlo.intervals import paired_ratio, wilson
from wideberth.evaluation.report_shell import notes_footer, section, shell, table, write_files
from wideberth.evaluation.report_style import LIMIT, MUTED, OWNSHIP, RC, new_figure, png, svg
from wideberth.evaluation.scenario_runs.study import Row, Study

_SHOWN = 20
EVENTS = {
    "violation": ("violation_count", "violations of the collision volume"),
    "nmac": ("nmac_count", "near mid-air collisions (500 ft, 100 ft)"),
    "loss_of_well_clear": ("loss_of_well_clear_count", "losses of well clear"),
}


def summarise(study: Study, rows: Sequence[Row]) -> dict[str, Any]:
    """Return the numbers of a study, JSON types only.

    A run counts once for each kind of event, however many intruders have it: intruders of one run are not independent.

    Parameters
    ----------
    study : Study
    rows : sequence of dict
        As `study.run_study` gives them.
    """
    ways = ("with", "without") if study.both else ("without",)
    found: dict[str, Any] = {
        "scenario": study.source,
        "seed": study.seed,
        "runs": len(rows),
        "wideberth": __version__,
        "events": {name: _events(rows, key, ways) for name, (key, _) in EVENTS.items()},
    }
    for way in ways:
        flown = [row[way] for row in rows]
        paths = [one["path_length_m"] / one["mission_path_length_m"] for one in flown if one["mission_path_length_m"]]
        found[way] = {
            "missions_completed": sum(one["mission_completed"] for one in flown),
            "path_ratio": {"mean": float(np.mean(paths)), "max": float(np.max(paths))} if paths else None,
        }
        if way != ways[0]:
            # The twin has no pipeline.
            continue
        cycles = [one["step_time_ms"] for one in flown]
        found[way] |= {
            "reversals": sum(one["reversals"] for one in flown),
            "maneuvers_mean": float(np.mean([one["maneuvers"] for one in flown])),
            "runs_with_least_bad_maneuver": sum(one["least_bad_maneuvers"] > 0 for one in flown),
            "runs_with_unknown_alert": sum(one["unknown_alert_steps"] > 0 for one in flown),
            "step_time_ms": {
                "mean": float(np.mean([cycle["mean"] for cycle in cycles])),
                "max": float(np.max([cycle["max"] for cycle in cycles])),
            },
        }
    found["bad_runs"] = [_told(study, row) for row in rows if row[ways[0]]["violation_count"]] if study.both else []
    return found


def _events(rows: Sequence[Row], key: str, ways: Sequence[str]) -> dict[str, Any]:
    happened = {way: np.array([bool(row[way][key]) for row in rows]) for way in ways}
    entry: dict[str, Any] = {}
    for way in ways:
        count = int(happened[way].sum())
        entry[way] = {"runs": count, "share": count / len(rows), "interval": wilson(count, len(rows))}
    if len(ways) == 2:
        first, second = happened["with"], happened["without"]
        both = int((first & second).sum())
        without = int(second.sum())
        entry["risk_ratio"] = int(first.sum()) / without if without else None
        entry["risk_ratio_interval"] = paired_ratio(both, int((first & ~second).sum()), int((second & ~first).sum()))
    return entry


def _told(study: Study, row: Row) -> dict[str, Any]:
    command = ["wideberth", "run", study.source, "--seed", str(row["seed"])]
    for override in row["overrides"]:
        command += ["--set", override]
    return {
        "run": row["run"],
        "separation_ratio": row["with"]["separation_ratio"],
        "least_bad": row["with"]["least_bad_maneuvers"] > 0,
        "violated_without_avoidance": bool(row["without"]["violation_count"]),
        "command": shlex.join(command),
    }


def write_page(out: Path, study: Study, rows: Sequence[Row], summary: Mapping[str, Any]) -> Path:
    """Write ``report.html`` and ``separation.png``.

    Parameters
    ----------
    out : Path
    study : Study
    rows : sequence of dict
    summary : mapping
        As `summarise` makes it.

    Returns
    -------
    Path
        Of the page.

    Raises
    ------
    InputError
        If the folder cannot be written.
    """
    figure = _separations(study, rows)
    drawn = section(
        "Closest approach of each run",
        "The larger of horizontal separation / 500 ft and vertical / 100 ft at the closest intruder: below 1 is a near"
        " mid-air collision.",
        svg(figure, "Cumulative distribution of the closest approach"),
    )
    body = section("Events", "Runs with at least one; 95 % intervals.", _event_table(summary)) + drawn
    if summary["bad_runs"]:
        told = [
            [
                str(bad["run"]),
                f"{bad['separation_ratio']:.2f}",
                "yes" if bad["violated_without_avoidance"] else "no",
                "yes" if bad["least_bad"] else "no",
                f"<code>{escape(bad['command'])}</code>",
            ]
            for bad in summary["bad_runs"][:_SHOWN]
        ]
        head = ["run", "closest", "without avoidance too", "no free path found", "fly it again"]
        body += section("Runs with a violation", f"The first {_SHOWN} at most.", table(head, told, text_columns=5))
    violated = summary["events"]["violation"]["with" if study.both else "without"]["runs"]
    state = "good" if violated == 0 else "bad"
    headline = f"{violated} of {len(rows)} runs violate the collision volume"
    sentence = "with avoidance" if study.both else "without avoidance: nothing was avoided"
    notes = [f"wideberth {__version__}, seed {study.seed}; each run is flown with the same draw and noise both ways."]
    title = str(study.tables.get("name", study.source))
    page = shell(f"{title}, {len(rows)} runs", study.source, state, headline, sentence, body + notes_footer(notes))
    write_files(out, {"separation.png": png(figure), "report.html": page})
    return out / "report.html"


def _event_table(summary: Mapping[str, Any]) -> str:
    rows = []
    for name, (_, words) in EVENTS.items():
        entry = summary["events"][name]
        cells = [words]
        for way in ("without", "with"):
            if way in entry:
                low, high = entry[way]["interval"]
                cells.append(f"{entry[way]['runs']} <small>{low:.1%} to {high:.1%}</small>")
        if "risk_ratio" in entry:
            ratio, interval = entry["risk_ratio"], entry["risk_ratio_interval"]
            cells.append("–" if ratio is None else f"{ratio:.3f} <small>{interval[0]:.3f} to {interval[1]:.3f}</small>")
        rows.append(cells)
    head = ["event", "without avoidance", "with avoidance", "risk ratio"][: len(rows[0])]
    return table(head, rows)


def _separations(study: Study, rows: Sequence[Row]) -> Any:
    with rc_context(RC):
        figure = new_figure(9.6, 3.6)
        axes = figure.add_subplot()
        for way, colour in (("without", MUTED), ("with", OWNSHIP)):
            ratios = [row[way]["separation_ratio"] for row in rows if way in row]
            known = np.sort([ratio for ratio in ratios if ratio is not None])
            if known.size:
                share = np.arange(1, known.size + 1) / known.size
                axes.step(
                    np.maximum(known, 1e-2), share, where="post", color=colour, linewidth=2, label=f"{way} avoidance"
                )
        axes.axvline(1.0, color=LIMIT, linewidth=1.2, linestyle=(0, (4, 3)))
        axes.set_xscale("log")
        axes.set_xlabel("closest approach, in units of 500 ft and 100 ft")
        axes.set_ylabel("share of runs")
        axes.set_ylim(0.0, 1.02)
        axes.legend(loc="upper left")
    return figure
