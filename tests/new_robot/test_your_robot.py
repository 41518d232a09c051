"""docs/your-robot.md, run: from an MJCF that nobody sells to a policy that only this robot takes."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from bumblebee.new_robot.first_folder import draft_folder
from tests.motion.human.people import bvh
from tests.robot.made_up import mjcf


def bumblebee(*words: str, cwd: Path, robot: str = "") -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "bumblebee.cli", *(["--robot", robot] if robot else []), *words]
    env = {key: value for key, value in os.environ.items() if key != "BUMBLEBEE_ROBOT"}
    return subprocess.run(command, cwd=cwd, env=env, capture_output=True, text=True, timeout=600)


@pytest.fixture
def robot(tmp_path: Path) -> Path:
    (tmp_path / "made.xml").write_text(mjcf())
    came = bumblebee("robot", "inspect", "made.xml", "--out", "mine", cwd=tmp_path)
    assert came.returncode == 0, came.stderr
    assert "Then: bumblebee robot check mine" in came.stdout
    return tmp_path / "mine"


def test_a_policy_of_a_robot_of_ones_own(tmp_path: Path, robot: Path) -> None:
    came = bumblebee("robot", "check", "mine", cwd=tmp_path)
    assert came.returncode == 0, came.stdout
    assert came.stdout.count("  yes  ") == 9
    people = tmp_path / "people"
    people.mkdir()
    for number in range(2):
        (people / f"sway{number}.bvh").write_text(bvh(frames=90 + number))
    words = ("train", "people", "--out", "policy", "--minutes", "0.05", "--worlds", "8", "--held-out", "0")
    came = bumblebee(*words, cwd=tmp_path, robot="mine")
    assert came.returncode == 0, came.stderr
    assert "no policy comes along for made" in came.stdout
    came = bumblebee("evaluate", "policy", "people", cwd=tmp_path, robot="mine")
    assert came.returncode == 0, came.stderr
    assert "of 2 motions" in came.stdout
    came = bumblebee("evaluate", "policy", "people", cwd=tmp_path)
    assert (came.returncode, came.stdout) == (2, "")
    assert "robot: expected 'g1_23dof', came 'made'. Name the robot that it was made for" in came.stderr
    changed = robot / "robot.yaml"
    changed.write_text(changed.read_text().replace("l_bend: 0.3", "l_bend: 0.4"))
    came = bumblebee("evaluate", "policy", "people", cwd=tmp_path, robot="mine")
    assert came.returncode == 2
    assert "a made of other bodies, motors or stand" in came.stderr


@pytest.mark.parametrize(
    ("of_model", "of_file", "line"),
    [
        ({'name="l_bend" axis="0 1 0" range="0 2.3"': 'name="l_bend" axis="0 1 0" range="0 1.3"'}, {}, "NO   sides"),
        ({}, {"l_bend: 0.3": "l_bend: -0.4"}, "NO   stand"),
        ({}, {"velocity_limit: 20.0": "velocity_limit: 1146.0"}, "NO   motors"),
        ({}, {"left_foot: l_shoe": "left_foot: r_shoe", "right_foot: r_shoe": "right_foot: l_shoe"}, "NO   limbs"),
        ({}, {"velocity_limit: 20.0": "velocity_limit: 20.0\n    effort_limit: 2.0"}, "NO   strength"),
        ({'type="sphere" size="0.09"': 'type="sphere" size="0.6"'}, {}, "NO   shapes"),
    ],
)
def test_a_check_says_what_does_not_hold(tmp_path: Path, of_model: dict, of_file: dict, line: str) -> None:
    (tmp_path / "made.xml").write_text(mjcf(**of_model))
    draft_folder(tmp_path / "made.xml", tmp_path / "mine")
    file = tmp_path / "mine" / "robot.yaml"
    text = file.read_text()
    for old, new in of_file.items():
        assert old in text
        text = text.replace(old, f"\0{new}")
    file.write_text(text.replace("\0", ""))
    came = bumblebee("robot", "check", "mine", cwd=tmp_path)
    assert came.returncode == 2
    assert line in came.stdout
