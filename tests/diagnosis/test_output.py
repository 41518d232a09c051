"""The four files of the contract."""

import copy
import json
import tempfile
from pathlib import Path

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.output import corrected_xml, write_diagnosis
from bumblebee.diagnosis.report.example_windows import examples
from bumblebee.diagnosis.report.page import render_report
from bumblebee.diagnosis.report.terminal import plot, summary
from bumblebee.errors import BadInput
from bumblebee.sim.effects import read_effects, single
from tests.diagnosis.arm import XML

CASE = {("motor_strength", "j3"): 0.85}


def test_the_files_keep_the_contract(diagnosed, tmp_path: Path) -> None:
    """Names, keys and ids as the contract has them; the corrected model loads in plain MuJoCo."""
    write_diagnosis(diagnosed(CASE, seed=3), tmp_path / "out")
    assert {p.name for p in (tmp_path / "out").iterdir()} == {
        "diagnosis.json",
        "model.xml",
        "effects.yaml",
        "report.html",
    }
    document = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert document["schema"] == 1
    assert sorted(document["train"] + document["holdout"]) == ["r00", "r01", "r02"]
    assert set(document["effects"][0]) == {
        "effect",
        "where",
        "parameters",
        "equivalent",
        "explains",
        "evidence",
        "native",
    }
    assert set(document["unexplained"]) == {"significant", "p", "where", "depends_on", "description"}
    for part in ("before", "after", "floor"):
        assert list(document["error"][part]) == ["0.02", "0.2", "1.0"]
        assert set(document["error"][part]["0.2"]) >= {"joint_pos_rmse", "joint_vel_rmse", "chi2"}
        assert set(document["error"][part]["0.2"]["joint_pos_rmse"]["per_joint"]) == {"j1", "j2", "j3"}
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "out" / "model.xml"))
    assert model.actuator("j3").gainprm[0] == pytest.approx(0.85 * 30, rel=0.01)
    (effect,) = read_effects(tmp_path / "out" / "effects.yaml")
    assert (effect.effect, effect.where) == ("motor_strength", ("j3",))


def test_an_effect_that_mjcf_cannot_carry_costs_its_place_in_the_model_and_a_note() -> None:
    spec = mujoco.MjSpec.from_string(XML)
    effects = [
        single("viscous_friction", "j1", 0.3),
        single("motor_strength", "j9", 0.8),
        single("armature", "j3", 0.02),
    ]
    xml, notes = corrected_xml(spec, effects)
    model = mujoco.MjModel.from_xml_string(xml)
    assert model.dof_damping[0] == pytest.approx(0.3) and model.dof_armature[2] == pytest.approx(0.02)
    (note,) = notes
    assert note.startswith("model.xml is without motor_strength") and "j9" in note


def test_an_offset_of_a_passive_joints_encoder_is_no_obstacle_to_the_model() -> None:
    passive = XML.replace(XML[XML.index('<position name="j3"') : XML.index("</actuator>")], "")
    xml, notes = corrected_xml(mujoco.MjSpec.from_string(passive), [single("encoder_offset", "j3", 0.1)])
    assert not notes
    assert mujoco.MjModel.from_xml_string(xml).nu == 2


def test_an_earlier_diagnosis_is_replaced_only_when_told_and_nothing_else_ever(
    diagnosed, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Refused in one line; what cannot be written there is kept in the temporary folder."""
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "elsewhere"))
    write_diagnosis(diagnosed(CASE, seed=3), tmp_path / "out")
    with pytest.raises(BadInput, match="a diagnosis from before") as caught:
        write_diagnosis(diagnosed(CASE, seed=3), tmp_path / "out")
    kept = Path(str(caught.value).split("kept in ")[1].rstrip("."))
    assert (kept / "diagnosis.json").read_text() == (tmp_path / "out" / "diagnosis.json").read_text()
    write_diagnosis(diagnosed(CASE, seed=3), tmp_path / "out", overwrite=True)
    (tmp_path / "out" / "old.txt").write_text("mine")
    with pytest.raises(BadInput, match=r"old\.txt"):
        write_diagnosis(diagnosed(CASE, seed=3), tmp_path / "out", overwrite=True)
    assert (tmp_path / "out" / "old.txt").read_text() == "mine"


def test_text_from_files_cannot_become_markup(diagnosed) -> None:
    """Joint and rollout names are escaped in the report."""
    document = copy.deepcopy(diagnosed(CASE, seed=3).document)
    document["effects"][0]["where"] = ["<script>alert(1)</script>"]
    document["notes"] = ["<img src=x>"]
    example = {"joint": "<b>", "rollout": "</svg><script>", "start": 0.0, "time": [0.0, 1.0], "unit": "<i>"}
    page = render_report(document, [example | {name: [0.0, 1.0] for name in ("measured", "before", "after")}])
    assert "<script>" not in page
    assert "<img" not in page and "<b>" not in page.replace("<b>motor_strength</b>", "") and "<i>" not in page


def test_a_correction_that_is_worse_is_said_loudly(diagnosed) -> None:
    """At any horizon, in the page and in the terminal; and not where it is better everywhere."""
    document = copy.deepcopy(diagnosed(CASE, seed=3).document)
    assert "WORSE" not in render_report(document, []) and "WORSE" not in summary(document)
    document["error"]["after"]["1.0"]["joint_pos_rmse"]["value"] *= 100
    assert "WORSE after 1.0 s" in render_report(document, [])
    assert "WORSE after 1.0 s" in summary(document)


def test_the_terminal_shows_what_the_page_shows(diagnosed) -> None:
    """The effect, its interval, the errors and a window drawn with characters."""
    result = diagnosed(CASE, seed=3)
    text, (window,) = summary(result.document), examples(result.session, result.effects, count=1)
    assert "motor_strength" in text and "floor" in text
    assert window["joint"] == "j3" and set(plot(window)) >= {"#", "x"}
    before, after = (np.abs(np.subtract(window["measured"], window[k])).mean() for k in ("before", "after"))
    assert after < 0.3 * before
