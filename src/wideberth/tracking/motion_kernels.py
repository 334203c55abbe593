"""How aircraft move between looks: constant velocity, constant acceleration, and the turning model of thesis (3.48).

States, all NED with down positive (the thesis has altitude instead of down):

- constant velocity: position (3), velocity (3);
- constant acceleration: position (3), velocity (3), acceleration (3);
- turning: position (3), speed V along the path, course chi, flight path angle gamma (positive climbing), and the rates
  of these three, which stay.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted
from wideberth.tracking.matrix_kernels import congruence

FloatArray = NDArray[np.float64]

CONSTANT_VELOCITY = 0
CONSTANT_ACCELERATION = 1
TURNING = 2


@jit_uncounted
def state_count(model: int) -> int:
    """Return the number of states of a model."""
    return 6 if model == CONSTANT_VELOCITY else 9


@jit_uncounted
def path_velocity(speed: float, course: float, gamma: float, out: FloatArray) -> None:
    """Write the NED velocity of a speed along a path (3)."""
    cg = math.cos(gamma)
    out[0] = speed * math.cos(course) * cg
    out[1] = speed * math.sin(course) * cg
    out[2] = -speed * math.sin(gamma)


@jit_uncounted
def propagate(model: int, dt: float, x: FloatArray, out: FloatArray) -> None:
    """Write the state after `dt` (which may be negative: backwards in time); `out` may be `x`.

    The turning model is integrated by Simpson's rule along the path, whose speed and angles are linear in time: exact
    to dt^5, where thesis (3.1) takes one Euler step.
    """
    if model == TURNING:
        n, e, d = x[0], x[1], x[2]
        for k in range(3):
            weight = (1.0, 4.0, 1.0)[k] * dt / 6.0
            t = 0.5 * k * dt
            speed, course, gamma = x[3] + t * x[6], x[4] + t * x[7], x[5] + t * x[8]
            cg = math.cos(gamma)
            n += weight * speed * math.cos(course) * cg
            e += weight * speed * math.sin(course) * cg
            d -= weight * speed * math.sin(gamma)
        v, chi, gam = x[3] + dt * x[6], x[4] + dt * x[7], x[5] + dt * x[8]
        out[0], out[1], out[2] = n, e, d
        out[3], out[4], out[5] = v, chi, gam
        out[6], out[7], out[8] = x[6], x[7], x[8]
    else:
        for i in range(3):
            position, velocity = x[i] + dt * x[3 + i], x[3 + i]
            if model == CONSTANT_ACCELERATION:
                position += 0.5 * dt * dt * x[6 + i]
                velocity += dt * x[6 + i]
                out[6 + i] = x[6 + i]
            out[i] = position
            out[3 + i] = velocity


@jit_uncounted
def transition(model: int, dt: float, x: FloatArray, out: FloatArray) -> None:
    """Write the Jacobian of `propagate` (n, n) at `x`.

    Errata, "R-RANSAC and ER-RANSAC": the full discrete form, where thesis (4.8) lacks dt^2/2 and (3.5) is a first-order
    step of the covariance.
    """
    n = state_count(model)
    for i in range(n):
        for j in range(n):
            out[i, j] = 1.0 if i == j else 0.0
    if model == TURNING:
        for k in range(3):
            weight = (1.0, 4.0, 1.0)[k] * dt / 6.0
            t = 0.5 * k * dt
            speed, course, gamma = x[3] + t * x[6], x[4] + t * x[7], x[5] + t * x[8]
            cc, sc, cg, sg = math.cos(course), math.sin(course), math.cos(gamma), math.sin(gamma)
            # Columns: speed, course, flight path angle; those of the rates are t times these.
            nv, nc, ng = cc * cg, -speed * sc * cg, -speed * cc * sg
            ev, ec, eg = sc * cg, speed * cc * cg, -speed * sc * sg
            dv, dg = -sg, -speed * cg
            out[0, 3] += weight * nv
            out[0, 4] += weight * nc
            out[0, 5] += weight * ng
            out[1, 3] += weight * ev
            out[1, 4] += weight * ec
            out[1, 5] += weight * eg
            out[2, 3] += weight * dv
            out[2, 5] += weight * dg
            later = weight * t
            out[0, 6] += later * nv
            out[0, 7] += later * nc
            out[0, 8] += later * ng
            out[1, 6] += later * ev
            out[1, 7] += later * ec
            out[1, 8] += later * eg
            out[2, 6] += later * dv
            out[2, 8] += later * dg
        for i in range(3):
            out[3 + i, 6 + i] = dt
    else:
        for i in range(3):
            out[i, 3 + i] = dt
            if model == CONSTANT_ACCELERATION:
                out[i, 6 + i] = 0.5 * dt * dt
                out[3 + i, 6 + i] = dt


@jit_uncounted
def add_process_noise(model: int, dt: float, q: FloatArray, p: FloatArray) -> None:
    """Add to a covariance what white noise on the highest derivative makes of it over `dt` (negative: backwards).

    Parameters
    ----------
    model : int
    dt : float
        s.
    q : ndarray, shape (3,)
        Spectral densities: of the acceleration (m2/s3) of the constant-velocity model, of the jerk (m2/s5) of the
        constant-acceleration one, each north, east, down; of the rates of acceleration, course rate and path angle rate
        (m2/s5, rad2/s3, rad2/s3) of the turning one.
    p : ndarray, shape (n, n)
        Changed in place. The positions of the turning model get none: they follow from the other states.
    """
    t = abs(dt)
    t3 = t * t * t
    # Backwards in time, what pushed the velocity up has left the position behind: odd cross terms change sign.
    t2 = dt * t
    for i in range(3):
        if model == CONSTANT_VELOCITY:
            p[i, i] += q[i] * t3 / 3.0
            p[i, 3 + i] += q[i] * t2 / 2.0
            p[3 + i, i] += q[i] * t2 / 2.0
            p[3 + i, 3 + i] += q[i] * t
            continue
        if model == CONSTANT_ACCELERATION:
            p[i, i] += q[i] * t * t * t3 / 20.0
            p[i, 3 + i] += q[i] * t2 * t * t / 8.0
            p[3 + i, i] += q[i] * t2 * t * t / 8.0
            p[i, 6 + i] += q[i] * t3 / 6.0
            p[6 + i, i] += q[i] * t3 / 6.0
        p[3 + i, 3 + i] += q[i] * t3 / 3.0
        p[3 + i, 6 + i] += q[i] * t2 / 2.0
        p[6 + i, 3 + i] += q[i] * t2 / 2.0
        p[6 + i, 6 + i] += q[i] * t


@jit_uncounted
def predict(
    model: int, dt: float, q: FloatArray, x: FloatArray, p: FloatArray, f: FloatArray, work: FloatArray
) -> None:
    """Take state and covariance `dt` further in place; `f` and `work` (n, n) are written over."""
    n = state_count(model)
    transition(model, dt, x, f)
    congruence(f, p, n, n, work, p)
    add_process_noise(model, dt, q, p)
    propagate(model, dt, x, x)


@jit_uncounted
def kinematics(model: int, x: FloatArray, out: FloatArray, jacobian: FloatArray) -> None:
    """Write position, velocity and acceleration (9, NED) of a state, and their Jacobian (9, n).

    The constant-velocity model says nothing of the acceleration: zero.
    """
    n = state_count(model)
    for i in range(9):
        out[i] = 0.0
        for j in range(n):
            jacobian[i, j] = 0.0
    if model != TURNING:
        for i in range(n):
            out[i] = x[i]
            jacobian[i, i] = 1.0
        return
    v, vd, cd, gd = x[3], x[6], x[7], x[8]
    cc, sc, cg, sg = math.cos(x[4]), math.sin(x[4]), math.cos(x[5]), math.sin(x[5])
    for i in range(3):
        out[i] = x[i]
        jacobian[i, i] = 1.0
    out[3], out[4], out[5] = v * cc * cg, v * sc * cg, -v * sg
    jacobian[3, 3], jacobian[3, 4], jacobian[3, 5] = cc * cg, -v * sc * cg, -v * cc * sg
    jacobian[4, 3], jacobian[4, 4], jacobian[4, 5] = sc * cg, v * cc * cg, -v * sc * sg
    jacobian[5, 3], jacobian[5, 5] = -sg, -v * cg
    # a = d/dt (V u): along the horizontal course, across it, and down.
    along, across = vd * cg - v * gd * sg, v * cd * cg
    out[6], out[7], out[8] = along * cc - across * sc, along * sc + across * cc, -vd * sg - v * gd * cg
    along_v, along_g = -gd * sg, -vd * sg - v * gd * cg
    across_v, across_g = cd * cg, -v * cd * sg
    jacobian[6, 3], jacobian[7, 3] = along_v * cc - across_v * sc, along_v * sc + across_v * cc
    jacobian[6, 4], jacobian[7, 4] = -out[7], out[6]
    jacobian[6, 5], jacobian[7, 5] = along_g * cc - across_g * sc, along_g * sc + across_g * cc
    jacobian[6, 6], jacobian[7, 6] = cg * cc, cg * sc
    jacobian[6, 7], jacobian[7, 7] = -v * cg * sc, v * cg * cc
    jacobian[6, 8], jacobian[7, 8] = -v * sg * cc, -v * sg * sc
    jacobian[8, 3], jacobian[8, 5] = -gd * cg, -vd * cg + v * gd * sg
    jacobian[8, 6], jacobian[8, 8] = -sg, -v * cg


@jit_uncounted
def to_kinematics(
    model: int, x: FloatArray, p: FloatArray, out: FloatArray, covariance: FloatArray, f: FloatArray, work: FloatArray
) -> None:
    """Write position, velocity and acceleration (9, NED), and their covariance (9, 9); `f` and `work` are (9, 9)."""
    kinematics(model, x, out, f)
    congruence(f, p, state_count(model), 9, work, covariance)


def warmup() -> None:
    """Compile what Python calls."""
    for model in (CONSTANT_VELOCITY, CONSTANT_ACCELERATION, TURNING):
        n = state_count(model)
        x, p = np.ones(n), np.eye(n)
        f, work = np.zeros((9, 9)), np.zeros((9, 9))
        propagate(model, 0.1, x, np.zeros(n))
        transition(model, 0.1, x, f)
        predict(model, 0.1, np.ones(3), x, p, f, work)
        to_kinematics(model, x, p, np.zeros(9), np.zeros((9, 9)), f, work)
    path_velocity(1.0, 0.0, 0.0, np.zeros(3))
