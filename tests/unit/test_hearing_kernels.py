"""What reports make of the filters by address, and whose radar track an aircraft is found to be."""

import numpy as np
import pytest

from tests.naive import fusion as naive
from tests.naive import multi_target as imm
from wideberth.tracking.multi_target.bank_kernels import CONFIRMED, TENTATIVE, make_bank, make_motion_scratch
from wideberth.tracking.multi_target.buffers_kernels import make_scratch
from wideberth.tracking.multi_target.config import MultiTargetConfig, ReportsConfig
from wideberth.tracking.multi_target.hand_over_kernels import drop_silent, hand_back, report_heard
from wideberth.tracking.multi_target.heard_kernels import advance, make_heard, remember, start
from wideberth.tracking.multi_target.heard_ownship_kernels import find_heard_ownship
from wideberth.tracking.multi_target.hearing_kernels import (
    AGAIN,
    ALTITUDE_AGAIN,
    NO_HEIGHT,
    NO_PLACE,
    NO_POSITION,
    NOT_NEW,
    OUTSIDE,
    REPORT_COUNTS,
    SECOND_USER,
    STARTED,
    SUPPORT,
    USED,
    agreeing,
    rescale,
    settle_report,
    start_again,
    support,
    take_report,
)
from wideberth.tracking.multi_target.identity_kernels import (
    CARRIED_ON,
    FALLEN_SILENT,
    HEARD_NOW,
    IS,
    IS_NOT,
    ONE_WITH,
    find_identities,
    find_identity,
    find_slots,
    link,
    new_number,
    note,
    separation,
    split,
    take_reports,
    witness,
)
from wideberth.tracking.multi_target.imm_kernels import HYPOTHESES, STRAIGHT
from wideberth.tracking.multi_target.life_kernels import HANDED_BACK
from wideberth.tracking.multi_target.report_kernels import make_report_scratch
from wideberth.tracking.multi_target.reports import report_rules
from wideberth.tracking.multi_target.state import motion_of
from wideberth.tracking.ownship_kernels import FLAG, OwnshipTest, identify

CONFIG = MultiTargetConfig()
MOTION, RULES = motion_of(CONFIG), report_rules(ReportsConfig(), 0.999)
VARIANCE, BIAS = np.array([25.0, 25, 9, 1, 1, 1]), np.array([900.0, 900, 500, 0.09])
PLACE, SPEED = np.array([1000.0, -500.0, -300.0]), np.array([40.0, 10.0, 0.0])


class Ears:
    """Filters of a few addresses, a bank of radar tracks, and a place for events."""

    def __init__(self, users=3, tracks=4):
        self.filters, self.heard, self.bank = make_bank(users), make_heard(users), make_bank(tracks)
        self.heard.bias[:] = BIAS
        self.counts, self.m, self.s = np.zeros(REPORT_COUNTS, np.int64), make_motion_scratch(), make_report_scratch()
        self.events, self.event_count = np.zeros((20, 4), np.int64), np.zeros(1, np.int64)
        self.scratch = make_scratch(tracks, 4, 4)
        self.bank.t[:] = 0.0

    def take(self, t, place=None, row=0, **change):
        z = np.concatenate([PLACE + t * SPEED if place is None else place, SPEED])
        for k, value in change.items():
            z[int(k[1:])] = value
        return take_report(
            self.filters, self.heard, row, t, z, VARIANCE, 0.06, RULES, MOTION, self.counts, self.m, self.s
        )

    def add(self, x, sigma=(3.0, 1.0), status=CONFIRMED, identity=None):
        i = int(self.bank.size[0])
        self.bank.size[0] += 1
        self.bank.mu[i] = np.array([0.8, 0.1, 0.1])
        self.bank.x[i, :, :] = np.concatenate([x, np.zeros(3)])
        for j in range(HYPOTHESES):
            acceleration = 0.0 if j == STRAIGHT else 1.0
            self.bank.p[i, j] = np.diag([sigma[0] ** 2] * 3 + [sigma[1] ** 2] * 3 + [acceleration] * 3)
        self.bank.status[i], self.bank.address[i], self.bank.existence[i] = status, -1, 0.9
        self.bank.identity[i] = new_number(self.bank) if identity is None else identity
        self.bank.size[1] = max(self.bank.size[1], self.bank.identity[i] + 1)
        return i

    def told(self):
        n = int(self.event_count[0])
        self.event_count[0] = 0
        return [tuple(e) for e in self.events[:n].tolist()]

    def parts(self):
        return self.bank, self.filters, self.heard, RULES, MOTION, self.events, self.event_count, self.scratch

    def find(self, u=0, fits=True):
        find_identity(
            self.bank, self.filters, self.heard, u, fits, RULES, MOTION, self.events, self.event_count, self.scratch
        )


