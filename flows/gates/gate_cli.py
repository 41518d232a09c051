"""`bumblebee gate list|show|approve|reject|more`: the gates of a workspace from any terminal, under one's own login.

`bumblebee/commands/table.py` names it as text, since the library imports nothing of flows.
"""

import re
from pathlib import Path
from typing import Annotated, Any

import typer

HELP = "Answer what the loop asks people: may it learn from a round's logs, may a version become champion?"
app = typer.Typer(help=HELP, no_args_is_help=True, add_completion=False)

Workspace = Annotated[Path, typer.Option("--workspace", help="Folder with params.yaml; by default this one.")]
What = Annotated[str, typer.Argument(help="The number of a round, or a model's name for its promotion.")]
Seen = Annotated[str, typer.Option("--seen", help="The hash that `show` printed: the answer holds for nothing else.")]
Note = Annotated[str, typer.Option("--note", help="Why.")]
By = Annotated[str, typer.Option("--by", help="Your name, beside your login; by default the login.")]
Change = Annotated[bool, typer.Option("--change", help="Replace an answer that stands; it stays in the history.")]


@app.command("list")
def list_gates(workspace: Workspace = Path()) -> None:
    """Every round and every proposed version: what stands, who answered, and whether the record is whole."""
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    from tasks.approvals import gate, ledger, words
    from tasks.approvals.promotion import answer as promotion_answer
    from tasks.approvals.promotion.gate import questions
    from tasks.gate import asked

    folder = folder_of(workspace)
    grid = Table("what", "hash", "what came", "answer")
    for path in sorted((folder / "data" / "measured").glob("r*/summary.json"), key=lambda path: _number(path)):
        table = asked(gate.Gate(folder, _number(path)))
        seen = table["seen"]
        came = f"{seen['accepted']} files, {seen['quarantined']} set aside"
        grid.add_row(str(table["round"]), words.short(table), came, escape(words.said(table)))
    for place in questions(folder):
        table = promotion_answer.asked(place)
        grid.add_row(place.model, words.short(table), escape(words.what(table)), escape(words.said(table)))
    Console().print(grid if grid.row_count else "no round has come in")
    record = folder / "data" / "approvals"
    so_far = "" if ledger.end_known(record) else ", as far as they go: none was given here yet"
    print(f"answers in the record: {len(ledger.check(record))}, unchanged since{so_far}")


@app.command()
def show(what: What, workspace: Workspace = Path()) -> None:
    """Print what came in a round, or what a version can; where its plots are, and the commands that answer."""
    from tasks import gate as rounds
    from tasks.approvals import gate
    from tasks.approvals.promotion import answer as promotion_answer

    place = _place(what, workspace)
    if isinstance(place, gate.Gate):
        rounds.show(rounds.asked(place), place)
    else:
        promotion_answer.show(promotion_answer.asked(place), place)


@app.command()
def approve(
    what: What,
    seen: Seen = "",
    by: By = "",
    note: Note = "",
    change: Change = False,
    workspace: Workspace = Path(),
) -> None:
    """Let the round go on, or the version become champion."""
    _answer("approve", what, seen, by, note, change, workspace)


@app.command()
def reject(
    what: What,
    seen: Seen = "",
    by: By = "",
    note: Note = "",
    change: Change = False,
    workspace: Workspace = Path(),
) -> None:
    """Stop the round, or leave the champion as it is; say why."""
    from bumblebee.errors import BadInput

    if not note.strip():
        raise BadInput("--note", "why it is rejected", "nothing", "Say what is wrong with it.")
    _answer("reject", what, seen, by, note, change, workspace)


@app.command()
def more(
    what: What,
    seen: Seen = "",
    by: By = "",
    note: Note = "",
    change: Change = False,
    workspace: Workspace = Path(),
) -> None:
    """Ask for more before anybody judges: rollouts of a round, trials of a version; --note says which."""
    _answer("more", what, seen, by, note, change, workspace)


def _answer(verb: str, what: str, seen: str, by: str, note: str, change: bool, workspace: Path) -> None:
    from flows.gates.gate_answer import given
    from tasks.approvals import gate
    from tasks.approvals.promotion import answer as promotion_answer

    who = gate.unix_user(by)
    author = who if by else gate.Author(str(who.known_by["user"]), who.known_by)
    place = _place(what, workspace)
    answer = given if isinstance(place, gate.Gate) else promotion_answer.given
    answer(place, verb, author, seen, note, change)


def _place(what: str, workspace: Path) -> Any:
    """A round's gate, or a model's promotion."""
    from bumblebee.errors import BadInput
    from tasks.approvals import gate
    from tasks.approvals.promotion.gate import Promotion

    folder = folder_of(workspace)
    if re.fullmatch(r"[1-9][0-9]{0,8}", what):
        return gate.Gate(folder, int(what))
    if not re.fullmatch(r"[a-z][a-z0-9_-]{0,99}", what, re.IGNORECASE):
        raise BadInput("what is answered", "the number of a round, or a model's name", repr(what))
    return Promotion(folder, what)


def folder_of(workspace: Path) -> Path:
    """The workspace, by its whole path."""
    from bumblebee.errors import BadInput

    folder = workspace.resolve()
    if not (folder / "params.yaml").is_file():
        raise BadInput(folder, "a workspace, with params.yaml", "none", "Give --workspace PATH.")
    return folder


def _number(path: Path) -> int:
    return int(path.parent.name.removeprefix("r"))
