"""How far a set of tracks is from a set of aircraft: OSPA and GOSPA, with their parts.

Sources: Schuhmacher, Vo and Vo, "A consistent metric for performance evaluation of multi-object filters" (2008), for
OSPA; Rahmathullah, Garcia-Fernandez and Svensson, "Generalized optimal sub-pattern assignment metric" (2017), for GOSPA
with alpha = 2, in which the cut-off distance of a pair is the price of one missed and one false track.
"""

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import linear_sum_assignment

from wideberth.argument_checks import POSITIVE, Domain, checked

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_ORDER = Domain(1.0, np.inf, "finite and at least 1")


class Ospa(NamedTuple):
    """OSPA and its parts, m: ``distance**p == localisation**p + cardinality**p``."""

    distance: float
    localisation: float
    cardinality: float


class Gospa(NamedTuple):
    """GOSPA, m, and its parts, m**p: ``distance**p == localisation + missed + false``."""

    distance: float
    localisation: float
    missed: float
    false: float


def distances(tracks: ArrayLike, truths: ArrayLike) -> FloatArray:
    """Return the distance of each track from each truth.

    Parameters
    ----------
    tracks : array_like, shape (n, d)
        Positions, m.
    truths : array_like, shape (m, d)
        Positions, m.

    Returns
    -------
    ndarray, shape (n, m)

    Raises
    ------
    ValueError
        If a position is not finite, or the shapes do not fit.
    """
    a, b = _points("tracks", tracks), _points("truths", truths)
    if a.shape[1] != b.shape[1] and len(a) and len(b):
        raise ValueError(f"tracks and truths must have the same number of coordinates, got {a.shape} and {b.shape}")
    if not len(a) or not len(b):
        return np.zeros((len(a), len(b)))
    return np.asarray(np.sqrt(((a[:, None] - b[None]) ** 2).sum(axis=2)))


def assigned(distance: FloatArray, cutoff: float, order: float) -> tuple[IntArray, IntArray]:
    """Return the pairs of the cheapest assignment that are nearer than the cut-off: rows and columns.

    Parameters
    ----------
    distance : ndarray, shape (n, m)
        As `distances` makes it, m.
    cutoff : float
        Distance from which on a pair is none, m.
    order : float
        Power of the distance that is summed.

    Returns
    -------
    rows, columns : ndarray, shape (pairs,)
    """
    rows, columns = linear_sum_assignment(np.minimum(distance, cutoff) ** order)
    near = distance[rows, columns] < cutoff
    return rows[near], columns[near]


def ospa(
    tracks: ArrayLike,
    truths: ArrayLike,
    cutoff: float = 50.0,
    order: float = 2.0,
    assign_by: Literal["power", "distance"] = "power",
) -> Ospa:
    """Return the optimal sub-pattern assignment distance.

    Parameters
    ----------
    tracks : array_like, shape (n, d)
        Positions, m.
    truths : array_like, shape (m, d)
        Positions, m.
    cutoff : float
        c: the price of one too many or too few, and the most that a pair costs, m.
    order : float
        p, at least 1.
    assign_by : {"power", "distance"}
        What the assignment makes least: the sum of the p-th powers, as defined, or of the distances themselves, as
        Stone Soup 1.9 does, which is never less and for most sets the same.

    Returns
    -------
    Ospa
        All 0 where both sets are empty.

    Raises
    ------
    ValueError
        If a position is not finite, the shapes do not fit, or `cutoff`, `order` or `assign_by` cannot be used.
    """
    if assign_by not in ("power", "distance"):
        raise ValueError(f"assign_by must be 'power' or 'distance', not {assign_by!r}")
    _check(cutoff, order)
    d = np.minimum(distances(tracks, truths), cutoff)
    rows, columns = linear_sum_assignment(d if assign_by == "distance" else d**order)
    return ospa_of(d, rows, columns, cutoff, order)


def gospa(tracks: ArrayLike, truths: ArrayLike, cutoff: float = 50.0, order: float = 2.0) -> Gospa:
    """Return the generalised optimal sub-pattern assignment distance, alpha = 2.

    Parameters
    ----------
    tracks : array_like, shape (n, d)
        Positions, m.
    truths : array_like, shape (m, d)
        Positions, m.
    cutoff : float
        c, m; one missed or one false track costs ``c**p / 2``.
    order : float
        p, at least 1.

    Returns
    -------
    Gospa
        All 0 where both sets are empty.

    Raises
    ------
    ValueError
        If a position is not finite, the shapes do not fit, or `cutoff` or `order` cannot be used.
    """
    _check(cutoff, order)
    d = distances(tracks, truths)
    rows, columns = assigned(d, cutoff, order)
    return gospa_of(d, rows, columns, cutoff, order)


def gospa_of(distance: FloatArray, rows: IntArray, columns: IntArray, cutoff: float, order: float) -> Gospa:
    """Return GOSPA of an assignment that is known.

    Parameters
    ----------
    distance : ndarray, shape (n, m)
        As `distances` makes it, m.
    rows, columns : ndarray, shape (pairs,)
        As `assigned` makes them.
    cutoff, order : float
        As in `gospa`.

    Returns
    -------
    Gospa
    """
    n, m = distance.shape
    localisation = float(np.sum(distance[rows, columns] ** order))
    missed, false = (m - len(rows)) * cutoff**order / 2, (n - len(rows)) * cutoff**order / 2
    return Gospa((localisation + missed + false) ** (1 / order), localisation, missed, false)


def ospa_of(distance: FloatArray, rows: IntArray, columns: IntArray, cutoff: float, order: float) -> Ospa:
    """Return OSPA of an assignment that is known.

    Parameters
    ----------
    distance : ndarray, shape (n, m)
        As `distances` makes it, m.
    rows, columns : ndarray, shape (pairs,)
        As `assigned` makes them.
    cutoff, order : float
        As in `ospa`.

    Returns
    -------
    Ospa
    """
    n, m = distance.shape
    if n == m == 0:
        return Ospa(0.0, 0.0, 0.0)
    # Pairs beyond the cut-off are pairs here still, at the price of the cut-off.
    localisation = float(np.sum(distance[rows, columns] ** order)) + (min(n, m) - len(rows)) * cutoff**order
    localisation /= max(n, m)
    cardinality = cutoff**order * abs(n - m) / max(n, m)
    return Ospa((localisation + cardinality) ** (1 / order), localisation ** (1 / order), cardinality ** (1 / order))


def _check(cutoff: float, order: float) -> None:
    checked("cutoff", cutoff, POSITIVE)
    checked("order", order, _ORDER)


def _points(name: str, points: ArrayLike) -> FloatArray:
    array = np.asarray(points, dtype=np.float64)
    if array.size == 0:
        return array.reshape(0, array.shape[1] if array.ndim == 2 else 0)
    if array.ndim != 2:
        raise ValueError(f"{name} must have shape (n, d), got {array.shape}")
    if not np.isfinite(array).all():
        raise ValueError(f"{name} must be finite, got {array[~np.isfinite(array)].flat[0]:g}")
    return array
