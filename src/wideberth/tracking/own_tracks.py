"""The ownship's own tracks, beyond the moment: what was the ownship a second ago has not become an intruder."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from wideberth.types import FloatArray, Track

HOLD_RADIUS = 30.0
"""A track that was the ownship's stays so this near to it, m, unless another track is found to be the ownship's."""


class OwnTracks:
    """Remembers which tracks were the ownship's.

    A track is the ownship's because telemetry explains it. In a hard turn the track lags and telemetry explains it no
    longer; once the radar loses it, it flies straight on. Taken as an intruder, either would be fled from, in ever
    harder turns. So a track that was the ownship's stays so while it has not been updated since, and while it is within
    `HOLD_RADIUS`, where an intruder would long have been avoided under a track of its own.
    """

    def __init__(self) -> None:
        self._updated: dict[str, float] = {}

    def step(self, tracks: Sequence[Track], own_position: FloatArray, sure: bool = True) -> tuple[Track, ...]:
        """Return the tracks, with those marked that are still the ownship's.

        Parameters
        ----------
        tracks : sequence of Track
            Those that the tracker found to be the ownship's are marked already.
        own_position : ndarray, shape (3,)
            NED, m.
        sure : bool
            Whether that place is known; otherwise what was the ownship's stays so.
        """
        found = any(track.is_ownship for track in tracks)
        before, self._updated = self._updated, {}
        marked = []
        for track in tracks:
            was = track.id in before
            seen = was and track.t_last_update != before[track.id]
            near = bool(np.linalg.norm(track.position - own_position) <= HOLD_RADIUS) if was and not found else False
            own = track.is_ownship or (was and (near or not seen or not sure))
            if own:
                self._updated[track.id] = (
                    track.t_last_update if track.is_ownship or near or not sure else before[track.id]
                )
            marked.append(dataclasses.replace(track, is_ownship=True) if own and not track.is_ownship else track)
        return tuple(marked)
