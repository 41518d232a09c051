"""Policies: saving, loading, the ONNX export and its contract, and trials."""

import json
from pathlib import Path

import numpy as np
import onnxruntime
import pytest
import torch

from bumblebee.errors import BadInput
from bumblebee.learning.export import export_policy
from bumblebee.learning.policy import Policy, Shape, load_policy, new_actor
from bumblebee.learning.trial import Trials, World, success_by_family, try_policy
from bumblebee.robot.facts import joint_names
from bumblebee.sim.sensors import load_model
from bumblebee.tracking.observing.observations import layout
from bumblebee.tracking.sampling.library import AHEAD
from tests.tracking.clips import waving

SIZE = sum(size for _, size in layout(23, len(AHEAD)))


@pytest.fixture
def policy() -> Policy:
    """An untrained policy whose normaliser has seen something."""
    torch.manual_seed(0)
    actor = new_actor(Shape(SIZE, SIZE + 4, 23, (32, 16), AHEAD))
    actor.train()
    actor.update_normalization({"policy": 3 + 2 * torch.randn(200, SIZE)})  # type: ignore[arg-type]
    return Policy(actor, {"w": torch.ones(2)}, Shape(SIZE, SIZE + 4, 23, (32, 16), AHEAD))


def test_saved_and_loaded_it_acts_alike(policy: Policy, tmp_path: Path) -> None:
    """Network, normalisation and shape survive the file."""
    policy.save(tmp_path)
    loaded = load_policy(tmp_path)
    seen = torch.randn(7, SIZE)
    assert torch.equal(loaded(seen), policy(seen))
    assert loaded.shape == policy.shape
    assert torch.equal(loaded.critic_state["w"], torch.ones(2))


def test_onnx_gives_the_same_actions(policy: Policy, tmp_path: Path) -> None:
    """Torch and onnxruntime agree to 1e-5, for one observation and for many, with the normalisation inside."""
    export_policy(tmp_path, policy)
    session = onnxruntime.InferenceSession(tmp_path / "policy.onnx", providers=["CPUExecutionProvider"])
    for rows in (1, 9):
        seen = 3 + 2 * torch.randn(rows, SIZE)
        (actions,) = session.run(["actions"], {"obs": seen.numpy()})
        np.testing.assert_allclose(actions, policy(seen).numpy(), atol=1e-5)
        assert np.abs(actions).max() > 1e-3


def test_the_contract_describes_the_file(policy: Policy, tmp_path: Path) -> None:
    """Joints, sizes, look-ahead and the file's own hash."""
    import hashlib

    export_policy(tmp_path, policy, physics_hz=100)
    contract = json.loads((tmp_path / "contract.json").read_text())
    assert contract["joints"] == list(joint_names())
    assert sum(part["size"] for part in contract["observation"]) == SIZE
    assert contract["ahead"] == list(AHEAD)
    assert len(contract["kp"]) == len(contract["kd"]) == len(contract["action"]["scale"]) == 23
    assert contract["onnx_sha256"] == hashlib.sha256((tmp_path / "policy.onnx").read_bytes()).hexdigest()


def test_a_missing_or_foreign_checkpoint_is_bad_input(tmp_path: Path) -> None:
    """One line that names the file."""
    with pytest.raises(BadInput, match=r"policy\.pt"):
        load_policy(tmp_path)
    torch.save({"something": 1}, tmp_path / "policy.pt")
    with pytest.raises(BadInput, match="checkpoint of a policy"):
        load_policy(tmp_path)


def test_trials_tell_success_from_failure() -> None:
    """Zero actions hold a still stand to its end; a policy that throws the legs falls; both are reproducible."""
    world = World(load_model(physics_hz=100), threads=1)
    clips = [waving("still", 30, size=0.0), waving("travel", 200, size=0.0, speed=1.0)]

    def still(seen: torch.Tensor) -> torch.Tensor:
        return torch.zeros(len(seen), 23)

    trials = try_policy(still, clips, world, AHEAD)
    assert trials["success"].tolist() == [True, False]
    assert trials["share"][0] == 1.0 and 0 < trials["share"][1] < 1
    assert trials["key_error"][0] < 0.05
    assert success_by_family(trials) == {"stand": 0.5, "all": 0.5}
    noisy = Trials(repeats=2, noise=1.0, seed=4)
    one, two = (try_policy(still, clips, world, AHEAD, noisy) for _ in range(2))
    assert len(one) == 4
    assert one.equals(two)
    assert one["key_error"][0] != one["key_error"][1]
