"""The tutorials' commands, as printed: all are known to the command line, and what needs no download is run."""

import json
import re
import shlex
import zipfile
from pathlib import Path

import mujoco
import numpy as np
import pytest
import typer

from bumblebee import cli
from flows.gates import gate_answer
from tasks.approvals import gate
from tests.flows.gates.test_gate_answer import waiting
from tests.motion.human.people import bvh

DOCS = Path(__file__).parent.parent / "docs"
SHARED = Path(__file__).parents[2] / "shared" / "data"
PAGES = sorted(page.name for page in [*DOCS.glob("tutorial-*.md"), DOCS / "faq.md", DOCS / "deploy.md"])
ARM = ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll", "gripper")


def commands(page: str) -> list[list[str]]:
    """Words of every `bumblebee` line of a page, without the program's name and a remark at its end."""
    lines = re.findall(r"^    bumblebee (.+)$", (DOCS / page).read_text(), re.MULTILINE)
    return [shlex.split(line, comments=True) for line in lines]


LINES = [pytest.param(words, id=f"{page}: {' '.join(words[:2])}") for page in PAGES for words in commands(page)]


@pytest.mark.parametrize("words", LINES)
def test_the_command_line_knows_every_command_and_option_of_a_tutorial(words: list[str]):
    words, command = list(words), typer.main.get_command(cli.app)
    while hasattr(command, "get_command"):
        name = words.pop(0)
        command = command.get_command(None, name)
        assert command is not None, f"no command {name}"
    command.make_context("bumblebee", words)  # raises for an option that it does not know


def test_the_first_tutorial_gives_a_robot_motion_of_a_persons(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    (tmp_path / "takes").mkdir()
    (tmp_path / "takes" / "08_01.bvh").write_text(bvh())
    monkeypatch.chdir(tmp_path)
    for words in commands("tutorial-mocap.md"):
        assert words[1] == "play" or cli.run(words) == 0
    assert {path.name for path in Path("walks").iterdir()} == {"08_01.npz", "LICENCES.csv"}


def published_arm(folder: Path) -> None:
    """An arm laid out as the published one: joints under its names, shapes and their files, a mount for a camera."""
    body = '<body name="camera_mount"><geom type="mesh" mesh="m"/></body>'
    for name in reversed(ARM):
        joint = f'<joint name="{name}" range="-0.2 1.7" axis="0 1 0"/>'
        inertial = '<inertial pos="0 0 .1" mass=".1" diaginertia="1e-4 1e-4 1e-4"/>'
        body = (
            f'<body name="{name}_link" pos="0 0 .1">{joint}{inertial}<geom type="mesh" mesh="m"/><site/>{body}</body>'
        )
    drives = "".join(f'<position name="{name}" joint="{name}" ctrlrange="-0.2 1.7" kp="9"/>' for name in ARM)
    folder.mkdir(parents=True)
    (folder / "so101.xml").write_text(
        '<mujoco><compiler angle="radian"/><default><mesh maxhullvert="64"/><joint armature=".01"/></default>'
        f'<asset><mesh name="m" file="m.stl"/></asset><worldbody>{body}</worldbody>'
        f"<actuator>{drives}</actuator></mujoco>"
    )


def test_the_arms_tutorial_makes_the_declared_model_and_imports_recordings(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(tmp_path)
    published_arm(Path("mujoco_menagerie/robotstudio_so101"))
    [block] = re.findall(r"^```python\n(.*?)^```", (DOCS / "tutorial-so101.md").read_text(), re.MULTILINE | re.DOTALL)
    exec(compile(block, "tutorial-so101.md", "exec"), {})
    model = mujoco.MjModel.from_xml_path("nominal.xml")
    assert [model.joint(i).name for i in range(model.njnt)] == [model.actuator(i).name for i in range(model.nu)]
    assert model.ngeom == 0 and model.nbody == 1 + len(ARM)
    np.testing.assert_allclose([model.joint("Jaw").range, model.actuator("Jaw").ctrlrange], [[-0.174533, 2.1617]] * 2)
    joints = [model.joint(i).name for i in range(model.njnt)]
    motion = Path("sage/output/real/so101/custom/wave")
    motion.mkdir(parents=True)
    angles = 0.5 + 0.1 * np.sin(np.arange(60)[:, None] / 9 + np.arange(6))
    rows = [f'{20060 * i},"{json.dumps(row)}"' for i, row in enumerate(angles.round(4).tolist())]
    for name in ("control.csv", "state_motor.csv"):
        (motion / name).write_text("\n".join(["timestamp,positions", *rows]) + "\n")
    (motion / "joint_list.txt").write_text("\n".join(joints))
    assert cli.run(commands("tutorial-so101.md")[0]) == 0
    assert Path("so101/rollouts/wave.parquet").exists() and Path("so101/model.xml").exists()


@pytest.mark.skipif(not (SHARED / "measured/so101/motions.zip").exists(), reason="the arm's recordings are not here")
def test_a_real_motion_of_the_arm_is_imported_as_the_tutorial_says(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    with zipfile.ZipFile(SHARED / "measured/so101/motions.zip") as archive:
        names = [name for name in archive.namelist() if name.startswith("static_holding/")]
        archive.extractall("sage/output/real/so101/custom", names)
    Path("nominal.xml").write_bytes((SHARED / "measured/so101/nominal.xml").read_bytes())
    assert cli.run(commands("tutorial-so101.md")[0]) == 0
    assert [path.stem for path in Path("so101/rollouts").iterdir()] == ["static_holding"]


def test_the_gates_tutorial_shows_and_answers_a_round(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    monkeypatch.setattr(gate_answer.servers, "running", lambda folder: None)
    place = waiting(tmp_path / "lab", 3)
    monkeypatch.chdir(place.workspace)
    seen = gate.seen_of(place.summary)["sha256"][:12]
    for words in commands("tutorial-gate.md")[:3]:
        assert cli.run([seen if re.fullmatch("[0-9a-f]{12}", word) else word for word in words]) == 0
    assert seen in capsys.readouterr().out and gate.verdict(place) == "approved"
