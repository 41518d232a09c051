"""Measured figures of README: one run of the demo, kept in docs/figures.json, from which README's block is written.

python -m benchmarks.readme_figures                   # runs the demo in runs/figures, then writes both files
python -m benchmarks.readme_figures --workspace .     # takes what a finished demo left; without its wall time
"""

import argparse
import contextlib
import json
import os
import re
import subprocess
import sys
import time
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from bumblebee.errors import BadInput
from bumblebee.last_line import guarded
from bumblebee.report.held_out import error_line
from bumblebee.report.names import label, reference
from bumblebee.report.results import LoopResults
from bumblebee.report.sections.opening import effect_rows
from bumblebee.report.sections.success_steps import step_differences, success_steps
from bumblebee.report.truth import hits
from bumblebee.report.wording import percent
from flows import workspace as workspaces
from tasks.report import collect
from tasks.running import paths
from tasks.sections import loop

NAME = "figures"
FILE, README = workspaces.HOME / "docs" / "figures.json", workspaces.HOME / "README.md"
BEGIN, END = "<!-- figures: `make figures` writes this block from docs/figures.json -->\n", "<!-- end of figures -->\n"
SHOWN = ("refined against before", "refined against control: declared model")
"""Beginnings of the paired differences that README has; the report has all."""

Json = dict[str, Any]


def main(argv: list[str] | None = None) -> int:
    """Measure, write both files; 0 when done, the demo's status otherwise."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.readme_figures", description=__doc__)
    parser.add_argument("--workspace", type=Path, help="a finished demo; by default one is run in runs/figures")
    return guarded(lambda: written(parser.parse_args(argv).workspace))


def written(workspace: Path | None) -> int:
    """Write docs/figures.json and README's block.

    Raises:
        BadInput: if runs/figures holds an earlier run, or the workspace no finished demo with a sealed robot.
    """
    minutes = None
    if workspace is None:
        workspace = workspaces.HOME / "runs" / NAME
        if workspace.exists():
            raise BadInput(workspace, "no earlier run, which would be gone on with", "one", f"rm -r {workspace}")
        began = time.monotonic()
        command = [sys.executable, "-m", "flows.demo", "--name", NAME]
        if status := subprocess.run(command, cwd=workspaces.HOME, check=False).returncode:
            return status
        minutes = round((time.monotonic() - began) / 60, 1)
    found = measured(workspace, minutes)
    FILE.write_text(json.dumps(found, indent=1, ensure_ascii=False) + "\n")
    README.write_text(with_block(README.read_text(), block(found)))
    print(f"written: {FILE.relative_to(workspaces.HOME)}, README.md")
    return 0


def measured(workspace: Path, minutes: float | None) -> Json:
    """Figures of a finished demo, as values and words with their intervals.

    Args:
        workspace: folder of the demo.
        minutes: wall time of the whole demo [min]; None where it was not measured.
    """
    if not (workspace / paths.REPORT).exists():
        raise BadInput(workspace, "a finished demo", f"no {paths.REPORT}", "make demo")
    with contextlib.chdir(workspace):
        results = collect(loop())
    if results.sealed is None or not results.rounds:
        raise BadInput(workspace, "a round with the sealed stand-in robot", "none", "make demo")
    return {
        "commit": code_of((workspace / paths.REPORT).read_text()),
        "date": datetime.now(UTC).date().isoformat(),
        "minutes": minutes,
        "processors": os.cpu_count(),
        "motions": len(results.contract["motions"]),
        **_round(results),
    }


def code_of(page: str) -> str:
    """The commit that a report says it was made with."""
    said = re.search(r"code ([0-9a-f]{7,40}(?:-dirty)?|unknown)", page)
    return said[1] if said else "unknown"


def _round(results: LoopResults) -> Json:
    turn, sealed = results.rounds[-1], results.sealed or {}
    found, undeclared, false = hits(sealed["effects"], turn.diagnosis["effects"])
    steps = success_steps(results.evaluation, turn, label(results, reference(results.evaluation)))
    return {
        "undeclared": undeclared,
        "found": found,
        "not_there": false,
        "effects": [list(row[:2]) for row in effect_rows(results, turn)],
        "error": error_line(turn),
        "success": [[step.called, step.note, percent(step.robot)] for step in steps if step.robot],
        "differences": step_differences(results.evaluation, turn),
    }


def block(found: Json) -> str:
    """README's text of these figures."""
    took = f", {found['minutes']:.0f} minutes on {found['processors']} processors" if found["minutes"] else ""
    head = f"`make demo` at {found['commit']}, {found['date']}{took}"
    lines = [
        f"{head}. {found['found']} of {found['undeclared']} undeclared effects found, "
        f"{found['not_there']} named that are not there. {found['error']}",
        "",
        "| undeclared | found |",
        "|---|---|",
        *(f"| {sealed} | {came} |" for sealed, came in found["effects"]),
        "",
        f"| policy on the robot, {found['motions']} motions | | followed to the end [95 %] |",
        "|---|---|---|",
        *(f"| {called} | {note} | {rate} |" for called, note, rate in found["success"]),
        "",
        *(f"- {line}" for line in found["differences"] if line.startswith(SHOWN)),
    ]
    return "\n".join(lines) + "\n"


def with_block(page: str, new: str) -> str:
    """The page with the text between its two marks replaced.

    Raises:
        BadInput: if the page does not hold both marks once.
    """
    if page.count(BEGIN) != 1 or page.count(END) != 1:
        raise BadInput(README, "the two marks of the figures once each", "another number", f"Add: {BEGIN.strip()}")
    before, rest = page.split(BEGIN)
    return before + BEGIN + new + END + rest.split(END)[1]


if __name__ == "__main__":
    raise SystemExit(main())
