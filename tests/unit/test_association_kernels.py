"""Clusters and joint association against plain enumeration."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.naive import multi_target as naive
from wideberth.tracking.multi_target.association_kernels import (
    event_count,
    find_clusters,
    joint_probabilities,
    shared_probabilities,
)

LARGEST = 4


def arrays(plots, ratio, none):
    n, width = len(plots), max([len(p) for p in plots] + [1])
    counts = np.array([len(p) for p in plots], np.int64)
    a, b = np.zeros((n, width), np.int64), np.zeros((n, width))
    for i in range(n):
        a[i, : len(plots[i])], b[i, : len(plots[i])] = plots[i], ratio[i]
    return counts, a, b, np.array(none)


def clusters_of(plots):
    counts, a, _, _ = arrays(plots, [[1.0] * len(p) for p in plots], [1.0] * len(plots))
    n, owner = len(plots), np.full(10, -1, np.int64)
    order, first = np.zeros(n, np.int64), np.zeros(n + 1, np.int64)
    k = find_clusters(n, counts, a, owner, np.zeros(n, np.int64), order, first)
    assert (owner == -1).all()
    return [sorted(order[first[q] : first[q + 1]].tolist()) for q in range(k)]


def joint(plots, ratio, none):
    counts, a, b, c = arrays(plots, ratio, none)
    n, beta, taken = len(plots), np.full((len(plots), a.shape[1] + 1), np.nan), np.zeros(10, np.int64)
    joint_probabilities(np.arange(n), 0, n, counts, a, b, c, beta, taken, np.zeros(n, np.int64), np.zeros(n + 1))
    assert not taken.any()
    return [beta[i, : counts[i] + 1].tolist() for i in range(n)]


def shared(plots, ratio, none):
    counts, a, b, c = arrays(plots, ratio, none)
    n, beta, claims = len(plots), np.zeros((len(plots), a.shape[1] + 1)), np.zeros(10)
    shared_probabilities(np.arange(n), 0, n, counts, a, b, c, beta, claims)
    assert not claims.any()
    return [beta[i, : counts[i] + 1].tolist() for i in range(n)]


def test_clusters_hang_together_by_shared_plots():
    assert clusters_of([[0], [1], [1, 2], [], [2, 3], [4]]) == [[0], [1, 2, 4], [3], [5]]
    assert clusters_of([[3], [2], [2, 3]]) == [[0, 1, 2]]
    assert clusters_of([]) == []


@st.composite
def scenes(draw):
    plots = draw(st.lists(st.lists(st.integers(0, 5), max_size=3, unique=True), min_size=1, max_size=LARGEST))
    number = st.floats(1e-3, 1e6)
    ratio = [[draw(number) for _ in p] for p in plots]
    none = [draw(st.floats(1e-6, 1.0)) for _ in plots]
    return plots, ratio, none


@given(scenes())
def test_joint_probabilities_are_those_of_all_events(scene):
    for got, want in zip(joint(*scene), naive.joint_association(*scene), strict=True):
        assert got == pytest.approx(want, rel=1e-9, abs=1e-12)


@given(scenes())
def test_clusters_are_the_connected_components(scene):
    plots = scene[0]
    groups = [{i} for i in range(len(plots))]
    for i, p in enumerate(plots):
        for j in range(i):
            if set(p) & set(plots[j]):
                a = next(g for g in groups if i in g)
                b = next(g for g in groups if j in g)
                if a is not b:
                    groups.remove(b)
                    a |= b
    assert sorted(clusters_of(plots)) == sorted(sorted(g) for g in groups)


@given(scenes())
def test_shared_probabilities_are_probabilities(scene):
    for row in shared(*scene):
        assert sum(row) == pytest.approx(1.0) or sum(row) >= 1.0
        assert all(0.0 <= b <= 1.0 + 1e-12 for b in row)


def test_sharing_is_exact_for_one_track_with_one_plot():
    scene = ([[0]], [[3.0]], [0.5])
    assert shared(*scene)[0] == pytest.approx(joint(*scene)[0])


def test_event_count_stops_at_the_limit():
    counts = np.full(40, 8, np.int64)
    assert event_count(np.arange(40), 0, 40, counts, 5000) == 5001
    assert event_count(np.arange(40), 0, 2, counts, 5000) == 81
