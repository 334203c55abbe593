"""Aircraft that the tracker no longer vouches for: still there, somewhere, and not to be forgotten at once."""

import dataclasses
import math
from collections.abc import Mapping, Sequence

import numpy as np

from wideberth.types import Track, TrackStatus


class LostTraffic:
    """Keeps lost tracks alive for a while, moving straight on with growing uncertainty.

    A track that ends because its aircraft landed, left or fell silent leaves a gap that looks like empty sky. For
    `memory` seconds its last estimate is carried on as a coasting track whose existence decays. The ownship's own track
    leaves no gap: where the ownship is, it knows.

    Parameters
    ----------
    memory : float
        How long a lost aircraft is remembered, s.
    """

    def __init__(self, memory: float) -> None:
        self._memory = memory
        self._last: dict[str, Track] = {}

    def step(self, t: float, tracks: Sequence[Track], absorbed: Mapping[str, str] | None = None) -> tuple[Track, ...]:
        """Return remembered aircraft at time `t` that are not among `tracks`, and remember those that are.

        Parameters
        ----------
        t : float
            s.
        tracks : sequence of Track
        absorbed : mapping of str to str, optional
            Tracks that have ended as they were the same aircraft as another one, and which: they are not lost, as long
            as the other one is there.
        """
        present = {track.id: track for track in tracks}
        for ended, goes_on in (absorbed or {}).items():
            if goes_on in present and ended not in present:
                self._last.pop(ended, None)
        remembered = []
        for name, track in list(self._last.items()):
            if name in present:
                continue
            age = t - track.t
            if age > self._memory or track.status is TrackStatus.TENTATIVE or track.is_ownship:
                del self._last[name]
                continue
            covariance = track.covariance.copy()
            transition = np.eye(9)
            transition[0:3, 3:6] = age * np.eye(3)
            transition[:, 6:9] = 0.0
            remembered.append(
                dataclasses.replace(
                    track,
                    t=t,
                    position=track.position + age * track.velocity,
                    acceleration=np.zeros(3),
                    covariance=transition @ covariance @ transition.T,
                    status=TrackStatus.COASTING,
                    existence=track.existence * math.exp(-age / self._memory),
                )
            )
        self._last.update(present)
        return tuple(remembered)
