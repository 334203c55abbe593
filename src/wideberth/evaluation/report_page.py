"""The page of a run's report."""

from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from wideberth.evaluation.flight_log import Encounter, FlightLog
from wideberth.evaluation.report_shell import notes_footer, number, section, shell
from wideberth.evaluation.report_style import VOLUME_NAMES, clock

_EVENTS_MAX = 400
_INTRUDERS_MAX = 15


def verdict(summary: Mapping[str, Any]) -> tuple[str, str, str]:
    """Return how a run went: ``good``, ``warn`` or ``bad``, a headline and a sentence, in plain words."""
    nmac, losses = summary.get("nmac_count"), summary.get("loss_of_well_clear_count")
    volume, done = _volume_name(summary), summary.get("mission_completed")
    mission = "The mission was completed." if done else "The mission was not completed."
    if nmac is None or losses is None:
        return "warn", "Separation not scored", f"Nobody knows where the other aircraft truly were. {mission}"
    intruders = summary.get("intruders") or 0
    traffic = f"{_count(intruders, 'aircraft', 'aircraft')} around"
    if nmac:
        headline = f"{_count(nmac, 'near mid-air collision', 'near mid-air collisions')}"
        lost = f"Well clear ({volume}) was lost to {losses} of {traffic}. " if losses else ""
        return "bad", headline, lost + mission
    if losses:
        headline = f"Well clear lost {_count(losses, 'time', 'times')}, no near mid-air collision"
        return "warn", headline, f"Volume: {volume}; {traffic}. {mission}"
    headline = "Well clear of all traffic" if done else "Well clear of all traffic, mission not completed"
    return (
        ("good" if done else "warn"),
        headline,
        f"No loss of {volume}, no near mid-air collision; {traffic}. {mission}",
    )


def _volume_name(summary: Mapping[str, Any]) -> str:
    name = str(summary.get("well_clear_volume", "own"))
    return "the scenario's own volume" if name == "own" else VOLUME_NAMES.get(name, name)


def _count(number: int, one: str, many: str) -> str:
    return f"{number} {one if number == 1 else many}"


def page(
    title: str,
    subtitle: str,
    summary: Mapping[str, Any],
    log: FlightLog,
    near: Sequence[Encounter],
    pictures: Mapping[str, str],
    notes: Sequence[str],
) -> str:
    """Return the page.

    Parameters
    ----------
    title, subtitle : str
    summary : mapping
        As `RunMetrics.summary` makes it.
    log : FlightLog
    near : sequence of Encounter
    pictures : mapping of str to str
        Inline SVG: ``map``, ``altitude``, ``separation``, ``timeline``.
    notes : sequence of str
        What the reader must know, in words.
    """
    state, headline, sentence = verdict(summary)
    others = len(log.aircraft()) - len(near)
    faint = f" {_count(others, 'other aircraft', 'other aircraft')} farther away, drawn faint." if others else ""
    body = f"""{_tiles(summary, log)}
{
        section(
            "Map",
            "North is up. Numbers along the ownship's path are minutes and seconds since the start." + faint,
            pictures["map"],
        )
    }
<div class="two">{_decisions(summary, log)}{_volumes(summary)}</div>
{
        section(
            "Separation",
            "Each aircraft that came near; shaded while it is inside both distances of a volume.",
            pictures["separation"],
        )
    }
{section("Altitude", "The dot marks the closest approach of each aircraft.", pictures["altitude"])}
{section("Alerts", "How serious each threat looked to the ownship; bars grow with the level.", pictures["timeline"])}
{_intruders(summary, log)}
<div class="two">{_sensors(log)}{_times(summary, log)}</div>
{notes_footer(notes)}"""
    return shell(title, subtitle, state, headline, sentence, body)


def _distance(metres: float) -> str:
    return f"{metres / 1000:,.1f} km" if metres >= 1000 else f"{metres:,.0f} m"