def test_what_becomes_of_a_report():
    ears = Ears()
    nan = np.nan
    assert ears.take(0.0, _0=nan) == (0, NO_PLACE)
    assert Ears().take(0.0, _2=nan) == (0, NO_HEIGHT)
    assert ears.take(1.0, _2=nan) == (0, STARTED)  # with the altitude of a second ago
    assert ears.take(2.0) == (0, USED) and ears.take(2.0) == (0, NOT_NEW)
    assert ears.take(2.5, _1=nan) == (0, NO_POSITION)
    assert ears.take(3.0, PLACE + 5000.0) == (0, OUTSIDE)
    assert ears.heard.reports[0] == 2 and ears.heard.heard[0] == 2.0


def test_positions_elsewhere_that_agree_begin_again_or_are_a_second_aircraft():
    ears = Ears()
    ears.take(0.0)
    ears.take(1.0)
    away = PLACE + np.array([4000.0, 0, 0])
    codes = [ears.take(t, away + t * SPEED)[1] for t in (2.0, 3.0, 4.0)]
    assert codes == [OUTSIDE, OUTSIDE, AGAIN]
    two = Ears()
    two.take(0.0)
    codes = []
    for t in (1.0, 2.0, 3.0):
        assert two.take(t)[1] == USED
        codes.append(two.take(t + 0.5, away + (t + 0.5) * SPEED)[1])
    assert codes == [OUTSIDE, OUTSIDE, SECOND_USER]
    two.heard.other[0] = 1
    assert two.take(3.9, away + 3.9 * SPEED) == (1, STARTED)
    # From then on each has its own.
    assert two.take(4.0) == (0, USED) and two.take(4.5, away + 4.5 * SPEED) == (1, USED)


@pytest.mark.parametrize("seed", range(6))
def test_three_places_agree_where_they_lie_on_a_line_that_can_be_flown(seed):
    rng = np.random.default_rng(seed)
    ears, points = Ears(), rng.uniform(-300.0, 300.0, size=(3, 2))
    times = np.cumsum(rng.uniform(0.3, 2.0, size=3))
    got = [
        agreeing(ears.heard, 0, t, np.array([*p, 0, 0, 0, 0]), 350.0, 100.0) for t, p in zip(times, points, strict=True)
    ]
    span = times[2] - times[0]
    line = points[0] + (times[1] - times[0]) / span * (points[2] - points[0])
    right = np.linalg.norm(points[2] - points[0]) <= 350.0 * span + 100.0
    right = right and np.linalg.norm(points[1] - line) <= 100.0 + 5.0 * span**2
    assert got == [False, False, right]


def test_beginning_again_takes_the_velocity_of_the_places():
    ears = Ears()
    ears.take(0.0)
    kept = ears.heard.rejected[0]
    for k, t in enumerate((1.0, 2.0, 3.0)):
        kept[k] = t, 500.0 + 20.0 * t, 7.0
    z = np.array([560.0, 7.0, -100.0, 99.0, 99.0, 1.0])
    start_again(ears.filters, ears.heard, 0, 0, 3.0, z, VARIANCE, RULES, MOTION)
    assert np.allclose(ears.filters.x[0, 0, 3:6], [20.0, 0.0, 1.0]) and ears.heard.rejects[0] == 0


def test_an_altitude_that_stays_elsewhere_is_taken_up():
    ears = Ears()
    ears.take(0.0)
    for k in range(1, 7):
        t = 0.5 * k
        z = np.concatenate([PLACE + t * SPEED, SPEED])
        z[2] -= 2000.0
        settle_report(ears.filters, ears.heard, 0, t, z, VARIANCE, 0.06, RULES, MOTION, ears.counts, ears.m, ears.s)
    assert ears.counts[ALTITUDE_AGAIN] == 1 and abs(ears.filters.x[0, 0, 2] + 2300.0) < 50.0


