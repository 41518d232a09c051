"""Geometry tells the roles of a robot whose names say nothing."""

from pathlib import Path

import pytest

from bumblebee.errors import BadInput
from bumblebee.new_robot.draft import draft
from bumblebee.new_robot.first_folder import draft_folder
from bumblebee.new_robot.maker import maker_of
from bumblebee.robot.mjcf import bodies_of
from tests.robot.made_up import mjcf


def drafted(tmp_path: Path, text: str):
    (tmp_path / "made.xml").write_text(text)
    path = tmp_path / "made.xml"
    return draft(path, "made", "made.xml", bodies_of(path), maker_of(path))


def test_roles_soles_and_stand_come_from_geometry(tmp_path: Path) -> None:
    said = drafted(tmp_path, mjcf()).said
    roles = said["key_bodies"]
    named = {role: value for role, value in roles.items() if isinstance(value, str)}
    assert named == {
        "pelvis": "hips",
        "torso": "chest",
        **{f"{side}_hip": f"{side[0]}_joint" for side in ("left", "right")},
        **{f"{side}_knee": f"{side[0]}_shin" for side in ("left", "right")},
        **{f"{side}_foot": f"{side[0]}_shoe" for side in ("left", "right")},
        **{f"{side}_shoulder": f"{side[0]}_upper" for side in ("left", "right")},
        **{f"{side}_elbow": f"{side[0]}_lower" for side in ("left", "right")},
    }
    assert roles["left_hand"][0] == "l_lower"
    assert said["stand"]["l_bend"] == said["stand"]["r_bend"] == 0.3
    x = [corner[0] for corner in said["soles"]["left"]]
    assert -0.07 < min(x) < 0 < 0.1 < max(x) < 0.15  # the shoe reaches from -0.07 to 0.15 m


def test_what_the_model_does_not_tell_is_asked(tmp_path: Path) -> None:
    made = drafted(tmp_path, mjcf())
    assert made.said["motors"] == {"every": {"velocity_limit": 20.0}}
    assert any("velocity_limit is a guess" in line for line in made.asked)
    without = drafted(tmp_path, mjcf(**{'<joint armature="0.02"/>': "<joint/>"}))
    assert without.said["motors"]["every"] == {"velocity_limit": 20.0, "armature": None}
    assert without.asked[0].startswith("motors: armature, which the model does not say")


def test_a_robot_without_a_second_leg_is_refused(tmp_path: Path) -> None:
    text = mjcf()
    start, end = text.index('<body name="r_rotor"'), text.index('<body name="chest"')
    motors = [f'<motor joint="r_{name}"' for name in ("yaw", "roll", "pitch", "bend", "tip", "tilt")]
    text = text[:start] + text[end:]
    for motor in motors:
        at = text.index(motor)
        text = text[:at] + text[text.index("/>", at) + 2 :]
    with pytest.raises(BadInput, match=r"expected two (arms|legs)"):
        drafted(tmp_path, text)


def test_the_folder_has_the_model_as_it_was_and_a_picture_with_every_role(tmp_path: Path) -> None:
    (tmp_path / "made.xml").write_text(mjcf())
    draft_folder(tmp_path / "made.xml", tmp_path / "robot")
    assert (tmp_path / "robot" / "made.xml").read_text() == mjcf()
    picture = (tmp_path / "robot" / "robot.svg").read_text()
    assert all(role in picture for role in ("left_hand", "right_knee", "torso"))
    with pytest.raises(BadInput, match="expected a new folder"):
        draft_folder(tmp_path / "made.xml", tmp_path / "robot")
    draft_folder(tmp_path / "made.xml", tmp_path / "robot", overwrite=True)
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.tex").write_text("...")
    with pytest.raises(BadInput, match="or a robot's folder to replace, came something else"):
        draft_folder(tmp_path / "made.xml", tmp_path / "mine", overwrite=True)
    assert (tmp_path / "mine" / "thesis.tex").exists()
