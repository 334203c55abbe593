"""Tracks as what the vertical controllers know of other aircraft: views of `multi_kernels`."""

import dataclasses
import math
from collections.abc import Sequence

import numpy as np

from wideberth.avoidance.cas import multi_kernels as multi
from wideberth.avoidance.position_spread import position_variances
from wideberth.avoidance.sound_tracks import SoundTracks
from wideberth.avoidance.vertical.config import VerticalConfig
from wideberth.types import FloatArray, Track

_AHEAD_MAX = 60.0  # s: heights are not known better by looking farther


@dataclasses.dataclass(frozen=True, slots=True)
class Intruders:
    """The aircraft that are avoided.

    Attributes
    ----------
    tracks : tuple of Track
        Whose each row is.
    views, use : ndarray, shape (m, N_VIEW) and (m,)
    """

    tracks: tuple[Track, ...]
    views: FloatArray
    use: FloatArray


class IntruderViews:
    """Makes views of tracks; what cannot be used is counted.

    Parameters
    ----------
    config : VerticalConfig

    Attributes
    ----------
    counters : dict of str to int
        ``not_finite``, ``unusable`` and ``motion_unknown`` as of `SoundTracks`; ``stale``: not updated for `stale_s`.
    """

    def __init__(self, config: VerticalConfig) -> None:
        self._config = config
        self._tracks = SoundTracks(config.ghost_s, config.tentative)
        self._stale: set[str] = set()
        self._stale_count = 0

    @property
    def counters(self) -> dict[str, int]:
        """What could not be used."""
        return {**self._tracks.counters, "stale": self._stale_count}

    def step(self, t: float, own: FloatArray, tracks: Sequence[Track]) -> tuple[Intruders, list[str]]:
        """Return the aircraft to avoid at time `t`, s, from the own state (6,), and what was wrong with tracks."""
        config = self._config
        usable, events = self._tracks.step(t, tracks)
        kept, rows, stale = [], [], set()
        for track, sound in usable:
            age = max(t - track.t_last_update, 0.0)
            if age > config.stale_s:
                stale.add(track.id)
                self._stale_count += 1
                if track.id not in self._stale:
                    events.append(f"track {track.label} was not updated for {age:.0f} s: it is no longer avoided")
                continue
            kept.append(track)
            rows.append(self._view(t, own, track, age, sound))
        self._stale = stale
        views = np.array(rows).reshape(-1, multi.N_VIEW)
        return Intruders(tuple(kept), views, np.ones(len(kept))), events

    def _view(self, t: float, own: FloatArray, track: Track, age: float, sound: bool) -> FloatArray:
        config = self._config
        late = {"none": 0.0, "estimate": config.delay_estimate_s, "timestamp": t - track.t}[config.delay_compensation]
        view = np.zeros(multi.N_VIEW)
        view[:3] = track.position + track.velocity * late
        view[3:6] = track.velocity
        view[multi.V_WANTED], view[multi.V_AGE] = view[2], age
        relative, closing = own[:2] - view[:2], own[3:5] - view[3:5]
        speed2 = float(closing @ closing)
        ahead = -float(relative @ closing) / speed2 if speed2 > 0.0 else 0.0
        ahead = min(max(ahead, 0.0), _AHEAD_MAX)
        cap = config.sigma_cap * config.zone_height
        variances = position_variances(track, ahead)
        sigma = math.sqrt(max(variances[2], 0.0))
        if config.threshold.kind == "probability":
            view[multi.V_VARIANCE] = max(float(np.mean(variances)), 0.0)  # this kind widens by itself
        elif not sound:
            view[multi.V_MARGIN] = cap
        else:
            view[multi.V_MARGIN] = min(config.sigmas * sigma, cap)
        return view
