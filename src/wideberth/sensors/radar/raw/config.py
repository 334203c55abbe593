"""How the raw samples of a radar lie in a file."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from wideberth.part_config import PartConfig

Axis = Literal["frame", "sweep", "channel", "sample", "iq"]
_USUAL: dict[int, tuple[Axis, ...]] = {
    2: ("channel", "sample"),
    3: ("sweep", "channel", "sample"),
    4: ("frame", "sweep", "channel", "sample"),
}


class RawLayoutConfig(PartConfig):
    """Which axis of an array is what, and what its numbers mean.

    Attributes
    ----------
    axes : tuple of {"frame", "sweep", "channel", "sample", "iq"} or None
        From the slowest to the fastest; "iq" has two places, in phase and quadrature. None: frame, sweep, channel,
        sample, without the first where there are fewer axes.
    interleaved_iq : bool
        Whether in-phase and quadrature samples alternate along "sample".
    conjugate : bool
        For complex radars whose beat frequency falls with the range.
    member : str or None
        Which array of an .npz; None: "samples", or the only one.
    volts_per_unit : float
        What a 1 in the file is at the receiver's input, over 1 ohm.
    remove_mean : bool
        Whether each sweep's mean is taken off: offset-binary converters, leakage at zero range.
    skip_samples : int
        So many samples at the start of each sweep are left out, while the sweep settles; the radar's settings are those
        of what is left.
    channels : tuple of int or None
        Which channels of the file are ours, from 0, in the order of the array (`array.element_positions`); None: all.
    t_start_s : float
        Time of the start of the first sweep.
    frame_interval_s : float or None
        From one frame's start to the next; None: the radar's `update_interval_s` where the file has frames, and as
        long as the sweeps take where it has only sweeps. An array "t" of an .npz, one a frame, goes before it.
    """

    axes: tuple[Axis, ...] | None = None
    interleaved_iq: bool = False
    conjugate: bool = False
    member: str | None = None
    volts_per_unit: float = Field(default=1.0, gt=0.0)
    remove_mean: bool = False
    skip_samples: int = Field(default=0, ge=0)
    channels: tuple[Annotated[int, Field(ge=0)], ...] | None = Field(default=None, min_length=1)
    t_start_s: float = 0.0
    frame_interval_s: float | None = Field(default=None, gt=0.0)

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.axes is not None:
            if len(set(self.axes)) != len(self.axes):
                raise ValueError(f"axes {', '.join(self.axes)}: each at most once")
            if "sample" not in self.axes:
                raise ValueError("axes must name the one that is sample")
            if "iq" in self.axes and self.interleaved_iq:
                raise ValueError("interleaved_iq goes without an axis iq")
        if self.channels is not None and len(set(self.channels)) != len(self.channels):
            raise ValueError("channels: each at most once")
        return self

    def axes_of(self, dimensions: int) -> tuple[Axis, ...]:
        """Return the axes of an array with so many dimensions.

        Raises
        ------
        ValueError
            If `axes` has another number, or is None and the number has no usual meaning.
        """
        axes = _USUAL.get(dimensions) if self.axes is None else self.axes
        if axes is None or len(axes) != dimensions:
            said = "there is no usual order for that" if self.axes is None else f"axes names {len(self.axes)}"
            raise ValueError(f"the array has {dimensions} dimensions, {said}: give axes in [layout]")
        return axes


class PoseConfig(PartConfig):
    """Where a radar stands; its boresight is in the radar's own settings.

    Attributes
    ----------
    north_m, east_m, altitude_m : float
        From the origin of the local frame.
    roll_deg : float
        About its boresight, the right side down.
    """

    north_m: float = 0.0
    east_m: float = 0.0
    altitude_m: float = 0.0
    roll_deg: Annotated[float, Field(ge=-360.0, le=360.0)] = 0.0
