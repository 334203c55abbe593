"""What a scene that stands still returns in each bin, learned from the frames themselves."""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth.argument_checks import FloatArray
from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.processing.noise_statistics import NoiseStatistics, fingerprint

_MOST = 4.0  # times the map that a frame counts for: moving targets leave little behind them


class ClutterMap:
    """The forgetting mean of the averaged powers of channels and bins, to be used in the place of noise statistics.

    A target that stays in a range bin becomes a part of the map, the more slowly the stronger it is: a frame counts for
    four times the map at most. Those of the first frame are in it from the start, and fade.

    Parameters
    ----------
    radar : RadarConfig
        `processing.clutter_map_frames` says how slowly the map forgets.
    """

    def __init__(self, radar: RadarConfig) -> None:
        self._radar = radar
        self._power = np.zeros((radar.channels, radar.range_bins))
        self._frames = np.zeros(radar.channels)
        self._known = np.zeros(radar.channels)  # frames that the mean is worth, were it not forgetting
        self._looks = math.inf

    def statistics(self, t: float) -> NoiseStatistics | None:
        """Return the map as noise statistics of a time, with the power 0 in channels that were never seen.

        Returns
        -------
        NoiseStatistics or None
            None before the first frame.
        """
        seen = self._known > 0.0
        if not seen.any():
            return None
        samples = float(self._known[seen].min()) * self._looks
        return NoiseStatistics(self._power.copy(), samples, fingerprint(self._radar), t, t)

    def learn(self, powers: FloatArray, looks: float, channels: NDArray[np.bool_]) -> None:
        """Take a frame in.

        Parameters
        ----------
        powers : ndarray, shape (channels, range_bins)
            Of `averaging.channel_powers`.
        looks : float
            Independent powers in each.
        channels : ndarray of bool, shape (channels,)
            Those that can be used; the others keep what they have.
        """
        self._frames[channels] += 1.0
        for channel in np.flatnonzero(channels):
            share = max(1.0 / self._frames[channel], 1.0 / self._radar.processing.clutter_map_frames)
            old = self._power[channel]
            new = powers[channel] if self._frames[channel] == 1.0 else np.minimum(powers[channel], _MOST * old)
            self._power[channel] = old + share * (new - old)
            before = self._known[channel]
            spread = (1.0 - share) ** 2 / before if before else 0.0
            self._known[channel] = 1.0 / (spread + share**2)
        self._looks = min(self._looks, looks)
