"""The table of facts is self-consistent and in the field's order."""

import numpy as np

from bumblebee.robot.facts import ANKLE_JOINTS, HELD_JOINTS, KEY_BODIES, joint_names, joints, robot_bodies, stand_pose


def test_the_23_are_the_29_without_the_wrists() -> None:
    assert len(joint_names(every=True)) == 29
    assert joint_names() == tuple(n for n in joint_names(every=True) if n not in HELD_JOINTS)
    assert len(joint_names()) == 23


def test_parents_come_before_their_children() -> None:
    seen = {"world"}
    for name, body in robot_bodies().items():
        assert body["parent"] in seen, name
        seen.add(name)


def test_left_and_right_are_mirror_images() -> None:
    """Reflection in the xz plane: y and the axes of roll and yaw change sign, everything else stays."""
    for left, right in ((n, n.replace("left", "right", 1)) for n in joint_names(every=True) if n.startswith("left")):
        a, b = (next(j for j in joints(every=True) if j.name == n) for n in (left, right))
        assert (a.effort_limit, a.velocity_limit, a.armature) == (b.effort_limit, b.velocity_limit, b.armature)
        mirrored = b.range if "pitch" in left or "knee" in left or "elbow" in left else (-b.range[1], -b.range[0])
        np.testing.assert_allclose(a.range, mirrored, atol=1e-6, err_msg=left)


def test_tracked_bodies_and_ankles_exist() -> None:
    assert set(KEY_BODIES) <= set(robot_bodies())
    assert len(KEY_BODIES) == 14
    assert set(ANKLE_JOINTS) <= set(joint_names())


def test_the_stand_is_within_limits_and_symmetric() -> None:
    pose = dict(zip(joint_names(), stand_pose(), strict=True))
    for joint in joints():
        assert joint.range[0] <= pose[joint.name] <= joint.range[1]
    assert pose["left_knee_joint"] == pose["right_knee_joint"] == 0.3
    assert pose["left_shoulder_roll_joint"] == -pose["right_shoulder_roll_joint"] == 0.2
