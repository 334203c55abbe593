"""Serial ports as ends of links: raw bytes on a file descriptor; a port that is pulled out is opened again."""

import asyncio
import os
import termios
from collections.abc import Callable

from wideberth.live.addresses import Address
from wideberth.live.packet_queue import PacketQueue
from wideberth.live.transports import FIRST_WAIT, LONGEST_WAIT, UNSENT_MAX, Backoff, Endpoint, error_words

_READ = 65536


class SerialEndpoint(Endpoint):
    """A serial port, 8 data bits, no parity, no flow control."""

    def __init__(
        self,
        address: Address,
        queue: PacketQueue,
        now: Callable[[], float],
        waits: tuple[float, float] = (FIRST_WAIT, LONGEST_WAIT),
    ) -> None:
        super().__init__(address, queue, now)
        self._backoff = Backoff(*waits)
        self._fd: int | None = None
        self._unsent = b""
        self._heard = False
        self._cause = "closed"
        self._again: asyncio.TimerHandle | None = None

    async def open(self) -> None:
        """Open the port, now or as soon as it is there."""
        self._try()

    def _try(self) -> None:
        fd = None
        try:
            fd = os.open(self.address.host, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
            _make_raw(fd, self.address.port)
        except (OSError, termios.error, ValueError) as error:
            if fd is not None:
                os.close(fd)
            self._later(error_words(error))
            return
        self._fd, self._cause, self._heard = fd, "", False
        self.counters["connections"] += 1
        asyncio.get_running_loop().add_reader(fd, self._read)

    def _later(self, cause: str) -> None:
        """Try again after a while."""
        self._cause = cause
        self._again = asyncio.get_running_loop().call_later(self._backoff.next(self._heard), self._try)
        self._heard = False

    def _read(self) -> None:
        assert self._fd is not None
        try:
            data = os.read(self._fd, _READ)
        except BlockingIOError:
            return
        except OSError as error:
            self._lose(error_words(error))
            return
        if not data:
            self._lose("the port was closed")
            return
        self._heard = True
        self.queue.put(self._now(), data)

    def _lose(self, cause: str) -> None:
        self._shut()
        self.queue.put(self._now(), b"")
        self._later(cause)

    def send(self, data: bytes) -> bool:
        """Write bytes; what the port does not take at once follows when it does."""
        if self._fd is None:
            return self._not_sent("not open")
        if len(self._unsent) > UNSENT_MAX:
            return self._not_sent("the port takes no more")
        waiting = bool(self._unsent)
        self._unsent += data
        if not waiting:
            self._write()
        return True

    def _write(self) -> None:
        assert self._fd is not None
        loop = asyncio.get_running_loop()
        try:
            self._unsent = self._unsent[os.write(self._fd, self._unsent) :]
        except BlockingIOError:
            pass
        except OSError as error:
            self._lose(error_words(error))
            return
        if self._unsent:
            loop.add_writer(self._fd, self._write)
        else:
            loop.remove_writer(self._fd)

    def trouble(self) -> str:
        """Return why nothing can come."""
        return f"trying again ({self._cause})" if self._cause else ""

    def _shut(self) -> None:
        if self._fd is not None:
            loop = asyncio.get_running_loop()
            loop.remove_reader(self._fd)
            loop.remove_writer(self._fd)
            os.close(self._fd)
            self._fd, self._unsent = None, b""

    def close(self) -> None:
        """Close the port."""
        if self._again is not None:
            self._again.cancel()
        self._shut()
        self._cause = "closed"


def _make_raw(fd: int, baud: int) -> None:
    speed = getattr(termios, f"B{baud}", None)
    if speed is None:
        raise ValueError(f"this system has no speed of {baud} baud")
    iflag, oflag, cflag, lflag, _, _, characters = termios.tcgetattr(fd)
    iflag &= ~(
        termios.IGNBRK | termios.BRKINT | termios.PARMRK | termios.ISTRIP | termios.INLCR | termios.IGNCR
        | termios.ICRNL | termios.IXON | termios.IXOFF
    )  # fmt: skip
    oflag &= ~termios.OPOST
    lflag &= ~(termios.ECHO | termios.ECHONL | termios.ICANON | termios.ISIG | termios.IEXTEN)
    cflag &= ~(termios.CSIZE | termios.PARENB | termios.CSTOPB | termios.CRTSCTS)
    cflag |= termios.CS8 | termios.CREAD | termios.CLOCAL
    termios.tcsetattr(fd, termios.TCSANOW, [iflag, oflag, cflag, lflag, speed, speed, characters])
