"""The controller flown ahead, and the sides on which intruders are passed."""

import dataclasses
import itertools
import math

import numpy as np
from numpy.typing import NDArray

from wideberth.avoidance.cas import multi_kernels as multi
from wideberth.avoidance.cas import pair_kernels as pair
from wideberth.avoidance.cas.settings import settings
from wideberth.avoidance.keep_out.kernels import path_enters
from wideberth.avoidance.keep_out.volumes import keep_out_arrays
from wideberth.avoidance.vertical import vertical_kernels as vk
from wideberth.avoidance.vertical.config import VerticalConfig
from wideberth.avoidance.vertical.intruders import Intruders
from wideberth.avoidance.vertical.way_ahead import way_ahead
from wideberth.types import FloatArray, Mission
from wideberth.vehicles import kernels as vehicle_kernels

STEP = 0.25  # s, of the flight ahead
_ABOVE, _BELOW = -1.0, 1.0  # the signs of positions down
_SIDES = {"climb": _ABOVE, "descend": _BELOW}
_BACK = 0.5  # m from the mission's altitude: the flight is back
_BACK_STEPS = 12  # for so long
_OVERSHOOT = 0.25  # of lag times rate


@dataclasses.dataclass(slots=True)
class Held:
    """What was decided before.

    Attributes
    ----------
    avoiding, command : bool, float
        Of the controller.
    target : str or None
        The track that is avoided.
    sides : dict of str to float
        On which intruders are passed (positions down: -1 above, 1 below), by track.
    """

    avoiding: bool = False
    command: float = 0.0
    target: str | None = None
    sides: dict[str, float] = dataclasses.field(default_factory=dict)


@dataclasses.dataclass(frozen=True, slots=True)
class Flight:
    """A flight ahead along the mission.

    Attributes
    ----------
    ahead : ndarray, shape (n, N_AHEAD)
        Every `STEP`.
    sides : ndarray, shape (m,)
        On which the intruders are passed; 0 where it does not matter.
    met : ndarray of bool, shape (m,)
        Which of them some vertical velocity would meet soon.
    inside, entry : float
        For how long it is in a protected zone, and from when on, s.
    least : ndarray, shape (m,)
        The smallest miss of each intruder in times of the zone's size.
    blocked : bool
        Whether it enters a keep-out volume.
    end : int
        The place from which on it is back on the mission; the last one where it is not.
    """

    ahead: FloatArray
    sides: FloatArray
    met: NDArray[np.bool_]
    inside: float
    entry: float
    least: FloatArray
    blocked: bool
    end: int

    @property
    def free(self) -> bool:
        """Whether it keeps everything clear."""
        return self.inside == 0.0 and not self.blocked

    @property
    def avoids_now(self) -> bool:
        """Whether the controller avoids now."""
        return bool(self.ahead[0, vk.REASON] != pair.NO_REASON)

    @property
    def avoids(self) -> bool:
        """Whether the controller avoids before the flight is back on the mission."""
        return bool((self.ahead[: self.end, vk.REASON] != pair.NO_REASON).any())


