"""Reversals: commands against a threat that contradict the one before."""

import math

import numpy as np

from wideberth.types import AlertLevel, Maneuver, Ownship, Snapshot
from wideberth.units import DEGREE

TURN_DEAD_BAND = 5 * DEGREE
CLIMB_DEAD_BAND = 0.5  # m/s
# Nearer waypoints say nothing of a direction.
_DISTANCE_MIN = 1.0


def commanded_signs(ownship: Ownship, maneuver: Maneuver) -> tuple[int, int]:
    """Return the signs of the turn and the climb that a new maneuver commands.

    Parameters
    ----------
    ownship : Ownship
        When it is commanded.
    maneuver : Maneuver

    Returns
    -------
    turn : int
        1 right, -1 left: the course of the first leg from where the ownship is, against its present course; 0 within
        the dead band of 5 deg.
    climb : int
        1 up, -1 down: the climb rate that the first leg needs; 0 within the dead band of 0.5 m/s.
    """
    turn = climb = 0
    for waypoint, t in zip(maneuver.waypoints, maneuver.times, strict=True):
        leg = waypoint - ownship.position
        if math.hypot(leg[0], leg[1]) < _DISTANCE_MIN:
            continue
        north, east = float(ownship.velocity[0]), float(ownship.velocity[1])
        # Of the rotation from the present course to the leg.
        change = math.atan2(north * leg[1] - east * leg[0], north * leg[0] + east * leg[1])
        turn = int(np.sign(change)) if abs(change) > TURN_DEAD_BAND else 0
        rate = -leg[2] / max(t - ownship.t, 1e-3)
        climb = int(np.sign(rate)) if abs(rate) > CLIMB_DEAD_BAND else 0
        break
    return turn, climb


class ReversalCounter:
    """Count reversals.

    A reversal is a commanded turn or climb of the opposite sign to the one before for the same threat, before that
    threat is clear. Only new maneuvers command; returning to the mission does not. A maneuver counts at most once for
    its turn and once for its climb, however many threats it answers. A threat that is gone, or at CLEAR, is clear.

    Attributes
    ----------
    count : int
    """

    def __init__(self) -> None:
        self.count = 0
        self._last_t = math.nan
        self._last: dict[str, list[int]] = {}

    def update(self, snapshot: Snapshot) -> bool:
        """Take in one step; return whether its maneuver is a reversal."""
        levels = {threat.track_id: threat.level for threat in snapshot.threats}
        for name in [n for n in self._last if levels.get(n, AlertLevel.CLEAR) == AlertLevel.CLEAR]:
            del self._last[name]
        maneuver = snapshot.maneuver
        if maneuver is None or maneuver.t == self._last_t:
            return False
        self._last_t = maneuver.t
        signs = commanded_signs(snapshot.ownship, maneuver)
        reversed_axes = set()
        for name in maneuver.threat_ids:
            if levels.get(name, AlertLevel.CLEAR) == AlertLevel.CLEAR:
                continue
            last = self._last.setdefault(name, [0, 0])
            for axis, sign in enumerate(signs):
                if sign and last[axis] == -sign:
                    reversed_axes.add(axis)
                last[axis] = sign or last[axis]
        self.count += len(reversed_axes)
        return bool(reversed_axes)
