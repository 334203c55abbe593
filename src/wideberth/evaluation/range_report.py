"""The report of a sweep of the detection range: one self-contained page, its picture, and its numbers beside it."""

from collections.abc import Sequence
from html import escape
from pathlib import Path

import numpy as np

from wideberth import __version__
from wideberth.analysis.range_sweep import Curve, Panel, Sweep
from wideberth.analysis.thesis_claims import Claim, claims
from wideberth.evaluation.range_figures import METHOD_NAMES, cut_off, scale, sweep_figure
from wideberth.evaluation.range_numbers import sweep_csv, sweep_json
from wideberth.evaluation.report_shell import Cell, notes_footer, section, shell, table, write_files
from wideberth.evaluation.report_style import png, svg

_ROWS = 11  # of a table of numbers; the CSV has all
_GAPS_TOLD = 2  # at the head of the page
_METHODS = (
    "TGVV: the bank lags, integrated (2.23). GVV: the bank is there at once, closed form (2.37, 2.46). TT: turn time "
    "(2.4). GT: tangent circles (2.5)."
)


def write_report(out: Path, sweep: Sweep) -> Path:
    """Write the page, the picture as PNG, the numbers as CSV and what they stand on as JSON, all of one name.

    Parameters
    ----------
    out : Path
        A folder, made where it does not exist.
    sweep : Sweep

    Returns
    -------
    Path
        Of the page.

    Raises
    ------
    InputError
        If the folder cannot be written.
    """
    stem = sweep.name.replace(".", "_").replace("-", "_")
    stem = f"figure_{stem}" if sweep.name[0].isdigit() else stem
    figure = sweep_figure(sweep)
    picture, drawing = png(figure), svg(figure, sweep.title)
    page_path = out / f"{stem}.html"
    write_files(
        out,
        {
            f"{stem}.png": picture,
            f"{stem}.csv": sweep_csv(sweep),
            f"{stem}.json": sweep_json(sweep, f"{stem}.csv"),
            page_path.name: page(sweep, drawing, stem),
        },
    )
    return page_path


def page(sweep: Sweep, drawing: str, stem: str) -> str:
    """Return the page.

    Parameters
    ----------
    sweep : Sweep
    drawing : str
        Inline SVG.
    stem : str
        Name of the files beside it, without what follows the dot.
    """
    number = f"Figure {sweep.name}: " if sweep.name[0].isdigit() else ""
    stated = claims(sweep)
    state, headline = _verdict(sweep, stated)
    gaps = gap_words(sweep)
    sentence = " ".join(gaps[:_GAPS_TOLD]) if gaps else "Every method has an answer at every point."
    if len(gaps) > _GAPS_TOLD:
        sentence += f" {len(gaps) - _GAPS_TOLD} more gaps are listed below."
    body = [
        section(sweep.title, " ".join(_reading(sweep)), drawing),
        _claims(stated),
        _gaps(sweep),
        section(
            "Inputs",
            "Printed in the thesis, given on the command line, or chosen here where its text does not say.",
            _inputs(sweep),
        ),
        _case_changes(sweep),
        section("Numbers", f"Every point is in {stem}.csv, in SI units.", _numbers(sweep)),
        notes_footer([_METHODS, f"wideberth {__version__}."]),
    ]
    subtitle = "Thesis, section 2.2: an intruder head-on, avoided by a level turn"
    return shell(f"{number}{sweep.title}", subtitle, state, headline, sentence, "\n".join(body))


def gap_words(sweep: Sweep) -> list[str]:
    """Return, in sentences, where methods have no answer and why."""
    return [f"No answer {where} ({who}): {why}." for who, where, why in _gap_groups(sweep)]


def _gap_groups(sweep: Sweep) -> list[tuple[str, str, str]]:
    """Return who has no answer, where and why, for gaps that agree in the latter two."""
    groups: dict[tuple[str, str], list[tuple[Panel, Curve]]] = {}
    for panel, curve, gap in sweep.gaps:
        groups.setdefault((_interval(panel.x, gap.first, gap.last), gap.reason), []).append((panel, curve))
    told = []
    every = sum(len(panel.curves) for panel in sweep.panels)
    for (where, why), found in groups.items():
        methods = [METHOD_NAMES[m] for m in METHOD_NAMES if any(curve.method == m for _, curve in found)]
        letters = sorted({panel.letter for panel, _ in found} - {""})
        levels = sorted({curve.level for _, curve in found} - {""})
        who = ", ".join(methods) + (f"; panel {', '.join(letters)}" if letters else "")
        who += f"; {' / '.join(levels)}" if 0 < len(levels) <= 3 else ""
        told.append(("all curves" if len(found) == every else who, where, why))
    return told


def _interval(x: str, first: float, last: float) -> str:
    x_scale = scale(x)
    low, high = (f"{value / x_scale.factor:.4g}" for value in (first, last))
    unit = f" {x_scale.unit}" if x_scale.unit else ""
    if x == "inverse_bank_rate":
        high, low = (f"{1.0 / (value / x_scale.factor):.4g}" if value else "∞" for value in (first, last))
        unit = " deg/s"
    return f"at {low}{unit}" if first == last else f"from {low} to {high}{unit}"


