"""How well it is known where the aircraft of a track will be."""

from wideberth.types import Track


def position_variances(track: Track, ahead: float) -> list[float]:
    """Return the variances of where a track will be in `ahead` seconds: north, east, down, m^2."""
    # Single elements: arrays of three cost more than they save.
    p = track.covariance.item
    square = ahead * ahead
    return [p(i, i) + 2.0 * ahead * p(i, 3 + i) + square * p(3 + i, 3 + i) for i in range(3)]
