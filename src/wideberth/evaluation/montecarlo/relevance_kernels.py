"""Which intruders still matter to an encounter, and when none does."""

import math

import numpy as np

from wideberth._jit import jit_uncounted


@jit_uncounted
def find_needed(
    own: np.ndarray,
    own_velocity: np.ndarray,
    positions: np.ndarray,
    velocities: np.ndarray,
    reach: float,
    reach_time: float,
    needed: np.ndarray,
) -> None:
    """Write which intruders matter now to detection, planning or separation: see `encounter_kernels.RunSettings`.

    One that moves away and is out of the planner's reach whatever the ownship does can be left alone. Its broadcasts
    wait until it is needed again, so that nothing depends on that.
    """
    for i in range(positions.shape[0]):
        dx, dy = positions[i, 0] - own[0], positions[i, 1] - own[1]
        vx, vy = velocities[i, 0], velocities[i, 1]
        away = dx * (vx - own_velocity[0]) + dy * (vy - own_velocity[1]) >= 0.0
        far = reach + reach_time * math.sqrt(vx * vx + vy * vy)
        needed[i] = not (away and dx * dx + dy * dy > far * far)


@jit_uncounted
def all_passed(
    own: np.ndarray,
    own_velocity: np.ndarray,
    mission_velocity: np.ndarray,
    positions: np.ndarray,
    velocities: np.ndarray,
) -> bool:
    """Return whether all intruders move away from the ownship, also if it flew along the mission."""
    for i in range(positions.shape[0]):
        dx, dy = positions[i, 0] - own[0], positions[i, 1] - own[1]
        vx, vy = velocities[i, 0], velocities[i, 1]
        if dx * (vx - own_velocity[0]) + dy * (vy - own_velocity[1]) < 0.0:
            return False
        if dx * (vx - mission_velocity[0]) + dy * (vy - mission_velocity[1]) < 0.0:
            return False
    return True


def warmup() -> None:
    """Compile every kernel of this module for the types it is used with."""
    zero = np.zeros((1, 3))
    find_needed(zero[0], zero[0], zero, zero, 1.0, 1.0, np.ones(1, np.bool_))
    all_passed(zero[0], zero[0], zero[0], zero, zero)