class FlightAhead:
    """Flies the controller ahead against intruders that go straight on.

    Parameters
    ----------
    config : VerticalConfig
    vehicle : ndarray
        Parameters of the ownship's point mass (`vehicles.kernels`).
    """

    def __init__(self, config: VerticalConfig, vehicle: FloatArray) -> None:
        self._config, self._vehicle = config, vehicle
        climb = config.climb_share * vehicle[vehicle_kernels.P_CLIMB_MAX]
        sink = config.climb_share * vehicle[vehicle_kernels.P_SINK_MAX]
        limits = {
            "climb_rate_max_mps": climb,
            "sink_rate_max_mps": sink,
            "return_climb_rate_max_mps": climb,
            "return_sink_rate_max_mps": sink,
            "lag_s": vehicle[vehicle_kernels.P_TAU_CLIMB],
            "guidance_gain_per_s": vehicle[vehicle_kernels.P_ALTITUDE_GAIN],
        }
        cas = config.cas_config({name: float(value) for name, value in limits.items()})
        self._p = settings(cas)
        # The vehicle follows paths with its lag, a little beyond floor and ceiling.
        self._lowest = float(self._p[pair.P_LOWEST]) - _OVERSHOOT * cas.lag_s * cas.sink_rate_max_mps
        self._highest = float(self._p[pair.P_HIGHEST]) + _OVERSHOOT * cas.lag_s * cas.climb_rate_max_mps
        slower = min(cas.climb_rate_max_mps, cas.sink_rate_max_mps)
        self._lookahead = config.lookahead_s or 2 * (config.zone_height + config.margin_m) / slower + 4 * cas.lag_s
        self._half = config.half_height_m if config.zone == "cylinder" else 0.0
        self._acceleration = float(vehicle[vehicle_kernels.P_VERTICAL_ACCEL_MAX])
        self._keep_outs = keep_out_arrays(config.keep_out, config.keep_out_margin_m)
        self._count = math.ceil(config.horizon_s / STEP) + 1
        self._among_all = config.several == "all_at_once"
        self._one_side = config.kernel == "bang_bang"
        self._level_off = bool(getattr(config, "level_off", False))

    def way(self, own: FloatArray, mission: Mission) -> tuple[FloatArray, FloatArray]:
        """Return the mission's places ahead of the own state (6,) and the times of its corners: see `way_ahead`.

        Sets floor and ceiling for what follows.
        """
        wanted = float(mission.speeds[min(mission.index, len(mission.speeds) - 1)])
        slowest, fastest = self._vehicle[vehicle_kernels.P_SPEED_MIN], self._vehicle[vehicle_kernels.P_SPEED_MAX]
        speed = float(min(max(wanted, slowest, 0.1), fastest))
        places, corners = way_ahead(own[:3], mission, speed, STEP, self._count)
        # Who is below the floor already, or above the ceiling, goes no farther.
        low, high = max(self._lowest, own[2]), min(self._highest, own[2])
        self._p[pair.P_LOWEST], self._p[pair.P_HIGHEST] = low, high
        outside = (places[:, vk.WANTED] > low) | (places[:, vk.WANTED] < high)
        places[outside, vk.SLOPE] = 0.0
        places[:, vk.WANTED] = np.clip(places[:, vk.WANTED], high, low)
        return places, corners

    def sides(self, own: FloatArray, intruders: Intruders, held: Held) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Return on which side each intruder is passed (0: it does not matter), and who is met soon.

        As held; else above whom it will be above; in a tie the ownship climbs (errata, "CAS thesis"). The bang-bang
        controller has one command: it passes all on the side of the first held, else of the first met.
        """
        sides, met = np.zeros(len(intruders.tracks)), np.zeros(len(intruders.tracks), bool)
        first, soonest = 0.0, (True, math.inf)
        for j, track in enumerate(intruders.tracks):
            met[j], miss = vk.vertical_miss(own, intruders.views[j], self._p, self._lookahead)
            natural = _SIDES.get(self._config.direction, _BELOW if miss > 0.0 else _ABOVE)
            sides[j] = held.sides.get(track.id, natural if met[j] else 0.0)
            rank = track.id not in held.sides, vk.time_to_entry(own, intruders.views[j], self._config.separation_m)
            if met[j] and rank < soonest:
                first, soonest = sides[j], rank
        if self._one_side:
            sides[sides != 0.0] = first
        return sides, met

    def best(self, own: FloatArray, intruders: Intruders, held: Held, places: FloatArray, *, reverse: bool) -> Flight:
        """Return the flight on the sides that are held or natural, or a better one where that is not free.

        Parameters
        ----------
        own : ndarray, shape (6,)
        intruders : Intruders
        held : Held
        places : ndarray, shape (n, N_PLACE)
        reverse : bool
            Whether sides that are held may be given up for a way that is free.
        """
        sides, met = self.sides(own, intruders, held)
        best = self._fly(own, intruders, held, (sides, met), places)
        if best.free or self._config.direction != "auto":
            return best
        fixed = np.array([track.id in held.sides for track in intruders.tracks], bool)
        tried = [sides]
        changed = (np.ones(len(fixed), bool),) if self._one_side else (~fixed, np.ones(len(fixed), bool))
        for side, of in itertools.product((_ABOVE, _BELOW), changed):
            other = np.where((sides != 0.0) & of, side, sides)
            keeps = np.array_equal(other[fixed], sides[fixed])
            if any(np.array_equal(other, one) for one in tried) or not (keeps or reverse):
                continue
            tried.append(other)
            flight = self._fly(own, intruders, held, (other, met), places)
            # A change of sense costs seconds: for a way that is no more than less bad it is not worth them.
            if flight.free or (keeps and not flight.blocked and (best.blocked or flight.inside < best.inside)):
                best = flight
            if best.free:
                break
        return best

    def _fly(
        self,
        own: FloatArray,
        intruders: Intruders,
        held: Held,
        choice: tuple[FloatArray, NDArray[np.bool_]],
        places: FloatArray,
    ) -> Flight:
        sides, _ = choice
        intruders.views[:, multi.V_SIDE] = sides
        ahead = np.empty((len(places), vk.N_AHEAD))
        names = [track.id for track in intruders.tracks]
        goes_on = all(held.sides.get(name, side) == side for name, side in zip(names, sides, strict=True))
        vk.fly_ahead(
            own,
            places,
            held.avoiding and goes_on,
            held.command,
            names.index(held.target) if held.target in names else -1,
            self._among_all,
            self._level_off,
            intruders.views,
            intruders.use,
            self._p,
            self._lookahead,
            STEP,
            self._acceleration,
            ahead,
        )
        return self.judged(ahead, choice, intruders, places)

    def judged(
        self,
        ahead: FloatArray,
        choice: tuple[FloatArray, NDArray[np.bool_]],
        intruders: Intruders,
        places: FloatArray,
    ) -> Flight:
        """Return a flight (n, N_AHEAD), with its sides and who is met, and with what it meets."""
        least = np.empty(len(intruders.tracks))
        down = ahead[:, vk.DOWN].copy()
        inside, entry = vk.pass_by(
            places, down, intruders.views, intruders.use, self._config.separation_m, self._half, STEP, least
        )
        blocked, end = False, _end_of(ahead, places)
        if len(self._keep_outs.volumes):
            # Where the mission itself leads through a volume a maneuver may.
            n = end + 1
            flown, straight = places[:n, :3].copy(), places[:n, :3].copy()
            flown[:, 2], straight[:, 2] = down[:n], places[:n, vk.WANTED]
            blocked = self._enters(flown) and not self._enters(straight)
        return Flight(ahead, *choice, inside, entry, least, blocked, end)

    def _enters(self, points: FloatArray) -> bool:
        return path_enters(points, len(points), self._keep_outs.volumes, self._keep_outs.vertices) >= 0


def _end_of(ahead: FloatArray, places: FloatArray) -> int:
    """Return the first place from which on a flight is back on the mission for a while; the last one where none is."""
    away = (ahead[:, vk.REASON] != pair.NO_REASON) | (np.abs(ahead[:, vk.DOWN] - places[:, vk.WANTED]) > _BACK)
    for k in (-1, *np.flatnonzero(away)):
        if not away[k + 1 : k + 1 + _BACK_STEPS].any():
            return int(min(k + 1, len(ahead) - 1))
    raise AssertionError  # the last one ends it
