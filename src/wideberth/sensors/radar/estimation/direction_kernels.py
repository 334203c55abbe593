"""Kernel of the direction of an echo from its amplitudes in the channels."""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

DIRECTION = 6
"""Numbers of a direction: right, down (direction cosines), likelihood, the information right, down, both."""

_HALVINGS = 4
_EDGE = 0.9999


@jit
def fit_direction(
    h: ComplexArray,
    response: ComplexArray,
    places: FloatArray,
    right: float,
    down: float,
    iterations: int,
    fit: FloatArray,
    wave: ComplexArray,
) -> None:
    """Climb from a start to the direction that explains most of the channels' amplitudes `h`, of unit noise.

    The channels answer a wave of phases a with `response` @ a; `places` (channels, 2) are right and down, in
    wavelengths.
    A cosine along which the array has no extent stays. `fit` (DIRECTION); information per unit noise of `h`.
    `wave` (channels,): what the channels answer a wave from there.
    """
    n = h.shape[0]
    a = np.empty((3, n), dtype=np.complex128)
    e = np.empty((3, n), dtype=np.complex128)
    sums = np.empty(6)
    _project(h, response, places, right, down, a, e, sums)
    for _ in range(iterations):
        step_r, step_d = _step(sums)
        shrink = max(1.0, abs(step_r) / 0.2, abs(step_d) / 0.2)
        step_r /= shrink
        step_d /= shrink
        before = sums[0]
        better = False
        to_r, to_d = right, down
        for _ in range(_HALVINGS):
            to_r, to_d = right + step_r, down + step_d
            size = math.sqrt(to_r * to_r + to_d * to_d)
            if size > _EDGE:
                to_r *= _EDGE / size
                to_d *= _EDGE / size
            _project(h, response, places, to_r, to_d, a, e, sums)
            if sums[0] >= before:
                better = True
                break
            step_r *= 0.5
            step_d *= 0.5
        if not better:
            _project(h, response, places, right, down, a, e, sums)
            break
        moved = (to_r - right) ** 2 + (to_d - down) ** 2
        right, down = to_r, to_d
        if moved < 1e-12:
            break
    fit[0], fit[1], fit[2] = right, down, sums[0]
    fit[3], fit[4], fit[5] = 2.0 * sums[1], 2.0 * sums[2], 2.0 * sums[3]
    for c in range(n):
        wave[c] = e[0, c]


@jit
def answer(response: ComplexArray, places: FloatArray, right: float, down: float, wave: ComplexArray) -> None:
    """Fill `wave` (channels,) with what the channels answer a wave from a direction."""
    n = places.shape[0]
    a = np.empty(n, dtype=np.complex128)
    for c in range(n):
        angle = -2.0 * math.pi * (right * places[c, 0] + down * places[c, 1])
        a[c] = complex(math.cos(angle), math.sin(angle))
    for c in range(n):
        total = 0j
        for d in range(n):
            total += response[c, d] * a[d]
        wave[c] = total


@jit
def _project(
    h: ComplexArray,
    response: ComplexArray,
    places: FloatArray,
    right: float,
    down: float,
    a: ComplexArray,
    e: ComplexArray,
    sums: FloatArray,
) -> None:
    """Fill `sums`: likelihood, information (right, down, both), gradient (right, down)."""
    n = h.shape[0]
    for c in range(n):
        angle = -2.0 * math.pi * (right * places[c, 0] + down * places[c, 1])
        a[0, c] = complex(math.cos(angle), math.sin(angle))
        a[1, c] = a[0, c] * complex(0.0, -2.0 * math.pi * places[c, 0])
        a[2, c] = a[0, c] * complex(0.0, -2.0 * math.pi * places[c, 1])
    for i in range(3):
        for c in range(n):
            total = 0j
            for d in range(n):
                total += response[c, d] * a[i, d]
            e[i, c] = total
    norm = 0.0
    s0, s1, s2, g1, g2, g12 = 0j, 0j, 0j, 0j, 0j, 0j
    g11, g22 = 0.0, 0.0
    for c in range(n):
        x, r, d = e[0, c], e[1, c], e[2, c]
        norm += (x.conjugate() * x).real
        s0 += x.conjugate() * h[c]
        s1 += r.conjugate() * h[c]
        s2 += d.conjugate() * h[c]
        g1 += x.conjugate() * r
        g2 += x.conjugate() * d
        g12 += r.conjugate() * d
        g11 += (r.conjugate() * r).real
        g22 += (d.conjugate() * d).real
    alpha = s0 / norm
    power = (alpha.conjugate() * alpha).real
    sums[0] = power * norm
    sums[1] = power * (g11 - (g1.conjugate() * g1).real / norm)
    sums[2] = power * (g22 - (g2.conjugate() * g2).real / norm)
    sums[3] = power * (g12.real - (g1.conjugate() * g2).real / norm)
    sums[4] = (alpha.conjugate() * (s1 - g1.conjugate() * alpha)).real
    sums[5] = (alpha.conjugate() * (s2 - g2.conjugate() * alpha)).real


@jit
def _step(sums: FloatArray) -> tuple[float, float]:
    """Return the Gauss-Newton step, zero along a cosine without information."""
    tiny = 1e-9 * (sums[1] + sums[2])
    if sums[1] <= tiny and sums[2] <= tiny:
        return 0.0, 0.0
    if sums[1] <= tiny:
        return 0.0, sums[5] / sums[2]
    if sums[2] <= tiny:
        return sums[4] / sums[1], 0.0
    det = sums[1] * sums[2] - sums[3] * sums[3]
    return (sums[2] * sums[4] - sums[3] * sums[5]) / det, (sums[1] * sums[5] - sums[3] * sums[4]) / det


def warmup() -> None:
    """Compile what Python calls."""
    h = np.ones(2, dtype=np.complex128)
    response, places = np.eye(2, dtype=np.complex128), np.array([[-0.25, 0.0], [0.25, 0.0]])
    fit_direction(h, response, places, 0.0, 0.0, 1, np.zeros(DIRECTION), h.copy())
    answer(response, places, 0.0, 0.0, h)