def test_remember_start_and_advance():
    ears = Ears()
    z = np.array([np.nan, np.nan, -100.0, 3.0, 4.0, np.nan])
    remember(ears.heard, 0, 1.0, z)
    assert ears.heard.velocity[0, :3].tolist() == [1.0, 3.0, 4.0] and ears.heard.altitude[0].tolist() == [1.0, -100.0]
    start(ears.filters, ears.heard, 0, 2.0, np.array([10.0, 20, np.nan, 0, 0, np.nan]), VARIANCE, RULES, MOTION)
    assert np.allclose(ears.filters.x[0, 0, :6], [10.9, 21.2, -100.0, 3.0, 4.0, 0.0])
    before = ears.filters.x[0, STRAIGHT].copy()
    ears.filters.mu[0] = np.array([1.0, 0.0, 0.0])
    advance(ears.filters, ears.heard, 0, 1.5, MOTION, ears.m)
    assert ears.heard.t[0] == 2.0
    advance(ears.filters, ears.heard, 0, 2.5, MOTION, ears.m)
    assert ears.heard.t[0] == 2.5
    assert np.allclose(ears.filters.x[0, STRAIGHT, :3], before[:3] + 0.5 * before[3:6], atol=1e-6)


def test_a_report_supports_the_radar_track_of_its_aircraft():
    ears = Ears()
    ears.take(0.0)
    i = ears.add(np.concatenate([PLACE, SPEED]))
    ears.bank.existence[i], ears.bank.address[i] = 0.3, 0
    z = np.concatenate([PLACE + 10.0, SPEED])
    rules = (VARIANCE, 0.06, RULES, ears.s)
    assert support(ears.bank, ears.heard, 0, i, 0.0, z, *rules) and ears.bank.existence[i] == SUPPORT
    assert not support(ears.bank, ears.heard, 0, i, 0.0, z + 1000.0, *rules)


@pytest.mark.parametrize("factor", [0.25, 1.0, 4.0])
def test_another_accuracy_leaves_the_errors_what_they_are(factor):
    """A smaller bias takes its share of the covariance with it, a larger one adds none."""
    ears = Ears()
    ears.take(0.0)
    before = ears.filters.cross.copy()
    rescale(ears.bank, ears.filters, ears.heard, 0, factor * BIAS)
    assert np.allclose(ears.heard.bias[0], factor * BIAS)
    assert np.allclose(ears.filters.cross, before * min(factor, 1.0))
    for j in range(HYPOTHESES):
        whole = np.block(
            [
                [ears.filters.p[0, j], ears.filters.cross[0, j]],
                [ears.filters.cross[0, j].T, np.diag(ears.heard.bias[0])],
            ]
        )
        assert np.linalg.eigvalsh(whole).min() > -1e-6


def test_the_witness_and_how_far_a_track_is_from_it():
    ears = Ears()
    ears.take(0.0)
    i = ears.add(np.concatenate([PLACE + 30.0, SPEED + 1.0]))
    mean, covariance = imm.mixture(ears.filters.mu[0], ears.filters.x[0], ears.filters.p[0])
    witness(ears.filters, 0, 0.4, MOTION, ears.scratch)
    f = np.eye(9)
    f[:3, 3:6], f[:3, 6:], f[3:6, 6:] = 0.4 * np.eye(3), 0.08 * np.eye(3), 0.4 * np.eye(3)
    np.testing.assert_allclose(ears.scratch.x[:6], (f @ mean)[:6], atol=1e-9)
    # Where straight, the acceleration is reported with a small spread of its own.
    np.testing.assert_allclose(ears.scratch.p[:6, :6], (f @ covariance @ f.T)[:6, :6], atol=0.05)
    x, p = imm.mixture(ears.bank.mu[i], ears.bank.x[i], ears.bank.p[i])
    d, s = x[:6] - ears.scratch.x[:6], p[:6, :6] + ears.scratch.p[:6, :6]
    square, score = separation(ears.bank, i, MOTION, ears.scratch)
    assert square == pytest.approx(d @ np.linalg.solve(s, d), rel=1e-6)
    assert score == pytest.approx(square + np.linalg.slogdet(s)[1], rel=1e-6)


@pytest.mark.parametrize("seed", range(12))
def test_the_track_that_is_found_is_the_naive_one(seed):
    rng = np.random.default_rng(seed)
    ears = Ears()
    for t in range(4):
        ears.take(float(t))
    ears.bank.t[:] = 3.0
    x = np.concatenate([PLACE + 3.0 * SPEED, SPEED])
    for _ in range(3):
        ears.add(x + np.concatenate([60.0 * rng.normal(size=3), 4.0 * rng.normal(size=3)]))
    ears.heard.waits[0] = waited = int(rng.integers(2)) * RULES.waits
    witness(ears.filters, 0, 0.0, MOTION, ears.scratch)
    scores = [separation(ears.bank, i, MOTION, ears.scratch) for i in range(3)]
    ears.find()
    expected = naive.identity(scores, RULES.link_gate, RULES.lead, waited > 0)
    assert ears.heard.slot[0] == (-1 if expected is None else expected)
    assert np.flatnonzero(ears.bank.address[:3] == 0).tolist() == ([] if expected is None else [expected])