def _verdict(sweep: Sweep, stated: Sequence[Claim]) -> tuple[str, str]:
    if not stated:
        return "warn" if sweep.gaps else "good", (
            "With values or an interval given" if sweep.changed else "The thesis has no figure of this"
        )
    held = sum(claim.holds for claim in stated)
    return "good" if held == len(stated) else "bad", f"{held} of {len(stated)} statements of the thesis hold"


def _reading(sweep: Sweep) -> list[str]:
    """Return what one must know to read the picture."""
    several = any(len({curve.level for curve in panel.curves}) > 1 for panel in sweep.panels)
    told = []
    if several:
        told.append(
            "Dashes tell the method, colours the level; a black curve is the same at all levels, as far as one can see."
        )
    if any(curve.nominal for panel in sweep.panels if panel.x == "ownship_speed" for curve in panel.curves):
        told.append("Levels are multiples of the fixed value, which is the blue one.")
    cuts = [(panel.letter, cut, scale(panel.x)) for panel in sweep.panels if (cut := cut_off(panel)) is not None]
    if cuts:
        places = ", ".join(f"({letter}) up to {cut[1] / x.factor:.3g} {x.unit}" for letter, cut, x in cuts)
        told.append(f"At the lowest speeds curves leave the picture above: {places}; the CSV has them.")
    if any(panel.y == "error" for panel in sweep.panels):
        told.append(
            "Short of TGVV's: by what part of TGVV's range a method's falls short of it; logarithmic against speed."
        )
    if any(panel.y == "cpa" for panel in sweep.panels):
        told.append("Closest approach: detected at a method's range, the ownship turns with the lag of its bank.")
    return told


def _claims(stated: Sequence[Claim]) -> str:
    if not stated:
        return ""
    rows = [
        [escape(c.says), escape(c.here), "yes" if c.holds else '<b style="color:var(--bad)">no</b>'] for c in stated
    ]
    return section("What the thesis says", "", table(("section 2.2", "here", "holds"), rows, text_columns=3))


def _gaps(sweep: Sweep) -> str:
    groups = _gap_groups(sweep)
    if not groups:
        return section("Where there is no answer", "Nowhere: every method answers at every point.", "")
    rows = [[escape(cell) for cell in group] for group in groups]
    text = "The curves have a gap there."
    return section("Where there is no answer", text, table(("curves", "where", "why"), rows, text_columns=3))


def _inputs(sweep: Sweep) -> str:
    rows = [
        [
            escape(item.name),
            escape(item.panels or "all"),
            escape(item.words),
            f"{', '.join(f'{value:.6g}' for value in item.si)} {item.si_unit}".replace("inf", "∞"),
            escape(item.source),
        ]
        for item in sweep.inputs
    ]
    return table(("quantity", "panel", "value", "in SI", "source"), rows, text_columns=5)


def _case_changes(sweep: Sweep) -> str:
    rows: list[list[Cell]] = []
    for panel in sweep.panels:
        if panel.y != "distance":
            continue
        x_scale, y_scale = scale(panel.x), scale(panel.y, panel.length_unit)
        rows += [
            [
                escape(panel.letter),
                METHOD_NAMES[curve.method],
                escape(curve.level),
                escape(mark.words),
                f"{mark.x / x_scale.factor:,.2f} {x_scale.unit}",
                f"{mark.y / y_scale.factor:,.1f} {y_scale.unit}",
            ]
            for curve in panel.curves
            for mark in curve.marks
        ]
    if not rows:
        return ""
    text = (
        "The triangles of the picture. TGVV: from case B, in which the largest bank is not reached, to A. GVV: from "
        "case 1, in which the turn is over before the closest approach, to 2."
    )
    head = ("panel", "method", "level", "case", "ownship speed", "range there")
    body = table(head, rows, text_columns=4)
    return section("Where the case changes", text, f"<details><summary>{len(rows)} changes</summary>{body}</details>")


def _numbers(sweep: Sweep) -> str:
    parts = []
    for panel in sweep.panels:
        name = f"({panel.letter}) {panel.title}" if panel.letter else panel.title or "all"
        parts.append(f"<details><summary>{escape(name)}</summary>{_panel_table(panel)}</details>")
    return "".join(parts)


def _panel_table(panel: Panel) -> str:
    x_scale, y_scale = scale(panel.x), scale(panel.y, panel.length_unit)
    x = panel.curves[0].x
    picked = np.unique(np.linspace(0, len(x) - 1, min(_ROWS, len(x))).round().astype(int))
    inverse = panel.x == "inverse_bank_rate"
    head = ["bank rate, deg/s" if inverse else x_scale.label]
    head += [" ".join(part for part in (METHOD_NAMES[c.method], c.level) if part) for c in panel.curves]
    rows = []
    for k in picked:
        at = x[k] / x_scale.factor
        first = ("∞" if at == 0.0 else f"{1.0 / at:.4g}") if inverse else f"{at:,.5g}"
        values = [curve.values[panel.y][k] / y_scale.factor for curve in panel.curves]
        rows.append([first, *(_value(value, y_scale.unit) for value in values)])
    return f"<p>{escape(y_scale.label)}</p>" + table(head, rows)


def _value(value: float, unit: str) -> Cell:
    if np.isnan(value):
        return "–"
    return f"{value:,.1f}" if unit == "ft" else f"{value:,.3f}"
