"""The status line and the closing words of a sender."""

import time
from collections import deque
from collections.abc import Callable, Iterator
from typing import TypeVar

from rich.console import Console

from wideberth.errors import InputError
from wideberth.live.sender_outputs import Output
from wideberth.live.senders import Sent, send

T = TypeVar("T")
_REFRESH = 0.5
_WINDOW = 10


def run_sender(
    pieces: Iterator[tuple[float, list[T]]],
    encode: Callable[[list[T], float], list[bytes]],
    count: Callable[[list[T]], int],
    output: Output,
    speed: float,
    values: str,
    nothing: str,
) -> None:
    """Send with a status line until everything is sent or the user interrupts; then say what was sent.

    Parameters
    ----------
    pieces, encode, count, output, speed
        As for `senders.send`; the output is closed at the end.
    values : str
        What the values are called.
    nothing : str
        What to say where there is nothing to send.

    Raises
    ------
    InputError
        If the speed is not positive, or there is nothing to send.
    """
    if not 0.0 < speed <= 1e6:
        raise InputError(f"--speed {speed:g}: give a positive number")
    console = Console(stderr=True)
    latest = Sent()
    marks: deque[tuple[float, int, int]] = deque(maxlen=_WINDOW)
    with console.status(f"sending to {output.describe()}") as status:

        def told(sent: Sent) -> None:
            nonlocal latest
            latest = sent
            now = time.monotonic()
            if marks and now - marks[-1][0] < _REFRESH:
                return
            marks.append((now, sent.packets, sent.values))
            seconds = max(now - marks[0][0], 1e-9)
            rates = [(sent.packets - marks[0][1]) / seconds, (sent.values - marks[0][2]) / seconds]
            status.update(
                f"{output.describe()}: {sent.elapsed:.1f} s, {rates[0]:.1f} packets/s, {rates[1]:.1f} {values}/s"
                + (f", {sent.late} late" if sent.late else "")
                + "".join(f", {cause} {number}" for cause, number in output.counters.items())
            )

        interrupted = False
        try:
            latest = send(pieces, encode, count, output, speed=speed, told=told)
        except KeyboardInterrupt:
            interrupted = True
        finally:
            output.close()
    if not latest.packets and not interrupted:
        raise InputError(nothing)
    trouble = {**({"late": latest.late} if latest.late else {}), **output.counters}
    console.print(
        f"{'interrupted: ' if interrupted else ''}{latest.packets} packets with {latest.values} {values},"
        f" {latest.octets} bytes, {latest.elapsed:.1f} s sent"
        + "".join(f"; {cause} {number}" for cause, number in trouble.items()),
        highlight=False,
        markup=False,
    )
