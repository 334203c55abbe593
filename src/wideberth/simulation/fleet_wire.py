"""The datagrams of a fleet whose vehicles, and hub, are processes of their own."""

import struct
import zlib
from collections.abc import Iterable
from typing import NamedTuple

from wideberth.simulation.fleet_hub_kernels import N_COMMAND
from wideberth.simulation.fleet_messages import TOLD

# Magic, number of a vehicle, step; the numbers of a message or of a command; CRC-32 of all before.
_BODIES = {b"WBF2": struct.Struct(f"<4sHI{TOLD}d"), b"WBC2": struct.Struct(f"<4sHI{N_COMMAND}d")}
_MESSAGE, _COMMAND = _BODIES
_CHECK = struct.Struct("<I")
MESSAGE_BYTES, COMMAND_BYTES = (body.size + _CHECK.size for body in _BODIES.values())


class Datagram(NamedTuple):
    """What a datagram carries.

    Attributes
    ----------
    command : bool
        It is a command of the hub to a vehicle, else a vehicle's message.
    vehicle : int
        Number of the vehicle that sends the message, or is commanded.
    step : int
    values : tuple of float
        The TOLD numbers of a message, or the N_COMMAND of a command.
    """

    command: bool
    vehicle: int
    step: int
    values: tuple[float, ...]


def packed_message(vehicle: int, step: int, values: Iterable[float]) -> bytes:
    """Return the datagram of a vehicle's message."""
    return _packed(_MESSAGE, vehicle, step, values)


def packed_command(vehicle: int, step: int, values: Iterable[float]) -> bytes:
    """Return the datagram of a hub's command to a vehicle."""
    return _packed(_COMMAND, vehicle, step, values)


def _packed(magic: bytes, vehicle: int, step: int, values: Iterable[float]) -> bytes:
    body = _BODIES[magic].pack(magic, vehicle, step, *values)
    return body + _CHECK.pack(zlib.crc32(body))


def opened(data: bytes) -> Datagram | str:
    """Return what a datagram carries, or in words why it is none of a fleet."""
    if len(data) not in (MESSAGE_BYTES, COMMAND_BYTES):
        return "wrong length"
    body = data[: -_CHECK.size]
    if _CHECK.unpack(data[-_CHECK.size :])[0] != zlib.crc32(body):
        return "wrong check sum"
    form = _BODIES.get(data[:4])
    if form is None or form.size != len(body):
        return "no message of a fleet"
    magic, vehicle, step, *values = form.unpack(body)
    return Datagram(magic == _COMMAND, vehicle, step, tuple(values))
