"""How well it is known where the aircraft of a track will be."""

from wideberth.types import Track


def position_variances(track: Track, ahead: float) -> list[float]:
    """Return the variances of where a track will be in `ahead` seconds: north, east, down, m^2."""
    p = track.covariance
    now, both, rate = p[:3, :3].diagonal(), p[:3, 3:6].diagonal(), p[3:6, 3:6].diagonal()
    variances: list[float] = (now + 2.0 * ahead * both + ahead * ahead * rate).tolist()
    return variances
