"""The report of a fleet that avoids itself: altitudes, separation and commands over time, and each avoidance."""

import json
from html import escape
from pathlib import Path
from typing import Any

from matplotlib import rc_context
from matplotlib.figure import Figure

from wideberth import __version__
from wideberth.evaluation.report_shell import notes_footer, number, section, shell, table, write_files
from wideberth.evaluation.report_style import INK, LIMIT, RC, new_figure, png, svg, traffic_colour, traffic_dashes
from wideberth.simulation.fleet import FleetRun
from wideberth.simulation.fleet_config import FleetConfig
from wideberth.units import FOOT

_EVENTS_SHOWN = 200
_TOUCHES = 1e-6  # m: a tangent path meets the separation itself


def summary_of(config: FleetConfig, run: FleetRun) -> dict[str, Any]:
    """Return the numbers of a run, ready for JSON: SI, and the least separation in feet as well."""
    least = run.least_separation
    separation = max(controller.separation_m for controller in config.controllers)
    first, second = (int(k) for k in divmod(int(run.separation.argmin()), len(config.vehicles)))
    kept = least >= separation - _TOUCHES
    return {
        "name": config.name,
        "architecture": config.architecture,
        "least_separation_m": least,
        "least_separation_ft": least / FOOT,
        "separation_wanted_m": separation,
        "kept": kept,
        "verdict": f"least separation {least:.3f} m ({least / FOOT:.3f} ft) at"
        f" {run.separation_time[first, second]:.1f} s between {first} and {second}: the {separation / FOOT:.4g} ft "
        + ("are kept" if kept else "are violated"),
        "vehicles": [
            {
                "controller": controller.controller,
                "least_separation_m": float(run.separation[k].min()),
                "least_separation_ft": float(run.separation[k].min()) / FOOT,
                "drift_up_m": float(run.drift[k, 0]),
                "drift_down_m": float(run.drift[k, 1]),
                "aside_m": float(run.aside[k]),
                "late_m": float(run.late[k]),
                "avoidances": sum(event.vehicle == k for event in run.events),
                **{name: int(counts[k]) for name, counts in run.counters.items()},
            }
            for k, controller in enumerate(config.controllers)
        ],
        "avoidances": [
            {
                "vehicle": event.vehicle,
                "other": event.other,
                "reason": event.reason,
                "start_s": event.start,
                "end_s": event.end,
                "first_command_up_mps": -event.first_rate,
                "largest_command_up_mps": -event.largest_rate,
            }
            for event in run.events
        ],
        "avoidances_unrecorded": run.events_unrecorded,
    }


def altitude_figure(run: FleetRun) -> Figure:
    """Return altitude and commanded climb rate of each vehicle over time."""
    with rc_context(RC):
        figure = new_figure(9.6, 5.2)
        axes, rates = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
        count = run.states.shape[1]
        for k in range(count):
            style = {"color": traffic_colour(k), "linestyle": traffic_dashes(k)}
            axes.plot(run.time, -run.states[:, k, 2], label=f"vehicle {k}", linewidth=1.6, **style)
            rates.plot(run.time, -run.commands[:, k], linewidth=1.2, drawstyle="steps-post", **style)
        axes.set_ylabel("altitude, m")
        axes.set_title("Altitude")
        if count <= 10:
            figure.legend(ncols=min(count, 5), loc="outside lower center")
        rates.set_title("Commanded climb rate")
        rates.set_ylabel("m/s")
        rates.set_xlabel("time, s")
    return figure


def plan_figure(run: FleetRun) -> Figure:
    """Return the tracks seen from above, with where each vehicle started."""
    with rc_context(RC):
        figure = new_figure(6.4, 6.0)
        axes = figure.subplots()
        for k in range(run.states.shape[1]):
            north, east = run.states[:, k, 0], run.states[:, k, 1]
            axes.plot(
                east, north, label=f"vehicle {k}", linewidth=1.4, color=traffic_colour(k), linestyle=traffic_dashes(k)
            )
            axes.plot(east[:1], north[:1], marker="o", color=traffic_colour(k))
        axes.set_aspect("equal", adjustable="datalim")
        axes.set_title("Tracks from above; dots are the starts")
        axes.set_xlabel("east, m")
        axes.set_ylabel("north, m")
    return figure


