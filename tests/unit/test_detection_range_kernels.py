"""Range kernels against naive flights: integrated in small steps, over all distances and courses."""

import math
import os
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.naive import detection_range as naive
from wideberth.analysis import cpa_simulation_kernels, detection_range_kernels, escape_path_kernels, turn_kernels
from wideberth.analysis.encounter_angle import required_range
from wideberth.analysis.maneuvering_intruder import maneuvering_intruder_range
from wideberth.analysis.speed_change import speed_change_range
from wideberth.analysis.vertical_escape import vertical_escape_range
from wideberth.units import DEGREE, FOOT, KNOT

FloatArray = NDArray[np.float64]
FEW = os.environ.get("NUMBA_DISABLE_JIT") == "1"

R = 500 * FOOT
# Ownship speed, turn, bank, roll rate, lag; the last three are Case A, Case B and beyond 90 degrees.
TURNS = [
    (25 * KNOT, 90 * DEGREE, 30 * DEGREE, 30 * DEGREE, 0.5),
    (8.0, 40 * DEGREE, 50 * DEGREE, 40 * DEGREE, 0.8),
    (60.0, 130 * DEGREE, 45 * DEGREE, 60 * DEGREE, 0.3),
]


@pytest.mark.parametrize(("v", "angle", "bank", "rate", "tau"), TURNS)
def test_turn_is_the_one_flown(v: float, angle: float, bank: float, rate: float, tau: float) -> None:
    times, positions = naive.turn(v, angle, bank, rate, tau, 40.0)
    path, out = np.empty((escape_path_kernels.MAX_ROWS, escape_path_kernels.N_COLUMNS)), np.empty(4)
    n = escape_path_kernels.turn_path(v, 3.0, angle, bank, rate, tau, 1.0, path)
    row = 0
    for k in range(0, len(times), 50):
        row = escape_path_kernels.path_at(path, n, 3.0 + times[k], row, out)
        assert out[:2] == pytest.approx(positions[k] + [3.0 * v, 0.0], abs=2e-3)
    assert math.hypot(*out[2:]) == pytest.approx(v, rel=1e-6)


@pytest.mark.parametrize(("v", "angle", "bank", "rate", "tau"), TURNS)
@pytest.mark.parametrize("v_i", [0.0, 150 * KNOT])
def test_head_on_range_by_brute_force(v: float, angle: float, bank: float, rate: float, tau: float, v_i: float) -> None:
    times, positions = naive.turn(v, angle, bank, rate, tau, 120.0)

    def safe(d: float) -> bool:
        return bool(naive.nearest(times, positions, np.array([d, 0.0]), np.array([-v_i, 0.0]))[0] >= R)

    d, t, _ = detection_range_kernels.tgvv(v, v_i, R, bank, angle, rate, tau)
    assert d == pytest.approx(naive.largest_unsafe(safe, R / 2, 1.5 * d), rel=1e-5)
    reached, at = cpa_simulation_kernels.closest_approach(d, 0.0, -v_i, 0.0, v, bank, 0.0, angle, rate, tau)
    assert reached == pytest.approx(R, rel=1e-6)
    assert at == pytest.approx(t, rel=1e-3)


def test_gvv_beyond_90_degrees_is_the_limit_of_fast_banks() -> None:
    for v in (8.0, 30.0, 60.0, 150.0):
        for angle in (100.0, 130.0, 170.0):
            for v_i in (0.0, 20.0, 80.0):
                d, t, _ = detection_range_kernels.gvv(v, v_i, R, 0.6, angle * DEGREE)
                fast, time, reached = detection_range_kernels.tgvv(v, v_i, R, 0.6, angle * DEGREE, math.inf, 0.5)
                assert reached
                assert d == pytest.approx(fast, rel=1e-8)
                assert t == pytest.approx(time, rel=1e-4)
    assert math.isnan(detection_range_kernels.gvv(10.0, 20.0, R, 0.6, math.pi)[0])
    assert math.isnan(detection_range_kernels.tgvv(10.0, 20.0, R, 0.6, math.pi, 0.5, 0.5)[0])


