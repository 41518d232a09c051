"""Sets of motions in data/raw, kept by DVC: what changed there is made anew, and nothing else, here and in a clone.

The stages `motions` and `filter` of dvc.yaml with their dependencies and outputs, and small commands in place of their
own; the first one retargets through the cache. `test_the_stages_themselves` has the real ones.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml
from dvc.repo import Repo

from bumblebee.errors import BadInput
from bumblebee.motion.kinematics import lowest
from bumblebee.robot.facts import stand_pose
from flows import workspace as workspaces
from flows.stages import changed_stages, read_stages, to_run
from tasks.settings import watched
from tasks.settings.watched import require_watched

HOME = Path(__file__).parents[3]
READ = """
import sys
from pathlib import Path
import numpy as np
from bumblebee.motion.cache import cached, key_of

def retarget(path):
    with open("made.log", "a") as log:
        log.write(path.name + "\\n")
    return {"joint_pos": np.loadtxt(path, delimiter=",", ndmin=2)}

out, source = Path("data/motions"), Path("data/raw")
out.mkdir(parents=True)
for path in sorted(source.rglob("*.csv")):
    key = key_of({"file": path.read_text(), "code": 1})
    np.savetxt(out / path.name, cached(Path("data/retargets"), key, lambda: retarget(path))["joint_pos"], fmt="%.3f")
"""


def git(folder: Path, *words: str) -> None:
    subprocess.run(["git", *words], cwd=folder, check=True, capture_output=True)


def commit(folder: Path) -> None:
    git(folder, "add", "-A")
    git(folder, "-c", "user.name=lab", "-c", "user.email=lab@example.org", "commit", "-qm", "a state")


def files(folder: Path, count: int = 4) -> None:
    folder.mkdir(parents=True)
    for number in range(count):
        (folder / f"walk{number}.csv").write_text(f"{number},1\n{number},2\n")


def made(folder: Path) -> list[str]:
    """The files that were retargeted since the last question."""
    log = folder / "made.log"
    names = log.read_text().split() if log.exists() else []
    log.unlink(missing_ok=True)
    return names


def repro(folder: Path, **options: object) -> list[str]:
    """Bring it up to date; the stages that had work."""
    before = Path.cwd()
    os.chdir(folder)
    try:
        with Repo(".") as repo:
            return [stage.addressing for stage in repo.reproduce(**options)]
    finally:
        os.chdir(before)


@pytest.fixture
def lab(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A repository with this one's rules of git and DVC, a local remote, and a set of four motions."""
    folder = tmp_path / "lab"
    (folder / "data/raw").mkdir(parents=True)
    shutil.copytree(HOME / "data/robot", folder / "data/robot")
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setenv("DVC_SITE_CACHE_DIR", str(tmp_path / "site"))
    monkeypatch.setenv("SHELL", "/bin/sh")
    for name in (".gitignore", ".dvcignore", "data/raw/README.md"):
        shutil.copy(HOME / name, folder / name)
    with (folder / ".gitignore").open("a") as rules:
        rules.write("made.log\nlooked\n")
    for name in ("bumblebee", "tasks", "flows"):
        (folder / name).symlink_to(HOME / name)
    (folder / "read.py").write_text(READ)
    settings = yaml.safe_load((HOME / "params.yaml").read_text())
    settings["motions"] = {"source": "data/raw/lab", "read": {"csv_fps": 30, "joints_23": "asap", "quaternion": "xyzw"}}
    (folder / "params.yaml").write_text(yaml.safe_dump(settings))
    stages = yaml.safe_load((HOME / "dvc.yaml").read_text())["stages"]
    kept = {name: stages[name] for name in ("motions", "filter")}
    kept["robot"] = {"cmd": "touch robot.txt", "deps": ["bumblebee/robot"], "outs": ["robot.txt"]}
    (folder / "dvc.yaml").write_text(yaml.safe_dump({"stages": kept}))
    git(folder, "init", "-q")
    (tmp_path / "remote").mkdir()
    with Repo.init(str(folder)) as repo, repo.config.edit() as settings:
        settings["remote"]["store"] = {"url": str(tmp_path / "remote")}
        settings["core"]["remote"] = "store"
    return folder


@pytest.fixture
def small(lab: Path) -> Path:
    """A lab with small commands."""
    stages = yaml.safe_load((lab / "dvc.yaml").read_text())
    stages["stages"]["motions"]["cmd"] = f"PYTHONPATH={HOME} {sys.executable} read.py"
    stages["stages"]["filter"]["cmd"] = "mkdir -p data/filtered && cp data/motions/* data/filtered && echo x >> looked"
    (lab / "dvc.yaml").write_text(yaml.safe_dump(stages))
    files(lab / "data/raw/lab")
    with Repo(str(lab)) as repo:
        repo.add([str(lab / "data/raw/lab")])
    return lab


def test_a_changed_and_an_added_motion_are_made_anew_and_nothing_else(small: Path):
    assert set(repro(small)) == {"motions", "filter", "robot"}
    assert len(made(small)) == 4
    commit(small)
    assert repro(small) == [] and made(small) == []
    (small / "data/raw/lab/walk2.csv").write_text("7,7\n7,8\n")
    (small / "data/raw/lab/walk9.csv").write_text("9,9\n")
    assert changed_stages(small) == {"data/raw/lab.dvc", "motions"}
    assert set(repro(small)) == {"data/raw/lab.dvc", "motions", "filter"}
    assert made(small) == ["walk2.csv", "walk9.csv"]
    assert (small / "data/filtered/walk2.csv").read_text().startswith("7.000")
    assert repro(small) == []


