"""The risk laid out for the search, against the naive twin of the risk of one place."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.naive import avoidance as naive
from tests.unit.test_avoidance_kernels import RISK, predict
from wideberth.avoidance import search_risk_kernels as sk
from wideberth.avoidance.config import LocalLevelConfig
from wideberth.avoidance.local_level import printed_risk_array

SPEED, CLIMB, DT = 30.0, 5.0, 1.0
START = np.array([0.0, 0.0, -800.0])
seeds = st.integers(0, 2**32 - 1)


def laid_out(rng, risk):
    m, n = int(rng.integers(0, 6)), 30
    rows, weight, _, _ = predict(rng, m, DT, n, risk, near=3000.0) if m else (np.empty((0, n, 9)), np.empty(0), 0, 0)
    k_start, stride, samples = int(rng.integers(0, 8)), int(rng.integers(1, 3)), int(rng.integers(1, 9))
    traffic = sk.lay_out(SPEED, rows, weight, len(rows), n, DT, risk)
    around = sk.make_around(10, len(rows))
    sk.look_around(*START, SPEED, CLIMB, k_start, stride, samples, DT, traffic, risk, around)
    return rows, weight, traffic, around, k_start, stride, samples


@pytest.mark.parametrize("risk", [RISK, printed_risk_array(LocalLevelConfig())], ids=["default", "printed"])
@settings(max_examples=60)
@given(seed=seeds)
def test_risk_on_a_way_equals_its_twin_and_is_not_below_its_bounds(risk, seed):
    """Any way within reach: its two parts are the risk of its places, and each is at least what was promised."""
    rng = np.random.default_rng(seed)
    rows, weight, traffic, around, k_start, stride, samples = laid_out(rng, risk)
    p = START.copy()
    volumes, total = np.zeros(samples), 0.0
    for sample in range(samples):
        v = np.array([*rng.uniform(-1.0, 1.0, 2), rng.uniform(-CLIMB, CLIMB)])
        v[:2] *= SPEED / np.linalg.norm(v[:2]) * rng.choice([1.0, rng.uniform()])
        p += v * stride * DT
        around.way[sample] = p
        k = k_start + stride * (sample + 1)
        volumes[sample] = sk.volumes_risk(*p, v[0], v[1], k, k * DT, sample, traffic, around, risk) * stride * DT
        total += naive.risk_at(np.array([*p, *v]), rows[:, k], weight, k * DT, stride * DT, 1.0, risk, naive.Met())
    near = sk.near_on_way(k_start, stride, samples, DT, traffic, around, math.inf)
    assert volumes.sum() + near == pytest.approx(total, rel=1e-9, abs=1e-12)
    left = np.cumsum(volumes[::-1])[::-1]
    assert np.all(around.volumes_left[:samples] <= left + 1e-12)
    assert around.near_left[0] <= near + 1e-12
    assert sk.near_on_way(k_start, stride, samples, DT, traffic, around, 0.5 * near - 1e-9) == math.inf


def test_bounds_are_close_where_there_is_little_way():
    """Standing still, what is left is what is."""
    rng = np.random.default_rng(3)
    rows, weight, _, _ = predict(rng, 5, DT, 12, near=1500.0)
    traffic, around = sk.lay_out(0.0, rows, weight, len(rows), 12, DT, RISK), sk.make_around(10, len(rows))
    sk.look_around(*START, 0.0, 0.0, 1, 1, 10, DT, traffic, RISK, around)
    around.way[:] = START
    volumes = sum(sk.volumes_risk(*START, 0.0, 0.0, k, k * DT, k - 2, traffic, around, RISK) * DT for k in range(2, 12))
    assert around.volumes_left[0] == pytest.approx(volumes, rel=1e-6) and volumes > 0.0
    assert around.near_left[0] == pytest.approx(sk.near_on_way(1, 1, 10, DT, traffic, around, math.inf), rel=1e-6)
