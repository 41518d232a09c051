"""One page on which a person can judge a round: what is asked, what was found, how well the robot followed.

Self-contained: inline style and SVG, no script. Every string that came from outside is escaped. The same files give
the same bytes: no time of day and no folder of this machine is on it, so the commands are those of the workspace's
folder; `bumblebee gate show` and Prefect's page print them whole.
"""

from collections.abc import Iterable, Iterator
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from bumblebee.io.page_policy import policy_tag
from bumblebee.io.read import file_hash
from bumblebee.measured import overview_plots as plots
from bumblebee.measured.overview_plots import Trace, tracking
from bumblebee.measured.rollout import Rollout
from tasks.approvals.words import NOTES, SHORT

__all__ = ["Trace", "tracking", "write_overview"]

MOTIONS_SHOWN = 24
ROWS_SHOWN = 60
FINDINGS_SHOWN = 200

STYLE = """
*{box-sizing:border-box}
body{font:15px/1.5 system-ui,sans-serif;max-width:1180px;margin:1.2rem auto;padding:0 1rem;
color:#1d2430;background:#fff;overflow-wrap:anywhere}
h1{font-size:1.5rem;line-height:1.25;margin:.4rem 0}h2{font-size:1.15rem;margin-top:2rem}
table{border-collapse:collapse;margin:.5rem 0;max-width:100%}
td,th{padding:.25rem .7rem .25rem 0;border-bottom:1px solid #e3e7ee;text-align:left;vertical-align:top}
td.n,th.n{text-align:right;font-variant-numeric:tabular-nums}.fatal{color:#b3261e}.note{color:#4a5568}
.big{display:flex;gap:.6rem 2.2rem;flex-wrap:wrap}.big b{display:block;font-size:1.7rem;line-height:1.2}
.ask{border:1px solid #cbd3df;border-left:4px solid #d97706;border-radius:6px;padding:.6rem .9rem;margin:1rem 0}
.ask p{margin:.3rem 0}code,pre{font:13px/1.45 ui-monospace,monospace;background:#f3f5f9;border-radius:4px}
code{padding:.1rem .3rem}pre{padding:.4rem .6rem;margin:.3rem 0;white-space:pre-wrap}
.grid{display:grid;gap:1rem 1.6rem;grid-template-columns:repeat(auto-fill,minmax(min(100%,330px),1fr))}
svg{display:block;width:100%;height:auto;max-width:520px}
"""


def write_overview(path: Path, summary: dict[str, Any], findings: pd.DataFrame, rollouts: Iterable[Rollout]) -> None:
    """Write overview.html from the summary, the findings and the accepted rollouts.

    summary.json and model.xml beside `path` give the hash that an answer names and the joints that slide.
    """
    errors, traces = tracking(rollouts)
    slides = plots.slides(path.with_name("model.xml"))
    shown = path.with_name("summary.json")
    number = int(summary["round"])
    parts = [
        _asked(summary, file_hash(shown) if shown.is_file() else ""),
        _numbers(summary),
        _table("Findings by rule", ("rule", "files", "fatal", "warnings"), _rule_rows(summary)),
        _table("By cluster", ("cluster", "accepted", "set aside"), _verdict_rows(summary["by_cluster"])),
        _tracking(errors, slides),
        _traces(traces, slides),
        _table("By motion", ("motion", "accepted", "set aside"), _verdict_rows(summary["by_motion"])),
        _findings(findings),
    ]
    head = (
        f"<!doctype html><html lang=en><head><meta charset=utf-8>{policy_tag()}"
        "<meta name=viewport content='width=device-width,initial-scale=1'>"
        f"<title>Round {number}: measured</title><style>{STYLE}</style></head>"
    )
    title = f"<h1>Round {number}: may the loop learn from these logs?</h1>"
    path.write_text(f"{head}<body>{title}{''.join(parts)}</body></html>\n", encoding="utf-8")


