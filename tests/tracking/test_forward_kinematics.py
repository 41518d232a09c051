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
    kinematics = ForwardKinematics(model, BODIES).double()
    inputs = torch.tensor(poses(model, 2)).split((3, 4, model.nq - 7), dim=1)

    def places(root: torch.Tensor, turn: torch.Tensor, angle: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        return kinematics(root, torch.nn.functional.normalize(turn, dim=-1), angle)

    assert torch.autograd.gradcheck(places, [part.clone().requires_grad_() for part in inputs], eps=1e-6, atol=1e-6)


def test_fixed_bodies_go_with_the_link_that_carries_them_and_idle_joints_have_no_gradient():
    model = mujoco.MjModel.from_xml_string("""
        <mujoco><worldbody><body name="base"><freejoint/><geom size=".1"/>
          <body pos="0 0 .1" quat=".8 .6 0 0"><body name="on base" pos=".1 .2 0" quat=".6 0 .8 0"><geom size=".1"/>
            <body name="link" pos="0 .3 0" quat=".8 0 0 .6"><joint axis="0 .6 .8"/><geom size=".1"/>
              <body name="on link" pos=".2 0 .1" quat="0 1 0 0"><geom size=".1"/></body></body></body></body>
          <body><joint axis="1 0 0"/><geom size=".1"/></body>
        </body></worldbody></mujoco>""")
    names = ["on link", "base", "on base", "link"]
    qpos, data = poses(model, 1), mujoco.MjData(model)
    data.qpos[:] = qpos[0]
    mujoco.mj_kinematics(model, data)
    inputs = torch.tensor(qpos, dtype=torch.float32).split((3, 4, 2), dim=1)
    inputs[2].requires_grad_()
    place, turn = ForwardKinematics(model, names)(*inputs)
    ids = [model.body(name).id for name in names]
    np.testing.assert_allclose(place[0].detach(), data.xpos[ids], atol=1e-5)
    np.testing.assert_allclose(np.abs((turn[0].detach().numpy() * data.xquat[ids]).sum(-1)), 1.0, atol=1e-5)
    moved, idle = torch.autograd.grad(place.sum(), inputs[2])[0][0]
    assert moved != 0 and idle == 0
    alone, _ = ForwardKinematics(model, ["base"])(*inputs)
    np.testing.assert_allclose(alone[0, 0].detach(), qpos[0, :3], atol=1e-6)


def test_a_model_without_a_free_base_is_refused():
    model = mujoco.MjModel.from_xml_string("""
        <mujoco><worldbody><body name="arm"><joint/><geom size=".1"/></body></worldbody></mujoco>""")
    with pytest.raises(BadInput, match="a free base"):
        ForwardKinematics(model, ["arm"])
