"""Where an aircraft may fly that a radar on the ground protects (thesis figure 4.2, article figure 1).

The radar sees aircraft in its surveillance volume. The ownship stays in an operation volume inside it, so that whoever
comes at it is seen from the required range on.
"""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from wideberth.argument_checks import NOT_NEGATIVE, POSITIVE, FloatArray, checked, choice

Shape = Literal["hemisphere", "cylinder"]


@dataclass(frozen=True, slots=True)
class SurveillanceVolume:
    """Where a radar on the ground holds tracks: a hemisphere, or an upright cylinder, that stands about it.

    Attributes
    ----------
    radius : float
        m.
    height : float
        m; that of a hemisphere is its radius.
    shape : {"hemisphere", "cylinder"}
    """

    radius: float
    height: float
    shape: Shape = "cylinder"

    def __post_init__(self) -> None:
        choice("shape", self.shape, ("hemisphere", "cylinder"))
        checked("radius", self.radius, POSITIVE)
        checked("height", self.height, POSITIVE)
        if self.shape == "hemisphere" and self.height != self.radius:
            raise ValueError("height must be the radius of a hemisphere")


@dataclass(frozen=True, slots=True)
class OperationVolume:
    """Where the ownship is protected, about the radar.

    Attributes
    ----------
    radius : float
        On the ground, its greatest, m; 0 if there is no such volume.
    height : float
        Above the radar, its greatest, m; 0 if there is no such volume.
    surveillance : SurveillanceVolume
    margin, margin_height : float
        By how much the surveillance volume reaches further than the operation volume, to the side and up, m.
    all_round : bool
        Whether the margin is a ball about the ownship; else it is a cylinder.
    """

    radius: float
    height: float
    surveillance: SurveillanceVolume
    margin: float
    margin_height: float
    all_round: bool

    def radius_at(self, height: ArrayLike) -> FloatArray:
        """Return the radius of the volume at a height.

        Parameters
        ----------
        height : array_like
            Above the radar, m.

        Returns
        -------
        ndarray
            m; 0 above the volume, and everywhere if there is none.

        Raises
        ------
        ValueError
            If a height is not finite, or negative.
        """
        z = checked("height", height, NOT_NEGATIVE)
        if self.surveillance.shape == "cylinder":
            radius = np.full(z.shape, self.radius)
        elif self.all_round:
            radius = np.sqrt(np.maximum((self.surveillance.radius - self.margin) ** 2 - z**2, 0.0))
        else:
            top = z + self.margin_height
            radius = np.sqrt(np.maximum(self.surveillance.radius**2 - top**2, 0.0)) - self.margin
        return np.asarray(np.where(z <= self.height, np.minimum(np.maximum(radius, 0.0), self.radius), 0.0))


def operation_volume(
    surveillance: SurveillanceVolume,
    required_range: float,
    *,
    required_height: float | None = None,
    turn_margin: float = 0.0,
) -> OperationVolume:
    """Return the operation volume inside a surveillance volume.

    Parameters
    ----------
    surveillance : SurveillanceVolume
        The range at which the radar has a *confirmed track* is what counts.
    required_range : float
        Greatest range at which an intruder must have a track, over all bearings and speeds, m.
    required_height : float or None
        How far above the ownship that intruder may be then, m: 0 where all fly level. None: it may come from any
        direction, and the required range applies all round.
    turn_margin : float
        Kept free inside, for the path of a turn at the border (such as the radius of the turn), m.

    Returns
    -------
    OperationVolume
        With radius and height 0 if the surveillance volume is too small.

    Raises
    ------
    ValueError
        If a length is not finite, or negative, or the required range not positive.
    """
    margin = float(checked("required_range", required_range, POSITIVE))
    margin += float(checked("turn_margin", turn_margin, NOT_NEGATIVE))
    all_round = required_height is None
    up = margin if required_height is None else float(checked("required_height", required_height, NOT_NEGATIVE))
    radius, height = surveillance.radius - margin, surveillance.height - up
    if surveillance.shape == "hemisphere" and not all_round:
        radius = math.sqrt(max(surveillance.radius**2 - up**2, 0.0)) - margin
        height = math.sqrt(max(surveillance.radius**2 - margin**2, 0.0)) - up
    if radius <= 0.0 or height <= 0.0:
        radius = height = 0.0
    return OperationVolume(radius, height, surveillance, margin, up, all_round)
