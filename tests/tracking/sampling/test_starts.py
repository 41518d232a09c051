"""Starts of episodes: at the reference, off by no more than said."""

import torch

from bumblebee.sim.rotations import angle_between
from bumblebee.tracking.sampling.library import MotionLibrary, ReferenceFrame
from bumblebee.tracking.sampling.starts import start_state
from tests.tracking.clips import waving

N = 200


def reference() -> ReferenceFrame:
    library = MotionLibrary([waving("a", 60)])
    return library.frames(torch.zeros(N, dtype=torch.long), torch.linspace(0, 1, N))


def test_without_noise_a_start_is_the_reference() -> None:
    """Position, orientation and all speeds; nothing is drawn that matters."""
    ref = reference()
    qpos, qvel = start_state(ref, 0.0, torch.Generator().manual_seed(0))
    torch.testing.assert_close(qpos, torch.cat((ref.root_pos_w, ref.root_quat_w, ref.joint_pos), dim=1))
    torch.testing.assert_close(qvel, torch.cat((ref.root_lin_vel_w, ref.root_ang_vel_b, ref.joint_vel), dim=1))


def test_noise_stays_within_its_bounds_and_reaches_far() -> None:
    """Each part has its own size, times the factor; a root is never put into the floor."""
    ref = reference()
    for factor in (1.0, 0.5):
        qpos, qvel = start_state(ref, factor, torch.Generator().manual_seed(1))
        off = {
            0.02: qpos[:, :2] - ref.root_pos_w[:, :2],
            0.03: qpos[:, 7:] - ref.joint_pos,
            0.1: qvel[:, :3] - ref.root_lin_vel_w,
            0.2: qvel[:, 3:6] - ref.root_ang_vel_b,
            0.3: qvel[:, 6:] - ref.joint_vel,
        }
        for size, values in off.items():
            largest = values.abs().amax(0)
            assert (largest <= factor * size + 1e-5).all() and (largest > 0.9 * factor * size).all(), size
        assert torch.equal(qpos[:, 2], ref.root_pos_w[:, 2])
        turn = angle_between(ref.root_quat_w, qpos[:, 3:7])
        assert 0.04 * factor < turn.max() <= 3**0.5 * 0.04 * factor + 1e-4


def test_worlds_and_parts_are_drawn_independently() -> None:
    """No two worlds start alike, and one part's noise says nothing of another's."""
    ref = reference()
    qpos, qvel = start_state(ref, 1.0, torch.Generator().manual_seed(2))
    shift, joints = qpos[:, :2] - ref.root_pos_w[:, :2], qpos[:, 7:] - ref.joint_pos
    noise = torch.cat((shift, joints, qvel[:, 6:] - ref.joint_vel), dim=1)
    assert len(torch.unique(noise[:, 2], dim=0)) == N
    correlation = torch.corrcoef(noise.T) - torch.eye(noise.shape[1])
    assert correlation.abs().max() < 0.35  # of 1,128 pairs of 200 draws; .071 is one deviation
