"""Export of a policy for deployment: ONNX with the normalisation inside, and the contract beside it."""

import hashlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import nn

from bumblebee.learning import pretrained
from bumblebee.learning.policy import Policy, load_policy
from bumblebee.robot.facts import joint_names, joints, stand_pose
from bumblebee.robot.model import gains
from bumblebee.tracking.config import ObservationConfig
from bumblebee.tracking.observations import action_scale
from bumblebee.tracking.terms import parts

ONNX, CONTRACT = "policy.onnx", "contract.json"
OPSET, IR_VERSION = 17, 8  # read by every onnxruntime since 1.14


def export_policy(folder: Path, policy: Policy, physics_hz: float = 200.0) -> None:
    """Write `policy.onnx` (input "obs" (N, D), output "actions" (N, J), the mean) and `contract.json`."""
    shape = policy.shape
    write_export(folder, onnx_of(policy), shape.ahead, physics_hz, shape.seen, shape.action)


def export_shipped(folder: Path) -> Path:
    """Export the policy that comes with BumbleBee into a new folder, which is returned."""
    folder.mkdir(parents=True)
    export_policy(folder, load_policy(pretrained.FOLDER))
    return folder


def write_export(
    folder: Path,
    onnx_bytes: bytes,
    ahead: tuple[float, ...],
    physics_hz: float = 200.0,
    seen: ObservationConfig | None = None,
    action: str = "reference",
) -> None:
    """Write any ONNX policy over our observations with its contract."""
    folder = Path(folder)
    (folder / ONNX).write_bytes(onnx_bytes)
    stated = contract(onnx_bytes, ahead, physics_hz, seen or ObservationConfig(), action)
    (folder / CONTRACT).write_text(json.dumps(stated, indent=1) + "\n")


def contract(
    onnx_bytes: bytes, ahead: tuple[float, ...], physics_hz: float, seen: ObservationConfig, action: str
) -> dict[str, Any]:
    """What a runner must know to feed the policy and to use its output.

    "observation" lists the parts of one control step; the input has "history" of them, the oldest first, and then the
    parts "observation_now" of the newest step alone.
    """
    table = [gains(joint) for joint in joints()]

    def listed(terms: Sequence[str]) -> list[dict[str, Any]]:
        return [{"name": name, "size": size} for name, size in parts(terms, len(table), len(ahead))]

    return {
        "schema": 1,
        "robot": "g1_23dof",
        "joints": list(joint_names()),
        "kp": [round(kp, 6) for kp, _ in table],
        "kd": [round(kd, 6) for _, kd in table],
        "control_hz": 50,
        "physics_hz": physics_hz,
        "default_pos": [round(float(q), 6) for q in stand_pose()],
        "ahead": list(ahead),
        "action": {
            "base": action,
            "scale": [round(float(s), 6) for s in action_scale()],
            "feed_forward": "quasi-static",  # tracking/feed_forward.py, of the clip and the declared model
        },
        "terms": list(seen.terms),
        "history": seen.history,
        "now": list(seen.now),
        "observation": listed(seen.terms),
        "observation_now": listed(seen.now),
        "onnx_sha256": hashlib.sha256(onnx_bytes).hexdigest(),
    }


def onnx_of(policy: Policy) -> bytes:
    """The actor as an ONNX graph: (obs - mean) / (std + eps), then Gemm and ELU layer by layer."""
    from onnx import TensorProto, checker, helper, numpy_helper

    actor, shape = policy.actor, policy.shape
    normalizer = actor.obs_normalizer
    weights: list[Any] = []
    nodes: list[Any] = []

    def constant(name: str, tensor: torch.Tensor) -> str:
        weights.append(numpy_helper.from_array(tensor.detach().numpy().astype(np.float32), name))
        return name

    nodes.append(helper.make_node("Sub", ["obs", constant("mean", normalizer._mean)], ["centred"]))
    nodes.append(helper.make_node("Div", ["centred", constant("scale", normalizer._std + normalizer.eps)], ["scaled"]))
    value = "scaled"
    for index, layer in enumerate(actor.mlp):
        out = f"layer{index}"
        if isinstance(layer, nn.Linear):
            names = [constant(f"{out}_weight", layer.weight), constant(f"{out}_bias", layer.bias)]
            nodes.append(helper.make_node("Gemm", [value, *names], [out], transB=1))
        elif isinstance(layer, nn.ELU):
            nodes.append(helper.make_node("Elu", [value], [out], alpha=layer.alpha))
        else:
            raise TypeError(f"no ONNX form for {type(layer).__name__} in the actor")
        value = out
    nodes[-1].output[0] = "actions"
    graph = helper.make_graph(
        nodes,
        "policy",
        [helper.make_tensor_value_info("obs", TensorProto.FLOAT, ["N", shape.observation])],
        [helper.make_tensor_value_info("actions", TensorProto.FLOAT, ["N", shape.actions])],
        weights,
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)], producer_name="bumblebee")
    model.ir_version = IR_VERSION
    checker.check_model(model)
    return model.SerializeToString()
