"""Helicopters that avoid each other by what they receive, little or much, and whatever is wrong with it."""

import dataclasses
import math
from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from wideberth.avoidance.cas.config import CasConfig, PredictionConfig, ThresholdConfig
from wideberth.avoidance.cas.vehicle_controller import VehicleController
from wideberth.avoidance.cas.vehicle_message import Health, VehicleMessage
from wideberth.units import FOOT

STEP, EVERY, DURATION = 0.1, 5, 50.0
ENCOUNTERS = 8
Harm = Callable[[VehicleMessage, int, np.random.Generator], list[VehicleMessage]]


@dataclasses.dataclass
class Flight:
    least: float
    drift: float
    avoided: float
    counts: Counter[str]


def meeting(seed: int) -> list[Any]:
    """Two that meet after 25 s at nearly one height, at 2 to 5 ft/s and any angle of 60 degrees or more."""
    random = np.random.default_rng(seed)
    course = random.uniform(0, 2 * math.pi)
    states = []
    for angle in (course, course + random.uniform(math.pi / 3, 5 * math.pi / 3)):
        v = random.uniform(2, 5) * FOOT * np.array([math.cos(angle), math.sin(angle), 0.0])
        states.append(np.concatenate([random.normal(size=3) * [1, 1, 0.5] - [0, 0, 15] - 25 * v, v]))
    return states


def fly(
    states: list[Any],
    config: CasConfig,
    *,
    harm: Harm = lambda message, _, random: [message],
    seed: int = 0,
    clocks: tuple[float, ...] = (0.0, 0.0, 0.0),
    numbers: tuple[int, ...] = (0, 1, 2),
    velocities: bool = True,
    echoes: bool = True,
    waypoints: dict[int, Any] | None = None,
) -> Flight:
    """Fly with 1 ft of noise, 0 to 0.8 s of delay (which reorders) and a fifth of the messages lost."""
    random, n = np.random.default_rng(seed), len(states)
    x, wanted = [s.copy() for s in states], [float(s[2]) for s in states]
    controls = [VehicleController(config, numbers[i]) for i in range(n)]
    rates, avoiding = np.zeros(n), np.zeros(n, bool)
    mail: list[list[tuple[float, VehicleMessage]]] = [[] for _ in range(n)]
    heard: dict[tuple[int, int], tuple[float, float]] = {}
    flight = Flight(math.inf, 0.0, 0.0, Counter())
    for k in range(round(DURATION / STEP)):
        t = k * STEP
        for i in range(n if k % EVERY == 0 else 0):
            for j in range(n):
                if i == j:
                    continue
                echo = heard.get((i, j), (None, None)) if echoes else (None, None)
                message = VehicleMessage(
                    numbers[i], t + clocks[i], x[i][:3] + FOOT * random.normal(size=3),
                    x[i][3:].copy() if velocities else None,
                    waypoints=None if waypoints is None else waypoints.get(i),
                    avoidance_rate=float(rates[i]) if avoiding[i] else None, echo_time=echo[0], echo_received=echo[1],
                )  # fmt: skip
                for one in harm(message, i, random):
                    if random.random() > 0.2:
                        mail[j].append((t + 0.8 * random.random(), one))
        for i in range(n):
            for _, one in [m for m in mail[i] if m[0] <= t]:
                sender = numbers.index(one.sender) if one.sender in numbers else i
                if controls[i].take(one, t + clocks[i]) and one.time > heard.get((i, sender), (-math.inf, 0))[0]:
                    heard[i, sender] = one.time, t + clocks[i]
            mail[i] = [m for m in mail[i] if m[0] > t]
            path = None if waypoints is None else waypoints.get(i)
            decision = controls[i].decide(t + clocks[i], x[i], wanted[i], path)
            rates[i], avoiding[i] = decision.rate, decision.avoid
        flight.avoided += STEP * avoiding.sum()
        for y, rate, height in zip(x, rates, wanted, strict=True):
            left = math.exp(-STEP / 0.4)
            y[:2] += y[3:5] * STEP
            y[2] += rate * STEP + (y[5] - rate) * 0.4 * (1 - left)
            y[5] = rate + (y[5] - rate) * left
            flight.drift = max(flight.drift, abs(y[2] - height) / FOOT)
        apart = min(float(np.linalg.norm(a[:3] - b[:3])) for a in x for b in x if a is not b)
        flight.least = min(flight.least, apart / FOOT)
    for control in controls:
        flight.counts.update(control.picture.counts)
    return flight


def flights(config: CasConfig, **changes: Any) -> list[Flight]:
    return [fly(meeting(seed), config, seed=seed, **changes) for seed in range(ENCOUNTERS)]


def test_a_filter_avoids_by_positions_alone_what_raw_positions_do_not() -> None:
    raw = flights(CasConfig(), velocities=False)
    filtered = flights(CasConfig(prediction=PredictionConfig(kind="kalman")), velocities=False)
    assert min(f.least for f in raw) < 12.0
    assert min(f.least for f in filtered) > 14.0


@pytest.mark.parametrize("kind", ["constant_velocity", "constant_acceleration", "kalman", "kalman_acceleration"])
def test_every_prediction_avoids_with_velocities(kind: Any) -> None:
    assert min(f.least for f in flights(CasConfig(prediction=PredictionConfig(kind=kind)))) > 12.0


