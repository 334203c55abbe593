"""A vertical maneuver that goes with the advisory of the other aircraft's TCAS (CAS thesis, 3.4)."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from wideberth.avoidance.cas.pair_kernels import forbidden_rates
from wideberth.units import FOOT

UP, FREE, DOWN = 1, 0, -1


@dataclass(frozen=True, slots=True)
class ComplementaryManeuver:
    """Keeps a cylinder around an intruder clear by climbing or sinking, on the side that its TCAS leaves.

    Attributes
    ----------
    radius, half_height : float
        Of the cylinder, m. By default higher than the 850 ft within which TCAS gives traffic advisories.
    climb_rate_max, sink_rate_max : float
        Of the own aircraft, m/s.
    lookahead : float
        Conflicts further ahead are left alone, s. Earlier than TCAS alerts, so that its alert need not come.
    """

    radius: float = 4000 * FOOT
    half_height: float = 900 * FOOT
    climb_rate_max: float = 1000 * FOOT / 60
    sink_rate_max: float = 1000 * FOOT / 60
    lookahead: float = 60.0

    def decide(
        self, own: ArrayLike, intruder: ArrayLike, wanted_rate: float = 0.0, advised: int = FREE, held: int = FREE
    ) -> tuple[float, int]:
        """Return the climb rate to fly, m/s, and the side on which the intruder is passed.

        Parameters
        ----------
        own, intruder : array_like, shape (6,)
            Position and velocity, NED.
        wanted_rate : float
            Climb rate without the intruder, m/s.
        advised : int
            What the intruder's TCAS advises it: `UP`, `DOWN`, or `FREE` where nothing is known. The own aircraft then
            takes the other side, whatever it held.
        held : int
            The side of the decision before: it is kept unless the advisory forbids it.

        Returns
        -------
        rate, side
            `FREE` and the wanted rate where nothing has to be avoided.

        Raises
        ------
        ValueError
            If a state has another shape or is not finite.
        """
        x, other = np.asarray(own, float), np.asarray(intruder, float)
        if x.shape != (6,) or other.shape != (6,) or not (np.isfinite(x).all() and np.isfinite(other).all()):
            raise ValueError("own and intruder must be six finite numbers each")
        p, v = x[:3] - other[:3], x[3:] - other[3:]
        above, below, t = forbidden_rates(p[0], p[1], p[2], v[0], v[1], self.radius, self.half_height)
        if math.isnan(above) or t > self.lookahead:
            return wanted_rate, FREE
        # Relative velocities down to climb rates: what passes above is at least `least`, below at most `most`.
        least, most = -(above + other[5]), -(below + other[5])
        if math.isinf(least) and math.isinf(most):
            # Inside: away from the intruder's altitude.
            least, most = self.climb_rate_max, -self.sink_rate_max
        free = not most < wanted_rate < least
        side = -advised if advised != FREE else held
        if side == FREE:
            if free:
                return wanted_rate, FREE
            side = (
                UP
                if self._shortfall(least, most, UP, wanted_rate) <= self._shortfall(least, most, DOWN, wanted_rate)
                else DOWN
            )
        rate = max(wanted_rate, least) if side == UP else min(wanted_rate, most)
        return min(max(rate, -self.sink_rate_max), self.climb_rate_max), side

    def _shortfall(self, least: float, most: float, side: int, wanted: float) -> tuple[float, float]:
        """Return by how much the limits fall short on a side, and how far its rate is from the one wanted."""
        if side == UP:
            return max(least - self.climb_rate_max, 0.0), least - wanted
        return max(-self.sink_rate_max - most, 0.0), wanted - most
