"""The planner from tracks to what to fly: who matters, where they will be, and the decision."""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit, jit_uncounted
from wideberth.avoidance.decision_kernels import (
    ACTIVE,
    CLIMB_SENSE,
    DT,
    HORIZON,
    MISSION,
    N_PLAN,
    N_POINTS,
    N_POLICY,
    NEW,
    ON_DETECTION,
    POINT_INDEX,
    STRIDE,
    TENTATIVE,
    TRIGGER_KIND,
    TURN_SENSE,
    Memory,
    Settings,
    advance_index,
    decide,
    look_ahead,
)
from wideberth.avoidance.graph_kernels import CLIMB_MAX, N_LABEL, N_LIMITS, SINK_MAX, SPEED_MAX
from wideberth.avoidance.keep_out.kernels import N_VOLUME
from wideberth.avoidance.kernels import (
    N_MET,
    N_PREDICTION,
    N_RISK,
    OUTER_HEIGHT,
    OUTER_RADIUS,
    OUTER_TAU,
    first_losses,
)
from wideberth.avoidance.prediction_kernels import predict_intruders
from wideberth.conflict.detection_kernels import closest_ahead, detection_time, track_sigmas
from wideberth.vehicles.kernels import N_PARAMS, P_CLIMB_MAX, P_SINK_MAX, P_SPEED_MAX

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Booleans = NDArray[np.bool_]

_KNOWN = np.zeros((6, 6))  # the ownship knows its own state


@jit
def involve(
    intruders: Floats,
    weight: Floats,
    owner: Integers,
    n_intruders: int,
    settings: Settings,
    memory: Memory,
    first: Floats,
) -> None:
    """Write into `first` when the flight in `memory.states` meets each aircraft's outer volume (s ahead, or inf)."""
    n = (memory.states.shape[0] - 1) // STRIDE + 1
    dt = settings.policy[DT]
    met = np.empty(n_intruders)
    first_losses(memory.states, STRIDE, n, dt, intruders, weight, n_intruders, settings.risk, met)
    first[:] = math.inf
    for m in range(n_intruders):
        first[owner[m]] = min(first[owner[m]], met[m])


@jit_uncounted
def detected(
    own_position: Floats,
    own_velocity: Floats,
    position: Floats,
    velocity: Floats,
    covariance: Floats,
    use: Booleans,
    rules: Floats,
) -> bool:
    """Return whether algorithm 2 detects a collision with one of the m aircraft whose `use` is set."""
    for i in range(position.shape[0]):
        if not use[i]:
            continue
        sn, se, sd = (
            position[i, 0] - own_position[0],
            position[i, 1] - own_position[1],
            position[i, 2] - own_position[2],
        )
        vn, ve, vd = (
            velocity[i, 0] - own_velocity[0],
            velocity[i, 1] - own_velocity[1],
            velocity[i, 2] - own_velocity[2],
        )
        # Most are not inside the boundary: no need to judge them further.
        if math.isnan(detection_time(sn, se, sd, vn, ve, vd, rules[0], rules[1], rules[2], rules[4], rules[7])):
            continue
        t_cpa = closest_ahead(sn, se, vn, ve, rules[7] + rules[2])
        sigma_d, sigma_h = track_sigmas(sn, se, vn, ve, _KNOWN, covariance[i], t_cpa, t_cpa)
        d_cpa, h_cpa = math.hypot(sn + vn * t_cpa, se + ve * t_cpa), abs(sd + vd * t_cpa)
        if d_cpa - rules[5] * sigma_d < rules[3] and h_cpa - rules[6] * sigma_h < rules[4]:
            return True
    return False


@jit_uncounted
def select(
    own: Floats,
    position: Floats,
    velocity: Floats,
    tentative: Booleans,
    settings: Settings,
    limits: Floats,
    near: Integers,
) -> int:
    """Write which aircraft could come near within the planning horizon into `near`, and return how many."""
    policy, risk = settings.policy, settings.risk
    n = 0
    climb_most = max(limits[CLIMB_MAX], limits[SINK_MAX])
    for i in range(position.shape[0]):
        speed = math.hypot(velocity[i, 0], velocity[i, 1]) + limits[SPEED_MAX]
        radius = 2.0 * risk[OUTER_RADIUS] + speed * (policy[HORIZON] + risk[OUTER_TAU])
        height = 2.0 * risk[OUTER_HEIGHT] + (abs(velocity[i, 2]) + climb_most) * policy[HORIZON]
        distance = math.hypot(position[i, 0] - own[0], position[i, 1] - own[1])
        if not (distance < radius and abs(position[i, 2] - own[2]) < height):
            continue
        # A first message or two tell little of where an aircraft goes: unless it is close, see it a little longer.
        if tentative[i] and distance - risk[OUTER_RADIUS] > speed * policy[TENTATIVE]:
            continue
        near[n] = i
        n += 1
    return n


