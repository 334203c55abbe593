"""Which sense and how strong: the separations that advisories would reach."""

from wideberth.conflict.tcas.advisories import (
    FIRST_RESPONSE,
    INITIAL,
    Response,
    Sense,
    VerticalAdvisory,
    height_gained,
)
from wideberth.conflict.tcas.alerts import Geometry


def separation(g: Geometry, own_rate: float, advisory: VerticalAdvisory, response: Response = FIRST_RESPONSE) -> float:
    """Return the height at the closest point on the advisory's own side, m; negative on the other side.

    Parameters
    ----------
    g : Geometry
    own_rate : float
        Own climb rate, m/s; the intruder is taken to keep its own.
    advisory : VerticalAdvisory
    response : Response
    """
    t = g.time_to_closest
    gained = height_gained(own_rate, advisory.complied(own_rate), t, response)
    intruder_rate = own_rate - g.height_rate
    return advisory.sense * (g.height + gained - intruder_rate * t)


def choose_sense(g: Geometry, own_rate: float, alim: float) -> Sense:
    """Return the sense: the one that does not cross the intruder's altitude where it reaches ALIM, else the better."""
    up = separation(g, own_rate, INITIAL[Sense.UP][-1])
    down = separation(g, own_rate, INITIAL[Sense.DOWN][-1])
    if g.height >= 0.0:
        return Sense.UP if up >= alim or up >= down else Sense.DOWN
    return Sense.DOWN if down >= alim or down >= up else Sense.UP


def choose_strength(
    g: Geometry, own_rate: float, sense: Sense, alim: float, response: Response = FIRST_RESPONSE
) -> VerticalAdvisory:
    """Return the weakest advisory of a sense that reaches ALIM, else the strongest."""
    for advisory in INITIAL[sense]:
        if separation(g, own_rate, advisory, response) >= alim:
            return advisory
    return INITIAL[sense][-1]
