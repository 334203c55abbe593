"""Naive twin of the test for the ownship's track: whole histories, numpy, one rule after the other."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import multivariate_normal

from wideberth.tracking.ownship_kernels import OwnshipTest

FloatArray = NDArray[np.float64]


class NaiveIdentifier:
    """Keeps every look at each of n tracks, and sums them up anew each time."""

    def __init__(self, n: int, test: OwnshipTest) -> None:
        self.test, self.t, self.own = test, 0.0, -1
        self.looks: list[list[tuple[float, float, float]]] = [[] for _ in range(n)]  # time, dt, chi-square

    def step(
        self, dt: float, x: FloatArray, p: FloatArray, telemetry: FloatArray, covariance: FloatArray
    ) -> tuple[int, Sequence[float]]:
        """Return the track that is the ownship (-1 none) and the evidence for each."""
        self.t += dt
        test, evidence, explained, settled = self.test, [], [], []
        if not np.isfinite(telemetry).all():
            self.own = -1
            return -1, [math.nan] * len(self.looks)
        for i, looks in enumerate(self.looks):
            s = p[i, :6, :6] + covariance
            d = x[i, :6] - telemetry
            square = float(d @ np.linalg.inv(s) @ d)
            looks.append((self.t, dt, square))
            decay = np.array([dt_ * math.exp(-(self.t - t) / test.window_s) for t, dt_, _ in looks])
            capped = np.array([min(q, 2.0 * test.look_limit) for _, _, q in looks])
            mean = float((decay * capped).sum() / decay.sum())
            peak = multivariate_normal(np.zeros(6), s).logpdf(np.zeros(6))
            evidence.append(float(peak - 0.5 * mean - test.log_density))
            explained.append(mean <= test.mean_limit and square <= test.look_limit)
            settled.append(decay.sum() >= test.window_s * (1.0 - math.exp(-test.settle_s / test.window_s)))
        order = np.argsort(evidence)[::-1]
        best, own = int(order[0]), self.own
        if own >= 0 and not (explained[own] and evidence[own] > 0.0):
            own = -1
        clear = len(order) == 1 or evidence[best] - evidence[order[1]] >= test.margin
        if best != own and settled[best] and explained[best] and evidence[best] >= test.margin and clear:
            own = best
        self.own = own
        return own, evidence
