"""`wideberth simulate-vehicle`: a vehicle behind MAVLink, to try things with."""

from pathlib import Path
from typing import Annotated

import typer

from wideberth.cli.errors import quantity
from wideberth.errors import InputError

_AIRFRAMES, _FAMILIES, _DYNAMICS = ("plane", "copter"), ("ardupilot", "px4"), ("own", "jsbsim")


def simulate_vehicle(
    mission: Annotated[
        Path,
        typer.Option(help="Mission: a scenario (.toml), a table (.csv), or a ground station's file (QGC WPL 110)."),
    ],
    vehicle: Annotated[str, typer.Option(help="plane or copter.")] = "copter",
    autopilot: Annotated[str, typer.Option(help="ardupilot or px4.")] = "ardupilot",
    dynamics: Annotated[
        str, typer.Option(help="own: our models; jsbsim: a Cessna 172 of JSBSim (plane only, 50 m/s).")
    ] = "own",
    connect: Annotated[
        list[str] | None,
        typer.Option(
            help="Where to send to, udp:HOST:PORT, or to be connected to, udpin:HOST:PORT or tcpin:HOST:PORT; may be "
            "repeated.  [default: udp:127.0.0.1:14550]"
        ),
    ] = None,
    speed: Annotated[str | None, typer.Option(help="Cruise speed, such as 20m/s.", show_default=False)] = None,
    wind: Annotated[
        str | None,
        typer.Option(help="Speed of the wind, such as 6m/s; by default the scenario's [wind].", show_default=False),
    ] = None,
    wind_from: Annotated[str, typer.Option(help="Where it comes from, clockwise from north.")] = "0deg",
    speed_up: Annotated[float, typer.Option(min=0.1, max=100.0, help="Simulated seconds for each real one.")] = 1.0,
    home_altitude: Annotated[str, typer.Option(help="Of the ground at home, above mean sea level.")] = "0m",
    signing_key: Annotated[str | None, typer.Option(help="Key of MAVLink signing.", show_default=False)] = None,
    tlog: Annotated[Path | None, typer.Option(help="Telemetry log to write.", show_default=False)] = None,
    until_done: Annotated[bool, typer.Option("--until-done", help="Stop when the mission is completed.")] = False,
) -> None:
    """Fly a mission behind MAVLink, as ArduPilot or PX4 would.

    docs/mavlink.md says what it understands.
    """
    if vehicle not in _AIRFRAMES:
        raise InputError(f"--vehicle {vehicle}: one of {', '.join(_AIRFRAMES)}")
    if autopilot not in _FAMILIES:
        raise InputError(f"--autopilot {autopilot}: one of {', '.join(_FAMILIES)}")
    if dynamics not in _DYNAMICS or (dynamics == "jsbsim" and vehicle != "plane"):
        raise InputError(f"--dynamics {dynamics}: own, or jsbsim with --vehicle plane")
    cruise = None if speed is None else quantity("--speed", speed, "speed")
    if cruise is not None and cruise <= 0.0:
        raise InputError(f"--speed {speed}: give a speed above 0")
    blown = None
    if wind is not None:
        from math import cos, sin

        import numpy as np

        speed_of_air, origin = quantity("--wind", wind, "speed"), quantity("--wind-from", wind_from, "angle")
        blown = -speed_of_air * np.array([cos(origin), sin(origin), 0.0])
    altitude = quantity("--home-altitude", home_altitude, "length")
    import contextlib
    import signal

    from wideberth.links.mavlink.modes import VehicleKind
    from wideberth.links.mavlink.wire import signing_key as key_of
    from wideberth.live.simulated_vehicle import SimulatedVehicle, parse_peers, serve
    from wideberth.live.vehicle_mission import read_vehicle_mission

    places = connect or ["udp:127.0.0.1:14550"]
    links = parse_peers(places)
    key = None if signing_key is None else key_of(signing_key)
    plan = read_vehicle_mission(mission, altitude)
    body = None
    if dynamics == "jsbsim":
        from wideberth.live.jsbsim_body import CRUISE_SPEED, JsbsimBody

        body, cruise = JsbsimBody(plan.frame, plan.wind if blown is None else blown), cruise or CRUISE_SPEED
    flown = SimulatedVehicle(VehicleKind(autopilot, vehicle), plan, cruise, body, key, blown)
    ended: list[int] = []
    signal.signal(signal.SIGTERM, lambda number, _frame: ended.append(number))
    typer.echo(f"{autopilot} {vehicle}, linked to {', '.join(places)}", err=True)
    with contextlib.ExitStack() as stack:
        stack.enter_context(contextlib.suppress(KeyboardInterrupt))
        log = None if tlog is None else stack.enter_context(tlog.open("wb"))
        serve(
            flown,
            links.peers,
            listen=links.listen,
            answer=links.answer,
            speed_up=speed_up,
            until=lambda: bool(ended) or (until_done and flown.is_finished),
            tlog=log,
            tell=lambda text: typer.echo(text, err=True),
        )
    typer.echo("mission completed" if flown.is_finished else "stopped before the mission was completed", err=True)
