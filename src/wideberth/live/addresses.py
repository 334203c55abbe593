"""Addresses of links: how to connect, to what, and where to listen."""

from dataclasses import dataclass

KINDS = ("udp", "udpout", "tcp", "tcpin", "serial")
LOOPBACK = "127.0.0.1"


@dataclass(frozen=True, slots=True)
class Address:
    """An address of a link.

    Attributes
    ----------
    kind : {"udp", "udpout", "tcp", "tcpin", "serial"}
        ``udp`` and ``tcpin`` listen, ``udpout`` and ``tcp`` connect.
    host : str
        Host, or path of the serial port.
    port : int
        Port, or baud of the serial port.
    """

    kind: str
    host: str
    port: int

    def __str__(self) -> str:
        return f"{self.kind}:{f'[{self.host}]' if ':' in self.host else self.host}:{self.port}"


def parse_address(text: str, default_kind: str = "udp") -> Address:
    """Return an address such as ``udp:127.0.0.1:14550``, ``serial:/dev/ttyUSB0:57600`` or ``127.0.0.1:30100``.

    Parameters
    ----------
    text : str
        A port alone is one of loopback, for those that listen.
    default_kind : str
        Kind of an address that names none.

    Raises
    ------
    ValueError
        If it is none of these.
    """
    kind, colon, rest = text.strip().partition(":")
    kind = {"udpin": "udp"}.get(kind, kind)
    if not (colon and kind in KINDS):
        kind, rest = default_kind, text.strip()
    host, _, number = rest.rpartition(":")
    host = host.strip("[]").removeprefix("//") or (LOOPBACK if kind in ("udp", "tcpin") else "")
    if kind == "serial":
        if host and number.isdecimal() and int(number) > 0:
            return Address(kind, host, int(number))
        raise ValueError(f"'{text}' is no serial port: write serial:/dev/ttyUSB0:57600, with the baud")
    # Port 0, of those that listen: any free one.
    lowest = 0 if kind in ("udp", "tcpin") else 1
    if host and number.isdecimal() and lowest <= int(number) < 65536:
        return Address(kind, host, int(number))
    raise ValueError(f"'{text}' is no address: write {kind}:HOST:PORT (kinds: {', '.join(KINDS)})")
