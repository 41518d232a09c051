"""Write requirements.lock and requirements-torch.lock: what pyproject.toml needs, as installed here, with hashes.

Run by `make lock` in an environment that holds everything: `pip install -e '.[loop,orchestration,develop]'`. The hashes
are those that the index which pip is configured for states, read by pip itself; files on disk are hashed here.
"""

import hashlib
import importlib.metadata
import logging
import re
import sys
import tomllib
from collections.abc import Iterable, Iterator
from itertools import product
from pathlib import Path
from typing import Any

from packaging.requirements import Requirement
from packaging.tags import Tag
from packaging.utils import parse_sdist_filename, parse_wheel_filename
from packaging.version import Version

HEAD = """\
# Every package of the loop but torch, as resolved together, with the sha256 of each file that pip may take.
# Made by `make lock`; see CONTRIBUTING.md. Install with: pip install --require-hashes --no-deps -r requirements.lock
"""
TORCH_HEAD = """\
# torch, with the sha256 of its builds on the default index and of those that pip found beside it. Made by `make lock`.
# Apart from the rest: the builds of PyTorch's own indices (make setup TORCH_INDEX=...) have other hashes.
"""
LEFT_OUT = re.compile("^(nvidia-|cuda-|triton)")  # parts of torch's CUDA build, which pip adds where it takes that one
GROUPS = ("loop", "orchestration", "develop")  # not `gpu`, which is for machines with an NVIDIA GPU
PYTHONS = ("3.11.0", "3.11.9", "3.12.0")
SYSTEMS = (("linux", "Linux", "x86_64"), ("linux", "Linux", "aarch64"), ("darwin", "Darwin", "arm64"))
MACHINES = re.compile(r"^(any|(manylinux|linux|macosx).*(x86_64|aarch64|arm64|universal2))$")

Page = list[tuple[str, str]]
"""Names of files on the index and their sha256."""


def normal(name: str) -> str:
    """The name as package indices compare it."""
    return re.sub(r"[-_.]+", "-", name).lower()


def environments() -> Iterator[dict[str, str]]:
    """Environments that markers are asked about: each Python on each system."""
    for python, (system, platform, machine) in product(PYTHONS, SYSTEMS):
        versions = {"python_version": python.rpartition(".")[0], "python_full_version": python, "os_name": "posix"}
        yield versions | {"sys_platform": system, "platform_system": platform, "platform_machine": machine}


def closure(wanted: list[Requirement]) -> dict[str, list[Requirement]]:
    """Name -> who asks for it how, of all that `wanted` needs, directly or not, in any of the environments."""
    found: dict[str, list[Requirement]] = {}
    seen: set[tuple[str, frozenset[str]]] = set()
    while wanted:
        requirement = wanted.pop()
        name, extras = normal(requirement.name), frozenset(requirement.extras)
        if LEFT_OUT.match(name):
            continue
        found.setdefault(name, []).append(requirement)
        if (name, extras) in seen or installed(name) is None:
            continue
        seen.add((name, extras))
        for text in importlib.metadata.distribution(name).requires or []:
            needed = Requirement(text)
            if needed.marker is None or any(
                needed.marker.evaluate({**place, "extra": extra}) for place in environments() for extra in ("", *extras)
            ):
                wanted.append(needed)
    return found


def installed(name: str) -> str | None:
    """The version here without its local part; None where only another Python or system needs the package."""
    try:
        return importlib.metadata.version(name).partition("+")[0]
    except importlib.metadata.PackageNotFoundError:
        return None


def version_of(name: str, asked: list[Requirement], page: Page) -> str:
    """The version here, else the newest that all who ask for it allow."""
    here = installed(name)
    if here is not None:
        return here
    versions = {version for file, _ in page if (version := parsed(file)[0]) is not None}
    allowed = [v for v in versions if all(v in requirement.specifier for requirement in asked)]
    if not allowed:
        raise SystemExit(f"{name}: no version on the index that {', '.join(map(str, asked))} allows")
    return str(max(allowed))