def test_batch_of_all_methods() -> None:
    row = [25 * KNOT, 150 * KNOT, R, 30 * DEGREE, 90 * DEGREE, 30 * DEGREE, 0.5]
    expected = {
        detection_range_kernels.TGVV: 5208.546,
        detection_range_kernels.GVV: 4942.1751,
        detection_range_kernels.TT: 3643.6138,
        detection_range_kernels.GT: 2875.0762,
    }
    for method, feet in expected.items():
        d, t, case = np.empty(1), np.empty(1), np.empty(1, np.int64)
        detection_range_kernels.detection_ranges(method, np.array(row)[:, None], d, t, case)
        assert (d[0] + 175 * KNOT * 5.0) / FOOT == pytest.approx(feet, abs=1e-3)


def test_gvv_within_and_after_the_turn() -> None:
    """The closed forms of both cases are stationary points: nothing nearby is larger."""
    for v, expected in ((25 * KNOT, 1), (100 * KNOT, 2)):
        d, t, case = detection_range_kernels.gvv(v, 150 * KNOT, R, 30 * DEGREE, 90 * DEGREE)
        assert case == expected
        radius = v**2 / (naive.G * math.tan(30 * DEGREE))
        at = np.linspace(0.0, 2 * t, 20_001)
        chi = np.minimum(v * at / radius, math.pi / 2)
        x, y = radius * np.sin(chi), radius * (1 - np.cos(chi)) + np.maximum(v * at - radius * math.pi / 2, 0.0)
        reach = x + 150 * KNOT * at + np.sqrt(np.maximum(R**2 - y**2, 0.0))
        assert d == pytest.approx(reach[y < R].max(), rel=1e-8)
    assert detection_range_kernels.gvv(v, 1.0, 0.0, 0.5, 1.0) == (0.0, 0.0, 2)


def test_special_cases_of_bearings() -> None:
    own: Any = {
        "ownship_speed": 20.0,
        "safety_radius": 100.0,
        "max_bank": 0.5,
        "computation_time": 2.0,
        "turn_angle": math.pi / 2,
        "max_bank_rate": 0.7,
        "roll_time_constant": 0.0,
    }
    # Slower, as fast, and still; on the constant bearing after a turn to the right; out of reach.
    bearings = np.array([0.2, 0.2, 0.0, -math.pi / 4, math.pi])
    speeds = np.array([10.0, 20.0, 0.0, 90.0, 10.0])
    found = required_range(bearings, intruder_speed=speeds, turn="right", **own)
    assert np.isfinite(found.distance[:3]).all() and (found.distance[:3] > 100).all()
    assert math.isinf(found.distance[3])
    assert found.distance[4] == 0
    # Parallel flight after the turn: neither nearer nor farther for ever.
    alike = required_range(math.pi / 4, intruder_speed=20.0, turn="left", courses="collision", **own)
    assert math.isfinite(alike.distance)
    assert math.isinf(
        speed_change_range(
            0.0,
            intruder_speed=20.0,
            new_speed=0.0,
            acceleration=1.0,
            **{name: own[name] for name in ("ownship_speed", "safety_radius", "computation_time")},
        ).distance
    )
    follows = maneuvering_intruder_range(
        0.0, intruder_speed=90.0, intruder_turn_angle=1.0, intruder_turn_rate=0.1, **own
    )
    assert math.isinf(follows.distance)
    still = maneuvering_intruder_range(0.0, intruder_speed=0.0, intruder_turn_angle=0, intruder_turn_rate=1, **own)
    assert 0 < still.distance < math.inf
    steep = detection_range_kernels.tgvv(30.0, 50.0, 100.0, 89 * DEGREE, 1.5, 0.5, 0.3)
    assert steep[0] > 0 and not steep[2]