def test_less_knowledge_passes_wider() -> None:
    config = CasConfig(
        margin_m=0.0, prediction=PredictionConfig(kind="kalman"), threshold=ThresholdConfig(kind="probability")
    )
    known, unknown = flights(config), flights(config, velocities=False)
    assert min(f.least for f in (*known, *unknown)) > 12.0
    assert np.median([f.least for f in unknown]) > np.median([f.least for f in known])


@pytest.mark.parametrize("threshold", [{"kind": "guaranteed"}, {"kind": "probability", "alert_probability": 0.01}])
def test_thresholds_keep_the_sphere_without_a_margin(threshold: Any) -> None:
    config = CasConfig(margin_m=0.0, threshold=ThresholdConfig(**threshold))
    assert min(f.least for f in flights(config)) > 12.0


def test_intent_spares_an_avoidance() -> None:
    # Figure 4.1: the other turns away before it meets us.
    states = [np.array([-20.0, 0, -15, 1.0, 0, 0]), np.array([25.0, 0, -15, -1.0, 0, 0])]
    path = np.array([[10.0, 15.0, 0.0, -15.0], [60.0, 15.0, 50.0, -15.0]])
    avoided = []
    for intent in (False, True):
        config = CasConfig(prediction=PredictionConfig(kind="kalman", intent=intent))
        control, x, seconds = VehicleController(config, 0), states[0].copy(), 0.0
        for k in range(300):
            t = 0.1 * k
            place = [np.interp(t, [0.0, *path[:, 0]], [states[1][a], *path[:, 1 + a]]) for a in range(3)]
            v = [-1.0, 0, 0] if t < 10 else [0, 1.0, 0]
            control.take(VehicleMessage(1, t, place, v, waypoints=path), t)
            seconds += 0.1 * control.decide(t, x, -15.0).avoid
            x[:3] += 0.1 * x[3:]
        avoided.append(seconds)
    # In the corner itself its velocity does not lead to the next waypoint for a moment.
    assert avoided[0] > 5.0 and avoided[1] < 0.5


@pytest.mark.parametrize("clocks", [(3.0, 0.0), (-3.0, 0.0)])
@pytest.mark.parametrize("echoes", [False, True])
def test_clocks_three_seconds_apart_are_safe(clocks: tuple[float, ...], echoes: bool) -> None:
    found = flights(CasConfig(), clocks=clocks, echoes=echoes)
    assert min(f.least for f in found) > 14.0
    assert all(f.counts["wrong clock"] > 50 for f in found)


def absurd(message: VehicleMessage, _: int, random: np.random.Generator) -> list[VehicleMessage]:
    """One in five is doubled, one in five corrupted in one of many ways."""
    if random.random() < 0.2:
        return [message, message]
    if random.random() < 0.25:
        wrong: list[dict[str, Any]] = [
            {"position": [math.nan, 0, 0]}, {"position": np.asarray(message.position) + 500.0}, {"time": 1e9},
            {"velocity": [99.0, 0, 0]}, {"time": message.time + 20.0}, {"sender": 7, "position": [1e9, 0, 0]},
            {"time": math.inf}, {"position_sigma": -1.0},
        ]  # fmt: skip
        return [dataclasses.replace(message, **wrong[random.integers(len(wrong))])]
    return [message]


def lying(message: VehicleMessage, i: int, _: np.random.Generator) -> list[VehicleMessage]:
    """The second says that it climbs out of the way, whatever it does."""
    return [dataclasses.replace(message, avoidance_rate=-2 * FOOT) if i == 1 else message]


def failing(message: VehicleMessage, i: int, _: np.random.Generator) -> list[VehicleMessage]:
    return [dataclasses.replace(message, health=Health.FAILED if i == 1 else Health.NOMINAL)]


@pytest.mark.parametrize(
    ("harm", "causes"),
    [(absurd, ("absurd", "jump", "duplicate", "out of order", "from the future")),
     (lying, ("doubted cooperation",)), (failing, ("failed vehicle",))],
    ids=["absurd", "lying", "failing"],
)  # fmt: skip
@pytest.mark.parametrize("kind", ["constant_velocity", "kalman"])
def test_what_is_wrong_is_counted_and_safe(harm: Harm, causes: tuple[str, ...], kind: Any) -> None:
    found = flights(CasConfig(prediction=PredictionConfig(kind=kind)), harm=harm)
    assert min(f.least for f in found) > 12.0
    total = sum((f.counts for f in found), Counter[str]())
    assert all(total[cause] > 0 for cause in causes)


def test_vehicles_that_share_a_number_are_both_avoided() -> None:
    states = [
        np.array([-30.0, 0, -15, 1.2, 0, 0]), np.array([30.0, 0, -15.3, -1.2, 0, 0]),
        np.array([0, 45.0, -14.8, 0, -1, 0]),
    ]  # fmt: skip
    alone = fly(states, CasConfig())
    shared = fly(states, CasConfig(), numbers=(0, 1, 1))
    assert alone.least > 12.0 and shared.least > 12.0
    assert shared.counts["identity collision"] > 50
