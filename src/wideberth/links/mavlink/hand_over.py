"""What a program that is ended in the middle of a maneuver leaves to the next one, so that control is given back."""

import json
from dataclasses import asdict, dataclass

from wideberth.errors import InputError
from wideberth.links.mavlink.mission_items import Item


@dataclass(frozen=True, slots=True)
class HandOver:
    """What must be restored.

    Attributes
    ----------
    guided : bool
        Whether the maneuver was flown by set-points, else by the mission.
    seq : int
        The item to resume the mission with.
    items, altered : tuple of Item
        The mission as people gave it, and as we changed it.
    """

    guided: bool
    seq: int
    items: tuple[Item, ...]
    altered: tuple[Item, ...]

    def to_json(self) -> str:
        """Return it as text."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: str) -> "HandOver":
        """Return it from text.

        Raises
        ------
        InputError
            If it is something else.
        """
        try:
            values = json.loads(text)
            items, altered = (
                tuple(Item(**{**item, "params": tuple(item["params"])}) for item in values[name])
                for name in ("items", "altered")
            )
            return cls(bool(values["guided"]), int(values["seq"]), items, altered)
        except (ValueError, TypeError, KeyError) as error:
            raise InputError(f"this is no note of a maneuver to be restored: {error}") from error
