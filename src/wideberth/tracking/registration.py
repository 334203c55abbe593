"""Registration of a network of radars: the biases of all of them, from the aircraft that they see together.

One Kalman filter holds the biases of all radars (`registration_kernels`), which wander slowly within what they were
expected to be. It is fed by

- pairs: plots of one aircraft by two or more radars within a second. Tracks only say which plots belong to an aircraft
  at all, and its velocity, by which the plots are brought to one time: their positions, which have the biases in them,
  are not used. One of the plots must have an elevation: two slant ranges without a height are off by more than a bias.
- references: plots of an aircraft that says where it is.

Each plot is used once. A plot whose partner is not certain (another one is within the gate too) is not used at all, and
the first two comparisons of a radar only if they agree.

What is left of the biases is no white noise and does not average out. `Registration.correct` inflates the noise of the
plots by it, so that gates hold and a radar that is not known well weighs less; and whoever reports tracks adds
`Registration.position_covariance`, as a tracker that takes the noise as white makes too little of it. This is
conservative; a Schmidt filter, which carries the cross-covariance of each track with the biases, would be exact, but
would have to be inside the tracker.
"""

import math
from collections import Counter
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from wideberth.tracking import registration_kernels as kernels
from wideberth.tracking.bias_correction import BiasEstimate, corrected, position_covariance, prior_sigma
from wideberth.tracking.bias_filter import REFERENCE, BiasFilter, Comparison
from wideberth.tracking.config import RegistrationConfig
from wideberth.tracking.radar_looks import Aircraft, Look, Match, aircraft_of, look_of, match
from wideberth.tracking.registration_kernels import BIASES
from wideberth.types import FloatArray, Scan, Track

_DIFFUSE = 1e8
"""Variance of the place of an aircraft before its first plot, m2: nothing is known."""

_REFERENCE_PAUSE = 0.1
"""Of the time constant of a reference's errors: it is not asked again sooner."""