def separation_figure(run: FleetRun, separation: float) -> Figure:
    """Return the least distance of any pair over time, and when each vehicle avoids."""
    with rc_context(RC):
        figure = new_figure(9.6, 4.6)
        axes, bars = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1.2))
        axes.plot(run.time, run.least, color=INK, linewidth=1.6)
        axes.axhline(separation, color=LIMIT, linewidth=1.2, linestyle="--")
        axes.annotate(
            f"protected, {separation:.4g} m",
            (run.time[0], separation),
            xytext=(4, 4),
            textcoords="offset points",
            color=LIMIT,
        )
        axes.set_ylim(bottom=0.0)
        axes.set_title("Distance of the nearest pair")
        axes.set_ylabel("m")
        bars.set_axisbelow(True)
        count = run.states.shape[1]
        for k in range(count):
            # From the log, which has no end of room for avoidances as the list of them has.
            bars.fill_between(
                run.time, k - 0.3, k + 0.3, where=run.avoiding[:, k].tolist(), step="post", linewidth=0,
                color=traffic_colour(k),
            )  # fmt: skip
        bars.set_ylim(count - 0.5, -0.5)
        bars.set_yticks(range(count) if count <= 10 else [])
        bars.set_title("Avoiding")
        bars.set_ylabel("vehicle")
        bars.set_xlabel("time, s")
    return figure


def write_cas_report(out: Path, config: FleetConfig, run: FleetRun, summary: dict[str, Any]) -> Path:
    """Write report.html, its pictures and cas.json into a folder, and return the page.

    Raises
    ------
    InputError
        If the folder cannot be written.
    """
    separation = summary["separation_wanted_m"]
    figures = {
        "plan": plan_figure(run),
        "altitude": altitude_figure(run),
        "separation": separation_figure(run, separation),
    }
    vehicles = [
        [
            str(k),
            escape(one["controller"]),
            number(one["least_separation_m"], " m", 3),
            number(one["drift_up_m"], " m", 2),
            number(one["drift_down_m"], " m", 2),
            number(one["aside_m"], " m", 2),
            number(one["late_m"], " m", 2),
            *(number(one[name]) for name in ("switches", "reversals", "received", "lost", "out_of_order", "absurd")),
        ]
        for k, one in enumerate(summary["vehicles"])
    ]
    events = [
        [
            number(one["start_s"], " s", 2),
            number(one["end_s"], " s", 2),
            str(one["vehicle"]),
            str(one["other"]),
            escape(one["reason"]),
            number(one["first_command_up_mps"], " m/s", 3),
            number(one["largest_command_up_mps"], " m/s", 3),
        ]
        for one in summary["avoidances"][:_EVENTS_SHOWN]
    ]
    left_out = len(summary["avoidances"]) - len(events) + run.events_unrecorded
    body = (
        section("Altitude", "", svg(figures["altitude"], "Altitude and commanded climb rate over time"))
        + section("Separation", "", svg(figures["separation"], "Least distance of any pair over time"))
        + section("Tracks", "", svg(figures["plan"], "Tracks from above"))
        + section(
            "Vehicles",
            "Drift is measured from the altitude wanted, aside and late from the straight track and the place on it;"
            " messages are counted by receiver.",
            table(
                [
                    *("vehicle", "controller", "least separation", "drift up", "drift down", "aside", "late"),
                    *("switches", "reversals", "received", "lost", "out of order", "absurd"),
                ],
                vehicles,
                text_columns=2,
            ),
        )
        + section(
            "Avoidances",
            f"{left_out} more are not shown." if left_out else "Commands are positive up.",
            table(["start", "end", "vehicle", "avoids", "because of", "first command", "largest"], events)
            if events
            else "<p>None.</p>",
        )
    )
    page = shell(
        config.name,
        config.description,
        "good" if summary["kept"] else "bad",
        f"Least separation {summary['least_separation_m']:.3f} m ({summary['least_separation_ft']:.3f} ft)",
        "; the protected zone is kept." if summary["kept"] else f"; {separation:.4g} m were to be kept.",
        body + notes_footer([f"wideberth {__version__}"]),
    )
    pictures: dict[str, str | bytes] = {f"{name}.png": png(figure) for name, figure in figures.items()}
    write_files(out, {**pictures, "report.html": page})
    write_cas_summary(out, summary)
    return out / "report.html"


def write_cas_summary(out: Path, summary: dict[str, Any]) -> Path:
    """Write cas.json into a folder, and return it.

    Raises
    ------
    InputError
        If the folder cannot be written.
    """
    write_files(out, {"cas.json": json.dumps(summary, indent=2, allow_nan=False)})
    return out / "cas.json"