def test_linking_and_splitting_keep_the_older_number():
    ears = Ears()
    ears.take(0.0)
    i = ears.add(np.concatenate([PLACE, SPEED]), identity=7)
    ears.heard.number[0], ears.heard.status[0] = 3, CONFIRMED
    link(ears.bank, ears.heard, 0, i, RULES, ears.events, ears.event_count)
    assert ears.told() == [(ONE_WITH, 3, 0, 7), (IS, 3, 0, -1)] and ears.bank.identity[i] == 3
    find_slots(ears.bank, ears.heard)
    assert ears.heard.slot.tolist() == [i, -1, -1]
    split(ears.bank, ears.heard, 0, ears.events, ears.event_count)
    assert ears.told() == [(IS_NOT, 3, 0, -1)] and ears.heard.number[0] == 8 and ears.bank.address[i] == -1
    for _ in range(30):
        note(ears.events, ears.event_count, IS, 1, 2, 3)
    assert ears.event_count[0] == len(ears.events)


def test_a_track_that_no_longer_fits_loses_its_address_after_some_reports():
    ears = Ears()
    for t in range(4):
        ears.take(float(t))
    ears.bank.t[:] = 3.0
    ears.heard.slot[0] = i = ears.add(np.concatenate([PLACE + 500.0, SPEED]))
    ears.bank.address[i] = 0
    for _ in range(RULES.strikes):
        assert ears.heard.slot[0] == i
        ears.find(fits=False)
    assert ears.heard.slot[0] == -1


def test_reports_become_a_confirmed_track_and_find_the_radar_track_that_came_later():
    ears = Ears()
    one = np.zeros(1, np.int64)
    for t in range(4):
        z = np.concatenate([PLACE + t * SPEED, SPEED])[None]
        arrays = (one, np.array([float(t)]), z, VARIANCE[None], np.array([0.06]), BIAS[None])
        take_reports(
            ears.bank, ears.filters, ears.heard, *arrays, 0, RULES, MOTION, one.copy(), one.copy(), ears.counts,
            ears.events, ears.event_count, ears.scratch, ears.s,
        )  # fmt: skip
    assert [e[0] for e in ears.told()] == [HEARD_NOW] and ears.counts[STARTED] == 1 and ears.counts[USED] == 3
    ears.bank.t[:] = 3.0
    i = ears.add(np.concatenate([PLACE + 3.0 * SPEED, SPEED]))
    find_identities(*ears.parts())
    assert [e[0] for e in ears.told()] == [ONE_WITH, IS] and ears.bank.address[i] == 0
    ears.bank.existence[i] = HANDED_BACK
    number = int(ears.bank.identity[i])
    hand_back(*ears.parts())
    assert [e[:2] for e in ears.told()] == [(CARRIED_ON, number)] and ears.bank.size[0] == 0
    assert ears.heard.number[0] == number and ears.heard.status[0] == CONFIRMED
    drop_silent(ears.bank, ears.heard, 3.0 + RULES.keep_s, RULES, ears.events, ears.event_count)
    assert ears.told() == [] and ears.heard.alive[0] == 1
    drop_silent(ears.bank, ears.heard, 3.1 + RULES.keep_s, RULES, ears.events, ears.event_count)
    assert [e[0] for e in ears.told()] == [FALLEN_SILENT] and ears.heard.alive[0] == 0


def test_a_filter_is_reported_at_the_time_asked_for():
    ears = Ears()
    ears.take(0.0)
    assert ears.heard.status[0] == TENTATIVE
    x, p, zero = np.zeros((1, 9)), np.zeros((1, 9, 9)), np.zeros(1, np.int64)
    kept = ears.filters.x.copy()
    report_heard(ears.filters, ears.heard, zero, 2.0, MOTION, make_bank(1), x, p, ears.scratch)
    assert np.array_equal(kept, ears.filters.x)
    assert np.allclose(x[0, :3], kept[0, 0, :3] + 2.0 * SPEED, atol=1e-3) and np.linalg.eigvalsh(p[0]).min() > 0.0
    advance(ears.filters, ears.heard, 0, 2.0, MOTION, ears.m)
    mean, covariance = imm.mixture(ears.filters.mu[0], ears.filters.x[0], ears.filters.p[0])
    assert np.allclose(mean[:6], x[0, :6], atol=0.1)
    np.testing.assert_allclose(p[0, :6, :6], covariance[:6, :6], rtol=0.02, atol=0.5)


