"""The page of all settings, from the dataclasses of `tasks.settings.params.SECTIONS`, without an import of them."""

import ast
from collections.abc import Iterator
from pathlib import Path

import griffe

HOME = Path(__file__).parent.parent.parent
HEAD = """# Settings

Every key of `params.yaml`: a section is named after its stage. A key that the file leaves out has the default below.
`python -m tasks.sections` checks a whole file.
"""


def settings_page() -> str:
    """Write every section and every table that a section's keys lead to, each once."""
    loader = griffe.GriffeLoader(search_paths=[HOME], allow_inspection=False)
    for package in ("bumblebee", "tasks"):
        loader.load(package)
    loader.resolve_aliases()
    params = loader.modules_collection["tasks.settings.params"]["SECTIONS"].value
    sections = {name: place.replace(":", ".") for name, place in ast.literal_eval(str(params)).items()}
    tables = {path: f"`{name}`" for name, path in sections.items()}
    text, written = [HEAD], set()
    while waiting := [path for path in tables if path not in written]:
        written.add(waiting[0])
        found = loader.modules_collection[waiting[0]]
        found = found.final_target if isinstance(found, griffe.Alias) else found
        for path in [path for _, nested in _fields(found) for path in _tables(loader, nested)]:
            tables.setdefault(path, path.rpartition(".")[2])
        text.append(_table(tables[waiting[0]], found, loader))
    return "\n".join(text)


def _fields(kind: griffe.Class) -> Iterator[tuple[str, griffe.Attribute]]:
    """Yield the fields of a dataclass, those of its bases first."""
    members: dict[str, griffe.Attribute] = {}
    for one in [*reversed(kind.mro()), kind]:
        members |= {name: member for name, member in one.members.items() if isinstance(member, griffe.Attribute)}
    yield from ((name, member) for name, member in members.items() if member.annotation is not None)


def _tables(loader: griffe.GriffeLoader, field: griffe.Attribute) -> Iterator[str]:
    """Yield the paths of the dataclasses that a field's type names."""
    for part in [field.annotation, *field.annotation.iterate(flat=True)]:
        if isinstance(part, griffe.ExprName):
            found = loader.modules_collection.get_member(part.canonical_path) if _known(loader, part) else None
            found = found.final_target if isinstance(found, griffe.Alias) else found
            if isinstance(found, griffe.Class) and "dataclass" in found.labels and "ranges" not in found.path:
                yield found.path


def _known(loader: griffe.GriffeLoader, name: griffe.ExprName) -> bool:
    try:
        loader.modules_collection.get_member(name.canonical_path)
    except (KeyError, griffe.GriffeError):
        return False
    return True


def _table(title: str, kind: griffe.Class, loader: griffe.GriffeLoader) -> str:
    rows = [f"\n## {title}\n", _line(kind), "", "| key | default | meaning |", "|---|---|---|"]
    for name, field in _fields(kind):
        nested = [f"[{path.rpartition('.')[2]}](#{path.rpartition('.')[2].lower()})" for path in _tables(loader, field)]
        value = "needed" if field.value is None else f"`{_short(str(field.value))}`"
        meaning = " ".join(_line(field).split()).replace("|", "\\|")
        rows.append(f"| `{name}` | {value} | {' '.join([meaning, *dict.fromkeys(nested)]).strip()} |")
    return "\n".join(rows)


def _line(thing: griffe.Object) -> str:
    return thing.docstring.value if thing.docstring else ""


def _short(text: str) -> str:
    made = text.replace("field(default_factory=", "").removesuffix(")") if "default_factory" in text else text
    return " ".join(made.replace("|", "\\|").split())[:80]
