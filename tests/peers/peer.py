"""A made-up peer of 29 joints in an order of its own: its contract as a table, and an ONNX file that fits it."""

from pathlib import Path
from typing import Any

import numpy as np
import yaml

from bumblebee.robot.facts import joint_names

JOINTS = tuple(reversed(joint_names(every=True)))
ANKLE = "left_ankle_roll_joint"


def table(**changes: Any) -> dict[str, Any]:
    """The contract; a value of None takes a field out."""
    made = {
        "robot": "g1",
        "name": "made up",
        "joints": list(JOINTS),
        "default_pos": [0.1 * (i % 3) for i in range(29)],
        "kp": [100.0] * 29,
        "kd": [3.0] * 29,
        "action": {"scale": 0.5, "clip": 2.0},
        "groups": {
            "robot": [
                {"term": "base_ang_vel", "scale": 0.25},
                {"term": "joint_vel", "scale": 0.05, "zero": [ANKLE]},
                {"term": "last_action"},
            ],
            "motion": [{"term": "reference_lin_vel", "axes": "xy"}, {"term": "reference_joint_pos", "step": 2}],
        },
        "input": [
            {"groups": ["motion"]},
            {"groups": ["robot", "motion"], "past": 2, "now": False},
            {"groups": ["robot"], "past": 1, "order": "newest_first", "stacked": "by_term", "begin": "first"},
        ],
    } | changes
    return {name: value for name, value in made.items() if value is not None}


WIDTH = 31 + 2 * (61 + 31) + 2 * 61


def write_contract(path: Path, **changes: Any) -> Path:
    """The contract as a file."""
    path.write_text(yaml.safe_dump(table(**changes)))
    return path


def write_onnx(
    path: Path, width: int = WIDTH, joints: int = 29, weight: np.ndarray | None = None, n: Any = "N"
) -> Path:
    """Outputs = input @ weight (width, joints); zeros without one."""
    from onnx import TensorProto, helper, numpy_helper

    weight = np.zeros((width, joints), np.float32) if weight is None else weight.astype(np.float32)
    seen = helper.make_tensor_value_info("input", TensorProto.FLOAT, [n, width])
    output = helper.make_tensor_value_info("output", TensorProto.FLOAT, [n, joints])
    node = helper.make_node("MatMul", ["input", "W"], ["output"])
    graph = helper.make_graph([node], "tiny", [seen], [output], [numpy_helper.from_array(weight, "W")])
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)])
    model.ir_version = 8
    path.write_bytes(model.SerializeToString())
    return path
