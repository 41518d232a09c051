"""The policy that comes with the code: small, safe to read, of the task's layout, and able to move."""

from pathlib import Path

import pytest
import torch

from bumblebee.learning import pretrained
from bumblebee.learning.export import export_shipped
from bumblebee.learning.policy import FILE, load_policy
from bumblebee.learning.trial import World, try_policy
from bumblebee.motion.embedded import EmbeddedConfig, make_library
from bumblebee.policy.exported import ExportedPolicy
from bumblebee.sim.sensors import load_model
from bumblebee.tracking.config import EnvConfig, ObservationConfig
from bumblebee.tracking.observing.needs import needed
from bumblebee.tracking.observing.terms import expanded, parts


@pytest.mark.parametrize("folder", pretrained.NAMES, ids=lambda folder: folder.name)
def test_it_is_small_and_of_the_layout_that_the_task_has(folder: Path) -> None:
    """At most 8 MB with its critic, if it has one; its observation has the parts that its shape names."""
    assert (folder / FILE).stat().st_size <= 8e6
    policy = load_policy(folder)
    seen = parts((*policy.shape.terms, *policy.shape.now), 23, len(policy.shape.ahead))
    assert policy.shape.observation == sum(size for _, size in seen)
    assert policy.shape.actions == 23
    assert policy(torch.zeros(2, policy.shape.observation)).isfinite().all()
    assert all(value.isfinite().all() for value in policy.critic_state.values())


@pytest.mark.parametrize("folder", pretrained.NAMES, ids=lambda folder: folder.name)
@pytest.mark.parametrize("physics_hz", [100.0, 200.0])
def test_it_follows_embedded_motions_without_training(folder: Path, physics_hz: float) -> None:
    """Each of seven kinds from its first frame to its last, at the rates that base and refine train at."""
    clips = make_library(EmbeddedConfig(limit=7))
    policy = load_policy(folder)
    trials = try_policy(policy, clips, World(load_model(physics_hz=physics_hz), threads=1), policy.shape.ahead)
    assert trials["success"].all()
    assert trials["key_error"].mean() < 0.04  # m


def test_the_default_policy_has_the_tasks_own_observation_and_the_imu_policy_needs_no_odometry() -> None:
    default, imu = (load_policy(pretrained.SHIPPED[name]).shape for name in ("shipped", "imu"))
    assert (default.seen, default.ahead) == (ObservationConfig(), EnvConfig().ahead)
    assert needed(expanded(imu.terms), 23, len(imu.ahead)) == ("imu", "heading", "encoders")


def test_the_imu_policy_is_deployed_with_a_contract_that_asks_for_no_odometry(tmp_path: Path) -> None:
    exported = ExportedPolicy.load(export_shipped(tmp_path / "imu", "imu"))
    assert exported.contract["sensors"] == ["imu", "heading", "encoders"]
