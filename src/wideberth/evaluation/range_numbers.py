"""The numbers of a sweep of the detection range as files: every point as CSV, and what it stands on as JSON."""

import csv
import io
import json
import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from wideberth import __version__
from wideberth.analysis.range_sweep import SYMBOLS, Curve, Sweep
from wideberth.analysis.thesis_claims import claims

_ARGUMENT_COLUMNS = {
    "ownship_speed": "ownship_speed_mps",
    "intruder_speed": "intruder_speed_mps",
    "safety_radius": "safety_radius_m",
    "max_bank": "max_bank_rad",
    "computation_time": "computation_time_s",
    "turn_angle": "turn_angle_rad",
    "max_bank_rate": "max_bank_rate_rad_per_s",
    "roll_time_constant": "roll_time_constant_s",
}
_VALUE_COLUMNS = {
    "range": "range_m",
    "distance": "distance_m",
    "maneuver_time": "maneuver_time_s",
    "cpa": "cpa_m",
    "t_cpa": "t_cpa_s",
    "error": "error_fraction",
}
_X_COLUMNS = {"time": "time_s", "pilot_delay": "pilot_delay_s"}
assert set(_ARGUMENT_COLUMNS) == set(SYMBOLS)


def curves_of(sweep: Sweep) -> Iterator[tuple[str, str, Curve]]:
    """Yield each curve once, with the letters of the panels that it stands in and what is swept there."""
    letters: dict[int, list[str]] = {}
    for panel in sweep.panels:
        for curve in panel.curves:
            letters.setdefault(id(curve), []).append(panel.letter)
    for panel in sweep.panels:
        for curve in panel.curves:
            if id(curve) in letters:
                yield "".join(letters.pop(id(curve))), panel.x, curve


def sweep_csv(sweep: Sweep) -> str:
    """Return every point as comma-separated values, in SI units; where there is no answer, ``why_not`` says why."""
    curves = list(curves_of(sweep))
    shown = {key for _, _, curve in curves for key in curve.values}
    extra = [column for key, column in _X_COLUMNS.items() if any(x == key for _, x, _ in curves)]
    values = {key: column for key, column in _VALUE_COLUMNS.items() if key in shown}
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    head = ["panel", "method", *extra, *_ARGUMENT_COLUMNS.values(), *values.values(), "case", "why_not"]
    writer.writerow(head)
    for letters, x, curve in curves:
        for k in range(len(curve.x)):
            swept = {name: array[k] for name, array in curve.swept.items()}
            arguments = {**curve.arguments, **swept}
            writer.writerow(
                [
                    letters,
                    curve.method,
                    *(_text(curve.x[k]) if _X_COLUMNS.get(x) == column else "" for column in extra),
                    *(_text(arguments[name]) for name in _ARGUMENT_COLUMNS),
                    *(_text(curve.values[key][k]) for key in values),
                    curve.case[k],
                    next((gap.reason for gap in curve.gaps if gap.first <= curve.x[k] <= gap.last), ""),
                ]
            )
    return out.getvalue()


def sweep_json(sweep: Sweep, csv_name: str) -> str:
    """Return inputs with their sources, statements of the thesis, gaps and marks as JSON; numbers are SI."""
    told: dict[str, Any] = {
        "sweep": sweep.name,
        "title": sweep.title,
        "version": __version__,
        "numbers": csv_name,
        "panels": [
            {"letter": panel.letter, "title": panel.title, "swept": panel.x, "shown": panel.y} for panel in sweep.panels
        ],
        "inputs": [
            {
                "panels": item.panels or "all",
                "name": item.name,
                "words": item.words,
                "si": [value if math.isfinite(value) else "inf" for value in item.si],
                "si_unit": item.si_unit,
                "source": item.source,
            }
            for item in sweep.inputs
        ],
        "thesis": [{"says": c.says, "here": c.here, "holds": c.holds} for c in claims(sweep)],
        "no_answer": [
            {
                "panel": panel.letter,
                "method": curve.method,
                "level": curve.level,
                "from": gap.first,
                "to": gap.last,
                "points": gap.count,
                "reason": gap.reason,
            }
            for panel, curve, gap in sweep.gaps
        ],
        "marks": [
            {"panels": letters, "method": curve.method, "level": curve.level, "at": m.x, "value": m.y, "what": m.words}
            for letters, _, curve in curves_of(sweep)
            for m in curve.marks
        ],
    }
    return json.dumps(told, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def _text(value: float | np.float64) -> str:
    return "" if math.isnan(value) else f"{value:.10g}"
