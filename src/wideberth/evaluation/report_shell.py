"""What the pages of all reports share: one HTML file that asks nothing of the network."""

from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path

from wideberth.errors import InputError
from wideberth.evaluation.report_style import css_variables

_STYLE = """
:root{--font:system-ui,-apple-system,"Segoe UI",Roboto,"DejaVu Sans",sans-serif;--page:#eef1f5;--card:#fdfdfe;
--ink:#1b2430;--muted:#5b6675;--line:#dde2e8;--good:#0f6b4f;--goodbg:#e2f3ec;--warn:#8a4b08;--warnbg:#fbeedb;
--bad:#9b1c1c;--badbg:#fbe5e3;--accent:#0b5cad;LIGHT}
@media (prefers-color-scheme:dark){:root{--page:#0e131a;--card:#151b23;--ink:#e8ecf1;--muted:#a7b1bd;--line:#2c3541;
--good:#6fd3ae;--goodbg:#12302a;--warn:#f0b866;--warnbg:#38290f;--bad:#ff9d94;--badbg:#3d1a1a;--accent:#6cb2f5;DARK}}
*{box-sizing:border-box}html{color-scheme:light dark}
body{margin:0;background:var(--page);color:var(--ink);font:15px/1.5 var(--font)}
main{max-width:1120px;margin:0 auto;padding:28px 20px 60px}
header h1{font-size:25px;line-height:1.25;margin:0 0 2px;letter-spacing:-.01em}header p{margin:0;color:var(--muted)}
.verdict{margin:18px 0;padding:16px 20px;border-radius:12px;display:flex;gap:16px;align-items:center}
.verdict b{display:block;font-size:19px;line-height:1.3}.verdict svg{flex:none;width:38px;height:38px}
.good{background:var(--goodbg);color:var(--good)}.warn{background:var(--warnbg);color:var(--warn)}
.bad{background:var(--badbg);color:var(--bad)}
.tiles{display:grid;grid-template-columns:repeat(auto-fit,minmax(160px,1fr));gap:12px;margin:0 0 18px}
.tile,section{background:var(--card);border:1px solid var(--line);border-radius:12px}
.tile{padding:12px 15px}.tile span{display:block;color:var(--muted);font-size:13px}
.tile b{font-size:17px;white-space:nowrap;font-variant-numeric:tabular-nums;font-weight:650}
.tile small{color:var(--muted);font-size:12.5px}
section{padding:16px 20px 18px;margin:0 0 18px}section h2{font-size:16.5px;margin:0 0 4px}
section>p{margin:0 0 8px;color:var(--muted);font-size:14px}section>svg{display:block;width:100%;height:auto}
table{border-collapse:collapse;width:100%;font-size:14px;font-variant-numeric:tabular-nums}
th{text-align:left;font-weight:600;color:var(--muted);font-size:13px;vertical-align:bottom}
td.n,th,td:first-child{white-space:nowrap}
th,td{padding:6px 12px 6px 0;border-bottom:1px solid var(--line)}tr:last-child td{border-bottom:0}
td.n,th.n{text-align:right}td.lost{color:var(--bad);font-weight:600}.scroll{overflow-x:auto}
ol{list-style:none;margin:6px 0 0;padding:0;max-height:430px;overflow-y:auto}
li{display:grid;grid-template-columns:64px 1fr;gap:10px;padding:5px 0;border-bottom:1px solid var(--line)}
li:last-child{border:0}li time{color:var(--muted);font-variant-numeric:tabular-nums;text-align:right}
details{margin-top:10px}summary{cursor:pointer;color:var(--muted);font-size:14px}
li.m{font-weight:600}li.m time{color:inherit}
.two{display:grid;grid-template-columns:1fr 1fr;gap:18px}.two section{margin:0}.two{margin-bottom:18px}
@media (max-width:800px){.two{grid-template-columns:1fr}}
td small{color:var(--muted);font-size:12px;white-space:nowrap}
td code{display:block;font-size:11.5px;white-space:normal;text-align:left;min-width:400px;
padding-left:10px}
tr.all td{font-weight:600}tr.all small{font-weight:400}
footer{color:var(--muted);font-size:13px}@media print{body{background:none}ol{max-height:none}}
"""
Cell = str  # HTML
_MARKS = {
    "good": '<path d="M11 20.5l6 6 11-13" fill="none" stroke="currentColor" stroke-width="3.4" stroke-linecap="round"'
    ' stroke-linejoin="round"/>',
    "warn": '<path d="M19 10v12" stroke="currentColor" stroke-width="3.6" stroke-linecap="round"/>'
    '<circle cx="19" cy="28" r="2.3" fill="currentColor"/>',
    "bad": '<path d="M12.5 12.5l13 13m0-13l-13 13" stroke="currentColor" stroke-width="3.6" stroke-linecap="round"/>',
}


