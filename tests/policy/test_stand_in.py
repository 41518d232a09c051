"""The stand-in's process: sealed file in, measured rollouts by the contract out, one line for what is wrong."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.measured.rollout import read_rollout
from bumblebee.motion.store import write_library
from bumblebee.policy.runner import PolicyRunner
from bumblebee.robot.facts import joint_names, joints
from bumblebee.robot.model import gains
from bumblebee.robot.sensors import Sensors
from bumblebee.stand_in.process import main
from bumblebee.stand_in.sealed import declared_g1, entry, read_sealed, seal
from bumblebee.stand_in.undeclared.kinds import KINDS, Place
from bumblebee.tracking.feed_forward import lead_angles
from tests.policy.conftest import nod

DRAWN = {"sign": 1, "axis": 0, "number": 8, "other": "left_knee_joint"}
OFFSET = entry(KINDS["encoder_offset"], Place(declared_g1(), "right_elbow_joint", DRAWN), 0.05)


def sealed(path: Path, effects: list[dict], schema: int = 2) -> Path:
    path.write_text(json.dumps({"schema": schema, "effects": effects, "sha256": seal(effects)}))
    return path


@pytest.fixture
def arguments(tmp_path: Path, policy_folder: Callable[..., Path]) -> Callable[..., list[str]]:
    write_library(tmp_path / "clips", [nod("a", 12), nod("b", 15)])
    policy = policy_folder()

    def make(effects: list[dict], out: str, *more: str) -> list[str]:
        common = ["--clips", str(tmp_path / "clips"), "--out", str(tmp_path / out), "--threads", "1"]
        return ["--sealed", str(sealed(tmp_path / "robot.json", effects)), *common, "--policy", str(policy), *more]

    return make


def test_rollouts_keep_the_contract_and_the_seed_decides_them(arguments: Callable, tmp_path: Path) -> None:
    for out in ("first", "again"):
        assert main(arguments([], out, "--names", "a", "b", "--rollouts", "2", "--seed", "5", "--cluster", "c1")) == 0
    files = sorted((tmp_path / "first").glob("*.parquet"))
    assert [file.stem for file in files] == ["a-0", "a-1", "b-0", "b-1"]
    rollout = read_rollout(files[0])
    assert rollout.joints == joint_names() and rollout.control_hz == 50 and rollout.frames == 12
    assert np.allclose(np.diff(rollout.time), 0.02)
    assert {"joint_target", "action", "joint_torque", "base_pos", "foot_force"} <= set(rollout.columns)
    assert rollout.meta["kp"] == pytest.approx([gains(joint)[0] for joint in joints()])
    assert rollout.meta["cluster"] == "c1" and rollout.meta["motion"] == "a" and rollout.meta["operator"] == "stand-in"
    assert len(rollout.meta["policy"]["sha256"]) == 64 and rollout.meta["notes"] == "ran to the end"
    assert np.array_equal(rollout.joint_pos, read_rollout(tmp_path / "again" / "a-0.parquet").joint_pos)
    assert not np.array_equal(rollout.joint_pos, read_rollout(files[1]).joint_pos)


def test_a_command_issued_in_a_row_acts_before_the_next(arguments: Callable, tmp_path: Path) -> None:
    """Row k's target, of a policy that adds nothing, is the reference of row k+1 led against gravity."""
    assert main(arguments([], "out", "--names", "b")) == 0
    rollout = read_rollout(tmp_path / "out" / "b-0.parquet")
    clip = nod("b", 15)
    assert rollout.joint_target[:-1] == pytest.approx((clip.joint_pos + lead_angles(clip))[1:], abs=1e-6)


def test_sealed_effects_reach_the_robot(arguments: Callable, tmp_path: Path) -> None:
    """The offset is in the readings from the first row on; everything else there is as without it."""
    assert main(arguments([OFFSET], "with", "--names", "a")) == 0
    assert main(arguments([], "without", "--names", "a")) == 0
    rows = [read_rollout(tmp_path / out / "a-0.parquet").joint_pos[0] for out in ("with", "without")]
    assert (rows[0] - rows[1]).round(9).tolist() == [0.05 * (name == "right_elbow_joint") for name in joint_names()]


