"""The ownship's navigation: simulated errors and faults, and what the watch believes of telemetry."""

import dataclasses
import math

import numpy as np
import pytest
from pydantic import ValidationError

from wideberth.navigation_watch import STALE, NavigationWatch
from wideberth.simulation.config import NavigationConfig
from wideberth.simulation.navigation import SimulatedNavigation
from wideberth.types import Ownship

V = np.array([40.0, 5.0, -2.0])


def own(t, off=(0.0, 0.0, 0.0), velocity=V, sigma=0.0):
    return Ownship(t, t * V + np.array(off), velocity, covariance=sigma**2 * np.eye(6))


def told(seconds, step=0.1, seed=1, **settings):
    navigation = SimulatedNavigation(NavigationConfig(**settings), seed)
    times = [k * step for k in range(round(seconds / step) + 1)]
    return times, [navigation.sense(own(t)) for t in times]


def errors(times, states):
    return np.array([[*(s.position - t * V), *(s.velocity - V)] for t, s in zip(times, states, strict=True)])


def test_white_errors_have_their_size_and_say_so():
    times, states = told(40.0, position_sigma_m=5.0, velocity_sigma_mps=0.5)
    assert np.allclose(np.sqrt(np.diag(states[-1].covariance)), [5, 5, 5, 0.5, 0.5, 0.5])
    e = errors(times, states)
    # 1203 samples each: 20 % is 9.8 standard errors.
    assert np.std(e[:, :3]) == pytest.approx(5.0, rel=0.2) and np.std(e[:, 3:]) == pytest.approx(0.5, rel=0.2)
    # 401 pairs on each of 3 axes: 0.15 is 5.2 standard errors.
    assert abs(np.mean(e[1:, :3] * e[:-1, :3])) < 0.15 * 25.0


def test_correlated_errors_are_stationary_and_die_away_with_their_time_constant():
    starts = np.array(
        [errors(*told(4.0, 2.0, seed, position_sigma_m=3.0, time_constant_s=4.0))[:, :3] for seed in range(400)]
    )
    # 1200 samples each: 20 % of the variance is 4.9 standard errors, 0.15 of the correlation 5.2.
    assert np.var(starts, axis=(0, 2)) == pytest.approx([9.0] * 3, rel=0.2)
    for k, kept in ((1, math.exp(-0.5)), (2, math.exp(-1.0))):
        assert np.mean(starts[:, 0] * starts[:, k]) / 9.0 == pytest.approx(kept, abs=0.15)


def test_a_jump_and_a_loss_come_when_they_are_set_and_change_no_noise():
    faults = {"jump_at_s": 2.0, "jump_until_s": 3.0, "jump_north_m": 30.0, "jump_up_m": 7.0}
    lost = {"lost_from_s": 4.0, "lost_until_s": 5.0}
    times, plain = told(6.0, position_sigma_m=1.0)
    _, states = told(6.0, position_sigma_m=1.0, **faults, **lost)
    for k, (t, a, b) in enumerate(zip(times, plain, states, strict=True)):
        if 40 <= k < 50:
            assert b is states[39] and b.t == times[39]
        else:
            assert b.t == t and np.allclose(b.position - a.position, [30, 0, -7] if 20 <= k < 30 else 0.0)


@pytest.mark.parametrize(
    "settings",
    [
        {"jump_north_m": 5.0},
        {"jump_until_s": 5.0},
        {"jump_at_s": 5.0, "jump_until_s": 5.0},
        {"lost_until_s": 3.0},
        {"lost_from_s": 3.0, "lost_until_s": 2.0},
        {"position_sigma_m": -1.0},
        {"position_sigma_m": math.nan},
        {"lost_from_s": 0.0},
    ],
)
def test_half_a_fault_is_refused(settings):
    with pytest.raises(ValidationError):
        NavigationConfig(**settings)


def test_sound_telemetry_is_passed_on_as_it_is():
    watch = NavigationWatch()
    for k in range(50):
        given = own(0.1 * k)
        believed, events = watch.step(0.1 * k, given)
        assert believed is given and events == ()


