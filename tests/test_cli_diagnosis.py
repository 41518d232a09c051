"""The command line: status 0 when done, status 2 and one line on standard error for unusable input."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from bumblebee import cli
from bumblebee.measured.rollout import Rollout, write_rollout

XML = """<mujoco><compiler angle="radian"/><option timestep="0.005"/><worldbody>
<body name="l"><joint name="j" axis="0 1 0" armature=".01"/>
<inertial pos="0 0 .1" mass="1" diaginertia=".01 .01 .01"/></body></worldbody>
<actuator><position name="j" joint="j" kp="30" kv="2"/></actuator></mujoco>"""


def run(*arguments: object) -> int:
    """Exit status of `bumblebee ARGUMENTS`."""
    before, sys.argv = sys.argv, ["bumblebee", *map(str, arguments)]
    try:
        cli.main()
    except SystemExit as end:
        return int(end.code or 0)
    finally:
        sys.argv = before
    return 0


@pytest.fixture
def data(tmp_path: Path) -> Path:
    """A dataset of two short rollouts that hang still but for a swing."""
    rng = np.random.default_rng(0)
    time = np.arange(60) / 50
    for name in ("a", "b"):
        q = 0.2 * np.sin(3 * time)[:, None] + 5e-4 * rng.standard_normal((60, 1))
        v = 0.6 * np.cos(3 * time)[:, None] + 0.02 * rng.standard_normal((60, 1))
        rollout = Rollout(name, ("j",), 50.0, time, q, v, joint_target=0.2 * np.sin(3 * time + 0.2)[:, None])
        write_rollout(tmp_path / "set" / "rollouts" / f"{name}.parquet", rollout)
    (tmp_path / "model.xml").write_text(XML)
    return tmp_path


def test_replay_and_gap_end_well(data: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Both write the error block, by horizon."""
    assert run("replay", data / "model.xml", data / "set", "--out", data / "errors.json") == 0
    assert run("gap", data / "model.xml", data / "set", "--out", data / "gap") == 0
    assert "joint position [mrad]" in capsys.readouterr().out
    errors = json.loads((data / "errors.json").read_text())
    assert set(errors) == {"0.02", "0.2", "1.0"}
    assert json.loads((data / "gap" / "gap.json").read_text())["error"] == errors
    page = (data / "gap" / "gap.html").read_text()
    assert "<svg" in page and "http" not in page
    assert run("gap", data / "model.xml", data / "set", "--out", data / "gap") == 2


@pytest.mark.parametrize("command", ["diagnose", "replay"])
def test_unusable_input_is_one_line_and_status_two(
    data: Path, capsys: pytest.CaptureFixture[str], command: str
) -> None:
    """No such model, no such dataset, a model without the logged joint."""
    (data / "other.xml").write_text(XML.replace('name="j"', 'name="k"').replace('joint="j"', 'joint="k"'))
    for model, folder in (("none.xml", "set"), ("model.xml", "nowhere"), ("other.xml", "set")):
        assert run(command, data / model, data / folder, "--out", data / "out") == 2
        assert capsys.readouterr().err.count("\n") == 1
    assert not (data / "out").exists()


def test_hostile_effects_are_refused(data: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """YAML that would build objects, and places that the model does not have."""
    bad = [
        "!!python/object/apply:os.system ['true']",
        "schema: 1\neffects: [{effect: armature, where: [x], parameters: {armature: 1}}]",
    ]
    for text in bad:
        (data / "effects.yaml").write_text(text)
        assert (
            run(
                "replay", data / "model.xml", data / "set", "--effects", data / "effects.yaml", "--out", data / "e.json"
            )
            == 2
        )
        assert capsys.readouterr().err.count("\n") == 1


def broken(data: Path, name: str) -> None:
    """A rollout with a NaN in row 7."""
    q = np.zeros((60, 1))
    q[7] = np.nan
    rollout = Rollout(name, ("j",), 50.0, np.arange(60) / 50, q, np.zeros((60, 1)), joint_target=np.zeros((60, 1)))
    place = data / "set" / "rollouts" / f"{name}.parquet"
    place.unlink(missing_ok=True)
    write_rollout(place, rollout)


def test_a_cell_that_is_not_a_number_names_file_column_and_row(data: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Where no rollout is usable the diagnosis ends before it begins."""
    for name in ("a", "b"):
        broken(data, name)
    assert run("diagnose", data / "model.xml", data / "set", "--out", data / "out") == 2
    line = capsys.readouterr().err
    assert "a.parquet: column joint_pos[j], row 7: rule finite" in line and line.count("\n") == 1


def test_one_bad_file_is_set_aside_with_its_reason(data: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A NaN and a file that is no Parquet: the others are diagnosed, both are named."""
    broken(data, "c")
    (data / "set" / "rollouts" / "d.parquet").write_text("not Parquet")
    assert run("diagnose", data / "model.xml", data / "set", "--out", data / "out") == 0
    aside = json.loads((data / "out" / "diagnosis.json").read_text())["set_aside"]
    assert {entry["rollout"] for entry in aside} == {"c", "d"}
    assert "row 7" in next(entry["reason"] for entry in aside if entry["rollout"] == "c")
    assert "set aside" in capsys.readouterr().out


def test_a_model_that_blows_up_is_unusable(data: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A servo of the wrong sign diverges from every measured state."""
    (data / "bad.xml").write_text(XML.replace('kp="30" kv="2"', 'kp="-9000" kv="0"'))
    assert run("diagnose", data / "bad.xml", data / "set", "--out", data / "out") == 2
    assert "diverge" in capsys.readouterr().err
    assert not (data / "out").exists()


DIVERGE = """x = '<mujoco><worldbody><body><joint/><geom size=".1"/></body></worldbody></mujoco>'
m = mujoco.MjModel.from_xml_string(x)
d = mujoco.MjData(m)
d.qvel[:] = 1e12
mujoco.mj_step(m, d)"""


@pytest.mark.parametrize("quiet", [True, False])
def test_a_simulation_that_diverges_leaves_no_log_where_the_user_is(tmp_path: Path, quiet: bool) -> None:
    """Some of what a diagnosis tries diverges; MuJoCo alone would write MUJOCO_LOG.TXT into the working folder."""
    first = "import mujoco\n" + ("from bumblebee.cli import quiet\nquiet()\n" if quiet else "")
    environment = os.environ | {"PYTHONPATH": str(Path.cwd())}
    subprocess.run([sys.executable, "-c", first + DIVERGE], cwd=tmp_path, check=True, env=environment)
    assert (tmp_path / "MUJOCO_LOG.TXT").exists() != quiet
