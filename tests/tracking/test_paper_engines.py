"""The paper's task on both engines: rough ground, delays, shifted centres of mass, histories; equal within tolerances.

Without `mujoco_warp` it is skipped. The comparison runs on Warp's CPU device: other devices draw other starts.
"""

from dataclasses import replace

import pytest
import torch

pytest.importorskip("mujoco_warp", reason="the extra `gpu` is not installed")

from bumblebee.sim.mujoco_cpu import MujocoCpu
from bumblebee.sim.mujoco_warp import MujocoWarp
from bumblebee.sim.warp_limits import Buffers
from bumblebee.tracking.config import EnvConfig
from bumblebee.tracking.env import TrackingEnv
from bumblebee.tracking.model import task_model
from bumblebee.tracking.presets import PAPER_RANDOMISATION, PAPER_TASK, distillation_task
from bumblebee.tracking.sampling.library import MotionLibrary
from tests.tracking.clips import waving

WORLDS, STEPS = 3, 12
ROOM = Buffers(contacts=64, constraints=256)
TASK = distillation_task(PAPER_TASK, terrain=replace(PAPER_TASK.terrain, rough=1.0))
TOLERANCES = {"joint_vel": 1.5, "root_ang_vel_b": 0.15}  # rad/s; of all others .03 rad, m, m/s


def make(config: EnvConfig, kind: type, **more: object) -> TrackingEnv:
    """The task on an engine, with solver iterations to spare: cut short, two solvers stop at two places."""
    robot = task_model(config)
    robot.opt.iterations, robot.opt.ls_iterations = 50, 50
    engine = kind(robot, config.num_worlds, **more)
    clips = [waving("a", 60), waving("b", 90)]
    return TrackingEnv(MotionLibrary(clips, config.ahead, device=engine.device), engine, config, 0)


def test_the_papers_task_is_one_on_both_engines() -> None:
    """Observations of teacher and student over their histories, rewards and ends; 12 control steps on rough ground."""
    calm = replace(PAPER_RANDOMISATION, push=0.0)  # headings are drawn in another order where work is done by mask
    config = replace(TASK, num_worlds=WORLDS, reset_noise=0.0, start_share=1.0, randomisation=calm)
    plain = make(config, MujocoCpu, threads=1)
    warp = make(config, MujocoWarp, device="cpu", buffers=ROOM)
    generator = torch.Generator().manual_seed(2)
    for _ in range(STEPS):
        action = 0.2 * torch.randn(WORLDS, 23, generator=generator)
        _, reward, done, _ = plain.step(action)
        _, reward_w, done_w, _ = warp.step(action)
        assert not done.any() and not done_w.any()
        torch.testing.assert_close(reward, reward_w, atol=2e-3, rtol=0)
        for name, group in plain.groups.items():
            allowed = torch.cat([torch.full((size,), TOLERANCES.get(part, 0.03)) for part, size in group.parts])
            error = (group.exact - warp.groups[name].exact).abs().unflatten(1, (-1, len(allowed)))
            assert (error <= allowed).all(), (error - allowed).amax((0, 1))
    warp.engine.check()
    lifted = plain.engine.state().root_pos_w[:, 2] - plain._state.root_pos_w[:, 2]
    assert lifted.abs().max() > 1e-3  # the ground was not flat


@pytest.mark.gpu
@pytest.mark.skipif(not torch.cuda.is_available(), reason="no NVIDIA GPU")
def test_the_papers_task_recorded_and_eager_is_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    """Histories, ground and pushes inside the CUDA graph and without it: the same observations and ends."""
    from bumblebee.sim import cuda_graph

    config = replace(TASK, num_worlds=64, episode_seconds=0.2)

    def rollout(eager_calls: int) -> torch.Tensor:
        monkeypatch.setattr(cuda_graph, "_EAGER_CALLS", eager_calls)
        env = make(config, MujocoWarp, buffers=ROOM)
        generator = torch.Generator("cuda").manual_seed(0)
        rows = []
        for _ in range(25):
            seen, reward, done, _ = env.step(0.3 * torch.randn(64, 23, generator=generator, device="cuda"))
            env.engine.check()
            rows.append(torch.cat([seen["student"], seen["critic"], reward[:, None], done[:, None].float()], 1))
        return torch.stack(rows)

    recorded, eager = rollout(2), rollout(1000)
    assert torch.isfinite(recorded).all()
    assert (recorded[:4] - eager[:4]).abs().mean() < 1e-3  # before the order of sums has spread
    assert torch.equal(recorded[:8, :, -1], eager[:8, :, -1])