def test_simulated_turns_that_pass_while_rolling() -> None:
    reached, at = cpa_simulation_kernels.closest_approach(400.0, 0.0, -60.0, 0.0, 60.0, 0.8, 0.0, 1.5, 1.0, 0.2)
    times, positions = naive.turn(60.0, 1.5, 0.8, 1.0, 0.2, 20.0)
    assert reached == pytest.approx(
        naive.nearest(times, positions, np.array([400.0, 0.0]), np.array([-60.0, 0.0]))[0], rel=1e-3
    )
    assert 3.0 < at < 3.5
    cpa, t_cpa = np.empty(1), np.empty(1)
    row = np.array([400.0, 0.0, math.pi, 60.0, 60.0, 0.8, 0.0, 1.5, 1.0, 0.2])
    cpa_simulation_kernels.closest_approaches(row[:, None], cpa, t_cpa)
    assert (cpa[0], t_cpa[0]) == pytest.approx((reached, at))


def test_roll_times_do_not_underflow() -> None:
    """The printed (A.10) is the logarithm of 0 here; the lag is then tau ln 2."""
    t1, t2 = turn_kernels.roll_times(0.5, 0.5, 1e-4)
    assert t1 == pytest.approx(1.0 + 1e-4 * math.log(2))
    assert t2 == pytest.approx(1.0 + 2e-4 * math.log(2))
    t1, t2 = turn_kernels.roll_times(0.5, 0.5, 0.4)
    assert t1 == pytest.approx(-0.4 * math.log(1 - math.sqrt(1 - math.exp(-1.0 / 0.4))))
    assert t2 == pytest.approx(2 * t1 - 1.0)


@pytest.mark.parametrize(("acceleration", "tau"), [(2.0, 0.0), (2.0, 0.5), (50.0, 1.0)])
def test_velocity_change_is_the_one_flown(acceleration: float, tau: float) -> None:
    t = np.linspace(-1.0, 8.0, 46)
    heights = naive.height(t, 4.0, acceleration, tau)
    found = [escape_path_kernels.velocity_change(float(at), 4.0, acceleration, tau) for at in t]
    np.testing.assert_allclose([added for _, added in found], heights, atol=5e-3)
    for at, (done, _) in zip(t, found, strict=True):
        if at > 0 and done < 3.999:
            assert escape_path_kernels.time_to_velocity(done, 4.0, acceleration, tau) == pytest.approx(at)
    times, positions = naive.velocity_change(10.0, np.array([2.0, -5.0]), acceleration, tau, 8.0)
    path, out = np.empty((escape_path_kernels.MAX_ROWS, escape_path_kernels.N_COLUMNS)), np.empty(4)
    n = escape_path_kernels.velocity_change_path(10.0, 0.0, 2.0, -5.0, acceleration, tau, path)
    for k in range(0, len(times), 400):
        escape_path_kernels.path_at(path, n, times[k], 0, out)
        assert out[:2] == pytest.approx(positions[k], abs=0.02)
    assert escape_path_kernels.time_to_velocity(4.0, 4.0, 1.0, 0.0) == math.inf
    assert escape_path_kernels.velocity_change_path(10.0, 1.0, 10.0, 0.0, 1.0, 0.0, path) == 2


TURN = (60 * DEGREE, 35 * DEGREE, 40 * DEGREE, 0.4)  # angle, bank, roll rate, lag
Flight = tuple[FloatArray, FloatArray]


