"""Forward kinematics in torch agrees with MuJoCo's, and its gradients with finite differences."""

import mujoco
import numpy as np
import pytest
import torch

from bumblebee.errors import BadInput
from bumblebee.robot.facts import FEET, KEY_BODIES
from bumblebee.sim.sensors import load_model
from bumblebee.tracking.forward_kinematics import ForwardKinematics

BODIES = [*KEY_BODIES, *FEET]


def poses(model: mujoco.MjModel, count: int) -> np.ndarray:
    qpos = np.random.default_rng(0).normal(size=(count, model.nq))
    qpos[:, 3:7] /= np.linalg.norm(qpos[:, 3:7], axis=1, keepdims=True)
    return qpos


def test_places_and_orientations_are_those_of_mujoco():
    model = load_model()
    qpos, data = poses(model, 6), mujoco.MjData(model)
    split = torch.tensor(qpos, dtype=torch.float32).split((3, 4, model.nq - 7), dim=1)
    place, turn = ForwardKinematics(model, BODIES)(*split)
    ids = [model.body(name).id for name in BODIES]
    for row, own_place, own_turn in zip(qpos, place, turn, strict=True):
        data.qpos[:] = row
        mujoco.mj_kinematics(model, data)
        np.testing.assert_allclose(own_place, data.xpos[ids], atol=1e-5)
        same = np.abs((own_turn.numpy() * data.xquat[ids]).sum(-1))  # q and -q are one orientation
        np.testing.assert_allclose(same, 1.0, atol=1e-5)


def test_gradients_are_those_of_finite_differences():
    model = load_model()
    kinematics = ForwardKinematics(model, ["left_wrist_yaw_link"])
    kinematics._levels = [
        type(level)(*(_double(part) for part in vars(level).values())) for level in kinematics._levels
    ]
    root, quat, angle = torch.tensor(poses(model, 2)).split((3, 4, model.nq - 7), dim=1)
    assert torch.autograd.gradcheck(
        lambda q: kinematics(root, quat, q)[0], angle.clone().requires_grad_(), eps=1e-6, atol=1e-6
    )


def test_a_model_without_a_free_base_is_refused():
    model = mujoco.MjModel.from_xml_string("""
        <mujoco><worldbody><body name="arm"><joint/><geom size=".1"/></body></worldbody></mujoco>""")
    with pytest.raises(BadInput, match="a free base"):
        ForwardKinematics(model, ["arm"])


def _double(part: torch.Tensor) -> torch.Tensor:
    return part.double() if part.is_floating_point() else part
