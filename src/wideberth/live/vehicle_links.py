"""The links of a simulated vehicle: UDP to peers and with whoever calls, and TCP for ground stations that connect."""

import select
import socket
import time
from collections import Counter
from collections.abc import Callable

from wideberth.errors import InputError
from wideberth.live.transports import error_words

HEARD_FOR = 30.0
"""Who calls over UDP is sent to until it has been silent for so long, s."""

CALLERS_MAX = 16

_RECEIVE = 65536
_PIECES_MAX = 1000  # taken at once
_BUSY = 0.02  # s to wait where nothing can be waited for

Place = tuple[str, int]


def _nobody(_text: str) -> None:
    """Tell nobody."""


class VehicleLinks:
    """Sockets of a simulated vehicle; a context manager.

    No fault of a network ends it: each is told in words when it begins and when it is over, and what is sent is tried
    again with the next frame.

    Parameters
    ----------
    peers : list of tuple
        Hosts and ports that datagrams go to.
    listen : tuple, optional
        Host and port where clients may connect by TCP.
    answer : tuple, optional
        Host and port where datagrams are taken from anybody, who is then sent to for `HEARD_FOR` seconds.
    tell : callable
        Told in words what fails, and when it works again.

    Raises
    ------
    InputError
        If it cannot be listened there.

    Attributes
    ----------
    faults : Counter
        By link and cause.
    """

    def __init__(
        self,
        peers: list[Place],
        listen: Place | None = None,
        answer: Place | None = None,
        tell: Callable[[str], None] = _nobody,
    ) -> None:
        self.faults: Counter[str] = Counter()
        self._tell = tell
        self._failing: dict[str, str] = {}
        self._peers = peers
        self._callers: dict[Place, float] = {}
        self._answers = answer is not None
        self._udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._udp.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
        self._udp.setblocking(False)
        self._server: socket.socket | None = None
        self._clients: dict[socket.socket, str] = {}
        where = answer
        try:
            if answer is not None:
                self._udp.bind(answer)
            where = listen
            if listen is not None:
                self._server = socket.create_server(listen)
                self._server.setblocking(False)
        except OSError as error:
            self._udp.close()
            assert where is not None
            raise InputError(f"cannot listen on {_words(where)}: {error_words(error)}") from error

    def __enter__(self) -> "VehicleLinks":
        return self

    def __exit__(self, *_: object) -> None:
        for one in self._sockets():
            one.close()

    def receive(self) -> list[bytes]:
        """Return what has come, whole datagrams and pieces of streams."""
        pieces: list[bytes] = []
        for _ in range(_PIECES_MAX):
            try:
                data, caller = self._udp.recvfrom(_RECEIVE)
            except BlockingIOError:
                break
            except OSError as error:
                self._failed("udp", error)  # of an earlier datagram: nobody listens there yet
                continue
            pieces.append(data)
            if self._answers and caller not in self._peers:
                self._note(caller)
        self._accept()
        for client, name in tuple(self._clients.items()):
            try:
                data = client.recv(_RECEIVE)
            except BlockingIOError:
                continue
            except OSError as error:
                self._failed(name, error)
                data = b""
            if data:
                pieces.append(data)
            else:
                self._drop(client)
        return pieces

    def send(self, frame: bytes) -> None:
        """Send a frame to all; what a peer cannot take now is lost to it, as in the air."""
        for peer in (*self._peers, *self._called()):
            name = f"udp {_words(peer)}"
            try:
                self._udp.sendto(frame, peer)
            except BlockingIOError:
                continue
            except OSError as error:
                self._failed(name, error)
            else:
                self._works(name)
        for client, name in tuple(self._clients.items()):
            try:
                whole = client.send(frame) == len(frame)
            except BlockingIOError:
                continue
            except OSError as error:
                self._failed(name, error)
                whole = False
            if not whole:
                # Half a frame would spoil the stream.
                self._drop(client)

    def wait(self, seconds: float) -> None:
        """Wait until something comes, but not longer than that."""
        try:
            select.select(self._sockets(), [], [], seconds)
        except OSError as error:
            self._failed("waiting", error)
            time.sleep(min(seconds, _BUSY))

    def _note(self, caller: Place) -> None:
        """Remember who called; in a crowd the last ones."""
        self._callers.pop(caller, None)
        self._callers[caller] = time.monotonic()
        if len(self._callers) > CALLERS_MAX:
            del self._callers[next(iter(self._callers))]

    def _called(self) -> list[Place]:
        oldest = time.monotonic() - HEARD_FOR
        self._callers = {place: t for place, t in self._callers.items() if t >= oldest}
        return list(self._callers)

    def _accept(self) -> None:
        if self._server is None:
            return
        try:
            client, place = self._server.accept()
            client.setblocking(False)
            self._clients[client] = f"tcp {_words(place)}"
        except BlockingIOError:
            pass
        except OSError as error:
            self._failed("tcp", error)
        else:
            self._works("tcp")

    def _failed(self, name: str, error: OSError) -> None:
        words = error_words(error)
        self.faults[f"{name}: {words}"] += 1
        if self._failing.get(name) != words:
            self._failing[name] = words
            self._tell(f"{name}: {words}; going on")

    def _works(self, name: str) -> None:
        if self._failing.pop(name, None) is not None:
            self._tell(f"{name}: works again")

    def _sockets(self) -> list[socket.socket]:
        return [self._udp, *self._clients, *([] if self._server is None else [self._server])]

    def _drop(self, client: socket.socket) -> None:
        client.close()
        self._failing.pop(self._clients.pop(client), None)


def _words(place: Place) -> str:
    return f"{place[0]}:{place[1]}"
