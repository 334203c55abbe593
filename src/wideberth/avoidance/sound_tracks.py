"""Tracks of others that can be used, and what stands in for those that are not finite."""

import dataclasses
import math
from collections.abc import Sequence

import numpy as np

from wideberth.types import Track, TrackStatus

_MOTION_UNKNOWN = 15.0  # m/s, standard deviation of the velocity along north or east, if it is more than the speed


class SoundTracks:
    """Chooses the tracks to avoid, and remembers the last sound state of each.

    A track that is not finite is taken where its last sound state leads, for `ghost` seconds; without a sound state,
    where it was reported, if it was. What could not be used is counted, and said once. A track that coasts and whose
    motion was not known yet when it was lost leads nowhere: after a second it could be anywhere within reach, and a
    path away from one guess is as likely one towards the next. It is counted; the alert state says that it is unknown.

    Parameters
    ----------
    ghost : float
        How long a sound state is remembered, s.
    tentative : bool
        Whether tentative tracks are to be avoided too; the ownship's own never are.

    Attributes
    ----------
    counters : dict of str to int
        ``not_finite`` and ``unusable``, and ``motion_unknown``.
    """

    def __init__(self, ghost: float, tentative: bool) -> None:
        self._ghost, self._tentative = ghost, tentative
        self._sound: dict[str, Track] = {}
        self._unsound: set[str] = set()
        self.counters = {"not_finite": 0, "unusable": 0, "motion_unknown": 0}

    def step(self, t: float, tracks: Sequence[Track]) -> tuple[list[tuple[Track, bool]], list[str]]:
        """Return the tracks to use at time `t`, s, each with whether it is sound, and what was wrong, in words."""
        used: list[tuple[Track, bool]] = []
        events: list[str] = []
        unsound = set()
        for track in tracks:
            if track.is_ownship or (track.status is TrackStatus.TENTATIVE and not self._tentative):
                continue
            if _finite(track):
                self._sound[track.id] = track
                if track.status is TrackStatus.COASTING and _motion_unknown(track):
                    self.counters["motion_unknown"] += 1
                else:
                    used.append((track, True))
                continue
            self.counters["not_finite"] += 1
            unsound.add(track.id)
            stand_in = self._stand_in(t, track)
            if track.id not in self._unsound:
                how = "it cannot be avoided" if stand_in is None else "it is avoided where it would be"
                events.append(f"track {track.label} is not finite: {how}")
            if stand_in is None:
                self.counters["unusable"] += 1
            else:
                used.append((stand_in, False))
        self._unsound = unsound
        self._sound = {key: track for key, track in self._sound.items() if t - track.t <= self._ghost}
        return used, events

    def _stand_in(self, t: float, track: Track) -> Track | None:
        """Return the last sound state of a track that is not finite, or what of it still says where it is."""
        sound = self._sound.get(track.id)
        if np.isfinite(track.position).all() and np.isfinite(track.velocity).all():
            return dataclasses.replace(track, acceleration=np.zeros(3), covariance=np.zeros((9, 9)))
        if sound is not None and t - sound.t <= self._ghost:
            return sound
        if np.isfinite(track.position).all():
            return dataclasses.replace(
                track, velocity=np.zeros(3), acceleration=np.zeros(3), covariance=np.zeros((9, 9))
            )
        return None


def _finite(track: Track) -> bool:
    short = (*track.position.tolist(), *track.velocity.tolist(), *track.acceleration.tolist())
    return math.isfinite(sum(short) + float(track.covariance.sum()))


def _motion_unknown(track: Track) -> bool:
    speed, p = math.hypot(track.velocity[0], track.velocity[1]), track.covariance
    return bool(max(p[3, 3], p[4, 4]) > max(_MOTION_UNKNOWN, speed) ** 2)
