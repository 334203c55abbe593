"""Made-up rows of encounters, as the Monte Carlo leaves them: drawn geometry, crude detectors and avoidance."""

import numpy as np
import pyarrow as pa

from wideberth.evaluation.montecarlo import rows
from wideberth.evaluation.montecarlo.detectors import nominal_thresholds
from wideberth.evaluation.montecarlo.ideal_detector import draw_intruders
from wideberth.units import FOOT

SARP = 4000 * FOOT, 700 * FOOT
SIZES = {rows.NMAC: (500 * FOOT, 100 * FOOT), rows.LOSS: SARP, rows.ASTM: (2000 * FOOT, 250 * FOOT)}


def made_rows(experiment, intruders, first, count, seed=1, avoid=True):
    """Return the rows of encounters first..first+count-1; each encounter is made from its own numbers alone."""
    parts = [_encounter(experiment, intruders, first + i, seed, avoid) for i in range(count)]
    return pa.Table.from_pydict(
        {name: np.concatenate([part[name] for part in parts]) for name in rows.SCHEMA.names}, schema=rows.SCHEMA
    )


def _encounter(experiment, k, encounter, seed, avoid):
    rng = np.random.default_rng([seed, k, encounter])
    scoring = experiment.scoring
    size = scoring.volume_radius_m, scoring.volume_half_height_m
    violation = scoring.violation_radius_m, scoring.violation_half_height_m
    p, v, height = draw_intruders(experiment.encounter, k, rng)
    speed = np.hypot(*v.T)
    miss = np.abs(p[:, 0] * v[:, 1] - p[:, 1] * v[:, 0]) / speed
    t_cpa = -(p * v).sum(axis=1) / speed**2
    tenths = np.rint(10 * np.clip(t_cpa - scoring.tau_s, 0.1, 170)) / 10
    event = (miss < size[0]) & (np.abs(height) < size[1])
    other = (miss < scoring.other_radius_m) & (np.abs(height) < scoring.other_half_height_m)
    sigma = experiment.scenario.sensor.config.nacp and 38.0
    out = {
        "intruders": np.full(k, k),
        "encounter": np.full(k, encounter),
        "intruder": np.arange(k),
        "north_m": p[:, 0],
        "east_m": p[:, 1],
        "height_m": height,
        "velocity_north_mps": v[:, 0],
        "velocity_east_mps": v[:, 1],
        "t_cpa_s": t_cpa,
        "miss_m": miss,
        "t_true_s": np.where(event, tenths, np.nan),
        "t_true_other_s": np.where(other, tenths, np.nan),
    }
    heard = np.abs(miss + sigma * rng.standard_normal(k)), np.abs(height + 6 * rng.standard_normal(k))
    scale = np.maximum(heard[0] / size[0], heard[1] / size[1])
    sigmas = np.maximum((heard[0] - size[0]) / sigma, (heard[1] - size[1]) / 23)
    scores = (
        scale,
        sigmas + 0.3 * rng.standard_normal(k),
        1.3 * sigmas,
        np.where(sigmas > 12, np.inf, np.exp(np.minimum(sigmas, 12) - 1)),
    )
    thresholds = list(nominal_thresholds(experiment).values())
    for i, (score, threshold) in enumerate(zip(scores, thresholds, strict=True)):
        late = np.rint(10 * rng.normal(0.8, 2.5, k)) / 10
        out[f"score_{i}"] = score
        out[f"t_{i}_s"] = np.where(score < threshold, np.maximum(tenths + late, 0.0), np.nan)
    maneuver = avoid and bool(np.isfinite(out["t_3_s"]).any() or rng.random() < 0.1)
    moved = np.abs(rng.normal(0, 1, k)) * 4 * size[0] if maneuver else np.zeros(k)
    out["horizontal_alone_m"], out["vertical_alone_m"] = miss, np.abs(height)
    out["horizontal_m"], out["vertical_m"] = miss + moved, np.abs(height) + 0.2 * moved
    in_run = event & (rng.random(k) < 0.9) if maneuver else event
    out["t_true_in_run_s"] = np.where(in_run, tenths, np.nan)
    out["t_detected_in_run_s"] = out["t_3_s"]
    for suffix in ("_alone", ""):
        h, z = out[f"horizontal{suffix}_m"], out[f"vertical{suffix}_m"]
        inside = np.zeros(k, np.int32)
        sizes = {
            **SIZES,
            rows.VOLUME_FULL: violation,
            rows.VOLUME_THIRD: (violation[0] / 3, violation[1] / 3),
            rows.VOLUME_AIRCRAFT: (scoring.aircraft_radius_m, scoring.aircraft_half_height_m),
            rows.LOSS_FILTERED: (0.8 * SARP[0], SARP[1]),
        }
        for bit, (radius, half) in sizes.items():
            inside |= np.where((h < radius) & (z < half), bit, 0).astype(np.int32)
        out[f"inside{suffix}"] = inside
    out["t_maneuver_s"] = np.full(k, np.round(float(rng.uniform(0, 30)), 1) if maneuver else np.nan)
    out["duration_alone_s"] = np.full(k, round(min(float(t_cpa.max()) + 5, experiment.encounter.duration_s), 1))
    out["duration_s"] = out["duration_alone_s"] + (1.5 if maneuver else 0.0)
    out["extra_path_m"] = np.full(k, round(abs(rng.normal(0, 300)), 2) if maneuver else 0.0)
    out["maneuvers"] = np.full(k, 1 + int(rng.integers(3)) if maneuver else 0)
    out["least_bad"] = np.full(k, int(rng.random() < 0.01) if maneuver else 0)
    out["full_tier"] = np.full(k, bool(rng.random() < 0.01))
    return out
