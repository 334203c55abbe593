"""What the integrity and accuracy codes of the versions of ADS-B mean, and the codes of size and emitter category.

RTCA DO-260B: 2.2.3.2.7.2.6 (NIC), appendix N (version 0 to NIC and NACp), 2.2.3.2.7.2.11 (length and width),
2.2.3.2.5.2 (category).
"""

_NIC_PLAIN = {9: 11, 10: 10, 12: 7, 13: 6, 14: 5, 15: 4, 17: 1, 20: 11, 21: 10}
# NUCp -> (NIC, NACp): containment radius and 95 % error that each NUCp promises, rounded towards the worse code.
_NUCP = {9: (11, 11), 8: (10, 10), 7: (8, 8), 6: (7, 7), 5: (6, 6), 4: (5, 5), 3: (4, 4), 2: (1, 1), 1: (1, 1)}
_SIZES = (
    None,
    (15.0, 23.0),
    (25.0, 28.5),
    (25.0, 34.0),
    (35.0, 33.0),
    (35.0, 38.0),
    (45.0, 39.5),
    (45.0, 45.0),
    (55.0, 45.0),
    (55.0, 52.0),
    (65.0, 59.5),
    (65.0, 67.0),
    (75.0, 72.5),
    (75.0, 80.0),
    (85.0, 80.0),
    (85.0, 90.0),
)


EMITTER_LETTERS = "ABCD"


def nucp(type_code: int) -> int:
    """Return the navigation uncertainty category of an airborne position's type code (version 0)."""
    if type_code in (20, 21):
        return 29 - type_code
    return 18 - type_code if 9 <= type_code <= 18 else 0


def nic(version: int, type_code: int, supplement_a: int, supplement_b: int) -> int:
    """Return the navigation integrity category of an airborne position.

    Parameters
    ----------
    version : int
        0 (also where it is not known yet), 1 or 2.
    type_code : int
        Of the position message, 0, 9 to 18 or 20 to 22.
    supplement_a : int
        NIC supplement of the operational status message (versions 1 and 2).
    supplement_b : int
        NIC supplement in the position message itself (version 2).
    """
    if version == 0:
        return _NUCP.get(nucp(type_code), (0, 0))[0]
    both = bool(supplement_a and (supplement_b or version == 1))
    if type_code == 11:
        return 9 if both else 8
    if type_code == 16:
        return 3 if both else 2
    return _NIC_PLAIN.get(type_code, 0)


def airborne_type(category: int | None) -> int:
    """Return the type code of an airborne position (version 2, pressure altitude) with a NIC; 18 where none is known.

    NIC 9 and 3 also need the supplements A and B (`nic`); with A alone they read as 8 and 2.
    """
    shared = {9: 11, 8: 11, 3: 16, 2: 16}
    plain = {value: code for code, value in _NIC_PLAIN.items() if code < 20}
    return {**plain, **shared}.get(category or 0, 18)


def nic_and_nacp_of_nucp(value: int) -> tuple[int, int]:
    """Return the NIC and NACp that stand for a NUCp of version 0."""
    return _NUCP.get(value, (0, 0))


def nacp_of_version_0(type_code: int) -> int:
    """Return the NACp that stands for the NUCp of a version 0 position."""
    return _NUCP.get(nucp(type_code), (0, 0))[1]


def length_and_width(code: int) -> tuple[float, float] | None:
    """Return the upper bounds of length and width, m, of a length/width code; None for "no data"."""
    return _SIZES[code & 15]


def emitter_category(type_code: int, code: int) -> str | None:
    """Return the emitter category ("A1" to "D7") of an identification message; None where it says nothing."""
    return f"{'DCBA'[type_code - 1]}{code}" if 1 <= type_code <= 4 and 1 <= code <= 7 else None


def emitter_category_of_number(number: int) -> str | None:
    """Return the emitter category ("A1" to "D7") of the number that UAT and GDL90 have for it; None for no data."""
    return f"{EMITTER_LETTERS[number >> 3]}{number & 7}" if 0 < number < 32 and number & 7 else None


def emitter_number(category: str | None) -> int:
    """Return the number that UAT and GDL90 have for an emitter category; 0 where none is known."""
    return next((k for k in range(32) if category and emitter_category_of_number(k) == category), 0)
