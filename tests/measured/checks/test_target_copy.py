"""Targets that repeat the measured positions are found; those of stiff servos and of robots that stand are commands."""

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pandas as pd
import pytest

from bumblebee.measured.checks import Finding, check_rollout
from bumblebee.measured.rollout import Rollout
from tests.commands.conftest import run
from tests.measured.simulated import ARM, ARM_JOINTS, arm_model, arm_rollout

MAP = """joints: [shoulder, elbow, wrist]
columns: {joint_pos: [q0, q1, q2], joint_vel: [v0, v1, v2], joint_target: [u0, u1, u2]}
meta: {kp: [40, 40, 40], kd: [2, 2, 2]}
"""


def copies(rollout: Rollout, model: mujoco.MjModel) -> list[Finding]:
    return [f for f in check_rollout(rollout, model) if f.rule == "target-copy"]


def copied(rollout: Rollout, rows: int, joints: slice = slice(None)) -> Rollout:
    """The rollout with positions of `rows` later in the place of some joints' targets, as float32."""
    target = np.array(rollout.joint_target)
    place = np.roll(rollout.joint_pos, -rows, axis=0)[:, joints]
    target[:, joints] = place.astype(np.float32)
    return replace(rollout, joint_target=target)


@pytest.mark.parametrize(("rows", "said"), [(0, "the same row"), (1, "the next row"), (-1, "the row before")])
def test_positions_in_the_place_of_targets_are_fatal_and_the_row_is_named(rows: int, said: str) -> None:
    found = copies(copied(arm_rollout(0), rows), arm_model())
    assert [f.column for f in found] == [f"joint_target[{name}]" for name in ARM_JOINTS]
    assert all(f.fatal and f"the measured positions of {said}" in f.came for f in found)
    assert "Log the targets" in found[0].message


def test_the_joints_that_are_commanded_are_not_named() -> None:
    found = copies(copied(arm_rollout(0), 1, slice(1, 2)), arm_model())
    assert [f.column for f in found] == ["joint_target[elbow]"]
    assert copies(arm_rollout(0), arm_model()) == []


@pytest.mark.parametrize("steps", [False, True])
def test_a_stiff_servo_is_a_servo(steps: bool) -> None:
    """It follows within a milliradian, and no sensor has any noise."""
    xml = ARM.replace('<option timestep="0.002"', '<option timestep="0.0005" gravity="0 0 0"')
    lines = "".join(f'<position name="{name}" joint="{name}" kp="40000" kv="40"/>' for name in ARM_JOINTS)
    model = mujoco.MjModel.from_xml_string(xml.replace("ACTUATORS", lines))
    data, time, states = mujoco.MjData(model), np.arange(400) / 100, []
    wave = 0.5 * np.sin(1.5 * time)[:, None] * [1, 0.6, 0.3]
    targets = np.round(wave, 1) if steps else wave
    for target in targets:
        states.append([data.qpos.copy(), data.qvel.copy()])
        data.ctrl[:] = target
        mujoco.mj_step(model, data, 20)
    place, speed = np.array(states).transpose(1, 0, 2)
    assert np.median(np.abs(place[1:] - targets[:-1])) < 1e-3
    rollout = Rollout("stiff", ARM_JOINTS, 100.0, time, place, speed, joint_target=targets)
    assert copies(rollout, model) == []


def test_a_robot_that_stands_on_the_ticks_of_its_encoder_is_not_accused() -> None:
    still = np.tile(np.array([0.3, -0.2, 0.1]), (300, 1))
    flicker = still.copy()
    flicker[40:45, 1] += 0.001
    rollout = replace(arm_rollout(0), joint_pos=flicker, joint_vel=0 * still, joint_target=still)
    assert copies(replace(rollout, joint_pos=still), arm_model()) == copies(rollout, arm_model()) == []


def test_the_remedy_that_is_printed_is_taken(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """`gap` and `diagnose --quick` end in a line; imported as it says, the same logs are analysed."""
    (tmp_path / "logs").mkdir()
    for seed in range(3):
        r = copied(arm_rollout(seed), 1)
        table = {"time": r.time}
        for name, values in (("q", r.joint_pos), ("v", r.joint_vel), ("u", r.joint_target)):
            table |= {f"{name}{k}": values[:, k] for k in range(3)}
        pd.DataFrame(table).to_csv(tmp_path / "logs" / f"run{seed}.csv", index=False)
    (tmp_path / "map.yaml").write_text(MAP)
    lines = "".join(f'<position name="{name}" joint="{name}" kp="40" kv="2"/>' for name in ARM_JOINTS)
    model = tmp_path / "model.xml"
    model.write_text(ARM.replace("ACTUATORS", lines))
    bring = ("import", tmp_path / "logs", "--kind", "csv", "--columns", tmp_path / "map.yaml", "--model", model)
    assert run(*bring, tmp_path / "set") == 0
    for command in (("gap",), ("diagnose", "--quick")):
        assert run(command[0], model, tmp_path / "set", *command[1:]) == 2
        said = capsys.readouterr().err
        assert said.count("\n") == 1 and "the measured positions of the next row" in said and "Log the targets" in said
    remedy = said.split("import with ")[1].strip().removesuffix(".").split()
    assert run(*bring, tmp_path / "again", *remedy) == 0
    assert run("gap", model, tmp_path / "again") == 0


@pytest.mark.parametrize("said", ["targets=position", "targets", "=3", "a=", "kp=x", "added_mass=3"])
def test_a_setting_that_is_no_condition_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], said: str
) -> None:
    (tmp_path / "log.csv").write_text("time,q,u\n" + "".join(f"{k / 50},{k},{k}\n" for k in range(9)))
    (tmp_path / "map.yaml").write_text("joints: [hip]\ncolumns: {joint_pos: q, joint_target: u}\n")
    bring = ("import", tmp_path / "log.csv", tmp_path / "set", "--kind", "csv", "--columns", tmp_path / "map.yaml")
    assert run(*bring, "--set", said) == 2
    assert "--set" in capsys.readouterr().err and not (tmp_path / "set").exists()
