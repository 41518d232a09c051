"""A page for the person at the gate: counts, findings, tracking error by joint, command against measurement.

Self-contained: inline style and SVG, no script. Every string that came from outside is escaped.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from bumblebee.measured.rollout import Rollout

WIDTH, HEIGHT, MARGIN = 640, 150, 36
MOTIONS_SHOWN = 24
FINDINGS_SHOWN = 200

STYLE = """
body{font:15px/1.5 system-ui,sans-serif;max-width:1000px;margin:2rem auto;padding:0 1rem;color:#1d2430;background:#fff}
h1{font-size:1.5rem}h2{font-size:1.15rem;margin-top:2rem}table{border-collapse:collapse;margin:.5rem 0}
td,th{padding:.25rem .7rem;border-bottom:1px solid #e3e7ee;text-align:left;vertical-align:top}
td.n{text-align:right;font-variant-numeric:tabular-nums}.fatal{color:#b3261e}.bar{fill:#d99a00}
.big{display:flex;gap:2.5rem;flex-wrap:wrap}.big b{display:block;font-size:1.9rem;line-height:1.2}
text{font:11px system-ui,sans-serif;fill:#4a5568}
.cmd{stroke:#8a94a6}.got{stroke:#d97706}path{fill:none;stroke-width:1.3}
"""


@dataclass(frozen=True)
class Trace:
    """Command and measurement of the joint that follows worst, in one rollout of a motion."""

    motion: str
    joint: str
    error: float
    time: np.ndarray
    command: np.ndarray
    measured: np.ndarray


def write_overview(path: Path, summary: dict[str, Any], findings: pd.DataFrame, rollouts: Iterable[Rollout]) -> None:
    """Write overview.html from the summary, the findings and the accepted rollouts."""
    errors, traces = tracking(rollouts)
    parts = [
        _numbers(summary),
        _table("Findings by rule", ("rule", "files", "fatal", "warnings"), _rule_rows(summary)),
        _table("By cluster", ("cluster", "accepted", "set aside"), _verdict_rows(summary["by_cluster"])),
        _table("By motion", ("motion", "accepted", "set aside"), _verdict_rows(summary["by_motion"])),
        _bars(errors),
        _traces(traces),
        _findings(findings),
    ]
    head = f"<!doctype html><html lang=en><meta charset=utf-8><title>Round {int(summary['round'])}: measured</title>"
    title = f"<h1>Round {int(summary['round'])}: what the robot's logs hold</h1>"
    path.write_text(f"{head}<style>{STYLE}</style><body>{title}{''.join(parts)}</body></html>\n", encoding="utf-8")


def tracking(rollouts: Iterable[Rollout]) -> tuple[dict[str, float], list[Trace]]:
    """RMS of target minus position by joint [rad] over all rollouts, and the worst joint of each motion's first."""
    squares: dict[str, list[np.ndarray]] = {}
    traces: dict[str, Trace] = {}
    for rollout in rollouts:
        if rollout.joint_target is None:
            continue
        error = rollout.joint_target - rollout.joint_pos
        for joint, name in enumerate(rollout.joints):
            squares.setdefault(name, []).append(error[:, joint] ** 2)
        worst = int(np.argmax((error**2).mean(axis=0)))
        motion = str(rollout.meta.get("motion", rollout.rollout_id))
        if motion not in traces:
            size = float(np.sqrt((error[:, worst] ** 2).mean()))
            pair = rollout.joint_target[:, worst], rollout.joint_pos[:, worst]
            traces[motion] = Trace(motion, rollout.joints[worst], size, rollout.time - rollout.time[0], *pair)
    errors = {name: float(np.sqrt(np.concatenate(parts).mean())) for name, parts in squares.items()}
    return errors, sorted(traces.values(), key=lambda trace: -trace.error)


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
    for name, verdict in counts.items():
        yield name, verdict["accepted"], verdict["quarantined"]


def _table(title: str, head: tuple[str, ...], rows: Iterable[tuple[Any, ...]]) -> str:
    body = "".join(f"<tr>{''.join(_cell(value) for value in row)}</tr>" for row in rows)
    names = "".join(f"<th>{escape(name)}</th>" for name in head)
    return f"<h2>{escape(title)}</h2>" + (f"<table><tr>{names}</tr>{body}</table>" if body else "<p>None.</p>")


def _cell(value: object) -> str:
    number = isinstance(value, int | float | np.integer)
    return f"<td{' class=n' if number else ''}>{escape(str(value))}</td>"


def _bars(errors: dict[str, float]) -> str:
    if not errors:
        return "<h2>Tracking error by joint</h2><p>No rollout holds position targets.</p>"
    largest = max(errors.values()) or 1.0
    rows = []
    for row, (name, value) in enumerate(sorted(errors.items(), key=lambda pair: -pair[1])):
        y = 18 * row
        rows.append(f'<text x="0" y="{y + 13}">{escape(name)}</text>')
        rows.append(f'<rect class="bar" x="210" y="{y + 3}" width="{360 * value / largest:.1f}" height="12"/>')
        rows.append(f'<text x="{216 + 360 * value / largest:.1f}" y="{y + 13}">{1000 * value:.0f} mrad</text>')
    svg = f'<svg viewBox="0 0 {WIDTH} {18 * len(errors) + 4}" width="{WIDTH}" role="img">{"".join(rows)}</svg>'
    return f"<h2>Tracking error by joint</h2><p>Root mean square of target minus position.</p>{svg}"


def _traces(traces: list[Trace]) -> str:
    if not traces:
        return ""
    shown = "".join(_plot(trace) for trace in traces[:MOTIONS_SHOWN])
    more = f"<p>{len(traces) - MOTIONS_SHOWN} more motions follow better.</p>" if len(traces) > MOTIONS_SHOWN else ""
    head = "<h2>Command (grey) and measurement (orange)</h2><p>Of each motion the joint that follows worst.</p>"
    return head + shown + more


def _plot(trace: Trace) -> str:
    low = float(min(trace.command.min(), trace.measured.min()))
    high = float(max(trace.command.max(), trace.measured.max()))
    span, end = (high - low) or 1.0, float(trace.time[-1]) or 1.0

    def line(values: np.ndarray) -> str:
        keep = np.unique(np.linspace(0, len(values) - 1, min(len(values), 300)).astype(int))
        x = MARGIN + trace.time[keep] / end * (WIDTH - 2 * MARGIN)
        y = HEIGHT - 24 - (values[keep] - low) / span * (HEIGHT - 50)
        return "M" + "L".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))

    label = f"{trace.motion}: {trace.joint}, {1000 * trace.error:.0f} mrad"
    return (
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" role="img">'
        f'<text x="{MARGIN}" y="14">{escape(label)}</text>'
        f'<path class="cmd" d="{line(trace.command)}"/><path class="got" d="{line(trace.measured)}"/>'
        f'<text x="0" y="32">{high:.2f}</text><text x="0" y="{HEIGHT - 22}">{low:.2f}</text>'
        f'<text x="{WIDTH - MARGIN - 30}" y="{HEIGHT - 6}">{end:.1f} s</text></svg>'
    )


def _findings(findings: pd.DataFrame) -> str:
    rows = []
    for record in findings.head(FINDINGS_SHOWN).to_dict("records"):
        kind = "<td class=fatal>fatal</td>" if record["fatal"] else "<td>warning</td>"
        rows.append(f"<tr>{kind}<td>{escape(str(record['message']))}</td></tr>")
    more = f"<p>{len(findings) - FINDINGS_SHOWN} more in findings.csv.</p>" if len(findings) > FINDINGS_SHOWN else ""
    return (
        f"<h2>Every finding</h2><table>{''.join(rows)}</table>{more}" if rows else "<h2>Every finding</h2><p>None.</p>"
    )
