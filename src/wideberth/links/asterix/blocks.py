"""Data blocks and records of ASTERIX, by the library libasterix, which knows the specifications.

Editions: category 021 2.7, 034 1.29, 048 1.32, 062 1.21. Their items keep their places over the editions of the last
decade (category 021 since 2.1).
"""

import importlib
import math
from collections import Counter
from collections.abc import Sequence
from typing import Any

from wideberth.errors import InputError

_CATEGORIES = {21: "Cat_021_2_7", 34: "Cat_034_1_29", 48: "Cat_048_1_32", 62: "Cat_062_1_21"}
_DAY = 86400.0
_LONGEST = 65507
_MOST_RECORDS = 1000
"""In a datagram: 65,000 empty ones would take more than a second."""

TIME_STEP = 1.0 / 128.0
"""Resolution of times of day, s."""


class Specifications:
    """The library, loaded when it is needed first.

    Raises
    ------
    InputError
        If it is not installed.
    """

    def __init__(self) -> None:
        try:
            self._base = importlib.import_module("asterix.base")
            generated = importlib.import_module("asterix.generated")
        except ImportError:
            raise InputError("ASTERIX needs the library libasterix: pip install 'wideberth[links]'") from None
        self._specs: dict[int, Any] = {number: getattr(generated, name) for number, name in _CATEGORIES.items()}

    def records(self, data: bytes, rejects: "Counter[str]") -> list[tuple[int, Any]]:
        """Return category and record of all that a datagram holds; what cannot be read is counted in `rejects`."""
        found: list[tuple[int, Any]] = []
        rest = self._base.Bits.from_bytes(data)
        while len(rest):
            parsed = self._base.RawDatablock.parse_single(rest)
            if isinstance(parsed, ValueError):
                rejects["block cut or damaged"] += 1
                break
            block, rest = parsed
            category = block.get_category()
            spec = self._specs.get(category)
            if spec is None:
                rejects["category not used"] += 1
                continue
            body = block.get_raw_records()
            while len(body):
                if len(found) >= _MOST_RECORDS:
                    rejects["records beyond the most in a datagram"] += 1
                    return found
                parsed = spec.cv_uap.cv_record.parse(self._base.ParsingMode.StrictParsing, body)
                if isinstance(parsed, ValueError):
                    rejects["record cut or damaged"] += 1
                    break
                record, body = parsed
                found.append((category, record))
        return found

    def block(self, category: int, records: Sequence[dict[str, Any]]) -> bytes:
        """Return a data block of records, each a mapping of items as the library takes them.

        Raises
        ------
        ValueError
            If they do not fit into a datagram.
        """
        make = self._specs[category].cv_uap.cv_record.create
        # The library joins records one by one, in quadratic time.
        body = b"".join(make(dict(items)).unparse().to_bytes() for items in records)
        size = 3 + len(body)
        if size > _LONGEST:
            raise ValueError(f"{len(records)} records do not fit into a datagram")
        return bytes([category]) + size.to_bytes(2, "big") + body


def find(record: Any, *names: str) -> Any:
    """Return the variation of an item, or of an element inside of it; None where the record has none."""
    node = record.get_item(names[0])
    for name in names[1:]:
        if node is None:
            return None
        node = node.variation.get_item(name)
    return None if node is None else node.variation


def number(record: Any, *names: str) -> float:
    """Return a quantity in the specification's unit; NaN where the record has none."""
    found = find(record, *names)
    return math.nan if found is None else float(found.content.as_quantity())


def code(record: Any, *names: str) -> int | None:
    """Return the raw value of an element; None where the record has none."""
    found = find(record, *names)
    return None if found is None else int(found.as_uint())


def flag(record: Any, *names: str) -> bool:
    """Return whether a bit is set; an absent one is not."""
    return bool(code(record, *names))


def text(record: Any, *names: str) -> str:
    """Return characters without spaces at their ends; empty where the record has none."""
    found = find(record, *names)
    return "" if found is None else str(found.content.as_string()).strip()


def source(record: Any) -> int:
    """Return the number of the system that a record is of: 256 SAC + SIC; -1 where it does not say."""
    sac, sic = code(record, "010", "SAC"), code(record, "010", "SIC")
    return -1 if sac is None or sic is None else 256 * sac + sic


def unix_time(second_of_day: float, t: float) -> float:
    """Return the Unix time, s, of a time of day that is nearest to a time of receipt `t`; NaN of NaN."""
    return second_of_day + _DAY * round((t - second_of_day) / _DAY) if not math.isnan(second_of_day) else math.nan


def time_of_day(t: float) -> float:
    """Return the time of day, s, of a Unix time, within the resolution of ASTERIX."""
    return round(t % _DAY / TIME_STEP) * TIME_STEP % _DAY
