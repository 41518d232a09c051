"""Who imports whom, read from the source files and without running them."""

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path

PACKAGES = ("bumblebee", "tasks", "flows")
Graph = dict[str, set[str]]
# What a room of `bumblebee` may import beside itself; a floor is a set of rooms that do not know each other.
FLOORS = [
    {"robot"},
    {"effects", "new_robot"},
    {"motion", "sim", "measured"},
    {"clustering", "tracking", "diagnosis"},
    {"learning", "evaluation", "compensation"},
    {"policy"},
    {"stand_in"},
    {"report", "wire", "peers"},
    {"api", "view"},
    {"commands"},
]


@dataclass(frozen=True)
class Import:
    """An import statement: `import names` where `module` is None, else `from module import names`."""

    line: int
    module: str | None
    names: tuple[str, ...]
    late: bool
    """Whether it runs later than the module's own import: inside a function, or for type checkers only."""

    @property
    def full(self) -> tuple[str, ...]:
        """Full names of what is imported."""
        return self.names if self.module is None else tuple(f"{self.module}.{name}" for name in self.names)


@dataclass(frozen=True)
class Source:
    """Facts that the tests ask of a file of code."""

    imports: tuple[Import, ...]
    started: tuple[str, ...]
    """Texts that stand after "-m" in a list: modules that are a process of their own."""


def source(path: Path, home: Path) -> Source:
    """Facts of a file below `home`: what it imports and starts; each state of a file is parsed once."""
    return _parsed(path, home, path.stat().st_mtime_ns)


@cache
def _parsed(path: Path, home: Path, changed: int) -> Source:
    tree, package = ast.parse(path.read_text()), path.relative_to(home).with_suffix("").parts[:-1]
    imports = []
    for node, late in _statements(tree, False):
        names = tuple(alias.name for alias in node.names)
        module = None
        if isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else ()
            module = ".".join([*base, *([node.module] if node.module else [])])
        imports.append(Import(node.lineno, module, names, late))
    return Source(tuple(imports), tuple(_started(tree)))


def modules(home: Path) -> dict[str, Path]:
    """Every module of the packages: full name -> path."""
    found = {}
    for package in PACKAGES:
        for path in sorted((home / package).rglob("*.py")):
            parts = path.relative_to(home).with_suffix("").parts
            found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def graph(home: Path, late: bool) -> Graph:
    """The modules that each module imports itself; `late`: inside functions and for type checkers too.

    `from package import name` is an import of `package.name` where that is a module, else of the package's face.
    """
    known = modules(home)
    return {name: {module for module, _ in _imported(path, home, known, late)} - {name} for name, path in known.items()}


def call_graph(home: Path) -> Graph:
    """The modules that each module may call: those it imports, late ones too, and those it starts with `python -m`.

    A name that comes through a face counts as imported from where the face has it: the rest of the room is not called.
    """
    known = modules(home)
    faces = {name: _offered(path, home, known) for name, path in known.items() if path.name == "__init__.py"}
    found = {}
    for name, path in known.items():
        called = {faces.get(module, {}).get(item, module) for module, item in _imported(path, home, known, late=True)}
        found[name] = (called | {text for text in source(path, home).started if text in known}) - {name}
    return found


def circles(of: Graph) -> list[list[str]]:
    """The groups of modules each of which imports, over whatever modules, each other one; those of two and more."""
    reach = {name: reached(of, name) for name in of}
    groups = {tuple(sorted({name, *(other for other in reach[name] if name in reach[other])})) for name in of}
    return sorted(list(group) for group in groups if len(group) > 1)


def reached(of: Graph, start: str) -> set[str]:
    """All modules that a module imports, its imports' imports too; without itself unless they lead back to it."""
    seen: set[str] = set()
    waiting = [*of[start]]
    while waiting:
        name = waiting.pop()
        if name not in seen:
            seen.add(name)
            waiting += of[name]
    return seen


def _imported(path: Path, home: Path, known: dict[str, Path], late: bool) -> Iterator[tuple[str, str]]:
    """(module of ours, the name that is taken from it or ""), for each import."""
    for one in source(path, home).imports:
        if one.late and not late:
            continue
        for name, full in zip(one.names, one.full, strict=True):
            if full in known:
                yield full, ""
            elif one.module in known:
                yield one.module, name


def _offered(path: Path, home: Path, known: dict[str, Path]) -> dict[str, str]:
    """Name -> module that a face has it from."""
    return {name: module for module, name in _imported(path, home, known, late=False) if name}


def _started(tree: ast.AST) -> Iterator[str]:
    for node in ast.walk(tree):
        texts = [getattr(item, "value", None) for item in node.elts] if isinstance(node, ast.List) else []
        yield from (text for before, text in pairwise(texts) if before == "-m" and isinstance(text, str))


def _statements(node: ast.AST, late: bool) -> Iterator[tuple[ast.Import | ast.ImportFrom, bool]]:
    """The imports below a node, each with whether it runs later than the module's own import."""
    for child in ast.iter_child_nodes(node):
        function = isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda)
        types_only = isinstance(child, ast.If) and "TYPE_CHECKING" in ast.unparse(child.test)
        if isinstance(child, ast.Import | ast.ImportFrom):
            yield child, late
        yield from _statements(child, late or function or types_only)
