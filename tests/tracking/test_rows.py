"""Work by index and work by mask end in the same worlds."""

import pytest
import torch

from bumblebee.sim.cuda_graph import Captured
from bumblebee.sim.mujoco_cpu import MujocoCpu
from bumblebee.sim.sensors import load_model
from bumblebee.tracking.config import EnvConfig, Randomisation
from bumblebee.tracking.env import TrackingEnv
from bumblebee.tracking.rows import Rows
from bumblebee.tracking.sampling.library import MotionLibrary
from bumblebee.tracking.sampling.sampler import ClipSampler
from tests.tracking.clips import waving

MASK = torch.tensor([False, True, True, False, True])


@pytest.mark.parametrize("shape", [(5,), (5, 2), (5, 2, 3)])
def test_both_ways_write_the_same_rows(shape: tuple[int, ...]) -> None:
    """Values for each world, and one value for all; the others stay as they were."""
    values = torch.arange(5 * 6, dtype=torch.float32)[: torch.Size(shape).numel()].reshape(shape)
    for new in (values, 7.0):
        ends = []
        for by_mask in (False, True):
            rows, into = Rows(MASK, by_mask), torch.full(shape, -1.0)
            rows.put(into, rows.of(new) if isinstance(new, torch.Tensor) else new)
            ends.append(into)
        assert torch.equal(*ends)
        assert (ends[0][~MASK] == -1).all() and (ends[0][MASK] != -1).all()


def test_work_by_index_is_for_the_chosen_alone() -> None:
    """Three worlds by index, all five by mask."""
    assert len(Rows(MASK, by_mask=False)) == 3
    assert len(Rows(MASK, by_mask=True)) == 5


def test_the_sampler_counts_the_same_episodes_both_ways() -> None:
    """Ended episodes alone, or all with a mark on those that ended."""
    clip = torch.tensor([0, 1, 1, 2, 0])
    failed = torch.tensor([True, True, False, True, False])
    one, two = ClipSampler(torch.tensor([100, 100, 300])), ClipSampler(torch.tensor([100, 100, 300]))
    one.update(clip[MASK], failed[MASK])
    two.update(clip, failed, MASK)
    assert torch.allclose(one.failure, two.failure)
    assert two.failure[2] == 1.0  # no episode of it has ended


def test_the_environment_by_mask_is_the_one_by_index() -> None:
    """Until an episode ends, bit for bit; afterwards the draws differ, and every ended world stands at a new start."""
    config = EnvConfig(num_worlds=6, threads=1, episode_seconds=0.2, randomisation=Randomisation(push=0.0))
    envs = []
    for by_mask in (False, True):
        engine = MujocoCpu(load_model(physics_hz=100), 6, threads=1)
        engine.by_mask = by_mask
        envs.append(TrackingEnv(MotionLibrary([waving("a", 60), waving("b", 90)], config.ahead), engine, config))
    for _ in range(25):
        a, b = (env.step(torch.zeros(6, 23)) for env in envs)
        if envs[1].statistics._sums[5] == 0:
            assert torch.equal(a[0]["critic"], b[0]["critic"]) and torch.equal(a[1], b[1])
        for env, (seen, _, done, _) in zip(envs, (a, b), strict=True):
            assert torch.isfinite(seen["critic"]).all()
            assert (env.episode_length_buf[done] == 0).all() and (env.episode_length_buf[~done] > 0).all()
    assert all(env.statistics.take()["episode_length"] <= 10 for env in envs)


def test_without_a_gpu_nothing_is_recorded() -> None:
    """The work is called each time."""
    calls = []
    captured = Captured(lambda: calls.append(1), torch.device("cpu"))
    for _ in range(4):
        captured()
    assert len(calls) == 4
