"""The ownship of a run with avoidance: along the mission, or along a maneuver, as `simulation.world.SimWorld` flies."""

from typing import NamedTuple

import numpy as np

from wideberth._jit import jit, jit_uncounted
from wideberth.avoidance.decision_kernels import N_POINTS, Memory, Settings
from wideberth.vehicles.kernels import (
    AIRSPEED,
    N_STATES,
    P_SPEED_MAX,
    P_SPEED_MIN,
    follow_path,
    point_mass_step,
    speed_to_arrive,
)

FLOWN, INDEX, COUNT = 0, 1, 2
N_FLIGHT = 3


class Flight(NamedTuple):
    """The ownship and the maneuver that it flies.

    Attributes
    ----------
    x : ndarray, shape (N_STATES,)
    points, speeds, times : ndarray, shape (n + 1, 3), (n + 1,), (n + 1,)
        The maneuver in flight; the first point is where it was begun.
    numbers : ndarray, shape (N_FLIGHT,)
        Whether it is flown (0, 1), its waypoint, and how many points.
    wind, command : ndarray, shape (3,)
        There is no wind.
    """

    x: np.ndarray
    points: np.ndarray
    speeds: np.ndarray
    times: np.ndarray
    numbers: np.ndarray
    wind: np.ndarray
    command: np.ndarray


@jit
def new_flight(points: int) -> Flight:
    """Return a flight for maneuvers of as many points, to be begun."""
    return Flight(
        np.zeros(N_STATES), np.zeros((points, 3)), np.zeros(points), np.zeros(points), np.zeros(N_FLIGHT),
        np.zeros(3), np.zeros(3),
    )  # fmt: skip


@jit_uncounted
def begin_flight(speed: float, own: np.ndarray, flight: Flight) -> None:
    """Put the ownship where straight flight along the mission has taken it."""
    flight.x[:] = 0.0
    flight.x[0], flight.x[1], flight.x[2] = own[0], own[1], own[2]
    flight.x[AIRSPEED] = speed
    flight.numbers[:] = 0.0


@jit_uncounted
def take_over(memory: Memory, vehicle: np.ndarray, flight: Flight) -> None:
    """Begin to fly the planner's maneuver from here."""
    n = int(memory.plan[N_POINTS])
    for i in range(n):
        for k in range(3):
            flight.points[i, k] = memory.points[i, k] if i > 0 else flight.x[k]
        flight.times[i], flight.speeds[i] = memory.times[i], vehicle[P_SPEED_MIN]
    flight.numbers[FLOWN], flight.numbers[INDEX], flight.numbers[COUNT] = 1.0, 1.0, n


@jit_uncounted
def move(
    t: float, t_before: float, planner: Settings, mission: np.ndarray, mission_speeds: np.ndarray, flight: Flight
) -> None:
    """Fly the ownship from `t_before` to `t`."""
    x, numbers, wind, command = flight.x, flight.numbers, flight.wind, flight.command
    n = int(numbers[COUNT])
    if numbers[FLOWN] > 0.0 and t_before >= flight.times[n - 1]:
        numbers[FLOWN] = 0.0
    if numbers[FLOWN] > 0.0:
        i = int(numbers[INDEX])
        if i < n:
            flight.speeds[i] = speed_to_arrive(
                t_before, x, flight.points[i], flight.times[i],
                max(planner.vehicle[P_SPEED_MIN], 1.0), planner.vehicle[P_SPEED_MAX],
            )  # fmt: skip
        numbers[INDEX] = follow_path(x, flight.points[:n], flight.speeds[:n], i, planner.free, wind, command)
    else:
        follow_path(x, mission, mission_speeds, 1, planner.vehicle, wind, command)
    point_mass_step(x, command, wind, planner.vehicle, t - t_before)


def warmup() -> None:
    """Compile what makes a flight; `tiers.prepare` compiles the rest, which goes with planners."""
    new_flight(2)
