"""What a vehicle tells others of itself (CAS thesis, 4.1.1)."""

import enum
from dataclasses import dataclass

from numpy.typing import ArrayLike


class Health(enum.IntEnum):
    """How far a vehicle can be relied on to fly as it should."""

    NOMINAL = 0
    DEGRADED = 1
    FAILED = 2


@dataclass(frozen=True, slots=True)
class VehicleMessage:
    """A message of one vehicle; all but sender, time and position may be missing.

    Nothing is checked here, as messages come from outside: `traffic_picture.TrafficPicture` counts what makes no sense.

    Attributes
    ----------
    sender : int
        Number of the vehicle.
    time : float
        Of the state, by the sender's clock, s.
    position, velocity, acceleration : array_like, shape (3,)
        Local NED, m, m/s, m/s2.
    position_sigma : float, optional
        Standard deviation of the position on each axis as the sender knows it, m (fewer satellites: larger).
    waypoints : array_like, shape (n, 4), optional
        Intent: when it will be where (time by the sender's clock, north, east, down).
    z_wanted : float, optional
        Position down that its guidance wants, m.
    cooperates : bool
        Whether it says that it avoids others.
    avoidance_rate : float, optional
        Velocity down that its avoidance commands now, m/s; None where it does not avoid.
    health : Health
    echo_time, echo_received : float, optional
        Time stamp of the newest message that it has of the receiver, by the receiver's clock, and when that came, by
        its own clock: with them the clocks are compared.
    """

    sender: int
    time: float
    position: ArrayLike
    velocity: ArrayLike | None = None
    acceleration: ArrayLike | None = None
    position_sigma: float | None = None
    waypoints: ArrayLike | None = None
    z_wanted: float | None = None
    cooperates: bool = True
    avoidance_rate: float | None = None
    health: Health = Health.NOMINAL
    echo_time: float | None = None
    echo_received: float | None = None
