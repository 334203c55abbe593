"""The page of results of random encounters of helicopters that avoid each other."""

from typing import Any

import numpy as np

from experiments.mission_results import wilson
from wideberth.simulation.fleet import COUNTERS
from wideberth.units import FOOT

Found = dict[str, dict[str, dict[str, Any]]]
"""Results by kind of encounter and controller or architecture, as `cas_encounters.found_in` returns them."""

_HEAD = [
    "| {} | encounters with a violation | per 1,000 (95 %) | pairs | least, ft | drift median / largest, ft |"
    " aside median / largest, ft | switches per encounter |",
    "|---|---|---|---|---|---|---|---|",
]


def row_of(name: str, one: dict[str, Any]) -> str:
    """Return the row of a controller or architecture."""
    n, bad = len(one["least"]), int(np.count_nonzero(one["violated"]))
    low, high = (1000 * x for x in wilson(bad, n))
    drift, aside = one["drift"] / FOOT, one["aside"] / FOOT
    switches = one["counters"][COUNTERS.index("switches")]
    return (
        f"| {name} | {bad} | {1000 * bad / n:.1f} ({low:.1f} to {high:.1f}) | {one['violated'].sum()} |"
        f" {one['least'].min() / FOOT:.1f} | {np.median(drift):.1f} / {drift.max():.1f} |"
        f" {np.median(aside):.1f} / {aside.max():.1f} | {switches / n:.1f} |"
    )


def table_of(first: str, rows: dict[str, dict[str, Any]]) -> list[str]:
    """Return a table of results; `first` is the heading of its first column."""
    return [_HEAD[0].format(first), _HEAD[1], *(row_of(name, one) for name, one in rows.items())]


def _rate(one: dict[str, Any]) -> float:
    return 1000.0 * float(np.mean(one["violated"] > 0))


def aims_of(found: Found) -> list[str]:
    """Return what was aimed at, and what came of it."""
    pairs, cubes, layers = found["pairs"], found["cubes"], found["layers"]
    worse = np.count_nonzero((pairs["interval"]["violated"] > 0) & (pairs["bang_bang"]["violated"] == 0))
    lines = [
        f"- Pairs: `interval`, the default, violates in {np.count_nonzero(pairs['interval']['violated'])} of"
        f" {len(pairs['interval']['least']):,}, in {worse} of those that `bang_bang` keeps apart with the same messages"
        " (aim: none).",
    ]
    for words, one in (("the cube", cubes), ("the layer", layers)):
        bad = int(np.count_nonzero(one["interval"]["violated"]))
        times = f"{_rate(one['bang_bang']) / _rate(one['interval']):.0f} times fewer" if bad else "none"
        high = 1000 * wilson(bad, len(one["interval"]["least"]))[1]
        lines.append(
            f"- Ten in {words}: {_rate(one['bang_bang']):.1f} per 1,000 with `bang_bang` for the most critical pair,"
            f" {_rate(one['interval']):.1f} (95 %: at most {high:.1f}) with `interval`: {times} (aim: at least 10 times"
            " fewer)."
        )
    drifts = ", ".join(f"{one['interval']['drift'].max() / FOOT:.1f} ft ({words})" for words, one in found.items())
    lines.append(f"- The largest drift of `interval` from the altitude wanted: {drifts}.")
    return lines


def page_of(found: Found, speeds: dict[str, tuple[float | None, float]], seed: int) -> str:
    """Return the page of results.

    Parameters
    ----------
    found : Found
    speeds : dict
        By controller: s of a decision about a pair or None, and times real time with 100 vehicles.
    seed : int
    """
    pairs, cubes, layers = found["pairs"], found["cubes"], found["layers"]
    lines = [
        "# Cooperative avoidance in random encounters",
        "",
        f"Made by `python -m experiments.cas_encounters` (seed {seed}, not used for tuning). Default settings"
        " (docs/cas.md) with each controller, 20 Hz, the same messages for all: 0 to 4 s late (drawn for each"
        " encounter), 20 % lost, positions noisy by 1 ft per axis, nothing known before the first message. Speeds 1 to"
        " 5 ft/s. A violation is a distance below 12 ft. Drift is the largest distance from the altitude wanted, aside"
        " that from the straight track. 95 % intervals are Wilson's.",
        "",
        *aims_of(found),
    ]
    controllers = {
        kind: {name: one for name, one in by_label.items() if not name.startswith(("distributed", "centralised"))}
        for kind, by_label in found.items()
    }
    titles = {
        "pairs": f"{len(pairs['none']['least']):,} pairs that would meet 20 to 40 s after the start",
        "cubes": f"{len(cubes['none']['least']):,} encounters of ten vehicles in a cube of 300 ft",
        "layers": f"{len(layers['none']['least']):,} encounters of ten vehicles in a layer of 300 by 300 by 40 ft",
    }
    for kind, title in titles.items():
        lines += ["", f"## {title}", "", *table_of("controller", controllers[kind])]
    lines += [
        "",
        "## Who decides (3.1)",
        "",
        "`interval` on board of each vehicle with messages from each to each (distributed), the same with messages that"
        " a hub passes on (relayed), and on the hub, which gathers the states and sends commands (centralised). Delay"
        " and loss count on each of the hub's two ways. Outage: from 15 to 30 s after the start no message arrives.",
    ]
    for kind, by_label in found.items():
        rows = {name: one for name, one in by_label.items() if name not in controllers[kind]}
        lines += [
            "",
            f"### {kind.capitalize()}, {len(rows['distributed']['least']):,}",
            "",
            *table_of("architecture", rows),
        ]
    lines += [
        "",
        "## Speed, one core",
        "",
        "| controller | one decision about a pair in batch, us | 100 vehicles, all pairs at 20 Hz, times real time |"
        " of that for each pair and decision, with messages and motion, us |",
        "|---|---|---|---|",
    ]
    for name, (decision, factor) in speeds.items():
        alone = "–" if decision is None else f"{decision * 1e6:.3f}"
        lines.append(f"| {name} | {alone} | {factor:.0f} | {1e6 / (factor * 20 * 100 * 99):.3f} |")
    return "\n".join(lines) + "\n"
