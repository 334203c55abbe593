"""Where the ownship is taken to be: as telemetry says, or straight on from the last that could be believed.

Telemetry may stop, and it may be wrong. Detector and planner need a state all the same: they get the last believed one,
extrapolated, with a covariance that grows, and its `state` says that it is no more than that.
"""

import dataclasses
import math

import numpy as np

from wideberth.sensor_watch import without_digits
from wideberth.tracking.config import OwnshipConfig
from wideberth.tracking.ownship import telemetry_covariance
from wideberth.types import Ownship

STALE = 0.5
"""Telemetry older than this is lost, s."""

JUMP_LEAST, JUMP_SIGMAS = 5.0, 5.0
"""A position this far, in m plus standard deviations, from where the state before leads to has jumped."""


class NavigationWatch:
    """Judges the ownship's telemetry.

    A position that jumped is refused until telemetry comes back, or until the covariance of the extrapolated state has
    grown so far that the ownship may have got there: 200 m off it takes 6 s. Slower drifts cannot be told from flight.
    """

    def __init__(self) -> None:
        self._config = OwnshipConfig()
        self._reported = math.nan
        self._believed: Ownship | None = None
        self._jump = 0.0
        self._state = "ok"

    def step(self, t: float, telemetry: Ownship) -> tuple[Ownship, tuple[str, ...]]:
        """Take the telemetry that is the latest at a step.

        Parameters
        ----------
        t : float
            Now, s.
        telemetry : Ownship
            The latest there is, its `t` being when it was true; while nothing new comes, the same again.

        Returns
        -------
        ownship : Ownship
            The state at `t`, which is not to be relied on unless its `state` is "ok".
        events : tuple of str
            What has changed, in words.
        """
        # Also false for a time that is not a number.
        usable = telemetry.t <= t + STALE
        if usable and not telemetry.t <= self._reported:
            self._reported = telemetry.t
            self._jump = self._jump_size(telemetry)
            if not self._jump:
                self._believed = telemetry
        age = t - self._reported
        if self._believed is None:
            state = "telemetry without a usable time"
        elif age > STALE:
            state = f"no telemetry for {age:.0f} s"
        else:
            # What telemetry says of itself, such as a lost GPS fix, is believed.
            state = f"position jumped by {self._jump:.0f} m" if self._jump else telemetry.state
        events: tuple[str, ...] = ()
        if state != self._state:
            events = (f"ownship: {state}",) if without_digits(state) != without_digits(self._state) else ()
            self._state = state
        return self._at(t, telemetry if self._believed is None else self._believed, state), events

    def _jump_size(self, telemetry: Ownship) -> float:
        """Return how far telemetry is from where the ownship was believed to fly, m; 0 where it may have got there."""
        if self._believed is None:
            return 0.0
        before, age = self._believed, telemetry.t - self._believed.t
        off = math.dist(telemetry.position.tolist(), (before.position + age * before.velocity).tolist())
        if off <= JUMP_LEAST:
            return 0.0
        extrapolated = telemetry_covariance(self._config, before.covariance, age)
        spread = np.diag(extrapolated + telemetry_covariance(self._config, telemetry.covariance))[:3]
        return 0.0 if off <= JUMP_LEAST + JUMP_SIGMAS * math.sqrt(spread.max()) else off

    def _at(self, t: float, known: Ownship, state: str) -> Ownship:
        """Return a known state extrapolated to `t`."""
        age = t - known.t
        if state == "ok" and age == 0.0:
            return known
        if not math.isfinite(age):
            return dataclasses.replace(known, t=t, state=state)
        return dataclasses.replace(
            known,
            t=t,
            position=known.position + age * known.velocity,
            covariance=telemetry_covariance(self._config, known.covariance, abs(age)),
            state=state,
        )
