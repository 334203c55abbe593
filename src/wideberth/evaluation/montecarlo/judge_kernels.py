"""What is scored of a run, step by step: separation, true events, and the alarms of four detectors."""

import math
from typing import NamedTuple

import numpy as np

from wideberth._jit import jit, jit_uncounted
from wideberth.conflict.alarm_kernels import N_ALARM, N_SCORES, alarm_scores, separation_ahead
from wideberth.evaluation.montecarlo.separation_kernels import N_CLOSEST, N_SIZES, score_step
from wideberth.tracking.life_kernels import STARTED

# What is judged by, one after the other: the parameters of `alarm_scores`, the rules of the other reading of the
# volume, the thresholds below which each detector raises an alarm, and the sizes of `separation_kernels`.
OTHER_RULES = N_ALARM
THRESHOLDS = OTHER_RULES + 8
SIZES = THRESHOLDS + N_SCORES
N_SCORING = SIZES + N_SIZES

# What is marked of an intruder: its closest approach (the columns of `separation_kernels`), its relative position at
# the step before, the first detection by algorithm 1 on true states (both readings), and each detector's first alarm
# and least score.
BEFORE = N_CLOSEST
TRUE = BEFORE + 3
TRUE_OTHER = TRUE + 1
FIRST = TRUE_OTHER + 1
SCORES = FIRST + N_SCORES
N_MARKS = SCORES + N_SCORES


class Judge(NamedTuple):
    """What is scored of a run.

    Attributes
    ----------
    marks : ndarray, shape (m, N_MARKS)
    inside : ndarray of int, shape (m,)
        Bits of the volumes that were entered.
    scores : ndarray, shape (N_SCORES,)
        Of the last intruder that was looked at.
    """

    marks: np.ndarray
    inside: np.ndarray
    scores: np.ndarray


_OWN_COVARIANCE = np.zeros((6, 6))  # the ownship knows its own state (ADS-B paper, "Simulation results")


@jit
def new_judge(m: int) -> Judge:
    """Return the scores of a run with `m` intruders, to be begun."""
    return Judge(np.zeros((m, N_MARKS)), np.zeros(m, np.int64), np.zeros(N_SCORES))


@jit_uncounted
def begin_judge(judge: Judge) -> None:
    """Begin with nothing seen."""
    judge.marks[:] = math.nan
    judge.marks[:, :BEFORE] = math.inf
    judge.marks[:, SCORES:] = math.inf
    judge.inside[:] = 0


@jit
def copy_judge(source: Judge, target: Judge) -> None:
    """Copy the scores."""
    target.marks[:] = source.marks
    target.inside[:] = source.inside


@jit_uncounted
def judge_step(
    t: float,
    own: np.ndarray,
    own_velocity: np.ndarray,
    positions: np.ndarray,
    velocities: np.ndarray,
    needed: np.ndarray,
    seen: np.ndarray,
    track_positions: np.ndarray,
    track_velocities: np.ndarray,
    covariances: np.ndarray,
    scoring: np.ndarray,
    marks: np.ndarray,
    inside: np.ndarray,
    scores: np.ndarray,
) -> None:
    """Judge one step.

    Parameters
    ----------
    t : float
        s.
    own, own_velocity : ndarray, shape (3,)
        True.
    positions, velocities : ndarray, shape (m, 3)
        True ones of the intruders.
    needed : ndarray of bool, shape (m,)
        Who matters; the others are left out.
    seen : ndarray of int, shape (m, N_INTEGERS)
        Whether there is a track, in the column `STARTED`.
    track_positions, track_velocities, covariances : ndarray, shape (m, 3), (m, 3), (m, 9, 9)
    scoring : ndarray, shape (N_SCORING,)
    marks, inside, scores
        Those of `Judge`.
    """
    sizes, other = scoring[SIZES:], scoring[OTHER_RULES:THRESHOLDS]
    for i in range(positions.shape[0]):
        if not needed[i]:
            continue
        sx, sy, sz = positions[i, 0] - own[0], positions[i, 1] - own[1], positions[i, 2] - own[2]
        vx, vy = velocities[i, 0] - own_velocity[0], velocities[i, 1] - own_velocity[1]
        vz = velocities[i, 2] - own_velocity[2]
        ax, ay, az = marks[i, BEFORE], marks[i, BEFORE + 1], marks[i, BEFORE + 2]
        if math.isnan(ax):
            ax, ay, az = sx, sy, sz
        inside[i] |= score_step(i, ax, ay, az, sx, sy, sz, vx, vy, vz, sizes, marks)
        marks[i, BEFORE], marks[i, BEFORE + 1], marks[i, BEFORE + 2] = sx, sy, sz
        if math.isnan(marks[i, TRUE]):
            _, d_cpa, h_cpa = separation_ahead(sx, sy, sz, vx, vy, vz, scoring)
            if d_cpa < scoring[3] and h_cpa < scoring[4]:
                marks[i, TRUE] = t
        if math.isnan(marks[i, TRUE_OTHER]):
            _, d_cpa, h_cpa = separation_ahead(sx, sy, sz, vx, vy, vz, other)
            if d_cpa < other[3] and h_cpa < other[4]:
                marks[i, TRUE_OTHER] = t
        if seen[i, STARTED] == 0:
            continue
        if alarm_scores(
            i,
            track_positions[i, 0] - own[0],
            track_positions[i, 1] - own[1],
            track_positions[i, 2] - own[2],
            track_velocities[i, 0] - own_velocity[0],
            track_velocities[i, 1] - own_velocity[1],
            track_velocities[i, 2] - own_velocity[2],
            covariances,
            scoring,
            scores,
            _OWN_COVARIANCE,
        ):
            for j in range(N_SCORES):
                score = scores[j]
                marks[i, SCORES + j] = min(marks[i, SCORES + j], score)
                if score < scoring[THRESHOLDS + j] and math.isnan(marks[i, FIRST + j]):
                    marks[i, FIRST + j] = t


def warmup() -> None:
    """Compile what Python calls of this module."""
    judge = new_judge(1)
    begin_judge(judge)
    zero = np.zeros((1, 3))
    judge_step(
        0.0, zero[0], zero[0], zero + 1.0, zero, np.ones(1, np.bool_), np.zeros((1, 8), np.int64), zero, zero,
        np.zeros((1, 9, 9)), np.ones(N_SCORING), judge.marks, judge.inside, judge.scores,
    )  # fmt: skip
