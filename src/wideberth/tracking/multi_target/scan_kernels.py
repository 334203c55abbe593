"""The multi-target tracker's work on one scan, on a whole file of scans, and what it reports."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted
from wideberth.tracking.multi_target.absorb_kernels import (
    absorb,
    absorb_cross,
    allow_shared,
    associate,
    gate_plots,
    keep_nis,
    weigh,
)
from wideberth.tracking.multi_target.bank_kernels import (
    CONFIRMED,
    Bank,
    Motion,
    combined,
    make_bank,
    note_maneuvers,
    place,
    predict_tracks,
)
from wideberth.tracking.multi_target.buffers_kernels import COUNTS, PLOTS_SHED, Rules, Scratch, make_scratch
from wideberth.tracking.multi_target.imm_kernels import HYPOTHESES
from wideberth.tracking.multi_target.intake_kernels import take_in
from wideberth.tracking.multi_target.life_kernels import drop_unscanned, give_birth, merge, settle
from wideberth.tracking.multi_target.sighting_kernels import (
    detection_at,
    frame_at,
    projected,
    sector_volume,
    visibility,
)
from wideberth.tracking.multi_target.unresolved_kernels import claim_merged, find_unresolved, keep_aim
from wideberth.tracking.multi_target.window_kernels import (
    TABLE_NODES,
    Window,
    keep_plots,
    make_window,
    open_window,
)
from wideberth.tracking.ownship_kernels import FLAG, OwnshipTest, choose, forget, look, telemetry_known

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

CLUTTER_WIDTH = 4
EXPECTED, CAME = 2, 3

PRIOR_PLOTS = 20.0
"""So many plots of confirmed tracks weigh as much as the probability of detection that the sensor says."""

MOST_PLOTS = 500.0
"""Expected plots further back than about this are forgotten."""

LEAST_SHARE = 0.3
MOST_SEEN = 0.999

LEAST_FALSE_PLOTS = 0.1
"""A sensor that has shown no false plot may still have some: plots a scan."""


class Table(NamedTuple):
    """Room for R rows of confirmed tracks: scan, number, state (9) and covariance (9, 9), existence, ownship, and NIS.

    The normalised innovation squared is that of the scan's plot, with its degrees of freedom; 0 of them: no plot.
    """

    scan: IntArray
    identity: IntArray
    x: FloatArray
    p: FloatArray
    existence: FloatArray
    ownship: NDArray[np.bool_]
    nis: FloatArray
    nis_dof: FloatArray


def make_table(rows: int) -> Table:
    """Return room for so many rows."""
    return Table(
        scan=np.zeros(rows, np.int64),
        identity=np.zeros(rows, np.int64),
        x=np.zeros((rows, 9)),
        p=np.zeros((rows, 9, 9)),
        existence=np.zeros(rows),
        ownship=np.zeros(rows, np.bool_),
        nis=np.zeros(rows),
        nis_dof=np.zeros(rows),
    )


@jit_uncounted
def process_scan(
    bank: Bank,
    window: Window,
    motion: Motion,
    rules: Rules,
    clutter: FloatArray,
    sensor: int,
    t: float,
    z: FloatArray,
    variance: FloatArray,
    begin: int,
    end: int,
    position: FloatArray,
    velocity: FloatArray,
    attitude: FloatArray,
    field_of_view: FloatArray,
    ranges: FloatArray,
    probabilities: FloatArray,
    cone: bool,
    counts: IntArray,
    s: Scratch,
) -> None:
    """Take in one scan: all tracks are at its time afterwards.

    Parameters
    ----------
    bank : Bank
        Tracks that end and are known by their ADS-B reports stay, with existence `HANDED_BACK`.
    window : Window
    motion : Motion
    rules : Rules
    clutter : ndarray, shape (sensors, CLUTTER_WIDTH)
        What each sensor has shown: plots a scan that no track explains, how many scans that is the mean of, and how
        many plots of confirmed tracks were expected and came.
    sensor : int
    t : float
        s; not before the bank's time.
    z : ndarray, shape (rows, 4)
        Range (m), azimuth, elevation (rad), range rate (m/s); NaN where not given.
    variance : ndarray, shape (rows, 4)
        Error variances of `z`.
    begin, end : int
        The scan's rows.
    position, velocity : ndarray, shape (3,)
        Of the sensor, NED, m and m/s.
    attitude : ndarray, shape (3, 3)
        C_ned_sensor.
    field_of_view : ndarray, shape (2,)
        Half-widths in azimuth and elevation, rad.
    ranges, probabilities : ndarray, shape (TABLE_NODES,)
        Probability of detection against range.
    cone : bool
        Whether the azimuth of plots without elevation is the angle out of the sensor's forward-down plane.
    counts : ndarray of int64, shape (COUNTS,)
    s : Scratch
    """
    drop_unscanned(bank, t, rules.silent_s, s)
    range_max = ranges[TABLE_NODES - 1]
    n = take_in(
        z, variance, begin, end, position, attitude, range_max, rules.known_down, rules.known_sigma, cone, counts, s
    )
    # At a sensor's first scan all its plots may be false.
    if clutter[sensor, 1] == 0.0:
        clutter[sensor, 0] = n
    density = max(clutter[sensor, 0], LEAST_FALSE_PLOTS) / sector_volume(range_max, field_of_view)
    open_window(window, t, position, velocity, attitude, field_of_view, ranges, probabilities, density)
    dt = t - bank.t[0] if bank.t[0] > -math.inf else 0.0
    predict_tracks(bank, t, motion, s.motion)
    bank.t[1] = t
    size = bank.size[0]
    # Sensors see less well than they say, or better: what confirmed tracks have had corrects it.
    share = (PRIOR_PLOTS + clutter[sensor, CAME]) / (PRIOR_PLOTS + clutter[sensor, EXPECTED])
    share = max(share, LEAST_SHARE)
    for i in range(size):
        place(bank, i, s.x, s.p)
        frame_at(position, attitude, s.x, s.frame, s.look)
        for a in range(3):
            s.spread[a] = projected(s.frame, s.p, a)
        shown = visibility(s.look, s.spread, field_of_view, range_max)
        said = shown * detection_at(ranges, probabilities, min(s.look[0], range_max))
        s.seen[i] = min(share * said, MOST_SEEN)
        s.said[i] = said if bank.status[i] == CONFIRMED and shown > 0.99 else 0.0
        if shown >= 0.5:
            bank.inside[i], bank.home[i], bank.seen[i] = 1, sensor, t
        elif bank.home[i] == sensor:
            bank.inside[i] = 0
        keep_aim(i, s)
        gate_plots(bank, i, window, n, rules.gate, cone, s)
        weigh(bank, i, window, rules.speed_max, s)
    pairs = find_unresolved(bank, window, n, cone, s)
    for i in range(size):
        if s.unresolved[i] > 0.0:
            allow_shared(bank, i, s.unresolved[i], s.shared[i], s)
    clusters = associate(size, rules.event_limit, counts, s)
    mine = s.claims
    for i in range(size):
        confirmed = bank.status[i] == CONFIRMED and s.seen[i] > 0.0
        clutter[sensor, EXPECTED] += s.said[i] * (1.0 - s.unresolved[i])
        if bank.address[i] >= 0:
            absorb_cross(bank, i, s)
        bank.nis_dof[i] = 0.0
        if absorb(bank, i, rules.existence_max, s) > 0.5:
            if confirmed and bank.inside[i] == 1:
                clutter[sensor, CAME] += 1.0 - s.unresolved[i]
            bank.hits[i] += 1
            bank.updated[i], bank.seen[i] = t, t
            bank.inside[i], bank.home[i] = 1, sensor
            bank.fed[i] |= 1 << min(sensor, 62)
            keep_nis(bank, i, s)
        for c in range(s.counts[i]):
            mine[s.plots[i, c]] += s.beta[i, c + 1]
    claim_merged(pairs, mine, s)
    expected, shed = keep_plots(window, s.z, s.variance, s.sight, s.order, n, mine)
    counts[PLOTS_SHED] += shed
    for q in range(n):
        mine[s.order[q]] = 0.0
    merge(bank, clusters, motion, rules.merge_gate, s)
    give_birth(bank, window, motion, rules, sensor, clutter[sensor, 0], counts, s)
    settle(bank, t, rules, s)
    note_maneuvers(bank, dt)
    if clutter[sensor, EXPECTED] > MOST_PLOTS:
        clutter[sensor, CAME] *= MOST_PLOTS / clutter[sensor, EXPECTED]
        clutter[sensor, EXPECTED] = MOST_PLOTS
    clutter[sensor, 1] = min(clutter[sensor, 1] + 1.0, rules.clutter_scans)
    clutter[sensor, 0] += (expected - clutter[sensor, 0]) / clutter[sensor, 1]


@jit_uncounted
def find_ownship(
    bank: Bank,
    dt: float,
    telemetry: FloatArray,
    covariance: FloatArray,
    motion: Motion,
    test: OwnshipTest,
    s: Scratch,
) -> int:
    """Compare all tracks with the ownship's telemetry of their time; return which one is the ownship, -1 none.

    Parameters
    ----------
    bank : Bank
    dt : float
        Time since this was done last, s.
    telemetry : ndarray, shape (6,)
        Position and velocity of the ownship, NED; anything not finite: no telemetry.
    covariance : ndarray, shape (6, 6)
    motion : Motion
    test : OwnshipTest
    s : Scratch
    """
    known = telemetry_known(telemetry, covariance)
    for i in range(bank.size[0]):
        if not known:
            forget(dt, test, bank.own[i])
        elif bank.status[i] == CONFIRMED:
            combined(bank, i, motion, s.x, s.p, s.motion)
            look(dt, s.x, s.p, telemetry, covariance, test, bank.own[i], s.own_work)
    return choose(bank.size[0], test, bank.own) if known else -1


@jit_uncounted
def run_scans(
    bank: Bank,
    window: Window,
    motion: Motion,
    rules: Rules,
    clutter: FloatArray,
    first: IntArray,
    t: FloatArray,
    use: NDArray[np.bool_],
    z: FloatArray,
    variance: FloatArray,
    position: FloatArray,
    velocity: FloatArray,
    attitude: FloatArray,
    field_of_view: FloatArray,
    ranges: FloatArray,
    probabilities: FloatArray,
    telemetry: FloatArray,
    telemetry_covariance: FloatArray,
    test: OwnshipTest,
    begin: int,
    rows: int,
    table: Table,
    counts: IntArray,
    s: Scratch,
) -> tuple[int, int]:
    """Take in scans of one sensor from `begin` on, and write the confirmed tracks of each, until room is short.

    Parameters
    ----------
    bank, window, motion, rules, clutter, z, variance, field_of_view, ranges, probabilities, counts, s
        As in `process_scan`.
    first : ndarray of int64, shape (n_scans + 1,)
        Where each scan's rows begin.
    t : ndarray, shape (n_scans,)
    use : ndarray of bool, shape (n_scans,)
        False: the scan was rejected; the tracks of the last one are reported at its time, which must not go back.
    position, velocity : ndarray, shape (n_scans, 3)
    attitude : ndarray, shape (n_scans, 3, 3)
    telemetry : ndarray, shape (n_scans, 6)
        Of the ownship; NaN where there is none.
    telemetry_covariance : ndarray, shape (6, 6)
    test : OwnshipTest
    begin : int
        The first scan to do.
    rows : int
        Rows of the table that are filled.
    table : Table

    Returns
    -------
    scan : int
        The next scan to do; where it is not the last plus one, bank or table must be made larger.
    rows : int
    """
    for k in range(begin, t.shape[0]):
        births = min(window.z.shape[1], first[k + 1] - first[k])
        if bank.size[0] + births > bank.mu.shape[0] or rows + bank.size[0] + births > table.scan.shape[0]:
            return k, rows
        s.event_count[0] = 0
        if use[k]:
            dt = t[k] - bank.t[0] if bank.t[0] > -math.inf else 0.0
            process_scan(
                bank,
                window,
                motion,
                rules,
                clutter,
                0,
                t[k],
                z,
                variance,
                first[k],
                first[k + 1],
                position[k],
                velocity[k],
                attitude[k],
                field_of_view,
                ranges,
                probabilities,
                False,
                counts,
                s,
            )
            find_ownship(bank, dt, telemetry[k], telemetry_covariance, motion, test, s)
        for i in range(bank.size[0]):
            if bank.status[i] == CONFIRMED and bank.inside[i] == 1:
                table.scan[rows], table.identity[rows] = k, bank.identity[i]
                combined(bank, i, motion, table.x[rows], table.p[rows], s.motion)
                table.existence[rows] = bank.existence[i]
                table.ownship[rows] = bank.own[i, FLAG] != 0.0
                table.nis[rows], table.nis_dof[rows] = bank.nis[i], bank.nis_dof[i] if use[k] else 0.0
                rows += 1
    return t.shape[0], rows


@jit_uncounted
def report_tracks(bank: Bank, motion: Motion, x: FloatArray, p: FloatArray, s: Scratch) -> None:
    """Write the means (n, 9) and covariances (n, 9, 9) of all tracks of a bank."""
    for i in range(bank.size[0]):
        combined(bank, i, motion, x[i], p[i], s.motion)


def warmup() -> None:
    """Compile what Python calls."""
    n = HYPOTHESES
    motion = Motion(np.full((n, 3), 1e-4), np.ones(n), np.full(n, 10.0), np.full(n, 1.0 / n), 1000.0, 0.01, 0.05)
    rules = Rules._make([16.0, 100, 0.05, 3, 100.0, 30.0, 3, 4] + [0.0] * 4 + [0.9999] + [1.0] * 5 + [10, 0.0, 1.0])
    bank, window, s = make_bank(4), make_window(2, 1), make_scratch(4, 1, 2)
    zero, eye, fov, table = np.zeros(3), np.eye(3), np.ones(2), np.ones(TABLE_NODES)
    clutter, counts, z = np.zeros((1, CLUTTER_WIDTH)), np.zeros(COUNTS, np.int64), np.ones((1, 4))
    process_scan(
        bank, window, motion, rules, clutter, 0, 0.0, z, z, 0, 1, zero, zero, eye, fov, table, table, False, counts, s
    )
    test = OwnshipTest(3.0, 0.5, 22.0, 35.0, 9.0, -25.0)
    find_ownship(bank, 0.1, np.zeros(6), np.eye(6), motion, test, s)
    first, use, places = np.array([0, 1]), np.ones(1, np.bool_), np.zeros((1, 3))
    run_scans(
        bank,
        window,
        motion,
        rules,
        clutter,
        first,
        np.ones(1),
        use,
        z,
        z,
        places,
        places,
        eye[None].copy(),
        fov,
        table,
        table,
        np.zeros((1, 6)),
        np.eye(6),
        test,
        0,
        0,
        make_table(4),
        counts,
        s,
    )
    report_tracks(bank, motion, np.zeros((4, 9)), np.zeros((4, 9, 9)), s)
