"""Tracks that are born again when late scans are run in order keep the numbers by which they are known."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wideberth.tracking.multi_target.bank_kernels import Bank
from wideberth.tracking.multi_target.rival_kernels import renumber_rivals
from wideberth.tracking.multi_target.state import TrackerState

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

SAME = 16.8
"""Normalised distance squared within which a track is taken for one of before: 99 % for 6 degrees of freedom."""


@dataclass(frozen=True, slots=True)
class Numbers:
    """The tracks before late scans are run: numbers, places and velocities at time `t`, and the next number.

    Attributes
    ----------
    t : float
    identity : ndarray of int64, shape (n,)
    x : ndarray, shape (n, 6)
    p : ndarray, shape (n, 6, 6)
    heard, alive : ndarray of int64, shape (R,)
        Numbers of the tracks that only reports feed, by the place of their addresses, and whether there are any.
    following : int
    """

    t: float
    identity: IntArray
    x: FloatArray
    p: FloatArray
    heard: IntArray
    alive: IntArray
    following: int


def numbers_of(state: TrackerState) -> Numbers:
    """Return the numbers of a state's tracks.

    Parameters
    ----------
    state : TrackerState
    """
    bank, heard, size = state.bank, state.fusion.heard, state.fusion.size
    x, p = _estimates(bank)
    return Numbers(
        t=float(bank.t[0]),
        identity=bank.identity[: len(x)].copy(),
        x=x,
        p=p,
        heard=heard.number[:size].copy(),
        alive=heard.alive[:size].copy(),
        following=int(bank.size[1]),
    )


def keep_numbers(state: TrackerState, known: Numbers) -> None:
    """Give tracks that have come since `known` was noted the numbers of those that have gone and that they are.

    Parameters
    ----------
    state : TrackerState
        While scans are run again, after each of them.
    known : Numbers
    """
    bank, heard, size = state.bank, state.fusion.heard, state.fusion.size
    n = int(bank.size[0])
    new = np.flatnonzero(bank.identity[:n] >= known.following)
    gone = np.flatnonzero(~np.isin(known.identity, bank.identity[:n]))
    if len(new) and len(gone):
        x, p = _estimates(bank)
        back = known.x[gone].copy()
        back[:, :3] += (float(bank.t[0]) - known.t) * back[:, 3:]
        apart = x[new][:, None] - back[None]
        spread = p[new][:, None] + known.p[gone][None]
        square = np.einsum("ija,ija->ij", apart, np.linalg.solve(spread, apart[..., None])[..., 0])
        while square.size and square.min() < SAME:
            i, j = np.unravel_index(int(square.argmin()), square.shape)
            _renumber(state, int(bank.identity[new[i]]), int(known.identity[gone[j]]))
            square[i, :] = square[:, j] = np.inf
    used = set(bank.identity[:n].tolist()) | set(heard.number[:size][heard.alive[:size] == 1].tolist())
    both = min(size, len(known.heard))
    for u in np.flatnonzero((heard.number[:both] >= known.following) & (known.alive[:both] == 1)).tolist():
        if int(known.heard[u]) not in used:
            old, heard.number[u] = int(heard.number[u]), known.heard[u]
            _rename(state.fusion.events[: state.fusion.event_count[0]], (1, 3), old, int(known.heard[u]))


def _renumber(state: TrackerState, old: int, new: int) -> None:
    bank, fusion, s = state.bank, state.fusion, state.scratch
    identity = bank.identity[: bank.size[0]]
    identity[identity == old] = new
    renumber_rivals(fusion.heard, old, new)
    _rename(s.events[: s.event_count[0]], (1, 2), old, new)
    _rename(fusion.events[: fusion.event_count[0]], (1, 3), old, new)


def _rename(events: IntArray, columns: tuple[int, ...], old: int, new: int) -> None:
    for column in columns:
        values = events[:, column]
        values[values == old] = new


def _estimates(bank: Bank) -> tuple[FloatArray, FloatArray]:
    """Return means (n, 6) and covariances (n, 6, 6) of position and velocity over the hypotheses of motion."""
    n = int(bank.size[0])
    mu, each = bank.mu[:n], bank.x[:n, :, :6]
    x = np.einsum("nj,nja->na", mu, each)
    off = each - x[:, None]
    return x, np.einsum("nj,njab->nab", mu, bank.p[:n, :, :6, :6]) + np.einsum("nj,nja,njb->nab", mu, off, off)
