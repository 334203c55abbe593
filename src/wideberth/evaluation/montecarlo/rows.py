"""The rows that an encounter leaves behind: one for each intruder, in the order of (intruders, encounter, intruder)."""

import pyarrow as pa

# Bits of `inside` (with avoidance) and `inside_alone` (without): which volumes the intruder entered, on true states.
VOLUME_FULL, VOLUME_THIRD, VOLUME_AIRCRAFT, NMAC, LOSS, LOSS_FILTERED, ASTM = 1, 2, 4, 8, 16, 32, 64

DETECTORS = ("algorithm_1", "algorithm_2_printed", "algorithm_2_track", "default")
"""The four detectors, in the order of the columns `score_0` to `score_3` and `t_0` to `t_3`.

Algorithm 1 on the track, algorithm 2 as printed, algorithm 2 with the track's covariance, and ours.
"""

_FLOATS = (
    # Where the intruder starts (local NED from the ownship, which flies north) and how it flies; m, m/s.
    "north_m",
    "east_m",
    "height_m",  # above the ownship
    "velocity_north_mps",
    "velocity_east_mps",
    # The twin without avoidance: time (s from the start) of closest approach, and separation then.
    "t_cpa_s",
    "miss_m",
    # Algorithm 1 on true states, in the twin: first time at which it detects; NaN: no event.
    "t_true_s",
    # The same for the other reading of the volume (self-separation: the SARP volume; collision: half the height).
    "t_true_other_s",
    # First detection by each detector, in the twin; NaN: none.
    "t_0_s",
    "t_1_s",
    "t_2_s",
    "t_3_s",
    # The least threshold at which each would have detected the intruder at some time in the twin: it detects where
    # line 1 of the algorithms holds and the score is below its threshold. Algorithm 1: the scale of the volume that
    # just holds the predicted miss (threshold 1). Algorithm 2: how many sigmas the miss lies beyond the volume (m).
    # Ours: -log10 of the probability of entering the volume (-log10 of alarm_probability), plus the early discount
    # log10(early_alarm_probability / alarm_probability) * min(t / early_alarm_s, 1), the closest point being t ahead.
    # inf: never.
    "score_0",
    "score_1",
    "score_2",
    "score_3",
    # The run with avoidance: algorithm 1 on true states, and ours on the track.
    "t_true_in_run_s",
    "t_detected_in_run_s",
    # Closest approach in both runs: the separations where max(horizontal / violation_radius_m, vertical /
    # violation_half_height_m) is least; among equals, where the smaller of both ratios is.
    "horizontal_alone_m",
    "vertical_alone_m",
    "horizontal_m",
    "vertical_m",
    # The same in every row of the encounter: first maneuver (NaN: none), how long the runs lasted, and how much longer
    # the flown path is than the straight one.
    "t_maneuver_s",
    "duration_alone_s",
    "duration_s",
    "extra_path_m",
)

SCHEMA = pa.schema(
    [
        ("intruders", pa.int16()),
        ("encounter", pa.int64()),
        ("intruder", pa.int16()),
        *((name, pa.float64()) for name in _FLOATS),
        ("inside_alone", pa.int32()),
        ("inside", pa.int32()),
        ("maneuvers", pa.int32()),  # of the encounter
        ("least_bad", pa.int32()),  # of the encounter: maneuvers that were only the least bad
        ("full_tier", pa.bool_()),  # the encounter needed the full tier (a track was lost or started anew)
    ]
)
FLOAT_COLUMNS = _FLOATS