def test_telemetry_a_little_old_is_extrapolated_and_fine():
    believed, events = NavigationWatch().step(1.0 + STALE / 2, own(1.0, sigma=1.0))
    assert believed.state == "ok" and events == () and believed.t == 1.0 + STALE / 2
    assert np.allclose(believed.position, believed.t * V) and believed.covariance[0, 0] > 1.0


def test_lost_telemetry_is_extrapolated_with_growing_covariance_and_said_once():
    watch = NavigationWatch()
    last = own(0.0, sigma=1.0)
    spread, said = [], []
    for k in range(51):
        believed, events = watch.step(0.1 * k, last)
        assert np.allclose(believed.position, 0.1 * k * V) and believed.t == 0.1 * k
        assert (believed.state == "ok") is (0.1 * k <= STALE)
        spread.append(believed.covariance[0, 0])
        said += events
    assert np.all(np.diff(spread) > 0) and said == ["ownship: no telemetry for 1 s"]
    assert watch.step(5.1, own(5.1))[1] == ("ownship: ok",)


def test_a_jump_is_refused_until_telemetry_comes_back():
    watch = NavigationWatch()
    watch.step(0.0, own(0.0))
    for k in range(1, 20):
        believed, events = watch.step(0.1 * k, own(0.1 * k, (0, 200, 0)))
        assert np.allclose(believed.position, 0.1 * k * V) and believed.state == "position jumped by 200 m"
        assert events == (("ownship: position jumped by 200 m",) if k == 1 else ())
    back = own(2.0)
    assert watch.step(2.0, back) == (back, ("ownship: ok",))


def test_a_jump_that_stays_is_believed_when_the_ownship_may_have_got_there():
    watch = NavigationWatch()
    watch.step(0.0, own(0.0))
    refused = [k for k in range(1, 200) if watch.step(0.1 * k, own(0.1 * k, (200, 0, 0)))[0].state != "ok"]
    assert refused == list(range(1, len(refused) + 1)) and 50 < len(refused) < 80


@pytest.mark.parametrize("sigma", [0.0, 1.0, 5.0, 15.0])
@pytest.mark.parametrize("tau", [0.0, 30.0])
def test_stated_errors_and_hard_turns_are_no_jump(sigma, tau):
    navigation = SimulatedNavigation(NavigationConfig(position_sigma_m=sigma, time_constant_s=tau), 5)
    watch = NavigationWatch()
    for k in range(2000):
        t = 0.1 * k
        # 40 m/s in a turn of 7 m/s2.
        angle = 7.0 / 40.0 * t
        position = 40.0**2 / 7.0 * np.array([math.sin(angle), -math.cos(angle), 0.0])
        true = Ownship(t, position, 40.0 * np.array([math.cos(angle), math.sin(angle), 0.0]))
        assert watch.step(t, navigation.sense(true))[0].state == "ok"


def test_times_that_make_no_sense_are_no_telemetry():
    for wrong in (math.nan, math.inf, 10.0):
        watch = NavigationWatch()
        first, events = watch.step(0.0, own(0.0) if wrong != wrong else dataclasses.replace(own(0.0), t=wrong))
        if math.isfinite(wrong) or wrong == math.inf:
            assert first.state == "telemetry without a usable time" and events and first.t == 0.0
        watch = NavigationWatch()
        watch.step(0.0, own(0.0))
        for k in range(1, 11):
            believed, _ = watch.step(0.1 * k, dataclasses.replace(own(0.0, (500, 0, 0)), t=wrong))
            assert np.allclose(believed.position, 0.1 * k * V)
        assert believed.state == "no telemetry for 1 s"
    nothing, _ = NavigationWatch().step(0.0, dataclasses.replace(own(0.0), t=math.nan))
    assert nothing.state == "telemetry without a usable time" and nothing.t == 0.0


def test_what_telemetry_says_against_itself_is_believed():
    watch = NavigationWatch()
    watch.step(0.0, own(0.0, (0, 0, 0)))
    bad = dataclasses.replace(own(0.2, (0, 0, 0)), state="autopilot has no GPS fix")
    for t in (0.2, 0.3):
        believed, events = watch.step(t, bad)
        assert believed.state == "autopilot has no GPS fix"
        assert bool(events) is (t == 0.2)
    assert watch.step(0.4, own(0.4, (0, 0, 0)))[0].state == "ok"
