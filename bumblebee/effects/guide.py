"""The page of all effects, docs/effects.md, from what their files say.

python -m bumblebee.effects.guide > docs/effects.md
"""

import inspect
from collections.abc import Iterator
from importlib import import_module

from bumblebee.effects.catalogue import CATALOGUE
from bumblebee.effects.kind import Kind

_HEAD = """# Effects that it looks for

One file each in `bumblebee/effects`; this page is made of them. Parameters are absolute, in SI; on a slide N stands
for N m and m for rad. MJCF: the corrected `model.xml` holds it. Hook: a part of `effects.yaml` that the project's
engines and the diagnosis apply by the same code; plain MuJoCo does not know it. u, q, v, a: the joint's target,
position, velocity and acceleration. Those marked * can sit on all joints at once. The experiment tells an effect
from those that look the same."""


def page() -> str:
    """The page's text."""
    rooms: dict[str, list[Kind]] = {}
    for kind in CATALOGUE.values():
        rooms.setdefault(type(kind).__module__.split(".")[-2], []).append(kind)
    return "\n".join([_HEAD, *(line for kinds in rooms.values() for line in _room(kinds))]) + "\n"


def _room(kinds: list[Kind]) -> Iterator[str]:
    title = inspect.getdoc(import_module(type(kinds[0]).__module__.rpartition(".")[0])) or ""
    yield from ("", f"## {title.rstrip('.')}", "")
    yield from ("| effect, parameters | what it is, its law, the experiment |", "|---|---|")
    yield from map(_row, kinds)


def _row(kind: Kind) -> str:
    parts = (inspect.getdoc(inspect.getmodule(type(kind))), inspect.getdoc(type(kind)))
    what = "<br>".join(" ".join((part or "").split()) for part in parts)
    numbers = "<br>".join(f"{p.name} [{p.unit or '1'}]".replace(" ", "&nbsp;") for p in kind.parameters)
    by = {(True, False): "MJCF", (True, True): "MJCF; with " + kind.hooked + " a hook"}
    carried = by.get((kind.native, kind.hooks), "MJCF in part, hook" if kind.added else "hook")
    grows = "; nq grows" if kind.structural and kind.hooked == "encoder" else ""
    told = kind.experiment + (f"; on a fixed base: {kind.on_fixed_base}" if kind.on_fixed_base else "")
    told = f"<br>*{told[0].upper()}{told[1:]}.*" if told else ""
    return f"| `{kind.id}`{'*' * kind.whole}<br>{numbers}<br>{carried}{grows} | {what}{told} |"


if __name__ == "__main__":
    print(page(), end="")
