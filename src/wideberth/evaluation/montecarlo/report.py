"""The report of a Monte Carlo run: one self-contained page, the ADS-B paper's numbers beside ours."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from wideberth import __version__
from wideberth.evaluation.montecarlo import paper
from wideberth.evaluation.montecarlo import report_figures as figures
from wideberth.evaluation.montecarlo import report_tables as tables
from wideberth.evaluation.montecarlo.experiment import Experiment
from wideberth.evaluation.montecarlo.verdict import verdict
from wideberth.evaluation.montecarlo.worst import ENTERED_MAX
from wideberth.evaluation.report_shell import notes_footer, number, section, shell, write_files
from wideberth.evaluation.report_style import svg
from wideberth.units import FOOT, NAUTICAL_MILE

Summary = Mapping[str, Any]


def write_report(out: Path, summary: Summary, experiment: Experiment) -> Path:
    """Write ``report.html``.

    Parameters
    ----------
    out : Path
        A folder, made where it does not exist.
    summary : mapping
        As `summary.summarise` makes it; with ``sensitivity`` as `sensitivity.run_sensitivity` makes it, or without.
    experiment : Experiment

    Returns
    -------
    Path
        Of the page.

    Raises
    ------
    InputError
        If the folder cannot be written.
    """
    text = page(summary, experiment)
    write_files(out, {"report.html": text})
    return out / "report.html"


def page(summary: Summary, experiment: Experiment) -> str:
    """Return the page.

    Parameters
    ----------
    summary : mapping
    experiment : Experiment
    """
    theirs = paper.SETS[experiment.scoring.paper]
    detection, delay, execution = theirs.tables
    state, headline, sentence = verdict(experiment, summary)
    body = [
        _tiles(summary, experiment),
        section("What is wanted", "", tables.criteria_table(summary)),
        section(
            f"Events and detections (the paper's figure {theirs.figure})",
            "Events and detections in the twin run without avoidance, with the same noise; entered volumes in the run "
            "with avoidance. The scale is logarithmic.",
            svg(figures.counts_figure(summary, experiment), "Events and detections for each number of intruders")
            + tables.counts_table(summary, experiment),
        ),
        section(
            f"Probability of detection (table {detection})",
            "P_cd: correct detections for each event; P_fa: false alarms for each intruder that is no event. In run: "
            "events and detections counted while the ownship avoids, as the paper may have counted.",
            tables.detection_table(summary, experiment),
        ),
        section(
            "Detectors",
            "Each detector over all its thresholds, on logarithmic scales: up and to the left is better. The marks are "
            "at the thresholds in use. The ideal detector knows the velocity and has the same errors of position and "
            "altitude.",
            svg(figures.curves_figure(summary, experiment), "P_cd against P_fa of each detector")
            + tables.detectors_table(summary),
        ),
        section("The reading nearest to the paper", _nearest(summary), tables.readings_table(summary, experiment)),
        section(
            f"Delay of detection (table {delay})",
            "From the event to its detection, where both happened; early detections count as no delay, but for the "
            "signed values. Longest: the mean of each encounter's longest delay.",
            svg(figures.delay_figure(summary), "Distribution of the delay") + tables.delay_table(summary, experiment),
        ),
        section(
            "Separation",
            "On true states. The separation ratio is the larger of horizontal distance / radius and vertical distance "
            "/ half-height of the collision volume, at its least.",
            svg(figures.miss_figure(summary, experiment), "How close intruders came, with and without avoidance"),
        ),
        section(
            "Volumes entered",
            "Intruders that were inside at least once, with avoidance; small: of how many without. SARP is counted "
            "for all closing pairs, and below with the miss-distance term. " + _paper_entered(experiment),
            tables.separation_table(summary, experiment),
        ),
        section(
            "Risk ratios",
            "Intruders inside a volume with avoidance, for each that is inside without it; same noise.",
            tables.risk_table(summary),
        ),
        section(
            "Maneuvers",
            "Encounters with a maneuver, and what it cost: path flown beyond the straight one, where there was a "
            "maneuver. Least bad: maneuvers whose path still entered the hard volume. " + _needed(experiment),
            tables.maneuvers_table(summary),
        ),
        _worst(summary),
        _sensitivity(summary),
        section(
            f"Time of one decision cycle (table {execution})",
            "CPU time of estimation, detection and planning, on the full pipeline; the paper's times are of Matlab.",
            tables.cycle_table(summary, experiment),
        ),
        section("Settings and readings", "", tables.settings_table(_settings(summary, experiment))),
        notes_footer(_notes(summary)),
    ]
    title = f"{experiment.name}: {theirs.title}"
    subtitle = experiment.description or f"{summary['pooled']['encounters']:,} encounters"
    return shell(title, subtitle, state, headline, sentence, "\n".join(body))


def _tiles(summary: Summary, experiment: Experiment) -> str:
    p = summary["pooled"]
    collision = experiment.scoring.paper == "collision"
    entered = "violations" if collision else "loss_of_self_separation"
    title = "collision volume entered" if collision else "self-separation lost"
    m = p["maneuvers"]
    tiles = [
        ("encounters", number(p["encounters"]), f"{p['intruder_count']:,} intruders"),
        ("true events", number(p["true_events"]), f"{p['missed']:,} missed"),
        ("P_cd", number(p["p_cd"], digits=4), _range(p["p_cd_interval"], 4)),
        ("P_fa", number(p["p_fa"], digits=4), _range(p["p_fa_interval"], 4)),
        (title, number(p[entered]), f"of {p[f'{entered}_alone']:,} without avoidance"),
        ("NMAC risk ratio", number(p["nmac_risk_ratio"], digits=4), _range(p["nmac_risk_ratio_interval"], 4)),
        ("encounters with maneuver", number(100 * m["share"], " %", 1), _unnecessary(m)),
        ("decision cycle", number(p["cycle_time_ms"]["mean"], " ms", 2), _most(p["cycle_time_ms"])),
    ]
    cells = "".join(
        f'<div class="tile"><span>{name}</span><b>{value}</b><br><small>{more}</small></div>'
        for name, value, more in tiles
    )
    # Eight tiles: two rows of four.
    return f'<div class="tiles" style="grid-template-columns:repeat(auto-fit,minmax(220px,1fr))">{cells}</div>'


def _range(interval: list[float] | None, digits: int) -> str:
    return "" if interval is None else f"95 %: {interval[0]:.{digits}f} to {interval[1]:.{digits}f}"


def _unnecessary(maneuvers: Summary) -> str:
    share = maneuvers["unnecessary_share"]
    return "" if share is None else f"{100 * share:.1f} % of them unnecessary"


def _most(times: Summary) -> str:
    return "not measured" if times["max"] is None else f"at most {times['max']:.2f} ms"


def _needed(experiment: Experiment) -> str:
    if experiment.scoring.paper == "collision":
        return "A maneuver was unnecessary if without it no intruder would have come within 500 ft and 100 ft."
    return "A maneuver was unnecessary if without it self-separation would not have been lost."


def _paper_entered(experiment: Experiment) -> str:
    theirs = paper.SETS[experiment.scoring.paper]
    if experiment.scoring.paper == "self_separation":
        return f"The paper lost self-separation in none of {theirs.encounters:,} encounters."
    return (
        f"The paper, with five intruders: {theirs.entered_by_intruders[5]} of {theirs.true_events[5]:,} in the volume, "
        f"{paper.VIOLATIONS_THIRD_FIVE} in a third of it, {paper.VIOLATIONS_AIRCRAFT_FIVE} at aircraft size; "
        f"{theirs.entered} in all {theirs.encounters:,} encounters."
    )


def _nearest(summary: Summary) -> str:
    best = summary["readings"][0]
    if best["distance"] is None:
        return "There were too few events to tell."
    ideal = summary["ideal_detector"]["p_fa_at_paper_p_cd"]
    text = (
        f"Nearest to the paper's pair: {best['detector']}, counted in the {best['counted']}. The distance is the "
        "factor between both fractions missed plus that between both P_fa, in powers of ten."
    )
    if ideal is not None:
        text += f" With these errors, an ideal detector has a P_fa of {ideal:.5f} at the paper's P_cd."
    return text


def _worst(summary: Summary) -> str:
    worst = summary["worst_encounters"]
    text = "The closest with avoidance; separation of the closest intruder then, and small: of the same one without."
    closest = sorted(worst["closest"], key=lambda e: e["separation_ratio"])
    body = tables.worst_table(closest[:10])
    each = tables.worst_table(worst["closest"])
    body += f"<details><summary>The closest for each number of intruders</summary>{each}</details>"
    entered = worst["entered"]
    name = (
        "in which the collision volume was entered"
        if worst["entered_volume"] == "violation"
        else "in which self-separation was lost"
    )
    if entered:
        count = f"{len(entered)} encounter{'s' * (len(entered) > 1)}"
        body += f"<details><summary>{count} {name}</summary>{tables.worst_table(entered)}</details>"
        text += f" Below are those {name}, the closest {ENTERED_MAX} for each number of intruders at most."
    else:
        text += f" There is no encounter {name}."
    return section("Worst encounters", text, body)


def _sensitivity(summary: Summary) -> str:
    results = summary.get("sensitivity")
    title = "Sensitivity to accuracy and to message loss"
    if not results:
        text = (
            "Not measured. Give --sensitivity N to fly N encounters for each NACp and each fraction of messages lost."
        )
        return section(title, text, "")
    text = (
        "The same encounters with another position accuracy (NACp 8: 92.6 m at 95 %, 11: 3 m) or other losses of "
        "messages; bars are 95 % intervals."
    )
    body = svg(figures.sensitivity_figure(results), "Results against NACp and message loss")
    body += f"<details><summary>All numbers</summary>{tables.sensitivity_table(results)}</details>"
    return section(title, text, body)


def _settings(summary: Summary, experiment: Experiment) -> list[tuple[str, str]]:
    e, s = experiment.encounter, experiment.scoring
    sensor = experiment.scenario.sensor.config
    settings = summary["settings"]
    planner = experiment.scenario.avoidance
    rows = [
        ("experiment", f"{settings.get('experiment_path') or experiment.name}, digest {experiment.digest()}"),
        ("seed", str(settings.get("seed", experiment.seed))),
        ("avoidance", f"{planner.kind}" if settings.get("avoidance") is not False else "off"),
        (
            "encounters",
            f"{settings.get('encounters') or experiment.encounters:,} for each number of intruders; "
            f"circle of {e.circle_nmi:g} nmi, {e.points} starting points; ownship at {e.ownship_speed_kt:g} kt, "
            f"intruders at {e.intruder_speed_min_kt:g} to {e.intruder_speed_max_kt:g} kt, level, within "
            f"±{e.altitude_offset_ft:g} ft of the ownship's height",
        ),
        (
            "drawn anew until the relative velocity points into the circle",
            "speed and heading" if e.redraw == "speed_and_heading" else "heading",
        ),
        ("longest run", f"{e.duration_s:g} s"),
        (
            "altitude error",
            "one value for each aircraft" if experiment.errors.altitude == "bias" else "new in each message",
        ),
        (
            "position error at the start",
            "its stationary spread" if experiment.errors.start == "stationary" else "zero",
        ),
        (
            "threshold boundary",
            f"{s.threshold_radius_m / NAUTICAL_MILE:.3g} nmi ({s.threshold_radius_m / FOOT:,.0f} ft), "
            f"±{s.threshold_half_height_m / FOOT:,.0f} ft, {s.tau_s:g} s; look-ahead {s.lookahead_s:g} s",
        ),
        ("volume of events", _volume(s.volume_radius_m, s.volume_half_height_m)),
        ("the other reading of it", _volume(s.other_radius_m, s.other_half_height_m)),
        ("collision volume", _volume(s.violation_radius_m, s.violation_half_height_m)),
        (
            "default detector",
            f"alarm at a probability of entry of {s.alarm_probability:g}, rising to"
            f" {s.early_alarm_probability or s.alarm_probability:g} where it is {s.early_alarm_s:g} s ahead or more",
        ),
        ("algorithm 2", f"m1 = {s.m1:g}, m2 = {s.m2:g}"),
    ]
    if hasattr(sensor, "nacp"):
        rows.append(
            (
                "reported accuracy",
                f"NACp {sensor.nacp}, NIC {sensor.nic}, NACv {sensor.nacv}; {100 * sensor.loss:g} % of messages lost",
            )
        )
    shown = {"seed", "avoidance", "experiment_path", "digest", "version", "encounters", "overrides"}
    rows += [(key, str(value)) for key, value in settings.items() if key not in shown and _plain(value)]
    if settings.get("overrides"):
        rows.append(("changed from the file", ", ".join(map(str, settings["overrides"]))))
    return rows


def _plain(value: object) -> bool:
    return isinstance(value, str | int | float | bool)


def _volume(radius: float, half_height: float) -> str:
    wide = f"{radius / FOOT:,.0f} ft" if radius < NAUTICAL_MILE else f"{radius / NAUTICAL_MILE:g} nmi"
    return f"{wide}, ±{half_height / FOOT:,.0f} ft"


def _notes(summary: Summary) -> list[str]:
    methods = summary["interval_methods"]
    return [
        *summary["notes"],
        "Small print below a number is its 95 % interval. "
        + " ".join(f"{name.replace('_', ' ').capitalize()}: {text}." for name, text in methods.items()),
        f"wideberth {__version__}.",
    ]
