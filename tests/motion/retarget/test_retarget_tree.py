"""Kinematics over all frames at once, against MuJoCo's frame by frame."""

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bumblebee.errors import BadInput
from bumblebee.motion.retarget.mapping import this_robot
from bumblebee.motion.retarget.tree import jacobian, points, poses, tree_of, turns
from tests.motion.retarget.robots import small_model

FRAMES = 4


def _states(count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(3)
    return rng.normal(size=(FRAMES, 3)), Rotation.random(FRAMES, rng).as_matrix(), rng.uniform(-1, 1, (FRAMES, count))


def _set(model: mujoco.MjModel, root: np.ndarray, turn: np.ndarray, joint: np.ndarray) -> mujoco.MjData:
    data = mujoco.MjData(model)
    data.qpos[:] = np.r_[root, np.roll(Rotation.from_matrix(turn).as_quat(), 1), joint]
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    return data


@pytest.fixture(params=["g1", "small"])
def model(request) -> mujoco.MjModel:
    return this_robot().model if request.param == "g1" else small_model()


def test_poses_axes_and_anchors_are_those_of_mujoco(model):
    tree = tree_of(model)
    root, turn, joint = _states(len(tree.joints))
    at = poses(tree, root, turn, joint)
    for t in range(FRAMES):
        data = _set(model, root[t], turn[t], joint[t])
        np.testing.assert_allclose(at.pos[t], data.xpos[1:], atol=1e-9)
        np.testing.assert_allclose(at.rot[t], data.xmat[1:].reshape(-1, 3, 3), atol=1e-9)
        np.testing.assert_allclose(at.axis[t], data.xaxis[1:], atol=1e-9)
        np.testing.assert_allclose(at.origin[t], data.xanchor[1:], atol=1e-9)


def test_the_jacobian_of_a_point_on_every_body_is_that_of_mujoco(model):
    tree = tree_of(model)
    root, turn, joint = _states(len(tree.joints))
    at = poses(tree, root, turn, joint)
    body = np.arange(len(tree.bodies))
    local = np.random.default_rng(0).normal(size=(len(body), 3)) / 5
    where = points(at, body, local)
    slope = jacobian(tree, at, body, where)
    for t in range(FRAMES):
        data = _set(model, root[t], turn[t], joint[t])
        for b in body:
            there = np.zeros((3, model.nv))
            mujoco.mj_jac(model, data, there, None, where[t, b], int(b) + 1)
            there[:, 3:6] = there[:, 3:6] @ turn[t].T  # MuJoCo turns a free joint in its own frame, we in the world
            np.testing.assert_allclose(slope[t, b], there, atol=1e-9)


def test_the_jacobian_is_the_derivative_of_the_points():
    tree = tree_of(small_model())
    root, turn, joint = _states(len(tree.joints))
    body, local = np.array([len(tree.bodies) - 1, 2]), np.array([[0.1, 0.2, 0.3], [0.0, -0.1, 0.2]])
    at = poses(tree, root, turn, joint)
    slope = jacobian(tree, at, body, points(at, body, local))
    change = np.random.default_rng(5).normal(size=(FRAMES, 6 + len(tree.joints)))
    h = 1e-6

    def there(sign: float) -> np.ndarray:
        step = sign * h * change
        moved = Rotation.from_rotvec(step[:, 3:6]).as_matrix() @ turn
        return points(poses(tree, root + step[:, :3], moved, joint + step[:, 6:]), body, local)

    np.testing.assert_allclose(np.einsum("tkcn,tn->tkc", slope, change), (there(1) - there(-1)) / (2 * h), atol=1e-7)


def test_a_turn_is_a_rotation_about_its_axis():
    axis, angle = np.array([1.0, 2.0, 2.0]) / 3, np.array([0.0, 1.0, -3.0])
    np.testing.assert_allclose(turns(axis, angle), Rotation.from_rotvec(angle[:, None] * axis).as_matrix(), atol=1e-12)


@pytest.mark.parametrize(
    ("model", "said"),
    [
        (small_model(root=""), "a free joint on the first body"),
        (small_model(root='<freejoint/><body><joint type="slide"/><geom size="0.1"/></body>'), "a hinge"),
        (small_model(root='<freejoint/><body><joint type="ball"/><geom size="0.1"/></body>'), "a hinge"),
        (small_model(extra='<body name="table"><geom size="0.1"/></body>'), "table apart from it"),
        (mujoco.MjModel.from_xml_string("<mujoco/>"), "a free joint"),
    ],
)
def test_what_is_no_floating_tree_of_hinges_is_refused(model, said):
    with pytest.raises(BadInput, match=said):
        tree_of(model, "robot.xml")


def test_a_joint_without_limits_has_none():
    tree = tree_of(small_model(root='<freejoint/><body name="x"><joint name="free"/><geom size="0.1"/></body>'))
    number = tree.joints.index("free")
    assert tree.low[number] == -np.inf and tree.high[number] == np.inf
