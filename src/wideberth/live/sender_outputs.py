"""Where senders send: datagrams to an address, or a TCP server for any number of clients."""

import contextlib
import socket
from collections import Counter
from typing import Any, Protocol

from wideberth.errors import InputError

_CLIENTS = 32


class Output(Protocol):
    """Takes bytes.

    Attributes
    ----------
    counters : Counter
        What could not be sent, by cause.
    """

    counters: Counter[str]

    def send(self, data: bytes) -> None:
        """Hand bytes to the system; they are dropped and counted where it does not take them."""

    def describe(self) -> str:
        """Return in words where the bytes go."""

    def close(self) -> None:
        """Close all sockets."""


def parse_host_port(text: str) -> tuple[str, int]:
    """Return host and port of ``host:port``, or of a port alone on loopback.

    Raises
    ------
    InputError
        If it is neither.
    """
    host, _, port = text.strip().rpartition(":")
    if not port.isdecimal() or not 0 <= int(port) < 65536:
        raise InputError(f"'{text}' is no address: write HOST:PORT, such as 127.0.0.1:30100")
    return host.strip("[]") or "127.0.0.1", int(port)


class UdpOutput:
    """Sends each piece as a datagram."""

    def __init__(self, host: str, port: int) -> None:
        self.counters: Counter[str] = Counter()
        self._where: tuple[Any, ...]
        try:
            family, kind, protocol, _, self._where = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
        except OSError as error:
            raise InputError(f"{host}: {(error.strerror or str(error)).lower()}") from None
        self._socket = socket.socket(family, kind, protocol)
        with contextlib.suppress(OSError):
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
        self._socket.setblocking(False)

    def send(self, data: bytes) -> None:
        """Send one datagram."""
        try:
            self._socket.sendto(data, self._where)
        except OSError as error:
            self.counters[f"not sent: {(error.strerror or str(error)).lower()}"] += 1

    def describe(self) -> str:
        """Return in words where the bytes go."""
        return f"udp {self._where[0]}:{self._where[1]}"

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


class TcpOutput:
    """Listens, and sends everything to all who are connected; a client that does not read is cut off.

    Raises
    ------
    InputError
        If this machine refuses to listen there.
    """

    def __init__(self, host: str, port: int) -> None:
        self.counters: Counter[str] = Counter()
        try:
            family = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0][0]
            self._server = socket.create_server((host, port), family=family)
        except OSError as error:
            raise InputError(f"{host}:{port}: cannot listen there: {(error.strerror or str(error)).lower()}") from None
        self._server.setblocking(False)
        self._clients: list[socket.socket] = []

    @property
    def port(self) -> int:
        """The port that is listened on."""
        return int(self._server.getsockname()[1])

    @property
    def clients(self) -> int:
        """How many are connected."""
        return len(self._clients)

    def send(self, data: bytes) -> None:
        """Take new clients, and send to all."""
        self._accept()
        for client in tuple(self._clients):
            try:
                sent = client.send(data)
            except OSError:
                sent = -1
            if sent != len(data):
                # The rest of a half-sent piece cannot be taken back: the stream is broken.
                self.counters["clients gone" if sent < 0 else "clients cut off: they do not read"] += 1
                self._clients.remove(client)
                client.close()

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            while len(self._clients) < _CLIENTS:
                client, _ = self._server.accept()
                client.setblocking(False)
                self._clients.append(client)

    def describe(self) -> str:
        """Return in words where the bytes go."""
        return f"tcp port {self.port}, {self.clients} connected"

    def close(self) -> None:
        """Close the server and all connections."""
        for one in (self._server, *self._clients):
            one.close()
