"""Lost aircraft that are seen again under another number (track segment association)."""

from collections.abc import Sequence

import numpy as np

from wideberth.types import Track, TrackStatus

_GATE = 22.46  # chi-square of position and velocity, 6 degrees of freedom, 99.9 %


def without_repeats(tracks: Sequence[Track]) -> list[Track]:
    """Return the tracks with each aircraft once, where one that was lost is seen again.

    A track that coasts and a confirmed one that agrees with it in position and velocity are taken for one aircraft, and
    that of the two stays which knows its velocity better: for some seconds what was known before the loss is worth more
    than a young track. Where they do not agree both stay.

    Parameters
    ----------
    tracks : sequence of Track
        All of one time, finite.
    """
    lost = [track for track in tracks if track.status is TrackStatus.COASTING]
    dropped: set[str] = set()
    for young in tracks if lost else ():
        if young.status is not TrackStatus.CONFIRMED:
            continue
        distances = [(_distance_square(young, old), old) for old in lost]
        nearest = min(distances, key=lambda pair: pair[0], default=None)
        if nearest is None or not nearest[0] <= _GATE:
            continue
        old = nearest[1]
        worse = young if _doubt(old) <= _doubt(young) else old
        dropped.add(worse.id)
        lost = [other for other in lost if other is not old]
    return [track for track in tracks if track.id not in dropped]


def _distance_square(one: Track, other: Track) -> float:
    """Return the squared Mahalanobis distance of position and velocity; inf beyond the gate or where not defined."""
    away = one.position - other.position
    covariance = one.covariance[:6, :6] + other.covariance[:6, :6]
    # No variance in any direction is more than the trace: most pairs are told apart without solving.
    if away @ away > _GATE * covariance[:3, :3].trace():
        return float("inf")
    apart = np.concatenate((away, one.velocity - other.velocity))
    try:
        return float(apart @ np.linalg.solve(covariance, apart))
    except np.linalg.LinAlgError:
        return float("inf")


def _doubt(track: Track) -> float:
    """Return the sum of the variances of a track's velocity, m^2/s^2."""
    return float(track.covariance[3:6, 3:6].trace())
