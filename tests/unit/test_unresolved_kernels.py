"""One plot for two aircraft: where it may lie, how dense it is there, and what it does to both tracks."""

import math

import numpy as np
import pytest

from tests.naive import multi_target as naive
from wideberth.tracking.multi_target.absorb_kernels import absorb, allow_shared, associate, keep_nis
from wideberth.tracking.multi_target.bank_kernels import CONFIRMED, make_bank
from wideberth.tracking.multi_target.buffers_kernels import COUNTS, make_scratch
from wideberth.tracking.multi_target.imm_kernels import HYPOTHESES
from wideberth.tracking.multi_target.unresolved_kernels import (
    UNRESOLVED,
    both_density,
    claim_merged,
    find_unresolved,
    off_line,
)
from wideberth.tracking.multi_target.window_kernels import make_window

VARIANCE = np.array([0.16, math.radians(1.0) ** 2, math.radians(1.0) ** 2, np.nan])


def direction(azimuth, elevation=0.4):
    ce = math.cos(elevation)
    return np.array([ce * math.cos(azimuth), ce * math.sin(azimuth), -math.sin(elevation)])


def aim(distance, azimuth, elevation=0.4, spread=(0.04, 4.0)):
    return np.array([*direction(azimuth, elevation), distance, azimuth, elevation, *spread])


def density(distance, azimuth, a, b, elevation=0.4):
    z = np.array([distance, azimuth, elevation, np.nan])
    return both_density(a, b, z, VARIANCE, direction(azimuth, elevation))


def test_the_angle_off_a_line_is_that_of_geometry():
    a, b = aim(400.0, -0.1, 0.0), aim(400.0, 0.1, 0.0)
    assert off_line(a, b, direction(0.0, 0.0)) == pytest.approx(0.0, abs=6e-3)
    assert off_line(a, b, direction(0.02, 0.05)) == pytest.approx(0.05, abs=2e-3)
    assert off_line(a, b, direction(0.2, 0.0)) == pytest.approx(0.1, abs=1e-3)
    a = aim(400.0, -0.1)
    assert off_line(a, a, direction(-0.1, 0.5)) == pytest.approx(0.1, abs=1e-3)


def test_a_merged_plot_lies_between_and_nowhere_else():
    a, b = aim(400.0, -0.08), aim(400.5, 0.08)
    assert density(400.0, 0.0, a, b) > 0.0 and density(399.0, 0.01, a, b) > 0.0
    assert density(405.0, 0.0, a, b) == 0.0 and density(400.0, 0.0, a, b, elevation=0.5) == 0.0
    assert density(400.0, 0.2, a, b) == 0.0
    assert density(400.0, 0.0, aim(400.0, -0.08), aim(410.0, 0.08)) == 0.0
    assert density(400.0, 0.0, aim(400.0, -0.5), aim(400.0, 0.5)) == 0.0


def test_the_density_is_a_density():
    """Its integral over the elements is one, less what the gates cut off."""
    a, b = aim(400.0, -0.05), aim(400.0, 0.05)
    ranges, azimuths, elevations = np.linspace(397, 403, 41), np.linspace(-0.15, 0.15, 61), np.linspace(0.3, 0.5, 41)
    cell = 400.0**2 * (ranges[1] - ranges[0]) * (azimuths[1] - azimuths[0]) * (elevations[1] - elevations[0])
    total = sum(density(r, az, a, b, el) * cell * math.cos(el) for r in ranges for az in azimuths for el in elevations)
    assert 0.9 < total < 1.05


@pytest.mark.parametrize("seed", range(4))
def test_the_density_is_that_of_the_naive_twin(seed):
    rng = np.random.default_rng(seed)
    found = 0
    for _ in range(300):
        a = aim(400.0, 0.0, 0.4, rng.uniform(0.01, [1.0, 30.0]))
        b = aim(
            400.0 + rng.normal(0, 1.5), rng.normal(0, 0.2), 0.4 + rng.normal(0, 0.05), rng.uniform(0.01, [1.0, 30.0])
        )
        share = rng.uniform(-0.2, 1.2)
        z = (1.0 - share) * a[3:6] + share * b[3:6] + rng.normal(size=3) * [1.0, 0.04, 0.04]
        sight = direction(z[1], z[2])
        z = np.append(z, np.nan)
        if rng.random() < 0.3:
            z[2] = np.nan
        expected = naive.merged_density(a, b, z, VARIANCE, sight)
        assert both_density(a, b, z, VARIANCE, sight) == pytest.approx(expected, rel=1e-3)
        found += expected > 0.0
    assert 60 < found < 290


def scene(plots, status=CONFIRMED):
    """Two tracks at 400 m, 0.12 rad apart, and some plots (range, azimuth)."""
    n = len(plots)
    bank, s, window = make_bank(2), make_scratch(2, 4, 4), make_window(2, 4)
    window.cursor[:] = 0, 1
    window.density[0], window.field_of_view[0], window.attitude[0] = 1e-8, [math.pi, math.pi / 2], np.eye(3)
    bank.size[:], bank.status[:], bank.existence[:] = [2, 3], status, 0.99
    s.seen[:], s.ranges[:] = 0.8, [400.0, 400.3]
    s.aim[0], s.aim[1] = aim(400.0, -0.06), aim(400.3, 0.06)
    for m, (distance, azimuth) in enumerate(plots):
        s.z[m], s.variance[m] = [distance, azimuth, 0.4, np.nan], VARIANCE
        s.sight[m], s.key[m], s.order[m] = direction(azimuth), distance, m
    s.order[:n] = np.argsort(s.key[:n], kind="stable")
    return bank, window, s, find_unresolved(bank, window, n, False, s)


