"""The packed library: lookup, interpolation, the clip's end, the feed-forward."""

import mujoco
import numpy as np
import pytest
import torch

from bumblebee.robot.facts import joints, stand_pose
from bumblebee.robot.model import build_model, gains
from bumblebee.tracking.feed_forward import lead_angles, static_torques
from bumblebee.tracking.sampling.library import MotionLibrary
from tests.tracking.clips import waving


@pytest.fixture(scope="module")
def library() -> MotionLibrary:
    return MotionLibrary([waving("a", 40), waving("b", 70, speed=0.5)], ahead=(0.1, 0.3))


def test_a_whole_frame_is_that_frame(library: MotionLibrary) -> None:
    """Looked up at frame k / fps, a clip gives its own frame k, whatever clip stands before it."""
    ids, frame = torch.tensor([0, 1, 1]), torch.tensor([7, 7, 33])
    found = library.frames(ids, frame / 50)
    for row, (i, k) in enumerate(zip(ids, frame, strict=True)):
        clip = library.clips[i]
        np.testing.assert_array_equal(found.joint_pos[row], clip.joint_pos[k])
        np.testing.assert_array_equal(found.key_pos_w[row], clip.key_pos[k])
        np.testing.assert_array_equal(found.ahead_root_pos_w[row, 0], clip.root_pos[k + 5])


def test_between_frames_it_interpolates(library: MotionLibrary) -> None:
    """Half way between two frames lies their mean."""
    found = library.frames(torch.tensor([1]), torch.tensor([10.5 / 50]))
    expected = (library.clips[1].root_pos[10] + library.clips[1].root_pos[11]) / 2
    np.testing.assert_allclose(found.root_pos_w[0], expected, atol=1e-6)
    assert found.root_quat_w.norm() == pytest.approx(1.0)


def test_beyond_the_end_the_last_frame_rests(library: MotionLibrary) -> None:
    """After the clip its last pose is held, without velocity, and never the next clip's first."""
    found = library.frames(torch.tensor([0]), torch.tensor([5.0]))
    np.testing.assert_array_equal(found.root_pos_w[0], library.clips[0].root_pos[-1])
    assert found.joint_vel.abs().max() == 0 and found.root_lin_vel_w.abs().max() == 0


def test_velocities_are_the_derivatives_of_the_positions(library: MotionLibrary) -> None:
    """The root's velocity is the slope of its path."""
    found = library.frames(torch.tensor([1]), torch.tensor([0.6]))
    assert found.root_lin_vel_w[0, 0] == pytest.approx(0.5, abs=1e-4)


def test_the_lead_holds_a_stand_that_plain_targets_let_sink() -> None:
    """With the feed-forward a standing robot stays within half a degree for half a second; without, its ankles give."""
    clip = waving("still", 3, size=0.0)
    lead = lead_angles(clip)[0]
    model = build_model()
    sag = []
    for targets in (stand_pose() + lead, stand_pose()):
        data = mujoco.MjData(model)
        mujoco.mj_resetDataKeyframe(model, data, 0)
        data.ctrl[:] = targets
        for _ in range(100):
            mujoco.mj_step(model, data)
        sag.append(np.abs(data.qpos[7:] - stand_pose()).max())
    assert sag[0] < 0.01 < 0.03 < sag[1]


def test_static_torques_are_inverse_dynamics_where_both_feet_carry() -> None:
    """The knees' torque of the stand equals that of a settled simulation of the stand."""
    clip = waving("still", 3, size=0.0)
    model = build_model()
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    data.ctrl[:] = stand_pose() + static_torques(clip)[0] / np.array([gains(j)[0] for j in joints()])
    for _ in range(100):
        mujoco.mj_step(model, data)
    np.testing.assert_allclose(data.actuator_force, static_torques(clip)[0], atol=1.0)