def test_a_broken_seal_is_refused(arguments: Callable, tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    line = arguments([OFFSET], "out", "--names", "a")
    path = tmp_path / "robot.json"
    path.write_text(path.read_text().replace("0.05", "0.06"))
    assert main(line) == 2
    err = capsys.readouterr().err
    assert "robot.json: field sha256" in err and err.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_odometry_drifts_for_policy_and_log_and_none_leaves_the_column_out(
    arguments: Callable, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[np.ndarray] = []
    real = PolicyRunner.step

    def step(self: PolicyRunner, robots: np.ndarray, tick: int, sensors: Sensors) -> Any:
        seen.append(sensors.base_pos[0].copy())
        return real(self, robots, tick, sensors)

    monkeypatch.setattr(PolicyRunner, "step", step)
    places = {}
    for base in ("mocap", "odometry", "none"):
        seen.clear()
        assert main(arguments([], base, "--names", "b", "--base", base)) == 0
        rollout = read_rollout(tmp_path / base / "b-0.parquet")
        places[base] = np.array(seen)
        if base == "none":
            assert rollout.base_pos is None and rollout.base_lin_vel is not None
        else:
            assert np.array_equal(rollout.base_pos, places[base])
    assert np.array_equal(places["none"], places["odometry"])
    apart = np.linalg.norm(places["odometry"] - places["mocap"], axis=1)
    assert 1e-4 < apart[1:].max() < 0.02
    steps = [np.abs(np.diff(places[base], n=2, axis=0)).max() for base in ("mocap", "odometry")]
    assert steps[1] < 0.5 * steps[0]


@pytest.mark.parametrize("base", ["gps", 3, None, ["mocap"]])
def test_a_plan_with_an_unknown_base_is_refused(
    base: object, arguments: Callable, tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    line = arguments([], "out")
    plan = {"policies": {"p": line[line.index("--policy") + 1]}, "base": base}
    plan["episodes"] = [{"rollout_id": "x", "policy": "p", "motion": "a", "seed": 0}]
    (tmp_path / "plan.json").write_text(json.dumps(plan))
    assert main([*line, "--plan", str(tmp_path / "plan.json")]) == 2
    err = capsys.readouterr().err
    assert "plan.json: base: expected one of mocap, odometry, none" in err and err.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_nothing_is_overwritten(arguments: Callable, tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    assert main(arguments([], "out", "--names", "a")) == 0
    before = (tmp_path / "out" / "a-0.parquet").read_bytes()
    assert main(arguments([OFFSET], "out", "--names", "a")) == 2
    assert (tmp_path / "out" / "a-0.parquet").read_bytes() == before
    assert "a-0.parquet" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({"effect": "gremlin"}, "a kind of effect that a G1 can have"),
        ({"effect": "loose_mount"}, "a kind of effect that a G1 can have"),  # an arm's
        ({"effect": ["encoder_offset"]}, "a kind of effect that a G1 can have"),
        ({"where": ["left_tail_joint"]}, "one joint of the model"),
        ({"where": []}, "one joint of the model"),
        ({"where": [["right_elbow_joint"]]}, "one joint of the model"),
        ({"effect": "link_mass", "where": ["tail"]}, "one body of the model"),
        ({"effect": "ground_friction"}, "where: expected nothing"),
        ({"size": 0.5}, "size: expected a number above 0, at most 0.25"),
        ({"size": 0}, "size: expected a number above 0"),
        ({"size": 10**400}, "size: expected a number above 0"),
        ({"size": -0.01}, "size: expected a number"),
        ({"size": "much"}, "size: expected a number"),
        ({"size": float("nan")}, "size: expected a number"),
        ({"draw": {}}, "draw: expected sign, axis, number, other"),
        ({"draw": {**OFFSET["draw"], "sign": 2}}, "draw: expected sign"),
        ({"draw": {**OFFSET["draw"], "other": "left_tail_joint"}}, "draw: expected sign"),
        ({"parameters": {"angle": 0.05}}, "parameters: expected those of its size"),
        ({"parameters": {"offset": 0.06}}, "parameters: expected those of its size"),
        ({"parameters": {"offset": None}}, "parameters: expected those of its size"),
    ],
)
def test_effects_it_cannot_have_are_named_in_one_line(change: dict, expected: str, tmp_path: Path) -> None:
    path = sealed(tmp_path / "robot.json", [{**OFFSET, **change}])
    with pytest.raises(BadInput, match=expected) as refused:
        read_sealed(path)
    assert "\n" not in str(refused.value) and "effects[0]" in str(refused.value)


@pytest.mark.parametrize("schema", [1, None, 3])
def test_a_robot_sealed_by_another_schema_is_refused(schema: int | None, tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"field schema: expected 2, came .*Run the stage seal again"):
        read_sealed(sealed(tmp_path / "robot.json", [OFFSET], schema))


@pytest.mark.parametrize("effects", [[3], {"a": 1}, [None]])
def test_what_is_no_effect_is_refused(effects: object, tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"robot\.json: effects"):
        read_sealed(sealed(tmp_path / "robot.json", effects))


@pytest.mark.parametrize("content", ["", "{}", "[]", "3", '{"effects": []}'])
def test_a_file_that_is_not_sealed_is_refused(tmp_path: Path, content: str) -> None:
    (tmp_path / "robot.json").write_text(content)
    with pytest.raises(BadInput, match=r"robot\.json"):
        read_sealed(tmp_path / "robot.json")
