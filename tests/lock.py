"""Print requirements.lock: what the requirements of pyproject.toml need, in the versions installed here.

Run by `make lock` in an environment that holds everything: `pip install -e .[loop,orchestration,develop]`.
"""

import importlib.metadata
import re
import sys
import tomllib
from pathlib import Path

from packaging.requirements import Requirement

HEAD = """\
# Every package of the loop, as resolved together. Made by `make lock`; see CONTRIBUTING.md.
# torch is named without a variant: pip takes what its index offers (README: how to get the CPU one on Linux)."""
LEFT_OUT = re.compile("^(nvidia-|cuda-|triton)")  # parts of torch's CUDA build, which pip adds where it takes that one


def normal(name: str) -> str:
    """The name as package indices compare it."""
    return re.sub(r"[-_.]+", "-", name).lower()


def closure(wanted: list[Requirement]) -> dict[str, str]:
    """Name -> version of all that `wanted` needs, directly or not."""
    found: dict[str, str] = {}
    seen: set[tuple[str, frozenset[str]]] = set()
    while wanted:
        requirement = wanted.pop()
        name, extras = normal(requirement.name), frozenset(requirement.extras)
        if (name, extras) in seen or LEFT_OUT.match(name):
            continue
        seen.add((name, extras))
        package = importlib.metadata.distribution(requirement.name)
        found[name] = package.version.partition("+")[0]
        for text in package.requires or []:
            needed = Requirement(text)
            if needed.marker is None or any(needed.marker.evaluate({"extra": extra}) for extra in ("", *extras)):
                wanted.append(needed)
    return found


def main() -> None:
    """Write the lock to standard output."""
    project = tomllib.loads(Path("pyproject.toml").read_text())["project"]
    groups = [project["dependencies"], *project["optional-dependencies"].values()]
    locked = closure([Requirement(line) for group in groups for line in group])
    sys.stdout.write("\n".join([HEAD, *(f"{name}=={locked[name]}" for name in sorted(locked))]) + "\n")


if __name__ == "__main__":
    main()
