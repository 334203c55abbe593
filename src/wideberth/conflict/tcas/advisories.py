"""What TCAS advises, and how a pilot flies it."""

import enum
import math
from dataclasses import dataclass

from wideberth.units import FOOT

GRAVITY = 9.80665
FOOT_PER_MINUTE = FOOT / 60.0


class Sense(enum.IntEnum):
    """On which side of the intruder to pass."""

    UP = 1
    DOWN = -1


def complementary_sense(sense: Sense) -> Sense:
    """Return the sense that goes with the other aircraft's: it climbs, we do not."""
    return Sense(-sense)


class VerticalAdvisory(enum.Enum):
    """A resolution advisory: its sense, and the vertical rate that it bounds (climbing positive, ft/min).

    The first ten are those of the CAS thesis, 3.4, in order of strength within each sense; the last two strengthen.
    """

    LIMIT_DESCENT_2000 = (Sense.UP, -2000.0)
    LIMIT_DESCENT_1000 = (Sense.UP, -1000.0)
    LIMIT_DESCENT_500 = (Sense.UP, -500.0)
    DO_NOT_DESCEND = (Sense.UP, 0.0)
    CLIMB = (Sense.UP, 1500.0)
    LIMIT_CLIMB_2000 = (Sense.DOWN, 2000.0)
    LIMIT_CLIMB_1000 = (Sense.DOWN, 1000.0)
    LIMIT_CLIMB_500 = (Sense.DOWN, 500.0)
    DO_NOT_CLIMB = (Sense.DOWN, 0.0)
    DESCEND = (Sense.DOWN, -1500.0)
    INCREASE_CLIMB = (Sense.UP, 2500.0)
    INCREASE_DESCENT = (Sense.DOWN, -2500.0)

    @property
    def sense(self) -> Sense:
        """Up or down."""
        return self.value[0]

    @property
    def rate(self) -> float:
        """The least climb (sense up) or the largest (down), m/s."""
        return self.value[1] * FOOT_PER_MINUTE

    @property
    def strength(self) -> float:
        """How much it asks for: larger is stronger within its sense, m/s."""
        return self.sense * self.rate

    @property
    def words(self) -> str:
        """What is said to the pilot."""
        return self.name.replace("_", " ").lower()

    def complied(self, rate: float) -> float:
        """Return the vertical rate that obeys, m/s: `rate` itself where it does already."""
        return max(rate, self.rate) if self.sense is Sense.UP else min(rate, self.rate)


INITIAL: dict[Sense, tuple[VerticalAdvisory, ...]] = {
    sense: tuple(a for a in VerticalAdvisory if a.sense is sense and not a.name.startswith("INCREASE"))
    for sense in Sense
}
"""The advisories that may come first, by sense, the weakest first."""

INCREASED = {Sense.UP: VerticalAdvisory.INCREASE_CLIMB, Sense.DOWN: VerticalAdvisory.INCREASE_DESCENT}


@dataclass(frozen=True, slots=True)
class Response:
    """How an advisory is flown (CAS thesis, 3.4): after a delay, s, with a vertical acceleration, m/s2."""

    delay: float
    acceleration: float


FIRST_RESPONSE = Response(5.0, 0.25 * GRAVITY)
LATER_RESPONSE = Response(2.5, 0.35 * GRAVITY)
"""To a stronger advisory or a reversal."""


@dataclass(frozen=True, slots=True)
class Advisory:
    """A resolution advisory in force.

    Attributes
    ----------
    advisory : VerticalAdvisory
    issued : float
        When this advisory replaced the one before, s.
    response : Response
    reversal : bool
        Whether the sense was turned round.
    """

    advisory: VerticalAdvisory
    issued: float
    response: Response = FIRST_RESPONSE
    reversal: bool = False


def height_gained(rate: float, wanted: float, t: float, response: Response) -> float:
    """Return the height gained in `t` s by one who flies at `rate` and changes to `wanted`, m/s, as by `response`.

    Closed form of a constant rate, a constant acceleration and a constant rate.
    """
    before = min(t, response.delay)
    change = wanted - rate
    turning = abs(change) / response.acceleration
    during = min(max(t - response.delay, 0.0), turning)
    after = max(t - response.delay - turning, 0.0)
    return rate * (before + during) + math.copysign(0.5 * response.acceleration, change) * during**2 + wanted * after
