"""Naive twin of R-RANSAC with a linear model: full matrices, no buffers, one step after the other.

Only the random draws are the tracker's, as another generator would give other tracks.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from wideberth.sensors.noise_kernels import fill_uniforms


@dataclass
class Plot:
    polar: np.ndarray
    position: np.ndarray
    used: bool = False


@dataclass
class Look:
    t: float
    sensor: np.ndarray
    attitude: np.ndarray
    sigma: np.ndarray
    number: int
    plots: list[Plot] = field(default_factory=list)


@dataclass
class Stored:
    name: int
    x: np.ndarray
    P: np.ndarray
    hits: list[int]  # numbers of the scans with an inlier
    age: int = 0
    misses: int = 0
    good: bool = False


def wrapped(angle):
    return (angle + math.pi) % (2 * math.pi) - math.pi


def polar(sensor, attitude, position):
    n, e, d = attitude.T @ (position - sensor)
    return np.array([math.sqrt(n * n + e * e + d * d), math.atan2(e, n), math.atan2(-d, math.hypot(n, e))])


def difference(a, b):
    d = a - b
    d[1] = wrapped(d[1])
    return d


def along_and_across(attitude, z):
    """Unit vectors as rows: out, across clockwise, across up."""
    ca, sa, ce, se = math.cos(z[1]), math.sin(z[1]), math.cos(z[2]), math.sin(z[2])
    return np.array([[ce * ca, ce * sa, -se], [-sa, ca, 0.0], [-se * ca, -se * sa, -ce]]) @ attitude.T


class NaiveRransac:
    """R-RANSAC of `config`, a `RransacConfig` in three dimensions; fewer plots a scan than the cap."""

    def __init__(self, config):
        self.c = config
        self.n = 6 if config.model == "constant_velocity" else 9
        self.tracks: list[Stored] = []
        self.looks: list[Look] = []
        self.born = 0
        self.scans = 0

    def needed(self, ratio):
        return math.ceil(ratio * self.c.window_scans - 1e-9)

    def transition(self, dt):
        f = np.eye(self.n)
        for i in range(3):
            f[i, 3 + i] = dt
            if self.n == 9:
                f[i, 6 + i], f[3 + i, 6 + i] = dt * dt / 2, dt
        return f

    def noise(self, dt):
        q = np.diag(np.array(self.c.process_noise_per_s)[: self.n] * dt)
        order = self.n // 3
        powers = {
            2: [[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]],
            3: [
                [dt**5 / 20, dt**4 / 8, dt**3 / 6],
                [dt**4 / 8, dt**3 / 3, dt**2 / 2],
                [dt**3 / 6, dt**2 / 2, dt],
            ],
        }[order]
        return q + np.kron(np.array(powers), np.diag(self.c.noise_density))

    def predict(self, x, P, dt):
        f = self.transition(dt)
        return f @ x, f @ P @ f.T + self.noise(dt)

    def measurement(self, x, plot, look):
        """Rows H (3, n), innovation and variances of an update."""
        h = np.zeros((3, self.n))
        if self.c.update == "pseudo_measurement":
            h[:, :3] = np.eye(3)
            return h, plot.position - x[:3], np.array(self.c.pseudo_variance_m2)
        expected = polar(look.sensor, look.attitude, x[:3])
        if self.c.update == "polar":
            for j in range(3):
                step = np.zeros(3)
                step[j] = 1e-4
                up = polar(look.sensor, look.attitude, x[:3] + step)
                h[:, j] = difference(up, polar(look.sensor, look.attitude, x[:3] - step)) / 2e-4
            return h, difference(plot.polar, expected), look.sigma**2
        h[:, :3] = along_and_across(look.attitude, expected)
        return h, h[:, :3] @ (plot.position - x[:3]), self.variances(expected, look)

    def variances(self, z, look):
        ground = max(abs(math.cos(z[2])), math.sin(look.sigma[2]))
        return np.array([look.sigma[0], z[0] * ground * look.sigma[1], z[0] * look.sigma[2]]) ** 2

    def update(self, x, P, plot, look):
        h, innovation, variance = self.measurement(x, plot, look)
        s = h @ P @ h.T + np.diag(variance)
        k = np.linalg.solve(s, h @ P).T
        P = P - k @ s @ k.T
        return x + k @ innovation, (P + P.T) / 2

    def distance(self, track, plot, look):
        """Squared distance, None outside the gate; and what is added to it to compare tracks."""
        expected = polar(look.sensor, look.attitude, track.x[:3])
        if self.c.gate == "thresholds":
            d = difference(plot.polar, expected) / look.sigma
            return float(d @ d) if np.all(np.abs(d) < self.c.gate_sigmas) else None, 0.0
        u = along_and_across(look.attitude, expected)
        s = u @ track.P[:3, :3] @ u.T + np.diag(self.variances(expected, look))
        d = u @ (plot.position - track.x[:3])
        square = float(d @ np.linalg.solve(s, d))
        return (square if square <= self.c.gate_mahalanobis**2 else None), float(np.linalg.slogdet(s)[1])

    def scan(self, t, z, sensor, attitude, sigma):
        look = Look(t, sensor, attitude, sigma, self.scans + 1)
        self.scans += 1
        for row in z:
            u = along_and_across(attitude, row)[0]
            look.plots.append(Plot(row[:3].copy(), sensor + row[0] * u))
        dt = t - self.looks[-1].t if self.looks else 0.0
        self.looks = [*self.looks, look][-self.c.window_scans :]
        for track in self.tracks:
            track.hits = [k for k in track.hits if k > look.number - self.c.window_scans]
            track.x, track.P = self.predict(track.x, track.P, dt)
        self.associate(look)
        for i, plot in enumerate(look.plots):
            if not plot.used:
                self.give_birth(look, i)
        self.cull()

    def associate(self, look):
        pairs = []
        for track in self.tracks:
            inliers = []
            for i, plot in enumerate(look.plots):
                square, offset = self.distance(track, plot, look)
                if square is not None:
                    inliers.append(i)
                    pairs.append((square + offset, track.name, i))
            track.age += 1
            if self.c.weighting == "mean" and inliers:
                expected = polar(look.sensor, look.attitude, track.x[:3])
                mean = Plot(
                    expected + np.mean([difference(look.plots[i].polar, expected) for i in inliers], axis=0),
                    np.mean([look.plots[i].position for i in inliers], axis=0),
                )
                track.x, track.P = self.update(track.x, track.P, mean, look)
            if self.c.weighting == "mean":
                self.record(track, look, bool(inliers))
        inside = {i for _, _, i in pairs}
        if self.c.weighting == "nearest":
            chosen = {}
            for _, name, i in sorted(pairs):
                if name not in chosen and i not in chosen.values():
                    chosen[name] = i
            for track in self.tracks:
                hit = track.name in chosen
                if hit:
                    track.x, track.P = self.update(track.x, track.P, look.plots[chosen[track.name]], look)
                self.record(track, look, hit)
        for i in inside:
            look.plots[i].used = True

    def record(self, track, look, hit):
        track.misses = 0 if hit else track.misses + 1
        if hit:
            track.hits.append(look.number)

    def candidates(self, look, plot):
        found = []
        for other in reversed(self.looks[:-1]):
            for i, there in enumerate(other.plots):
                if self.c.births_from == "unassociated" and there.used:
                    continue
                if self.c.speed_max_mps and not self.reachable(look, plot, other, there):
                    continue
                found.append((other, i))
        return found

    def reachable(self, look, plot, other, there, far=None):
        far = plot.polar[0] if far is None else far
        noise = 3 * (look.sigma[0] + math.sqrt(2) * far * max(look.sigma[1:]))
        reach = noise + self.c.speed_max_mps * abs(look.t - other.t)
        return np.linalg.norm(plot.position - there.position) <= reach

    def draw(self, number, i, trial, candidates):
        size = self.n // 3
        uniform = np.empty(4)
        fill_uniforms(self.c.seed, 1, number, i, trial, uniform)
        picks = np.minimum((uniform * len(candidates)).astype(int), len(candidates) - 1)
        if size == 2:
            return [candidates[trial if len(candidates) <= self.c.ransac_iterations else picks[0]]]
        a, k = candidates[picks[0]]
        for pick in picks[1:]:
            b, m = candidates[pick]
            one, other = a.plots[k], b.plots[m]
            if a.t == b.t:
                continue
            far = max(one.polar[0], other.polar[0])
            if not self.c.speed_max_mps or self.reachable(a, one, b, other, far):
                return [(a, k), (b, m)]
        return None

    def give_birth(self, look, i):
        plot, size = look.plots[i], self.n // 3
        candidates = self.candidates(look, plot)
        if len(candidates) + 1 < max(size, self.needed(self.c.consensus_ratio)):
            return
        best = None
        trials = min(self.c.ransac_iterations, len(candidates)) if size == 2 else self.c.ransac_iterations
        for trial in range(trials):
            others = self.draw(look.number, i, trial, candidates)
            if others is None:
                continue
            subset = [(look, i), *others]
            # Positions at several times from the ending state: one dense linear system.
            a = np.concatenate([self.transition(m.t - look.t)[:3] for m, _ in subset])
            x = np.linalg.solve(a, np.concatenate([m.plots[k].position for m, k in subset]))
            if self.c.speed_max_mps and np.linalg.norm(x[3:6]) > 2 * self.c.speed_max_mps:
                continue
            hits = self.consensus(x, look, i, candidates)
            if best is None or len(hits) > len(best[1]):
                best = (x, hits, subset)
            if len(hits) >= self.needed(self.c.stop_ratio):
                break
        if best is None or len(best[1]) < max(size, self.needed(self.c.consensus_ratio)):
            return
        x, P = self.smooth(*best, look)
        for m, k in best[1]:
            m.plots[k].used = True
        self.tracks.append(Stored(self.born, x, P, [m.number for m, _ in best[1]]))
        self.born += 1

    def consensus(self, x, look, i, candidates):
        nearest = {}
        for m, k in candidates:
            position = (self.transition(m.t - look.t) @ x)[:3]
            d = difference(m.plots[k].polar, polar(m.sensor, m.attitude, position)) / m.sigma
            if np.all(np.abs(d) < self.c.hypothesis_sigmas):
                square = float(d @ d)
                if m.number not in nearest or square < nearest[m.number][0]:
                    nearest[m.number] = (square, m, k)
        return [(look, i)] + [(m, k) for _, m, k in nearest.values()]

    def smooth(self, x, hits, subset, look):
        information = np.zeros((self.n, self.n))
        for m, k in subset:
            h = self.transition(m.t - look.t)[:3]
            if self.c.update == "pseudo_measurement":
                r = np.diag(self.c.pseudo_variance_m2)
            else:
                z = m.plots[k].polar
                u = along_and_across(m.attitude, z)
                r = u.T @ np.diag(self.variances(z, m)) @ u
            information += h.T @ np.linalg.inv(r) @ h
        P = np.linalg.inv(information)
        hits = sorted(hits, key=lambda hit: hit[0].t)
        t = hits[0][0].t
        f = self.transition(t - look.t)
        x, P = f @ x, f @ P @ f.T * self.c.covariance_inflation
        for m, k in hits:
            # Step by step, as the process noise of the tables is not that of one long step.
            for other in self.looks:
                if t < other.t <= m.t:
                    x, P = self.predict(x, P, other.t - t)
                    t = other.t
            x, P = self.update(x, P, m.plots[k], m)
        return x, P

    def better(self, a, b):
        return (a.good, len(a.hits), -a.name) > (b.good, len(b.hits), -b.name)

    def cull(self):
        self.tracks = [track for track in self.tracks if track.misses < self.c.misses_max]
        merge = np.array(self.c.merge_thresholds)[: self.n]
        for a in list(self.tracks):
            for b in list(self.tracks):
                if a is not b and a in self.tracks and b in self.tracks and np.all(np.abs(a.x - b.x) < merge):
                    self.tracks.remove(b if self.better(a, b) else a)
        while len(self.tracks) > self.c.stored_tracks:
            worst = self.tracks[0]
            for track in self.tracks:
                worst = track if self.better(worst, track) else worst
            self.tracks.remove(worst)
        for track in self.tracks:
            if track.good:
                track.good = len(track.hits) >= self.needed(self.c.end_ratio)
            else:
                long_enough = self.c.lifetime_scans is None or track.age > self.c.lifetime_scans
                track.good = len(track.hits) >= self.needed(self.c.begin_ratio) and long_enough
