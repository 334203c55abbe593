"""What the two ways to fly a maneuver share: by set-points (guided_flight) or by the mission (inserted_flight)."""

import enum
import math
from typing import Protocol

import numpy as np

from wideberth.types import FloatArray


class Phase(enum.Enum):
    """Where a flight of a maneuver is."""

    IDLE = "idle"
    TAKING = "taking"  # control is being taken
    FLYING = "flying"
    RESTORING = "restoring"  # mode and mission are being given back


class Flight(Protocol):
    """A way to fly a maneuver and to give control back afterwards.

    Attributes
    ----------
    phase : Phase
    lost : str
        Why control was lost to somebody else, in words; "" while it was not.
    failed : str
        Why the maneuver could not be flown, in words; "" while it could.
    """

    phase: Phase
    lost: str
    failed: str

    def fly(self, waypoints: FloatArray, times: FloatArray, t: float) -> None:
        """Fly a path (n, 3) in the local frame from now on, instead of the mission or the path before."""

    def end(self, t: float) -> None:
        """Give back the mode and the mission from before, and go on with the mission where it is."""

    def let_go(self, t: float) -> None:
        """Command nothing more: somebody else flies."""

    def step(self, t: float) -> None:
        """Send what is due."""


def same_path(a: tuple[FloatArray, FloatArray] | None, waypoints: FloatArray, times: FloatArray) -> bool:
    """Return whether a path that is flown is the one that is wanted."""
    return a is not None and np.array_equal(a[0], waypoints) and np.array_equal(a[1], times)


def turn_radius(airframe: str, speed: float) -> float:
    """Return the radius (m) of a turn as it is flown: with 35 deg of bank (plane), or 2 m/s2 sideways."""
    return speed * speed / (9.81 * math.tan(math.radians(35.0)) if airframe == "plane" else 2.0)
