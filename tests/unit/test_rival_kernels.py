"""Whose track makes an aircraft's reports: the evidence report by report, against a joint distribution."""

import math

import numpy as np
import pytest

from tests.naive import fusion as naive
from wideberth.tracking.multi_target.bank_kernels import CONFIRMED, make_bank
from wideberth.tracking.multi_target.buffers_kernels import make_scratch
from wideberth.tracking.multi_target.config import MultiTargetConfig
from wideberth.tracking.multi_target.consider_kernels import POSITION_TIME_S
from wideberth.tracking.multi_target.heard_kernels import RIVALS, make_heard
from wideberth.tracking.multi_target.imm_kernels import HYPOTHESES
from wideberth.tracking.multi_target.report_kernels import CAPPED_SQUARE
from wideberth.tracking.multi_target.rival_kernels import (
    FADE_S,
    LARGEST_STEP,
    MOST_BEHIND,
    enter,
    is_denied,
    place_of_rival,
    renumber_rivals,
    score_of,
    settle_scores,
    weigh_rival,
    weigh_rivals,
)
from wideberth.tracking.multi_target.state import motion_of

MOTION = motion_of(MultiTargetConfig())
R = np.array([25.0, 25.0, 100.0, 4.0, 4.0, 1.0])


def ears(users=1):
    heard = make_heard(users)
    heard.bias[:] = [1400.0, 1400.0, 500.0, 0.0]
    return heard


@pytest.mark.parametrize("seed", range(5))
def test_the_offset_is_that_of_all_reports_together(seed):
    rng = np.random.default_rng(seed)
    heard, n = ears(), 12
    x, p = np.zeros(9), np.diag(rng.uniform(0.5, 4.0, size=9))
    assert enter(heard, 0, 7) == 0 and heard.rival[0, 0] == 7
    bias = rng.normal(size=3) * [30.0, 30.0, 20.0]
    z = np.full((n, 6), np.nan)
    z[:, :3] = bias + rng.normal(size=(n, 3)) * np.sqrt(R[:3])
    squares = []
    for k in range(n):
        square, spread = weigh_rival(heard, 0, 0, 0.0, 1.0, x, p, z[k], R, 0.0)
        assert math.isfinite(spread)
        squares.append(square)
    expected = np.zeros(n)
    for axis in range(3):
        drift = 2.0 * heard.bias[0, axis] / POSITION_TIME_S if axis < 2 else 0.0
        white = np.full(n, R[axis] + p[axis, axis])
        mean, variance, each = naive.constant_offset(z[:, axis], np.zeros(n), white, heard.bias[0, axis], drift)
        assert heard.offset[0, 0, 0, axis] == pytest.approx(mean, rel=1e-9)
        assert heard.offset[0, 0, 1, axis] == pytest.approx(variance, rel=1e-9)
        expected += np.minimum(each, CAPPED_SQUARE)
    np.testing.assert_allclose(squares, expected, rtol=1e-9)


def test_a_report_before_the_track_is_compared_with_where_it_was():
    heard, x, p = ears(), np.zeros(9), np.eye(9)
    x[:3], x[3:6], x[6:] = [100.0, -50.0, 10.0], [20.0, 5.0, -1.0], [2.0, -1.0, 0.5]
    age = 0.7
    z = np.concatenate([x[:3] - age * x[3:6] + 0.5 * age**2 * x[6:], x[3:6] - age * x[6:]])
    enter(heard, 0, 1)
    square, _ = weigh_rival(heard, 0, 0, age, 1.0, x, p, z, R, 0.1)
    assert square == pytest.approx(0.0, abs=1e-18)
    z[3] += 100.0
    assert weigh_rival(heard, 0, 0, age, 1.0, x, p, z, R, 0.1)[0] == pytest.approx(CAPPED_SQUARE)


def test_scores_fade_stay_between_zero_and_the_most_and_one_report_decides_nothing():
    heard = ears()
    heard.rival[0, :3] = 1, 2, 3
    told = np.array([5.0, 8.0, 1000.0, np.nan])
    settle_scores(heard, 0, told, 1.0)
    assert heard.score[0].tolist() == [0.0, 3.0, LARGEST_STEP, 0.0]
    settle_scores(heard, 0, np.array([8.0, 5.0, 5.0, np.nan]), FADE_S)
    np.testing.assert_allclose(heard.score[0, :3], np.array([3.0, 3.0 / math.e, LARGEST_STEP / math.e]) - 3.0 / math.e)
    for _ in range(50):
        settle_scores(heard, 0, np.array([0.0, 99.0, 99.0, np.nan]), 0.1)
    assert score_of(heard, 0, 2) == MOST_BEHIND and score_of(heard, 0, 1) == 0.0 and score_of(heard, 0, 99) == 0.0


def test_places_are_found_renumbered_and_taken_over():
    heard = ears(2)
    for number in range(1, RIVALS + 1):
        assert enter(heard, 1, number) == number - 1
    assert enter(heard, 1, 9) == -1
    heard.score[1, 2] = MOST_BEHIND
    assert enter(heard, 1, 9) == 2 and place_of_rival(heard, 1, 3) == -1
    renumber_rivals(heard, 9, 4 + RIVALS)
    assert place_of_rival(heard, 1, 4 + RIVALS) == 2 and place_of_rival(heard, 0, 4 + RIVALS) == -1
    heard.denied[1, 2] = 5.0
    assert is_denied(heard, 1, 4 + RIVALS, 4.0) and not is_denied(heard, 1, 4 + RIVALS, 6.0)


@pytest.mark.parametrize("speed", [0.0, 6.0])
def test_of_two_tracks_the_one_that_goes_with_the_reports_wins_and_a_ghost_is_denied(speed):
    """Tracks 10 m apart; the second one moves sideways against the reports, or not."""
    rng = np.random.default_rng(3)
    heard, bank, s = ears(), make_bank(2), make_scratch(2, 4, 4)
    bank.size[:] = 2, 3
    bank.mu[:], bank.status[:], bank.identity[:] = [0.9, 0.05, 0.05], CONFIRMED, [1, 2]
    heard.surprise[0] = 4.0
    for k in range(15):
        t = float(k)
        bank.t[:] = t
        for i, (north, east, v) in enumerate(((20.0 * t, 0.0, 0.0), (20.0 * t, 10.0 + speed * t, speed))):
            bank.x[i] = np.array([north, east, -100.0, 20.0, v, 0.0, 0.0, 0.0, 0.0])
            bank.p[i] = np.diag([4.0] * 3 + [0.25] * 3 + [0.01] * 3)
        z = np.array([20.0 * t, 25.0, -90.0, 20.0, 0.0, 0.0]) + rng.normal(size=6) * np.sqrt(R)
        weigh_rivals(bank, heard, 0, np.ones(2, np.int64), t, z, R, 0.06, 0.0, MOTION, s)
    assert heard.rival[0, :2].tolist() == [1, 2]
    assert not is_denied(heard, 0, 1, 9.2)
    if speed:
        assert score_of(heard, 0, 1) == 0.0 and score_of(heard, 0, 2) > 18.4 and is_denied(heard, 0, 2, 18.4)
    else:
        assert max(heard.score[0, :2]) < 9.2
    bank.size[0] = 1
    weigh_rivals(bank, heard, 0, np.zeros(2, np.int64), 15.0, z, R, 0.06, 0.0, MOTION, s)
    assert place_of_rival(heard, 0, 2) == -1 and bank.mu.shape[1] == HYPOTHESES
