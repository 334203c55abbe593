"""Keep-out volumes as the arrays that kernels take."""

from collections.abc import Sequence

import numpy as np

from wideberth.avoidance.keep_out import kernels
from wideberth.avoidance.keep_out.config import CylinderKeepOut, PolygonKeepOut


def keep_out_arrays(volumes: Sequence[PolygonKeepOut | CylinderKeepOut], margin: float) -> kernels.KeepOuts:
    """Return the volumes, each widened by `margin` metres horizontally, for the kernels."""
    rows = np.zeros((len(volumes), kernels.N_VOLUME))
    vertices: list[tuple[float, float]] = []
    for row, volume in zip(rows, volumes, strict=True):
        row[kernels.BOTTOM], row[kernels.TOP] = volume.altitude_min_m, volume.altitude_max_m
        row[kernels.FIRST], row[kernels.MARGIN] = len(vertices), margin
        if isinstance(volume, CylinderKeepOut):
            row[kernels.COUNT], row[kernels.MARGIN] = 1, margin + volume.radius_m
            vertices.append(volume.centre_m)
        else:
            row[kernels.COUNT] = len(volume.vertices_m)
            vertices.extend(volume.vertices_m)
    return kernels.KeepOuts(rows, np.array(vertices, float).reshape(-1, 2))
