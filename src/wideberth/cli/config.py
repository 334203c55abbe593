"""`wideberth config`: the configuration that a scenario comes to, defaults included."""

from pathlib import Path
from typing import Annotated

import typer


def config(
    scenario: Annotated[Path, typer.Argument(help="Scenario file (TOML).", show_default=False)],
    set_: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Set one key, such as mission.speed_mps=30. May be repeated."),
    ] = None,
) -> None:
    """Check a scenario and print its resolved configuration as TOML."""
    from wideberth.config import load_scenario
    from wideberth.toml_text import to_toml

    typer.echo(to_toml(load_scenario(scenario, set_ or ()).resolved()), nl=False)
