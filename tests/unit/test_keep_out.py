"""Keep-out volumes: kernels against their twin, configuration."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from tests.naive import waypoint_paths as naive
from wideberth.avoidance.config import LocalLevelConfig
from wideberth.avoidance.keep_out import kernels as kk
from wideberth.avoidance.keep_out.config import CylinderKeepOut, PolygonKeepOut
from wideberth.avoidance.keep_out.volumes import keep_out_arrays
from wideberth.avoidance.waypoint_paths.config import AStarConfig

SQUARE = ((0.0, 0.0), (100.0, 0.0), (100.0, 100.0), (0.0, 100.0))


def enters(a, b, volumes, margin=0.0):
    return kk.volumes_entered(*np.array(a, float), *np.array(b, float), *keep_out_arrays(volumes, margin)) > 0


@settings(max_examples=40)
@given(st.integers(0, 2**32 - 1))
def test_entering_a_volume_equals_its_twin(seed):
    """Many places on the piece: the deepest is inside where the kernel says so (places just at the bound aside)."""
    rng = np.random.default_rng(seed)
    angles = np.sort(rng.uniform(0, 2 * np.pi, int(rng.integers(3, 8))))
    radii = rng.uniform(30, 120, len(angles))
    corners = np.column_stack([radii * np.cos(angles), radii * np.sin(angles)])
    margin = float(rng.choice([0.0, 25.0]))
    if rng.random() < 0.3:
        corners = corners[:1]
        volume = CylinderKeepOut(centre_m=tuple(corners[0]), radius_m=40.0, altitude_min_m=20.0, altitude_max_m=90.0)
        reach = margin + 40.0
    else:
        volume = PolygonKeepOut(vertices_m=tuple(map(tuple, corners)), altitude_min_m=20.0, altitude_max_m=90.0)
        reach = margin
    a, b = ([*rng.uniform(-250, 250, 2), -rng.uniform(0, 120)] for _ in range(2))
    a, b = np.array(a), np.array(b)
    depths = [naive.depth_in_volume(a + s * (b - a), 20.0, 90.0, corners, reach) for s in np.linspace(0, 1, 401)]
    if abs(max(depths)) > 1.0:
        assert enters(a, b, [volume], margin) == (max(depths) > 0.0)


def test_known_pieces():
    fence = PolygonKeepOut(vertices_m=SQUARE, altitude_max_m=50.0)
    assert enters([-50, 50, -10], [150, 50, -10], [fence])  # through
    assert enters([40, 40, -10], [60, 60, -10], [fence])  # inside
    assert not enters([-50, 50, -51], [150, 50, -51], [fence])  # over it
    assert enters([-50, 50, -80], [150, 50, -20], [fence])  # sinking into it
    assert not enters([-50, 50, -80], [150, 50, -56], [fence])
    assert not enters([-50, -1, -10], [150, -1, -10], [fence])
    assert enters([-50, -1, -10], [150, -1, -10], [fence], margin=1.5)
    assert enters([50, 50, -10], [50, 50, -10], [fence])  # a place
    mast = CylinderKeepOut(centre_m=(0.0, 0.0), radius_m=10.0)
    assert enters([-50, 9, 0], [50, 9, 0], [mast]) and not enters([-50, 11, 0], [50, 11, 0], [mast])
    path = np.array([[-90.0, 50, -10], [-50, 50, -10], [150, 50, -10]])
    arrays = keep_out_arrays([mast, fence], 0.0)
    assert kk.path_enters(path, 3, *arrays) == 1
    assert kk.path_enters(path, 2, *arrays) == -1
    assert kk.path_enters(path, 3, *keep_out_arrays([], 0.0)) == -1


def test_wrong_volumes_are_refused():
    for model in (LocalLevelConfig, AStarConfig):
        table = [{"kind": "polygon", "vertices_m": SQUARE}, {"kind": "cylinder", "centre_m": (1, 2), "radius_m": 3}]
        assert len(model(keep_out=table).keep_out) == 2
        for wrong in (
            {"kind": "polygon", "vertices_m": SQUARE[:2]},
            {"kind": "polygon", "vertices_m": ((0, 0), (1, 1), (2, 2))},
            {"kind": "cylinder", "centre_m": (0, 0), "radius_m": -1},
            {"kind": "cylinder", "centre_m": (0, 0), "radius_m": 1, "altitude_min_m": 5, "altitude_max_m": 4},
            {"kind": "cube"},
            {"kind": "cylinder", "centre_m": (0, float("nan")), "radius_m": 1},
        ):
            with pytest.raises(ValidationError):
                model(keep_out=[wrong])
