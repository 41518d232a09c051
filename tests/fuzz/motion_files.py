"""Small valid inputs to damage: a CSV file, a pickle, a library, an effects file, a policy folder."""

import json
from pathlib import Path
from typing import Any

import joblib
import numpy as np
import pyarrow.parquet as pq

from bumblebee.motion.clip import Clip
from bumblebee.motion.kinematics import make_clip
from bumblebee.motion.store import write_library
from bumblebee.robot.facts import joint_names, stand_pose
from tests.motion.conftest import standing

EFFECTS = """\
schema: 1
effects:
- effect: coulomb_friction
  where: [left_knee_joint]
  parameters: {frictionloss: 0.5}
- effect: command_delay
  where: []
  parameters: {delay: 0.01}
- effect: discovered
  where: [left_knee_joint]
  parameters:
    terms:
    - {term: sin(12*q), coefficient: 0.3}
    - {term: 'friction(q[left_hip_pitch_joint]^2)', coefficient: 0.001}
"""
FACTS = b"bumblebee.clips"


def motion(frames: int = 24) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Root positions (T, 3) [m], quaternions wxyz (T, 4) and joint angles (T, 23) [rad] of a robot that sways."""
    time = np.arange(frames) / 30
    joint_pos = stand_pose() + 0.1 * np.sin(3 * time)[:, None] * np.linspace(0.2, 1, 23)
    half = 0.2 + 0.1 * np.sin(time)
    root_quat = np.stack([np.cos(half), 0 * half, 0 * half, np.sin(half)], axis=1)
    return standing(root_quat, joint_pos), root_quat, joint_pos


def table(frames: int = 24) -> np.ndarray:
    """Rows of a CSV file with 23 joints, (T, 30)."""
    root_pos, root_quat, joint_pos = motion(frames)
    return np.concatenate([root_pos, root_quat[:, [1, 2, 3, 0]], joint_pos], axis=1)


def csv(values: np.ndarray) -> str:
    """Rows as text."""
    return "".join(",".join(f"{value:.6f}" for value in row) + "\n" for row in values)


def fields(frames: int = 24, **changed: Any) -> dict[str, Any]:
    """A motion of an ASAP pickle."""
    root_pos, root_quat, joint_pos = motion(frames)
    asap = {"root_trans_offset": root_pos, "root_rot": root_quat[:, [1, 2, 3, 0]], "dof": joint_pos, "fps": 30}
    return {**asap, **changed}


def pickle(path: Path, **changed: Any) -> None:
    """A joblib pickle of one motion."""
    joblib.dump({"sway": fields(**changed)}, path)


def clip(name: str = "sway", **about: Any) -> Clip:
    """A clip with captions."""
    return make_clip(name, 50.0, *motion(), captions=("a person sways.#a/DET#0.0#0.0",), licence="MIT", **about)


def library(folder: Path, *names: str) -> Path:
    """A library of such clips."""
    write_library(folder, [clip(name) for name in names or ("sway",)])
    return folder


def shard(folder: Path) -> Path:
    """The file of a library's only shard."""
    (path,) = (folder / "clips").iterdir()
    return path


def change_facts(path: Path, change: Any) -> None:
    """Rewrite the facts about a shard's first clip; `change` gets them as a dict and may return text instead."""
    found = pq.read_table(path)
    facts = json.loads(found.schema.metadata[FACTS])
    text = change(facts[0])
    text = text if isinstance(text, str) else json.dumps(facts)
    pq.write_table(found.replace_schema_metadata({FACTS: text.encode()}), path)


def policy(folder: Path, gain: float = 0.0) -> Path:
    """An exported policy that answers with zeros."""
    from onnx import TensorProto, helper, numpy_helper

    from bumblebee.learning.export import write_export
    from bumblebee.tracking.observing.observations import layout
    from bumblebee.tracking.sampling.library import AHEAD

    size = sum(part for _, part in layout(23, len(AHEAD)))
    weight = np.full((size, 23), gain, dtype=np.float32)
    ends = [helper.make_tensor_value_info(n, TensorProto.FLOAT, ["N", s]) for n, s in (("obs", size), ("actions", 23))]
    node = helper.make_node("MatMul", ["obs", "W"], ["actions"])
    graph = helper.make_graph([node], "tiny", ends[:1], ends[1:], [numpy_helper.from_array(weight, "W")])
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)])
    model.ir_version = 8
    folder.mkdir(parents=True)
    write_export(folder, model.SerializeToString(), AHEAD)
    return folder


JOINTS = joint_names()
