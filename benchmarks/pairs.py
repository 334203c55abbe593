"""Well-clear pairs a second: the compiled kernel against the same mathematics in plain numpy."""

import numpy as np

from benchmarks.timing import cpu_seconds
from wideberth.conflict.well_clear import PRESETS, WellClearVolume, conflict_interval
from wideberth.types import FloatArray

PAIRS = 100_000
LOOKAHEAD = 120.0


def numpy_intervals(
    volume: WellClearVolume, s: FloatArray, v: FloatArray, lookahead: float
) -> tuple[FloatArray, FloatArray]:
    """Return the interval of each pair inside a volume with TCOA = 0, of relative states (n, 3)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        height, rate = np.abs(s[:, 2]), np.abs(v[:, 2])
        approaching = s[:, 2] * v[:, 2] < 0
        z_in = np.where(height <= volume.zthr, 0.0, np.where(approaching, (height - volume.zthr) / rate, np.nan))
        z_out = np.where(approaching, volume.zthr + height, volume.zthr - height) / rate
        a = (v[:, :2] ** 2).sum(axis=1)
        sv = (s[:, :2] * v[:, :2]).sum(axis=1)
        outside = (s[:, :2] ** 2).sum(axis=1) - volume.dthr**2
        delta = a * volume.dthr**2 - (s[:, 0] * v[:, 1] - s[:, 1] * v[:, 0]) ** 2
        b, c = 2 * sv + volume.tthr * a, outside + volume.tthr * sv
        h_in = np.where((outside <= 0) | (c <= 0), 0.0, (-b - np.sqrt(b * b - 4 * a * c)) / (2 * a))
        h_out = (np.sqrt(np.maximum(delta, 0.0)) - sv) / a
        misses = (outside > 0) & ((sv >= 0) | (delta < 0))
        t_in = np.where(misses, np.nan, np.maximum(h_in, z_in))
        t_out = np.minimum(np.minimum(h_out, z_out), lookahead)
        conflict = (t_in <= lookahead) & (t_in < t_out)
    return np.where(conflict, t_in, np.nan), np.where(conflict, t_out, np.nan)


def measure() -> dict[str, float]:
    """Return pairs a second of both ways, nanoseconds a pair, and the ratio, after comparing the results."""
    random = np.random.default_rng(1)
    volume = PRESETS["sarp"]
    own, intruder = random.uniform(-8000, 8000, (2, PAIRS, 3)) * (1, 1, 0.1)
    own_velocity, intruder_velocity = random.uniform(-100, 100, (2, PAIRS, 3)) * (1, 1, 0.05)

    def compiled() -> tuple[FloatArray, FloatArray]:
        return conflict_interval(volume, own, own_velocity, intruder, intruder_velocity, LOOKAHEAD)

    def plain() -> tuple[FloatArray, FloatArray]:
        return numpy_intervals(volume, own - intruder, own_velocity - intruder_velocity, LOOKAHEAD)

    for ours, theirs in zip(compiled(), plain(), strict=True):
        np.testing.assert_allclose(ours, theirs, atol=1e-6)
    ours_seconds, numpy_seconds = cpu_seconds(compiled), cpu_seconds(plain)
    return {
        "pairs_per_cpu_second": PAIRS / ours_seconds,
        "nanoseconds_per_pair": ours_seconds / PAIRS * 1e9,
        "numpy_pairs_per_cpu_second": PAIRS / numpy_seconds,
        "ratio_to_numpy": numpy_seconds / ours_seconds,
    }
