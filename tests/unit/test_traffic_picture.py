"""Messages of other vehicles, sane and not: what is believed, counted, and shown to controllers."""

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.naive import cas as naive
from wideberth.avoidance.cas import multi_kernels as multi
from wideberth.avoidance.cas.clock_offset import ClockOffset
from wideberth.avoidance.cas.config import CasConfig, PredictionConfig, cas_preset
from wideberth.avoidance.cas.settings import PairController, settings
from wideberth.avoidance.cas.traffic_picture import CAUSES, TrafficPicture
from wideberth.avoidance.cas.vehicle_message import Health, VehicleMessage

OWN = np.array([-30.0, 0, -15, 1.5, 0, 0])


def message(time: float = 0.0, sender: int = 1, **changes: Any) -> VehicleMessage:
    """Of a vehicle that comes head-on from 30 m north at 1.5 m/s."""
    fields: dict[str, Any] = {"position": [30.0 - 1.5 * time, 0.0, -15.0], "velocity": [-1.5, 0.0, 0.0]}
    return VehicleMessage(sender, time, **{**fields, **changes})


def picture(**prediction: Any) -> TrafficPicture:
    return TrafficPicture(CasConfig(smoothing=1.0, prediction=PredictionConfig(**prediction)), number=0)


def test_a_message_is_moved_on_by_its_age() -> None:
    seen = picture()
    assert seen.take(message(1.0), 1.5)
    traffic = seen.traffic(3.0, OWN)
    assert traffic.senders == (1,) and traffic.use.tolist() == [1.0]
    assert traffic.views[0, :6] == pytest.approx([25.5, 0, -15, -1.5, 0, 0])
    assert traffic.views[0, [multi.V_WANTED, multi.V_AGE]] == pytest.approx([-15.0, 2.0])
    assert traffic.closest[0] == pytest.approx([18.5, 0.0])


@pytest.mark.parametrize(
    "changes",
    [
        {"position": [math.nan, 0, 0]},
        {"position": [0.0, 0]},
        {"position": "north"},
        {"position": None},
        {"velocity": [math.inf, 0, 0]},
        {"velocity": [11.0, 0, 0]},
        {"acceleration": [0.0, math.nan, 0]},
        {"time": math.nan},
        {"time": 62.0},
        {"position": [1e6, 0, 0]},
        {"acceleration": [0.0, 30.0, 0]},
        {"position_sigma": 0.0},
        {"position_sigma": math.inf},
        {"waypoints": [[2.0, 0, 0, 0], [1.0, 0, 0, 0]]},
        {"waypoints": [[2.0, 0, 0]]},
        {"waypoints": [[2.0, 0, 0, math.nan]]},
        {"avoidance_rate": 50.0},
        {"health": 9},
        {"z_wanted": math.nan},
    ],
    ids=str,
)
def test_an_absurd_message_is_counted_and_changes_nothing(changes: dict[str, Any]) -> None:
    seen = picture()
    assert seen.take(message(), 0.0)
    before = seen.traffic(1.0, OWN).views
    fields = {**{f.name: getattr(message(1.0), f.name) for f in dataclasses.fields(VehicleMessage)}, **changes}
    assert not seen.take(VehicleMessage(**fields), 1.0)
    assert seen.counts == {"taken": 1, "absurd": 1} and seen.counts_by_sender[1]["absurd"] == 1
    assert np.array_equal(seen.traffic(1.0, OWN).views, before)


def test_duplicates_and_late_ones_are_counted_and_change_nothing() -> None:
    seen = picture(kind="kalman")
    for time in (0.0, 1.0, 2.0):
        seen.take(message(time), 2.0)
    before = seen.traffic(2.0, OWN).views
    assert not seen.take(message(2.0), 2.1)
    assert not seen.take(message(1.0), 2.2)
    assert seen.counts == {"taken": 3, "duplicate": 1, "out of order": 1}
    assert np.array_equal(seen.traffic(2.0, OWN).views, before)


def test_stale_vehicles_are_left_out_and_counted() -> None:
    seen = picture()
    seen.take(message(), 0.0)
    assert seen.traffic(20.0, OWN).use.tolist() == [1.0]
    traffic = seen.traffic(20.1, OWN)
    assert traffic.use.tolist() == [0.0] and np.isnan(traffic.closest).all()
    assert seen.counts["stale"] == 1
    assert seen.take(message(22.0), 22.0)
    assert seen.traffic(22.0, OWN).use.tolist() == [1.0]


