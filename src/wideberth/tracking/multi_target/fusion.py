"""The side of the multi-target tracker's state that hears ADS-B: filters by address, and whose tracks they are."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wideberth.tracking.multi_target.bank_kernels import Bank, Motion, copied_bank, grown_bank, make_bank
from wideberth.tracking.multi_target.buffers_kernels import Scratch
from wideberth.tracking.multi_target.hand_over_kernels import drop_silent, hand_back, report_heard
from wideberth.tracking.multi_target.heard_kernels import Heard, ReportRules, make_heard
from wideberth.tracking.multi_target.heard_ownship_kernels import find_heard_ownship
from wideberth.tracking.multi_target.hearing_kernels import REPORT_COUNTS
from wideberth.tracking.multi_target.identity_kernels import find_identities, find_slots, take_reports
from wideberth.tracking.multi_target.report_kernels import make_report_scratch
from wideberth.tracking.multi_target.reports import ReadyReports
from wideberth.tracking.ownship_kernels import OwnshipTest

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_FIRST_PLACES = 32
_EVENTS = 4096
_NO_FILTERS, _NOBODY = make_bank(0), make_heard(0)


@dataclass(slots=True)
class FusionSnapshot:
    """A copy of the filters by address at one time."""

    filters: Bank
    heard: Heard
    counts: IntArray


class Fusion:
    """Filters by address, and what ties them to the tracks of radars.

    Parameters
    ----------
    rules : ReportRules
    motion : Motion

    Attributes
    ----------
    filters : Bank
    heard : Heard
    counts : ndarray of int64, shape (REPORT_COUNTS,)
    events : ndarray of int64, shape (n, 4)
        The first ``event_count[0]``: code, track, place of the address, other track.
    event_count : ndarray of int64, shape (1,)
    size : int
        Places in use.
    """

    def __init__(self, rules: ReportRules, motion: Motion) -> None:
        self._rules, self._motion = rules, motion
        self.filters, self.heard = make_bank(_FIRST_PLACES), make_heard(_FIRST_PLACES)
        self.counts = np.zeros(REPORT_COUNTS, np.int64)
        self.events, self.event_count = np.zeros((_EVENTS, 4), np.int64), np.zeros(1, np.int64)
        self._scratch, self._one = make_report_scratch(), make_bank(1)
        self._one.address[0] = -1
        self.size = 0

    def reserve(self, size: int) -> None:
        """Make room for so many users of addresses.

        Parameters
        ----------
        size : int
        """
        while size > len(self.heard.alive):
            self.filters, old = grown_bank(self.filters), self.heard
            self.heard = make_heard(2 * len(old.alive))
            for new, known in zip(self.heard, old, strict=True):
                new[: len(known)] = known
        self.size = max(self.size, size)

    def clear(self, place: int) -> None:
        """Forget all of one place."""
        for kept, blank in zip(self.heard, make_heard(1), strict=True):
            kept[place] = blank[0]

    def take_in(self, bank: Bank, reports: ReadyReports, scratch: Scratch) -> tuple[IntArray, IntArray]:
        """Take in reports; return the place of the aircraft each is of, and what became of it.

        Parameters
        ----------
        bank : Bank
            The radars' tracks.
        reports : ReadyReports
        scratch : Scratch
        """
        users, outcome = np.zeros(len(reports.rows), np.int64), np.zeros(len(reports.rows), np.int64)
        self.heard.mine[reports.rows] = reports.mine
        take_reports(
            bank,
            self.filters,
            self.heard,
            reports.rows,
            reports.times,
            reports.z,
            reports.variance,
            reports.time_sigma,
            reports.bias,
            reports.sensor,
            self._rules,
            self._motion,
            users,
            outcome,
            self.counts,
            self.events,
            self.event_count,
            scratch,
            self._scratch,
        )
        return users, outcome

    def after_scan(self, bank: Bank, confirmed: bool, scratch: Scratch) -> None:
        """Carry on tracks that the radars have lost, and name those that they have just confirmed.

        Parameters
        ----------
        bank : Bank
        confirmed : bool
            Whether a track has just been confirmed.
        scratch : Scratch
        """
        if not self.size:
            return
        parts = (bank, self.filters, self.heard, self._rules, self._motion, self.events, self.event_count, scratch)
        hand_back(*parts)
        if confirmed:
            find_identities(*parts)

    def drop_silent(self, bank: Bank, t: float) -> None:
        """End what has not been heard for too long before `t`.

        Parameters
        ----------
        bank : Bank
        t : float
        """
        if self.size:
            drop_silent(bank, self.heard, t, self._rules, self.events, self.event_count)

    def identify_ownship(
        self,
        bank: Bank,
        t: float,
        dt: float,
        telemetry: FloatArray,
        covariance: FloatArray,
        test: OwnshipTest,
        addressed: bool,
        scratch: Scratch,
    ) -> int:
        """Mark which of the aircraft that no radar's track is, is the ownship; return the place of it, -1: none.

        The place is also that of one that flies as the ownship does but may not be it (`Heard.mine`).

        Parameters
        ----------
        bank : Bank
        t, dt : float
            Time of the telemetry, and since the last look, s.
        telemetry : ndarray, shape (6,)
        covariance : ndarray, shape (6, 6)
        test : OwnshipTest
        addressed : bool
            Whether the ownship's address is known.
        scratch : Scratch
        """
        if not self.size:
            return -1
        parts = (self._motion, test, addressed, self.events, self.event_count, scratch)
        return int(find_heard_ownship(bank, self.filters, self.heard, t, dt, telemetry, covariance, *parts))

    def alone(self, bank: Bank) -> IntArray:
        """Return the places of the aircraft that no radar's track is.

        Parameters
        ----------
        bank : Bank
        """
        if not self.size:
            return np.zeros(0, np.int64)
        find_slots(bank, self.heard)
        return np.flatnonzero((self.heard.alive == 1) & (self.heard.slot < 0))

    def estimates(self, places: IntArray, t: float, scratch: Scratch) -> tuple[FloatArray, FloatArray]:
        """Return states (n, 9) and covariances (n, 9, 9) of the filters at `places`, predicted to `t`.

        Parameters
        ----------
        places : ndarray of int64, shape (n,)
        t : float
        scratch : Scratch
        """
        x, p = np.empty((len(places), 9)), np.empty((len(places), 9, 9))
        report_heard(self.filters, self.heard, places, t, self._motion, self._one, x, p, scratch)
        return x, p

    def snapshot(self) -> FusionSnapshot:
        """Return a copy."""
        if not self.size:
            return FusionSnapshot(_NO_FILTERS, _NOBODY, self.counts.copy())
        heard = Heard._make(a[: self.size].copy() for a in self.heard)
        return FusionSnapshot(copied_bank(self.filters, self.size), heard, self.counts.copy())

    def restore(self, snapshot: FusionSnapshot) -> None:
        """Go back to a copy; places that were given since are empty.

        Parameters
        ----------
        snapshot : FusionSnapshot
        """
        n = len(snapshot.heard.alive)
        for kept, known, blank in zip(self.heard, snapshot.heard, make_heard(1), strict=True):
            kept[:n] = known
            kept[n:] = blank[0]
        whole = {"habit", "size", "t"}
        for name, kept, known in zip(Bank._fields, self.filters, snapshot.filters, strict=True):
            if name not in whole:
                kept[:n] = known
        self.counts = snapshot.counts.copy()
