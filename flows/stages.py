"""The stages of dvc.yaml as a graph: who needs whom, and who has something to do.

python -m flows.stages [--workspace runs/demo]     # each stage with its state, in at most 100 columns
"""

import argparse
import os
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from graphlib import TopologicalSorter
from pathlib import Path

from rich.console import Console
from rich.table import Table

from bumblebee.errors import BadInput
from bumblebee.last_line import guarded
from flows.servers.rwlock import clear_cut_off
from tasks.running import lock_file

WIDTH = 100
STALE, AFTER, LACKS, DONE = "stale", "after a stale one", "waits for", "up to date"


@dataclass(frozen=True)
class Stage:
    """One stage of the loop, after its matrix is spelled out."""

    name: str
    """As DVC calls it, such as `experts@c0`."""
    command: str
    """Command that it runs."""
    needs: frozenset[str]
    """Names of the stages whose files it reads."""
    lacks: frozenset[str]
    """Files it reads that no stage makes and that are not there (an answer not yet given)."""

    @property
    def kind(self) -> str:
        """The stage's name without cluster and round."""
        return kind_of(self.name)

    def option(self, name: str) -> str | None:
        """The value of `--name` in the command, or None."""
        words = self.command.split()
        return words[words.index(f"--{name}") + 1] if f"--{name}" in words else None

    @property
    def title(self) -> str:
        """For people: `refine round 1 c0`, `control round 1 c0 delta`."""
        number, cluster, kind = (self.option(name) for name in ("round", "cluster", "kind"))
        parts = [self.kind, f"round {number}" if number else "", cluster or "", kind or ""]
        return " ".join(part for part in parts if part)


def kind_of(name: str) -> str:
    """A stage's name without cluster and round: `experts` of `experts@c0`."""
    return name.partition("@")[0]


def read_stages(workspace: Path) -> list[Stage]:
    """All stages, each after those that it needs; among equals in the order of dvc.yaml."""
    from dvc.exceptions import DvcException
    from dvc.repo import Repo

    lock_file.read_whole()
    try:
        with Repo(str(workspace)) as repo:
            graph = repo.index.graph
            found = {}
            for node in repo.index.stages:
                needs = frozenset(_name(other.addressing, workspace) for other in graph.successors(node))
                made = {str(out.fs_path) for out in repo.index.outs}
                lacks = frozenset(
                    str(dep.def_path)
                    for dep in node.deps
                    if dep.def_path and not dep.exists and not any(_inside(str(dep.fs_path), out) for out in made)
                )
                name = _name(node.addressing, workspace)
                found[name] = Stage(name, str(node.cmd), needs, lacks)
    except DvcException as error:
        if lock_file.FILE.name in str(error):
            raise lock_file.damaged(workspace / lock_file.FILE, str(error)) from None
        raise BadInput(workspace / "dvc.yaml", "stages that DVC can read", str(error)) from None
    return in_order(found.values())


def _name(address: str, workspace: Path) -> str:
    """A stage's name, or that of the file of a set in data/raw, as seen from the workspace.

    Seen from another folder, DVC puts the path of dvc.yaml before the one and begins the other there.
    """
    name = address.rpartition(":")[2]
    return os.path.relpath(name, workspace) if name.endswith(".dvc") else name


def _inside(path: str, out: str) -> bool:
    return path == out or path.startswith(out + "/") or out.startswith(path + "/")


def in_order(stages: Iterable[Stage]) -> list[Stage]:
    """Each stage after those that it needs."""
    known = {stage.name: stage for stage in stages}
    sorter = TopologicalSorter({name: sorted(stage.needs) for name, stage in known.items()})
    return [known[name] for name in sorter.static_order()]


def to_run(stages: list[Stage], changed: set[str]) -> set[str]:
    """The stages that may have work: the changed ones and everything that reads what they make."""
    busy: set[str] = set()
    for stage in in_order(stages):
        if stage.name in changed or stage.needs & busy:
            busy.add(stage.name)
    return busy


def changed_stages(workspace: Path) -> set[str]:
    """Names of the stages whose inputs, outputs, command or parameters differ from dvc.lock."""
    from dvc.lock import LockError
    from dvc.repo import Repo

    clear_cut_off(workspace)
    try:
        with Repo(str(workspace)) as repo:
            return {_name(address, workspace) for address in repo.status()}
    except LockError as error:
        lines = [line.strip() for line in str(error).splitlines() if "PID" in line] or [str(error)]
        remedy = "Wait for it or stop it, then run again."
        raise BadInput(workspace, "no other run at work in it", lines[0], remedy) from None


def downstream(stages: list[Stage], name: str) -> set[str]:
    """Names of all stages that read, directly or not, what the stage `name` makes."""
    return to_run(stages, {name}) - {name}


def state_of(stage: Stage, changed: set[str], busy: set[str]) -> str:
    """State of a stage: nothing, run, run after another, or wait for a file that no stage makes."""
    if stage.lacks:
        return f"{LACKS} {', '.join(sorted(stage.lacks))}"
    if stage.name in changed:
        return STALE
    return AFTER if stage.name in busy else DONE


def by_level(stages: list[Stage]) -> list[list[Stage]]:
    """Stages that can run side by side, in the order in which they come up."""
    level: dict[str, int] = {}
    for stage in in_order(stages):
        level[stage.name] = 1 + max((level[name] for name in stage.needs), default=-1)
    return [[s for s in in_order(stages) if level[s.name] == n] for n in range(1 + max(level.values(), default=-1))]


def table(stages: list[Stage], changed: set[str]) -> Table:
    """A row a stage: its turn, name, state, and the stages that it reads directly from the turn before or earlier."""
    busy, titles = to_run(stages, changed), {stage.name: stage.title for stage in stages}
    shown = Table(box=None, pad_edge=False, header_style="bold")
    for heading in ("turn", "stage", "state", "after"):
        shown.add_column(heading, overflow="fold", justify="right" if heading == "turn" else "left")
    for turn, level in enumerate(by_level(stages), start=1):
        for index, stage in enumerate(level):
            reads = ", ".join(titles[name] for name in sorted(stage.needs - _indirect(stages, stage)))
            shown.add_row("" if index else str(turn), stage.title, state_of(stage, changed, busy), reads)
    return shown


def _indirect(stages: list[Stage], stage: Stage) -> set[str]:
    """Stages that a stage would read through another of those that it needs: left out of the picture."""
    return {name for name in stage.needs if stage.needs & downstream(stages, name)}


def main(argv: list[str] | None = None) -> int:
    """Print the table; returns the exit status."""
    made = argparse.ArgumentParser(prog="python -m flows.stages", description="The stages of a workspace, their state.")
    made.add_argument("--workspace", type=Path, default=Path("."), help="folder with dvc.yaml (default: this one)")
    workspace = made.parse_args(argv).workspace

    def show() -> None:
        if not (workspace / "dvc.yaml").exists():
            raise BadInput(workspace / "dvc.yaml", "a workspace's stages", "no file", "Give --workspace.")
        stages = read_stages(workspace)
        shown = table(stages, changed_stages(workspace))
        Console(width=min(WIDTH, Console().width) if sys.stdout.isatty() else WIDTH).print(shown)

    return guarded(show)


if __name__ == "__main__":
    sys.exit(main())
