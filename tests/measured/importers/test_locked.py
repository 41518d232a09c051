"""Joints that the robot has locked: named where they are in the way, and left out of log and model by one key."""

from pathlib import Path

import mujoco
import numpy as np
import pandas as pd
import pytest

from bumblebee.errors import BadInput
from bumblebee.measured.importers import import_dataset
from bumblebee.measured.model_file import copy_model
from bumblebee.measured.rollout import read_dataset
from tests.commands.conftest import run
from tests.measured.simulated import ARM, ARM_JOINTS, excitation

SERVOS = ARM.replace(
    "ACTUATORS", "".join(f'<position name="{name}" joint="{name}" kp="40" kv="2"/>' for name in ARM_JOINTS)
)
LISTED = "columns: {joint_pos: [q0, q1, q2], joint_target: [u0, u1, u2], kp: [p0, p1, p2], kd: [d0, d1, d2]}\n"
MAP = f"joints: [shoulder, elbow, wrist]\n{LISTED}"
OUT = f"joints: [shoulder, _, wrist]\n{LISTED}"
LOCKED = f"{OUT}locked: [elbow]\n"


@pytest.fixture
def logs(tmp_path: Path) -> Path:
    """Two logs of an arm whose elbow is bolted, with slots of zeros for it, and the model with its motor."""
    (tmp_path / "logs").mkdir()
    (tmp_path / "model.xml").write_text(SERVOS)
    copy_model(tmp_path / "model.xml", tmp_path / "true.xml", ["elbow"])
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "true.xml"))
    for seed in range(2):
        rng, data, time = np.random.default_rng(seed), mujoco.MjData(model), np.arange(200) / 50
        targets, rows = excitation(rng, time, 2, 0.8), []
        for target in targets:
            rows.append(data.qpos + 5e-4 * rng.standard_normal(2))
            data.ctrl[:] = target
            mujoco.mj_step(model, data, 10)
        table = {"time": time}
        for name, values in (("q", np.array(rows)), ("u", targets), ("p", 40 + 0 * targets), ("d", 2 + 0 * targets)):
            for k, column in enumerate((values[:, 0], 0 * time, values[:, 1])):
                table[f"{name}{k}"] = column
        pd.DataFrame(table).to_csv(tmp_path / "logs" / f"run{seed}.csv", index=False)
    return tmp_path


def imported(folder: Path, text: str) -> None:
    (folder / "map.yaml").write_text(text)
    import_dataset(folder / "logs", "csv", folder / "set", folder / "model.xml", folder / "map.yaml")


@pytest.mark.parametrize(("text", "says"), [(MAP, "kp 0 of elbow"), (OUT, "came all but elbow")])
def test_the_joint_in_the_way_is_named_with_the_key_that_helps(logs: Path, text: str, says: str) -> None:
    with pytest.raises(BadInput, match=rf"{says}\. .*has _ in its place in joints, and .* under locked"):
        imported(logs, text)
    assert not (logs / "set").exists()


def test_a_locked_joint_is_in_neither_log_nor_model_and_the_commands_take_both(
    logs: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    imported(logs, LOCKED)
    dataset = read_dataset(logs / "set")
    assert {rollout.joints for rollout in dataset.rollouts} == {("shoulder", "wrist")}
    assert dataset.rollouts[0].meta["kp"] == [40, 40]
    assert run("gap", logs / "model.xml", logs / "set") == 2
    said = capsys.readouterr().err
    assert "no column for elbow" in said and "give the model.xml that lies in the dataset" in said
    assert run("gap", logs / "set" / "model.xml", logs / "set") == 0
    assert "WARNING" not in capsys.readouterr().out


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (f"{MAP}locked: [elbow]\n", "not under joints, came elbow"),
        (f"{OUT}locked: [elbwo]\n", "came 'elbwo'.*The nearest is elbow"),
        (f"{OUT}locked: [3]\n", "locked"),
    ],
)
def test_a_key_that_contradicts_map_or_model_is_one_line(logs: Path, text: str, says: str) -> None:
    with pytest.raises(BadInput, match=says):
        imported(logs, text)


def test_a_locked_joint_takes_what_refers_to_it_along(tmp_path: Path) -> None:
    more = (
        '<sensor><jointpos joint="elbow"/><actuatorfrc actuator="elbow"/><jointvel joint="wrist"/></sensor>'
        '<equality><joint joint1="elbow" joint2="wrist"/></equality>'
        '<keyframe><key qpos=".1 .2 .3" ctrl=".1 .2 .3"/></keyframe></mujoco>'
    )
    (tmp_path / "a.xml").write_text(SERVOS.replace("</mujoco>", more))
    copy_model(tmp_path / "a.xml", tmp_path / "b.xml", ["elbow"])
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "b.xml"))
    assert (model.nq, model.nu, model.neq, model.nsensor) == (2, 2, 0, 1)
    np.testing.assert_allclose(model.key_qpos, [[0.1, 0.3]])
    tendon = '<tendon><fixed><joint joint="elbow" coef="1"/><joint joint="wrist" coef="1"/></fixed></tendon></mujoco>'
    (tmp_path / "a.xml").write_text(SERVOS.replace("</mujoco>", tendon))
    with pytest.raises(BadInput, match="loads without elbow"):
        copy_model(tmp_path / "a.xml", tmp_path / "b.xml", ["elbow"])
