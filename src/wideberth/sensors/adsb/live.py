"""Live receivers over TCP, and those that send datagrams: the only sockets and the only wall clock of this step."""

import socket
import threading
import time
from collections import deque
from collections.abc import Callable

from wideberth.errors import InputError
from wideberth.sensors.adsb.formats import LISTENING, LIVE_READERS
from wideberth.sensors.adsb.readers import Reader
from wideberth.sensors.adsb.report import AdsbReport
from wideberth.types import SensorHealth

_FIRST_WAIT, _LONGEST_WAIT = 0.5, 30.0  # s
_RECEIVE = 65536
_TICK = 0.5  # s, how often a waiting thread looks whether it is to end
_MAX_WAITING = 200_000  # reports nobody has polled
_LOOPBACK = "127.0.0.1"


def parse_address(spec: str) -> tuple[str, str, int]:
    """Return format, host and port of an address such as ``beast://localhost:30005``.

    Without a host those that are listened for (``gdl90://:4000``) are bound to loopback.

    Raises
    ------
    InputError
        If the format is not a live one, or host or port are missing or wrong.
    """
    scheme, _, rest = spec.partition("://")
    host, _, port = rest.rpartition(":")
    if scheme not in LIVE_READERS:
        raise InputError(
            f"traffic '{spec}': a live receiver is one of {', '.join(f'{s}://' for s in LIVE_READERS)}host:port"
        )
    if not host and scheme in LISTENING:
        host = _LOOPBACK
    if not host or not port.isdecimal() or not 0 < int(port) < 65536:
        raise InputError(f"traffic '{spec}': give host and port, such as {scheme}://localhost:30005")
    return scheme, host.strip("[]"), int(port)


class LiveSource:
    """Reports of a receiver program, read by a thread that reconnects with growing waits.

    Parameters
    ----------
    name : str
        The address, for messages.
    reader : Reader
        Of the format that the receiver speaks.
    host : str
    port : int
    listen : bool
        Whether datagrams are waited for at host and port, instead of connecting to them.
    silent_after : float
        s without a message after which the source is called silent.
    first_wait, longest_wait : float
        s before the first try to reconnect; doubled with each further one up to the longest.
    clock : callable
        Gives the time of receipt, Unix s.
    """

    live = True

    def __init__(
        self,
        name: str,
        reader: Reader,
        host: str,
        port: int,
        *,
        listen: bool = False,
        silent_after: float = 10.0,
        first_wait: float = _FIRST_WAIT,
        longest_wait: float = _LONGEST_WAIT,
        clock: Callable[[], float] = time.time,
    ) -> None:
        self.name = name
        self._reader = reader
        self._address = (host, port)
        self._listen = listen
        self._silent_after = silent_after
        self._waits = (first_wait, longest_wait)
        self._clock = clock
        self._lock = threading.Lock()
        self._reports: deque[AdsbReport] = deque()
        self._arrivals: deque[tuple[float, int]] = deque()
        self._t_last: float | None = None
        self._t_opened = clock()
        self._state = "connecting"
        self._t_retry: float | None = None
        self._cause = ""
        self._connections = 0
        self._lost = 0
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._run, name=f"traffic {name}", daemon=True)
        self._thread.start()

    @property
    def exhausted(self) -> bool:
        """Return whether it was closed; a live source never ends by itself."""
        return self._ending.is_set()

    @property
    def counters(self) -> dict[str, int]:
        """Counts of messages by kind, of results, of rejections by cause, and of connections."""
        with self._lock:
            counts = self._reader.counters | {"connections": self._connections}
            return counts | ({"reports nobody took": self._lost} if self._lost else {})

    def poll(self, t: float) -> list[AdsbReport]:
        """Return the reports received up to time `t` (Unix s) and not returned before."""
        reports = []
        with self._lock:
            while self._reports and self._reports[0].t <= t:
                reports.append(self._reports.popleft())
        return reports

    def health(self, t: float) -> SensorHealth:
        """Return age, rate, rejects and state at time `t`.

        States: "ok", "connecting", "connected, nothing heard yet" (or "listening, ..."), "silent for 12 s",
        "reconnecting in 4 s (cause)", "closed".
        """
        with self._lock:
            while self._arrivals and self._arrivals[0][0] < t - 10.0:
                self._arrivals.popleft()
            rate = sum(count for _, count in self._arrivals) / 10.0
            age = float("inf") if self._t_last is None else max(t - self._t_last, 0.0)
            state = self._state
            if state == "connected":
                if self._t_last is None:
                    waited = t - self._t_opened
                    state = f"{'listening' if self._listen else 'connected'}, nothing heard yet"
                    if waited > self._silent_after:
                        state = f"silent for {waited:.0f} s"
                else:
                    state = "ok" if age <= self._silent_after else f"silent for {age:.0f} s"
            elif state == "waiting":
                state = f"reconnecting in {max((self._t_retry or t) - t, 0.0):.0f} s ({self._cause})"
            return SensorHealth(age, rate, self._reader.rejects, state)

    def close(self) -> None:
        """End the thread and the connection."""
        self._ending.set()
        self._thread.join(timeout=5.0)
        with self._lock:
            self._state = "closed"

    def _run(self) -> None:
        wait = self._waits[0]
        while not self._ending.is_set():
            with self._lock:
                self._state = "connecting"
            heard = False
            try:
                with self._open() as connection:
                    connection.settimeout(_TICK)
                    with self._lock:
                        self._state = "connected"
                        self._connections += 1
                    heard = self._receive(connection)
                cause = "connection closed by the receiver"
            except OSError as error:
                cause = (error.strerror or str(error) or type(error).__name__).lower()
            if heard:
                wait = self._waits[0]
            with self._lock:
                self._reader.restart()
                self._state, self._cause, self._t_retry = "waiting", cause, self._clock() + wait
            self._ending.wait(wait)
            wait = min(2 * wait, self._waits[1])

    def _open(self) -> socket.socket:
        if not self._listen:
            return socket.create_connection(self._address, timeout=5.0)
        family, kind, protocol, _, where = socket.getaddrinfo(*self._address, type=socket.SOCK_DGRAM)[0]
        listening = socket.socket(family, kind, protocol)
        try:
            listening.bind(where)
        except OSError:
            listening.close()
            raise
        return listening

    def _receive(self, connection: socket.socket) -> bool:
        """Read until the connection or the source is closed; return whether anything came."""
        heard = False
        while not self._ending.is_set():
            try:
                data = connection.recv(_RECEIVE)
            except TimeoutError:
                continue
            if not data and not self._listen:
                return heard
            heard = True
            t = self._clock()
            with self._lock:
                before = self._reader.counters.get("messages", 0)
                self._reports.extend(self._reader.feed(data, t))
                count = self._reader.counters.get("messages", 0) - before
                if count:
                    self._t_last = t
                    self._arrivals.append((t, count))
                while len(self._reports) > _MAX_WAITING:
                    self._reports.popleft()
                    self._lost += 1
        return heard
