"""Whether a straight piece of path enters a keep-out volume.

A volume is closed between two altitudes, and horizontally within a margin of a polygon. A cylinder is one with a single
corner, its centre, and its radius for the margin.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted

Floats = NDArray[np.float64]

# One volume: altitudes (m), first corner and their number, horizontal margin (m).
BOTTOM, TOP, FIRST, COUNT, MARGIN = 0, 1, 2, 3, 4
N_VOLUME = 5


class KeepOuts(NamedTuple):
    """Keep-out volumes.

    Attributes
    ----------
    volumes : ndarray, shape (k, N_VOLUME)
    vertices : ndarray, shape (v, 2)
        Corners of all of them, north and east, m.
    """

    volumes: Floats
    vertices: Floats


@jit_uncounted
def distance_to_piece(pn: float, pe: float, an: float, ae: float, bn: float, be: float) -> float:
    """Return the distance (m) of a point from the piece a-b."""
    dn, de = bn - an, be - ae
    length2 = dn * dn + de * de
    s = 0.0
    if length2 > 0.0:
        s = max(0.0, min(1.0, ((pn - an) * dn + (pe - ae) * de) / length2))
    return math.hypot(pn - an - s * dn, pe - ae - s * de)


@jit_uncounted
def side(an: float, ae: float, bn: float, be: float, pn: float, pe: float) -> float:
    """Return on which side of the line a-b a point lies: the sign of twice the triangle's area."""
    return (bn - an) * (pe - ae) - (be - ae) * (pn - an)


@jit_uncounted
def pieces_cross(an: float, ae: float, bn: float, be: float, cn: float, ce: float, dn: float, de: float) -> bool:
    """Return whether the pieces a-b and c-d cross; touching ends are left to the distances."""
    return (side(an, ae, bn, be, cn, ce) > 0.0) != (side(an, ae, bn, be, dn, de) > 0.0) and (
        side(cn, ce, dn, de, an, ae) > 0.0
    ) != (side(cn, ce, dn, de, bn, be) > 0.0)


@jit_uncounted
def enters_volume(
    an: float, ae: float, ad: float, bn: float, be: float, bd: float, volume: Floats, vertices: Floats
) -> bool:
    """Return whether the piece a-b (local NED, m) touches one volume (N_VOLUME,)."""
    # Cut the piece to the altitudes that are closed.
    top, bottom = -volume[TOP], -volume[BOTTOM]
    first, last = 0.0, 1.0
    rise = bd - ad
    if rise == 0.0:
        if ad < top or ad > bottom:
            return False
    else:
        s0, s1 = (top - ad) / rise, (bottom - ad) / rise
        first, last = max(first, min(s0, s1)), min(last, max(s0, s1))
        if first > last:
            return False
    pn, pe = an + first * (bn - an), ae + first * (be - ae)
    qn, qe = an + last * (bn - an), ae + last * (be - ae)
    start, count, margin = int(volume[FIRST]), int(volume[COUNT]), volume[MARGIN]
    inside = False
    for i in range(count):
        cn, ce = vertices[start + i, 0], vertices[start + i, 1]
        j = start + (i + 1) % count
        dn, de = vertices[j, 0], vertices[j, 1]
        if count > 1 and pieces_cross(pn, pe, qn, qe, cn, ce, dn, de):
            return True
        nearest = min(
            distance_to_piece(pn, pe, cn, ce, dn, de),
            distance_to_piece(qn, qe, cn, ce, dn, de),
            distance_to_piece(cn, ce, pn, pe, qn, qe),
            distance_to_piece(dn, de, pn, pe, qn, qe),
        )
        if nearest <= margin:
            return True
        # A ray to the north from the piece's start crosses the outline an odd number of times from inside.
        if (ce > pe) != (de > pe) and pn < cn + (pe - ce) * (dn - cn) / (de - ce):
            inside = not inside
    return inside


@jit_uncounted
def volumes_entered(
    an: float, ae: float, ad: float, bn: float, be: float, bd: float, volumes: Floats, vertices: Floats
) -> int:
    """Return how many of the volumes of a `KeepOuts` the piece a-b (local NED, m) touches."""
    n = 0
    for i in range(volumes.shape[0]):
        if enters_volume(an, ae, ad, bn, be, bd, volumes[i], vertices):
            n += 1
    return n


@jit_uncounted
def path_enters(points: Floats, n: int, volumes: Floats, vertices: Floats) -> int:
    """Return the first of the n - 1 legs of a path that touches a volume, or -1.

    Parameters
    ----------
    points : ndarray, shape (>= n, 3)
        Local NED, m.
    n : int
    volumes, vertices : ndarray
        Of a `KeepOuts`.
    """
    for i in range(n - 1):
        a, b = points[i], points[i + 1]
        if volumes_entered(a[0], a[1], a[2], b[0], b[1], b[2], volumes, vertices) > 0:
            return i
    return -1


def warmup() -> None:
    """Compile every kernel that is called from Python."""
    volumes, vertices = np.zeros((1, N_VOLUME)), np.zeros((1, 2))
    volumes_entered(0.0, 0.0, 0.0, 1.0, 0.0, 0.0, volumes, vertices)
    path_enters(np.zeros((2, 3)), 2, volumes, vertices)
