"""A state as a vector: what moves it and what tells two apart undo each other, and no place or heading counts."""

import torch

from bumblebee.learning.world_model.body import change_of, difference, features, moved
from bumblebee.sim.rotations import from_rotation_vector, multiply, rotate

DT, JOINTS = 0.02, 5


def bodies(count: int = 8, seed: int = 0) -> torch.Tensor:
    generator = torch.Generator().manual_seed(seed)
    rows = torch.randn(count, 13 + 2 * JOINTS, generator=generator)
    rows[:, 3:7] = torch.nn.functional.normalize(rows[:, 3:7], dim=-1)
    return rows


def test_the_change_from_one_state_to_the_next_leads_there():
    before = bodies()
    change = 0.1 * torch.randn(8, 12 + 2 * JOINTS, generator=torch.Generator().manual_seed(1))
    after = moved(before, change, DT)
    assert (moved(before, change_of(before, after, DT), DT) - after).abs().max() < 1e-2
    small = moved(before, 0.01 * change, DT)
    assert (moved(before, change_of(before, small, DT), DT) - small).abs().max() < 1e-4


def test_a_state_does_not_differ_from_itself_nor_from_the_other_sign_of_its_quaternion():
    body = bodies()
    other = body.clone()
    other[:, 3:7] *= -1
    assert difference(body, body).abs().max() < 1e-5 and difference(body, other).abs().max() < 1e-4


def test_features_know_no_place_in_the_plane_and_no_heading():
    body = bodies()
    heading = from_rotation_vector(torch.tensor([[0.0, 0.0, 1.3]])).expand(8, -1)
    turned = body.clone()
    turned[:, :3] = rotate(heading, body[:, :3]) + torch.tensor([3.0, -2.0, 0.0])
    turned[:, 3:7] = multiply(heading, body[:, 3:7])
    assert (features(turned) - features(body)).abs().max() < 1e-4
