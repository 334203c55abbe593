"""`wideberth send-traffic`: ADS-B traffic of a scenario or a recording onto the wire."""

from typing import Annotated

import typer

from wideberth.errors import InputError


def send_traffic(
    source: Annotated[
        str,
        typer.Argument(
            help="File of traffic (as for tracks), scenario with ADS-B (TOML), or recording of a run (MCAP)."
        ),
    ],
    format_: Annotated[
        str,
        typer.Option("--format", help="gdl90 or asterix (category 021) over UDP; sbs, beast or uat from a TCP server."),
    ] = "gdl90",
    to: Annotated[
        str | None,
        typer.Option(help="HOST:PORT to send datagrams to, or for the server to listen on; by default on loopback."),
    ] = None,
    traffic_format: Annotated[str, typer.Option(help="Format of a file of traffic.")] = "auto",
    speed: Annotated[float, typer.Option(help="Times real time; for load tests, as velocities then do not fit.")] = 1.0,
    duration: Annotated[float | None, typer.Option(help="Seconds of the source to send.")] = None,
    seed: Annotated[int | None, typer.Option(help="Of a scenario's errors, instead of its own.")] = None,
) -> None:
    """Send traffic in real time as a receiver would.

    Datagrams go to an address; for the other formats receivers connect to a port here. Ctrl-C ends it.
    """
    import itertools
    from pathlib import Path

    from wideberth.live.sender_outputs import Output, TcpOutput, UdpOutput, parse_host_port
    from wideberth.live.sender_progress import run_sender
    from wideberth.live.senders import DATAGRAM_FORMATS, TRAFFIC_PORTS, TrafficPackets

    packets = TrafficPackets(format_)
    if Path(source).suffix in (".toml", ".mcap"):
        from wideberth.live.sender_sources import reports_of_scans, scans_of

        pieces = reports_of_scans(*scans_of(Path(source), ownship=False, duration=duration, seed=seed))
    elif seed is not None:
        raise InputError(f"--seed {seed}: {source} has errors of its own; give a scenario")
    else:
        from wideberth.live.traffic_file import reports_of_file

        pieces = reports_of_file(source, traffic_format)
        if duration is not None:
            first = next(pieces, None)
            pieces = itertools.chain([first] if first else [], pieces)
            end = (first[0] if first else 0.0) + duration
            pieces = itertools.takewhile(lambda piece: piece[0] <= end, pieces)
    host, port = parse_host_port(to or str(TRAFFIC_PORTS[format_]))
    output: Output = UdpOutput(host, port) if format_ in DATAGRAM_FORMATS else TcpOutput(host, port)
    run_sender(pieces, packets.encode, len, output, speed, "reports", f"{source} has no ADS-B reports")
