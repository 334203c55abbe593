"""Configuration of keep-out volumes."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from wideberth.part_config import PartConfig


class _Volume(PartConfig):
    """What every volume has: a name, and the altitudes between which it is closed.

    Attributes
    ----------
    altitude_min_m, altitude_max_m : float
        Above the local frame's zero; the bounds belong to the volume. By default all altitudes are closed.
    """

    name: str = "keep-out"
    altitude_min_m: float = -1e5
    altitude_max_m: float = 1e5

    @model_validator(mode="after")
    def _heights_in_order(self) -> Self:
        if self.altitude_max_m <= self.altitude_min_m:
            raise ValueError("altitude_max_m must be above altitude_min_m")
        return self


class PolygonKeepOut(_Volume):
    """A geofence or a piece of terrain (closed up to its top): a prism over a polygon.

    Attributes
    ----------
    vertices_m : list of (north, east)
        Corners in the local frame, in turn, either way round; the polygon need not be convex.
    """

    kind: Literal["polygon"] = "polygon"
    vertices_m: tuple[tuple[float, float], ...] = Field(min_length=3)

    @model_validator(mode="after")
    def _encloses_area(self) -> Self:
        corners = self.vertices_m
        twice = sum(a[0] * b[1] - a[1] * b[0] for a, b in zip(corners, (*corners[1:], corners[0]), strict=True))
        if abs(twice) < 1e-6:
            raise ValueError("vertices_m encloses no area: give the corners in turn")
        return self


class CylinderKeepOut(_Volume):
    """An upright cylinder, such as about a mast.

    Attributes
    ----------
    centre_m : (north, east)
    radius_m : float
    """

    kind: Literal["cylinder"] = "cylinder"
    centre_m: tuple[float, float]
    radius_m: float = Field(gt=0)


KeepOut = Annotated[PolygonKeepOut | CylinderKeepOut, Field(discriminator="kind")]
