"""A tiny policy, a tiny clip, robots with a floor: what the tests of the deployment share."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from bumblebee.learning.export import write_export
from bumblebee.motion.clip import Clip
from bumblebee.motion.kinematics import make_clip, sole_points
from bumblebee.robot.facts import stand_pose
from bumblebee.tracking.observing.observations import layout
from bumblebee.tracking.sampling.library import AHEAD


def linear_onnx(gain: float, ahead: int = len(AHEAD)) -> bytes:
    """Actions = obs @ W, W random with deviation `gain`; 0 gives a policy that follows the reference blindly."""
    from onnx import TensorProto, helper, numpy_helper

    size = sum(part for _, part in layout(23, ahead))
    weight = (gain * np.random.default_rng(0).standard_normal((size, 23))).astype(np.float32)
    obs = helper.make_tensor_value_info("obs", TensorProto.FLOAT, ["N", size])
    actions = helper.make_tensor_value_info("actions", TensorProto.FLOAT, ["N", 23])
    node = helper.make_node("MatMul", ["obs", "W"], ["actions"])
    graph = helper.make_graph([node], "tiny", [obs], [actions], [numpy_helper.from_array(weight, "W")])
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)])
    model.ir_version = 8
    return model.SerializeToString()


def nod(name: str = "nod", frames: int = 20, **about: object) -> Clip:
    """A stand with arms that swing a little, soles on the floor."""
    joint_pos = np.tile(stand_pose(), (frames, 1))
    joint_pos[:, [15, 19]] += 0.2 * np.sin(np.arange(frames) / 8)[:, None]
    root_quat = np.tile([1.0, 0.0, 0.0, 0.0], (frames, 1))
    root_pos = np.zeros((frames, 3))
    root_pos[:, 2] -= sole_points(root_pos, root_quat, joint_pos)[..., 2].min(axis=(1, 2))
    return make_clip(name, 50.0, root_pos, root_quat, joint_pos, family="gesture", **about)


@pytest.fixture
def policy_folder(tmp_path: Path) -> Callable[..., Path]:
    """Makes a policy folder; `gain` as in `linear_onnx`, `ahead` the look-ahead times [s]."""

    def make(name: str = "policy", gain: float = 0.0, ahead: tuple[float, ...] = AHEAD) -> Path:
        folder = tmp_path / name
        folder.mkdir()
        write_export(folder, linear_onnx(gain, len(ahead)), ahead)
        return folder

    return make
