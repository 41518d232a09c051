"""Reflections: what the mirrored robot would see and do, against kinematics and against the terms themselves."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from bumblebee.errors import BadInput
from bumblebee.learning.config import PpoConfig
from bumblebee.learning.ppo.learner import Trainer
from bumblebee.motion.kinematics import forward_key_positions
from bumblebee.robot.facts import FEET, KEY_BODIES, joint_names, stand_pose
from bumblebee.sim.engine import RobotState
from bumblebee.sim.mujoco_cpu import MujocoCpu
from bumblebee.sim.sensors import load_model
from bumblebee.tracking.config import EnvConfig, ObservationConfig
from bumblebee.tracking.env import TrackingEnv
from bumblebee.tracking.mirror import augmentation, body_reflection, joint_reflection, reflection
from bumblebee.tracking.observing.terms import TERMS, parts, see
from bumblebee.tracking.sampling.library import MotionLibrary, ReferenceFrame
from tests.tracking.clips import waving

POLAR, AXIAL, QUAT = torch.tensor([1.0, -1, 1]), torch.tensor([-1.0, 1, -1]), torch.tensor([1.0, -1, 1, -1])
B, J, A = 5, 23, 2
OWN = [name for name, term in TERMS.items() if term.__module__ == "bumblebee.tracking.observing.terms"]


def turned(values: torch.Tensor) -> torch.Tensor:
    index, sign = joint_reflection()
    return values[..., index] * torch.tensor(sign)


def swapped(places: torch.Tensor) -> torch.Tensor:
    index, sign = body_reflection(KEY_BODIES)
    return (places.flatten(1)[:, index] * torch.tensor(sign)).view_as(places)


def situation() -> tuple[tuple, tuple]:
    """States, references and actions drawn at random, and the same with the world reflected in the x-z plane."""
    g = torch.Generator().manual_seed(0)

    def normal(*shape: int) -> torch.Tensor:
        return torch.randn(*shape, generator=g)

    def quat(*shape: int) -> torch.Tensor:
        return torch.nn.functional.normalize(normal(*shape, 4), dim=-1)

    keys = len(KEY_BODIES)
    s = RobotState(normal(B, 3), quat(B), normal(B, 3), normal(B, 3), normal(B, J), normal(B, J), normal(B, keys, 3))
    r = ReferenceFrame(
        *(normal(B, 3), quat(B), normal(B, 3), normal(B, 3), normal(B, J), normal(B, J), normal(B, keys, 3)),
        *(normal(B, J), normal(B, A, 3), quat(B, A), normal(B, A, J)),
    )
    action = normal(B, J)
    s_m = RobotState(
        *(s.root_pos_w * POLAR, s.root_quat_w * QUAT, s.root_lin_vel_b * POLAR, s.root_ang_vel_b * AXIAL),
        *(turned(s.joint_pos), turned(s.joint_vel), swapped(s.key_pos_w)),
    )
    r_m = ReferenceFrame(
        *(r.root_pos_w * POLAR, r.root_quat_w * QUAT, r.root_lin_vel_w * POLAR, r.root_ang_vel_b * AXIAL),
        *(turned(r.joint_pos), turned(r.joint_vel), swapped(r.key_pos_w), turned(r.lead)),
        *(r.ahead_root_pos_w * POLAR, r.ahead_root_quat_w * QUAT, turned(r.ahead_joint_pos)),
    )
    return (s, r, action), (s_m, r_m, turned(action))


@pytest.mark.parametrize("name", OWN)
def test_the_mirrored_robot_sees_the_reflected_observation(name: str) -> None:
    """Each term, seen in the mirrored world or reflected after it was seen, is equal."""
    plain, mirrored = situation()
    index, sign = reflection(parts([name], J, A))
    seen = see((name,), *plain)[:, index] * torch.tensor(sign)
    torch.testing.assert_close(seen, see((name,), *mirrored), atol=1e-5, rtol=0)


def test_mirrored_joints_put_mirrored_bodies_in_mirrored_places() -> None:
    """By the robot's kinematics: signs and sides of all joints at once, to what its two sides differ by (2 mm)."""
    rng = np.random.default_rng(0)
    pose = stand_pose() + 0.3 * rng.standard_normal((4, J))
    index, sign = joint_reflection()
    at, level = np.zeros((4, 3)), np.tile([1.0, 0, 0, 0], (4, 1))
    keys = forward_key_positions(at, level, pose)
    keys_m = forward_key_positions(at, level, pose[:, index] * np.array(sign))
    reflected = swapped(torch.as_tensor(keys, dtype=torch.float32)).numpy()
    np.testing.assert_allclose(keys_m, reflected, atol=2e-3)
    assert np.abs(keys_m - keys).max() > 0.05


def test_twice_reflected_is_as_before() -> None:
    """Joints, bodies and whole observations."""
    for index, sign in (joint_reflection(), body_reflection(FEET), reflection(parts(["teacher", "student"]))):
        back = [index[i] for i in index]
        assert back == list(range(len(index)))
        assert [sign[i] * sign[index[i]] for i in range(len(index))] == [1.0] * len(index)
    stand = torch.as_tensor(stand_pose())
    torch.testing.assert_close(turned(stand), stand)  # which actions are measured from
    assert turned(torch.eye(J))[0].nonzero().item() == joint_names().index("right_hip_pitch_joint")


def test_a_part_without_a_reflection_is_named() -> None:
    """Before training starts."""
    with pytest.raises(BadInput, match=r"ppo\.symmetry.*'unheard_of'"):
        reflection([("unheard_of", 3)])


def make(config: EnvConfig) -> TrackingEnv:
    engine = MujocoCpu(load_model(physics_hz=100), config.num_worlds, threads=1)
    return TrackingEnv(MotionLibrary([waving("a", 60)], config.ahead), engine, config, 0)


def test_the_batch_is_doubled_by_its_reflection(tmp_path: Path) -> None:
    """Over all steps of a history; training with it runs and learns other weights than without."""
    seen = ObservationConfig(terms=("student",), history=3, now=("root_height",))
    config = EnvConfig(num_worlds=4, threads=1, observation=seen, observation_noise=0.0)
    env = make(config)
    env.step(torch.randn(4, J, generator=torch.Generator().manual_seed(1)))
    observation, action = env.get_observations(), torch.randn(4, J)
    both, actions = augmentation(env)(env, observation, action)
    assert both is not None and actions is not None and both.batch_size[0] == 8
    index, sign = reflection(parts(["student"]))
    steps = observation["policy"][:, :-1].unflatten(1, (3, -1))
    expected = (steps[..., index] * torch.tensor(sign)).flatten(1)
    torch.testing.assert_close(both["policy"][4:, :-1], expected)
    assert torch.equal(both["policy"][4:, -1], observation["policy"][:, -1])
    assert torch.equal(both["critic"][:4], observation["critic"]) and torch.equal(actions[4:], turned(action))
    ppo = PpoConfig(iterations=1, steps=4, epochs=1, mini_batches=2, hidden=(16,))
    weights = []
    for symmetry in (False, True):
        trainer = Trainer(make(config), replace(ppo, symmetry=symmetry), tmp_path / str(symmetry))
        trainer.train()
        weights.append(trainer.policy().actor.mlp[0].weight)
    assert not torch.equal(*weights)