def shell(title: str, subtitle: str, state: str, headline: str, sentence: str, body: str) -> str:
    """Return a whole page.

    Parameters
    ----------
    title, subtitle : str
    state : str
        ``good``, ``warn`` or ``bad``: the colour and mark of the headline.
    headline, sentence : str
        What came of it, in plain words.
    body : str
        HTML.
    """
    style = _STYLE.replace("LIGHT", css_variables(dark=False)).replace("DARK", css_variables(dark=True))
    return f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width,initial-scale=1">
<title>{escape(title)}</title><style>{style}</style></head><body><main>
<header><h1>{escape(title)}</h1><p>{escape(subtitle)}</p></header>
<div class="verdict {state}"><svg viewBox="0 0 38 38" aria-hidden="true"><circle cx="19" cy="19" r="17.4" fill="none"
 stroke="currentColor" stroke-width="2.4"/>{_MARKS[state]}</svg><div><b>{escape(headline)}</b>{
        escape(sentence)
    }</div></div>
{body}
</main></body></html>
"""


def make_folder(out: Path) -> None:
    """Make a report's folder where it does not exist: before what takes long is drawn for it.

    Raises
    ------
    InputError
        If it cannot be made.
    """
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"cannot write the report into {out}: {error.strerror or error}") from error


def write_files(out: Path, files: Mapping[str, str | bytes]) -> None:
    """Write a report's files into a folder, which is made where it does not exist.

    Parameters
    ----------
    out : Path
    files : mapping of str to str or bytes
        By name; text is written as UTF-8.

    Raises
    ------
    InputError
        If the folder cannot be written.
    """
    make_folder(out)
    try:
        for name, content in files.items():
            (out / name).write_bytes(content.encode() if isinstance(content, str) else content)
    except OSError as error:
        raise InputError(f"cannot write the report into {out}: {error.strerror or error}") from error


def section(title: str, text: str, body: str) -> str:
    """Return a section of a page: a title, a line of text, and HTML."""
    return f"<section><h2>{escape(title)}</h2>{f'<p>{escape(text)}</p>' if text else ''}{body}</section>"


def number(value: float | None, unit: str = "", digits: int = 0) -> str:
    """Return a number with its unit, a dash for None."""
    return "–" if value is None else f"{value:,.{digits}f}{unit}".replace("-", "−", 1)


def notes_footer(notes: Sequence[str]) -> str:
    """Return the notes at the foot of a page."""
    if not notes:
        return ""
    return f"<footer>{''.join(f'<p>{escape(note)}</p>' for note in notes)}</footer>"


def table(head: Sequence[str], body: Sequence[Sequence[Cell]], *, text_columns: int = 1, total: bool = False) -> str:
    """Return an HTML table; cells are HTML already.

    Parameters
    ----------
    head : sequence of str
        Plain text.
    body : sequence of sequences of str
    text_columns : int
        How many columns, from the left, hold text; the others hold numbers.
    total : bool
        Whether the last row sums up the others.
    """
    titles = "".join(f"<th{_right(i, text_columns)}>{escape(title)}</th>" for i, title in enumerate(head))
    lines = []
    for k, row in enumerate(body):
        cells = "".join(f"<td{_right(i, text_columns)}>{cell}</td>" for i, cell in enumerate(row))
        lines.append(f"<tr{' class=all' if total and k == len(body) - 1 else ''}>{cells}</tr>")
    return f'<div class="scroll"><table><tr>{titles}</tr>{"".join(lines)}</table></div>'


def _right(column: int, text_columns: int) -> str:
    return "" if column < text_columns else ' class="n"'