def _asked(summary: dict[str, Any], sha256: str) -> str:
    """Question, and how to answer exactly this."""
    if not summary["accepted"]:
        return "<div class=ask><p><b>No file can be used: there is nothing to approve.</b></p></div>"
    text = (
        "<p>Approve, and the diagnosis corrects the simulator with the accepted files. "
        "Reject, and the round stops here. More, and it waits for more rollouts. "
        "Files that were set aside are not used either way.</p>"
    )
    if not sha256:
        return f"<div class=ask>{text}</div>"
    asked, hashed = int(summary["round"]), sha256[:SHORT]
    answers = [f"bumblebee gate {verb} {asked} --seen {hashed}{note}" for verb, note in NOTES.items()]
    return (
        f"<div class=ask>{text}<p>The answer holds for what this page shows, and for nothing else: "
        f"<code>{hashed}</code>. On Prefect's page of the run, choose Resume at the top right "
        "(in the menu ⋮ where it is no button); "
        "or in the workspace's folder:</p>"
        f"{''.join(f'<pre>{answer}</pre>' for answer in answers)}"
        f"<p class=note>Whole commands, for any folder: <code>bumblebee gate show {asked}</code>. "
        f"SHA-256 of summary.json: {sha256}</p></div>"
    )


def _numbers(summary: dict[str, Any]) -> str:
    cells = {
        "files accepted": summary["accepted"],
        "files set aside": summary["quarantined"],
        "seconds accepted": f"{summary['seconds']:.1f}",
        "joints": len(summary["joints"]),
    }
    inner = "".join(f"<div><b>{escape(str(value))}</b>{escape(name)}</div>" for name, value in cells.items())
    return f"<div class=big>{inner}</div>"


def _rule_rows(summary: dict[str, Any]) -> Iterator[tuple[Any, ...]]:
    for rule, counts in summary["by_rule"].items():
        yield rule, counts["files"], counts["fatal"], counts["warning"]


def _verdict_rows(counts: dict[str, dict[str, int]]) -> Iterator[tuple[Any, ...]]:
    """Those with files set aside first."""
    for name, verdict in sorted(counts.items(), key=lambda pair: -pair[1]["quarantined"]):
        yield name, verdict["accepted"], verdict["quarantined"]


def _table(title: str, head: tuple[str, ...], rows: Iterable[tuple[Any, ...]]) -> str:
    every = list(rows)
    body = "".join(f"<tr>{''.join(_cell(value) for value in row)}</tr>" for row in every[:ROWS_SHOWN])
    first, *others = (escape(name) for name in head)
    names = f"<th>{first}</th>" + "".join(f"<th class=n>{name}</th>" for name in others)
    more = f"<p>{len(every) - ROWS_SHOWN} more in summary.json.</p>" if len(every) > ROWS_SHOWN else ""
    table = f"<table><tr>{names}</tr>{body}</table>{more}" if body else "<p>None.</p>"
    return f"<h2>{escape(title)}</h2>{table}"


def _cell(value: object) -> str:
    number = isinstance(value, int | float | np.integer)
    return f"<td{' class=n' if number else ''}>{escape(str(value))}</td>"


def _tracking(errors: dict[str, float], slides: frozenset[str]) -> str:
    head = "<h2>Tracking error by joint</h2>"
    if not errors:
        return f"{head}<p>No rollout holds position targets.</p>"
    text = "<p>Root mean square of target minus position, over all accepted files.</p>"
    pictures = [
        f"<div><h3>{what}</h3>{plots.bars(values, unit)}</div>" for what, unit, values in plots.by_unit(errors, slides)
    ]
    return f"{head}{text}<div class=grid>{''.join(pictures)}</div>"


def _traces(traces: list[Trace], slides: frozenset[str]) -> str:
    if not traces:
        return ""
    shown = "".join(f"<div>{plots.plot(trace, trace.joint in slides)}</div>" for trace in traces[:MOTIONS_SHOWN])
    more = f"<p>{len(traces) - MOTIONS_SHOWN} more motions follow better.</p>" if len(traces) > MOTIONS_SHOWN else ""
    text = "<p>Of each motion's first file the joint that follows worst, and its root mean square error.</p>"
    return f"<h2>Command (grey) and measurement (orange)</h2>{text}<div class=grid>{shown}</div>{more}"


def _findings(findings: pd.DataFrame) -> str:
    rows = []
    ordered = findings.sort_values("fatal", ascending=False, kind="stable") if len(findings) else findings
    for record in ordered.head(FINDINGS_SHOWN).to_dict("records"):
        kind = "<td class=fatal>fatal</td>" if record["fatal"] else "<td>warning</td>"
        rows.append(f"<tr>{kind}<td>{escape(str(record['message']))}</td></tr>")
    more = f"<p>{len(findings) - FINDINGS_SHOWN} more in findings.csv.</p>" if len(findings) > FINDINGS_SHOWN else ""
    table = f"<table>{''.join(rows)}</table>{more}" if rows else "<p>None.</p>"
    return f"<h2>Every finding</h2>{table}"
