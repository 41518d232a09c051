"""Tests that `make test` leaves to `make test-all` are listed here; all others run in both."""

import ast
import tomllib
from pathlib import Path

HOME = Path(__file__).parent.parent
ALL_SLOW: set[str] = set()
"""Files of which nothing runs in `make test`."""


def marked(node: ast.expr) -> bool:
    return ast.unparse(node).startswith("pytest.mark.slow")


def unmarked_tests(path: Path) -> list[str]:
    """Tests of a file that run without being asked for; one with slow cases beside others counts."""
    tree = ast.parse(path.read_text())
    marks = [n.value for n in tree.body if isinstance(n, ast.Assign) and ast.unparse(n.targets[0]) == "pytestmark"]
    if any("mark.slow" in ast.unparse(mark) for mark in marks):
        return []
    functions = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    return [f.name for f in functions if f.name.startswith("test_") and not any(map(marked, f.decorator_list))]


def test_every_file_of_tests_runs_in_make_test_but_for_those_listed():
    files = {str(path.relative_to(HOME)): path for path in (HOME / "tests").rglob("test_*.py")}
    assert {name for name, path in files.items() if not unmarked_tests(path)} == ALL_SLOW


def test_the_marker_is_seen(tmp_path: Path):
    path = tmp_path / "test_x.py"
    path.write_text("@pytest.mark.slow\ndef test_a(): pass\n\n@pytest.mark.parametrize('b', [])\ndef test_b(b): pass\n")
    assert unmarked_tests(path) == ["test_b"]
    path.write_text("pytestmark = [pytest.mark.slow]\ndef test_a(): pass\n")
    assert unmarked_tests(path) == []


def test_only_make_test_leaves_the_slow_ones_out_and_the_nightly_job_runs_all():
    options = tomllib.loads((HOME / "pyproject.toml").read_text())["tool"]["pytest"]["ini_options"]
    assert " -m" not in options["addopts"] and "--ignore" not in options["addopts"]
    lines = (HOME / "Makefile").read_text().splitlines()
    recipe = {line.partition(":")[0]: lines[k + 1] for k, line in enumerate(lines) if line.startswith("test")}
    assert recipe == {"test": '\t$(TESTS) -m "not slow"', "test-all": "\t$(TESTS)"}
    (tests,) = (line for line in lines if line.startswith("TESTS "))
    assert " -m pytest -q -n " in tests and not {"-k", "--ignore", "--deselect"} & set(tests.split())
    assert "make test-all" in (HOME / ".github" / "workflows" / "nightly.yml").read_text()