def test_a_jump_is_not_believed_until_borne_out() -> None:
    seen = picture()
    seen.take(message(0.0), 0.0)
    away: dict[str, Any] = {"position": [30.0, 90.0, -15.0], "velocity": [0.0, 0.0, 0.0]}
    assert not seen.take(message(1.0, **away), 1.0)
    assert seen.traffic(1.0, OWN).views[0, 1] == 0.0
    # Nothing more came from the first place: the vehicle is there now.
    assert seen.take(message(2.0, **away), 2.0)
    traffic = seen.traffic(2.0, OWN)
    assert traffic.senders == (1,) and traffic.views[0, 1] == 90.0
    assert seen.counts == {"taken": 2, "jump": 1}


def test_two_vehicles_of_one_number_are_both_kept_and_both_avoided() -> None:
    seen = picture()
    for k in range(6):
        seen.take(message(0.5 * k), 0.5 * k)
        seen.take(message(0.5 * k, position=[-29.0, 40.0 - 0.75 * k, -15.0], velocity=[1.5, -1.5, 0.0]), 0.5 * k)
    traffic = seen.traffic(3.0, OWN)
    assert traffic.senders == (1, 1) and traffic.use.tolist() == [1.0, 1.0]
    assert sorted(traffic.views[:, 1]) == pytest.approx([0.0, 40.0 - 0.75 * 5 - 0.5 * 1.5])
    assert seen.counts["identity collision"] >= 8 and seen.counts["jump"] == 1


def test_one_place_that_another_number_also_sends_is_two_vehicles() -> None:
    seen = picture()
    seen.take(message(), 0.0)
    seen.take(message(sender=2), 0.0)
    assert seen.traffic(0.0, OWN).senders == (1, 2)


def test_the_own_number_is_an_echo_or_somebody_else() -> None:
    seen = picture()
    seen.traffic(0.0, OWN)
    echo = message(0.0, sender=0, position=OWN[:3], velocity=OWN[3:])
    assert not seen.take(echo, 0.3)
    assert seen.counts == {"own echo": 1} and seen.traffic(0.3, OWN).senders == ()
    assert seen.take(message(0.5, sender=0), 0.5)
    assert seen.counts["identity collision"] == 1
    assert seen.traffic(0.5, OWN).senders == (0,)


def test_a_duplicate_is_one_though_the_clock_is_known_better_by_then() -> None:
    seen = picture()
    for k in range(4):
        seen.take(message(k + 3.0, velocity=None, position=[30.0 - 1.5 * k, 0, -15]), k + 0.4)
    # A quicker message has shown the clock to be ahead by more.
    seen.take(message(7.0, velocity=None, position=[24.0, 0, -15]), 4.0)
    assert not seen.take(message(7.0, velocity=None, position=[24.0, 0, -15]), 4.1)
    assert not seen.take(message(6.0, velocity=None, position=[25.5, 0, -15]), 4.2)
    assert (seen.counts["duplicate"], seen.counts["out of order"]) == (1, 1)
    assert seen.traffic(4.0, OWN).views[0, [0, 3]] == pytest.approx([24.0, -1.5])


def test_who_has_been_silent_for_long_is_forgotten_and_old_doubts_too() -> None:
    seen = picture()
    seen.take(message(0.0), 0.0)
    assert seen.traffic(59.0, OWN).senders == (1,)
    assert seen.traffic(61.0, OWN).senders == ()
    assert seen.take(message(70.0, position=[0.0, 900.0, -15]), 70.0)
    assert not seen.take(message(71.0, position=[0.0, -900.0, -15]), 71.0)
    # Much later something else far away does not bear that out.
    seen.take(message(94.0, position=[0.0, 880.0, -15]), 94.0)
    assert not seen.take(message(94.5, position=[0.0, -800.0, -15]), 94.5)
    assert seen.counts["jump"] == 2


@pytest.mark.parametrize("ahead", [3.0, -3.0])
@pytest.mark.parametrize("delay", [0.0, 0.5])
def test_clocks_three_seconds_apart_are_compared_by_echoes(ahead: float, delay: float) -> None:
    seen = picture()
    for k in range(1, 8):
        sent = 0.5 * k
        # It answers what we sent half a second before.
        echo: dict[str, Any] = {"echo_time": sent - 0.5 - delay, "echo_received": sent - 0.5 + ahead}
        at: dict[str, Any] = {"position": [30.0 - 1.5 * sent, 0.0, -15.0]}
        seen.take(message(sent + ahead, **at, **echo), sent + delay)
    assert seen.clock_offset(1) == pytest.approx(ahead)
    assert seen.traffic(5.0, OWN).views[0, :3] == pytest.approx([22.5, 0, -15])
    # Of a clock that is ahead, the first two messages could be wrong as well.
    assert seen.counts["wrong clock"] == (5 if ahead > 0.0 else 7)
    assert seen.counts["from the future"] == (2 if ahead > 0.0 else 0)


