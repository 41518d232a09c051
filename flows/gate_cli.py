"""`bumblebee gate list|show|approve|reject|more`: the gates of a workspace from any terminal, under one's own login.

The library's command line finds it as a plug-in (entry point `bumblebee.commands`), since it knows nothing of flows.
"""

from pathlib import Path
from typing import Annotated

import typer

app = typer.Typer(help="Answer what the loop asks people: may it learn from a round's logs?", no_args_is_help=True)

Workspace = Annotated[Path, typer.Option("--workspace", help="Folder with params.yaml; by default this one.")]
Round = Annotated[int, typer.Argument(min=1, help="The round that is meant.")]
Seen = Annotated[str, typer.Option("--seen", help="The hash that `show` printed: the answer holds for nothing else.")]
Note = Annotated[str, typer.Option("--note", help="Why.")]
By = Annotated[str, typer.Option("--by", help="Your name, beside your login; by default the login.")]
Change = Annotated[bool, typer.Option("--change", help="Replace an answer that stands; it stays in the history.")]


@app.command("list")
def list_gates(workspace: Workspace = Path()) -> None:
    """Every round that has come in: what stands, who answered, and whether the record of all answers is whole."""
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    from bumblebee.measured import gate, gate_record
    from bumblebee.measured import gate_words as words
    from tasks.gate import asked

    folder = _folder(workspace)
    grid = Table("round", "hash", "what came", "answer")
    for path in sorted((folder / "data" / "measured").glob("r*/summary.json"), key=lambda path: _number(path)):
        table = asked(gate.Gate(folder, _number(path)))
        seen = table["seen"]
        came = f"{seen['accepted']} files, {seen['quarantined']} set aside"
        grid.add_row(str(table["round"]), words.short(table), came, escape(words.said(table)))
    Console().print(grid if grid.row_count else "no round has come in")
    print(f"answers in the record: {len(gate_record.check(folder / 'data' / 'approvals'))}, unchanged since")


@app.command()
def show(round: Round, workspace: Workspace = Path()) -> None:
    """What came in a round, where its plots are, and the commands that answer."""
    from bumblebee.measured import gate
    from tasks.gate import asked
    from tasks.gate import show as shown

    place = gate.Gate(_folder(workspace), round)
    shown(asked(place), place)


@app.command()
def approve(
    round: Round,
    seen: Seen = "",
    by: By = "",
    note: Note = "",
    change: Change = False,
    workspace: Workspace = Path(),
) -> None:
    """Let the round go on."""
    _answer("approve", round, seen, by, note, change, workspace)


@app.command()
def reject(
    round: Round,
    seen: Seen = "",
    by: By = "",
    note: Note = "",
    change: Change = False,
    workspace: Workspace = Path(),
) -> None:
    """Stop the round; say why."""
    from bumblebee.errors import BadInput

    if not note.strip():
        raise BadInput("--note", "why the round is rejected", "nothing", "Say what is wrong with its logs.")
    _answer("reject", round, seen, by, note, change, workspace)


@app.command()
def more(
    round: Round,
    seen: Seen = "",
    by: By = "",
    note: Note = "",
    change: Change = False,
    workspace: Workspace = Path(),
) -> None:
    """Ask for more rollouts before anybody judges the round; --note says which."""
    _answer("more", round, seen, by, note, change, workspace)


def _answer(verb: str, round: int, seen: str, by: str, note: str, change: bool, workspace: Path) -> None:
    from bumblebee.measured import gate
    from flows.gate_answer import given

    who = gate.unix_user(by)
    author = who if by else gate.Author(str(who.known_by["user"]), who.known_by)
    given(gate.Gate(_folder(workspace), round), verb, author, seen, note, change)


def _folder(workspace: Path) -> Path:
    from bumblebee.errors import BadInput

    folder = workspace.resolve()
    if not (folder / "params.yaml").is_file():
        raise BadInput(folder, "a workspace, with params.yaml", "none", "Give --workspace PATH.")
    return folder


def _number(path: Path) -> int:
    return int(path.parent.name.removeprefix("r"))
