"""The ownship's own tracks, beyond the moment: what was the ownship a second ago has not become an intruder."""

import dataclasses
import math
from collections.abc import Collection, Sequence

from wideberth.types import FloatArray, Track

NEWBORN = 12.0
"""For so long a track that begins within `HOLD_RADIUS` of the ownship may be its own, s: the test of telemetry has then
forgotten its first states, also where the ownship turned meanwhile."""

SECOND_ECHO = 1.0
"""For so long it may be beside another track that is the ownship's, s, if nothing is known of its motion."""

MOTION_UNKNOWN = 10.0
"""Nothing is known of a motion with a larger standard deviation of the velocity, m/s."""

HOLD_RADIUS = 30.0
"""A track that was the ownship's stays so this near to it, m, unless another track is found to be the ownship's."""

LEFT_BEHIND = 2.0
"""A radar is not on board if it has not moved since the ownship was so far away, m."""

NEWS = 3
"""So many updates make somebody else of a track that flew on without news, if another is the ownship's."""

SILENT = 1.0
"""A track flew on without news when it had none for longer, s."""


class OwnTracks:
    """Remembers which tracks were the ownship's.

    A track is the ownship's because telemetry explains it. In a hard turn the track lags and telemetry explains it no
    longer; once the radar loses it, it flies straight on. Taken as an intruder, either would be fled from, in ever
    harder turns. So a track that was the ownship's stays so while it has not been updated since, and while it is within
    `HOLD_RADIUS`, where an intruder would long have been avoided under a track of its own. A single plot of the ownship
    may go to the one that flies on: where another track is the ownship's by now, with news or without, it takes `NEWS`
    to be an intruder.

    A radar that stands elsewhere sees the ownship and begins a track of it, whose first states may be too poor for
    telemetry to explain them. So one that begins within `HOLD_RADIUS` is taken as the ownship's for `NEWBORN` seconds,
    while no track with news as late is; beside one with news, which two plots of the ownship in one scan can begin, for
    `SECOND_ECHO` seconds at most, before anything is known of its motion. If the ownship's track flies on without news
    meanwhile, the new one has its plots: it takes its place, as one that was the ownship's.
    """

    def __init__(self) -> None:
        self._updated: dict[str, tuple[float, int]] = {}  # when each was updated last, and how often since it was ours
        self._began: dict[str, tuple[float, bool]] = {}  # when each track did, and whether near the ownship
        self._newborn_updated: dict[str, float] = {}  # of those taken as the ownship's for being newborn
        self._seen_from_elsewhere = False
        self._stood: dict[tuple[float, ...], list[float]] = {}  # where radars stand, and the ownship's place at first

    def step(
        self,
        tracks: Sequence[Track],
        own_position: FloatArray,
        sure: bool = True,
        radars: Sequence[FloatArray] = (),
        receivers: Collection[str] = (),
    ) -> tuple[Track, ...]:
        """Return the tracks, with those marked that are still the ownship's.

        Parameters
        ----------
        tracks : sequence of Track
            Those that the tracker found to be the ownship's are marked already.
        own_position : ndarray, shape (3,)
            NED, m.
        sure : bool
            Whether that place is known; otherwise what was the ownship's stays so.
        radars : sequence of ndarray, shape (3,)
            Where the radars of the step's scans stood, NED, m.
        receivers : collection of str
            Names of the sensors that hear ADS-B: what they alone tell of is not the ownship for being newborn.
        """
        found_updated = [track.t_last_update for track in tracks if track.is_ownship]
        place = own_position.tolist()
        distances = [math.dist(track.position.tolist(), place) for track in tracks]
        own_news = max(
            (track.t_last_update for track in tracks if track.is_ownship or track.id in self._updated), default=None
        )
        newborn = self._newborn(tracks, distances, own_position, sure, radars, own_news)
        # Only an echo can be: what is only heard has told who it is.
        newborn -= {track.id for track in tracks if track.sources and set(track.sources) <= set(receivers)}
        before, self._updated = self._updated, {}
        ours = {track.id for track in tracks if track.is_ownship or track.id in before}
        marked = []
        for track, distance in zip(tracks, distances, strict=True):
            was = track.id in before
            # One that flies on without news is found to be ours for want of plots: they may be this track's.
            found = any(t >= track.t_last_update - SILENT for t in found_updated)
            updated, news = before.get(track.id, (track.t_last_update, 0))
            if track.t_last_update != updated:
                flew_on = news > 0 or track.t_last_update - updated > SILENT
                updated, news = track.t_last_update, news + 1 if flew_on else NEWS
            seen = news >= (NEWS if ours - {track.id} else 1)
            near = was and not found and distance <= HOLD_RADIUS
            own = track.is_ownship or (was and (near or not seen or not sure))
            if own:
                again = track.is_ownship or near or not sure
                self._updated[track.id] = (track.t_last_update, 0) if again else (updated, news)
            if track.id in newborn:
                own, self._newborn_updated[track.id] = True, track.t_last_update
                if own_news is not None and track.t_last_update - own_news > SILENT:
                    self._updated[track.id] = (track.t_last_update, 0)
            # Without news it is still nobody else.
            own = own or self._newborn_updated.get(track.id) == track.t_last_update
            marked.append(dataclasses.replace(track, is_ownship=True) if own and not track.is_ownship else track)
        return tuple(marked)

    def _is_elsewhere(self, place: list[float], radars: Sequence[FloatArray]) -> bool:
        """Return whether a radar is far from the ownship, or stayed where it was while that moved."""
        before, self._stood = self._stood, {}
        found = False
        for radar in radars:
            at = tuple(radar.tolist())
            self._stood[at] = before.get(at, place)
            found = found or math.dist(at, place) > HOLD_RADIUS or math.dist(self._stood[at], place) > LEFT_BEHIND
        return found

    def _newborn(
        self,
        tracks: Sequence[Track],
        distances: Sequence[float],
        own_position: FloatArray,
        sure: bool,
        radars: Sequence[FloatArray],
        own_news: float | None,
    ) -> set[str]:
        """Return the tracks that have just begun at the ownship and may be its own, whose known ones had `own_news`."""
        # A radar on board never sees the ownship: what begins near it there is somebody else.
        if sure and not self._seen_from_elsewhere:
            self._seen_from_elsewhere = self._is_elsewhere(own_position.tolist(), radars)
        self._began = {
            track.id: self._began.get(track.id, (track.t, distance <= HOLD_RADIUS))
            for track, distance in zip(tracks, distances, strict=True)
        }
        self._newborn_updated = {name: t for name, t in self._newborn_updated.items() if name in self._began}
        if not (self._seen_from_elsewhere and sure):
            return set()
        newborn = set()
        for track, distance in zip(tracks, distances, strict=True):
            began, near = self._began[track.id]
            if near and distance <= HOLD_RADIUS and track.t - began < NEWBORN:
                later = own_news is None or track.t_last_update > own_news
                if later or (track.t - began < SECOND_ECHO and _is_motion_unknown(track)):
                    newborn.add(track.id)
        return newborn


def _is_motion_unknown(track: Track) -> bool:
    """Return whether a track says next to nothing of its velocity."""
    return bool(max(track.covariance[i, i] for i in range(3, 6)) > MOTION_UNKNOWN**2)
