"""What one vehicle knows of all others from their messages: checked, counted, predicted, shown to a controller."""

import math
from collections import Counter
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wideberth.argument_checks import FINITE, checked
from wideberth.avoidance.cas import multi_kernels as multi
from wideberth.avoidance.cas.clock_offset import ClockOffset
from wideberth.avoidance.cas.config import CasConfig
from wideberth.avoidance.cas.vehicle_estimate import ReceivedState, VehicleEstimate
from wideberth.avoidance.cas.vehicle_message import Health, VehicleMessage
from wideberth.types import FloatArray

CAUSES = (
    "taken",
    "absurd",
    "jump",
    "duplicate",
    "out of order",
    "from the future",
    "own echo",
    "identity collision",
    "wrong clock",
    "stale",
    "doubted intent",
    "doubted cooperation",
    "failed vehicle",
)
"""What is counted: messages, but ``wrong clock`` comes on top, and ``stale`` and those after it count views."""

_FORGOTTEN = 3.0  # times `stale_s`
_SHARE_FLOWN = 0.2  # of the rate it says it flies: less is not flying it


class Traffic(NamedTuple):
    """The others as they are shown to a controller, in order of their numbers.

    Attributes
    ----------
    senders : tuple of int
        A number comes twice where two vehicles use it.
    own_row : int
        Row after which those of higher number begin (of the own number: farther north): `number` of the kernels'
        tie-breaks.
    views, use : ndarray, shape (n, N_VIEW) and (n,)
        For `multi_kernels` and `maneuver_kernels`.
    cooperates : ndarray of bool, shape (n,)
        Whether it is believed to avoid.
    closest : ndarray, shape (n, 2)
        Predicted t* and d*, s and m.
    """

    senders: tuple[int, ...]
    own_row: int
    views: FloatArray
    use: FloatArray
    cooperates: NDArray[np.bool_]
    closest: FloatArray


class _Known:
    """An estimate, and since when its vehicle has flown against what it says."""

    def __init__(self, estimate: VehicleEstimate, arrived: float) -> None:
        self.estimate, self.arrived = estimate, arrived
        self.against_since: float | None = None


