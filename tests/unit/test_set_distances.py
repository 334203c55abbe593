"""OSPA and GOSPA: cases by hand, refusals, and an assignment found by trying all."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from wideberth.evaluation.set_distances import Ospa, gospa, ospa

NONE = np.empty((0, 3))
ORIGIN = np.zeros((1, 3))


def at(*norths):
    return np.array([[north, 0.0, 0.0] for north in norths])


def test_ospa_by_hand():
    assert ospa(NONE, NONE) == Ospa(0.0, 0.0, 0.0)
    assert ospa(NONE, ORIGIN) == ospa(ORIGIN, NONE) == Ospa(50.0, 0.0, 50.0)
    assert ospa(at(3), ORIGIN) == pytest.approx((3.0, 3.0, 0.0))
    assert ospa(at(80), ORIGIN) == pytest.approx((50.0, 50.0, 0.0))
    # One of two missing: half of c squared.
    assert ospa(at(0), at(0, 100)) == pytest.approx((math.sqrt(1250), 0.0, math.sqrt(1250)))
    assert ospa(at(4, 103), at(0, 100)) == pytest.approx((math.sqrt(12.5), math.sqrt(12.5), 0.0))
    assert ospa(at(4, 103), at(0, 100), order=1) == pytest.approx((3.5, 3.5, 0.0))
    assert ospa(at(4), ORIGIN, cutoff=2) == pytest.approx((2.0, 2.0, 0.0))


def test_gospa_by_hand():
    assert gospa(NONE, NONE) == (0.0, 0.0, 0.0, 0.0)
    assert gospa(NONE, ORIGIN) == pytest.approx((math.sqrt(1250), 0.0, 1250.0, 0.0))
    assert gospa(ORIGIN, NONE) == pytest.approx((math.sqrt(1250), 0.0, 0.0, 1250.0))
    assert gospa(at(3), ORIGIN) == pytest.approx((3.0, 9.0, 0.0, 0.0))
    # Too far apart to be a pair: one missed and one false.
    assert gospa(at(80), ORIGIN) == pytest.approx((50.0, 0.0, 1250.0, 1250.0))
    assert gospa(at(50), ORIGIN) == pytest.approx((50.0, 0.0, 1250.0, 1250.0))
    assert gospa(at(4, 300), at(0, 100)) == pytest.approx((math.sqrt(2516), 16.0, 1250.0, 1250.0))


def test_powers_or_distances():
    # Pairs 0 and 10 m apart, or both 6 m: the first have the lesser sum, the second the lesser sum of squares.
    angle = math.acos((36 + 36 - 100) / 72)
    tracks, truths = np.array([[0.0, 0.0], [6 * math.cos(angle), 6 * math.sin(angle)]]), np.array([[0.0, 0], [6, 0]])
    assert ospa(tracks, truths).distance == pytest.approx(6.0)
    assert ospa(tracks, truths, assign_by="distance").distance == pytest.approx(math.sqrt(50))
    assert gospa(tracks, truths).distance == pytest.approx(math.sqrt(72))


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda: ospa([[math.nan, 0, 0]], ORIGIN), "tracks must be finite, got nan"),
        (lambda: gospa(ORIGIN, [[0, math.inf, 0]]), "truths must be finite, got inf"),
        (lambda: ospa(np.zeros(3), ORIGIN), r"tracks must have shape \(n, d\)"),
        (lambda: ospa(np.zeros((1, 2)), ORIGIN), "same number of coordinates"),
        (lambda: ospa(ORIGIN, ORIGIN, cutoff=0), "cutoff must be positive"),
        (lambda: gospa(ORIGIN, ORIGIN, order=0.5), "order must be finite and at least 1"),
        (lambda: ospa(ORIGIN, ORIGIN, assign_by="luck"), "assign_by"),  # type: ignore[arg-type]
    ],
)
def test_what_cannot_be_used_is_named(call, says):
    with pytest.raises(ValueError, match=says):
        call()


sets = st.integers(0, 4).flatmap(lambda n: arrays(np.float64, (n, 3), elements=st.floats(-60, 60)))


def tried(tracks, truths, cutoff, order):
    """The least sum of cut-off powers over all ways to pair the smaller set into the larger one."""
    few, many = sorted((tracks, truths), key=len)
    sums = [
        sum(min(np.linalg.norm(a - many[k]), cutoff) ** order for a, k in zip(few, way, strict=True))
        for way in itertools.permutations(range(len(many)), len(few))
    ]
    return min(sums), len(many) - len(few), max(len(many), 1)


@given(tracks=sets, truths=sets, order=st.sampled_from([1.0, 2.0, 3.0]))
def test_nothing_is_less_than_what_trying_all_finds(tracks, truths, order):
    cost, surplus, n = tried(tracks, truths, 50.0, order)
    assert ospa(tracks, truths, order=order).distance == pytest.approx(
        ((cost + 50.0**order * surplus) / n) ** (1 / order), abs=1e-9
    )
    assert gospa(tracks, truths, order=order).distance == pytest.approx(
        (cost + 50.0**order / 2 * surplus) ** (1 / order), abs=1e-9
    )


@given(a=sets, b=sets, c=sets)
def test_they_are_metrics(a, b, c):
    for metric in (ospa, gospa):
        ab, ba, bc, ac = (metric(*pair).distance for pair in ((a, b), (b, a), (b, c), (a, c)))
        assert ab == pytest.approx(ba, abs=1e-9)
        assert ac <= ab + bc + 1e-6
        assert metric(a, a).distance == 0.0


@given(tracks=sets, truths=sets)
def test_parts_make_the_whole(tracks, truths):
    o, g = ospa(tracks, truths), gospa(tracks, truths)
    assert o.distance**2 == pytest.approx(o.localisation**2 + o.cardinality**2, abs=1e-6)
    assert g.distance**2 == pytest.approx(g.localisation + g.missed + g.false, abs=1e-6)
    assert ospa(tracks, truths, assign_by="distance").distance >= o.distance - 1e-9
