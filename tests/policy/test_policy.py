"""A policy is deployed as its contract says, or not at all."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.policy.exported import ExportedPolicy

Make = Callable[..., Path]


def edit(folder: Path, change: Callable[[dict], object]) -> None:
    contract = json.loads((folder / "contract.json").read_text())
    change(contract)
    (folder / "contract.json").write_text(json.dumps(contract))


def test_a_good_export_loads_and_acts_row_by_row(policy_folder: Make) -> None:
    policy = ExportedPolicy.load(policy_folder(gain=0.1))
    size = sum(part["size"] for part in policy.contract["observation"])
    obs = np.random.default_rng(1).standard_normal((5, size))
    actions = policy.act(obs)
    assert actions.shape == (5, 23) and np.any(actions)
    assert np.allclose(policy.act(obs[2:3]), actions[2:3], atol=1e-5)


def test_a_file_that_is_not_the_one_of_the_contract_is_refused(policy_folder: Make) -> None:
    folder = policy_folder()
    (folder / "policy.onnx").write_bytes((folder / "policy.onnx").read_bytes() + b"\0")
    with pytest.raises(BadInput, match=r"policy.onnx: sha256"):
        ExportedPolicy.load(folder)


def test_two_joints_swapped_are_refused_by_name(policy_folder: Make) -> None:
    folder = policy_folder()

    def swap(contract: dict) -> None:
        joints = contract["joints"]
        joints[3], joints[4] = joints[4], joints[3]

    edit(folder, swap)
    with pytest.raises(BadInput, match=r"joints\[3\]: expected left_knee_joint, came left_ankle_pitch_joint"):
        ExportedPolicy.load(folder)


def test_a_joint_too_few_is_refused(policy_folder: Make) -> None:
    folder = policy_folder()
    edit(folder, lambda contract: contract["joints"].pop())
    with pytest.raises(BadInput, match="came nothing"):
        ExportedPolicy.load(folder)


def test_another_observation_layout_is_refused(policy_folder: Make) -> None:
    folder = policy_folder()
    edit(folder, lambda contract: contract["observation"][4].update(name="joint_angle"))
    with pytest.raises(BadInput, match=r"observation\[4\]"):
        ExportedPolicy.load(folder)


def test_other_gains_than_the_servos_are_refused(policy_folder: Make) -> None:
    folder = policy_folder()
    edit(folder, lambda contract: contract["kp"].__setitem__(3, 100.5))
    with pytest.raises(BadInput, match=r"kp\[3\]"):
        ExportedPolicy.load(folder)


@pytest.mark.parametrize("content", ["", "[1, 2]", '{"joints": []}'])
def test_a_broken_contract_is_one_line(policy_folder: Make, content: str) -> None:
    folder = policy_folder()
    (folder / "contract.json").write_text(content)
    with pytest.raises(BadInput, match=r"contract.json") as caught:
        ExportedPolicy.load(folder)
    assert "\n" not in str(caught.value)


def test_an_absent_policy_is_named(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"contract.json"):
        ExportedPolicy.load(tmp_path)


def test_an_unknown_feed_forward_is_refused(policy_folder: Make) -> None:
    folder = policy_folder()
    edit(folder, lambda contract: contract["action"].update(feed_forward="learned"))
    with pytest.raises(BadInput, match=r"action\.feed_forward"):
        ExportedPolicy.load(folder)
