"""Geometry tells the roles of a robot whose names say nothing."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.new_robot.draft import draft
from bumblebee.new_robot.first_folder import draft_folder
from bumblebee.new_robot.maker import maker_of
from bumblebee.robot.mjcf import bodies_of
from tests.robot.made_up import mjcf

_MASS = '<inertial pos="0 0 0" mass="1" diaginertia="0.002 0.002 0.002"/>'
_SPIN = '<actuator><motor joint="spin" ctrlrange="-80 80"/>'


def made(tmp_path: Path) -> Path:
    (tmp_path / "plain.xml").write_text(mjcf())
    return tmp_path / "plain.xml"


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


def test_a_rotor_that_the_motor_has_is_the_joints(tmp_path: Path) -> None:
    made(tmp_path)
    own = bodies_of(tmp_path / "plain.xml")["l_shin"]["joint"]
    spec = mujoco.MjSpec.from_file(str(tmp_path / "plain.xml"))
    motor = next(a for a in spec.actuators if a.target == own["name"])
    motor.gear, motor.armature, motor.damping = [10.0, *motor.gear[1:]], 0.0005, [0.002, 0.0, 0.0]
    (tmp_path / "geared.xml").write_text(spec.to_xml())
    geared = bodies_of(tmp_path / "geared.xml")["l_shin"]["joint"]
    assert geared["armature"] == pytest.approx(own["armature"] + 0.05)
    assert geared["damping"] == pytest.approx(own.get("damping", 0.0) + 0.2)


def test_a_keyframe_named_after_a_stand_is_the_stand(tmp_path: Path) -> None:
    joints = ["l_yaw", "l_roll", "l_pitch", "l_bend", "l_tip", "l_tilt"]
    qpos = "0 0 0.9 1 0 0 0 " + " ".join("0.5" if name == "l_bend" else "0" for name in joints) + " 0" * 14
    key = f'<keyframe><key name="home" qpos="{qpos}"/></keyframe></mujoco>'
    assert drafted(tmp_path, mjcf(**{"</mujoco>": key})).said["stand"] == {"l_bend": 0.5}


def test_a_sole_is_the_makers_box_also_in_a_tilted_frame(tmp_path: Path) -> None:
    shoe = '<geom type="box" size="0.11 0.045 0.015" pos="0.04 0 -0.055"/>'
    flat = np.array(drafted(tmp_path, mjcf()).said["soles"]["left"])
    np.testing.assert_allclose(flat.min(axis=0), [-0.06, -0.035, -0.06], atol=1e-3)
    np.testing.assert_allclose(flat.max(axis=0), [0.14, 0.035, -0.06], atol=1e-3)
    turn = np.array([[np.cos(0.3), 0, np.sin(0.3)], [0, 1, 0], [-np.sin(0.3), 0, np.cos(0.3)]])
    place = turn.T @ [0.04, 0, -0.055]
    level = f'<geom type="box" size="0.11 0.045 0.015" pos="{place[0]} 0 {place[2]}" euler="0 -0.3 0"/>'
    tilted = mjcf(**{shoe: level, '<body name="l_shoe">': '<body name="l_shoe" euler="0 0.3 0">'})
    corners = np.array(drafted(tmp_path, tilted).said["soles"]["left"])
    assert np.ptp(corners[:, 2]) > 0.02
    np.testing.assert_allclose(corners @ turn.T, flat, atol=1e-3)


def test_what_touches_nothing_is_no_sole_and_no_shape_but_where_nothing_touches_at_all(tmp_path: Path) -> None:
    shoe = '<geom type="box" size="0.11'
    shell = f'<geom contype="0" conaffinity="0" size="0.3"/>{shoe}'
    (tmp_path / "shell.xml").write_text(mjcf(**{shoe: shell}))
    assert maker_of(tmp_path / "shell.xml").boxes.keys() == maker_of(made(tmp_path)).boxes.keys()
    assert len(bodies_of(tmp_path / "shell.xml")["l_shoe"]["collision"]) == 1
    nothing = mjcf(**{"<default>": '<default><geom contype="0" conaffinity="0"/>'})
    (tmp_path / "nothing.xml").write_text(nothing)
    assert bodies_of(tmp_path / "nothing.xml") == bodies_of(made(tmp_path))


def test_an_elbow_bends_and_a_hand_is_what_is_fixed_to_the_arm(tmp_path: Path) -> None:
    curl = '<geom type="capsule" size="0.035" fromto="0 0 0 0 0 -0.22"/>'
    twist = f"""{curl}<body name="wrist" pos="0 0 -0.11"><joint name="elbow_twist" axis="0 0 1" range="-1 1"/>
<inertial pos="0 0 -0.05" mass="0.2" diaginertia="1e-4 1e-4 1e-4"/><body name="palm" pos="0 0 -0.15"/></body>"""
    text, parts = mjcf(), []
    for number, part in enumerate(text.split(curl)):
        side = "lr"[number] if number < 2 else ""
        own = twist.replace('"wrist"', f'"{side}_wrist"').replace('"palm"', f'"{side}_palm"')
        parts += [part, own.replace("elbow_twist", f"{side}_elbow_twist") if number < 2 else ""]
    motors = "".join(f'<motor joint="{side}_elbow_twist" ctrlrange="-9 9"/>' for side in "lr")
    roles = drafted(tmp_path, "".join(parts).replace("</actuator>", f"{motors}</actuator>")).said["key_bodies"]
    assert (roles["left_elbow"], roles["left_hand"]) == ("l_lower", "l_palm")


def test_a_waist_below_the_floating_body_makes_the_torso_a_point_of_it(tmp_path: Path) -> None:
    spin, motor = '<joint name="spin" axis="0 0 1" range="-1.5 1.5"/>', '<motor joint="spin" ctrlrange="-80 80"/>'
    text = mjcf(**{spin: "", motor: ""})
    legs = text[text.index('<body name="l_rotor"') : text.index('<body name="chest"')]
    below = f'<body name="waist"><joint name="spin" axis="0 0 1" range="-1 1"/>{_MASS}{legs}</body>'
    said = drafted(tmp_path, text.replace(legs, below).replace("<actuator>", _SPIN)).said
    body, place = said["key_bodies"]["torso"]
    assert (body, said["key_bodies"]["pelvis"]) == ("hips", "hips") and place[2] > 0.1


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
