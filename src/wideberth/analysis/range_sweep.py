"""What a sweep of the detection ranges is: panels of curves, and the numbers that went in, each with its source."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from wideberth.analysis.range_samples import Gap, Mark
from wideberth.argument_checks import FloatArray
from wideberth.units import DEGREE, FOOT, KNOT, NAUTICAL_MILE

SYMBOLS: Mapping[str, tuple[str, str, float]] = MappingProxyType(
    {
        "ownship_speed": ("v_o", "kt", KNOT),
        "intruder_speed": ("v_i", "kt", KNOT),
        "safety_radius": ("R_s", "ft", FOOT),
        "max_bank": ("φ_max", "deg", DEGREE),
        "computation_time": ("t_c", "s", 1.0),
        "turn_angle": ("χ_t", "deg", DEGREE),
        "max_bank_rate": ("dφ/dt_max", "deg/s", DEGREE),
        "roll_time_constant": ("τ", "s", 1.0),
    }
)
"""The arguments: the thesis's symbol, the unit it gives them in, and that unit in SI."""


@dataclass(frozen=True, slots=True)
class Curve:
    """A method at one level.

    Attributes
    ----------
    method : str
        Of `detection_range.METHODS`.
    level : str
        In words, such as ``"300 kt"``; empty where there is only one.
    nominal : bool
        Whether the level is the one that all panels share.
    arguments : mapping of str to float
        The arguments that do not change along the curve.
    swept : mapping of str to ndarray, shape (points,)
        Those that do.
    x : ndarray, shape (points,)
        The swept quantity of the panel.
    values : mapping of str to ndarray, shape (points,)
        As `range_samples.Samples.values`; for the relative range, ``range``.
    case : ndarray of str, shape (points,)
        As `range_samples.Samples.case`.
    gaps : tuple of Gap
    marks : tuple of Mark
    """

    method: str
    level: str
    nominal: bool
    arguments: Mapping[str, float]
    swept: Mapping[str, FloatArray]
    x: FloatArray
    values: Mapping[str, FloatArray]
    case: NDArray[np.str_]
    gaps: tuple[Gap, ...] = ()
    marks: tuple[Mark, ...] = ()


@dataclass(frozen=True, slots=True)
class Panel:
    """One diagram of a figure.

    Attributes
    ----------
    letter : str
        Empty where the figure has only one.
    title : str
    x : str
        What is swept: ``ownship_speed``, ``time``, ``pilot_delay`` or ``inverse_bank_rate`` (s/rad).
    y : str
        What is shown: a key of the curves' values.
    curves : tuple of Curve
    length_unit : str
        In which lengths are best read: ``ft`` or ``nmi``.
    """

    letter: str
    title: str
    x: str
    y: str
    curves: tuple[Curve, ...]
    length_unit: str = "ft"


@dataclass(frozen=True, slots=True)
class Input:
    """Numbers that went in.

    Attributes
    ----------
    panels : str
        Letters of the panels; empty for all.
    name : str
    words : str
        Their values in the thesis's units.
    si : tuple of float
        The same in SI.
    si_unit : str
        Where there are several, they take turns.
    source : str
        Where they come from.
    """

    panels: str
    name: str
    words: str
    si: tuple[float, ...]
    si_unit: str
    source: str


@dataclass(frozen=True, slots=True)
class Sweep:
    """A figure, as numbers.

    Attributes
    ----------
    name : str
        Key of `FIGURES`.
    title : str
    panels : tuple of Panel
    inputs : tuple of Input
    changed : bool
        Whether an argument or the interval is not the default, or the points are fewer.
    """

    name: str
    title: str
    panels: tuple[Panel, ...]
    inputs: tuple[Input, ...]
    changed: bool = False

    @property
    def gaps(self) -> list[tuple[Panel, Curve, Gap]]:
        """All points at which a panel has nothing to show."""
        return [
            (panel, curve, gap)
            for panel in self.panels
            for curve in panel.curves
            for gap in curve.gaps
            if panel.y in gap.missing
        ]


SI_UNITS: Mapping[str, str] = MappingProxyType({"kt": "m/s", "ft": "m", "deg": "rad", "deg/s": "rad/s", "s": "s"})
"""The SI units of the units of `SYMBOLS`."""

LENGTH_UNITS: Mapping[str, float] = MappingProxyType({"ft": FOOT, "nmi": NAUTICAL_MILE})


def words(name: str, value: float, length_unit: str = "ft") -> str:
    """Return an argument in the thesis's unit, such as ``"150 kt"``; lengths in a unit of `LENGTH_UNITS`."""
    _, unit, factor = SYMBOLS[name]
    if unit in LENGTH_UNITS:
        unit, factor = length_unit, LENGTH_UNITS[length_unit]
    return f"{value / factor:.6g} {unit}".replace("inf", "∞")
