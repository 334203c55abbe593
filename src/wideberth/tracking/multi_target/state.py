"""The multi-target tracker's whole state as arrays that grow, can be copied, and take in one scan."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wideberth.tracking.multi_target.bank_kernels import Bank, Motion, grown_bank, make_bank
from wideberth.tracking.multi_target.buffers_kernels import CONFIRMED_NOW, COUNTS, Rules, Scratch, make_scratch
from wideberth.tracking.multi_target.config import MultiTargetConfig
from wideberth.tracking.multi_target.fusion import Fusion, FusionSnapshot
from wideberth.tracking.multi_target.intake import ReadyScan
from wideberth.tracking.multi_target.reports import ReadyReports, report_rules
from wideberth.tracking.multi_target.scan_kernels import CLUTTER_WIDTH, find_ownship, process_scan
from wideberth.tracking.multi_target.window_kernels import Window, make_window
from wideberth.tracking.ownship import ownship_test

FloatArray = NDArray[np.float64]

_FIRST_TRACKS = 32
_FIRST_PLOTS = 64
_MOST_SENSORS = 8
"""The window grows with the number of sensors up to this many."""


_OF_PLOTS = {"z", "variance", "sight", "place", "used"}
"""What a window has of each plot of each scan."""


@dataclass(slots=True)
class Snapshot:
    """A copy of the state at one time."""

    t: float
    bank: Bank
    window: Window
    clutter: FloatArray
    counts: NDArray[np.int64]
    fusion: FusionSnapshot


class TrackerState:
    """Everything that a scan changes.

    Parameters
    ----------
    config : MultiTargetConfig
    """

    def __init__(self, config: MultiTargetConfig) -> None:
        self.config = config
        self.motion = motion_of(config)
        self.test = ownship_test(config.ownship)
        # Reports are too coarse to tell the ownship from traffic within the 50 m that are meant for radars.
        wide = {"traffic_radius_m": config.reports.ownship_radius_m}
        self.heard_test = ownship_test(config.ownship.model_copy(update=wide))
        self.addressed = config.reports.ownship_address is not None
        """Whether the ownship's address is known."""
        self.bank = make_bank(_FIRST_TRACKS)
        self.window = make_window(config.window_scans, config.window_plots)
        self.clutter = np.zeros((1, CLUTTER_WIDTH))
        self.counts = np.zeros(COUNTS, np.int64)
        self.rules = rules_of(config, 1)
        self.scratch = make_scratch(_FIRST_TRACKS, _FIRST_PLOTS, config.window_scans)
        self.fusion = Fusion(report_rules(config.reports, config.existence_max), self.motion)
        self.t = -math.inf
        """Time of the last scan or report, s."""

    def reserve(self, sensors: int, plots: int) -> None:
        """Make room for so many sensors, and a scan of so many plots with the tracks it may give birth to.

        Parameters
        ----------
        sensors, plots : int
        """
        known = len(self.clutter)
        if sensors > known:
            self.clutter = np.concatenate([self.clutter, np.zeros((sensors - known, CLUTTER_WIDTH))])
            factor = min(sensors, _MOST_SENSORS)
            if self.config.window_scans * factor > len(self.window.t):
                self.window = _larger_window(self.window, self.config.window_scans * factor)
                self.rules = rules_of(self.config, factor)
        births = min(self.config.window_plots, plots)
        while self.bank.size[0] + births > len(self.bank.mu):
            self.bank = grown_bank(self.bank)
        self._fit_scratch(plots)

    def _fit_scratch(self, plots: int) -> None:
        s: Scratch = self.scratch
        tracks, room, scans = len(self.bank.mu), len(s.z), len(self.window.t)
        if len(s.counts) < tracks or room < plots or len(s.birth.chosen) < scans:
            while room < plots:
                room *= 2
            self.scratch = make_scratch(tracks, room, scans)

    def take_in(self, scan: ReadyScan) -> None:
        """Process one scan, not before the last one's time; events are left in the scratch.

        Parameters
        ----------
        scan : ReadyScan
        """
        self.reserve(scan.sensor + 1, len(scan.z))
        self.t = scan.t
        process_scan(
            self.bank,
            self.window,
            self.motion,
            self.rules,
            self.clutter,
            scan.sensor,
            scan.t,
            scan.z,
            scan.variance,
            0,
            len(scan.z),
            scan.position,
            scan.velocity,
            scan.attitude,
            scan.field_of_view,
            scan.ranges,
            scan.probabilities,
            scan.cone,
            self.counts,
            self.scratch,
        )
        s = self.scratch
        self.fusion.after_scan(self.bank, CONFIRMED_NOW in s.events[: s.event_count[0], 0], s)

    def hear(self, reports: ReadyReports) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Take in ADS-B reports; return the places of their aircraft, and what became of them (`hearing_kernels`).

        Parameters
        ----------
        reports : ReadyReports
        """
        self.t = max(self.t, reports.t)
        return self.fusion.take_in(self.bank, reports, self.scratch)

    def identify_ownship(self, dt: float, telemetry: FloatArray, covariance: FloatArray) -> None:
        """Mark the track that is the ownship.

        Parameters
        ----------
        dt : float
            Time since the last look, s.
        telemetry : ndarray, shape (6,)
            Position and velocity at the time of the tracks, NED; NaN: none.
        covariance : ndarray, shape (6, 6)
        """
        find_ownship(self.bank, dt, telemetry, covariance, self.motion, self.test, self.scratch)

    def identify_heard_ownship(self, t: float, dt: float, telemetry: FloatArray, covariance: FloatArray) -> int:
        """Mark which of the aircraft that only reports tell of is the ownship; return its place, -1: none.

        Parameters
        ----------
        t, dt : float
            Time of the telemetry, and since the last look, s.
        telemetry : ndarray, shape (6,)
            Position and velocity at `t`, NED; NaN: none.
        covariance : ndarray, shape (6, 6)
        """
        parts = (self.heard_test, self.addressed, self.scratch)
        return self.fusion.identify_ownship(self.bank, t, dt, telemetry, covariance, *parts)

    def snapshot(self) -> Snapshot:
        """Return a copy."""
        return Snapshot(
            self.t,
            Bank._make(a.copy() for a in self.bank),
            _window_copy(self.window),
            self.clutter.copy(),
            self.counts.copy(),
            self.fusion.snapshot(),
        )

    def restore(self, snapshot: Snapshot) -> None:
        """Go back to a copy; numbers of tracks that have been given away since are not given again.

        Parameters
        ----------
        snapshot : Snapshot
        """
        given = int(self.bank.size[1])
        self.bank = Bank._make(a.copy() for a in snapshot.bank)
        self.window = make_window(len(snapshot.window.t), self.window.z.shape[1])
        for new, known in zip(self.window, snapshot.window, strict=True):
            new[tuple(map(slice, known.shape))] = known
        self.clutter, self.counts = snapshot.clutter.copy(), snapshot.counts.copy()
        self.fusion.restore(snapshot.fusion)
        self.t = snapshot.t
        self.bank.size[1] = max(given, int(self.bank.size[1]))
        self._fit_scratch(1)


def motion_of(c: MultiTargetConfig) -> Motion:
    """Return the numbers of the motion for the kernels.

    Parameters
    ----------
    c : MultiTargetConfig
    """
    densities = [c.straight_noise_m2_per_s3, c.gentle_jerk_m2_per_s5, c.hard_jerk_m2_per_s5]
    return Motion(
        noise=np.repeat(np.array(densities)[:, None], 3, axis=1),
        acceleration_variance=np.array([0.0, c.gentle_acceleration_mps2, c.hard_acceleration_mps2]) ** 2,
        duration=np.array([c.straight_s, c.gentle_s, c.hard_s]),
        share=np.array([1.0 - 2.0 * c.maneuver_share, c.maneuver_share, c.maneuver_share]),
        survival_s=c.survival_s,
        least_mix=c.least_mix,
        least_report=c.least_report,
    )


def rules_of(c: MultiTargetConfig, sensors: int) -> Rules:
    """Return the rules for the kernels.

    Parameters
    ----------
    c : MultiTargetConfig
    sensors : int
        How many there are: the scans back in which a pair may lie are of all of them together.
    """
    return Rules(
        gate=c.gate,
        event_limit=c.event_limit,
        birth_per_scan=c.birth_per_scan,
        pair_scans=c.pair_scans * sensors,
        speed_max=c.speed_max_mps,
        speed_sigma=c.speed_sigma_mps,
        least_hits=c.least_hits,
        confirm_hits=c.confirm_hits,
        tentative_odds=c.tentative_odds,
        confirm_odds=c.confirm_odds,
        drop_tentative=c.drop_tentative_odds,
        drop_confirmed=c.drop_confirmed_odds,
        existence_max=c.existence_max,
        outside_s=c.outside_s,
        silent_s=c.silent_s,
        spread_max=c.spread_max_m,
        merge_gate=c.merge_gate,
        clutter_scans=c.clutter_scans,
        consensus_budget=c.consensus_budget,
        known_down=math.nan if c.known_altitude_m is None else -c.known_altitude_m,
        known_sigma=c.known_altitude_sigma_m,
    )


def _window_copy(window: Window) -> Window:
    """Return a copy that holds as many plots of each scan as the scan with the most of them has."""
    most = int(window.filled.max())
    return Window._make(
        (a[:, :most] if name in _OF_PLOTS else a).copy() for name, a in zip(Window._fields, window, strict=True)
    )


def _larger_window(window: Window, scans: int) -> Window:
    """Return a window of more scans with the same content, oldest first."""
    larger = make_window(scans, window.z.shape[1])
    newest, filled = int(window.cursor[0]), int(window.cursor[1])
    size = len(window.t)
    old = [(newest - filled + 1 + i) % size for i in range(filled)]
    for name, new, known in zip(Window._fields, larger, window, strict=True):
        if name != "cursor":
            new[:filled] = known[old]
    larger.cursor[:] = filled - 1, filled
    return larger
