"""What the questions about ranges are asked of: arguments that mean the same everywhere, checked and broadcast."""

import math
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike

from wideberth.argument_checks import (
    FINITE,
    NOT_NEGATIVE,
    POSITIVE,
    POSITIVE_OR_INFINITE,
    Domain,
    FloatArray,
    checked,
)

DOMAINS: Mapping[str, Domain] = MappingProxyType(
    {
        "distance": NOT_NEGATIVE,
        "bearing": FINITE,
        "safety_radius": NOT_NEGATIVE,
        "half_height": POSITIVE,
        "computation_time": NOT_NEGATIVE,
        "slack": NOT_NEGATIVE,
        "horizon": POSITIVE_OR_INFINITE,
        "tailwind": FINITE,
        "crosswind": FINITE,
        # The ownship.
        # Far below these the turn would take more steps than can be waited for.
        "ownship_speed": Domain(1e-6, math.inf, "positive (at least 1e-6 m/s) and finite"),
        "max_bank": Domain(1e-6, 0.5 * math.pi, "at least 1e-6 and below pi/2 (rad)", high_open=True),
        "turn_angle": Domain(0.0, math.pi, "above 0 and at most pi (rad)", low_open=True),
        "max_bank_rate": POSITIVE_OR_INFINITE,
        "roll_time_constant": NOT_NEGATIVE,
        "new_speed": NOT_NEGATIVE,
        "new_course": Domain(-math.pi, math.pi, "within pi (rad)"),
        "acceleration": POSITIVE_OR_INFINITE,
        "climb_rate": NOT_NEGATIVE,
        "descent_rate": NOT_NEGATIVE,
        "vertical_acceleration": POSITIVE_OR_INFINITE,
        "time_constant": NOT_NEGATIVE,
        # The intruder.
        "intruder_speed": NOT_NEGATIVE,
        "intruder_course": FINITE,
        "intruder_climb_rate": FINITE,
        "intruder_turn_angle": Domain(0.0, math.pi, "at least 0 and at most pi (rad)"),
        "intruder_turn_rate": POSITIVE,
        "intruder_acceleration": NOT_NEGATIVE,
        "intruder_slowest": NOT_NEGATIVE,
        "intruder_fastest": NOT_NEGATIVE,
    }
)
"""What each argument may be."""


def checked_table(arguments: Mapping[str, ArrayLike]) -> tuple[FloatArray, tuple[int, ...]]:
    """Return arguments as a table, a row for each, and the shape that they broadcast to.

    Parameters
    ----------
    arguments : mapping
        By their names, those of `DOMAINS`.

    Returns
    -------
    table : ndarray, shape (arguments, elements)
    shape : tuple of int

    Raises
    ------
    ValueError
        If an element is out of its range, or they do not broadcast; the message names the argument, or those that are
        no single numbers with their shapes.
    """
    arrays = {name: checked(name, value, DOMAINS[name]) for name, value in arguments.items()}
    try:
        shape = np.broadcast_shapes(*(a.shape for a in arrays.values()))
    except ValueError as error:
        shapes = ", ".join(f"{name} {a.shape}" for name, a in arrays.items() if a.ndim)
        raise ValueError(f"shapes do not broadcast: {shapes}") from error
    table = np.empty((len(arrays), *shape))
    for k, array in enumerate(arrays.values()):
        table[k] = array
    return table.reshape(len(arrays), -1), shape
