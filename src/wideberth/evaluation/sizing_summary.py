"""The numbers of a sensor's sizing as plain data."""

import math
from typing import Any

import numpy as np

from wideberth.analysis.escapes import ESCAPES, escape_range
from wideberth.analysis.ground_sizing import GroundProtection
from wideberth.analysis.sensor_reach import adsb_reach, radar_reach
from wideberth.analysis.sizing_answer import SizingAnswer, SpeedLimit
from wideberth.analysis.sizing_config import AdsbSizingConfig, GroundRadarConfig
from wideberth.evaluation.sizing_tables import Sizing


def summary(sizing: Sizing, *, by_bearing: bool) -> dict[str, Any]:
    """Return the numbers: SI units, but bearings in degrees; None where a range is infinite or there is none.

    Parameters
    ----------
    sizing : Sizing
    by_bearing : bool
        Whether to add the ranges at each bearing.

    Returns
    -------
    dict
        Plain data for JSON.
    """
    sensor, aircraft, answer = sizing.sensor, sizing.aircraft, sizing.answer
    kind = "adsb" if isinstance(sensor, AdsbSizingConfig) else "radar"
    found: dict[str, Any] = {
        "sensor": {
            "name": sizing.sensor_name,
            "kind": "ground_radar" if isinstance(sensor, GroundRadarConfig) else kind,
            **sensor.model_dump(mode="json", exclude={"noise", "encounter"}),
        },
        "aircraft": aircraft.model_dump(mode="json"),
        "rcs_m2": sizing.rcs,
        "reach": _reach(sizing),
        "escapes": {
            name: [
                {"speed_mps": one.speed, "required_head_on_m": _number(r)}
                for one, r in zip(
                    sizing.intruders,
                    escape_range(name, 0.0, np.array([i.speed for i in sizing.intruders]), aircraft),
                    strict=True,
                )
            ]
            for name in ESCAPES
        },
    }
    if isinstance(answer, GroundProtection):
        found["answer"] = {"words": sizing.words}
        found["intruders"] = _ground(sizing, answer)
        found["turn_margin_m"] = answer.turn_margin
        return found
    found["answer"] = {
        "words": sizing.words,
        "head_on": _limit(answer.head_on),
        "field_of_view": _limit(answer.field_of_view),
        "all_directions": _limit(answer.all_round),
    }
    found["intruders"] = _intruders(answer)
    if by_bearing:
        found["by_bearing"] = {
            "bearing_deg": np.degrees(answer.protection.bearings).round(6).tolist(),
            "required_m": _rows(answer.protection.required_range.T),
            "available_m": _rows(answer.protection.available_range.T),
        }
    return found


def _intruders(answer: SizingAnswer) -> list[dict[str, Any]]:
    return [
        {
            "name": one.intruder.name,
            "speed_mps": one.intruder.speed,
            "protected_bearings_deg": _degrees(one.protected),
            "unprotected_bearings_deg": _degrees(one.unprotected),
            "no_threat_bearings_deg": _degrees(one.no_threat),
            "required_head_on_m": _number(one.required_head_on),
            "available_head_on_m": one.available_head_on,
            "worst": {
                "bearing_deg": round(math.degrees(one.worst_bearing), 6),
                "required_m": _number(one.worst_required),
                "available_m": one.worst_available,
                "shortfall_m": _number(one.shortfall),
            },
            "cure": {
                "range_in_view_m": _number(one.needed_range),
                "range_all_round_m": _number(one.needed_range_all_round),
                "field_of_view_deg": round(math.degrees(one.needed_field_of_view), 6),
                "rcs_m2": one.needed_rcs,
                "decision_time_s": one.needed_decision_time,
            },
        }
        for one in answer.intruders
    ]


def _ground(sizing: Sizing, found: GroundProtection) -> list[dict[str, Any]]:
    rows = []
    for k, one in enumerate(sizing.intruders):
        seen, volume = found.surveillance[k], found.operation[k]
        rows.append(
            {
                "name": one.name,
                "speed_mps": one.speed,
                "required_m": _number(float(found.required_range[k])),
                "surveillance": None
                if seen is None
                else {"shape": seen.shape, "radius_m": seen.radius, "height_m": seen.height},
                "operation": None
                if volume is None or volume.radius == 0.0
                else {"radius_m": volume.radius, "height_m": volume.height},
            }
        )
    return rows


def _reach(sizing: Sizing) -> Any:
    if isinstance(sizing.sensor, AdsbSizingConfig):
        return [
            {"power_class": name, "range_m": far, "track_m": tracks}
            for name, (far, tracks) in adsb_reach(sizing.sensor).items()
        ]
    found = radar_reach(sizing.sensor)
    return {
        "detection_probability": found.detection_probability,
        "closing_speeds_mps": found.closing_speeds.tolist(),
        "snr_at_m": found.ranges.tolist(),
        "by_rcs": [
            {
                "rcs_m2": float(rcs),
                "snr_db": found.snr[k].tolist(),
                "detected_m": float(found.detection[k]),
                "track_m": found.confirmed[k].tolist(),
                "lost_to_confirmation_m": found.lost[k].tolist(),
            }
            for k, rcs in enumerate(found.sections)
        ],
    }


def _limit(limit: SpeedLimit) -> dict[str, Any]:
    return {"up_to_mps": limit.speed, "at_least": limit.at_least}


def _degrees(stretches: tuple[tuple[float, float], ...]) -> list[list[float]]:
    return [[round(math.degrees(a), 6), round(math.degrees(b), 6)] for a, b in stretches]


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _rows(values: Any) -> list[list[float | None]]:
    return [[_number(round(float(v), 2)) for v in row] for row in values]
