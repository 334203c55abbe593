"""The links of a simulated vehicle: it sends to peers over UDP, and ground stations connect to it over TCP."""

import contextlib
import select
import socket

from wideberth.errors import InputError

_RECEIVE = 65536
_PIECES_MAX = 1000  # taken at once


class VehicleLinks:
    """Sockets of a simulated vehicle; a context manager.

    Parameters
    ----------
    peers : list of tuple
        Hosts and ports that datagrams go to.
    listen : tuple, optional
        Host and port where clients may connect by TCP.

    Raises
    ------
    InputError
        If it cannot be listened there.
    """

    def __init__(self, peers: list[tuple[str, int]], listen: tuple[str, int] | None = None) -> None:
        self._peers = peers
        self._udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._udp.setblocking(False)
        self._server: socket.socket | None = None
        self._clients: list[socket.socket] = []
        if listen is not None:
            try:
                self._server = socket.create_server(listen)
            except OSError as error:
                self._udp.close()
                raise InputError(f"cannot listen on {listen[0]}:{listen[1]}: {error.strerror or error}") from error
            self._server.setblocking(False)

    def __enter__(self) -> "VehicleLinks":
        return self

    def __exit__(self, *_: object) -> None:
        for one in self._sockets():
            one.close()

    def receive(self) -> list[bytes]:
        """Return what has come, whole datagrams and pieces of streams."""
        pieces: list[bytes] = []
        while len(pieces) < _PIECES_MAX:
            try:
                pieces.append(self._udp.recv(_RECEIVE))
            except BlockingIOError:
                break
            except ConnectionError:
                continue  # nobody listens there yet
        if self._server is not None:
            with contextlib.suppress(OSError):
                client, _ = self._server.accept()
                client.setblocking(False)
                self._clients.append(client)
        for client in tuple(self._clients):
            with contextlib.suppress(BlockingIOError):
                try:
                    data = client.recv(_RECEIVE)
                except ConnectionError:
                    data = b""
                if data:
                    pieces.append(data)
                else:
                    self._drop(client)
        return pieces

    def send(self, frame: bytes) -> None:
        """Send a frame to all; what a peer cannot take now is lost to it, as in the air."""
        for peer in self._peers:
            with contextlib.suppress(BlockingIOError, ConnectionError):
                self._udp.sendto(frame, peer)
        for client in tuple(self._clients):
            try:
                whole = client.send(frame) == len(frame)
            except BlockingIOError:
                continue
            except ConnectionError:
                whole = False
            if not whole:
                # Half a frame would spoil the stream.
                self._drop(client)

    def wait(self, seconds: float) -> None:
        """Wait until something comes, but not longer than that."""
        select.select(self._sockets(), [], [], seconds)

    def _sockets(self) -> list[socket.socket]:
        return [self._udp, *self._clients, *([] if self._server is None else [self._server])]

    def _drop(self, client: socket.socket) -> None:
        client.close()
        self._clients.remove(client)
