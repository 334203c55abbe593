"""Links over the network on asyncio: what comes is put into a queue, and nobody waits for the other end."""

import abc
import asyncio
import os
from collections import Counter
from collections.abc import Callable
from typing import Any, cast

from wideberth.errors import InputError
from wideberth.live.addresses import Address
from wideberth.live.packet_queue import PacketQueue

FIRST_WAIT, LONGEST_WAIT = 0.5, 8.0
"""Before connecting again, s; doubled with each try that brought nothing."""

PEER_SILENT = 2.0
"""A listening UDP link answers another peer once its own has said nothing for so long, s."""

UNSENT_MAX = 1 << 16
"""Bytes that may wait to be sent; what comes on top is dropped."""


class Endpoint(abc.ABC):
    """One end of a link.

    Parameters
    ----------
    address : Address
    queue : PacketQueue
        Where what comes is put.
    now : callable
        Live time, s.

    Attributes
    ----------
    counters : Counter
        Connections made, packets that could not be sent, and errors by cause.
    """

    def __init__(self, address: Address, queue: PacketQueue, now: Callable[[], float]) -> None:
        self.address = address
        self.queue = queue
        self.counters: Counter[str] = Counter()
        self._now = now

    @abc.abstractmethod
    async def open(self) -> None:
        """Start to listen, or to connect for as long as it takes.

        Raises
        ------
        InputError
            If this machine refuses to listen there.
        """

    @abc.abstractmethod
    def send(self, data: bytes) -> bool:
        """Hand bytes to the system; return whether it took them. They are dropped and counted where it did not."""

    @abc.abstractmethod
    def trouble(self) -> str:
        """Return why nothing can come, in words; empty where it can."""

    @abc.abstractmethod
    def close(self) -> None:
        """End the link."""

    def _not_sent(self, why: str) -> bool:
        self.counters[f"not sent: {why}"] += 1
        return False

    def _cannot_listen(self, error: OSError) -> InputError:
        return InputError(f"{self.address}: cannot listen there: {error_words(error)}")


def error_words(error: BaseException) -> str:
    """Return what went wrong in a few words."""
    if isinstance(error, OSError) and error.errno:
        text = os.strerror(error.errno) if error.errno > 0 else error.strerror or ""
    else:
        text = str(error)
    return (text or type(error).__name__).lower()


class _Datagrams(asyncio.DatagramProtocol):
    def __init__(self, endpoint: "UdpEndpoint") -> None:
        self._endpoint = endpoint

    def datagram_received(self, data: bytes, addr: Any) -> None:
        self._endpoint.receive(data, addr)

    def error_received(self, exc: Exception) -> None:
        self._endpoint.counters[error_words(exc)] += 1


class UdpEndpoint(Endpoint):
    """UDP: ``udp`` listens and answers the peer that it hears, ``udpout`` speaks with one address."""

    def __init__(self, address: Address, queue: PacketQueue, now: Callable[[], float]) -> None:
        super().__init__(address, queue, now)
        self._transport: asyncio.DatagramTransport | None = None
        self._peer: Any = None
        self._heard = 0.0

    @property
    def port(self) -> int:
        """The port of this end."""
        assert self._transport is not None
        return int(self._transport.get_extra_info("sockname")[1])

    async def open(self) -> None:
        """Bind the socket."""
        where = (self.address.host, self.address.port)
        ends: dict[str, Any] = {"remote_addr": where} if self.address.kind == "udpout" else {"local_addr": where}
        try:
            made = await asyncio.get_running_loop().create_datagram_endpoint(lambda: _Datagrams(self), **ends)
        except OSError as error:
            raise self._cannot_listen(error) from error
        self._transport = made[0]

    def receive(self, data: bytes, peer: Any) -> None:
        """Take a datagram from an address."""
        t = self._now()
        # Whoever else sends here is heard, but does not take the answers away from a peer that is there.
        if peer == self._peer or self._peer is None or t - self._heard > PEER_SILENT:
            if self._peer is not None and peer != self._peer:
                self.counters["changes of peer"] += 1
            self._peer, self._heard = peer, t
        else:
            self.counters["datagrams of another peer"] += 1
        self.queue.put(t, data)

    def send(self, data: bytes) -> bool:
        """Send one datagram."""
        transport = self._transport
        if transport is None or transport.is_closing():
            return self._not_sent("closed")
        if self.address.kind == "udp" and self._peer is None:
            return self._not_sent("no peer yet")
        # Of the transports of asyncio itself; not declared for datagrams.
        if transport.get_write_buffer_size() > UNSENT_MAX:  # type: ignore[attr-defined]
            return self._not_sent("the system takes no more")
        transport.sendto(data, None if self.address.kind == "udpout" else self._peer)
        return True

    def trouble(self) -> str:
        """Return why nothing can come."""
        return "closed" if self._transport is None or self._transport.is_closing() else ""

    def close(self) -> None:
        """Close the socket."""
        if self._transport is not None:
            self._transport.close()


