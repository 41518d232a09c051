"""A map beside the declared model: joints it lacks, and units that do not suit their kind."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from bumblebee import cli
from bumblebee.errors import BadInput
from bumblebee.measured.importers import import_dataset, read_rollouts
from bumblebee.measured.rollout import Rollout

CART = (
    "<mujoco><worldbody><body><joint name='slider' type='slide' axis='1 0 0'/><geom size='.1'/>"
    "<body><joint name='wrist' axis='0 1 0'/><geom size='.1'/></body></body></worldbody>"
    "<actuator><position joint='slider' kp='10'/></actuator></mujoco>"
)
MAP = "joints: [slider, wrist]\ncolumns: {joint_pos: [x, q], joint_target: [u, w]}\n"
ROWS = "\n".join(["time,x,q,u,w", *(f"{0.02 * k:.2f},0.5,90,0.25,45" for k in range(20))])


def read(folder: Path, text: str, model: str | None = CART) -> Rollout:
    (folder / "log.csv").write_text(ROWS)
    (folder / "map.yaml").write_text(text)
    given = mujoco.MjModel.from_xml_string(model) if model else None
    (rollout,) = read_rollouts(folder / "log.csv", "csv", given, folder / "map.yaml")
    return rollout


@pytest.mark.parametrize("unit", ["rad", "deg", "turn", "[deg, deg]"])
def test_a_slide_in_a_unit_of_angles_is_refused(tmp_path: Path, unit: str) -> None:
    with pytest.raises(BadInput, match=r"angle_unit: expected m for slider, which is a slide.*a list.*m.*0\.001"):
        read(tmp_path, f"{MAP}angle_unit: {unit}\n")
    assert read(tmp_path, f"{MAP}angle_unit: {unit}\n", None).frames == 20  # without a model nobody can tell


@pytest.mark.parametrize("unit", ["m", "[m, m]"])
def test_a_hinge_in_metres_is_refused(tmp_path: Path, unit: str) -> None:
    with pytest.raises(BadInput, match="for wrist, which is no slide"):
        read(tmp_path, f"{MAP}angle_unit: {unit}\n")


def test_a_unit_a_joint_leaves_metres_alone(tmp_path: Path) -> None:
    rollout = read(tmp_path, f"{MAP}angle_unit: [m, deg]\n")
    np.testing.assert_allclose(rollout.joint_pos[0], [0.5, np.pi / 2])
    np.testing.assert_allclose(read(tmp_path, MAP).joint_pos[0], [0.5, 90])  # unstated: the contract's rad and m


def test_millimetres_are_said_by_a_factor(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"Say m, and factors of 0\.001 under scale"):
        read(tmp_path, f"{MAP}angle_unit: [mm, deg]\n")
    text = f"{MAP}angle_unit: [m, deg]\nscale: {{joint_pos: [0.001, 1]}}\n"
    assert read(tmp_path, text).joint_pos[0, 0] == 0.5e-3


def test_a_joint_that_the_model_lacks_is_refused_with_the_nearest_and_nothing_is_written(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"map\.yaml: joints: expected joints of the model, came 'wirst'.*wrist"):
        read(tmp_path, MAP.replace("wrist", "wirst"))
    (tmp_path / "model.xml").write_text(CART)
    with pytest.raises(BadInput, match="wirst"):
        import_dataset(
            tmp_path / "log.csv", "csv", tmp_path / "out", tmp_path / "model.xml", tmp_path / "map.yaml"
        )  # fmt: skip
    assert not (tmp_path / "out").exists()


PASSIVE = MAP.replace("[u, w]", "[u, _]") + "angle_unit: [m, deg]\n"


def test_nobody_commands_a_joint_without_an_actuator(tmp_path: Path) -> None:
    """Its target is 0 whatever scale and offset say, and no cell counts as lost."""
    rollout = read(tmp_path, PASSIVE + "scale: {joint_target: 2}\noffset: {joint_target: [0.1, 0.3]}\n")
    assert rollout.joint_target is not None
    np.testing.assert_allclose(rollout.joint_target, np.tile([0.6, 0.0], (20, 1)))
    np.testing.assert_allclose(rollout.joint_pos[0], [0.5, np.pi / 2])
    assert "cells without a number" not in rollout.meta["notes"]
    torques = read(tmp_path, PASSIVE.replace("joint_target", "joint_torque_cmd"))
    assert torques.joint_torque_cmd is not None
    np.testing.assert_allclose(torques.joint_torque_cmd, np.tile([0.25, 0.0], (20, 1)))


def test_a_driven_joint_without_a_command_is_refused_in_one_line(tmp_path: Path) -> None:
    driven = r"map\.yaml: columns: joint_target: expected the column of slider, which an actuator of the model drives"
    with pytest.raises(BadInput, match=driven):
        read(tmp_path, PASSIVE.replace("[u, _]", "[_, w]"))
    with pytest.raises(BadInput, match=r"expected the declared model .* wrist has no actuator.*--model"):
        read(tmp_path, PASSIVE, None)


@pytest.mark.parametrize("change", [("[u, _]", "[_, _]"), ("[u, _]", "_"), ("[x, q]", "[x, _]")])
def test_only_some_commands_may_be_absent(tmp_path: Path, change: tuple[str, str]) -> None:
    with pytest.raises(BadInput, match=r"columns: joint_\w+: expected names in the file, came '_'"):
        read(tmp_path, PASSIVE.replace(*change))


def test_only_a_csv_may_lack_a_command(tmp_path: Path) -> None:
    (tmp_path / "map.yaml").write_text(f"{PASSIVE}hz: 50\n")
    with pytest.raises(BadInput, match=r"columns: joint_target: expected names in the file, came '_'"):
        read_rollouts(tmp_path / "log.hdf5", "hdf5", mujoco.MjModel.from_xml_string(CART), tmp_path / "map.yaml")


PAIR = "<tendon><fixed name='t'><joint joint='slider' coef='1'/></fixed></tendon>"
UNLIKE = {
    "no column for it": MAP.replace(", wrist", "").replace(", q", "").replace(", w", ""),
    "one on a tendon": f"{MAP}angle_unit: [m, deg]\n",
}


@pytest.mark.parametrize("said", UNLIKE)
def test_a_model_that_diagnose_would_refuse_is_refused_at_import_and_nothing_is_written(
    said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    model = CART
    if "tendon" in said:
        model = model.replace("<actuator>", f"{PAIR}<actuator><motor tendon='t'/>")
    for name, text in {"log.csv": ROWS, "map.yaml": UNLIKE[said], "model.xml": model}.items():
        (tmp_path / name).write_text(text)
    given = ["import", tmp_path / "log.csv", tmp_path / "set", "--kind", "csv", "--columns", tmp_path / "map.yaml"]
    monkeypatch.setattr("sys.argv", ["bumblebee", *map(str, given), "--model", str(tmp_path / "model.xml")])
    with pytest.raises(SystemExit) as end:
        cli.main()
    line = capsys.readouterr().err
    assert end.value.code == 2 and line.count("\n") == 1 and said in line
    assert sorted(path.name for path in tmp_path.iterdir()) == ["log.csv", "map.yaml", "model.xml"]
