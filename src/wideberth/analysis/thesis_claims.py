"""What section 2.2 of the thesis says about figures 2.7 to 2.12, beside what the sweeps give."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from wideberth.analysis.range_sweep import Curve, Panel, Sweep
from wideberth.argument_checks import FloatArray
from wideberth.units import FOOT, KNOT, NAUTICAL_MILE


@dataclass(frozen=True, slots=True)
class Claim:
    """What the text says, what the sweep gives, in words, and whether they agree."""

    says: str
    here: str
    holds: bool


def claims(sweep: Sweep) -> list[Claim]:
    """Return the statements of the thesis about a figure; none where the sweep is not that of the thesis.

    Parameters
    ----------
    sweep : Sweep
        As `thesis_figures.sweep` makes it.
    """
    return [] if sweep.changed or sweep.name not in _CLAIMS else _CLAIMS[sweep.name](sweep)


def _stacked(panel: Panel, method: str, quantity: str) -> FloatArray:
    """Return a method's values, a row for each level, without the points that have none."""
    rows = np.array([curve.values[quantity] for curve in panel.curves if curve.method == method])
    return rows[:, np.isfinite(rows).all(axis=0)]


def _at(panel: Panel, method: str, quantity: str, speed: float) -> FloatArray:
    """Return a method's values at the point nearest to a speed of the ownship, one for each level."""
    k = int(np.argmin(np.abs(panel.curves[0].x - speed)))
    return np.array([curve.values[quantity][k] for curve in panel.curves if curve.method == method])


def _figure_2_7(sweep: Sweep) -> list[Claim]:
    above = min(float((_stacked(p, "tgvv", "distance") - _stacked(p, "gvv", "distance")).min()) for p in sweep.panels)
    roll, fast = sweep.panels[0], sweep.panels[0].curves[0].x[-2:]
    excess = (_stacked(roll, "tgvv", "distance") - _stacked(roll, "gvv", "distance"))[:, -1] / FOOT
    slopes = [np.diff(_stacked(p, "gvv", "distance")[:, -2:]).ravel() / np.diff(fast) for p in sweep.panels[1:]]
    speed, radius, bank, wait, turn = slopes
    steeper = _rising(radius) and _rising(wait)
    told = "; ".join(", ".join(f"{slope:.2f}" for slope in panel) for panel in (radius, wait))
    return [
        Claim("TGVV is always above GVV", f"by {above / FOOT:.1f} ft at least", above > 0.0),
        Claim(
            "with a faster roll TGVV comes nearer to GVV (a)",
            f"{' → '.join(f'{e:,.0f}' for e in excess)} ft above it at the right edge",
            _rising(-excess),
        ),
        Claim("the slope at large speeds grows with R_s and t_c (c, e)", f"{told} m for each m/s", steeper),
        Claim("it falls with φ_max (d)", ", ".join(f"{slope:.2f}" for slope in bank), _rising(-bank)),
        Claim(
            "it stays with v_i and χ_t (b, f)",
            "; ".join(", ".join(f"{slope:.2f}" for slope in panel) for panel in (speed, turn)),
            bool(np.ptp(speed) < 0.02 * speed.mean() and np.ptp(turn) < 0.02 * turn.mean()),
        ),
    ]


def _rising(values: FloatArray) -> bool:
    return bool((np.diff(values) > 0.0).all())


def _figure_2_8(sweep: Sweep) -> list[Claim]:
    text = {"tgvv": (5209, 500, 18.9), "gvv": (4942, 456, 17.9), "tt": (None, 243, 12.9), "gt": (None, 116, 9.9)}
    told = []
    for curve in sweep.panels[0].curves:
        start, cpa, t_cpa = text[curve.method]
        mark, distance = curve.marks[0], curve.arguments["distance"] / FOOT
        name, ours = curve.method.upper(), mark.y / FOOT
        if start is not None:
            told.append(
                Claim(f"{name}: detected at {start:,} ft", f"{distance:,.1f} ft", round(distance) == start),
            )
        near = f"{ours:.1f} ft after {mark.x:.2f} s"
        told.append(
            Claim(f"{name}: closest {cpa} ft after {t_cpa} s", near, (round(ours), round(mark.x, 1)) == (cpa, t_cpa))
        )
    return told


def _figure_2_9(sweep: Sweep) -> list[Claim]:
    away, others = 0.0, -np.inf
    for panel in sweep.panels:
        for curve in panel.curves:
            radius = curve.arguments["safety_radius"]
            beyond = curve.values["cpa"] / radius - 1.0
            if curve.method == "tgvv":
                away = max(away, float(np.nanmax(np.abs(beyond))))
            else:
                others = max(others, float(np.nanmax(beyond)))
    slow, fast = 25.0 * KNOT, sweep.panels[1].curves[0].x[-1]
    by_speed, by_bank, by_turn = sweep.panels[1], sweep.panels[3], sweep.panels[5]
    short = {
        at: max(float((_at(by_speed, "gvv", "cpa", at) - _at(by_speed, m, "cpa", at)).max()) for m in ("tt", "gt"))
        for at in (slow, fast)
    }
    bank = _at(by_bank, "gvv", "cpa", fast) / FOOT
    turn = (_at(by_turn, "gvv", "cpa", slow) - _at(by_turn, "tt", "cpa", slow)) / FOOT
    return [
        Claim("TGVV leads to exactly R_s", f"within {away:.0e} of it", away < 1e-6),
        Claim("the others lead to less", f"by {-others:.2g} of it at least", others < 0.0),
        Claim(
            "TT and GT come to GVV as v_o grows (b)",
            f"{short[slow] / FOOT:.0f} ft below it at 25 kt, {short[fast] / FOOT:.0f} ft at the right edge, at most",
            short[fast] < 0.1 * short[slow],
        ),
        Claim(
            "the smaller φ_max, the nearer to R_s (d)",
            f"GVV: {', '.join(f'{cpa:.0f}' for cpa in bank)} ft at the right edge",
            _rising(-bank),
        ),
        Claim(
            "the smaller χ_t, the farther is TT from GVV at low speeds (f)",
            f"{', '.join(f'{gap:.0f}' for gap in turn)} ft below it at 25 kt",
            _rising(-turn),
        ),
    ]


