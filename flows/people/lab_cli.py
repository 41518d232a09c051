"""`bumblebee lab user add|remove|list`: the people who may use this workspace's servers from elsewhere.

`bumblebee/commands/table.py` names it as text; `python -m flows.people.lab_cli` is the same.
"""

from pathlib import Path
from typing import Annotated

import typer

from bumblebee.last_line import guarded
from flows.environment import SERVERS
from flows.gates.gate_cli import folder_of
from flows.people import accounts as people
from tasks.lab.serve import read_serve

app = typer.Typer(help="A lab's people.", no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False)
user = typer.Typer(help="Personal logins to both servers, for people from elsewhere.", no_args_is_help=True)
app.add_typer(user, name="user")

Workspace = Annotated[Path, typer.Option("--workspace", help="Folder whose servers are meant; by default this one.")]
Name = Annotated[str, typer.Argument(help="Small letters; the person's unix login, where there is one.")]
Groups = Annotated[list[str], typer.Option("--group", help="A group of gate.group, serve.write or serve.promote.")]


@user.command()
def add(name: Name, group: Groups = [], workspace: Workspace = Path()) -> None:  # noqa: B006  (typer copies it)
    """Let somebody in; their password is printed once, and kept as a salted hash only."""
    print(people.add(_folder(workspace), name, tuple(group)))


@user.command()
def remove(name: Name, workspace: Workspace = Path()) -> None:
    """Let somebody in no more, from now on."""
    people.remove(_folder(workspace), name)
    print(f"{name} can no longer log in")


@user.command("list")
def everybody(workspace: Workspace = Path()) -> None:
    """Everybody who may get in, and what their groups let them do."""
    folder = workspace.resolve()
    own = read_serve(folder)
    for one in people.read(_folder(workspace)).values():
        may = [what for what in ("write", "promote") if own is not None and getattr(own, what) in one.groups]
        print(f"{one.name}  groups: {', '.join(one.groups) or 'none'}  may: {', '.join(['read', *may])}")


def _folder(workspace: Path) -> Path:
    return folder_of(workspace) / SERVERS


if __name__ == "__main__":
    raise SystemExit(guarded(lambda: app(standalone_mode=False) or 0))