def parsed(file: str) -> tuple[Version | None, frozenset[Tag]]:
    """Version and tags of a file's name; a source archive has no tags, other files no version."""
    try:
        if file.endswith(".whl"):
            _, version, _, tags = parse_wheel_filename(file)
            return version, frozenset(tags)
        return parse_sdist_filename(file)[1], frozenset()
    except ValueError:
        return None, frozenset()


def hashes(version: str, page: Page) -> list[str]:
    """sha256 of the wheels of a version for Linux and macOS, and of its source where there is no wheel for all."""
    files = [(sha, file, parsed(file)) for file, sha in page]
    files = [item for item in files if item[2][0] is not None and item[2][0].public == Version(version).public]
    wheels = [(sha, tags) for sha, _, (_, tags) in files if any(map(fits, tags))]
    kept = {sha for sha, _ in wheels}
    if not any(tag.platform == "any" for _, tags in wheels for tag in tags):
        kept |= {sha for sha, file, _ in files if not file.endswith(".whl")}
    return sorted(kept)


def fits(tag: Tag) -> bool:
    """Whether a wheel with this tag is for CPython 3.11 or later on Linux or macOS."""
    python = re.fullmatch(r"(py|cp)(\d)(\d*)", tag.interpreter)
    if python is None or python[2] != "3" or not MACHINES.match(tag.platform):
        return False
    minor = int(python[3] or 0)
    return minor >= 11 and tag.abi == tag.interpreter if tag.abi.startswith("cp") else minor <= 11 or python[1] == "cp"


def pages(names: Iterable[str]) -> dict[str, Page]:
    """Pages that pip finds for each name, on the indices and in the folders that it is configured for."""
    from pip._internal.commands import create_command
    from pip._internal.index.collector import LinkCollector, parse_links

    logging.getLogger("pip").setLevel(logging.ERROR)  # an index that lacks a package is no news where there are others
    command: Any = create_command("download")
    options, _ = command.parse_args(["x"])
    with command.main_context():
        session = command._build_session(options)
        collector = LinkCollector.create(session, options)

        def links(page: Any) -> list[Any]:
            response = collector.fetch_response(page)
            return [] if response is None else list(parse_links(response))

        found: dict[str, Page] = {}
        for name in names:
            sources = [one for group in collector.collect_sources(name, links) for one in group if one is not None]
            listed = [link for one in sources for link in (*one.page_candidates(), *one.file_links())]
            found[name] = [
                (link.filename, sha256(link)) for link in listed if normal(link.filename).startswith(f"{name}-")
            ]
    return found


def sha256(link: Any) -> str:
    """As the index states it; of a file on disk, worked out."""
    if link.hash_name == "sha256":
        return str(link.hash)
    if link.is_file:
        return hashlib.sha256(Path(link.file_path).read_bytes()).hexdigest()
    raise SystemExit(f"{link.filename}: the index states no sha256")


def entry(name: str, version: str, page: Page) -> str:
    """The lines of one package.

    Raises:
        SystemExit: where the index has no file of this version that fits.
    """
    found = hashes(version, page)
    if not found:
        raise SystemExit(f"{name}=={version}: no file for Linux or macOS on the index")
    return " \\\n    ".join([f"{name}=={version}", *(f"--hash=sha256:{sha}" for sha in found)]) + "\n"


def main() -> None:
    """Write both files, or neither."""
    project = tomllib.loads(Path("pyproject.toml").read_text())["project"]
    groups = [project["dependencies"], *(project["optional-dependencies"][name] for name in GROUPS)]
    asked = closure([Requirement(line) for group in groups for line in group])
    offered = pages(sorted(asked))
    entries = {name: entry(name, version_of(name, asked[name], offered[name]), offered[name]) for name in sorted(asked)}
    torch = TORCH_HEAD + entries.pop("torch")
    Path("requirements.lock").write_text(HEAD + "".join(entries.values()))
    Path("requirements-torch.lock").write_text(torch)
    sys.stdout.write(f"{len(entries) + 1} packages\n")


if __name__ == "__main__":
    main()
