"""Docstrings and options' help begin with their subject, so that each can be read alone."""

import re
from pathlib import Path

HOME = Path(__file__).parent.parent
FOLDERS = ("bumblebee", "tasks", "flows", "benchmarks", "tests")
BEGINNING = re.compile(r'(^ *"""\s*|\bhelp=")(Of|The same|What)\b.*', re.MULTILINE)


def test_docstrings_and_help_begin_with_their_subject():
    found = [
        f"{path.relative_to(HOME)}: {match[0].strip()}"
        for folder in FOLDERS
        for path in (HOME / folder).rglob("*.py")
        for match in BEGINNING.finditer(path.read_text())
    ]
    assert not found
