"""Intruders drawn at random so that they come near the ownship's mission, straight or maneuvering."""

import math

import numpy as np

from wideberth.errors import InputError
from wideberth.simulation.config import IntruderConfig, LegConfig, PositionConfig, RandomTrafficConfig
from wideberth.simulation.legs import Leg, LegFlight
from wideberth.tracking.motion_kernels import TURNING, propagate
from wideberth.types import FloatArray, Mission

_TRIES = 1000
_FIRST_ADDRESS = 0xA00000


def planned_state(mission: Mission, t: float) -> tuple[FloatArray, FloatArray]:
    """Return where the mission, flown as planned, has the ownship, and its velocity there; local NED, m and m/s.

    Parameters
    ----------
    mission : Mission
    t : float
        s after the mission's start; after its end the last leg goes on.
    """
    left = t
    for k in range(1, len(mission.waypoints)):
        step = mission.waypoints[k] - mission.waypoints[k - 1]
        length = math.hypot(step[0], step[1])
        takes = length / mission.speeds[k]
        if takes > 0.0 and (left <= takes or k == len(mission.waypoints) - 1):
            return mission.waypoints[k - 1] + step * (left / takes), step / takes
        left -= takes
    raise InputError("mission: all waypoints are at one place: nothing can be drawn around it")


def draw_intruders(config: RandomTrafficConfig, mission: Mission, seed: int) -> tuple[IntruderConfig, ...]:
    """Return the intruders of one encounter.

    Each passes, at a time drawn, a point at a distance drawn from where the mission has the ownship then, at right
    angles to the relative velocity: on straight courses that is the closest point of approach. A maneuvering one passes
    it too, with legs before and after, so that it may be closer at another time.

    Parameters
    ----------
    config : RandomTrafficConfig
    mission : Mission
    seed : int

    Raises
    ------
    InputError
        If no intruder can be drawn that starts as far away as wanted.
    """
    rng = np.random.default_rng([seed, 0x7A])
    count = int(rng.integers(config.intruders_min, config.intruders_max + 1))
    return tuple(_draw_one(config, mission, rng, k) for k in range(count))


def _draw_one(config: RandomTrafficConfig, mission: Mission, rng: np.random.Generator, number: int) -> IntruderConfig:
    own_start = mission.waypoints[0]
    for _ in range(_TRIES):
        t = rng.uniform(config.time_min_s, config.time_max_s)
        own, own_velocity = planned_state(mission, t)
        speed, course = rng.uniform(config.speed_min_mps, config.speed_max_mps), rng.uniform(-math.pi, math.pi)
        climb = math.radians(rng.uniform(-config.path_angle_max_deg, config.path_angle_max_deg))
        ground = speed * math.cos(climb)
        relative = np.array([ground * math.cos(course), ground * math.sin(course)]) - own_velocity[:2]
        miss = rng.uniform(0.0, config.miss_max_m) * rng.choice([-1.0, 1.0])
        above = rng.uniform(-config.height_max_m, config.height_max_m)
        closing = float(np.hypot(*relative))
        if closing < config.closing_speed_min_mps:
            continue
        point = own - np.array([0.0, 0.0, above])
        point[:2] += miss / closing * np.array([-relative[1], relative[0]])
        legs = _legs(config, rng, t)
        # Back from the closest point: the same rates, flown the other way.
        there = _backwards(point, speed, course, climb, legs, t)
        if there is None or np.linalg.norm(there[:3] - own_start) < config.start_distance_min_m:
            continue
        return IntruderConfig(
            address=f"{_FIRST_ADDRESS + number:06x}",
            callsign=f"RANDOM{number + 1}",
            position=PositionConfig(north_m=float(there[0]), east_m=float(there[1]), altitude_m=float(-there[2])),
            speed_mps=float(there[3] * math.cos(there[5])),
            course_deg=math.degrees(math.remainder(float(there[4]), 2.0 * math.pi)),
            climb_rate_mps=float(there[3] * math.sin(there[5])),
            rcs_m2=config.rcs_m2,
            legs=tuple(
                LegConfig(
                    duration_s=leg.duration,
                    acceleration_mps2=leg.acceleration,
                    turn_rate_dps=math.degrees(leg.turn_rate),
                    path_angle_rate_dps=math.degrees(leg.path_angle_rate),
                )
                for leg in legs
            ),
        )
    raise InputError(
        f"traffic: {_TRIES} draws found no intruder that starts {config.start_distance_min_m:g} m away: raise"
        " time_min_s, or lower start_distance_min_m"
    )


def _legs(config: RandomTrafficConfig, rng: np.random.Generator, t: float) -> list[Leg]:
    """Draw legs until well after the closest point: straight, a turn, a turn with another speed, or a climb."""
    legs: list[Leg] = []
    while config.maneuvering and sum(leg.duration for leg in legs) < 2.0 * t:
        duration = rng.uniform(config.leg_min_s, config.leg_max_s)
        turn = math.radians(rng.uniform(-1.0, 1.0) * config.turn_rate_max_dps)
        kind = int(rng.integers(4))
        legs.append(
            Leg(
                duration,
                rng.uniform(-1.0, 1.0) * config.acceleration_max_mps2 if kind == 2 else 0.0,
                turn if kind in (1, 2) else 0.0,
                math.radians(rng.uniform(-1.0, 1.0) * config.path_angle_rate_max_dps) if kind == 3 else 0.0,
            )
        )
    return legs


def _backwards(
    point: FloatArray, speed: float, course: float, climb: float, legs: list[Leg], t: float
) -> FloatArray | None:
    """Return the states (9) at the start from which `legs` lead to the point at `t`; None if they stop or loop."""
    x = np.array([*point, speed, course, climb, 0.0, 0.0, 0.0])
    before = t
    starts = np.cumsum([0.0, *(leg.duration for leg in legs)])
    for k in range(len(legs) - 1, -1, -1):
        if starts[k] >= before:
            continue
        x[6:] = legs[k][1:]
        while before > starts[k]:
            dt = min(0.25, before - starts[k])
            propagate(TURNING, -dt, x, x)
            before -= dt
        if x[3] < 1.0 or abs(x[5]) > math.radians(40.0):
            return None
    x[6:] = 0.0
    propagate(TURNING, -before, x, x)
    flight = LegFlight(x[:3], x[3], x[4], x[5], legs)
    # The flight keeps its speed and path angle within limits where the drawn rates do not.
    if np.linalg.norm(flight.state(t)[:3] - point) > 1.0:
        return None
    return x
