"""`wideberth compare`: the summaries of two runs side by side."""

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from wideberth.errors import InputError

_TITLES = {
    "intruders": "intruders",
    "nmac_count": "near mid-air collisions",
    "loss_of_well_clear_count": "losses of well clear",
    "violation_count": "collision volume violations",
    "min_horizontal_separation_m": "least horizontal separation, m",
    "min_vertical_separation_m": "vertical separation then, m",
    "alerts": "alerts",
    "maneuvers": "maneuvers",
    "reversals": "reversals",
    "path_length_m": "path flown, m",
    "mission_path_length_m": "path of the mission, m",
    "mission_completed": "mission completed",
    "step_time_ms": "step time mean / p95 / max, ms",
    "seed": "seed",
}


def compare(
    first: Annotated[Path, typer.Argument(help="Folder of a run.", show_default=False)],
    second: Annotated[Path, typer.Argument(help="Folder of another run.", show_default=False)],
) -> None:
    """Print the summaries of two runs side by side, and where their reports are."""
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    folders = (first, second)
    summaries = [read_summary(folder) for folder in folders]
    table = Table(title="Two runs compared")
    table.add_column("")
    for folder in folders:
        table.add_column(escape(folder.name or str(folder)), justify="right")
    for key, title in _TITLES.items():
        table.add_row(title, *(escape(_text(s.get(key))) for s in summaries))
    volumes = [s.get("loss_of_well_clear_by_volume") for s in summaries]
    by_volume = [v if isinstance(v, dict) else {} for v in volumes]
    for name in dict.fromkeys(k for v in by_volume for k in v):
        table.add_row(f"  lost: {escape(name)}", *(escape(_text(v.get(name))) for v in by_volume))
    console = Console()
    console.print(table)
    for folder in folders:
        report = folder / "report.html"
        console.print(
            f"report: {report}" if report.exists() else f"no report in {folder}",
            highlight=False,
            markup=False,
            soft_wrap=True,
        )


def read_summary(folder: Path) -> dict[str, Any]:
    """Return the summary of a run.

    Raises
    ------
    InputError
        If the folder holds none, or it is not JSON.
    """
    path = folder / "summary.json"
    if not path.is_file():
        raise InputError(f"{folder}: no summary.json; give a folder that `wideberth run --out` wrote")
    try:
        summary = json.loads(path.read_bytes())
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: not valid JSON: {error}") from None
    if not isinstance(summary, dict):
        raise InputError(f"{path}: not a summary of a run")
    return summary


def _text(value: object) -> str:
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:,.2f}" if abs(value) < 100 else f"{value:,.0f}"
    if isinstance(value, dict):
        return " / ".join(_text(v) for v in value.values()) or "-"
    return str(value)
