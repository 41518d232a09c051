"""The command line: status 0 when done, status 2 and one line on standard error for unusable input."""

import json
import os
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import bumblebee
from bumblebee.errors import BadInput
from bumblebee.measured.rollout import Rollout, write_rollout
from tests.commands.conftest import XML, run


@pytest.mark.parametrize("more", [(), ("--out", "found"), ("--quick",)])
def test_paths_that_are_not_there_or_exchanged_are_said_first(data: Path, capsys, more: tuple[str, ...]) -> None:
    model, folder = data / "model.xml", data / "set"
    for paths, said in (
        ((data / "nosuch.xml", folder), f"nosuch.xml: expected an MJCF file, came no such file or folder. `ls {data}`"),
        ((model, data / "no"), f"rollouts/*.parquet, came no such file or folder. `ls {data}` lists what is there."),
        ((folder, model), f"came the folder first. Exchange the two: {model} {folder}"),
    ):
        assert run("diagnose", *paths, *more) == 2
        assert said in capsys.readouterr().err
    for command in ("gap", "replay"):
        assert run(command, folder, model, *(["--out", data / "out"] if command == "replay" else [])) == 2
        assert "Exchange the two" in capsys.readouterr().err


def test_a_first_look_writes_nothing(data: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = sorted(data.rglob("*"))
    assert run("diagnose", data / "model.xml", data / "set", "--quick") == 0
    assert "furthest off" in capsys.readouterr().out
    assert sorted(data.rglob("*")) == before
    assert run("diagnose", data / "model.xml", data / "set", "--quick", "--out", data / "out") == 2
    assert run("diagnose", data / "model.xml", data / "set") == 2


def begun(*given) -> None:
    raise BadInput("the diagnosis", "to be begun", "begun")


def test_a_first_look_takes_as_many_windows_as_are_asked_for_and_names_the_whole_diagnosis(
    data: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    time = np.arange(500) / 50
    q, v = 0.2 * np.sin(3 * time)[:, None], 0.6 * np.cos(3 * time)[:, None]
    for name in ("a", "b"):
        place = data / "long" / "rollouts" / f"{name}.parquet"
        write_rollout(place, Rollout(name, ("j",), 50.0, time, q, v, joint_target=1.01 * q))
    command = ("diagnose", data / "model.xml", data / "long", "--quick")
    for options, count in ((("--max-windows", "8"), 8), ((), 40)):
        assert run(*command, *options) == 0
        said = capsys.readouterr().out
        assert f"] {count} windows of 0.2 s" in said
    (whole,) = (line for line in said.splitlines() if line.startswith("  bumblebee diagnose "))
    monkeypatch.chdir(data)
    monkeypatch.setattr("bumblebee.diagnosis.diagnose.diagnose", begun)
    assert run(*shlex.split(whole)[1:]) == 2
    assert "begun" in capsys.readouterr().err


def test_replay_and_gap_end_well(data: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Both write the error block, by horizon."""
    assert run("replay", data / "model.xml", data / "set", "--out", data / "errors.json") == 0
    assert run("gap", data / "model.xml", data / "set", "--out", data / "gap") == 0
    assert "joint position [mrad]" in capsys.readouterr().out
    errors = json.loads((data / "errors.json").read_text())
    assert set(errors) == {"0.02", "0.2", "1.0"}
    assert json.loads((data / "gap" / "gap.json").read_text())["error"] == errors
    page = (data / "gap" / "gap.html").read_text()
    assert "<svg" in page and "://" not in page
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
    first = "import mujoco\n" + ("from bumblebee.sim.quiet import quiet_mujoco\nquiet_mujoco()\n" if quiet else "")
    environment = os.environ | {"PYTHONPATH": str(Path.cwd())}
    subprocess.run([sys.executable, "-c", first + DIVERGE], cwd=tmp_path, check=True, env=environment)
    assert (tmp_path / "MUJOCO_LOG.TXT").exists() != quiet


@pytest.mark.parametrize(
    "arguments",
    [
        ("diagnose", "m", "d", "--out", "o", "--seed", "-1"),
        ("diagnose", "m", "d", "--out", "o", "--max-windows", "7"),
        ("diagnose", "m", "d", "--out", "o", "--seed", "one"),
        ("diagnose", "m"),
        ("replay", "m", "d", "--out"),
        ("nonsense",),
    ],
)
def test_unusable_options_are_one_line_and_status_two(
    arguments: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    """No box of five lines; the option and its range are in it."""
    assert run(*arguments) == 2
    said = capsys.readouterr()
    assert said.err.count("\n") == 1 and not said.out and "--help" in said.err


def test_an_unforeseen_error_is_one_line_with_a_log(
    data: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Status 1; the traceback is in the file that the line names."""
    from bumblebee.diagnosis import dataset

    def broken_product(*_: object) -> None:
        raise ZeroDivisionError("surprise")

    monkeypatch.setattr(dataset, "open_session", broken_product)
    assert run("gap", data / "model.xml", data / "set") == 1
    said = capsys.readouterr().err
    log = Path(said.split("with ")[-1].strip())
    assert said.count("\n") == 1 and "ZeroDivisionError" in log.read_text()
    log.unlink()


def test_the_module_says_its_version() -> None:
    """`python -m bumblebee --version`, from anywhere."""
    environment = os.environ | {"PYTHONPATH": str(Path.cwd())}
    command = [sys.executable, "-m", "bumblebee", "--version"]
    said = subprocess.run(command, capture_output=True, text=True, env=environment, check=True).stdout
    assert said == f"bumblebee {bumblebee.__version__}\n"


def test_commands_without_an_actuator_are_refused(data: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Nothing could move as it was told; the answer was once "nothing that these tests can see"."""
    (data / "passive.xml").write_text(XML.split("<actuator>")[0] + "</mujoco>")
    assert run("diagnose", data / "passive.xml", data / "set", "--out", data / "out") == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and "actuator" in said and "j" in said
