"""Who imports whom, read from the source files and without running them."""

import ast
from collections.abc import Iterator
from pathlib import Path

PACKAGES = ("bumblebee", "tasks", "flows")
Graph = dict[str, set[str]]


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
    return {name: set(_imported(path, home, known, late)) - {name} for name, path in known.items()}


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


def _imported(path: Path, home: Path, known: dict[str, Path], late: bool) -> Iterator[str]:
    package = path.relative_to(home).with_suffix("").parts[:-1]
    for node in _statements(ast.parse(path.read_text()), late):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in known)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else ()
            module = ".".join([*base, *([node.module] if node.module else [])])
            named = (f"{module}.{alias.name}" for alias in node.names)
            yield from (name if name in known else module for name in named if name in known or module in known)


def _statements(node: ast.AST, late: bool) -> Iterator[ast.AST]:
    """The statements that run when the module is imported; with `late` all."""
    for child in ast.iter_child_nodes(node):
        function = isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda)
        types_only = isinstance(child, ast.If) and "TYPE_CHECKING" in ast.unparse(child.test)
        if late or not (function or types_only):
            yield child
            yield from _statements(child, late)
