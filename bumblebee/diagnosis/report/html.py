"""Building blocks of the two reports: the page, tables and numbers with intervals; all text from files is escaped."""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

from bumblebee.diagnosis.simulation import pick
from bumblebee.diagnosis.simulation import rows as rows_of
from bumblebee.io.page_policy import policy_tag

_STYLE = """:root{color-scheme:light}body{font:15px/1.55 system-ui,-apple-system,'Segoe UI',sans-serif;max-width:62rem;
margin:2.2rem auto;padding:0 1.2rem;color:#1d2430;background:#fff}h1{font-size:1.7rem;margin:0 0 .3rem}
h2{font-size:1.15rem;margin:2rem 0 .4rem}h3{font-size:.98rem;margin:1.1rem 0 .2rem}
p{margin:.4rem 0}.lead{font-size:1.08rem;max-width:52rem}.first,.strong{font-weight:600}
.scroll{overflow-x:auto}table{border-collapse:collapse;margin:.5rem 0;font-size:.9rem}
td,th{padding:.28rem .7rem .28rem 0;border-bottom:1px solid #e4e7ee;text-align:left;vertical-align:top}
td:first-child{white-space:nowrap}
th{color:#6b7385;font-weight:500}td.n,th.n{text-align:right;font-variant-numeric:tabular-nums;white-space:nowrap}
.place{display:inline-block;white-space:normal;max-width:10.5rem}td.group{padding-top:1rem;font-weight:600}
td.group span{display:inline-block;white-space:normal;max-width:min(84vw,52rem)}
.note{color:#6b7385;font-size:.86rem}.warn{border-left:4px solid #c8553d;background:#fbeeea;padding:.5rem .9rem;
margin:.8rem 0}
.share{white-space:nowrap}.bar{display:inline-block;height:.6rem;background:#1b8a6b;border-radius:2px;vertical-align:middle;margin-right:.4rem}
figure{overflow-x:auto}svg{display:block;width:100%;min-width:34rem;max-width:48rem;height:auto;font-size:13px}
.row svg{min-width:0}.row{display:flex;flex-wrap:wrap;gap:.6rem}.row figure{flex:1 1 18rem}
figure{margin:.4rem 0}.row figure{max-width:20rem}figcaption{color:#6b7385;font-size:.86rem}
@media(max-width:40rem){td:last-child:not(.n){min-width:11rem}}
code{font-size:.86rem;white-space:normal;overflow-wrap:anywhere}
details{margin:.6rem 0}summary{cursor:pointer;color:#6b7385}.good{color:#1b8a6b}.bad{color:#c8553d}
.values{min-width:13rem;display:inline-block}"""


@dataclass(frozen=True)
class Inlay:
    """HTML that another room makes for a page, with its own style and script."""

    html: str = ""
    style: str = ""
    script: str = ""


NO_INLAY = Inlay()


def html_page(title: str, parts: Sequence[str], inlay: Inlay = NO_INLAY) -> str:
    """A whole page; it loads nothing from anywhere, and runs the inlay's script alone."""
    view = "<meta name='viewport' content='width=device-width,initial-scale=1'>"
    head = f"<meta charset='utf-8'>{policy_tag(inlay.script)}{view}<title>{escape(title)}</title>"
    style, body = _STYLE + inlay.style, "\n".join(part for part in parts if part)
    body += f"<script>{inlay.script}</script>" if inlay.script else ""
    return f"<!doctype html><html lang='en'><head>{head}<style>{style}</style></head><body>\n{body}\n</body></html>\n"


def table(head: Sequence[str], rows: Sequence[Sequence[str]], numbers: Sequence[int] = ()) -> str:
    """A table of ready-made cells; the columns `numbers` are set flush right, a row of one cell is a title."""
    kinds = [" class='n'" if k in numbers else "" for k in range(len(head))]
    top = "".join(f"<th{kind}>{h}</th>" for h, kind in zip(head, kinds, strict=True))
    body = "".join(f"<tr>{_cells(row, kinds)}</tr>" for row in rows)
    return f"<div class='scroll'><table><tr>{top}</tr>{body}</table></div>"


def _cells(row: Sequence[str], kinds: Sequence[str]) -> str:
    if len(row) == 1 < len(kinds):
        return f"<td class='group' colspan='{len(kinds)}'><span>{row[0]}</span></td>"
    return "".join(f"<td{kind}>{cell}</td>" for cell, kind in zip(row, kinds, strict=True))


def figure(picture: str, caption: str) -> str:
    """A picture with words under it; nothing where there is no picture."""
    return f"<figure>{picture}<figcaption>{caption}</figcaption></figure>" if picture else ""


def items(texts: Sequence[str]) -> str:
    """A list of plain texts."""
    return "<ul>" + "".join(f"<li>{escape(text)}</li>" for text in texts) + "</ul>" if texts else ""


def warning(text: str) -> str:
    """Something that must not be overlooked; plain text."""
    return f"<p class='warn'>{escape(text)}</p>"


def number(value: float | None, digits: int = 3) -> str:
    """A number with so many digits, large ones in full; "-" for none."""
    if value is None:
        return "-"
    return f"{value:,.0f}" if 10**digits <= abs(value) < 1e9 else f"{value:.{digits}g}"


def share_of(part: float, whole: float, what: str = "") -> str:
    """A size as a share of another, called `what`; as a multiple where it is the larger one."""
    if not whole:
        return "-"
    text = f"{100 * part / whole:.0f} %" if part <= whole else f"{number(part / whole, 2)} times"
    return f"{text}{' of' if part <= whole else ''} {what}" if what else text


def probability(p: float) -> str:
    """A p value; below 1e-12 nobody's model of noise is that good."""
    return "&lt; 1e-12" if p < 1e-12 else f"{p:.1g}"


def interval(entry: dict[str, Any] | None, scale: float = 1.0) -> str:
    """A value of the contract's error block with its 95 % interval."""
    if not entry or entry.get("value") is None:
        return "-"
    ci = entry.get("ci95")
    ends = f" <span class='note'>[{number(scale * ci[0])}, {number(scale * ci[1])}]</span>" if ci else ""
    return f"{number(scale * entry['value'])}{ends}"


def shade(ratio: float) -> str:
    """Background for a cell whose error is `ratio` times the noise: the redder, the more."""
    strength = min(max((ratio - 1.0) / 20.0, 0.0), 1.0) ** 0.5
    return f"background:rgba(200,85,61,{0.55 * strength:.2f})"


def error_rows(columns: dict[str, dict[str, Any]]) -> str:
    """Rows for horizon and measure, a column for each error block."""
    rows = []
    first = next(iter(columns.values()))
    for horizon, measures in first.items():
        for label, unit, scale, key in rows_of(measures):
            cells = [interval(pick(block.get(horizon, {}), key), scale) for block in columns.values()]
            rows.append([f"{escape(horizon)} s", label + (f" [{unit}]" if unit else ""), *cells])
        lost = measures.get("windows", {}).get("diverged", 0)
        if lost:
            rows.append([f"{escape(horizon)} s", "windows that diverged", str(lost), *[""] * (len(columns) - 1)])
    return table(["horizon", "quantity", *columns], rows, range(2, 2 + len(columns)))