def test_one_plot_between_two_tracks_is_both_and_two_are_one_of_each():
    _, _, s, pairs = scene([(400.0, 0.01)])
    assert pairs == 1 and s.pairs[0].tolist() == [0, 1, 0]
    assert s.unresolved[:2].tolist() == [UNRESOLVED] * 2 and s.shared[0] == s.shared[1] > 100.0
    for plots in ([(400.0, -0.06), (400.2, 0.06)], [], [(450.0, 0.0)]):
        _, _, s, pairs = scene(plots)
        assert pairs == 0 and not s.unresolved.any()
    assert scene([(400.0, 0.01)], status=0)[3] == 0


@pytest.mark.parametrize("flat", [False, True])
@pytest.mark.parametrize("seed", range(5))
def test_pairs_are_those_of_the_naive_twin(seed, flat):
    """Twelve tracks in a small part of the sky, some tentative or unseen, and 6 plots."""
    rng = np.random.default_rng(seed)
    tracks, n, tilt = 12, 6, 0.4
    bank, s, window = make_bank(tracks), make_scratch(tracks, 16, 4), make_window(2, 16)
    window.cursor[:] = 0, 1
    window.density[0], window.field_of_view[0], window.attitude[0] = 1e-8, [math.pi, math.pi / 2], np.eye(3)
    bank.size[:], bank.status[:] = [tracks, tracks + 1], rng.random(tracks) < 0.9
    s.seen[:] = 0.8 * (rng.random(tracks) < 0.9)
    for i in range(tracks):
        s.aim[i] = aim(
            400.0 + rng.normal(0, 3.0), rng.normal(0, 0.3), tilt + rng.normal(0, 0.1), rng.uniform(0.01, [0.3, 9])
        )
    s.ranges[:] = s.aim[:, 3]
    for m in range(n):
        i, j = rng.integers(tracks, size=2)
        r, azimuth, elevation = 0.5 * (s.aim[i, 3:6] + s.aim[j, 3:6]) + rng.normal(size=3) * [0.5, 0.01, 0.01]
        s.sight[m], s.variance[m], s.key[m] = direction(azimuth, elevation), VARIANCE, r
        s.z[m] = [r, azimuth, np.nan if flat else elevation, np.nan]
    s.order[:n] = np.argsort(s.key[:n])
    order = np.argsort(s.ranges)
    order = order[(bank.status[order] == CONFIRMED) & (s.seen[order] > 0.0)]
    density = np.zeros((len(order), len(order), n))
    for i, a in enumerate(s.aim[order]):
        for j, b in enumerate(s.aim[order]):
            for m in range(n):
                sight = direction(s.z[m, 1], 0.5 * (a[5] + b[5])) if flat else s.sight[m]
                density[i, j, m] = naive.merged_density(a, b, s.z[m], VARIANCE, sight)
    expected = naive.shared_plots(density)
    pairs = find_unresolved(bank, window, n, False, s)
    found = {(i, j): m for i, j, m in s.pairs[:pairs].tolist()}
    assert found == {(order[i], order[j]): m for (i, j), m in expected.items()} and found
    shared = np.zeros(tracks)
    for (i, j), m in expected.items():
        height = 2.0 * s.aim[order[i], 3] * math.pi / 2 if flat else 1.0
        for k in (order[i], order[j]):
            shared[k] = max(shared[k], density[i, j, m] / (1e-8 * height))
    np.testing.assert_allclose(s.shared, shared, rtol=1e-3)
    np.testing.assert_array_equal(s.unresolved, UNRESOLVED * (shared > 0.0))


def test_neither_of_two_that_share_a_plot_is_missed_and_the_plot_is_explained():
    for plots, lost in (([(400.0, 0.0)], False), ([], True)):
        bank, _, s, pairs = scene(plots)
        for i in range(2):
            s.missed[i], s.none[i] = bank.existence[i] * 0.2, 1.0 - bank.existence[i] * 0.8
            if s.unresolved[i] > 0.0:
                allow_shared(bank, i, s.unresolved[i], s.shared[i], s)
            bank.mu[i] = 1.0 / HYPOTHESES
        associate(2, 100, np.zeros(COUNTS, np.int64), s)
        for i in range(2):
            assert absorb(bank, i, 0.999, s) == pytest.approx(0.0)
        assert (bank.existence[:2] < 0.97).all() == lost and (bank.existence[:2] > 0.99).all() != lost
        mine = np.zeros(4)
        claim_merged(pairs, mine, s)
        assert mine[0] == (0.0 if lost else UNRESOLVED)


def test_the_nis_is_that_of_the_likeliest_plot_over_the_hypotheses():
    bank, s = make_bank(1), make_scratch(1, 4, 4)
    s.counts[0], s.plots[0, :2], s.beta[0, :3] = 2, [3, 1], [0.1, 0.2, 0.7]
    s.likelihood[0, 1], s.nis[0, 1] = [0.5, 0.3, 0.2], [3.0, 2.0, 1.0]
    s.z[1] = [100.0, 0.1, np.nan, 5.0]
    keep_nis(bank, 0, s)
    assert bank.nis[0] == pytest.approx(2.3) and bank.nis_dof[0] == 3.0
