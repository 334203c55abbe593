"""Whether a radar's plots determine the state of an aircraft, and how well (thesis 3.3.3 and appendix B).

The nonlinear observability matrix (3.57) stacks the derivatives of what the radar measures, of its rate along the
motion, of the rate's rate and so on, to the state. Where its rank is the number of states, as many looks as it has
orders determine the state; where it is less, two states look the same. Rows are computed by truncated Taylor series,
exact but for rounding.

Convention: that of the thesis, for comparison with it. Positions are north, east and **altitude** (up), unlike the rest
of the package; the state of the turning model is ``[p_n, p_e, h, V, chi, gamma, V', chi', gamma']``, those of the
linear models are position, velocity (and acceleration), each north, east, up, as in (4.6). The sensor's attitude is
C_ned_sensor as everywhere (`wideberth.frames.rotation_ned_body` makes it from Euler angles).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wideberth.analysis.taylor_series import Series, atan2, sin_cos, sqrt

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

Model = Literal["constant_velocity", "constant_acceleration", "turning"]
Element = Literal["range", "azimuth", "elevation", "range_rate"]

STATES: dict[Model, int] = {"constant_velocity": 6, "constant_acceleration": 9, "turning": 9}

NEAR_M = 1e-6
"""Closer to the radar a target counts as at it, m."""
SMALL = 1e-9
"""Ratios and speeds (m/s) below this count as zero."""


@dataclass(frozen=True)
class SingularCases:
    """Where the state cannot be determined, by name; each an array of the shape of the states given.

    Parameters
    ----------
    at_radar : ndarray of bool
        L1 = 0: the target is at the radar, and no angle means anything.
    above_radar : ndarray of bool
        L2 = 0: the target is on the axis about which the radar measures azimuth (straight above or below a level
        radar). The determinant (B.37) grows without bound there, but azimuth and elevation have no derivatives.
    no_speed : ndarray of bool
        V = 0 in the turning model: no course and no flight path angle.
    vertical_path : ndarray of bool
        gamma = +-90 deg in the turning model: no course.
    """

    at_radar: BoolArray
    above_radar: BoolArray
    no_speed: BoolArray
    vertical_path: BoolArray

    @property
    def any(self) -> BoolArray:
        """Whether any of them holds."""
        return self.at_radar | self.above_radar | self.no_speed | self.vertical_path

    def names(self) -> list[str]:
        """Return the names of the cases that hold for any of the states."""
        return [name for name in self.__dataclass_fields__ if bool(np.any(getattr(self, name)))]


@dataclass(frozen=True)
class Observability:
    """The observability matrix of states, and what it says; the shape (...) is that of the states given.

    Parameters
    ----------
    matrix : ndarray, shape (..., looks * elements, states)
        (3.57): all elements of h first, then those of its first Lie derivative, and so on. SI, rad. Rows of elements
        that have no derivative (see `SingularCases`) are NaN.
    determinant : ndarray, shape (...)
        NaN where the matrix is not square or has rows of NaN.
    singular_values : ndarray, shape (..., states)
        Of the scaled matrix, rows of NaN left out, largest first.
    condition : ndarray, shape (...)
        Ratio of the largest to the smallest of them; infinite where the rank is not full.
    rank : ndarray of int, shape (...)
        Number of singular values above rounding.
    singular : SingularCases
    """

    matrix: FloatArray
    determinant: FloatArray
    singular_values: FloatArray
    condition: FloatArray
    rank: NDArray[np.int64]
    singular: SingularCases

    @property
    def observable(self) -> BoolArray:
        """Whether the looks determine the state."""
        full: BoolArray = self.rank == self.matrix.shape[-1]
        return full


def observability_matrix(
    state: ArrayLike,
    radar_position: ArrayLike,
    *,
    attitude: ArrayLike | None = None,
    model: Model = "turning",
    elements: Sequence[Element] = ("range", "azimuth", "elevation"),
    looks: int | None = None,
    state_scale: ArrayLike | None = None,
    element_scale: ArrayLike | None = None,
    time_scale_s: float = 1.0,
) -> Observability:
    """Return the observability matrix (3.57) of states seen by a radar, and what it says.

    Parameters
    ----------
    state : array_like, shape (..., states)
        North, east, **altitude** (m), then for the turning model speed (m/s), course, flight path angle (rad) and
        their rates; for the linear models velocity (m/s) and acceleration (m/s2), north, east, up.
    radar_position : array_like, shape (3,)
        North, east, **altitude**, m. The radar is taken as at rest, as in the thesis: a motion of its own that is
        known changes nothing about the states, only the velocity becomes the relative one.
    attitude : array_like, shape (3, 3), optional
        C_ned_sensor; level and looking north if not given, as (3.58)-(3.60).
    model : str
        ``"turning"`` (3.48), ``"constant_velocity"`` or ``"constant_acceleration"`` (4.6).
    elements : sequence of str
        What the radar measures: of ``"range"``, ``"azimuth"``, ``"elevation"``, ``"range_rate"``.
    looks : int, optional
        Orders of the matrix, 1 for h alone; 3 if not given (2 for constant velocity).
    state_scale, element_scale : array_like, optional
        Typical sizes of the states and of the elements (standard deviations, say), by which columns are multiplied
        and rows divided before singular values are taken. Ones if not given: SI, rad.
    time_scale_s : float
        Typical time between looks: rows of order k are multiplied by its k-th power, before singular values.

    Returns
    -------
    Observability

    Raises
    ------
    ValueError
        Where an argument has the wrong shape, is not finite or names nothing known.
    """
    n = _known_states(model)
    x = np.asarray(state, float)
    if x.ndim == 0 or x.shape[-1] != n:
        raise ValueError(f"state: the {model} model has {n} states, got the shape {x.shape}: give (..., {n})")
    if not np.isfinite(x).all():
        raise ValueError("state: not finite: leave out states with NaN or inf")
    radar = _finite(radar_position, (3,), "radar_position")
    pose = np.eye(3) if attitude is None else _finite(attitude, (3, 3), "attitude")
    if not np.allclose(pose @ pose.T, np.eye(3), atol=1e-6):
        raise ValueError("attitude: not a rotation matrix: give C_ned_sensor, e.g. frames.rotation_ned_body(...)")
    measured = _known_elements(elements)
    orders = (2 if model == "constant_velocity" else 3) if looks is None else looks
    if orders < 1:
        raise ValueError(f"looks: {orders}: give 1 or more")
    columns = np.ones(n) if state_scale is None else _finite(state_scale, (n,), "state_scale")
    sizes = np.ones(len(measured))
    if element_scale is not None:
        sizes = _finite(element_scale, (len(measured),), "element_scale")
    if not (columns > 0).all() or not (sizes > 0).all() or not 0.0 < time_scale_s < math.inf:
        raise ValueError("state_scale, element_scale, time_scale_s: give positive numbers")

    flat = x.reshape(-1, n)
    with np.errstate(divide="ignore", invalid="ignore"):
        position = _position(model, flat, orders + 1)
        matrix = _rows(position, radar, pose, measured, orders)
    singular = _singular_cases(model, flat, radar, pose)
    angles = np.tile([e in ("azimuth", "elevation") for e in measured], orders)
    matrix[singular.at_radar] = np.nan
    matrix[np.ix_(singular.above_radar, angles)] = np.nan
    rows = (time_scale_s ** np.arange(orders)[:, None] / sizes).ravel()
    defined = np.where(np.isfinite(matrix).all(axis=2, keepdims=True), matrix, 0.0)
    values = _singular_values(defined * rows[:, None] * columns)
    distance = np.linalg.norm(flat[:, :3] - radar, axis=1)
    rank = _rank(defined, *_natural_sizes(model, flat, distance), orders)
    determinant = np.full(len(flat), np.nan)
    if matrix.shape[1] == n:
        whole = np.isfinite(matrix).all(axis=(1, 2))
        determinant[whole] = np.linalg.det(matrix[whole])
    full = rank == n
    condition = np.full(len(flat), np.inf)
    condition[full] = values[full, 0] / values[full, -1]
    shape = x.shape[:-1]
    return Observability(
        matrix=matrix.reshape(*shape, *matrix.shape[1:]),
        determinant=determinant.reshape(shape),
        singular_values=values.reshape(*shape, n),
        condition=condition.reshape(shape),
        rank=rank.reshape(shape),
        singular=SingularCases(
            singular.at_radar.reshape(shape),
            singular.above_radar.reshape(shape),
            singular.no_speed.reshape(shape),
            singular.vertical_path.reshape(shape),
        ),
    )


def looks_needed(
    model: Model = "turning", elements: Sequence[Element] = ("range", "azimuth", "elevation"), most: int = 8
) -> int:
    """Return the smallest number of looks that determine a state in general position (thesis 3.3.3: three).

    Parameters
    ----------
    model : str
        As of `observability_matrix`.
    elements : sequence of str
        As of `observability_matrix`.
    most : int
        Where to stop.

    Returns
    -------
    int

    Raises
    ------
    ValueError
        Where even `most` looks do not: the elements do not determine the state.
    """
    n = _known_states(model)
    # No symmetry, and numbers near one, so that a rank that is not full is not full anywhere.
    state = np.array([0.7, 0.4, 0.5, 1.1, 0.6, 0.35, 0.25, 0.45, -0.3])[:n]
    for looks in range(1, most + 1):
        if observability_matrix(state, np.zeros(3), model=model, elements=elements, looks=looks).observable:
            return looks
    raise ValueError(
        f"elements: {', '.join(elements)} do not determine the {model} model in {most} looks: measure more of it"
    )


def _known_states(model: str) -> int:
    if model not in STATES:
        raise ValueError(f"model: {model!r} is not known: give one of {', '.join(STATES)}")
    return STATES[model]


def _known_elements(elements: Sequence[Element]) -> list[Element]:
    known = get_args(Element)
    if not elements or len(set(elements)) != len(elements) or not set(elements) <= set(known):
        raise ValueError(f"elements: {elements!r}: give some of {', '.join(known)}, each once")
    return list(elements)


def _finite(value: ArrayLike, shape: tuple[int, ...], name: str) -> FloatArray:
    array = np.asarray(value, float)
    if array.shape != shape:
        raise ValueError(f"{name}: the shape is {array.shape}: give {shape}")
    if not np.isfinite(array).all():
        raise ValueError(f"{name}: not finite")
    return array


def _position(model: Model, x: FloatArray, orders: int) -> list[Series]:
    """Return north, east and altitude along the motion."""
    points, n = x.shape

    def start(states: list[int]) -> Series:
        """Return the polynomial in time whose derivatives at the start are these states."""
        value, gradient = np.zeros((orders, points)), np.zeros((orders, points, n))
        for k, state in enumerate(states[:orders]):
            value[k] = x[:, state] / math.factorial(k)
            gradient[k, :, state] = 1.0 / math.factorial(k)
        return Series(value, gradient)

    if model != "turning":
        return [start(list(range(axis, n, 3))) for axis in range(3)]
    speed = start([3, 6])
    (sin_course, cos_course), (sin_path, cos_path) = sin_cos(start([4, 7])), sin_cos(start([5, 8]))
    level = speed * cos_path
    velocity = [level * cos_course, level * sin_course, speed * sin_path]
    return [_integrated(start([axis]), v) for axis, v in enumerate(velocity)]


def _integrated(start: Series, rate: Series) -> Series:
    value, gradient = start.value.copy(), start.gradient.copy()
    order = np.arange(1.0, len(value))
    value[1:] = rate.value[:-1] / order[:, None]
    gradient[1:] = rate.gradient[:-1] / order[:, None, None]
    return Series(value, gradient)


def _rows(
    position: list[Series], radar: FloatArray, pose: FloatArray, elements: list[Element], orders: int
) -> FloatArray:
    line = [p.shifted(-float(r)) for p, r in zip(position, radar, strict=True)]
    # Altitude is minus down: column 2 of the transposed attitude changes sign, and so does the third axis back.
    ahead, right, below = (
        line[0].scaled(pose[0, i]) + line[1].scaled(pose[1, i]) - line[2].scaled(pose[2, i]) for i in range(3)
    )
    ground_square = ahead * ahead + right * right
    distance = sqrt(ground_square + below * below)
    series = {"range": distance.shortened(), "range_rate": distance.derivative()}
    if "azimuth" in elements:
        series["azimuth"] = atan2(right, ahead).shortened()
    if "elevation" in elements:
        series["elevation"] = atan2(below.scaled(-1.0), sqrt(ground_square)).shortened()
    rows = [math.factorial(k) * series[e].gradient[k] for k in range(orders) for e in elements]
    return np.stack(rows, axis=1)


def _singular_cases(model: Model, x: FloatArray, radar: FloatArray, pose: FloatArray) -> SingularCases:
    line = (x[:, :3] - radar) * [1.0, 1.0, -1.0] @ pose
    distance, ground = np.linalg.norm(line, axis=1), np.hypot(line[:, 0], line[:, 1])
    at_radar = distance < NEAR_M
    turning = np.full(len(x), model == "turning")
    return SingularCases(
        at_radar=at_radar,
        above_radar=~at_radar & (ground <= SMALL * distance),
        no_speed=turning & (np.abs(x[:, 3]) < SMALL),
        vertical_path=turning & (np.abs(np.cos(x[:, 5])) < SMALL),
    )


def _natural_sizes(model: Model, x: FloatArray, distance: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return sizes of the states (points, n) and a time (points,) that make the matrix free of units.

    The length is the distance, the time what the target needs to fly it.
    """
    length = np.where(distance < NEAR_M, 1.0, distance)
    speed = np.abs(x[:, 3]) if model == "turning" else np.linalg.norm(x[:, 3:6], axis=1)
    speed = np.where(speed < SMALL, 1.0, speed)
    time, one = length / speed, np.ones(len(x))
    if model == "turning":
        sizes = [length] * 3 + [speed, one, one, speed / time, one / time, one / time]
    else:
        sizes = ([length] * 3 + [speed] * 3 + [speed / time] * 3)[: x.shape[1]]
    return np.stack(sizes, axis=1), time


def _singular_values(matrix: FloatArray) -> FloatArray:
    values = np.zeros((len(matrix), matrix.shape[2]))
    values[:, : min(matrix.shape[1:])] = np.linalg.svd(matrix, compute_uv=False)
    return values


def _rank(matrix: FloatArray, sizes: FloatArray, time: FloatArray, orders: int) -> NDArray[np.int64]:
    """Return the ranks: in natural sizes and with rows of length one, so that units and distances do not matter."""
    rows = time[:, None] ** np.repeat(np.arange(orders), matrix.shape[1] // orders)
    even = matrix * rows[:, :, None] * sizes[:, None, :]
    length = np.linalg.norm(even, axis=2, keepdims=True)
    values = _singular_values(even / np.where(length > 0.0, length, 1.0))
    rounding = 8.0 * max(matrix.shape[1:]) * np.finfo(float).eps
    return np.asarray((values > rounding * values[:, :1]).sum(axis=1), np.int64)
