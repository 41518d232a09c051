"""Every remedy that an import prints is carried out to the letter, and the import then succeeds."""

import ast
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

import bumblebee.measured
from tests.measured.importers.remedies import arrays, motors, recordings, tables
from tests.measured.importers.remedies.walk import recorded, walk

pytest.importorskip("mcap_ros2")
pytest.importorskip("h5py")

CASES = {case.name: case for case in (*tables.CASES, *motors.CASES, *arrays.CASES, *recordings.CASES)}
HOME = Path(bumblebee.measured.__file__).parent
SOURCES = (*sorted((HOME / "importers").rglob("*.py")), HOME / "tables.py", HOME / "csv_faults.py")
NOT_WALKED = {"extras.py"}
"""Remedies of another test, `tests/test_install_lines.py`: they install the optional libraries."""


@cache
def walked(name: str) -> frozenset[tuple[str, int]]:
    """Places in the code that made the case's refusal; the case has been walked to its end."""
    sites: set[tuple[str, int]] = set()
    with TemporaryDirectory() as folder, recorded(sites):
        line, ids = walk(CASES[name], Path(folder))
    assert ids and "\n" not in line
    return frozenset(sites)


@pytest.mark.parametrize("name", list(CASES))
def test_the_remedy_that_is_printed_works(name: str) -> None:
    walked(name)


def test_every_remedy_in_the_importers_code_is_walked() -> None:
    seen = set().union(*map(walked, CASES))
    missing = []
    for path in (path for path in SOURCES if path.name not in NOT_WALKED):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "BadInput" and len(node.args) > 3:
                lines = range(node.lineno, (node.end_lineno or node.lineno) + 1)
                if not any((str(path), line) in seen for line in lines):
                    missing.append(f"{path.name}:{node.lineno}: {ast.unparse(node.args[3])[:80]}")
    assert not missing