def test_what_changes_no_motion_stops_at_the_library(small: Path):
    repro(small)
    made(small)
    (small / "data/raw/lab/LICENCE.txt").write_text("CC BY 4.0\n")
    assert set(repro(small)) == {"data/raw/lab.dvc", "motions"}
    assert made(small) == []


def test_a_clone_pulls_all_of_it_and_makes_only_what_it_changes(small: Path, tmp_path: Path):
    repro(small)
    with Repo(str(small)) as repo:
        assert repo.push() > 0
    commit(small)
    clone = tmp_path / "clone"
    git(tmp_path, "clone", "-q", str(small), str(clone))
    assert not (clone / "data/raw/lab").exists() and (clone / "data/raw/lab.dvc").exists()
    with Repo(str(clone)) as repo:
        repo.pull()
    assert repro(clone) == []
    (clone / "data/raw/lab/walk1.csv").write_text("5,5\n")
    assert set(repro(clone)) == {"data/raw/lab.dvc", "motions", "filter"}
    assert made(clone) == ["walk1.csv"]  # the others' retargets came along


def test_the_flow_sees_the_sets_before_the_stage_that_reads_them(small: Path):
    repro(small)
    (small / "data/raw/lab/walk1.csv").write_text("5,5\n")
    stages = read_stages(small)
    assert next(stage for stage in stages if stage.name == "motions").needs == {"data/raw/lab.dvc"}
    assert to_run(stages, changed_stages(small)) == {"data/raw/lab.dvc", "motions", "filter"}
    for stage in stages:  # as flows.reproduce does
        repro(small, targets=[stage.name], single_item=True)
    assert changed_stages(small) == set()


def test_the_checkouts_motions_depend_on_the_folder_of_sets():
    assert "data/raw" in watched.dependencies("motions")
    assert subprocess.run(["git", "check-ignore", "-q", "data/raw/a.dvc"], cwd=HOME).returncode == 1
    assert subprocess.run(["git", "check-ignore", "-q", "data/raw/a"], cwd=HOME).returncode == 0


def test_a_folder_that_dvc_does_not_watch_is_refused_in_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    (tmp_path / "data/raw/lab").mkdir(parents=True)
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "data/raw/link").symlink_to(tmp_path / "elsewhere")
    shutil.copy(HOME / "dvc.yaml", tmp_path)
    monkeypatch.chdir(tmp_path)
    require_watched("motions", {"source": "elsewhere"})  # by hand: nobody says that it is up to date
    monkeypatch.setenv("DVC_STAGE", "motions")
    for good in ("data/raw", "data/raw/lab", "data/raw/lab/a.csv", "data/raw/lab/../lab", tmp_path / "data/raw", ""):
        require_watched("motions", {"source": good})
    for bad in ("elsewhere", "data/raw/../../elsewhere", "data/raw/link", "data", "/"):
        with pytest.raises(BadInput, match=r"motions\.source: expected a folder in data/raw"):
            require_watched("motions", {"source": bad})


def test_a_workspace_watches_the_users_texts_as_well_as_his_motions(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    for name in ("mocap", "texts"):
        (tmp_path / name).mkdir()
    folder = workspaces.create(tmp_path / "lab", motions=tmp_path / "mocap")
    settings = yaml.safe_load((folder / "params.yaml").read_text())
    settings["motions"]["read"] = {"describe": {"captions_folder": str(tmp_path / "texts")}}
    (folder / "params.yaml").write_text(yaml.safe_dump(settings))
    workspaces.create(folder)  # as the next `make demo` does
    monkeypatch.chdir(folder)
    monkeypatch.setenv("DVC_STAGE", "motions")
    require_watched("motions", {"source": tmp_path / "mocap", "read.describe.captions_folder": str(tmp_path / "texts")})
    assert (folder / "data/raw/README.md").exists()


@pytest.mark.slow  # a minute of starting programs; the tests above have the same graph
def test_the_stages_themselves(lab: Path):
    folder = lab / "data/raw/lab"
    folder.mkdir()
    for number in range(4):
        write_csv(folder / f"sway{number}.csv", number)
    with Repo(str(lab)) as repo:
        repo.add([str(folder)])
    assert set(repro(lab)) == {"motions", "filter", "robot"}
    before = (lab / "data/filtered/index.parquet").read_bytes()
    assert repro(lab) == []
    write_csv(folder / "sway2.csv", 7)
    assert set(repro(lab)) == {"data/raw/lab.dvc", "motions", "filter"}
    assert (lab / "data/filtered/index.parquet").read_bytes() != before
    write_csv(folder / "sway2.csv", 2)
    repro(lab)
    assert (lab / "data/filtered/index.parquet").read_bytes() == before


def write_csv(path: Path, phase: float) -> None:
    """Two seconds of a robot that sways, 23 joints at 30 Hz."""
    time = np.arange(60)[:, None] / 30
    joints = stand_pose() + 0.1 * np.sin(np.pi * time + phase) * np.linspace(0.2, 1, 23)
    root, quat = np.zeros((60, 3)), np.tile([1.0, 0, 0, 0], (60, 1))
    root[:, 2] = -lowest(root, quat, joints)
    np.savetxt(path, np.concatenate([root, quat[:, [1, 2, 3, 0]], joints], axis=1), delimiter=",", fmt="%.6f")
