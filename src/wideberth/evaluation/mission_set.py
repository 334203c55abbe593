"""Found missions as files: one CSV each, and an index with what they meet."""

import csv
import json
import math
from dataclasses import asdict
from pathlib import Path
from typing import Any

from wideberth.evaluation.mission_search import FoundMission, SearchResult, SearchSettings

INDEX = "missions.json"
COLUMNS = ("lat_deg", "lon_deg", "altitude_m", "speed_mps", "start_time_s")


def write_mission_set(
    folder: Path, result: SearchResult, settings: SearchSettings, source: str, seed: int
) -> list[tuple[str, FoundMission]]:
    """Write the missions of a search into a folder.

    Parameters
    ----------
    folder : Path
        Made if it does not exist.
    result : SearchResult
    settings : SearchSettings
    source : str
        The recording searched, for the index.
    seed : int

    Returns
    -------
    list of (str, FoundMission)
        Name and mission of each file `<name>.csv`.

    Raises
    ------
    OSError
        If the folder cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    width = max(3, len(str(len(result.missions))))
    named = []
    inside = outside = 0
    for mission in result.missions:
        if mission.passes:
            inside += 1
            name = f"mission_{inside:0{width}d}"
        else:
            outside += 1
            name = f"outside_{outside:0{width}d}"
        write_mission_file(folder / f"{name}.csv", mission)
        named.append((name, mission))
    index = {
        "source": source,
        "seed": seed,
        "tries": result.tries,
        "rejected": dict(result.rejected),
        "settings": asdict(settings),
        "missions": [_entry(name, mission, settings) for name, mission in named],
    }
    (folder / INDEX).write_text(json.dumps(index, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    return named


def write_mission_file(path: Path, mission: FoundMission) -> None:
    """Write a mission as the CSV file that `wideberth run --mission` reads."""
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for latitude, longitude, altitude in mission.waypoints.tolist():
            writer.writerow(
                (
                    f"{math.degrees(latitude):.7f}",
                    f"{math.degrees(longitude):.7f}",
                    f"{altitude:.2f}",
                    f"{mission.speed:.4f}",
                    f"{mission.t_start:.3f}",
                )
            )


def _entry(name: str, mission: FoundMission, settings: SearchSettings) -> dict[str, Any]:
    volumes = sorted({volume for meeting in mission.meetings for volume in meeting.losses})
    return {
        "id": name,
        "file": f"{name}.csv",
        "start_time_s": mission.t_start,
        "duration_s": mission.duration,
        "length_m": round(mission.duration * mission.speed, 1),
        "altitude_m": round(float(mission.waypoints[0, 2]), 2),
        "course_deg": round(math.degrees(mission.course), 2),
        "aircraft_crossed": sum(math.isfinite(m.t_cross) for m in mission.meetings),
        "losses": {volume: len(mission.losses(volume)) for volume in volumes},
        "first_loss_s": min(mission.losses(settings.volume).values(), default=None),
        "filter": {"passed": mission.passes, "no_early_loss": mission.quiet, "seen_in_time": mission.seen},
        "aircraft": [
            {
                "address": m.address,
                "crossed_at_s": m.t_cross if math.isfinite(m.t_cross) else None,
                "losses_at_s": m.losses,
                "seen_in_time": m.seen,
            }
            for m in mission.meetings
        ],
    }