def test_a_fast_clock_shows_by_itself_and_a_slow_one_looks_like_delay() -> None:
    fast, slow = picture(), picture()
    for k in range(3):
        fast.take(message(3.0 + k, position=[30.0 - 1.5 * k, 0, -15]), float(k))
    assert fast.clock_offset(1) == 3.0 and fast.traffic(2.0, OWN).views[0, 0] == pytest.approx(27.0)
    slow.take(message(-3.0, position=[30.0, 0, -15]), 0.0)
    traffic = slow.traffic(0.0, OWN)
    # Moved on too far along its course, but the controller is told of the age, and widens the sphere for it.
    assert traffic.views[0, 0] == pytest.approx(25.5) and traffic.views[0, multi.V_AGE] == 3.0


def test_clock_offset_takes_the_quickest_ways() -> None:
    clock, random = ClockOffset(0.5), np.random.default_rng(1)
    assert clock.value == 0.0
    for k in range(300):
        down, up = 0.2 + random.exponential(0.5, 2)
        clock.take(k + down, k + 3.0, k - 1.0, k - 1.0 + up + 3.0)
    # Least of 30 exponential delays on both ways, half the difference: 0.1 is seven standard deviations.
    assert clock.value == pytest.approx(3.0, abs=0.1)


def test_one_message_from_the_future_does_not_set_the_clock() -> None:
    seen = picture()
    for k in range(5):
        seen.take(message(float(k)), k + 0.2)
    assert not seen.take(message(30.0), 5.0)
    assert seen.counts["from the future"] == 1 and seen.clock_offset(1) == 0.0
    assert seen.traffic(5.0, OWN).views[0, 0] == pytest.approx(22.5)
    # Nor does the first of all.
    fresh = picture()
    assert [fresh.take(message(t), now) for t, now in ((20.0, 0.0), (1.0, 1.2), (2.0, 2.2))] == [False, True, True]
    assert fresh.clock_offset(1) == 0.0
    # A clock that has been set anew shows in one message after the other.
    taken = [seen.take(message(k + 20.0, position=[30.0 - 1.5 * k, 0, -15]), float(k)) for k in range(6, 12)]
    assert taken == [False, True, True, True, True, True]
    assert seen.traffic(11.0, OWN).views[0, 0] == pytest.approx(30.0 - 1.5 * 11)


def test_a_vehicle_that_lies_about_avoiding_is_found_out() -> None:
    seen = picture()
    for k in range(12):
        time = 0.5 * k
        seen.take(message(time, avoidance_rate=-0.6), time)  # says it climbs, but flies level
        believed = seen.traffic(time, OWN).cooperates[0]
        assert believed == (time <= 4.0)
    assert seen.counts["doubted cooperation"] == 3
    honest = picture()
    for k in range(12):
        honest.take(message(0.5 * k, avoidance_rate=-0.6, velocity=[-1.5, 0, -0.5]), 0.5 * k)
        assert honest.traffic(0.5 * k, OWN).cooperates[0]
    assert not honest.counts["doubted cooperation"]


@pytest.mark.parametrize(
    ("changes", "believed"), [({}, True), ({"cooperates": False}, False), ({"health": Health.FAILED}, False)], ids=str
)
def test_who_does_not_avoid_is_avoided_alone(changes: dict[str, Any], believed: bool) -> None:
    seen = picture()
    seen.take(message(**changes), 0.0)
    traffic = seen.traffic(0.0, OWN)
    assert traffic.cooperates.tolist() == [believed]
    control = PairController(cas_preset("thesis", law="shared_corrected"), first=True)
    rate = control.decide(OWN, traffic.views[0, :6], -15.0, other_cooperates=bool(traffic.cooperates[0])).rate
    both = control.decide(OWN, traffic.views[0, :6], -15.0).rate
    assert rate == pytest.approx(both if believed else 2 * both)
    assert (seen.counts["failed vehicle"] == 1) == ("health" in changes)


def test_ties_go_by_number() -> None:
    config = CasConfig(smoothing=1.0)
    signs = []
    for number, sender in ((0, 1), (5, 1), (5, 9)):
        seen = TrafficPicture(config, number)
        seen.take(message(sender=sender), 0.0)
        views, use = seen.traffic(0.0, OWN)[2:4]
        row = seen.traffic(0.0, OWN).own_row
        _, rate, _ = multi.interval_rate(
            OWN, row, -15.0, 0.0, False, views, use, settings(config), np.empty((len(views), 3))
        )
        signs.append(np.sign(rate))
    assert signs == [-1, 1, -1]  # the lower number climbs


