"""A policy with a memory is deployed with the contract that says so, or not at all."""

import hashlib
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import pytest
import torch

from bumblebee.errors import BadInput
from bumblebee.learning.export import CONTRACT, ONNX, export_policy
from bumblebee.learning.generalist.transformer import TransformerConfig
from bumblebee.learning.policy import Policy, Shape, new_actor
from bumblebee.policy.exported import ExportedPolicy

OWN = TransformerConfig(embedding=12, heads=3, memory=4, feed_forward=8, head=(16,))
SHAPE = Shape(107, 107, 23, OWN.head, (), ("student",), transformer=OWN)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    torch.manual_seed(0)
    export_policy(tmp_path, Policy(new_actor(SHAPE), {}, SHAPE))
    return tmp_path


def edit(folder: Path, change: Callable[[dict[str, Any]], object]) -> None:
    contract = json.loads((folder / CONTRACT).read_text())
    change(contract)
    (folder / CONTRACT).write_text(json.dumps(contract))


def rewrite(folder: Path, change: Callable[[onnx.ModelProto], object]) -> None:
    """Another model under the contract's new hash."""
    model = onnx.load(folder / ONNX)
    change(model)
    raw = model.SerializeToString()
    (folder / ONNX).write_bytes(raw)
    edit(folder, lambda contract: contract.update(onnx_sha256=hashlib.sha256(raw).hexdigest()))


def line(folder: Path) -> str:
    with pytest.raises(BadInput) as refused:
        ExportedPolicy.load(folder)
    assert "\n" not in str(refused.value)
    return str(refused.value)


def test_it_loads_and_carries_its_memory(folder: Path) -> None:
    policy = ExportedPolicy.load(folder)
    seen, memory = np.random.default_rng(0).standard_normal((2, 3, 107)), policy.empty_memory(3)
    assert policy.memory == (4, 13) and memory.shape == (3, 4, 13) and not memory.any()
    first, memory = policy.advance(seen[0], memory)
    second, memory = policy.advance(seen[1], memory)
    assert np.array_equal(policy.act(seen[0]), first) and not np.allclose(policy.act(seen[1]), second)
    assert memory[:, :, -1].tolist() == [[0, 0, 1, 1]] * 3


def test_without_a_memory_contract_and_policy_are_as_before(tmp_path: Path) -> None:
    shape = Shape(107, 107, 23, (8,), (), ("student",))
    export_policy(tmp_path, Policy(new_actor(shape), {}, shape))
    policy = ExportedPolicy.load(tmp_path)
    assert "memory" not in policy.contract and policy.memory is None
    actions, memory = policy.advance(np.ones((2, 107)), policy.empty_memory(2))
    assert np.array_equal(actions, policy.act(np.ones((2, 107)))) and memory.shape == (2, 0, 0)


@pytest.mark.parametrize("memory", [{"steps": 5, "size": 13}, {"steps": 4, "size": 12}])
def test_a_memory_of_another_shape_than_the_contracts_is_refused(folder: Path, memory: dict[str, int]) -> None:
    edit(folder, lambda contract: contract.update(memory=memory))
    said = line(folder)
    assert f"policy.onnx: inputs: expected obs (N, 107), memory (N, {memory['steps']}, {memory['size']})" in said


def test_a_memory_that_the_contract_does_not_name_is_refused(folder: Path) -> None:
    edit(folder, lambda contract: contract.pop("memory"))
    assert "policy.onnx: inputs: expected obs (N, 107), came" in line(folder)


def test_a_contract_with_a_memory_that_the_model_has_not_is_refused(tmp_path: Path) -> None:
    shape = Shape(107, 107, 23, (8,), (), ("student",))
    export_policy(tmp_path, Policy(new_actor(shape), {}, shape))
    edit(tmp_path, lambda contract: contract.update(memory={"steps": 4, "size": 13}))
    assert "inputs: expected obs (N, 107), memory (N, 4, 13), came" in line(tmp_path)


def test_a_model_that_does_not_give_its_memory_back_is_refused(folder: Path) -> None:
    rewrite(folder, lambda model: model.graph.output.pop())
    assert "outputs: expected actions (N, 23), memory_next (N, 4, 13), came" in line(folder)


def test_a_model_whose_memory_is_no_number_is_refused(folder: Path) -> None:
    def spoil(model: onnx.ModelProto) -> None:
        (one,) = (tensor for tensor in model.graph.initializer if tensor.name == "remembered_one")
        one.CopyFrom(onnx.numpy_helper.from_array(np.float32(np.nan), one.name))

    rewrite(folder, spoil)
    assert "memory_next: expected a finite memory" in line(folder) or "finite actions" in line(folder)


@pytest.mark.parametrize(
    "memory",
    [
        *(None, 4, [4, 13], {"steps": 4}, {"steps": 0, "size": 13}, {"steps": 4, "size": 10**9}),
        *({"steps": 4.0, "size": 13}, {"steps": True, "size": 13}, {"steps": 4, "size": 13, "type": "lstm"}),
    ],
)
def test_a_memory_that_is_none_is_refused_by_its_key(folder: Path, memory: Any) -> None:
    edit(folder, lambda contract: contract.update(memory=memory))
    assert "contract.json: memory" in line(folder)
