"""Export of a policy for deployment: ONNX with the normalisation inside, and the contract beside it."""

import hashlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from bumblebee.learning import pretrained
from bumblebee.learning.generalist.transformer import TransformerModel
from bumblebee.learning.onnx_graph import IR_VERSION, OPSET, Graph, behind_memory, layers, normalised
from bumblebee.learning.policy import Policy, load_policy
from bumblebee.robot.facts import IDENTITY, ROBOT, joint_names, joints, stand_pose
from bumblebee.robot.model import gains
from bumblebee.tracking.config import ObservationConfig
from bumblebee.tracking.observing.needs import needed
from bumblebee.tracking.observing.observations import action_scale
from bumblebee.tracking.observing.terms import expanded, parts

ONNX, CONTRACT = "policy.onnx", "contract.json"


def export_policy(folder: Path, policy: Policy, physics_hz: float = 200.0) -> None:
    """Write `policy.onnx` (input "obs" (N, D), output "actions" (N, J), the mean) and `contract.json`.

    With a memory "memory" (N, M, E + 1) goes in, too, and "memory_next" of the same shape out.
    """
    shape = policy.shape
    write_export(folder, onnx_of(policy), shape.ahead, physics_hz, shape.seen, shape.action, shape.memory)


def export_shipped(folder: Path, name: str = "shipped") -> Path:
    """Export a policy that comes with BumbleBee, by its name in `pretrained.SHIPPED`, into a new folder, returned."""
    folder.mkdir(parents=True)
    export_policy(folder, load_policy(pretrained.SHIPPED[name]))
    return folder


def write_export(
    folder: Path,
    onnx_bytes: bytes,
    ahead: tuple[float, ...],
    physics_hz: float = 200.0,
    seen: ObservationConfig | None = None,
    action: str = "reference",
    memory: tuple[int, int] | None = None,
) -> None:
    """Write any ONNX policy over our observations with its contract; `memory` (M, E + 1) is of one robot."""
    folder = Path(folder)
    (folder / ONNX).write_bytes(onnx_bytes)
    stated = contract(onnx_bytes, ahead, physics_hz, seen or ObservationConfig(), action, memory)
    (folder / CONTRACT).write_text(json.dumps(stated, indent=1) + "\n")


def contract(
    onnx_bytes: bytes,
    ahead: tuple[float, ...],
    physics_hz: float,
    seen: ObservationConfig,
    action: str,
    memory: tuple[int, int] | None = None,
) -> dict[str, Any]:
    """Contract that a runner needs to feed the policy and to use its output.

    "observation" lists the parts of one control step; the input has "history" of them, the oldest first, and then the
    parts "observation_now" of the newest step alone. "sensors" names the readings that it takes
    (`tracking.observing.needs.READINGS`); no other has any effect. A policy with a memory has "memory": zeros of its
    shape go in at a clip's start, then what the step before gave out.
    """
    table, counts = [gains(joint) for joint in joints()], (len(joints()), len(ahead))
    looks_ahead = any(name.startswith("ahead") for name, _ in parts((*seen.terms, *seen.now), *counts))
    return {
        "schema": 1,
        "robot": ROBOT,
        "robot_sha256": IDENTITY,
        "joints": list(joint_names()),
        "kp": [round(kp, 6) for kp, _ in table],
        "kd": [round(kd, 6) for _, kd in table],
        "control_hz": 50,
        "physics_hz": physics_hz,
        "default_pos": [round(float(q), 6) for q in stand_pose()],
        "ahead": list(ahead) if looks_ahead else [],  # a student's task may have frames for its teacher alone
        "action": {
            "base": action,
            "scale": [round(float(s), 6) for s in action_scale()],
            "feed_forward": "quasi-static",  # tracking/feed_forward.py, of the clip and the declared model
        },
        "sensors": list(needed(expanded((*seen.terms, *seen.now)), *counts)),
        "terms": list(seen.terms),
        "history": seen.history,
        "now": list(seen.now),
        "observation": _listed(seen.terms, *counts),
        "observation_now": _listed(seen.now, *counts),
        **({} if memory is None else {"memory": {"steps": memory[0], "size": memory[1]}}),
        "onnx_sha256": hashlib.sha256(onnx_bytes).hexdigest(),
    }


def _listed(terms: Sequence[str], joint_count: int, ahead: int) -> list[dict[str, Any]]:
    return [{"name": name, "size": size} for name, size in parts(terms, joint_count, ahead)]


def onnx_of(policy: Policy) -> bytes:
    """The actor as an ONNX graph: (obs - mean) / (std + eps), perhaps a block with a memory, then layers."""
    from onnx import TensorProto, checker, helper

    actor, shape, graph = policy.actor, policy.shape, Graph()
    value = normalised(graph, actor)
    inputs: dict[str, list[str | int | None]] = {"obs": ["N", shape.observation]}
    outputs: dict[str, list[str | int | None]] = {"actions": ["N", shape.actions]}
    if isinstance(actor, TransformerModel):
        value = behind_memory(graph, actor, value)
        inputs["memory"] = outputs["memory_next"] = ["N", *actor.settings.memory_shape]
    layers(graph, actor.mlp, value)
    graph.nodes[-1].output[0] = "actions"
    came, gone = (
        [helper.make_tensor_value_info(name, TensorProto.FLOAT, size) for name, size in side.items()]
        for side in (inputs, outputs)
    )
    made = helper.make_graph(graph.nodes, "policy", came, gone, graph.weights)
    model = helper.make_model(made, opset_imports=[helper.make_opsetid("", OPSET)], producer_name="bumblebee")
    model.ir_version = IR_VERSION
    checker.check_model(model)
    return model.SerializeToString()