@pytest.mark.parametrize(
    ("own", "path", "words"),
    [
        (np.zeros(3), None, "own must be"),
        (np.full(6, np.nan), None, "own must be finite"),
        (OWN, np.zeros((2, 4)), "increasing times"),
        (OWN, np.zeros((2, 3)), "own_path must be"),
    ],
)
def test_an_own_state_that_makes_no_sense_is_refused(own: Any, path: Any, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        picture().traffic(0.0, own, path)


def test_intents_of_both_are_used() -> None:
    seen = picture(intent=True)
    seen.take(message(waypoints=[[5.0, 22.5, 0, -15], [25.0, 22.5, 30.0, -15.0]]), 0.0)
    straight = seen.traffic(0.0, OWN).closest[0]
    turning = seen.traffic(0.0, OWN, [[4.0, -24.0, 0, -15], [24.0, -24.0, -30.0, -15]]).closest[0]
    assert straight[1] > 15 and turning[1] > straight[1] + 5


def test_intent_is_believed_only_of_those_who_fly_there() -> None:
    seen = picture(intent=True)
    waypoints = [[5.0, 22.5, 0, -15], [25.0, 22.5, 30.0, -15.0]]
    for k in range(10):
        seen.take(message(float(k), waypoints=waypoints), float(k))
        closest = seen.traffic(float(k), np.array([1.5 * k - 30.0, *OWN[1:]])).closest[0]
        # It flies on where it should have turned.
        assert (closest[1] > 10.0) == (k < 5)
    assert seen.counts["doubted intent"] == 5
    seen.take(message(10.0, waypoints=waypoints, position=[22.5, 7.5, -15], velocity=[0, 1.5, 0]), 10.0)
    seen.take(message(11.0, waypoints=waypoints, position=[22.5, 9, -15], velocity=[0, 1.5, 0]), 11.0)
    there = seen.traffic(11.0, OWN)
    assert seen.counts["doubted intent"] == 5
    # While it avoids, it does not fly along its waypoints.
    seen.take(message(12.0, waypoints=waypoints, avoidance_rate=-0.6, velocity=[0, 1.5, -0.6]), 12.0)
    straight = naive.closest(OWN[:3] - [12.0, 0, -15], OWN[3:] - [0, 1.5, -0.6])
    assert seen.traffic(12.0, OWN).closest[0] == pytest.approx(straight)
    assert there.closest[0, 0] != pytest.approx(straight[0])


def test_who_shares_our_number_and_height_goes_the_other_way() -> None:
    # Both decide alike: the one farther south climbs.
    for own, other, row in ((OWN, message(sender=0), -1), (np.array([60.0, 0, -15, -1.5, 0, 0]), message(sender=0), 0)):
        seen = picture()
        seen.take(other, 0.0)
        assert seen.traffic(0.0, own).own_row == row


def test_differences_of_hasty_messages_stay_within_the_limits() -> None:
    seen = picture(kind="constant_acceleration")
    for k in range(4):
        seen.take(message(1e-9 * k, velocity=None, position=[30.0 + k, 0, -15]), 1e-9 * k)
    assert np.abs(seen.traffic(0.5, OWN).views[0, :6]).max() < 100.0


numbers = st.one_of(st.floats(allow_nan=True, allow_infinity=True), st.floats(-50, 50), st.floats(-5, 5))
triples = st.one_of(st.none(), st.lists(numbers, min_size=3, max_size=3))
any_message = st.builds(
    VehicleMessage,
    sender=st.integers(0, 2), time=numbers, position=triples, velocity=triples, acceleration=triples,
    position_sigma=st.one_of(st.none(), numbers), cooperates=st.booleans(),
    avoidance_rate=st.one_of(st.none(), numbers),
    waypoints=st.one_of(st.none(), st.lists(st.lists(numbers, min_size=4, max_size=4), max_size=3)),
    z_wanted=st.one_of(st.none(), numbers), health=st.sampled_from(list(Health)),
    echo_time=st.one_of(st.none(), numbers), echo_received=st.one_of(st.none(), numbers),
)  # fmt: skip


@given(
    st.lists(st.tuples(any_message, st.floats(0, 5)), max_size=8),
    st.sampled_from(["constant_velocity", "constant_acceleration", "kalman", "kalman_acceleration"]),
    st.booleans(),
)
def test_whatever_comes_is_counted_once_and_what_is_shown_is_finite(rows: Any, kind: str, intent: bool) -> None:
    seen, now = picture(kind=kind, intent=intent), 0.0
    for one, dt in rows:
        now += dt
        seen.take(one, now)
        traffic = seen.traffic(now, OWN)
        assert np.isfinite(traffic.views).all()
        assert len(traffic.senders) == len(traffic.use) <= 6
    about_views = ("stale", "wrong clock", "doubted cooperation", "failed vehicle")
    assert sum(n for cause, n in seen.counts.items() if cause not in about_views) == len(rows)
    assert set(seen.counts) <= set(CAUSES)
