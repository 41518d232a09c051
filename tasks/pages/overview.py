"""One page on which a person can judge a round: what is asked, what was found, how well the robot followed.

Self-contained, without a script. The same files give the same bytes: no time of day and no folder of this machine is on
it, so the commands are those of the workspace's folder; `bumblebee gate show` and Prefect's page print them whole.
"""

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from bumblebee.io.read import file_hash
from bumblebee.measured import overview_plots as plots
from bumblebee.measured.overview_plots import Trace, data_uri, tracking
from bumblebee.measured.rollout import Rollout
from bumblebee.report.page import Block, Cell, Section, heading, image, note, pairs, render, table, text, warning
from tasks.approvals.words import NOTES, SHORT

__all__ = ["Trace", "tracking", "write_overview"]

MOTIONS_SHOWN = 24
ROWS_SHOWN = 60
FINDINGS_SHOWN = 200
VERDICTS = ("accepted", "set aside")


def write_overview(path: Path, summary: dict[str, Any], findings: pd.DataFrame, rollouts: Iterable[Rollout]) -> None:
    """Write overview.html from the summary, the findings and the accepted rollouts.

    summary.json and model.xml beside `path` give the hash that an answer names and the joints that slide.
    """
    errors, traces = tracking(rollouts)
    slides = plots.slides(path.with_name("model.xml"))
    shown = path.with_name("summary.json")
    asked = _asked(summary, file_hash(shown) if shown.is_file() else "")
    found = [
        *_listed("Findings by rule", ("rule", "files", "fatal", "warnings"), _rule_rows(summary)),
        *_listed("By cluster", ("cluster", *VERDICTS), _verdict_rows(summary["by_cluster"])),
        *_listed("By motion", ("motion", *VERDICTS), _verdict_rows(summary["by_motion"])),
        *_findings(findings),
    ]
    followed = [*_tracking(errors, slides), *_traces(traces, slides)]
    sections = [
        Section("asked", "May the loop learn from these logs?", (*asked, _numbers(summary))),
        Section("followed", "How the robot followed", tuple(followed)),
        Section("found", "What the checks found", tuple(found)),
    ]
    title = f"Round {int(summary['round'])}: measured"
    path.write_text(render(title, f"{summary['accepted']} files accepted", "", sections), encoding="utf-8")


def _asked(summary: dict[str, Any], sha256: str) -> list[Block]:
    """Question, and how to answer exactly this."""
    if not summary["accepted"]:
        return [warning("No file can be used: there is nothing to approve.")]
    choices = text(
        "Approve, and the diagnosis corrects the simulator with the accepted files. Reject, and the round stops here. "
        "More, and it waits for more rollouts. Files that were set aside are not used either way."
    )
    if not sha256:
        return [choices]
    asked, hashed = int(summary["round"]), sha256[:SHORT]
    answers = [(verb, f"bumblebee gate {verb} {asked} --seen {hashed}{given}") for verb, given in NOTES.items()]
    return [
        choices,
        text(
            f"The answer holds for what this page shows, and for nothing else: {hashed}. On Prefect's page of the run, "
            "choose Resume at the top right (in the menu ⋮ where it is no button); or in the workspace's folder:"
        ),
        pairs(("answer", "command"), answers, "how to answer"),
        note(f"Whole commands, for any folder: bumblebee gate show {asked}. SHA-256 of summary.json: {sha256}"),
    ]


def _numbers(summary: dict[str, Any]) -> Block:
    cells = [
        ("files accepted", f"{summary['accepted']}"),
        ("files set aside", f"{summary['quarantined']}"),
        ("seconds accepted", f"{summary['seconds']:.1f}"),
        ("joints", f"{len(summary['joints'])}"),
    ]
    return pairs(("", ""), cells, "what came")


def _rule_rows(summary: dict[str, Any]) -> Iterator[tuple[Any, ...]]:
    for rule, counts in summary["by_rule"].items():
        yield rule, counts["files"], counts["fatal"], counts["warning"]


def _verdict_rows(counts: dict[str, dict[str, int]]) -> Iterator[tuple[Any, ...]]:
    """Those with files set aside first."""
    for name, verdict in sorted(counts.items(), key=lambda pair: -pair[1]["quarantined"]):
        yield name, verdict["accepted"], verdict["quarantined"]


def _listed(title: str, header: Sequence[str], rows: Iterable[tuple[Any, ...]]) -> list[Block]:
    every: list[list[str | Cell]] = [[str(value) for value in row] for row in rows]
    return [heading(title), *_shown(header, every, ROWS_SHOWN, "summary.json", title)]


def _shown(
    header: Sequence[str], rows: Sequence[Sequence[str | Cell]], most: int, file: str, title: str
) -> list[Block]:
    """The first rows, and how many more are in a file."""
    if not rows:
        return [text("None.")]
    more = f"{len(rows) - most} more in {file}." if len(rows) > most else ""
    return [table(header, rows[:most], more, title)]


def _findings(findings: pd.DataFrame) -> list[Block]:
    ordered = findings.sort_values("fatal", ascending=False, kind="stable") if len(findings) else findings
    rows: list[list[str | Cell]] = [
        [Cell("fatal", mark="missed") if record["fatal"] else "warning", str(record["message"])]
        for record in ordered.to_dict("records")
    ]
    title = "Every finding"
    return [heading(title), *_shown(("", "finding"), rows, FINDINGS_SHOWN, "findings.csv", title)]


def _tracking(errors: dict[str, float], slides: frozenset[str]) -> list[Block]:
    if not errors:
        return [text("No rollout holds position targets.")]
    pictures = [image(data_uri(plots.bars(own, unit)), what) for what, unit, own in plots.by_unit(errors, slides)]
    return [text("Root mean square of target minus position, over all accepted files."), *pictures]


def _traces(traces: list[Trace], slides: frozenset[str]) -> list[Block]:
    if not traces:
        return []
    more = f" {len(traces) - MOTIONS_SHOWN} more motions follow better." if len(traces) > MOTIONS_SHOWN else ""
    return [
        heading("Command (grey) and measurement (orange)"),
        note(f"Of each motion's first file the joint that follows worst, and its root mean square error.{more}"),
        *(_trace(trace, trace.joint in slides) for trace in traces[:MOTIONS_SHOWN]),
    ]


def _trace(trace: Trace, slide: bool) -> Block:
    error = f"{plots.rounded(1000 * trace.error)} {'mm' if slide else 'mrad'}"
    return image(data_uri(plots.plot(trace, slide, headed=False)), trace.motion, f"{trace.joint}, {error}")
