"""What a flight says of itself once a second: one object for programs, a few lines for people."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from wideberth.types import AlertLevel, Maneuver, Mission, Ownship, SensorHealth, Snapshot, Threat, Track

NO_MISSION = "the autopilot has no mission: straight flight is assumed, and nothing is commanded"

_COLOURS = {"clear": "green", "unknown": "magenta", "preventive": "cyan", "corrective": "yellow", "warning": "bold red"}


def status_of(
    t: float,
    snapshot: Snapshot | None,
    missing: str,
    mission: Mission | None,
    inputs: Mapping[str, SensorHealth],
    autopilot: Mapping[str, Any],
    loop: Mapping[str, Any],
    events: Sequence[str],
) -> dict[str, Any]:
    """Return the status, JSON types only.

    Parameters
    ----------
    t : float
        Live time, s.
    snapshot : Snapshot or None
        Of the last step; None before the first.
    missing : str
        What is missing for the first step, in words.
    mission : Mission or None
        One that is assumed is told as none.
    inputs : mapping of str to SensorHealth
    autopilot, loop : mapping
        Of the autopilot and of the loop, JSON types already.
    events : sequence of str
        What happened since the last status.
    """
    state, why = "unknown", missing
    if snapshot is not None:
        state = snapshot.alert_state.name.lower()
        why = _why_unknown(snapshot, mission) if snapshot.alert_state == AlertLevel.UNKNOWN else ""
    return {
        "t": t,
        "state": state,
        "why": why,
        "threat": None if snapshot is None else _threat(snapshot),
        "tracks": 0 if snapshot is None else sum(not track.is_ownship for track in snapshot.tracks),
        "maneuver": None if snapshot is None else _maneuver(snapshot.maneuver),
        "mission": None
        if mission is None or mission.assumed
        else {"index": mission.index, "waypoints": len(mission.waypoints)},
        "ownship": None if snapshot is None else _ownship(snapshot.ownship),
        "autopilot": dict(autopilot),
        "inputs": {name: health_of(health) for name, health in inputs.items()},
        "loop": dict(loop),
        "events": list(events),
    }


def health_of(health: SensorHealth) -> dict[str, Any]:
    """Return a health as JSON types."""
    return {
        "state": health.state,
        "age_s": round(health.age, 3) if math.isfinite(health.age) else None,
        "rate_hz": round(health.rate, 2),
        "rejects": {cause: int(count) for cause, count in health.rejects.items()},
    }


def _why_unknown(snapshot: Snapshot, mission: Mission | None) -> str:
    reasons = [NO_MISSION] if mission is not None and mission.assumed else []
    reasons += [] if snapshot.ownship.state == "ok" else [f"ownship: {snapshot.ownship.state}"]
    reasons += [f"{name}: {health.state}" for name, health in snapshot.sensors.items() if health.state != "ok"]
    return "; ".join(reasons) or "not all around is watched, or a near aircraft was lost"


def _threat(snapshot: Snapshot) -> dict[str, Any] | None:
    """Return the worst threat, of equal ones the nearest; None where nobody is one."""
    tracks = {track.id: track for track in snapshot.tracks}
    known = [threat for threat in snapshot.threats if threat.level > AlertLevel.CLEAR and threat.track_id in tracks]

    def rank(threat: Threat) -> tuple[int, float]:
        return -threat.level, _distance(snapshot.ownship, tracks[threat.track_id])

    if not known:
        return None
    threat = min(known, key=rank)
    track = tracks[threat.track_id]
    return {
        "label": track.label,
        "level": threat.level.name.lower(),
        "distance_m": round(_distance(snapshot.ownship, track)),
        "above_m": round(float(snapshot.ownship.position[2] - track.position[2])),
        "t_cpa_s": _number(threat.t_cpa),
        "horizontal_miss_m": _number(threat.horizontal_miss),
        "time_to_loss_s": _number(threat.time_to_loss),
    }


def _distance(ownship: Ownship, track: Track) -> float:
    return math.hypot(*(track.position[:2] - ownship.position[:2]))


def _number(value: float) -> float | None:
    return round(float(value), 1) if math.isfinite(value) else None


def _maneuver(maneuver: Maneuver | None) -> dict[str, Any] | None:
    if maneuver is None:
        return None
    return {"t": maneuver.t, "reason": maneuver.reason, "least_bad": bool(maneuver.least_bad)}


def _ownship(ownship: Ownship) -> dict[str, Any]:
    north, east, down = (round(float(x), 1) for x in ownship.position)
    speed = round(math.hypot(*ownship.velocity[:2]), 1)
    return {"state": ownship.state, "north_m": north, "east_m": east, "altitude_m": -down, "speed_mps": speed}


def markup(status: Mapping[str, Any]) -> str:
    """Return a status as lines for people, in rich's markup."""
    from rich.markup import escape

    state = status["state"]
    head = f"[{_COLOURS[state]}]{state.upper()}[/]"
    if status["why"]:
        head += f" ({escape(status['why'])})"
    threat = status["threat"]
    if threat is not None:
        head += f"  {escape(threat['label'])} {threat['distance_m'] / 1e3:.1f} km, {threat['above_m']:+d} m"
        if threat["t_cpa_s"] is not None:
            head += f", closest in {threat['t_cpa_s']:.0f} s at {threat['horizontal_miss_m'] or 0:.0f} m"
    elif status["tracks"]:
        head += f"  {status['tracks']} aircraft, no threat"
    autopilot, loop = status["autopilot"], status["loop"]
    second = f"autopilot: {escape(autopilot['state'])}"
    if not loop["command"]:
        second += ", advisory only"
    if status["mission"] is not None:
        second += f", waypoint {status['mission']['index']} of {status['mission']['waypoints'] - 1}"
    if status["maneuver"] is not None:
        second += f", [bold]{escape(status['maneuver']['reason'])}[/]"
    latency = loop["step_ms"]
    second += f"  steps missed {loop['missed_steps']}"
    if latency["p99"] is not None:
        second += f", latency {latency['p50']:.1f} ms (p99 {latency['p99']:.1f})"
    return "\n".join([head, second, *_input_lines(status["inputs"])])


def _input_lines(inputs: Mapping[str, Mapping[str, Any]]) -> list[str]:
    from rich.markup import escape

    lines = []
    for name, health in inputs.items():
        age = "never" if health["age_s"] is None else f"{health['age_s']:.1f} s ago"
        rejects = sum(health["rejects"].values())
        state = health["state"] if health["state"] == "ok" else f"[magenta]{escape(health['state'])}[/]"
        lines.append(f"  {escape(name)}: {state}, {health['rate_hz']:.1f}/s, last {age}, {rejects} rejected")
    return lines
