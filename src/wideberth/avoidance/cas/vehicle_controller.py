"""One vehicle's cooperative collision avoidance, from messages to a vertical command."""

import numpy as np
from numpy.typing import ArrayLike

from wideberth.argument_checks import FINITE, checked
from wideberth.avoidance.cas import multi_kernels as multi
from wideberth.avoidance.cas import pair_kernels as k
from wideberth.avoidance.cas.config import CasConfig
from wideberth.avoidance.cas.settings import REASONS, Decision, settings
from wideberth.avoidance.cas.traffic_picture import Traffic, TrafficPicture
from wideberth.avoidance.cas.vehicle_message import VehicleMessage
from wideberth.types import FloatArray

CONTROLLERS = ("interval", "bang_bang", "continuous")
"""Those that decide for one vehicle on what it predicts."""


class VehicleController:
    """Takes messages as they come and decides against all vehicles known (CAS thesis, 4.1, 4.3).

    Parameters
    ----------
    config : CasConfig
        With one of `CONTROLLERS`; prediction and threshold of any kind.
    number : int
        Of the own vehicle: in a tie the lower one climbs.

    Attributes
    ----------
    picture : TrafficPicture
        What is known, and what was wrong with messages.
    target : int or None
        Number of the vehicle that is avoided.

    Raises
    ------
    ValueError
        For another controller.
    """

    def __init__(self, config: CasConfig, number: int) -> None:
        if config.controller not in CONTROLLERS:
            raise ValueError(f"controller '{config.controller}' is for fleets: use one of {', '.join(CONTROLLERS)}")
        self.picture = TrafficPicture(config, number)
        self.target: int | None = None
        self._p = settings(config, predicted=True)
        self._cooperates = self._p[k.P_COOPERATES]
        self._reason, self._command = np.zeros(1, np.int64), np.zeros(1)

    def take(self, message: VehicleMessage, now: float) -> bool:
        """Take a message that has come by `now`, s, and return whether it is believed."""
        return self.picture.take(message, now)

    def decide(self, now: float, own: ArrayLike, z_wanted: float, own_path: ArrayLike | None = None) -> Decision:
        """Return the decision now, and remember it.

        Parameters
        ----------
        now : float
            Own clock, s.
        own : array_like, shape (6,)
            Own position and velocity, NED.
        z_wanted : float
            Position down that guidance wants, m.
        own_path : array_like, shape (n, 4), optional
            Own waypoints: time, north, east, down. Used with ``prediction.intent``.

        Returns
        -------
        Decision
            Its t* and d* are those of the vehicle avoided, else of the most critical one; NaN where nobody is known.

        Raises
        ------
        ValueError
            If an argument has another shape or is not finite.
        """
        wanted = checked("z_wanted", [z_wanted], FINITE)
        traffic = self.picture.traffic(now, own, own_path)
        x = np.array(own, dtype=np.float64)
        if self._p[k.P_CONTROLLER] == k.INTERVAL:
            reason, rate, row = multi.interval_rate(
                x,
                traffic.own_row,
                float(wanted[0]),
                k.guidance_rate(x[2], float(wanted[0]), self._p),
                bool(self._reason[0] != k.NO_REASON),
                traffic.views,
                traffic.use,
                self._p,
                np.empty((len(traffic.use), 3)),
            )
            self._reason[0], self._command[0] = reason, rate
        else:
            row = self._decide_against_one(traffic, x, wanted)
        shown = row if row >= 0 else multi.most_critical(x, traffic.views, traffic.use, self._p)
        t_star, d_star = (np.nan, np.nan) if shown < 0 else traffic.closest[shown]
        avoids = bool(self._reason[0] != k.NO_REASON)
        self.target = traffic.senders[row] if avoids and row >= 0 else None
        return Decision(avoids, float(self._command[0]), REASONS[self._reason[0]], float(t_star), float(d_star))

    def _decide_against_one(self, traffic: Traffic, x: FloatArray, wanted: FloatArray) -> int:
        """Decide against the most critical vehicle, or the one that is avoided already, and return its row."""
        row = multi.most_critical(x, traffic.views, traffic.use, self._p)
        if self._p[k.P_CONTROLLER] == k.BANG_BANG and self.target in traffic.senders:
            held = traffic.senders.index(self.target)
            row = held if traffic.use[held] > 0.0 else row
        if row < 0:
            self._reason[0], self._command[0] = k.NO_REASON, k.guidance_rate(x[2], float(wanted[0]), self._p)
            return row
        self._p[k.P_COOPERATES] = self._cooperates and traffic.cooperates[row]
        first = np.array([float(row > traffic.own_row)])
        k.decide_pairs(
            x[None],
            np.ascontiguousarray(traffic.views[row : row + 1, :6]),
            wanted,
            first,
            self._p,
            self._reason,
            self._command,
            np.empty((1, 2)),
        )
        return row
