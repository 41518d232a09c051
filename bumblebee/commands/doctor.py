"""Command line: `bumblebee doctor`; what this machine has and lacks, each lack with a remedy."""

import importlib.metadata
import os
import shutil
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

INSTALL = {
    "": "in the checkout: make setup",
    "loop": "in the checkout: pip install -e '.[loop]'; then ask again",
    "orchestration": "in the checkout: pip install -e '.[orchestration]'; then ask again",
    "gpu": "in the checkout: pip install -e '.[gpu]'; then ask again",
    "logs": "in the checkout: pip install -e '.[logs]'; then ask again",
    "lab": "in the checkout: pip install -e '.[lab]'; then ask again",
}
NEEDED = ("", "loop", "orchestration")
_DISK, _MEMORY = 3.0, 4.0  # GB: what README says the loop needs; what its largest stage held


def doctor() -> None:
    """Say what this machine has and lacks: packages, rendering, browser, GPU, disk, memory, ports, programs."""
    lacking = 0
    for check in (python, packages, rendering, browser, gpu, disk, memory, ports, programs):
        for good, needed, line in check():
            lacking += not good and needed
            print(f"{'ok' if good else 'LACKS' if needed else 'without'}: {line}", flush=True)
    print("all that the loop needs is here" if not lacking else f"{lacking} of what the loop needs is missing")
    raise SystemExit(0 if not lacking else 1)


Said = Iterator[tuple[bool, bool, str]]
"""For each thing: whether it is there, whether the loop needs it, and the line."""


def python() -> Said:
    """Python's version."""
    good = sys.version_info >= (3, 11)
    remedy = "" if good else "; 3.11 or later is needed: make setup PYTHON=/path/to/python3.11"
    yield good, True, f"Python {sys.version.split()[0]}{remedy}"


def packages() -> Said:
    """Packages of each extra, by what the distribution itself declares."""
    from bumblebee import DISTRIBUTION

    if not installed(DISTRIBUTION):
        yield False, True, f"{DISTRIBUTION} as an installed package; in the checkout: pip install -e ."
        return
    for extra in INSTALL:
        missing = [name for name in required(DISTRIBUTION, extra) if not installed(name)]
        what = f"packages of the extra `{extra}`" if extra else "packages of the library"
        yield not missing, extra in NEEDED, what + (f": no {', '.join(missing)}; {INSTALL[extra]}" if missing else "")


def required(distribution: str, extra: str) -> list[str]:
    """Names of the packages that an extra adds, or that are always needed."""
    from packaging.requirements import Requirement

    found = []
    for line in importlib.metadata.requires(distribution) or []:
        requirement = Requirement(line)
        marked = "extra ==" in str(requirement.marker or "")
        if (marked and extra and requirement.marker.evaluate({"extra": extra})) or (not marked and not extra):  # type: ignore[union-attr]
            found.append(requirement.name)
    return found


def installed(name: str) -> bool:
    """Whether a distribution is installed."""
    try:
        return bool(importlib.metadata.version(name))
    except importlib.metadata.PackageNotFoundError:
        return False


def rendering() -> Said:
    """Off-screen OpenGL, tried with a box."""
    import numpy as np

    from bumblebee.report.films.render import render_frames
    from bumblebee.robot.model import build_spec

    spec = build_spec()
    frames, how = render_frames(spec.compile() and spec.to_xml(), spec.compile().key_qpos.astype(np.float64), 32, 32)
    remedy = "films are painted, and slower; Debian and Ubuntu: apt-get install libegl1 libgl1-mesa-dri"
    yield frames is not None, False, f"off-screen OpenGL, {how}" if frames is not None else f"OpenGL; {remedy}"


def browser() -> Said:
    """A browser that shows the pages."""
    names = ("chromium", "chromium-browser", "google-chrome", "firefox")
    found = next((path for name in names if (path := shutil.which(name))), None)
    remedy = "; open the pages from another machine, or on Debian and Ubuntu: apt-get install chromium"
    yield found is not None, False, f"browser {found}" if found else f"browser{remedy}"


def gpu() -> Said:
    """An NVIDIA GPU that torch can use."""
    try:
        import torch
    except ImportError:
        return
    if torch.cuda.is_available():
        yield True, False, f"GPU {torch.cuda.get_device_name()}"
    else:
        why = f"this torch {torch.__version__} sees none; training runs on the CPU"
        anew = ", then in the checkout: rm -r .venv && make setup" if torch.version.cuda is None else ""
        yield False, False, f"NVIDIA GPU: {why}; with one: its driver{anew}"


def disk() -> Said:
    """Free space here."""
    free = shutil.disk_usage(Path.cwd()).free / 1e9
    remedy = "" if free >= _DISK else f"; {_DISK:g} GB are needed: free some, or work in a folder on another disk"
    yield free >= _DISK, True, f"{free:.1f} GB free in {Path.cwd()}{remedy}"


def memory() -> Said:
    """Memory of the machine."""
    size = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 1e9
    remedy = "" if size >= _MEMORY else f"; {_MEMORY:g} GB are needed: train with fewer robots, --worlds 128"
    yield size >= _MEMORY, True, f"{size:.1f} GB of memory, {os.cpu_count()} cores{remedy}"


def ports() -> Said:
    """A free port on loopback for each server."""
    try:
        with socket.create_server(("127.0.0.1", 0)) as one, socket.create_server(("127.0.0.1", 0)) as other:
            yield True, True, f"ports on loopback, such as {one.getsockname()[1]} and {other.getsockname()[1]}"
    except OSError as error:
        yield False, True, f"a port on loopback ({error.strerror}); allow this user to listen on 127.0.0.1"


def programs() -> Said:
    """Programs that run the loop."""
    for name, call, needed, remedy in (
        ("git", ["git"], True, "on Debian and Ubuntu: apt-get install git"),
        ("make", ["make"], False, "on Debian and Ubuntu: apt-get install make; `bumblebee demo` needs none"),
        ("dvc", [sys.executable, "-m", "dvc"], True, "in the checkout: pip install -e '.[orchestration]'"),
    ):
        version = _answer([*call, "--version"])
        yield bool(version), needed, f"{name} {version}" if version else f"{name}; {remedy}"


def _answer(command: list[str]) -> str:
    """First line of what a program says of its version; "" where it does not run."""
    try:
        said = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    except (OSError, subprocess.SubprocessError):
        return ""
    return said.stdout.strip().splitlines()[0] if said.stdout.strip() else ""
