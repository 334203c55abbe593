"""The memory of a TCAS: advisories from the first to clear of conflict, coordinated with the other aircraft's."""

from wideberth.conflict.tcas.advisories import (
    FIRST_RESPONSE,
    INCREASED,
    INITIAL,
    LATER_RESPONSE,
    Advisory,
    Response,
    Sense,
    VerticalAdvisory,
    complementary_sense,
)
from wideberth.conflict.tcas.alerts import Geometry, TcasAlert, altitude_test, range_test, tcas_alert
from wideberth.conflict.tcas.resolution import choose_sense, choose_strength, separation
from wideberth.conflict.tcas.thresholds import TcasThresholds
from wideberth.units import FOOT

WEAKENING_AFTER = 10.0  # s in force before an advisory is weakened
REVERSAL_GAIN = 100 * FOOT  # by which the other sense must be better
INCREASE_BEFORE = 4.0  # s before the closest point after which a stronger advisory would come too late
_ALERT_HELD = 2.0  # s that an alert must be over before clear of conflict


class TcasUnit:
    """One aircraft's TCAS II against one intruder, called once a second.

    Parameters
    ----------
    address : int
        Of the own aircraft: in a tie the lower one keeps its sense.

    Attributes
    ----------
    alert : TcasAlert
        Of the last step.
    advisory : Advisory or None
        In force.
    traffic_advisories, resolution_advisories : int
        How many were begun.
    """

    def __init__(self, address: int = 0) -> None:
        self.address = address
        self.alert = TcasAlert.NONE
        self.advisory: Advisory | None = None
        self.traffic_advisories = 0
        self.resolution_advisories = 0
        self._over_since: float | None = None
        self._reversed = False

    @property
    def sense(self) -> Sense | None:
        """The sense in force: what the other aircraft is told."""
        return self.advisory.advisory.sense if self.advisory is not None else None

    def step(
        self,
        t: float,
        g: Geometry,
        own_rate: float,
        thresholds: TcasThresholds,
        other_sense: Sense | None = None,
        other_address: int = 0,
    ) -> Advisory | None:
        """Take one step.

        Parameters
        ----------
        t : float
            Now, s.
        g : Geometry
            Of the intruder from the own aircraft.
        own_rate : float
            Own climb rate, m/s.
        thresholds : TcasThresholds
        other_sense : Sense, optional
            What the intruder's TCAS, or a drone that coordinates, has said it will do.
        other_address : int
            Of the intruder.

        Returns
        -------
        Advisory or None
            In force from now on.
        """
        before = self.alert
        now = tcas_alert(g, thresholds)
        if self.advisory is not None and not self._is_over(t, g, thresholds):
            now = TcasAlert.RESOLUTION
        if now is not TcasAlert.NONE and before is TcasAlert.NONE:
            self.traffic_advisories += 1
        self.alert = now
        if now is not TcasAlert.RESOLUTION:
            self.advisory, self._over_since, self._reversed = None, None, False
        elif self.advisory is None:
            self.resolution_advisories += 1
            sense = choose_sense(g, own_rate, thresholds.alim)
            if other_sense is not None:
                sense = complementary_sense(other_sense)
            self.advisory = Advisory(choose_strength(g, own_rate, sense, thresholds.alim), t)
        else:
            self._revise(t, g, own_rate, thresholds, self.advisory, other_sense, other_address)
        return self.advisory

    def _is_over(self, t: float, g: Geometry, thresholds: TcasThresholds) -> bool:
        """Return whether the intruder has passed, or its range and altitude have not alerted for a while."""
        ra = thresholds.ra
        if ra is None or (g.range_rate > 0.0 and not range_test(g, ra)):
            return True
        if range_test(g, ra) and (altitude_test(g, ra) or abs(g.height) < thresholds.alim):
            self._over_since = None
            return False
        if g.range_rate < 0.0 and g.miss <= thresholds.hmd:
            # The advisory itself has opened the altitudes: it stays until the closest point.
            return False
        if self._over_since is None:
            self._over_since = t
        return t - self._over_since >= _ALERT_HELD

    def _revise(
        self,
        t: float,
        g: Geometry,
        own_rate: float,
        thresholds: TcasThresholds,
        held: Advisory,
        other_sense: Sense | None,
        other_address: int,
    ) -> None:
        """Keep, strengthen, weaken or reverse the advisory in force."""
        alim, sense = thresholds.alim, held.advisory.sense
        if other_sense is sense and self.address > other_address:
            self._issue(
                t, choose_strength(g, own_rate, complementary_sense(sense), alim, LATER_RESPONSE), reversal=True
            )
            return
        if g.range_rate >= 0.0:
            return
        remaining = Response(max(held.response.delay - (t - held.issued), 0.0), held.response.acceleration)
        expected = separation(g, own_rate, held.advisory, remaining)
        strongest = INITIAL[sense][-1]
        if expected >= alim:
            weaker = choose_strength(g, own_rate, sense, alim, FIRST_RESPONSE)
            if t - held.issued >= WEAKENING_AFTER and weaker.strength < held.advisory.strength:
                self._issue(t, weaker)
            return
        if held.advisory.strength < strongest.strength:
            self._issue(t, choose_strength(g, own_rate, sense, alim, LATER_RESPONSE))
            return
        if g.time_to_closest <= INCREASE_BEFORE:
            return
        other = complementary_sense(sense)
        turned = separation(g, own_rate, INITIAL[other][-1], LATER_RESPONSE)
        more = INCREASED[sense]
        raised = separation(g, own_rate, more, LATER_RESPONSE)
        # Where the other aircraft is bound to its own sense, turning round would meet it.
        if other_sense is None and not self._reversed and turned > max(raised, expected) + REVERSAL_GAIN:
            self._reversed = True
            self._issue(t, choose_strength(g, own_rate, other, alim, LATER_RESPONSE), reversal=True)
        elif held.advisory is not more and raised > expected:
            self._issue(t, more)

    def _issue(self, t: float, advisory: VerticalAdvisory, reversal: bool = False) -> None:
        if self.advisory is None or advisory is not self.advisory.advisory:
            weaker = self.advisory is not None and not reversal and advisory.strength < self.advisory.advisory.strength
            self.advisory = Advisory(advisory, t, FIRST_RESPONSE if weaker else LATER_RESPONSE, reversal)
