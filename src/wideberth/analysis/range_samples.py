"""What the four methods say along a swept argument, with a stated gap wherever one of them has no answer."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wideberth.analysis.detection_range import METHODS, minimum_detection_range, simulate_cpa
from wideberth.argument_checks import FloatArray, choice

QUANTITIES = ("distance", "maneuver_time", "cpa", "t_cpa", "error")
"""What is sampled; `error` is by what part of the range of "tgvv" a method falls short of it."""

_REFINED = 257  # points in an interval in which the case changes; looked through twice


@dataclass(frozen=True, slots=True)
class Gap:
    """Neighbouring points of a curve that have no answer, for one reason.

    Attributes
    ----------
    first, last : float
        Values of the swept argument there.
    count : int
        How many points.
    reason : str
        As the method says it.
    missing : tuple of str
        Which of the values are missing.
    """

    first: float
    last: float
    count: int
    reason: str
    missing: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Mark:
    """A point of a curve that is worth a mark.

    Attributes
    ----------
    x, y : float
    words : str
        What happens there, such as ``"B to A"``.
    """

    x: float
    y: float
    words: str


@dataclass(frozen=True, slots=True)
class Samples:
    """A method's answers along a sweep.

    Attributes
    ----------
    values : mapping of str to ndarray, shape (points,)
        By the names of `QUANTITIES`: m, s, m, s and a fraction; NaN where there is no answer.
    case : ndarray of str, shape (points,)
        As in `DetectionRange`, empty where there is none.
    gaps : tuple of Gap
    changes : tuple of Mark
        Where the case changes, with the distance there.
    """

    values: Mapping[str, FloatArray]
    case: NDArray[np.str_]
    gaps: tuple[Gap, ...]
    changes: tuple[Mark, ...]


def sample(
    methods: Sequence[str], x: FloatArray, swept: Mapping[str, FloatArray], fixed: Mapping[str, float]
) -> dict[str, Samples]:
    """Return what methods say along a sweep; "tgvv" is asked too, for the others are compared with it.

    Parameters
    ----------
    methods : sequence of str
        Of `detection_range.METHODS`.
    x : ndarray, shape (points,)
        What gaps and changes of the case are told by; rising.
    swept : mapping of str to ndarray, shape (points,)
        Arguments of `minimum_detection_range` that change.
    fixed : mapping of str to float
        Its other arguments.

    Returns
    -------
    dict
        By method.

    Raises
    ------
    ValueError
        If a method is not known. A value out of its range is no error: it leaves a gap.
    """
    for method in methods:
        choice("method", method, tuple(METHODS))
    arguments = {name: np.full(len(x), value) for name, value in fixed.items()} | dict(swept)
    (exact, _), _, exact_reasons = _ask_method("tgvv", arguments)
    return {method: _samples(method, x, arguments, exact, exact_reasons) for method in methods}


def _samples(
    method: str, x: FloatArray, arguments: Mapping[str, FloatArray], exact: FloatArray, exact_reasons: Mapping[int, str]
) -> Samples:
    (distance, maneuver_time), case, reasons = _ask_method(method, arguments)
    answered = np.isfinite(distance)
    flown: Any = {name: value[answered] for name, value in arguments.items() if name != "safety_radius"}
    reached = simulate_cpa(distance[answered], **flown)
    approach = np.full((2, len(x)), np.nan)
    approach[:, answered] = reached.cpa, reached.t_cpa
    # Where there is nothing to avoid and no time to wait all ranges are zero.
    error = np.divide(exact - distance, exact, out=np.zeros(len(x)), where=exact != 0.0)
    lost = {
        int(k): "the closest approach is beyond all numbers" for k in np.flatnonzero(answered & np.isnan(approach[0]))
    }
    gaps = _gaps(x, reasons, QUANTITIES) + _gaps(x, lost, ("cpa", "t_cpa"))
    alone = {k: f"TGVV has no answer to compare with: {why}" for k, why in exact_reasons.items() if k not in reasons}
    values = dict(zip(QUANTITIES, (distance, maneuver_time, *approach, error), strict=True))
    return Samples(values, case, gaps + _gaps(x, alone, ("error",)), _case_changes(method, x, case, arguments))


def _ask_method(
    method: Any, arguments: Mapping[str, FloatArray]
) -> tuple[FloatArray, NDArray[np.str_], dict[int, str]]:
    """Return distance and time, the case, and why points have no answer."""
    n = len(next(iter(arguments.values())))
    out, case = np.full((2, n), np.nan), np.full(n, "", "<U1")

    def ask(part: slice) -> None:
        with np.errstate(over="ignore", invalid="ignore"):  # told below
            found = minimum_detection_range(method=method, **{name: value[part] for name, value in arguments.items()})
        if not np.isfinite(found.distance).all():
            raise ValueError("the distance is beyond all numbers")
        out[:, part] = found.distance, found.maneuver_time
        if found.case is not None:
            case[part] = np.asarray(found.case).astype(str)

    return out, case, _one_by_one(ask, 0, n)


def _one_by_one(ask: Callable[[slice], None], start: int, stop: int) -> dict[int, str]:
    """Ask about a part of the points; what is refused is halved until each refusal is that of one point."""
    if start == stop:
        return {}
    try:
        ask(slice(start, stop))
    except ValueError as error:
        if stop - start == 1:
            return {start: str(error)}
        middle = (start + stop) // 2
        return _one_by_one(ask, start, middle) | _one_by_one(ask, middle, stop)
    return {}


def _gaps(x: FloatArray, reasons: Mapping[int, str], missing: tuple[str, ...]) -> tuple[Gap, ...]:
    gaps: list[Gap] = []
    previous: tuple[int, str] | None = None
    for k in sorted(reasons):
        # The value refused differs from point to point.
        cause = reasons[k].rpartition(", got ")[0] or reasons[k]
        if previous == (k - 1, cause):
            gaps[-1] = replace(gaps[-1], last=float(x[k]), count=gaps[-1].count + 1)
        else:
            gaps.append(Gap(float(x[k]), float(x[k]), 1, cause, missing))
        previous = k, cause
    return tuple(gaps)


def _case_changes(
    method: str, x: FloatArray, case: NDArray[np.str_], arguments: Mapping[str, FloatArray]
) -> tuple[Mark, ...]:
    marks = []
    for k in np.flatnonzero((case[1:] != case[:-1]) & (case[1:] != "") & (case[:-1] != "")):
        low, high = 0.0, 1.0
        for _ in range(2):
            part = np.linspace(low, high, _REFINED)
            between = {name: value[k] + part * (value[k + 1] - value[k]) for name, value in arguments.items()}
            answers, found, _ = _ask_method(method, between)
            last = int(np.argmax(found != found[0]))
            low, high = part[last - 1], part[last]
        at = float(x[k] + high * (x[k + 1] - x[k]))
        marks.append(Mark(at, float(answers[0, last]), f"{case[k]} to {case[k + 1]}"))
    return tuple(marks)
