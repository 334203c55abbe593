"""Radar plots of made flights."""

import math

import numpy as np

from wideberth.plots import Plots

SIGMA = np.array([0.4, math.radians(1.0), math.radians(1.0)])
FIELD_OF_VIEW = (math.pi, math.pi / 2)


def straight(starts, velocities, n_scans, dt=0.1):
    """Positions (n_scans, targets, 3) of aircraft that fly on."""
    t = dt * np.arange(n_scans)
    return np.array(starts)[None] + t[:, None, None] * np.array(velocities)[None]


def made_plots(truth, seed, *, clutter=2, p_d=0.8, dt=0.1, sensor=None, attitude=None, sigma=SIGMA, noise=1.0):
    """Plots of `truth` (n_scans, targets, 3), in random order within each scan, with up to `clutter` false ones."""
    rng = np.random.default_rng(seed)
    n = len(truth)
    sensor = np.zeros((n, 3)) if sensor is None else sensor
    attitude = np.tile(np.eye(3), (n, 1, 1)) if attitude is None else attitude
    rows, first = [], [0]
    for k in range(n):
        scan = []
        for p in truth[k]:
            if rng.random() < p_d:
                x, y, z = attitude[k].T @ (p - sensor[k])
                true = [math.sqrt(x * x + y * y + z * z), math.atan2(y, x), math.atan2(-z, math.hypot(x, y))]
                scan.append(np.array(true) + noise * rng.normal(size=3) * sigma)
        for _ in range(rng.integers(0, clutter + 1)):
            scan.append(np.array([rng.uniform(20, 600), rng.uniform(-math.pi, math.pi), rng.uniform(-0.2, 1.4)]))
        rows += [scan[i] for i in rng.permutation(len(scan))]
        first.append(len(rows))
    z = np.full((len(rows), 4), np.nan)
    if rows:
        z[:, :3] = rows
    return Plots(
        first=np.array(first, dtype=np.int64),
        z=z,
        t=dt * np.arange(n),
        sensor_position=sensor,
        sensor_attitude=attitude,
        sigma=np.append(sigma, np.nan),
        detection_probability=p_d,
        range_max=1000.0,
        field_of_view=FIELD_OF_VIEW,
        dt=dt,
        ownship=np.full((n, 6), np.nan),
    )