class _Stream(asyncio.Protocol):
    """A connection whose bytes go into the endpoint's queue; its end too, so that the reader can start afresh."""

    def __init__(self, endpoint: "TcpEndpoint | TcpServerEndpoint") -> None:
        self._endpoint = endpoint
        self.transport: asyncio.Transport | None = None
        self.heard = False
        self.ended = asyncio.get_running_loop().create_future()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self.transport = cast(asyncio.Transport, transport)
        self._endpoint.counters["connections"] += 1
        self._endpoint.connected(self)

    def data_received(self, data: bytes) -> None:
        self.heard = True
        self._endpoint.receive(data)

    def connection_lost(self, exc: Exception | None) -> None:
        self._endpoint.receive(b"")
        if not self.ended.done():
            self.ended.set_result("connection closed by the other end" if exc is None else error_words(exc))

    def send(self, data: bytes) -> str:
        """Return why the bytes are not sent; empty where they are."""
        if self.transport is None or self.transport.is_closing():
            return "not connected"
        if self.transport.get_write_buffer_size() > UNSENT_MAX:
            return "the other end takes no more"
        self.transport.write(data)
        return ""


class Backoff:
    """Growing waits before the next try."""

    def __init__(self, first: float, longest: float) -> None:
        self._first, self._longest = first, longest
        self._wait = first

    def next(self, success: bool) -> float:
        """Return how long to wait, s, after a try that brought something or not."""
        wait = self._first if success else self._wait
        self._wait = min(2.0 * wait, self._longest)
        return wait


class TcpEndpoint(Endpoint):
    """A TCP client that connects again, with growing waits, whenever the connection breaks."""

    def __init__(
        self,
        address: Address,
        queue: PacketQueue,
        now: Callable[[], float],
        waits: tuple[float, float] = (FIRST_WAIT, LONGEST_WAIT),
    ) -> None:
        super().__init__(address, queue, now)
        self._waits = waits
        self._stream: _Stream | None = None
        self._task: asyncio.Task[None] | None = None
        self._retry = 0.0
        self._state = "connecting"

    async def open(self) -> None:
        """Begin to connect, in the background."""
        self._task = asyncio.get_running_loop().create_task(self._connect())

    async def _connect(self) -> None:
        backoff = Backoff(*self._waits)
        loop = asyncio.get_running_loop()
        while True:
            self._state, heard = "connecting", False
            try:
                connection = loop.create_connection(lambda: _Stream(self), self.address.host, self.address.port)
                _, stream = await asyncio.wait_for(connection, timeout=5.0)
                self._state = ""
                cause = str(await stream.ended)
                heard = stream.heard
            except (OSError, TimeoutError) as error:
                cause = error_words(error)
            self._stream = None
            wait = backoff.next(heard)
            self._retry = self._now() + wait
            self._state = cause
            await asyncio.sleep(wait)

    def connected(self, stream: _Stream) -> None:
        """Take a new connection."""
        self._stream = stream

    def receive(self, data: bytes) -> None:
        """Take bytes of the connection."""
        self.queue.put(self._now(), data)

    def send(self, data: bytes) -> bool:
        """Send bytes on the connection."""
        why = "not connected" if self._stream is None else self._stream.send(data)
        return self._not_sent(why) if why else True

    def trouble(self) -> str:
        """Return why nothing can come."""
        if not self._state or self._state == "connecting":
            return self._state
        return f"reconnecting in {max(self._retry - self._now(), 0.0):.0f} s ({self._state})"

    def close(self) -> None:
        """End the connection and the tries."""
        if self._task is not None:
            self._task.cancel()
        if self._stream is not None and self._stream.transport is not None:
            self._stream.transport.close()


class TcpServerEndpoint(Endpoint):
    """A TCP server for one client at a time: who connects last is heard."""

    def __init__(self, address: Address, queue: PacketQueue, now: Callable[[], float]) -> None:
        super().__init__(address, queue, now)
        self._server: asyncio.Server | None = None
        self._stream: _Stream | None = None

    @property
    def port(self) -> int:
        """The port that is listened on."""
        assert self._server is not None
        return int(self._server.sockets[0].getsockname()[1])

    async def open(self) -> None:
        """Listen."""
        try:
            loop = asyncio.get_running_loop()
            self._server = await loop.create_server(lambda: _Stream(self), self.address.host, self.address.port)
        except OSError as error:
            raise self._cannot_listen(error) from error

    def connected(self, stream: _Stream) -> None:
        """Take a new client in the place of the one before."""
        if self._stream is not None and self._stream.transport is not None:
            self._stream.transport.abort()
        self._stream = stream
        self.queue.put(self._now(), b"")

    def receive(self, data: bytes) -> None:
        """Take bytes of a client."""
        self.queue.put(self._now(), data)

    def send(self, data: bytes) -> bool:
        """Send bytes to the client."""
        why = "no client yet" if self._stream is None else self._stream.send(data)
        return self._not_sent(why) if why else True

    def trouble(self) -> str:
        """Return why nothing can come."""
        gone = self._stream is None or self._stream.transport is None or self._stream.transport.is_closing()
        return "no client is connected" if gone else ""

    def close(self) -> None:
        """End server and client."""
        if self._server is not None:
            self._server.close()
        if self._stream is not None and self._stream.transport is not None:
            self._stream.transport.close()


def make_endpoint(address: Address, queue: PacketQueue, now: Callable[[], float]) -> Endpoint:
    """Return the end of a link of the address's kind, not yet open."""
    from wideberth.live.serial_port import SerialEndpoint

    kinds: dict[str, type[Endpoint]] = {
        "udp": UdpEndpoint,
        "udpout": UdpEndpoint,
        "tcp": TcpEndpoint,
        "tcpin": TcpServerEndpoint,
        "serial": SerialEndpoint,
    }
    return kinds[address.kind](address, queue, now)
