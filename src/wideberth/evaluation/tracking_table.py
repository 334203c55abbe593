"""The numbers of a tracker's runs in words, for the command line and the report."""

from collections.abc import Mapping
from typing import Any, NamedTuple

# Key, name, unit, digits, which of the seeds is the worst: the one with the most, with the least, or none is.
_ROWS: tuple[tuple[str, str, str, int, str], ...] = (
    ("ospa_m", "OSPA (c = 50 m, p = 2)", "m", 2, "most"),
    ("ospa_localisation_m", "– localisation", "m", 2, "most"),
    ("ospa_cardinality_m", "– cardinality", "m", 2, "most"),
    ("gospa_m", "GOSPA (alpha = 2)", "m", 2, "most"),
    ("gospa_localisation_m2", "– localisation", "m²", 1, "most"),
    ("gospa_missed_m2", "– missed", "m²", 1, "most"),
    ("gospa_false_m2", "– false", "m²", 1, "most"),
    ("first_confirmed_s", "first confirmed, from scan 0", "s", 2, "most"),
    ("latency_s", "first confirmed, from first visible", "s", 2, "most"),
    ("never_confirmed", "targets never confirmed", "", 0, "most"),
    ("tracks", "tracks", "", 0, ""),
    ("false_tracks", "false tracks", "", 0, "most"),
    ("identity_switches", "identity switches", "", 0, "most"),
    ("track_purity", "track purity", "", 4, "least"),
    ("missed_fraction", "visible targets without a track", "", 4, "most"),
    ("rmse_position_m", "RMSE of position", "m", 2, "most"),
    ("rmse_velocity_mps", "RMSE of velocity", "m/s", 2, "most"),
    ("nees_per_dof", "NEES per dof", "", 2, "most"),
    ("nis_per_dof", "NIS per dof", "", 2, "most"),
    ("coverage_95_horizontal", "inside the horizontal 95 % ellipse", "", 3, "least"),
    ("coverage_95_position", "inside the 95 % ellipsoid", "", 3, "least"),
    ("unsound_covariances", "covariances not positive definite", "", 0, "most"),
    ("ownship_identified", "ownship's track known as such", "", 3, "least"),
    ("intruder_taken_for_ownship_scans", "scans: intruder taken for the ownship", "", 0, "most"),
)


class MetricRow(NamedTuple):
    """A number in words: of all seeds together, of the worst seed (empty where none is), and its unit."""

    name: str
    value: str
    worst: str
    unit: str


def metric_rows(summary: Mapping[str, Any]) -> list[MetricRow]:
    """Return the rows of the table of a tracker's runs.

    Parameters
    ----------
    summary : mapping
        As `plot_run.summary_of` makes it.

    Returns
    -------
    list of MetricRow
    """
    worst = max(summary["cpu_ms_per_scan_by_seed"])
    rows = [MetricRow("CPU time a scan", _number(summary["cpu_ms_per_scan"], 3), _number(worst, 3), "ms")]
    if summary["metrics"] is None:
        return rows
    for key, name, unit, digits, extreme in _ROWS:
        found = [one[key] for one in summary["metrics_by_seed"] if one[key] is not None]
        words = ""
        if found and extreme:
            words = _number(max(found) if extreme == "most" else min(found), digits)
        rows.append(MetricRow(name, _number(summary["metrics"][key], digits), words, unit))
    return rows


def _number(value: float | None, digits: int) -> str:
    return "–" if value is None else f"{value:,.{digits}f}"