def check(
    flights: list[Flight], straight: Flight, found: Any, bearing: float, radius: float, v_i: float, beyond: float
) -> None:
    """Fly every course at and beyond a required range, and the worst one from a little nearer."""
    needed = float(found.distance)
    b = np.array([math.cos(bearing), math.sin(bearing)])
    courses = np.linspace(-math.pi, math.pi, 60 if FEW else 240)
    velocities = v_i * np.stack([np.cos(courses), np.sin(courses)], axis=1)
    for d in (beyond * needed, 1.4 * needed):
        entering = velocities[naive.nearest(*straight, d * b, velocities) < radius]
        best = np.max([naive.nearest(*flight, d * b, entering) for flight in flights], axis=0, initial=-np.inf)
        assert len(entering) and (best >= radius * (1 - 1e-3)).all()
    worst = v_i * np.array([[math.cos(found.intruder_course), math.sin(found.intruder_course)]])
    d = needed * (2 - beyond)
    assert naive.nearest(*straight, d * b, worst)[0] < radius * 1.01
    assert max(naive.nearest(*flight, d * b, worst)[0] for flight in flights) < radius


@pytest.mark.parametrize("bearing", [0.0, 40.0, -100.0, 175.0])
@pytest.mark.parametrize("wind", [(0.0, 0.0), (-4.0, 6.0)])
def test_turns_at_any_bearing_and_in_wind(bearing: float, wind: tuple[float, float]) -> None:
    """Flown over ground: the air's motion is added to the ownship's, and the intruder's course is over ground."""
    v, v_i, wait = 15.0, 40.0, 4.0
    found = required_range(
        bearing * DEGREE,
        ownship_speed=v,
        intruder_speed=v_i,
        safety_radius=120.0,
        computation_time=wait,
        tailwind=wind[0],
        crosswind=wind[1],
        turn_angle=TURN[0],
        max_bank=TURN[1],
        max_bank_rate=TURN[2],
        roll_time_constant=TURN[3],
    )
    times, right = naive.after_waiting(*naive.turn(v, *TURN, 150.0), v, wait)
    times, right = times[::20], right[::20]
    drift = times[:, None] * np.array(wind)
    flights = [(times, right + drift), (times, right * [1.0, -1.0] + drift)]
    straight = (times, times[:, None] * np.array([v, 0.0]) + drift)
    check(flights, straight, found, bearing * DEGREE, 120.0, v_i, 1.004)


@pytest.mark.parametrize(("new_speed", "new_course"), [(0.0, 0.0), (4.0, 0.0), (10.0, 90 * DEGREE)])
@pytest.mark.parametrize("bearing", [35.0, 110.0])
def test_speed_changes(new_speed: float, new_course: float, bearing: float) -> None:
    v, v_i, wait = 10.0, 25.0, 2.0
    found = speed_change_range(
        bearing * DEGREE,
        ownship_speed=v,
        intruder_speed=v_i,
        safety_radius=80.0,
        computation_time=wait,
        new_speed=new_speed,
        new_course=new_course,
        acceleration=2.0,
        time_constant=0.6,
    )
    new = new_speed * np.array([math.cos(new_course), math.sin(new_course)])
    times, positions = naive.after_waiting(*naive.velocity_change(v, new, 2.0, 0.6, 80.0), v, wait)
    times, positions = times[::10], positions[::10]
    straight = (times, times[:, None] * np.array([v, 0.0]))
    flights = [(times, positions), (times, positions * [1.0, -1.0])]
    check(flights, straight, found, bearing * DEGREE, 80.0, v_i, 1.004)


