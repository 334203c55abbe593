"""The work that a decision may do: counted, not timed, so that a flight is the same on every machine."""

LOOK = 4  # a look of the refinement or of a judgement at an intruder from a leg, in those of the search and the chain
_JUDGEMENT = 400  # a judgement besides its looks


class Work:
    """What is left to do, in looks of the search and the chain at an intruder from a place (some 20 ns).

    Parameters
    ----------
    most : int
    """

    def __init__(self, most: int) -> None:
        self.left = most

    def part(self, share: float, kept: int = 0) -> int:
        """Return a share of what is left, with so much kept of it."""
        return max(0, min(int(share * self.left), self.left - kept))

    def take(self, work: int) -> None:
        """Note what was done."""
        self.left -= work

    def split(self, share: float) -> "Work":
        """Take a share of what is left for one part; `join` gives back what it leaves."""
        part = Work(self.part(share))
        self.take(part.left)
        return part

    def join(self, part: "Work") -> None:
        """Take back what a part has left."""
        self.left += part.left


def judgement(places: int, intruders: int) -> int:
    """Return the work of a judgement of a path of so many places."""
    return _JUDGEMENT + LOOK * places * intruders