def _figure_2_10(sweep: Sweep) -> list[Claim]:
    smallest = all(
        (_stacked(p, "gvv", "error") <= _stacked(p, other, "error") + 1e-9).all()
        for p in sweep.panels[1:]
        for other in ("tt", "gt")
    )
    roll = _stacked(sweep.panels[0], "gvv", "error")
    slow, at_once = roll[:, -1], float(np.abs(roll[:, 0]).max())
    told = ", ".join(f"{100 * e:.2f} %" for e in slow)
    better = np.concatenate(
        [(_stacked(p, "tt", "error") < _stacked(p, "gt", "error")).mean(axis=1) for p in sweep.panels[1:]]
    )
    return [
        Claim("GVV has the smallest error", "at every point" if smallest else "not at every point", smallest),
        Claim(
            "TT's is less than GT's, but for v_i near zero",
            f"at {100 * better[1:].min():.0f} % of the points of each level; v_i zero: {100 * better[0]:.0f} %",
            bool(better[0] < 0.5 < better[1:].min()),
        ),
        Claim(
            "the error falls with τ, but not to zero (a)",
            f"at 30 deg/s, from 0 to 1 s: {told}",
            slow[0] > 1e-3 and _rising(slow),
        ),
        Claim("it goes to zero as the bank is there at once (a)", f"{100 * at_once:.1e} % at most", at_once < 1e-8),
    ]


def _figure_2_11(sweep: Sweep) -> list[Claim]:
    turn_time = _stacked(sweep.panels[1], "tt", "maneuver_time")
    same = bool(np.ptp(turn_time) < 1e-9)
    others = np.array([_stacked(sweep.panels[2], m, "maneuver_time")[:, -1] for m in ("tt", "gvv", "gt")])
    away = float(np.abs(others / others[0] - 1.0).max())
    radius, bank = (_stacked(panel, "tgvv", "maneuver_time") for panel in sweep.panels[2:4])
    last = [f"{t:.2f}" for t in (*radius[:, -1], *bank[:, -1])]
    return [
        Claim("TT's time does not depend on speed", f"{turn_time[0, 0]:.3f} s everywhere", same),
        Claim("GT and GVV come to it at large speeds (c)", f"within {100 * away:.1f} % at the right edge", away < 0.1),
        Claim(
            "it grows with R_s (c)",
            f"{', '.join(last[:3])} s at the right edge",
            bool((np.diff(radius, axis=0) > 0).all()),
        ),
        Claim(
            "it falls with φ_max (d)",
            f"{', '.join(last[3:])} s there; the same where none of these banks is reached",
            bool((np.diff(bank, axis=0) < 1e-9).all() and (np.diff(bank[:, -1]) < 0).all()),
        ),
    ]


def _figure_2_12(sweep: Sweep) -> list[Claim]:
    panel = sweep.panels[0]
    fast = panel.curves[0].x >= 125.0 * KNOT
    exact: list[Curve] = [curve for curve in panel.curves if curve.method == "tgvv"]
    distances = np.array([curve.values["distance"][fast] for curve in exact]) / NAUTICAL_MILE
    cpa = _stacked(panel, "tgvv", "cpa") / NAUTICAL_MILE
    error = float(_stacked(panel, "gvv", "error").max())
    time = float(_stacked(panel, "tgvv", "maneuver_time")[:, -1].mean())
    least, most = float(distances.min()), float(distances.max())
    return [
        Claim(
            "ranges are of the order of 10 to 50 nmi (a)",
            f"{least:.1f} to {most:.1f} nmi from 125 kt on",
            least > 8 and most < 60,
        ),
        Claim(
            "TGVV leads to 0.75 nmi (b)",
            f"{cpa.min():.6f} to {cpa.max():.6f} nmi",
            bool(np.abs(cpa - 0.75).max() < 1e-6),
        ),
        Claim("GVV's error stays well under 1 % (c)", f"{100 * error:.2f} % at most", error < 0.01),
        Claim("at large speeds it takes about 57 s (d)", f"{time:.2f} s at 1250 kt", round(time) == 57),
    ]


_CLAIMS: Mapping[str, Callable[[Sweep], list[Claim]]] = MappingProxyType(
    {
        "2.7": _figure_2_7,
        "2.8": _figure_2_8,
        "2.9": _figure_2_9,
        "2.10": _figure_2_10,
        "2.11": _figure_2_11,
        "2.12": _figure_2_12,
    }
)
