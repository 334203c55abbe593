"""Confirming tracks by hits of a window of scans: against sampling and by hand."""

import math

import numpy as np
import pytest

from wideberth.sensors.confirmation import confirmation_probability, confirmation_range


def sampled(p: np.ndarray, hits: int, window: int, samples: int, seed: int) -> np.ndarray:
    """How often the rule is met by each scan."""
    seen = np.random.default_rng(seed).random((samples, len(p))) < p
    before = np.cumsum(np.pad(seen, ((0, 0), (window, 0))), axis=1)
    met = np.logical_or.accumulate(before[:, window:] - before[:, :-window] >= hits, axis=1)
    return np.asarray(met.mean(axis=0))


@pytest.mark.parametrize(("hits", "window"), [(1, 1), (1, 4), (2, 2), (2, 3), (3, 5), (6, 10), (12, 12)])
def test_against_sampled_detections(hits, window):
    p = np.linspace(0.1, 0.9, 25)
    found = confirmation_probability(p, hits, window)
    np.testing.assert_allclose(found, sampled(p, hits, window, 40_000, seed=hits), atol=0.012)


def test_by_hand():
    np.testing.assert_allclose(confirmation_probability([0.5, 0.5, 0.5], 1, 1), [0.5, 0.75, 0.875])
    # Two of three: HH., HTH, THH.
    np.testing.assert_allclose(confirmation_probability([0.5, 0.5, 0.5], 2, 3), [0.0, 0.25, 0.5])
    np.testing.assert_array_equal(confirmation_probability([1.0] * 4, 3, 5), [0.0, 0.0, 1.0, 1.0])


def test_other_axes_are_targets():
    p = np.random.default_rng(1).random((9, 2, 3))
    found = confirmation_probability(p, 2, 4)
    assert found.shape == p.shape
    np.testing.assert_allclose(found[:, 1, 2], confirmation_probability(p[:, 1, 2], 2, 4))


def ranged(p, speed, **changes):
    settings = {
        "update_interval": 1.0,
        "range_limit": 1000.0,
        "range_min": 10.0,
        "hits": 3,
        "window": 5,
        "confirmed_with": 0.9,
    }
    return confirmation_range(p, speed, **(settings | changes))


def test_sure_detections_confirm_after_as_many_scans_as_hits():
    np.testing.assert_allclose(ranged(np.ones_like, [10.0, 50.0, 100.0]), [970.0, 850.0, 700.0])


def test_what_passes_in_between_two_scans_is_not_confirmed():
    assert ranged(np.ones_like, 400.0) == 0.0
    assert ranged(np.ones_like, 330.0) == pytest.approx(10.0)
    assert ranged(np.zeros_like, 50.0) == 0.0


def test_the_range_is_that_of_the_scan_that_reaches_the_probability():
    def p(ranges):
        return np.clip(1.2 - ranges / 1000.0, 0.0, 1.0)

    scans = 1000.0 - 7.0 * np.arange(1, 141)
    for hits, window, wanted in ((1, 1, 0.5), (3, 5, 0.9), (6, 10, 0.99)):
        expected = scans[np.argmax(confirmation_probability(p(scans), hits, window) >= wanted)]
        found = ranged(p, 7.0, hits=hits, window=window, confirmed_with=wanted)
        assert found == pytest.approx(expected)


def test_targets_do_not_touch_each_other():
    speeds = np.array([[1.0, 30.0], [7.0, 70.0]])

    def p(ranges):
        return np.clip(1.0 - ranges / 800.0, 0.0, 1.0)

    together = ranged(p, speeds)
    np.testing.assert_array_equal(together, [[ranged(p, v) for v in row] for row in speeds])
    assert together[0, 0] > together[0, 1] > together[1, 1] > 0.0


def test_a_target_that_hardly_closes():
    fast_enough = ranged(lambda r: np.clip(1.0 - r / 800.0, 0.0, 1.0), 0.3)
    crawling = ranged(lambda r: np.clip(1.0 - r / 800.0, 0.0, 1.0), 1e-6)
    assert fast_enough < crawling < 800.0


def test_bad_arguments_are_refused_by_name():
    for p in ([1.1], [-0.1], [math.nan]):
        with pytest.raises(ValueError, match="p_detection must be"):
            confirmation_probability(p, 1, 1)
    with pytest.raises(ValueError, match="p_detection must have an axis"):
        confirmation_probability(0.5, 1, 1)
    for hits, window in ((0, 3), (4, 3), (1.5, 3)):
        with pytest.raises(ValueError, match="hits must be one of 1, 2, 3"):
            confirmation_probability([0.5], hits, window)
    for window in (0, 13):
        with pytest.raises(ValueError, match="window must be one of"):
            confirmation_probability([0.5], 1, window)
    for name in ("update_interval", "range_limit"):
        with pytest.raises(ValueError, match=f"{name} must be positive"):
            ranged(np.ones_like, 10.0, **{name: 0.0})
    with pytest.raises(ValueError, match="closing_speed must be positive"):
        ranged(np.ones_like, [10.0, 0.0])
    with pytest.raises(ValueError, match="range_min must be less than range_limit"):
        ranged(np.ones_like, 10.0, range_min=1000.0)
    with pytest.raises(ValueError, match="confirmed_with must be"):
        ranged(np.ones_like, 10.0, confirmed_with=1.0)
