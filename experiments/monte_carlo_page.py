"""The page that says what the Monte Carlo experiments came to."""

from collections.abc import Mapping
from typing import Any

_COLUMNS = (
    "true events",
    "P_cd",
    "P_fa",
    "delay mean of max / p95 / max, s",
    "violations, without avoidance",
    "with",
    "third",
    "aircraft",
    "SARP losses, without",
    "with",
    "same with miss filter, without",
    "with",
    "extra path, m",
)


def markdown(results: Mapping[str, Any]) -> str:
    """Return the page."""
    first, *others = results["runs"]
    name = results["experiment"]
    cpu = sum(block["cpu_s"] for block in first["block_times"])
    lines = [
        f"# {name}: {first['pooled']['encounters']:,} encounters",
        "",
        f"`{first['command']}`: {cpu:.0f} CPU seconds. Made by `make experiments`, which runs all that is below.",
        f"All numbers with their intervals and the detectors' curves: [{name}.json]({name}.json).",
        "",
        *_table("intruders", [(str(entry["intruders"]), entry) for entry in first["by_intruders"]], first["pooled"]),
        "",
        "| aim | reached | |",
        "| --- | ---: | --- |",
    ]
    for aim in first["criteria"]:
        met = "met" if aim["met"] else "**missed**"
        lines.append(f"| {aim['name']}, {aim['sense']} {aim['limit']:g} | {aim['value']:.4g} | {met} |")
    lines += ["", "## Detectors", "", "| detector | threshold | P_cd | P_fa | P_fa at P_cd 0.995 |", "| --- " * 5 + "|"]
    for detector in first["detectors"]:
        at = detector["p_fa_at_p_cd"]["0.995"]
        lines.append(
            f"| {detector['title']} | {detector['threshold']:.3g} | {detector['p_cd']:.4f} | {detector['p_fa']:.4f} "
            f"| {'never' if at is None else f'{at:.4f}'} |"
        )
    lines += ["", "## The same, read otherwise", "", *_table("run", [(run["title"], run["pooled"]) for run in others])]
    lines += ["", "| run | encounters | P_fa / ideal detector's at the same P_cd | aims missed |", "| --- " * 4 + "|"]
    for run in results["runs"]:
        missed = ", ".join(aim["name"] for aim in run["criteria"] if not aim["met"]) or "none"
        ratio = "" if run["p_fa_ratio"] is None else f"{run['p_fa_ratio']:.2f}"
        lines.append(f"| {run['title']} | {run['pooled']['encounters']:,} | {ratio} | {missed} |")
    lines += ["", *(f"- {run['title']}: `{run['command']}`" for run in others)]
    lines += ["", "## What entered the volume that is to be kept", ""]
    for run in results["runs"]:
        if run["entered_count"] > len(run["entered"]):
            lines.append(f"- {run['title']}: {run['entered_count']}, the first of them in the JSON")
            continue
        if not run["entered_count"]:
            lines.append(f"- {run['title']}: nothing")
        for entry in run["entered"]:
            lines.append(
                f"- {run['title']}, {entry['intruders']}-{entry['encounter']}, intruder {entry['intruder']}: "
                f"{entry['horizontal_m']:.0f} m and {entry['vertical_m']:.0f} m "
                f"(without avoidance {entry['horizontal_alone_m']:.0f} m and {entry['vertical_alone_m']:.0f} m); "
                f"`{entry['command']}`"
            )
    return "\n".join(lines) + "\n"


def _table(head: str, rows: list[tuple[str, Any]], pooled: Any = None) -> list[str]:
    lines = [f"| {head} | {' | '.join(_COLUMNS)} |", "| --- " + "| ---: " * len(_COLUMNS) + "|"]
    for title, entry in [*rows, *([("all", pooled)] if pooled is not None else [])]:
        delay = entry["delay_s"]
        cells = [
            f"{entry['true_events']:,}",
            _number(entry["p_cd"]),
            _number(entry["p_fa"]),
            " / ".join(_number(delay[key], 1) for key in ("mean_max", "p95", "max")),
            *(
                f"{entry[key]:,}"
                for key in (
                    *("violations_alone", "violations", "violations_third", "violations_aircraft"),
                    *("loss_of_self_separation_alone", "loss_of_self_separation"),
                    *("loss_of_self_separation_filtered_alone", "loss_of_self_separation_filtered"),
                )
            ),
            _number(entry["extra_path_m"]["mean"], 0),
        ]
        lines.append(f"| {title} | {' | '.join(cells)} |")
    return lines


def _number(value: float | None, digits: int = 4) -> str:
    return "–" if value is None else f"{value:.{digits}f}"