def _tiles(summary: Mapping[str, Any], log: FlightLog) -> str:
    get = summary.get
    horizontal, vertical = get("min_horizontal_separation_m"), get("min_vertical_separation_m")
    closest = get("closest_intruder")
    flown, planned = get("path_length_m"), get("mission_path_length_m")
    longer = f"the mission's path: {planned / 1000:,.1f} km" if planned else ""
    tiles = [
        (
            "closest approach",
            f"{_distance(horizontal)} / {_distance(vertical)}"
            if horizontal is not None and vertical is not None
            else "–",
            f"horizontal / vertical, {log.label(closest)}" if closest else "",
        ),
        ("near mid-air collisions", number(get("nmac_count")), "within 500 ft and 100 ft"),
        ("losses of well clear", number(get("loss_of_well_clear_count")), _volume_name(summary)),
        (
            "maneuvers",
            number(get("maneuvers")),
            f"{number(get('reversals'))} reversals, {number(get('alerts'))} alerts",
        ),
        ("path flown", number(flown / 1000 if flown else None, " km", 1), longer),
        (
            "time",
            clock(log.own.t[-1] - log.own.t[0]) if log.own.rows else "–",
            f"{_count(get('intruders') or 0, 'aircraft', 'aircraft')} around",
        ),
    ]
    cells = "".join(
        f'<div class="tile"><span>{escape(name)}</span><b>{escape(value)}</b><br><small>{escape(more)}</small></div>'
        for name, value, more in tiles
    )
    return f'<div class="tiles">{cells}</div>'


def _decisions(summary: Mapping[str, Any], log: FlightLog) -> str:
    reasons = {span.maneuver.reason for span in log.maneuvers if span.maneuver.reason}
    items = [(t, text, any(reason in text for reason in reasons)) for t, text in log.events]
    told = " ".join(text for _, text in log.events)
    items += [(m.t_start, m.maneuver.reason, True) for m in log.maneuvers if m.maneuver.reason not in told]
    items.sort(key=lambda item: item[0])
    # The life of tracks is of use to few, and would bury the rest.
    decided = [item for item in items if not item[1].startswith("track ")]
    tracks = [item for item in items if item[1].startswith("track ")]
    off = summary.get("avoidance") is False
    body, text = "", "Avoidance was switched off." if off else "Nothing had to be decided."
    if decided:
        body, text = _list(decided, log), f"{_count(len(decided), 'event', 'events')}; maneuvers in bold."
    if tracks:
        count = _count(len(tracks), "event", "events")
        body += f"<details><summary>{count} in the life of tracks</summary>{_list(tracks, log)}</details>"
    if max(len(decided), len(tracks)) > _EVENTS_MAX:
        text += f" At most {_EVENTS_MAX} are shown; the recording holds all."
    return section("Decisions", text, body)


def _list(items: Sequence[tuple[float, str, bool]], log: FlightLog) -> str:
    t0 = log.own.rows[0][0]
    rows = "".join(
        f"<li{' class=m' if main else ''}><time>{clock(t - t0)}</time><span>{escape(text)}</span></li>"
        for t, text, main in items[:_EVENTS_MAX]
    )
    return f"<ol>{rows}</ol>"


def _volumes(summary: Mapping[str, Any]) -> str:
    volumes, counts = summary.get("volumes", {}), dict(summary.get("loss_of_well_clear_by_volume", {}))
    names = {**VOLUME_NAMES, "collision_volume": "scenario's collision volume"}
    counts["collision_volume"] = summary.get("violation_count")
    rows = []
    for key, count in counts.items():
        v = volumes.get(key, {})
        size = f"{v['dthr_m']:,.0f} m, ±{v['zthr_m']:,.0f} m" if v else ""
        times = ", ".join(f"{v[k]:g} s" for k in ("tthr_s", "tcoa_s") if v.get(k))
        mark = " ★" if key == summary.get("well_clear_volume") else ""
        rows.append(
            f"<tr><td>{escape(f'{names.get(key, key)}{mark}')}</td>"
            f"<td>{escape(', '.join(part for part in (size, times) if part))}</td>"
            f'<td class="n{" lost" if count else ""}">{number(count)}</td></tr>'
        )
    filter_text = (
        "Only pairs whose projected miss distance is within the horizontal threshold count."
        if summary.get("horizontal_miss_filter")
        else "No filter on the projected miss distance."
    )
    table = f'<table><tr><th>volume</th><th>size</th><th class="n">aircraft</th></tr>{"".join(rows)}</table>'
    text = f"Aircraft that were inside each volume at least once, on true states; ★ the scenario's own. {filter_text}"
    return section("Losses by volume", text, table)


