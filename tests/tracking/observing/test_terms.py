"""The terms of observations, each against values worked out by hand, and the sets that the paper names."""

import math

import pytest
import torch
from torch.utils._python_dispatch import TorchDispatchMode

from bumblebee.errors import BadInput
from bumblebee.sim.engine import RobotState
from bumblebee.tracking.observing.terms import SETS, TERMS, Seen, expanded, parts, see
from bumblebee.tracking.sampling.library import ReferenceFrame

HALF = math.sqrt(0.5)
J, K = 23, 14


def example() -> Seen:
    """One robot at (1, 2, 0.7) that has turned left by 90 degrees: its x axis is the world's y, its y the world's -x.

    The reference is at (1, 3, 0.8), unturned. Key bodies stand at the roots, raised by their index in centimetres.
    """
    key = torch.zeros(1, K, 3)
    key[0, :, 2] = 0.01 * torch.arange(K)
    own, wanted = torch.tensor([[1.0, 2.0, 0.7]]), torch.tensor([[1.0, 3.0, 0.8]])
    state = RobotState(
        root_pos_w=own,
        root_quat_w=torch.tensor([[HALF, 0.0, 0.0, HALF]]),
        root_lin_vel_b=torch.tensor([[0.1, 0.2, 0.3]]),
        root_ang_vel_b=torch.tensor([[0.4, 0.5, 0.6]]),
        joint_pos=torch.arange(J)[None] / 10,
        joint_vel=torch.arange(J)[None] / 5,
        key_pos_w=own[:, None] + key,
    )
    ref = ReferenceFrame(
        root_pos_w=wanted,
        root_quat_w=torch.tensor([[1.0, 0.0, 0.0, 0.0]]),
        root_lin_vel_w=torch.tensor([[1.0, 0.0, 0.0]]),
        root_ang_vel_b=torch.tensor([[0.0, 0.0, 2.0]]),
        joint_pos=torch.arange(J)[None] / 100,
        joint_vel=torch.arange(J)[None] / 50,
        key_pos_w=wanted[:, None] + key,
        lead=torch.ones(1, J),
        ahead_root_pos_w=torch.zeros(1, 0, 3),
        ahead_root_quat_w=torch.zeros(1, 0, 4),
        ahead_joint_pos=torch.zeros(1, 0, J),
    )
    return Seen.of(state, ref, torch.full((1, J), 0.25))


RAISED = [[0.0, 0.0, 0.01 * k] for k in range(K)]
IDENTITY = [1.0, 0.0, 0.0, 1.0, 0.0, 0.0]  # the first two columns, row by row
BY_HAND = {
    "gravity_b": [0.0, 0.0, -1.0],
    "root_lin_vel_b": [0.1, 0.2, 0.3],
    "root_ang_vel_b": [0.4, 0.5, 0.6],
    "joint_pos": [i / 10 for i in range(J)],
    "joint_vel": [i / 5 for i in range(J)],
    "last_action": [0.25] * J,
    "root_rotation_g": [0.0, -1.0, 1.0, 0.0, 0.0, 0.0],
    "target_joint_pos": [i / 100 for i in range(J)],  # without the gravity lead
    "target_key_pos_g": [[x, y + 1.0, z + 0.1] for x, y, z in RAISED],
    "target_root_pos_g": [0.0, 1.0, 0.1],
    "target_root_rotation_g": IDENTITY,
    "target_root_pos_b": [1.0, 0.0, 0.1],  # a metre along the world's y is straight ahead
    "target_root_rotation_b": [0.0, 1.0, -1.0, 0.0, 0.0, 0.0],  # a turn to the right
    "root_height": [0.7],
    "key_pos_b": RAISED,
    "key_error_b": [[1.0, 0.0, 0.1]] * K,
    "target_key_pos_b": [[x + 1.0, y, z + 0.1] for x, y, z in RAISED],
    "target_joint_vel": [i / 50 for i in range(J)],
    "target_lin_vel_b": [0.0, -1.0, 0.0],
    "target_ang_vel": [0.0, 0.0, 2.0],
}


@pytest.mark.parametrize("name", BY_HAND)
def test_a_term_is_what_its_row_says(name: str) -> None:
    """Values by hand for one robot that has turned left by a quarter."""
    expected = torch.tensor(BY_HAND[name]).reshape(1, -1)
    torch.testing.assert_close(TERMS[name](example()), expected, atol=1e-6, rtol=0)
    assert parts([name]) == [(name, expected.shape[1])]


def test_the_papers_terms_are_in_the_sets() -> None:
    """Appendix A: the student has the teacher's proprioception but for linear velocity, and no key bodies."""
    proprioception = {"root_lin_vel_b", "root_ang_vel_b", "joint_pos", "joint_vel", "last_action"}
    teacher, student = set(SETS["teacher"]), set(SETS["student"])
    assert proprioception <= teacher
    assert {"target_joint_pos", "target_key_pos_g", "target_root_pos_g", "target_root_rotation_g"} <= teacher
    assert proprioception - {"root_lin_vel_b"} <= student and "root_lin_vel_b" not in student
    assert student - proprioception == {"gravity_b", "target_joint_pos", "target_root_pos_b", "target_root_rotation_b"}
    assert not any(name.endswith("_g") for name in student)


def test_a_set_is_its_terms_side_by_side() -> None:
    """In order, and as long as the parts say."""
    seen = example()
    whole = see(expanded(["student"]), seen.state, seen.ref, seen.last_action)
    expected = torch.cat([torch.tensor(BY_HAND[name]).reshape(1, -1) for name in SETS["student"]], dim=1)
    torch.testing.assert_close(whole, expected, atol=1e-6, rtol=0)
    assert sum(size for _, size in parts(["student"])) == whole.shape[1] == 107


def test_encoders_that_are_off_move_what_is_seen_of_the_key_bodies() -> None:
    """Where encoders are off, own key bodies are where the readings put them."""
    from dataclasses import replace

    seen = example()
    read = replace(seen.state, read_key_pos_w=seen.state.key_pos_w + torch.tensor([0.0, 0.5, 0.0]))
    off = Seen.of(read, seen.ref, seen.last_action)
    moved = TERMS["key_pos_b"](off) - TERMS["key_pos_b"](seen)
    torch.testing.assert_close(moved.view(K, 3), torch.tensor([[0.5, 0.0, 0.0]]).repeat(K, 1), atol=1e-6, rtol=0)


def test_an_unknown_term_is_named() -> None:
    """With the names that there are."""
    with pytest.raises(BadInput, match=r"'gravitation'.*gravity_b"):
        expanded(["joint_pos", "gravitation"])


class Called(TorchDispatchMode):
    """Names of the operations that are called within."""

    def __init__(self) -> None:
        super().__init__()
        self.names: set[str] = set()

    def __torch_dispatch__(self, func, types, args=(), kwargs=None):
        self.names.add(func.overloadpacket.__name__)
        return func(*args, **(kwargs or {}))


@pytest.mark.parametrize("name", [*BY_HAND, "demo", "demo_in_place", "imu"])
def test_a_term_copies_nothing_from_the_host_so_that_a_gpu_can_record_it(name: str) -> None:
    seen = example()
    with Called() as called:
        TERMS[name](seen)
    assert not called.names & {"index", "_local_scalar_dense", "nonzero"}
