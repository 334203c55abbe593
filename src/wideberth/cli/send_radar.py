"""`wideberth send-radar`: radar plots of a scenario or a recording onto the wire."""

from pathlib import Path
from typing import Annotated

import typer

from wideberth.errors import InputError


def send_radar(
    source: Annotated[Path, typer.Argument(help="Scenario with a radar (TOML), or recording of a run (MCAP).")],
    to: Annotated[str, typer.Option(help="UDP address, HOST:PORT.")] = "127.0.0.1:30100",
    format_: Annotated[
        str, typer.Option("--format", help="Packets: wideberth, thesis (section 5.1) or asterix (category 048).")
    ] = "wideberth",
    sensor: Annotated[str | None, typer.Option(help="Send only this radar, such as radar/1.")] = None,
    radar_id: Annotated[int, typer.Option(help="Number of the first radar; ASTERIX: 256 SAC + SIC.")] = 1,
    ownship: Annotated[
        str,
        typer.Option(
            help="Of a scenario: absent (radars on the ground do not see it), or mission (it flies its mission, "
            "without avoidance, in their picture; needed for a radar on it)."
        ),
    ] = "absent",
    speed: Annotated[float, typer.Option(help="Times real time; for load tests, as velocities then do not fit.")] = 1.0,
    duration: Annotated[float | None, typer.Option(help="Seconds of the source to send.")] = None,
    seed: Annotated[int | None, typer.Option(help="Of a scenario's errors, instead of its own.")] = None,
) -> None:
    """Send radar plots over UDP in real time.

    To be received by `wideberth fly` or anything else that knows the packets (docs/inputs.md). Ctrl-C ends it.
    """
    from wideberth.live.sender_outputs import UdpOutput, parse_host_port
    from wideberth.live.sender_progress import run_sender
    from wideberth.live.sender_sources import radar_scans, scans_of
    from wideberth.live.senders import RadarPackets

    if ownship not in ("absent", "mission"):
        raise InputError(f"--ownship {ownship}: use absent or mission")
    if not 0 <= radar_id < 65536:
        raise InputError(f"--radar-id {radar_id}: give 0 to 65535")
    packets = RadarPackets(format_, radar_id)
    scans, _ = scans_of(source, ownship=ownship == "mission", duration=duration, seed=seed)
    output = UdpOutput(*parse_host_port(to))
    run_sender(
        radar_scans(scans, sensor),
        lambda piece, t: [packets.encode(scan, t) for scan in piece],
        lambda piece: sum(len(scan.z) for scan in piece),
        output,
        speed,
        "plots",
        f"{source} has no radar" + (f" '{sensor}'" if sensor else ""),
    )