class TrafficPicture:
    """Takes the messages of other vehicles and predicts how they pass (CAS thesis, 4.1.1, 4.1.2, 6.2.2).

    Parameters
    ----------
    config : CasConfig
        Its `prediction`, `smoothing`, `stale_s`.
    number : int
        Of the own vehicle.

    Attributes
    ----------
    counts : Counter
        By the names of `CAUSES`.
    counts_by_sender : dict of int to Counter
        The same for each sender.

    Notes
    -----
    States are moved on by their messages' age, by clocks that are compared. A message far from where its sender is
    expected is not believed at once; where a second one fits it, two vehicles use one number and both are kept, or, if
    nothing more comes from the first place, the vehicle is there now.
    """

    def __init__(self, config: CasConfig, number: int) -> None:
        self.number = number
        self.counts: Counter[str] = Counter()
        self.counts_by_sender: dict[int, Counter[str]] = {}
        self._config = config
        self._known: dict[int, list[_Known]] = {}
        self._doubtful: dict[int, _Known] = {}
        self._clocks: dict[int, ClockOffset] = {}
        self._own: tuple[float, FloatArray] | None = None

    def take(self, message: VehicleMessage, now: float) -> bool:
        """Take a message that has come by `now` (own clock, s), and return whether it is believed."""
        state, cause = self._checked(message, now), "absurd"
        if state is not None:
            c = self._config.prediction
            clock = self._clocks.setdefault(message.sender, ClockOffset(c.clock_tolerance_s))
            echo = message.echo_time, message.echo_received
            known_echo = _finite_or_nan(echo, (2,)) is not None
            borne_out = clock.take(now, message.time, *(echo if known_echo else (None, None)))
            cause = "from the future"
            if borne_out:
                if abs(clock.value) > c.clock_tolerance_s:
                    self._count(message.sender, "wrong clock")
                cause = self._sort(message.sender, state, now)
        self._count(message.sender, cause)
        return cause in {"taken", "identity collision"}

    def clock_offset(self, sender: int) -> float:
        """Return by how much a sender's clock is ahead, s."""
        clock = self._clocks.get(sender)
        return 0.0 if clock is None else clock.value

    def traffic(self, now: float, own: ArrayLike, own_path: ArrayLike | None = None) -> Traffic:
        """Return the others as predicted now.

        Parameters
        ----------
        now : float
            Own clock, s.
        own : array_like, shape (6,)
            Own position and velocity, NED.
        own_path : array_like, shape (n, 4), optional
            Own waypoints: time, north, east, down. Used with ``prediction.intent``.

        Raises
        ------
        ValueError
            If an argument has another shape or is not finite.
        """
        x = checked("own", own, FINITE)
        if x.shape != (6,):
            raise ValueError(f"own must be (6,), position and velocity, not {x.shape}")
        path = None if own_path is None else checked("own_path", own_path, FINITE)
        if path is not None and (path.ndim != 2 or path.shape[1] != 4 or (np.diff(path[:, 0]) <= 0.0).any()):
            raise ValueError("own_path must be (n, 4) with increasing times")
        self._own = now, x
        # Those that have the own number are told from us by their place, which they know like we do.
        self._forget(now)
        placed = [
            (sender, self._north(sender, known, now), known) for sender in self._known for known in self._known[sender]
        ]
        placed.sort(key=lambda row: row[:2])
        rows = [(sender, known) for sender, _, known in placed]
        views, use = np.zeros((len(rows), multi.N_VIEW)), np.zeros(len(rows))
        cooperates, closest = np.zeros(len(rows), bool), np.full((len(rows), 2), np.nan)
        for j, (sender, known) in enumerate(rows):
            ahead = self.clock_offset(sender)
            age = now + ahead - known.estimate.last.time
            if age > self._config.stale_s:
                self._count(sender, "stale")
                continue
            shifted = None if path is None else path + np.array([ahead, 0.0, 0.0, 0.0])
            predicted = known.estimate.predict(now + ahead, x, shifted)
            if predicted.strays:
                self._count(sender, "doubted intent")
            use[j], closest[j] = 1.0, (predicted.t_star, predicted.d_star)
            views[j, :3], views[j, 3:6] = predicted.position, predicted.velocity
            wanted = known.estimate.last.z_wanted
            views[j, multi.V_WANTED] = predicted.position[2] if math.isnan(wanted) else wanted
            views[j, multi.V_AGE], views[j, multi.V_VARIANCE] = max(age, 0.0), predicted.variance
            cooperates[j] = self._believed(sender, known, now)
        senders = tuple(sender for sender, _ in rows)
        own_row = sum((sender, north) < (self.number, x[0]) for sender, north, _ in placed) - 1
        return Traffic(senders, own_row, views, use, cooperates, closest)

    def _north(self, sender: int, known: _Known, now: float) -> float:
        """Return how far north a vehicle is, m; 0 where its number alone tells it from all others."""
        if sender != self.number and len(self._known[sender]) == 1:
            return 0.0
        return float(known.estimate.position_at(now + self.clock_offset(sender))[0])

    def _forget(self, now: float) -> None:
        """Drop vehicles that have been stale for long."""
        longest = _FORGOTTEN * self._config.stale_s
        for sender in list(self._known):
            self._known[sender] = [k for k in self._known[sender] if now - k.arrived <= longest]
            if not self._known[sender]:
                del self._known[sender]
                self._doubtful.pop(sender, None)
                self._clocks.pop(sender, None)

    def _count(self, sender: int, cause: str) -> None:
        self.counts[cause] += 1
        self.counts_by_sender.setdefault(sender, Counter())[cause] += 1

    def _checked(self, message: VehicleMessage, now: float) -> ReceivedState | None:
        """Return the numbers of a message; None where they make no sense."""
        c = self._config.prediction
        parts = [_finite_or_nan(part, (3,)) for part in (message.position, message.velocity, message.acceleration)]
        scalars = [
            _finite_or_nan(part, ())
            for part in (message.time, message.position_sigma, message.z_wanted, message.avoidance_rate)
        ]
        waypoints = _waypoints(message.waypoints)
        if waypoints is None or any(part is None for part in (*parts, *scalars)):
            return None
        measured = np.array(parts)
        time, sigma, wanted, rate = (float(part) for part in scalars if part is not None)
        sizes = np.abs(measured).max(axis=1)
        far = max(np.abs(waypoints[:, 1:]).max(initial=0.0), np.abs(waypoints[:, 0] - time).max(initial=0.0))
        if (
            not abs(now - time) <= c.clock_limit_s
            or not sizes[0] <= c.distance_limit_m
            or sizes[1] > c.speed_limit_mps
            or np.linalg.norm(measured[1]) > c.speed_limit_mps
            or sizes[2] > c.acceleration_limit_mps2
            or not (math.isnan(sigma) or 0.0 < sigma <= c.distance_limit_m)
            or abs(rate) > c.speed_limit_mps
            or max(far, abs(wanted)) > c.distance_limit_m
            or message.health not in tuple(Health)
        ):
            return None
        return ReceivedState(
            time,
            measured,
            c.position_sigma_m if math.isnan(sigma) else sigma,
            waypoints,
            wanted,
            bool(message.cooperates),
            rate,
            Health(message.health),
        )

    def _fits(self, expected: FloatArray, seconds: float, state: ReceivedState) -> bool:
        c = self._config.prediction
        far = float(np.linalg.norm(state.measured[0] - expected))
        return far <= c.jump_limit_m + abs(seconds) * c.speed_limit_mps

    def _sort(self, sender: int, state: ReceivedState, now: float) -> str:
        """Give a message to the vehicle that it is of, and return what is counted."""
        if sender == self.number and self._own is not None:
            t, own = self._own
            since = state.time - self.clock_offset(sender) - t
            if self._fits(own[:3] + own[3:] * since, since, state):
                return "own echo"
        known = self._known.setdefault(sender, [])
        if not known:
            known.append(self._new(state, now))
            return "identity collision" if sender == self.number else "taken"
        fitting = [k for k in known if self._fits(k.estimate.position_at(state.time), self._since(k, state), state)]
        if fitting:
            position = state.measured[0]
            nearest = min(fitting, key=lambda k: np.linalg.norm(k.estimate.position_at(state.time) - position))
            last = nearest.estimate.last
            if state.time == last.time:
                if np.array_equal(position, last.measured[0]):
                    return "duplicate"
            elif state.time < last.time:
                return "out of order"
            else:
                nearest.estimate.take(state)
                nearest.arrived = now
                return "identity collision" if len(known) > 1 or sender == self.number else "taken"
        return self._doubt(sender, state, now)

    def _doubt(self, sender: int, state: ReceivedState, now: float) -> str:
        """Keep a message that fits no known place until another one bears it out."""
        known, doubtful = self._known[sender], self._doubtful.get(sender)
        if doubtful is not None and now - doubtful.arrived > self._config.stale_s:
            doubtful = None
        if doubtful is None or not self._fits(
            doubtful.estimate.position_at(state.time), self._since(doubtful, state), state
        ):
            self._doubtful[sender] = self._new(state, now)
            return "jump"
        if state.time <= doubtful.estimate.last.time:
            return "duplicate" if state.time == doubtful.estimate.last.time else "out of order"
        doubtful.estimate.take(state)
        # Those that have sent since the doubt began are there as well.
        alive = [k for k in known if k.arrived >= doubtful.arrived]
        doubtful.arrived = now
        self._known[sender] = [*alive, doubtful]
        del self._doubtful[sender]
        return "identity collision" if alive else "taken"

    def _new(self, state: ReceivedState, now: float) -> _Known:
        return _Known(VehicleEstimate(self._config.prediction, self._config.smoothing, state), now)

    @staticmethod
    def _since(known: _Known, state: ReceivedState) -> float:
        return state.time - known.estimate.last.time

    def _believed(self, sender: int, known: _Known, now: float) -> bool:
        """Return whether a vehicle is taken to avoid: it says so, is well, and flies as it says."""
        last = known.estimate.last
        if last.health is Health.FAILED:
            self._count(sender, "failed vehicle")
            return False
        rate = last.avoidance_rate
        against = not math.isnan(rate) and known.estimate.velocity()[2] * np.sign(rate) < _SHARE_FLOWN * abs(rate)
        if not against:
            known.against_since = None
        elif known.against_since is None:
            known.against_since = now
        elif now - known.against_since > self._config.prediction.patience_s:
            self._count(sender, "doubted cooperation")
            return False
        return last.cooperates


def _finite_or_nan(value: object, shape: tuple[int, ...]) -> FloatArray | None:
    """Return numbers of a shape, NaN for None; None where they are something else or not finite."""
    if value is None:
        return np.full(shape, math.nan)
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        return None
    return array if array.shape == shape and np.isfinite(array).all() else None


def _waypoints(value: ArrayLike | None) -> FloatArray | None:
    """Return waypoints (n, 4); None where they are something else or their times do not increase."""
    if value is None:
        return np.zeros((0, 4))
    try:
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        return None
    if array.size == 0:
        return np.zeros((0, 4))
    good = array.ndim == 2 and array.shape[1] == 4 and np.isfinite(array).all() and (np.diff(array[:, 0]) > 0.0).all()
    return array if good else None