def find_heard(ears, t, telemetry, covariance, test, addressed=False):
    parts = (telemetry, covariance, MOTION, test, addressed, ears.events, ears.event_count, ears.scratch)
    return find_heard_ownship(ears.bank, ears.filters, ears.heard, t, 0.1, *parts)


def test_the_ownship_among_those_heard_is_the_one_that_the_test_of_estimates_finds():
    ears, test = Ears(), OwnshipTest(3.0, 0.5, 22.0, 35.0, 9.0, -28.0)
    for t in range(4):
        ears.take(float(t), row=0)
        ears.take(float(t), PLACE + 700.0 + t * SPEED, row=1)
    ears.heard.status[:2], ears.heard.mine[:2] = CONFIRMED, 1
    telemetry, covariance = np.concatenate([PLACE + 3.0 * SPEED, SPEED]), np.eye(6)
    x, p = np.zeros((2, 9)), np.zeros((2, 9, 9))
    for u in range(2):
        witness(ears.filters, u, 0.0, MOTION, ears.scratch)
        x[u], p[u] = ears.scratch.x, ears.scratch.p
    states = np.zeros((2, ears.heard.own.shape[1]))
    for _ in range(10):
        expected = identify(2, 0.1, x, p, telemetry, covariance, test, states, np.zeros((14, 6)))
        assert find_heard(ears, 3.0, telemetry, covariance, test) == expected
    assert expected == 0 and ears.heard.own[:2, FLAG].tolist() == [1.0, 0.0]
    np.testing.assert_allclose(ears.heard.own[:2], states)
    # Without telemetry nothing is, and what is not compared starts anew.
    assert find_heard(ears, 3.1, np.full(6, np.nan), covariance, test) == -1
    assert not ears.heard.own[:, FLAG].any()
    assert find_heard(ears, 60.0, telemetry, covariance, test) == -1
    assert not ears.heard.own.any()


def test_who_may_not_be_the_ownship_is_found_and_not_marked():
    test = OwnshipTest(3.0, 0.5, 22.0, 35.0, 9.0, -28.0)
    telemetry, covariance = np.concatenate([PLACE + 3.0 * SPEED, SPEED]), np.eye(6)
    ears = Ears()
    for t in range(4):
        ears.take(float(t), row=0)
        ears.take(float(t), PLACE + [8.0, 0.0, 0.0] + t * SPEED, row=1)
    # Two that cannot be told apart: neither is it, unless its address is known.
    for mine, addressed, expected, marked in (
        ((0, 0), False, -1, (0, 0)),
        ((1, 1), False, -1, (0, 0)),
        ((0, 1), True, 1, (0, 1)),
        ((1, 0), True, 0, (1, 0)),
    ):
        ears.heard.status[:2], ears.heard.mine[:2], ears.heard.own[:] = CONFIRMED, mine, 0.0
        for _ in range(10):
            chosen = find_heard(ears, 3.0, telemetry, covariance, test, addressed)
        assert chosen == expected and ears.heard.own[:2, FLAG].tolist() == list(marked)
    ears.heard.status[1], ears.heard.own[:], ears.heard.mine[:] = TENTATIVE, 0.0, 0
    for _ in range(10):
        chosen = find_heard(ears, 3.0, telemetry, covariance, test)
    assert chosen == 0 and not ears.heard.own[:, FLAG].any()
    # The known address elsewhere is not the ownship.
    ears.heard.mine[:2] = 1, 0
    for _ in range(50):
        chosen = find_heard(ears, 3.0, telemetry + 300.0, covariance, test, True)
    assert chosen == -1 and not ears.heard.own[:, FLAG].any()


def test_the_ownships_radar_track_has_no_address_of_another():
    ears = Ears()
    for t in range(4):
        ears.take(float(t))
    ears.heard.number[0] = new_number(ears.bank)
    ears.bank.t[:] = 3.0
    i = ears.add(np.concatenate([PLACE + 3.0 * SPEED, SPEED]))
    find_slots(ears.bank, ears.heard)
    ears.bank.own[i, FLAG] = 1.0
    ears.find()
    assert ears.bank.address[i] == -1
    ears.heard.mine[0] = 1
    ears.find()
    assert ears.bank.address[i] == 0
    # Found to be the ownship's only after it was linked: the address goes on by itself.
    ears.heard.mine[0] = 0
    ears.told()
    find_heard(ears, 3.0, np.full(6, np.nan), np.eye(6), OwnshipTest(3.0, 0.5, 22.0, 35.0, 9.0, -28.0))
    assert ears.bank.address[i] == -1 and [e[0] for e in ears.told()] == [IS_NOT]