@jit
def plan(
    t: float,
    own_position: Floats,
    own_velocity: Floats,
    bank: float,
    position: Floats,
    velocity: Floats,
    acceleration: Floats,
    covariance: Floats,
    keys: Integers,
    tentative: Booleans,
    mission: Floats,
    mission_speeds: Floats,
    mission_index: int,
    settings: Settings,
    memory: Memory,
    first: Floats,
) -> int:
    """Take one decision of the planner, from tracks to what to fly.

    Parameters
    ----------
    t : float
        Now, s.
    own_position, own_velocity : ndarray, shape (3,)
    bank : float
        rad.
    position, velocity, acceleration, covariance : ndarray, shape (m, 3), (m, 3), (m, 3), (m, 9, 9)
        Of the tracks, all finite, in an order that stays the same.
    keys : ndarray of int, shape (m,)
        A number for each aircraft that stays the same.
    tentative : ndarray of bool, shape (m,)
    mission, mission_speeds, mission_index
        The mission and its next waypoint.
    settings : Settings
    memory : Memory
        Updated.
    first : ndarray, shape (m,)
        Written where a new maneuver is returned: when the mission would have met each aircraft, inf if never.

    Returns
    -------
    int
        `MISSION`, `KEEP`, `NEW` or `RETURN`.
    """
    near = np.empty(position.shape[0], np.int64)
    n = select(own_position, position, velocity, tentative, settings, memory.limits, near)
    active = memory.plan[ACTIVE] > 0.0
    if n == 0 and not active:
        return MISSION
    if mission_index >= mission.shape[0]:
        memory.plan[:] = 0.0
        return MISSION
    chosen = near[:n]
    if not active and settings.policy[TRIGGER_KIND] == ON_DETECTION:
        use = np.zeros(position.shape[0], np.bool_)
        use[chosen] = True
        if not detected(own_position, own_velocity, position, velocity, covariance, use, settings.trigger):
            return MISSION
    covariances = covariance[chosen]
    dt, vehicle = settings.policy[DT], settings.vehicle
    steps = (memory.states.shape[0] - 1) // STRIDE + 1
    intruders = np.empty((max(1, 2 * n), steps, N_PREDICTION))
    weight, owner = np.empty(max(1, 2 * n)), np.empty(max(1, 2 * n), np.int64)
    count = predict_intruders(
        own_position, vehicle[P_SPEED_MAX], max(vehicle[P_CLIMB_MAX], vehicle[P_SINK_MAX]),
        position[chosen], velocity[chosen], acceleration[chosen], covariances, settings.risk, dt, steps,
        intruders, weight, owner,
    )  # fmt: skip
    x = np.empty(7)
    x[0], x[1], x[2] = own_position[0], own_position[1], own_position[2]
    x[3] = math.hypot(own_velocity[0], own_velocity[1])
    x[4] = math.atan2(own_velocity[1], own_velocity[0])
    x[5], x[6] = bank, -own_velocity[2]
    met = np.empty(n)
    if active:
        points = memory.points[: int(memory.plan[N_POINTS])]
        memory.plan[POINT_INDEX] = advance_index(x, points, int(memory.plan[POINT_INDEX]), settings.free)
    look_ahead(x, mission, mission_speeds, mission_index, vehicle, dt, memory.states)
    if active:
        # Once other aircraft than those it was chosen for are in the way, the sense of the maneuver binds no more.
        involve(intruders, weight, owner, count, settings, memory, met)
        others = same = False
        for i in range(n):
            if met[i] < math.inf:
                others = True
                for j in range(memory.held[0]):
                    same = same or memory.held[1 + j] == keys[chosen[i]]
        if others and not same:
            memory.plan[TURN_SENSE] = memory.plan[CLIMB_SENSE] = 0.0
    action = decide(t, x, mission, mission_speeds, mission_index, intruders, weight, count, settings, memory)
    if action == NEW:
        look_ahead(x, mission, mission_speeds, mission_index, vehicle, dt, memory.states)
        involve(intruders, weight, owner, count, settings, memory, met)
        first[:] = math.inf
        held = 0
        for i in range(n):
            first[chosen[i]] = met[i]
            if met[i] < math.inf:
                held += 1
        if held > 0 or not active:
            memory.held[0] = 0
            for i in range(n):
                if met[i] < math.inf and memory.held[0] < memory.held.shape[0] - 1:
                    memory.held[0] += 1
                    memory.held[memory.held[0]] = keys[chosen[i]]
    return action


def warmup() -> None:
    """Compile every kernel of this module for the types it is used with."""
    x, mission = np.array([0.0, 0.0, -500.0, 40.0, 0.0, 0.0, 0.0]), np.array([[0.0, 0.0, -500.0], [9e3, 0.0, -500.0]])
    zero, one = np.zeros(1), np.ones(1, np.int64)
    settings = Settings(
        np.ones(N_PARAMS), np.ones(N_PARAMS), 1, np.array([0, 1]), np.array([3]), zero, zero, np.ones(N_RISK),
        np.ones(N_RISK), np.ones(2), np.ones(N_POLICY), np.ones(8), np.zeros((0, N_VOLUME)), np.zeros((0, 2)),
    )  # fmt: skip
    memory = Memory(
        np.zeros(N_PLAN), np.zeros((3, 3)), np.zeros(3), np.zeros(3), np.zeros(2, np.int64), np.ones(N_LIMITS),
        np.zeros((7, 7)), np.zeros((1, N_LABEL)), np.zeros(1, np.int64), np.zeros(1, np.int64), np.zeros((3, N_MET)),
    )  # fmt: skip
    state = np.zeros((1, 3))
    plan(
        0.0, x[:3], x[:3], 0.0, state, state, state, np.zeros((1, 9, 9)), one, np.zeros(1, np.bool_),
        mission, np.full(2, 40.0), 1, settings, memory, zero,
    )  # fmt: skip
