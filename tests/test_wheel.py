"""The wheel by itself: its commands work where there is neither a checkout nor its folders `tasks` and `flows`."""

import contextlib
import functools
import json
import os
import subprocess
import sys
import zipfile
from importlib.metadata import PackageNotFoundError, distributions, packages_distributions, requires
from pathlib import Path

import numpy as np
import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from bumblebee.measured.rollout import write_rollout
from bumblebee.motion.formats.write import write_motion
from bumblebee.motion.kinematics import make_clip
from bumblebee.robot.facts import stand_pose
from tests.diagnosis import arm
from tests.motion.conftest import standing

HOME = Path(__file__).parents[1]
QUIET = ("--no-deps", "--no-build-isolation", "--disable-pip-version-check", "-q")
CALL = """
import os, sys
gone = set(os.environ["GONE"].split())


class Empty:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in gone:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)


sys.meta_path.insert(0, Empty())
from bumblebee.cli import main

main()
"""


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Built from the files that git would commit: what lies about in a checkout is no part of it."""
    clean, out = tmp_path_factory.mktemp("source"), tmp_path_factory.mktemp("dist")
    names = subprocess.run(
        ["git", "ls-files", "-co", "--exclude-standard", "bumblebee", "pyproject.toml", "README.md", "LICENSE"],
        cwd=HOME, capture_output=True, text=True, check=True,
    ).stdout.splitlines()  # fmt: skip
    for name in filter(lambda name: (HOME / name).is_file(), names):
        (clean / name).parent.mkdir(parents=True, exist_ok=True)
        (clean / name).write_bytes((HOME / name).read_bytes())
    subprocess.run([sys.executable, "-m", "pip", "wheel", *QUIET, "-w", str(out), str(clean)], check=True)
    return next(out.glob("*.whl"))


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Unpacked as pip does, in a folder of its own."""
    site = tmp_path_factory.mktemp("site")
    subprocess.run([sys.executable, "-m", "pip", "install", *QUIET, "--target", str(site), str(wheel)], check=True)
    return site


@functools.cache
def not_asked_for(site: Path) -> str:
    """Modules of packages here that nothing which the wheel asks for brings: in an empty environment they are not."""
    (own,) = distributions(path=[str(site)])
    known, left = set(), list(own.requires or ())
    while left:
        wanted = Requirement(left.pop())
        name = canonicalize_name(wanted.name)
        if name in known or (wanted.marker and not wanted.marker.evaluate({"extra": ""})):
            continue
        known.add(name)
        with contextlib.suppress(PackageNotFoundError):  # of another platform
            left += requires(name) or ()
    modules = packages_distributions().items()
    return " ".join(module for module, names in modules if not {canonicalize_name(n) for n in names} & known)


def call(installed: Path, folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """`bumblebee WORDS` in a folder that is no checkout, with the packages alone that the wheel asks for."""
    gone = set(not_asked_for(installed).split()) - {"bumblebee"}
    env = {**os.environ, "PYTHONPATH": str(installed), "COLUMNS": "200", "GONE": " ".join(gone)}
    return subprocess.run([sys.executable, "-c", CALL, *words], cwd=folder, env=env, capture_output=True, text=True)


def test_it_brings_one_package_to_import(wheel: Path) -> None:
    tops = {name.split("/")[0] for name in zipfile.ZipFile(wheel).namelist()}
    assert {top for top in tops if not top.endswith(".dist-info")} == {"bumblebee"}


def test_what_it_does_not_ask_for_is_gone(installed: Path) -> None:
    gone = set(not_asked_for(installed).split())
    assert {"prefect", "mlflow", "dvc", "pytest"} <= gone and not gone & {"mujoco", "torch", "matplotlib", "trimesh"}


def test_a_motion_is_inspected(installed: Path, tmp_path: Path) -> None:
    upright = np.tile([1.0, 0, 0, 0], (60, 1))
    joints = np.tile(stand_pose(), (60, 1))
    write_motion(tmp_path / "in", make_clip("stand", 50.0, standing(upright, joints), upright, joints), "asap")
    done = call(installed, tmp_path, "motions", "inspect", "in")
    assert done.returncode == 0, done.stderr
    assert "1 file: 1 read, 0 not. 1 motion: 1 usable" in done.stdout


def test_logs_are_diagnosed(installed: Path, tmp_path: Path) -> None:
    for rollout in arm.simulate({("viscous_friction", "j2"): 2.0}, count=4):
        write_rollout(tmp_path / "logs/rollouts" / f"{rollout.rollout_id}.parquet", rollout)
    (tmp_path / "arm.xml").write_text(arm.XML)
    done = call(installed, tmp_path, "diagnose", "arm.xml", "logs", "--out", "found", "--max-windows", "10")
    assert done.returncode == 0, done.stderr
    found = json.loads((tmp_path / "found/diagnosis.json").read_text())["effects"]
    assert [(e["effect"], e["where"]) for e in found] == [("viscous_friction", ["j2"])]
    assert (tmp_path / "found/model.xml").is_file()


@pytest.mark.parametrize("words", [("settings",), ("demo",), ("gate", "show", "1")])
def test_the_loop_says_that_it_needs_its_checkout(installed: Path, tmp_path: Path, words: tuple[str, ...]) -> None:
    done = call(installed, tmp_path, *words)
    assert done.returncode == 2
    assert done.stderr.startswith(f"bumblebee {words[0]}: expected BumbleBee's checkout, came the library alone")
    assert len(done.stderr.splitlines()) == 1