class Registration:
    """Estimates the biases of radars and takes them off.

    Parameters
    ----------
    config : RegistrationConfig

    Attributes
    ----------
    counters : Counter of str
        Plots and comparisons by what became of them, in words.
    """

    Config = RegistrationConfig

    def __init__(self, config: RegistrationConfig) -> None:
        self._config = config
        self.counters: Counter[str] = Counter()
        self._filter = BiasFilter(config, self.counters)
        self._numbers: dict[str, int] = {}
        self._poses: list[tuple[FloatArray, FloatArray]] = []
        self._known_axes: list[bool] = []
        self._t = -math.inf
        self._looks: list[Look] = []
        self._reference_used: dict[str, float] = {}

    @property
    def sensors(self) -> tuple[str, ...]:
        """Names of the radars, in the order in which they came."""
        return tuple(self._numbers)

    @property
    def covariance(self) -> FloatArray:
        """Covariance (10 n, 10 n) of the biases of all n radars, in the order of `sensors`."""
        return self._filter.p.copy()

    def estimate(self, sensor: str) -> BiasEstimate:
        """Return what is known of a radar.

        Parameters
        ----------
        sensor : str

        Returns
        -------
        BiasEstimate

        Raises
        ------
        ValueError
            If no scan of such a radar has come yet.
        """
        if sensor not in self._numbers:
            known = ", ".join(self._numbers) or "none yet"
            raise ValueError(f"no scan of a radar '{sensor}' has come; known radars: {known}")
        r, f = self._numbers[sensor], self._filter
        b, p = f.of(r)
        return BiasEstimate(sensor, b, np.sqrt(np.maximum(p.diagonal(), 0.0)), f.prior[r].copy(), f.comparisons[r])

    def unobserved(self) -> list[FloatArray]:
        """Return the combinations of biases of which the plots have said little so far.

        Returns
        -------
        list of ndarray, shape (10 n,)
            In standard deviations of the prior, the least observed first: the variance along each is still more than
            half of what it was before.
        """
        return self._filter.unobserved()

    def step(
        self, t: float, scans: Sequence[Scan], tracks: Sequence[Track], references: Sequence[Track] = ()
    ) -> tuple[str, ...]:
        """Take in the scans of a step.

        Parameters
        ----------
        t : float
            Time, s.
        scans : sequence of Scan
            As the radars give them, not corrected; those of kind ``"radar"`` are used.
        tracks : sequence of Track
            Of the last step; tentative ones are not used.
        references : sequence of Track
            Aircraft that say where they are (ADS-B, telemetry of the ownship), with the covariance of that.

        Returns
        -------
        tuple of str
            What happened, in words.

        Raises
        ------
        ValueError
            If the time is not finite.
        """
        if not math.isfinite(t):
            raise ValueError(f"time {t} is not finite")
        events: list[str] = []
        if t < self._t - self._config.pair_age_s:
            events.append(f"registration: time went back by {self._t - t:.0f} s, plots forgotten, biases kept")
            self._looks.clear()
            self._reference_used.clear()
            self._t = t
        if math.isfinite(self._t):
            self._filter.drift(max(t - self._t, 0.0))
        self._t = max(self._t, t)
        fresh = self._take(scans, events)
        if fresh:
            oldest = max(float(look.t.max()) for look in fresh) - self._config.pair_age_s
            self._looks = [look for look in self._looks if look.free.any() and look.t.max() >= oldest]
            self._use_references(fresh, aircraft_of(references, self.counters, tentative=True))
            self._looks += fresh
            self._use_pairs(fresh, aircraft_of(tracks, self.counters))
            self._find_moved(events)
        return tuple(events)

    def correct(self, scan: Scan, *, inflate: bool = True) -> Scan:
        """Return a scan with the biases taken off.

        Parameters
        ----------
        scan : Scan
            Of a radar; one that is not known yet has no biases, but the uncertainty of the prior.
        inflate : bool
            Whether the uncertainty of the biases is added to `R`, which stays diagonal: what the elements have in
            common is left out.

        Returns
        -------
        Scan
            Offsets are taken off the measurements, the rest off the pose and the times. Scans of other kinds are
            returned as they are.
        """
        if scan.kind != "radar":
            return scan
        r = self._numbers.get(scan.sensor)
        b, p = (np.zeros(BIASES), np.diag(prior_sigma(self._config) ** 2)) if r is None else self._filter.of(r)
        return corrected(scan, b, p, inflate=inflate)

    def position_covariance(self, sensor: str, position: FloatArray, velocity: FloatArray) -> FloatArray:
        """Return the covariance (3, 3) that the biases of a radar leave in the position of an aircraft, m2.

        Parameters
        ----------
        sensor : str
        position, velocity : ndarray, shape (3,)
            Of the aircraft, NED, m and m/s.

        Returns
        -------
        ndarray, shape (3, 3)

        Raises
        ------
        ValueError
            If no scan of such a radar has come yet.
        """
        self.estimate(sensor)
        r = self._numbers[sensor]
        return position_covariance(*self._filter.of(r), *self._poses[r], position, velocity)

    def restart(self, sensor: str) -> None:
        """Forget the biases of a radar.

        Parameters
        ----------
        sensor : str

        Raises
        ------
        ValueError
            If no scan of such a radar has come yet.
        """
        self.estimate(sensor)
        r = self._numbers[sensor]
        self._filter.restart(r)
        self._looks = [look for look in self._looks if look.radar != r]

    def _take(self, scans: Sequence[Scan], events: list[str]) -> list[Look]:
        fresh: list[Look] = []
        for scan in scans:
            if scan.kind != "radar":
                continue
            if not (np.isfinite(scan.sensor_position).all() and np.isfinite(scan.sensor_attitude).all()):
                self.counters["scan: pose not finite"] += 1
                continue
            r = self._radar(scan, events)
            look = look_of(r, scan, self.counters)
            if not len(look.z):
                continue
            if not self._known_axes[r]:
                self._known_axes[r] = True
                if np.isnan(look.z[:, 2]).all():
                    self._filter.without_elevation(r)
            future = look.t > self._t + self._config.pair_age_s
            if future.any():
                self.counters["plot: time in the future"] += int(future.sum())
                look.free[future] = False
            if look.free.any():
                fresh.append(look)
        return fresh

    def _radar(self, scan: Scan, events: list[str]) -> int:
        """Return the number of a scan's radar; a new one, or one at a new place, starts."""
        r = self._numbers.get(scan.sensor)
        pose = (np.array(scan.sensor_position, float), np.array(scan.sensor_attitude, float))
        if r is None:
            r = self._numbers[scan.sensor] = self._filter.add()
            self._poses.append(pose)
            self._known_axes.append(False)
            return r
        moved = float(np.linalg.norm(pose[0] - self._poses[r][0]))
        cosine = 0.5 * (float(np.trace(pose[1].T @ self._poses[r][1])) - 1.0)
        turned = math.degrees(math.acos(min(max(cosine, -1.0), 1.0)))
        c = self._config
        if scan.sensor in c.moving_radars:
            self._poses[r] = pose
        elif moved > c.pose_jump_m or turned > c.pose_jump_deg:
            self._poses[r] = pose
            self.restart(scan.sensor)
            self.counters["pose jumped"] += 1
            events.append(
                f"radar {scan.sensor}: its pose has changed by {moved:.1f} m and {turned:.1f} deg,"
                " its biases start again"
            )
        return r

    def _match(self, look: Look, p: FloatArray, aircraft: Aircraft, *, reference: bool = False) -> Match:
        c = self._config
        speed, height = (0.0, 0.0) if reference else (c.velocity_sigma_mps**2, c.track_height_sigma_m**2)
        return match(look, self._filter.b, p, aircraft, speed, height, self._filter.gate)

    def _use_references(self, fresh: list[Look], references: Aircraft) -> None:
        if not len(references.t):
            return
        wide = self._filter.wide()
        chosen: dict[int, list[tuple[Look, int, Match]]] = {}
        for look in fresh:
            tight_match, wide_match = (self._match(look, p, references, reference=True) for p in (self._filter.p, wide))
            for m in range(len(references.t)):
                inside = np.flatnonzero(tight_match.track == m)
                around = np.flatnonzero(wide_match.track == m)
                if len(inside) == 1:
                    chosen.setdefault(m, []).append((look, int(inside[0]), tight_match))
                elif len(inside) > 1:
                    self.counters["reference: ambiguous"] += 1
                elif len(around) == 1:
                    self._filter.judge(look.radar, REFERENCE, False)
        for m, plots in chosen.items():
            look, i, matched = max(plots, key=lambda plot: plot[0].t[plot[1]])
            now, name, slow = float(look.t[i]), references.ids[m], self._config.reference_correlation_s
            since = now - self._reference_used.get(name, -math.inf)
            if since < _REFERENCE_PAUSE * slow:
                continue  # it would say the same again; the plots are of more use in pairs
            # Errors with a time constant: so much information in a time, however many plots there are.
            factor = max(1.0, 2.0 * slow / since) if slow > 0.0 else 1.0
            self._reference_used[name] = max(now, self._reference_used.get(name, now))
            self._compare([(a, k) for a, k, _ in plots], matched.state[i], matched.covariance[i] * factor, now, False)

    def _use_pairs(self, fresh: list[Look], aircraft: Aircraft) -> None:
        if not len(aircraft.t) or len(self._numbers) < 2:
            return
        matches = {id(look): self._match(look, self._filter.p, aircraft) for look in self._looks}
        p, wide = self._filter.p.copy(), self._filter.wide()
        for look in fresh:
            for i in np.flatnonzero(look.free & (matches[id(look)].track >= 0)):
                if look.free[i]:
                    self._use_pair(look, int(i), matches, p, wide)

    def _use_pair(self, look: Look, i: int, matches: dict[int, Match], p: FloatArray, wide: FloatArray) -> None:
        partners: list[tuple[Look, int]] = []
        for radar in range(len(self._numbers)):
            if radar == look.radar:
                continue
            others = [other for other in self._looks if other.radar == radar and other.free.any()]
            if np.isnan(look.z[i, 2]):
                high = [other for other in others if np.isfinite(other.z[:, 2]).all()]
                self.counters["pair: no height"] += len(high) < len(others)
                others = high
            for other in sorted(others, key=lambda o: abs(float(o.t.mean()) - look.t[i])):
                inside, around = (self._near(look, i, other, matches, q) for q in (p, wide))
                if len(inside) == 1 and len(self._near(other, int(inside[0]), look, matches, p)) == 1:
                    partners.append((other, int(inside[0])))
                elif len(inside) > 0:
                    self.counters["pair: ambiguous"] += 1
                elif len(around) == 1:
                    self._filter.judge(look.radar, radar, False)
                    other.free[around[0]] = False  # it is judged once
                if len(around):
                    break
        if partners:
            plots = [(look, i), *partners]
            # The first plot says where the aircraft is: it should be one with a height of its own.
            plots.sort(key=lambda plot: bool(np.isnan(plot[0].z[plot[1], 2])))
            look, i = plots[0]
            x, px = np.zeros(6), np.zeros((6, 6))
            found = matches[id(look)]
            x[:3], x[3:] = found.position[i], found.state[i, 3:]
            px[[0, 1, 2], [0, 1, 2]] = _DIFFUSE
            px[3:, 3:] = found.covariance[i, 3:, 3:]
            self._compare(plots, x, px, float(look.t[i]), True)

    def _near(self, look: Look, i: int, other: Look, matches: dict[int, Match], p: FloatArray) -> NDArray[np.intp]:
        """Return the plots of another look that may be of the same aircraft as plot `i`."""
        mine, theirs = matches[id(look)], matches[id(other)]
        usable = np.flatnonzero(other.free & (theirs.track >= 0))
        dt = look.t[i] - other.t[usable]
        usable, dt = usable[np.abs(dt) <= self._config.pair_age_s], dt[np.abs(dt) <= self._config.pair_age_s]
        moved = theirs.position[usable] + dt[:, None] * theirs.state[usable, 3:]
        spread = theirs.noise[usable] + (dt**2)[:, None, None] * theirs.covariance[usable, 3:, 3:]
        distances = np.full(len(usable), math.inf)
        kernels.pair_distances(
            p, look.radar, mine.position[i], mine.to_bias[i], mine.noise[i],
            other.radar, moved, theirs.to_bias[usable], spread, distances,
        )  # fmt: skip
        near: NDArray[np.intp] = usable[distances <= self._filter.gate]
        return near

    def _compare(self, plots: list[tuple[Look, int]], x: FloatArray, px: FloatArray, t: float, seeded: bool) -> None:
        for look, i in plots:
            look.free[i] = False
        self._filter.compare(
            Comparison(
                x,
                px,
                seeded,
                np.array([look.radar for look, _ in plots], np.int64),
                np.array([look.sensor for look, _ in plots]),
                np.array([look.attitude for look, _ in plots]),
                np.array([look.z[i] for look, i in plots]),
                np.array([look.variance[i] for look, i in plots]),
                np.array([look.t[i] - t for look, i in plots]),
            )
        )

    def _find_moved(self, events: list[str]) -> None:
        """Start radars again that no longer agree with any other."""
        names = [self.sensors[r] for r in self._filter.disagreeing()]
        if names:
            who = " or ".join(f"radar {name}" for name in names)
            events.append(f"{who} no longer fits: moved or turned? biases start again")
        for name in names:
            self.counters["radar no longer fits"] += 1
            self.restart(name)
