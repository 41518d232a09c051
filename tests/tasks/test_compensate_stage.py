"""The stage compensate: what a round's effects make of the runner's commands."""

import json
from pathlib import Path

import pytest

from bumblebee.cli import run
from bumblebee.compensation.file import read_compensation
from bumblebee.errors import BadInput
from bumblebee.sim.effects import Effect, single, write_effects
from tasks import compensate


@pytest.fixture
def diagnosed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(compensate, "log_run", lambda *_, **__: None)
    Path("params.yaml").write_text("compensate: {}\nrounds: [{n: 1, parent: 0}, {n: 2, parent: 1}]\n")
    Path("data/diagnosis/r1").mkdir(parents=True)
    return tmp_path


def test_what_can_be_undone_is_and_what_cannot_is_listed_with_its_reason(
    diagnosed: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    effects = [single("encoder_offset", "left_knee_joint", 0.05), single("backlash", "left_hip_yaw_joint", 0.02)]
    write_effects(Path("data/diagnosis/r1/effects.yaml"), effects)
    compensate.main(1)
    made = read_compensation(Path("models/compensation/r1/compensation.json"))
    assert [bool(step.done) for step in made.plan] == [True, False]
    assert made.plan[1].why_not
    assert made.encoder_offset[made.joints.index("left_knee_joint")] == 0.05
    assert "1 of 2 effects undone" in capsys.readouterr().out


def test_a_robot_that_lacks_nothing_is_sent_its_own_gains(diagnosed: Path) -> None:
    write_effects(Path("data/diagnosis/r1/effects.yaml"), list[Effect]())
    compensate.main(1)
    made = read_compensation(Path("models/compensation/r1/compensation.json"))
    assert not made.plan and not made.encoder_offset.any() and not made.dry.any()


def error(before: list[float] | None, after: list[float] | None) -> dict:
    """A diagnosis's document with these intervals [rad]."""
    part = {
        name: {"0.2": {"joint_pos_rmse": {"value": 0.05, "ci95": ends}}}
        for name, ends in (("before", before), ("after", after))
    }
    return {"effects": [{}], "error": part}


@pytest.mark.parametrize(
    ("before", "after", "undone"),
    [([0.048, 0.077], [0.016, 0.045], True), ([0.018, 0.098], [0.013, 0.088], False), (None, None, False)],
)
def test_nothing_is_undone_where_held_out_rollouts_show_no_better_model(
    diagnosed: Path, before: list[float] | None, after: list[float] | None, undone: bool
) -> None:
    write_effects(Path("data/diagnosis/r1/effects.yaml"), [single("encoder_offset", "left_knee_joint", 0.05)])
    Path("data/diagnosis/r1/diagnosis.json").write_text(json.dumps(error(before, after)))
    compensate.main(1)
    made = read_compensation(Path("models/compensation/r1/compensation.json"))
    assert [bool(step.done) for step in made.plan] == [undone]
    assert made.encoder_offset.any() == undone
    assert undone or "held-out rollouts" in made.plan[0].why_not


@pytest.mark.parametrize(
    "text", ["[]", "{}", '{"effects": [{}]}', '{"effects": [{}], "error": {"before": 1, "after": 2}}',
             json.dumps(error(["a"], [])), json.dumps(error([0.1, "b"], [0.2, 0.3]))],
)  # fmt: skip
def test_a_diagnosis_of_any_other_form_shows_nothing(diagnosed: Path, text: str) -> None:
    folder = Path("data/diagnosis/r1")
    write_effects(folder / "effects.yaml", [single("encoder_offset", "left_knee_joint", 0.05)])
    (folder / "diagnosis.json").write_text(text)
    with pytest.raises(BadInput, match="--unproven"):
        run(["compensate", str(folder / "effects.yaml"), "--out", "c.json"])


def test_the_command_refuses_them_in_one_line_unless_told_to(diagnosed: Path) -> None:
    folder = Path("data/diagnosis/r1")
    write_effects(folder / "effects.yaml", [single("encoder_offset", "left_knee_joint", 0.05)])
    (folder / "diagnosis.json").write_text(json.dumps(error([0.018, 0.098], [0.013, 0.088])))
    command = ["compensate", str(folder / "effects.yaml"), "--out", "c.json"]
    with pytest.raises(BadInput, match="--unproven"):
        run(command)
    assert not Path("c.json").exists()
    assert run([*command, "--unproven"]) == 0 and Path("c.json").exists()


def test_what_the_experts_were_trained_with_is_not_undone_a_second_time(diagnosed: Path) -> None:
    old, new = single("encoder_offset", "left_knee_joint", 0.05), single("encoder_offset", "left_elbow_joint", 0.02)
    write_effects(Path("data/diagnosis/r1/effects.yaml"), [old])
    Path("data/diagnosis/r2").mkdir()
    write_effects(Path("data/diagnosis/r2/effects.yaml"), [old, new])
    compensate.main(2)
    made = read_compensation(Path("models/compensation/r2/compensation.json"))
    assert made.encoder_offset[made.joints.index("left_knee_joint")] == 0
    assert made.encoder_offset[made.joints.index("left_elbow_joint")] == 0.02
    assert [(step.where[0], bool(step.done)) for step in made.plan] == [
        ("left_elbow_joint", True), ("left_knee_joint", False),
    ]  # fmt: skip
    assert "trained with it in round 1" in made.plan[1].why_not
