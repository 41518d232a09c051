"""The package says that it is typed, where it is installed, too; mypy itself runs in `make check`."""

import tomllib
from fnmatch import fnmatch
from pathlib import Path

ROOT = Path(__file__).parents[1]


def test_the_mark_of_a_typed_package_is_packaged() -> None:
    patterns = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["package-data"]["*"]
    marks = [file for file in (ROOT / "bumblebee").iterdir() if file.name == "py.typed"]
    assert [file.name for file in marks if any(fnmatch(file.name, one) for one in patterns)] == ["py.typed"]