@pytest.mark.parametrize("climbing", [0.0, 2.0, -6.0])
@pytest.mark.parametrize("bearing", [0.0, 70.0, 180.0])
def test_climbs_and_descents(climbing: float, bearing: float) -> None:
    v, v_i, wait, radius, half = 12.0, 30.0, 3.0, 100.0, 25.0
    rates, acceleration, tau = (3.0, 4.0), 2.0, 0.7
    found = vertical_escape_range(
        bearing * DEGREE,
        ownship_speed=v,
        intruder_speed=v_i,
        safety_radius=radius,
        half_height=half,
        computation_time=wait,
        climb_rate=rates[0],
        descent_rate=rates[1],
        vertical_acceleration=acceleration,
        time_constant=tau,
        intruder_climb_rate=climbing,
    )
    t = np.arange(0.0, 60.0, 0.01)
    heights = [
        sense * naive.height(t - wait, rate, acceleration, tau) for rate, sense in zip(rates, (1, -1), strict=True)
    ]

    def separated(d: float, course: float) -> bool | None:
        """Whether one of the climbs keeps them apart; None where there is nothing to be avoided."""
        start = d * np.array([math.cos(bearing * DEGREE), math.sin(bearing * DEGREE)])
        relative = start + t[:, None] * (v_i * np.array([math.cos(course), math.sin(course)]) - [v, 0.0])
        apart = np.hypot(relative[:, 0], relative[:, 1])
        if apart.min() >= radius or apart.argmin() == 0:
            return None
        intruder = climbing * (t - t[apart.argmin()])
        return any(bool((np.abs(own - intruder)[apart < radius] >= half - 0.02).all()) for own in heights)

    courses = np.linspace(-math.pi, math.pi, 721)
    for d in (1.002, 1.3):
        verdicts = [separated(d * float(found.distance), float(course)) for course in courses]
        assert True in verdicts and False not in verdicts
    assert separated(0.99 * float(found.distance), float(found.intruder_course)) is False


@pytest.mark.parametrize(("bearing", "horizon"), [(0.0, math.inf), (50.0, math.inf), (0.0, 25.0)])
def test_maneuvering_intruders(bearing: float, horizon: float) -> None:
    v, v_i, wait, radius = 15.0, 60.0, 3.0, 120.0
    widest, rate, acceleration, slowest, fastest = 6 * DEGREE, 3 * DEGREE, 1.0, 50.0, 70.0
    found = maneuvering_intruder_range(
        bearing * DEGREE,
        ownship_speed=v,
        intruder_speed=v_i,
        safety_radius=radius,
        computation_time=wait,
        intruder_turn_angle=widest,
        intruder_turn_rate=rate,
        intruder_acceleration=acceleration,
        intruder_slowest=slowest,
        intruder_fastest=fastest,
        horizon=horizon,
        turn_angle=TURN[0],
        max_bank=TURN[1],
        max_bank_rate=TURN[2],
        roll_time_constant=TURN[3],
    )
    times, right = naive.after_waiting(*naive.turn(v, *TURN, 200.0), v, wait)
    own = right * [1.0, 1.0 if found.escape == 0 else -1.0]
    t = np.arange(0.0, min(horizon, 150.0), 0.02)
    own = np.stack([np.interp(t, times, own[:, i]) for i in range(2)], axis=1)
    b = np.array([math.cos(bearing * DEGREE), math.sin(bearing * DEGREE)])

    def nearest(d: float, start: float, angle: float, final: float) -> float:
        course = found.intruder_course + np.sign(angle) * np.clip(rate * (t - start), 0.0, abs(angle))
        speed = v_i + np.sign(final - v_i) * np.minimum(acceleration * t, abs(final - v_i))
        velocity = speed[:, None] * np.stack([np.cos(course), np.sin(course)], axis=1)
        way = np.concatenate([np.zeros((1, 2)), np.cumsum((velocity[1:] + velocity[:-1]) / 2 * 0.02, axis=0)])
        r = d * b + way - own
        return float(np.hypot(r[:, 0], r[:, 1]).min())

    random = np.random.default_rng(3)
    needed = float(found.distance)
    for _ in range(30 if FEW else 300):
        start, angle = random.uniform(0.0, 40.0) * random.integers(2), random.uniform(-widest, widest)
        for final in (slowest, v_i, fastest):
            d = needed * random.choice([1.002, random.uniform(1.002, 2.0)])
            assert nearest(d, start, angle, final) >= radius * (1 - 2e-3)
    worst = (float(found.turn_start), float(found.turn), float(found.final_speed))
    assert nearest(needed * 0.998, *worst) < radius