def _intruders(summary: Mapping[str, Any], log: FlightLog) -> str:
    rows = summary.get("per_intruder", [])
    if not rows:
        return ""
    t0 = summary.get("start_time_s") or 0.0
    names = list(summary.get("loss_of_well_clear_by_volume", {}))
    head = "".join(f'<th class="n">{escape(VOLUME_NAMES.get(n, n).replace(" (ADS-B paper)", ""))}</th>' for n in names)
    body = []
    for row in rows[:_INTRUDERS_MAX]:
        losses = row["first_loss_time_s"]
        cells = "".join(
            f'<td class="n lost">{clock(losses[n] - t0)}</td>' if n in losses else '<td class="n">–</td>' for n in names
        )
        body.append(
            f"<tr><td><b>{escape(row['callsign'] or log.label(row['id']))}</b></td><td>{escape(row['id'])}</td>"
            f'<td class="n">{clock(row["closest_time_s"] - t0)}</td>'
            f'<td class="n">{number(row["horizontal_separation_m"], " m")}</td>'
            f'<td class="n">{number(row["vertical_separation_m"], " m")}</td>'
            f'<td class="n">{row["alerts"]}</td>{cells}</tr>'
        )
    text = (
        "Closest approach: the least of the larger of horizontal / 500 ft and vertical / 100 ft. First losses as times."
    )
    if len(rows) > _INTRUDERS_MAX:
        text += f" The closest {_INTRUDERS_MAX} of {len(rows)}; summary.json has all."
    table = (
        '<div class="scroll"><table><tr><th>aircraft</th><th>address</th><th class="n">closest at</th>'
        f'<th class="n">horizontal</th><th class="n">vertical</th><th class="n">alerts</th>{head}</tr>'
        f"{''.join(body)}</table></div>"
    )
    return section("Aircraft", text, table)


def _sensors(log: FlightLog) -> str:
    rows = []
    for name, health in log.sensors.items():
        rejects = ", ".join(f"{cause}: {count:,}" for cause, count in health.rejects.items() if count) or "none"
        rate = f"{health.rate:,.1f} a second"
        rows.append(
            f"<tr><td><b>{escape(name)}</b></td><td>{escape(health.state)}</td><td>{rate}</td><td>{escape(rejects)}</td></tr>"
        )
    if not rows:
        return section("Sensors", "No sensor reported its health.", "")
    table = f"<table><tr><th>sensor</th><th>state</th><th>messages</th><th>rejected</th></tr>{''.join(rows)}</table>"
    return section("Sensors", "At the end of the run.", table)


def _times(summary: Mapping[str, Any], log: FlightLog) -> str:
    step = summary.get("step_time_ms") or {}
    rows = [
        f'<tr><td>whole step</td><td class="n">{number(step.get("mean"), " ms", 2)}</td>'
        f'<td class="n">{number(step.get("p95"), " ms", 2)}</td>'
        f'<td class="n">{number(step.get("max"), " ms", 2)}</td></tr>'
    ]
    for stage in log.stage_times[0] if log.stage_times else ():
        values = sorted(1e3 * times.get(stage, 0.0) for times in log.stage_times)
        mean, p95 = sum(values) / len(values), values[min(len(values) - 1, int(0.95 * len(values)))]
        rows.append(
            f'<tr><td>{escape(stage)}</td><td class="n">{mean:.2f} ms</td><td class="n">{p95:.2f} ms</td>'
            f'<td class="n">{values[-1]:.2f} ms</td></tr>'
        )
    table = (
        '<table><tr><th>stage</th><th class="n">mean</th><th class="n">95 %</th><th class="n">most</th></tr>'
        f"{''.join(rows)}</table>"
    )
    return section("Step times", f"{_count(summary.get('steps') or 0, 'step', 'steps')}, CPU time of each.", table)
