"""One plot for two aircraft: where it may lie, how dense it is there, and what it does to both tracks."""

import math

import numpy as np
import pytest

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
