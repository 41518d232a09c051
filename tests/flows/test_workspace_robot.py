"""A workspace has a robot of its own: written once, kept, and refused before the first stage where it does not fit."""

import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from bumblebee import cli
from bumblebee.errors import BadInput
from bumblebee.new_robot.first_folder import draft_folder
from flows import workspace as workspaces
from flows.environment import environment
from tests.robot.made_up import mjcf


def robot_of(folder: Path) -> dict:
    return yaml.safe_load((folder / "data/robot/robot.yaml").read_text())


def test_a_workspace_has_the_checkouts_robot_or_the_one_that_is_asked_for(tmp_path: Path) -> None:
    folder = workspaces.create(tmp_path / "lab")
    assert robot_of(folder) == {"like": "g1_23"}
    workspaces.create(folder, robot="h1")
    assert robot_of(folder) == {"like": "h1"}
    workspaces.create(folder)
    assert robot_of(folder) == {"like": "h1"}
    with pytest.raises(BadInput, match="robot atlas: expected a folder"):
        workspaces.create(folder, robot="atlas")


def test_a_robots_folder_is_copied_whole(tmp_path: Path) -> None:
    (tmp_path / "made.xml").write_text(mjcf())
    draft_folder(tmp_path / "made.xml", tmp_path / "mine")
    folder = workspaces.create(tmp_path / "lab", robot=str(tmp_path / "mine"))
    assert (folder / "data/robot/made.xml").read_text() == mjcf()
    assert robot_of(folder)["robot"] == "made"
    workspaces.create(folder, robot="g1_29")
    assert [file.name for file in (folder / "data/robot").iterdir()] == ["robot.yaml"]


@pytest.mark.parametrize(
    ("own_motions", "line"),
    [
        (
            False,
            "motions.source: expected a folder of motions, came what comes along for g1_23dof, and this is h1",
        ),
        (True, "base.init: expected own or scratch, came what comes along for g1_23dof"),
    ],
)
def test_what_comes_along_for_the_g1_is_refused_of_another_robot(tmp_path: Path, own_motions: bool, line: str) -> None:
    folder = workspaces.create(tmp_path / "lab", motions=tmp_path if own_motions else None, robot="h1")
    command = [sys.executable, "-m", "tasks.sections"]
    came = subprocess.run(command, cwd=folder, env=environment(folder), capture_output=True, text=True, timeout=120)
    assert came.returncode == 2
    assert line in came.stderr


def test_a_policy_of_ones_own_lies_in_the_workspace_and_must_be_there(tmp_path: Path) -> None:
    mine = tmp_path / "mine"
    mine.mkdir()
    with pytest.raises(BadInput, match=r"mine: expected a policy of `bumblebee train` \(policy.pt\), came none"):
        workspaces.create(tmp_path / "lab", policy=mine)
    for name in ("policy.pt", "card.json", "film.html"):
        (mine / name).write_text(name)
    folder = workspaces.create(tmp_path / "lab", policy=mine)
    place = folder / "data/policy"
    assert sorted(file.name for file in place.iterdir()) == ["README.md", "card.json", "policy.pt"]
    said = yaml.safe_load((folder / "params.yaml").read_text())["base"]
    assert (said["init"], said["learner"]) == ("own", "none")
    (place / "policy.pt").unlink()
    command = [sys.executable, "-m", "tasks.sections"]
    came = subprocess.run(command, cwd=folder, env=environment(folder), capture_output=True, text=True, timeout=120)
    assert came.returncode == 2
    assert "base.init: expected a policy of `bumblebee train`, came no policy.pt in data/policy" in came.stderr


def test_the_robot_before_the_command_is_the_loops(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []
    monkeypatch.setattr("flows.demo.started", lambda options: asked.append(options.robot) or 0)
    monkeypatch.setenv("BUMBLEBEE_ROBOT", "")  # put back what `--robot` sets
    for words in (
        ["--robot", "h1", "demo"],
        ["demo", "--robot", "g1_29"],
        ["--robot", "h1", "demo", "--robot", "g1_29"],
    ):
        assert cli.run(words) == 0
    monkeypatch.setenv("BUMBLEBEE_ROBOT", "h1")  # as `tasks` sets it in any process that imports it
    assert cli.run(["demo"]) == 0
    assert asked == ["h1", "g1_29", "g1_29", ""]
