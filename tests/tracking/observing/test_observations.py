"""The observation: its layout, its independence of place and heading, and the targets."""

import torch

from bumblebee.sim.engine import RobotState
from bumblebee.sim.rotations import (
    angle_between,
    from_rotation_vector,
    length3,
    matrix,
    multiply,
    rotate,
    rotate_inverse,
    turned,
    turned_in_full,
    two_columns,
)
from bumblebee.tracking.observing.noise import LEVELS, noise_levels
from bumblebee.tracking.observing.observations import joint_targets, layout, observe
from bumblebee.tracking.observing.terms import LAYOUTS, TERMS
from bumblebee.tracking.sampling.library import MotionLibrary, ReferenceFrame
from tests.tracking.clips import waving

GENERATOR = torch.Generator().manual_seed(0)


def randoms(n: int = 4) -> tuple[RobotState, ReferenceFrame, torch.Tensor]:
    library = MotionLibrary([waving(speed=0.4)], ahead=(0.1, 0.3))
    ref = library.frames(torch.zeros(n, dtype=torch.long), torch.rand(n, generator=GENERATOR))

    def near(values: torch.Tensor) -> torch.Tensor:
        return values + 0.1 * torch.randn(values.shape, generator=GENERATOR)

    state = RobotState(
        root_pos_w=near(ref.root_pos_w),
        root_quat_w=torch.nn.functional.normalize(near(ref.root_quat_w), dim=-1),
        root_lin_vel_b=near(ref.root_lin_vel_w),
        root_ang_vel_b=near(ref.root_ang_vel_b),
        joint_pos=near(ref.joint_pos),
        joint_vel=near(ref.joint_vel),
        key_pos_w=near(ref.key_pos_w),
    )
    return state, ref, torch.randn(n, 23, generator=GENERATOR)


def test_layout_names_every_entry() -> None:
    """The sizes of the parts sum to the observation's, with and without look-ahead."""
    state, ref, action = randoms()
    assert observe(state, ref, action).shape == (4, sum(size for _, size in layout(23, 2)))
    names = [name for name, _ in layout(23, 2)]
    assert len(set(names)) == len(names)


def part(observation: torch.Tensor, wanted: str) -> torch.Tensor:
    first = 0
    for name, size in layout(23, 2):
        if name == wanted:
            return observation[:, first : first + size]
        first += size
    raise KeyError(wanted)


def test_parts_are_where_the_layout_says() -> None:
    """Joint angles, last action, what a zero action commands, the error of the pelvis in the base frame."""
    state, ref, action = randoms()
    seen = observe(state, ref, action)
    assert torch.equal(part(seen, "joint_pos"), state.joint_pos)
    assert torch.equal(part(seen, "last_action"), action)
    assert torch.equal(part(seen, "ref_joint_pos"), joint_targets(ref, torch.zeros_like(action), torch.ones(23)))
    expected = rotate_inverse(state.root_quat_w, ref.key_pos_w[:, 0] - state.key_pos_w[:, 0])
    assert torch.allclose(part(seen, "key_error_b")[:, :3], expected, atol=1e-6)
    gravity = rotate_inverse(state.root_quat_w, torch.tensor([0.0, 0.0, -1.0]).expand(4, 3))
    assert torch.allclose(part(seen, "gravity_b"), gravity, atol=1e-6)


def test_place_and_heading_do_not_matter() -> None:
    """Robot and reference moved and turned together about the vertical look the same to the policy."""
    state, ref, action = randoms()
    turn = from_rotation_vector(torch.tensor([[0.0, 0.0, 2.1]])).expand(4, 4)
    shift = torch.tensor([3.0, -1.0, 0.0])

    def moved(points: torch.Tensor) -> torch.Tensor:
        q = turn if points.ndim == 2 else turn[:, None].expand(*points.shape[:2], 4)
        return rotate(q, points) + shift

    other = RobotState(
        root_pos_w=moved(state.root_pos_w),
        root_quat_w=multiply(turn, state.root_quat_w),
        root_lin_vel_b=state.root_lin_vel_b,
        root_ang_vel_b=state.root_ang_vel_b,
        joint_pos=state.joint_pos,
        joint_vel=state.joint_vel,
        key_pos_w=moved(state.key_pos_w),
    )
    elsewhere = ReferenceFrame(
        root_pos_w=moved(ref.root_pos_w),
        root_quat_w=multiply(turn, ref.root_quat_w),
        root_lin_vel_w=rotate(turn, ref.root_lin_vel_w),
        root_ang_vel_b=ref.root_ang_vel_b,
        joint_pos=ref.joint_pos,
        joint_vel=ref.joint_vel,
        key_pos_w=moved(ref.key_pos_w),
        lead=ref.lead,
        ahead_root_pos_w=moved(ref.ahead_root_pos_w),
        ahead_root_quat_w=multiply(turn[:, None].expand(4, 2, 4), ref.ahead_root_quat_w),
        ahead_joint_pos=ref.ahead_joint_pos,
    )
    assert torch.allclose(observe(other, elsewhere, action), observe(state, ref, action), atol=1e-5)


def test_rotations_agree_with_each_other() -> None:
    """Matrix, rotation, product and angle describe the same rotation."""
    a, b = (torch.nn.functional.normalize(torch.randn(5, 4, generator=GENERATOR), dim=-1) for _ in range(2))
    v = torch.randn(5, 3, generator=GENERATOR)
    assert torch.allclose((matrix(a) @ v[..., None])[..., 0], rotate(a, v), atol=1e-5)
    assert torch.allclose(rotate(multiply(a, b), v), rotate(a, rotate(b, v)), atol=1e-5)
    assert torch.allclose(rotate_inverse(a, rotate(a, v)), v, atol=1e-5)
    small = from_rotation_vector(torch.tensor([[0.0, 0.3, 0.0]]))
    assert torch.allclose(angle_between(a[:1], multiply(a[:1], small)), torch.tensor([0.3]), atol=1e-4)
    assert torch.allclose(angle_between(a, -a), torch.zeros(5), atol=1e-6)  # two names of one rotation
    assert torch.allclose(length3(v), v.norm(dim=-1)) and length3(torch.zeros(2, 3, 3)).shape == (2, 3)


def test_every_noise_level_names_a_part() -> None:
    """No level is written for a part that does not exist, and the reference's joints carry none."""
    names = {name for layout in LAYOUTS.values() for name, _ in layout(23, 2)} | set(TERMS)
    assert set(LEVELS) <= names
    assert part(noise_levels(layout(23, 2))[None], "ref_joint_vel").max() == 0


def test_two_columns_and_turned_vectors_are_those_of_the_matrix() -> None:
    """The first two columns as rows, and each vector by its own row's matrix, whichever way the product is done."""
    generator = torch.Generator().manual_seed(3)
    q = torch.nn.functional.normalize(torch.randn(5, 4, generator=generator), dim=-1)
    vectors = torch.randn(5, 7, 3, generator=generator)
    torch.testing.assert_close(two_columns(q), matrix(q)[..., :2].mT)
    expected = torch.stack([rotate(q, vectors[:, i]) for i in range(7)], dim=1)
    torch.testing.assert_close(turned(vectors, matrix(q)), expected, atol=1e-5, rtol=0)
    torch.testing.assert_close(turned_in_full(vectors, matrix(q)), expected, atol=1e-5, rtol=0)
