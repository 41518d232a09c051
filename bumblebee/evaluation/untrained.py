"""A policy as it is before training: the trained network's own ONNX graph with freshly drawn weights.

Success before training is measured with it, so that the success of the trained policy has its nought beside it.
"""

import hashlib
import json
from pathlib import Path

import numpy as np


def export_untrained(like: Path, folder: Path, seed: int = 0) -> None:
    """Copy an exported policy with every weight matrix drawn anew (uniform, +-1/sqrt(fan-in)) and every bias at nought.

    What is not a weight (the observation's running mean and deviation) stays: an untrained network on sane inputs.

    Args:
        like: folder of an exported policy.
        folder: where the untrained one goes.
        seed: of the weights.
    """
    import onnx
    from onnx import numpy_helper

    model = onnx.load(like / "policy.onnx")
    rng = np.random.default_rng(seed)
    biases = _biases(model)
    for tensor in model.graph.initializer:
        values = numpy_helper.to_array(tensor)
        if values.dtype != np.float32:
            continue
        if values.ndim == 2 and min(values.shape) > 1:
            bound = 1.0 / np.sqrt(_fan_in(model, tensor.name, values.shape))
            fresh = rng.uniform(-bound, bound, values.shape).astype(np.float32)
        elif tensor.name in biases:
            fresh = np.zeros_like(values)
        else:
            continue
        tensor.CopyFrom(numpy_helper.from_array(fresh, tensor.name))
    folder.mkdir(parents=True, exist_ok=True)
    onnx.save(model, folder / "policy.onnx")
    contract = json.loads((like / "contract.json").read_text())
    contract["onnx_sha256"] = hashlib.sha256((folder / "policy.onnx").read_bytes()).hexdigest()
    (folder / "contract.json").write_text(json.dumps(contract, indent=1) + "\n")


def _biases(model) -> set[str]:  # noqa: ANN001 (onnx.ModelProto)
    """Names of the tensors that a Gemm adds."""
    return {node.input[2] for node in model.graph.node if node.op_type == "Gemm" and len(node.input) > 2}


def _fan_in(model, name: str, shape: tuple[int, ...]) -> int:  # noqa: ANN001 (onnx.ModelProto)
    for node in model.graph.node:
        if name in node.input and node.op_type == "Gemm":
            transposed = any(a.name == "transB" and a.i for a in node.attribute)
            return shape[1] if transposed else shape[0]
    return shape[0]
