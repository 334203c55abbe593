"""Windows of unexplained plots for tests, as the tracker fills them."""

import math

import numpy as np

from wideberth.tracking.multi_target.sighting_kernels import line_of_sight
from wideberth.tracking.multi_target.window_kernels import TABLE_NODES, Window, keep_plots, make_window, open_window
from wideberth.tracking.radar_kernels import to_plot

SIGMA = np.array([0.4, math.radians(1.0), math.radians(1.0), 0.3])


def window_of(scans, *, room=64, dt=0.1, density=1e-8, p_d=0.8, range_max=600.0, rates=False) -> Window:
    """Return a window with a scan for each list of plots (k, 4)."""
    window = make_window(len(scans), room)
    table = np.full(TABLE_NODES, range_max), np.full(TABLE_NODES, p_d)
    for k, rows in enumerate(scans):
        z = np.array(rows, float).reshape(-1, 4)
        sight = np.zeros((len(z), 3))
        for m in range(len(z)):
            line_of_sight(np.eye(3), z[m, 1], 0.0 if math.isnan(z[m, 2]) else z[m, 2], sight[m])
        fov = np.array([math.pi, math.pi / 2])
        open_window(window, k * dt, np.zeros(3), np.zeros(3), np.eye(3), fov, *table, density)
        order = np.argsort(z[:, 0], kind="stable")
        keep_plots(window, z, np.tile(SIGMA**2, (len(z), 1)), sight, order, len(z), np.zeros(len(z)))
    return window


def plot_of(position, rng=None, velocity=None):
    """Return a plot of a NED position; noisy with a generator, with range rate with a velocity."""
    out = np.zeros(3)
    to_plot(np.asarray(position, float), out)
    rate = math.nan if velocity is None else float(np.dot(position, velocity) / np.linalg.norm(position))
    z = np.array([*out, rate])
    return z if rng is None else z + rng.normal(size=4) * SIGMA


def flight(rng, n, start=(300.0, 100.0, -150.0), velocity=(-15.0, 5.0, 0.5), dt=0.1, rates=False):
    """Return a plot for each scan of a straight flight, and its state at the last one."""
    places = [np.add(start, np.multiply(velocity, k * dt)) for k in range(n)]
    plots = [plot_of(p, rng, velocity if rates else None) for p in places]
    return plots, np.array([*places[-1], *velocity])
