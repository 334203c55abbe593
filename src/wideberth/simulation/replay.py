"""A recording played back through the protocol of a world: the pipeline meets the same inputs again."""

import dataclasses
from collections.abc import Iterable

from wideberth.types import Maneuver, Mission, Ownship, Scan, Snapshot


class ReplayWorld:
    """A world that gives back what was recorded; what is done to it changes nothing.

    Parameters
    ----------
    steps : iterable of (float, Ownship, list of Scan, Snapshot, Mission or None)
        In the order of time; a mission where it changed.
    mission : Mission
        What the ownship flew at first.

    Attributes
    ----------
    recorded : Snapshot or None
        What was made of the step that was sensed last.
    maneuver : Maneuver or None
        What was last asked to be flown.
    """

    def __init__(
        self, steps: Iterable[tuple[float, Ownship, list[Scan], Snapshot, Mission | None]], mission: Mission
    ) -> None:
        self._steps = iter(steps)
        self._next = next(self._steps, None)
        self._mission = mission
        self.recorded: Snapshot | None = None
        self.maneuver: Maneuver | None = None

    @property
    def mission(self) -> Mission:
        """The mission with the progress that was recorded."""
        if self.recorded is None:
            return self._mission
        return dataclasses.replace(self._mission, index=self.recorded.mission_index)

    @property
    def done(self) -> bool:
        """Whether all steps were given back."""
        return self._next is None

    @property
    def next_time(self) -> float | None:
        """Time of the next step, s; None at the end."""
        return None if self._next is None else self._next[0]

    def sense(self, t: float) -> tuple[Ownship, list[Scan]]:
        """Return the ownship and the scans of the next step, which must be that of time `t`, s.

        Raises
        ------
        ValueError
            If the next recorded step is another, or there is none.
        """
        if self._next is None:
            raise ValueError(f"the recording has no step at {t:.3f} s: it has ended")
        if self._next[0] != t:
            raise ValueError(f"the next recorded step is at {self._next[0]!r} s, not at {t!r} s")
        _, ownship, scans, self.recorded, changed = self._next
        self._mission = self._mission if changed is None else changed
        self._next = next(self._steps, None)
        return ownship, scans

    def actuate(self, t: float, maneuver: Maneuver | None) -> None:
        """Keep the maneuver for comparison; a recording flies as it flew."""
        self.maneuver = maneuver
