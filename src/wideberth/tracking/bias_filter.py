"""The Kalman filter on the biases of all radars: drift, comparisons, and radars that agree with no other any more."""

import math
from collections import Counter, deque
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wideberth.tracking import registration_kernels as kernels
from wideberth.tracking.bias_correction import prior_sigma
from wideberth.tracking.config import RegistrationConfig
from wideberth.tracking.registration_kernels import BIASES, ELEVATION
from wideberth.types import FloatArray

REFERENCE = -1
"""In the place of a radar's number: an aircraft that says where it is."""

_NOT_OBSERVED = 0.5
_PROBATION = 2


class Comparison(NamedTuple):
    """Plots of one aircraft that are compared: arguments of `registration_kernels.fuse`, which describes them."""

    x: FloatArray
    px: FloatArray
    seeded: bool
    radars: NDArray[np.int64]
    sensors: FloatArray
    attitudes: FloatArray
    z: FloatArray
    variance: FloatArray
    dt: FloatArray


class BiasFilter:
    """Biases of radars that are numbered from 0, ten each.

    Parameters
    ----------
    config : RegistrationConfig
    counters : Counter of str
        Added to: comparisons by what became of them.

    Attributes
    ----------
    gate : float
        Largest squared Mahalanobis distance.
    b, p : ndarray, shape (10 n,) and (10 n, 10 n)
        Estimate and covariance.
    prior : ndarray, shape (n, 10)
        Standard deviations before anything is known; 0: not estimated.
    comparisons : list of int
        Plots of each radar that were used since it (last) started.
    """

    def __init__(self, config: RegistrationConfig, counters: Counter[str]) -> None:
        self._config = config
        self._counters = counters
        self._new = prior_sigma(config)
        self.gate = config.gate_mahalanobis**2
        self.b, self.p = np.zeros(0), np.zeros((0, 0))
        self.prior = np.zeros((0, BIASES))
        self.comparisons: list[int] = []
        self._outcomes: dict[tuple[int, int], deque[bool]] = {}
        self._pending: dict[tuple[int, ...], Comparison] = {}

    def add(self) -> int:
        """Add a radar of which nothing is known, and return its number."""
        r = len(self.comparisons)
        p = np.zeros((BIASES * (r + 1), BIASES * (r + 1)))
        p[:-BIASES, :-BIASES] = self.p
        self.b, self.p = np.concatenate([self.b, np.zeros(BIASES)]), p
        self.prior = np.concatenate([self.prior, self._new[None]])
        self.comparisons.append(0)
        self.restart(r)
        return r

    def of(self, r: int) -> tuple[FloatArray, FloatArray]:
        """Return biases (10,) and covariance (10, 10) of radar `r`."""
        own = _rows(r)
        return self.b[own].copy(), self.p[own, own].copy()

    def restart(self, r: int) -> None:
        """Forget radar `r`."""
        own = _rows(r)
        self.b[own] = 0.0
        self.p[own, :] = 0.0
        self.p[:, own] = 0.0
        self.p[own, own] = np.diag(self.prior[r] ** 2)
        self.comparisons[r] = 0
        self._outcomes = {pair: seen for pair, seen in self._outcomes.items() if r not in pair}
        self._pending = {key: first for key, first in self._pending.items() if r not in key[1:]}

    def without_elevation(self, r: int) -> None:
        """Take the elevation of radar `r`, which it does not measure, out of the estimate."""
        self.prior[r, ELEVATION] = 0.0
        row = BIASES * r + ELEVATION
        self.p[row, :] = 0.0
        self.p[:, row] = 0.0

    def drift(self, dt: float) -> None:
        """Let the biases wander for `dt`, s: towards zero, with a spread that ends at the prior's."""
        keep = math.exp(-dt / (3600.0 * self._config.drift_time_constant_h))
        self.b *= keep
        self.p *= keep * keep
        self.p[np.diag_indices_from(self.p)] += (1.0 - keep * keep) * self.prior.ravel() ** 2

    def wide(self) -> FloatArray:
        """Return a covariance as if nothing were known: what is beyond it cannot be explained by any bias."""
        return np.diag(np.maximum(self.prior.ravel() ** 2, self.p.diagonal()))

    def unobserved(self) -> list[FloatArray]:
        """Return the directions (10 n,) that keep more than half of the prior's variance, the least known first."""
        prior = self.prior.ravel()
        estimated = np.flatnonzero(prior > 0.0)
        if not len(estimated):
            return []
        scaled = self.p[np.ix_(estimated, estimated)] / np.outer(prior[estimated], prior[estimated])
        shares, directions = np.linalg.eigh(scaled)
        found = []
        for k in np.flatnonzero(shares > _NOT_OBSERVED)[::-1]:
            direction = np.zeros(len(prior))
            direction[estimated] = directions[:, k]
            found.append(direction)
        return found

    def compare(self, comparison: Comparison) -> None:
        """Update with plots of one aircraft.

        Parameters
        ----------
        comparison : Comparison
        """
        radars = comparison.radars.tolist()
        if min(self.comparisons[r] for r in radars) >= _PROBATION:
            self._account(comparison, self._run(self.b, self.p, comparison))
            return
        # The gate of an unknown radar is wide, and a false plot in it would make the bias seem known: two must agree.
        key = (int(comparison.seeded), *sorted(radars))
        first = self._pending.get(key)
        self._pending[key] = comparison
        if first is None:
            return
        b, p = self.b.copy(), self.p.copy()
        nis = [self._run(b, p, c) for c in (first, comparison)]
        if (np.concatenate([n[comparison.seeded :] for n in nis]) <= self.gate).all():
            self.b, self.p = b, p
            self._account(first, nis[0])
            self._account(comparison, nis[1])
            del self._pending[key]
        else:
            self._counters["first comparisons: not agreed"] += 1

    def judge(self, a: int, b: int, agreed: bool) -> None:
        """Note whether two radars (or a reference and a radar) agreed about an aircraft.

        Parameters
        ----------
        a, b : int
        agreed : bool
        """
        kind = "reference" if REFERENCE in (a, b) else "pair"
        self._counters[f"{kind}: {'used' if agreed else 'beyond the gate'}"] += 1
        window = self._config.suspect_window
        self._outcomes.setdefault((min(a, b), max(a, b)), deque(maxlen=window)).append(agreed)

    def disagreeing(self) -> list[int]:
        """Return the radars that no longer agree with any other, nor with a reference."""
        c = self._config
        agree: dict[int, list[bool]] = {}
        for pair, seen in self._outcomes.items():
            if len(seen) == c.suspect_window:
                good = seen.count(False) <= c.suspect_share * c.suspect_window
                for r in pair:
                    agree.setdefault(r, []).append(good)
        return sorted(r for r, good in agree.items() if r != REFERENCE and not any(good))

    def _run(self, b: FloatArray, p: FloatArray, comparison: Comparison) -> FloatArray:
        nis = np.zeros(len(comparison.radars))
        kernels.fuse(b, p, *comparison, self.gate, nis)
        return nis

    def _account(self, comparison: Comparison, nis: FloatArray) -> None:
        agreed = (nis <= self.gate).tolist()
        partner = int(comparison.radars[0]) if comparison.seeded else REFERENCE
        for k, r in enumerate(comparison.radars.tolist()):
            if comparison.seeded and k == 0:
                self.comparisons[r] += any(agreed[1:])
            else:
                self.comparisons[r] += agreed[k]
                self.judge(partner, r, agreed[k])


def _rows(r: int) -> slice:
    return slice(BIASES * r, BIASES * (r + 1))
