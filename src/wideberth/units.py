"""Conversion factors to SI, and parsing of quantities that carry their unit ("25kt", "500 ft")."""

import math
import re

FOOT = 0.3048
NAUTICAL_MILE = 1852.0
KNOT = NAUTICAL_MILE / 3600.0
FOOT_PER_MINUTE = FOOT / 60.0
DEGREE = math.pi / 180.0
GRAVITY = 9.81  # m/s2, the value that reproduces the source documents' numbers

UNITS: dict[str, dict[str, float]] = {
    "length": {"m": 1.0, "km": 1000.0, "ft": FOOT, "nmi": NAUTICAL_MILE},
    "speed": {"m/s": 1.0, "mps": 1.0, "km/h": 1 / 3.6, "kt": KNOT, "kn": KNOT, "ft/min": FOOT_PER_MINUTE, "ft/s": FOOT},
    "angle": {"rad": 1.0, "deg": DEGREE},
    "angular rate": {"rad/s": 1.0, "deg/s": DEGREE},
    "time": {"s": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0},
}
_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([A-Za-z/]+)\s*")


def parse_quantity(text: str, dimension: str) -> float:
    """Return a quantity in SI units from text with a unit.

    Parameters
    ----------
    text : str
        A number followed by its unit, such as ``"25kt"`` or ``"500 ft"``.
    dimension : str
        One of the keys of `UNITS`.

    Returns
    -------
    float
        The value in SI units (radians for angles).

    Raises
    ------
    ValueError
        If there is no number, no unit, or a unit of another dimension; the message lists the accepted units.
    """
    accepted = UNITS[dimension]
    match = _QUANTITY.fullmatch(text)
    if match is None or match[2] not in accepted:
        article = "an" if dimension[0] in "aeiou" else "a"
        raise ValueError(
            f"'{text}' is not {article} {dimension}: give a number with one of the units {', '.join(accepted)}"
        )
    return float(match[1]) * accepted[match[2]]
