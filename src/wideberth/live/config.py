"""Settings of the inputs of a flight that every kind has, and of those that hear ADS-B."""

from typing import Annotated, Self

from pydantic import Field, model_validator

from wideberth.live.addresses import Address, parse_address
from wideberth.part_config import PartConfig
from wideberth.sensors.adsb.config import AdsbReceiverConfig


class LinkConfig(PartConfig):
    """Where an input comes from: one of the two is given.

    Attributes
    ----------
    listen : str or None
        Address to listen on, ``host:port``, or a port alone, which is that of loopback; ``tcpin:`` or ``udp:`` before
        it chooses how, where the kind's own way is another.
    connect : str or None
        Address to connect to, ``host:port``, or ``serial:/dev/ttyUSB0:115200``.
    silent_after_s : float
        Without a message for so long the input is called silent.
    """

    listen: str | None = None
    connect: str | None = None
    silent_after_s: Annotated[float, Field(gt=0.0, le=3600.0)] = 10.0

    @model_validator(mode="after")
    def _one_address(self) -> Self:
        if (self.listen is None) == (self.connect is None):
            raise ValueError('give either listen = "127.0.0.1:PORT" or connect = "HOST:PORT"')
        self.address("udp")
        return self

    def address(self, transport: str) -> Address:
        """Return the address, of a kind that speaks over ``"udp"`` or over ``"tcp"`` where it does not say."""
        if self.listen is not None:
            return parse_address(self.listen, "udp" if transport == "udp" else "tcpin")
        return parse_address(str(self.connect), "udpout" if transport == "udp" else "tcp")


class ReceiverInputConfig(LinkConfig, AdsbReceiverConfig):
    """A receiver of ADS-B: its link, and what is taken of what it hears."""
