"""The whole of params.yaml: the loop's shape, and every section; `python -m tasks.sections` checks it at once."""

import hashlib
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any

from bumblebee.errors import BadInput
from bumblebee.io.read import read_bytes
from bumblebee.last_line import guarded
from bumblebee.ranges import Few, Name, Range, Ranged, Size, shown
from tasks.running import paths
from tasks.settings import params

CHECKED = paths.SCRATCH / "params.checked"
LONGEST = 64  # signs of a cluster's name, which names folders and models


@dataclass(frozen=True)
class Round(Ranged):
    """One turn of the loop."""

    n: Few
    """Its number, from 1."""
    parent: Annotated[int, Range(least=0, most=1000)]
    """The round whose experts act on the robot in it; 0 are the experts fine-tuned from base."""


@dataclass(frozen=True)
class Loop(Ranged):
    """The loop's shape: the keys of params.yaml that belong to no stage."""

    clusters: Annotated[tuple[Name, ...], Size(0)]
    """Names of the clusters, slowest motions first; their number is K."""
    rounds: Annotated[tuple[Round, ...], Size(0)]
    """The rounds, each after its parent; may be empty."""
    final_round: Annotated[int, Range(least=0, most=1000)]
    """The round whose experts are distilled, evaluated and published."""


def loop(path: Path = params.FILE) -> Loop:
    """The loop's shape, consistent in itself.

    Raises:
        BadInput: naming the key that does not fit.
    """
    return shape_of(params.read(path), path)


def shape_of(content: dict[str, Any], path: Path) -> Loop:
    """Shape of the loop from the content of the file."""
    shape = params.build(Loop, {key: content[key] for key in params.LOOP if key in content}, path, "")
    if not shape.clusters or len({name.casefold() for name in shape.clusters}) < len(shape.clusters):
        raise BadInput(f"{path}: clusters", "distinct names, at least one", shown(list(shape.clusters)))
    for name in shape.clusters:
        if not name.replace("_", "").isalnum() or len(name) > LONGEST:
            raise BadInput(f"{path}: clusters", f"names of at most {LONGEST} letters, digits and _", shown(name))
    for index, item in enumerate(shape.rounds):
        if item.n != index + 1 or item.parent != index:
            expected = f"n: {index + 1}, parent: {index} (each round follows the one before)"
            raise BadInput(f"{path}: rounds[{index}]", expected, f"n: {item.n}, parent: {item.parent}")
    if not 0 <= shape.final_round <= len(shape.rounds):
        known = f"0 to {len(shape.rounds)}, the rounds there are"
        raise BadInput(f"{path}: final_round", known, str(shape.final_round))
    return shape


def parent_of(round: int) -> int:
    """The round whose experts run on the robot in this one, and are refined after it."""
    listed = params.read().get("rounds", [])
    for entry in listed:
        if isinstance(entry, dict) and entry.get("n") == round and "parent" in entry:
            return int(entry["parent"])
    raise BadInput(f"{params.FILE}: rounds", f"an entry with n: {round} and its parent", str(listed))


def check(path: Path = params.FILE) -> dict[str, Any]:
    """Every section as its dataclass, and the loop's shape under ""; what they name is there.

    Raises:
        BadInput: for the first thing in the file that is wrong.
    """
    return check_content(params.read(path), path)


def check_content(content: dict[str, Any], path: Path) -> dict[str, Any]:
    """Check the content of the file."""
    params.check_names(content, path)
    found: dict[str, Any] = {"": shape_of(content, path)}
    for section, place in params.SECTIONS.items():
        module, _, name = place.partition(":")
        found[section] = params.section_of(content, section, getattr(import_module(module), name), path)
    import_module("tasks.settings.sources").check_sources(found, path)
    return found


def check_once(path: Path = params.FILE) -> None:
    """`check` of a file that has changed since it was checked last: a slip in the last section stops the first stage.

    Checking imports what all stages import, which takes seconds; a stage reads and checks its own section in any case.

    Raises:
        BadInput: see `check`.
    """
    if not path.exists():
        return  # a stage that reads it says so
    if not CHECKED.is_file() or CHECKED.read_text(errors="replace") != _digest(path):
        main(path)


def _digest(path: Path) -> str:
    return hashlib.sha256(read_bytes(path)).hexdigest()


def main(path: Path = params.FILE) -> None:
    """Check the params.yaml of this folder, and note that it was: the first stage need not check it again."""
    digest = _digest(path)
    check(path)
    CHECKED.parent.mkdir(exist_ok=True)
    CHECKED.write_text(digest)


if __name__ == "__main__":
    raise SystemExit(guarded(main))
