"""What flying many missions came to: sums, confidence intervals, and the page that says so."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

Z95 = 1.959964  # two-sided 95 %
VOLUMES = ("nmac", "astm_f3442", "sarp")
NAMES = {"nmac": "NMAC", "astm_f3442": "ASTM F3442", "sarp": "SARP", "sarp_miss_filter": "SARP with miss filter"}


def wilson(successes: int, n: int) -> tuple[float, float]:
    """Return the 95 % Wilson interval of a probability, (0, 1) for no trial."""
    if n == 0:
        return 0.0, 1.0
    p, z2 = successes / n, Z95 * Z95
    middle = (p + z2 / (2 * n)) / (1 + z2 / n)
    half = Z95 / (1 + z2 / n) * math.sqrt(p * (1 - p) / n + z2 / (4 * n * n))
    return max(0.0, middle - half), min(1.0, middle + half)


def share(successes: int, n: int) -> dict[str, Any]:
    """Return a count with its share's 95 % interval."""
    return {"count": successes, "of": n, "interval_95": [round(x, 3) for x in wilson(successes, n)]}


def summarise(flown: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the sums over missions: `with` and `without` avoidance, missions that kept each volume, and the rest."""
    n = len(flown)
    result: dict[str, Any] = {"missions": n}
    for way in ("without", "with"):
        runs = [mission[way] for mission in flown]
        result[way] = {
            "kept": {v: share(sum(not run["lost"][v] for run in runs), n) for v in runs[0]["lost"]} if runs else {},
            "aircraft_lost": {v: sum(len(run["lost"][v]) for run in runs) for v in runs[0]["lost"]} if runs else {},
            "completed": share(sum(run["completed"] for run in runs), n),
        }
    if not n:
        return result
    runs = [mission["with"] for mission in flown]
    result["with"] |= {
        "maneuvers_per_mission": round(sum(run["maneuvers"] for run in runs) / n, 2),
        "reversals": sum(run["reversals"] for run in runs),
        "detour_ratio_mean": round(sum(run["detour_ratio"] for run in runs) / n, 3),
        "detour_ratio_max": round(max(run["detour_ratio"] for run in runs), 3),
        "step_ms_mean": round(sum(run["step_ms"]["mean"] for run in runs) / n, 3),
        "step_ms_p95_mean": round(sum(run["step_ms"]["p95"] for run in runs) / n, 3),
        "step_ms_max": round(max(run["step_ms"]["max"] for run in runs), 1),
        "flown_after_recording_s": round(sum(mission["flown_after_recording_s"] for mission in flown), 1),
        "flight_hours": round(sum(run["duration_s"] for run in runs) / 3600, 2),
    }
    return result


def markdown(results: Mapping[str, Any]) -> str:
    """Return the results as a page."""
    lines = [
        "# Missions among recorded traffic",
        "",
        f"Made by `{results['command']}`; recording `{results['traffic']}`, seed {results['seed']}.",
        f"{results['tries']} candidates were tried. Missions were chosen for the conflicts they meet without",
        "avoidance, never for what avoidance makes of them. Losses are counted on the recorded truth, without a miss",
        "filter unless the row says so; intervals are 95 % Wilson intervals of the share.",
        "",
    ]
    for name, title in (("filter", "Missions that pass the filter"), ("outside", "Missions that do not")):
        if results["sets"][name]["missions"]:
            lines += [f"## {title}", "", *_table(results["sets"][name]), ""]
    lines += ["## Failures and their causes", "", *_failures(results["missions"]), ""]
    return "\n".join(lines)


def _table(summary: Mapping[str, Any]) -> list[str]:
    n = summary["missions"]
    rows = [f"| of {n} missions | without avoidance | with avoidance |", "| --- | ---: | ---: |"]
    for volume in summary["with"]["kept"]:
        cells = [_share(summary[way]["kept"][volume]) for way in ("without", "with")]
        rows.append(f"| missions without loss of {NAMES[volume]} | {cells[0]} | {cells[1]} |")
    for volume in summary["with"]["aircraft_lost"]:
        cells = [summary[way]["aircraft_lost"][volume] for way in ("without", "with")]
        rows.append(f"| aircraft, loss of {NAMES[volume]} | {cells[0]} | {cells[1]} |")
    rows.append(
        f"| missions completed | {_share(summary['without']['completed'])} | {_share(summary['with']['completed'])} |"
    )
    w = summary["with"]
    rows += [
        f"| maneuvers per mission | | {w['maneuvers_per_mission']:.1f} |",
        f"| reversals, all missions | | {w['reversals']} |",
        f"| path flown / mission path, mean (max) | | {w['detour_ratio_mean']:.2f} ({w['detour_ratio_max']:.2f}) |",
        f"| hours flown (of these after the recording's end, s) | | {w['flight_hours']:.1f}"
        f" ({w['flown_after_recording_s']:.0f}) |",
        f"| step, CPU ms: mean / mean p95 / max | | {w['step_ms_mean']:.2f} / {w['step_ms_p95_mean']:.2f} /"
        f" {w['step_ms_max']:.0f} |",
    ]
    return rows


def _share(value: Mapping[str, Any]) -> str:
    low, high = value["interval_95"]
    return f"{value['count']} ({100 * low:.0f}-{100 * high:.0f} %)"


def _failures(missions: Sequence[Mapping[str, Any]]) -> list[str]:
    rows = []
    for mission in missions:
        for loss in mission["failures"]:
            who = loss.get("callsign") or loss["aircraft"] or "-"
            when = f"{loss['after_s']:.0f}"
            distance = loss.get("closest")
            near = f"{distance[0]:.0f} / {distance[1]:.0f}" if distance else "-"
            known = " / ".join(_seconds(loss.get(f"{what}_s_before")) for what in ("seen", "alerted", "avoided"))
            rows.append(
                f"| {mission['id']} | {loss['what']} | {who} | {when} | {near} | {known} |"
                f" {'; '.join(loss['causes'])} |"
            )
    if not rows:
        return ["None."]
    head = [
        "Least separation is horizontal / vertical in m; seen, alerted and avoided are s before the loss, the last two",
        "within its last 60 s.",
        "",
        "| mission | what | aircraft | after s | least separation | seen / alerted / avoided | why |",
        "| --- | --- | --- | ---: | ---: | ---: | --- |",
    ]
    return head + rows


def _seconds(value: float | None) -> str:
    return "-" if value is None else f"{value:.0f}"
