"""Page of a gate on Prefect, as Markdown: everything needed to judge, and which button answers.

Prefect renders tables, links and pictures that lie in the text itself (data URIs); nothing is loaded from elsewhere.
"""

import csv
import io
import re
from collections.abc import Iterable
from html import escape
from typing import Any

from bumblebee.errors import BadInput
from bumblebee.io.read import read_json, read_text
from bumblebee.measured import overview_plots
from bumblebee.measured.rollout import read_rollout, rollout_files
from tasks.approvals import gate, words

BUTTON = "Resume at the top right (in the menu ⋮ where it is no button)"
ROWS, PLOTS, BAR = 40, 12, 20  # rows of a table, pictures on the page, blocks of the longest bar
SPECIAL = re.compile(r"([\\`*_{}\[\]()#+!|~>:.@-])")  # with `:`, `.` and `@`: no address becomes a link by itself


def where_to_answer(round: int, url: str | None) -> str:
    """The log line of a run that is about to be suspended."""
    page = f"open {url} and " if url else ""
    return f"round {round} waits for an answer: {page}choose {BUTTON} of the run's page"


def question(request: dict[str, Any], artifact: str) -> str:
    """Text of the dialog above its fields: short, with a link to the page."""
    seen = request["seen"]
    rules = ", ".join(f"{cell(rule)} ({counts['files']})" for rule, counts in list(seen["findings"].items())[:8])
    return (
        f"**Round {request['round']}: may the loop learn from these logs?** {seen['accepted']} files accepted "
        f"({seen['seconds']:.1f} s), {seen['quarantined']} set aside. "
        f"{f'Findings (files): {rules}' if rules else 'No findings'}. Hash `{words.short(request)}`: the answer holds "
        f"for nothing else.\n\n[Look at the tables and plots first](../../artifacts/artifact/{artifact})"
    )


def asked_of(rule: gate.GateConfig, personal: bool = False) -> str:
    """A sentence for the dialog where not everybody's button answers.

    Args:
        rule: who must answer.
        personal: whether people have logins of their own; of whoever uses the workspace's own nothing is known.
    """
    if rule.people == 1 and not rule.group:
        return ""
    who = f"{rule.people} people" if rule.people > 1 else "One person"
    of = f" of the group {cell(rule.group)}" if rule.group else ""
    where = "here with a login of their own, or by `bumblebee gate` in a terminal" if personal else ""
    return f"\n\n**{who}{of} must answer, each {where or 'by `bumblebee gate` in a terminal, not here'}.**"


def page(request: dict[str, Any], place: gate.Gate, run: str = "") -> str:
    """Everything that a person needs to judge a round; `run` is the number of the run that asks, if it can be answered.

    Links lead from one page of Prefect's to another by relative paths, which hold in both of its designs.
    """
    seen, number = request["seen"], request["round"]
    summary = read_json(place.summary, gate.SUMMARY_LIMITS)
    counts = [("files accepted", seen["accepted"]), ("files set aside", seen["quarantined"])]
    counts += [("seconds accepted", f"{seen['seconds']:.1f}"), ("joints", len(summary["joints"]))]
    rules = [(rule, n["files"], n["fatal"], n["warning"]) for rule, n in seen["findings"].items()]
    blocks = [
        f"# Round {number}: may the loop learn from these logs?",
        "Approve, and the diagnosis corrects the simulator with the accepted files; reject, and the round stops here; "
        "more, and it waits for more rollouts, which the note names.",
        *wanted(request),
        table(("what", "how many"), counts),
        f"An answer holds for `{words.short(request)}`, the hash of what stands here, and for nothing else.",
        *([f"**[To answer, open the run](../../runs/flow-run/{run})** and choose {BUTTON}."] if run else []),
        "In a terminal:",
        "```\n" + "\n".join(words.answer_command(place.workspace, request, verb) for verb in gate.ANSWERS) + "\n```",
        "## Findings",
        table(("rule", "files", "fatal", "warnings"), rules) if rules else "None.",
        *findings(place),
        "## By cluster",
        table(("cluster", "accepted", "set aside"), verdicts(summary["by_cluster"])),
        *pictures(place),
        "## By motion",
        table(("motion", "accepted", "set aside"), verdicts(summary["by_motion"])),
        f"The same page as a file: `{place.summary.with_name('overview.html')}`",
    ]
    return "\n\n".join(blocks) + "\n"


def wanted(request: dict[str, Any]) -> list[str]:
    """Who asked for more, for what, and how it goes on."""
    if request["status"] != "more":
        return []
    go_on = "Add rollouts and start a run again: changed data are asked about anew."
    return [f"**{cell(words.said(request))}.** {go_on} To answer all the same, add `--change` to a command below."]


def findings(place: gate.Gate) -> list[str]:
    """Findings in words, the fatal ones first."""
    rows = list(csv.DictReader(io.StringIO(read_text(place.summary.with_name("findings.csv"), 1 << 30))))
    rows.sort(key=lambda row: row["fatal"] != "True")
    if not rows:
        return []
    return [table(("", "finding"), [("fatal" if row["fatal"] == "True" else "", row["message"]) for row in rows])]


def pictures(place: gate.Gate) -> list[str]:
    """Tracking error by joint as tables with bars, and the worst joint of each motion as a picture."""
    folder = place.summary.parent
    try:
        slides = overview_plots.slides(folder / "model.xml")
        errors, traces = overview_plots.tracking(map(read_rollout, rollout_files(folder)))
    except BadInput as error:
        return [f"The plots cannot be drawn: {cell(str(error))}"]
    blocks = ["## Tracking error by joint", "Root mean square of target minus position."]
    for what, unit, values in overview_plots.by_unit(errors, slides):
        largest = max(values.values()) or 1.0
        rows = [(name, overview_plots.rounded(v), "█" * round(BAR * v / largest)) for name, v in values.items()]
        blocks.append(table((f"{what.lower()}", unit, " "), rows))
    if not errors:
        return [*blocks, "No rollout holds position targets."]
    blocks += [
        "## Command (grey) and measurement (orange)",
        "Of each motion's first file the joint that follows worst.",
    ]
    blocks += [picture(overview_plots.plot(trace, trace.joint in slides), trace.motion) for trace in traces[:PLOTS]]
    more = len(traces) - PLOTS
    return [*blocks, f"{more} more motions follow better: overview.html has them."] if more > 0 else blocks


def picture(svg: str, name: str) -> str:
    """An SVG that lies in the text, on white also where the page is dark."""
    sized = svg.replace("<svg ", "<svg width='720' height='300' style='background:#fff' ", 1)
    return f"![{cell(name)}]({overview_plots.data_uri(sized)})"


def verdicts(counts: dict[str, dict[str, int]]) -> list[tuple[str, int, int]]:
    """Rows of accepted and set aside, those with files set aside first."""
    rows = [(name, verdict["accepted"], verdict["quarantined"]) for name, verdict in counts.items()]
    return sorted(rows, key=lambda row: -row[2])


def table(head: Iterable[str], rows: list[tuple[Any, ...]]) -> str:
    """A Markdown table of at most `ROWS` rows."""
    names = list(head)
    lines = [f"| {' | '.join(names)} |", f"|{'---|' * len(names)}"]
    lines += [f"| {' | '.join(cell(str(value)) for value in row)} |" for row in rows[:ROWS]]
    more = f"\n\n{len(rows) - ROWS} more." if len(rows) > ROWS else ""
    return "\n".join(lines) + more


def cell(text: str) -> str:
    """Text from outside in a Markdown table: one line, no markup, no link."""
    return SPECIAL.sub(r"\\\1", escape(words.one_line(text), quote=False))
