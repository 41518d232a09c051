"""Bad policy folders by hand: what each is called, and what damages a good one."""

import hashlib
import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

Make = Callable[[Path], object]


def edited(change: Callable[[dict[str, Any]], object]) -> Make:
    def make(folder: Path) -> None:
        contract = json.loads((folder / "contract.json").read_text())
        change(contract)
        (folder / "contract.json").write_text(json.dumps(contract))

    return make


def stated(key: str, value: Any) -> Make:
    return edited(lambda contract: contract.__setitem__(key, value))


def entry(key: str, index: int, value: Any) -> Make:
    return edited(lambda contract: contract[key].__setitem__(index, value))


def action(key: str, value: Any) -> Make:
    return edited(lambda contract: contract["action"].__setitem__(key, value))


def without(key: str) -> Make:
    return edited(lambda contract: contract.pop(key))


def contract(content: bytes) -> Make:
    return lambda folder: (folder / "contract.json").write_bytes(content)


def onnx_bytes(content: bytes) -> Make:
    """Another file as the model, its hash stated as it should be."""

    def make(folder: Path) -> None:
        (folder / "policy.onnx").write_bytes(content)
        stated("onnx_sha256", hashlib.sha256(content).hexdigest())(folder)

    return make


def model(change: Callable[[Any], object]) -> Make:
    """The model changed, its hash stated as it should be."""

    def make(folder: Path) -> None:
        import onnx

        proto = onnx.load_model(str(folder / "policy.onnx"))
        change(proto)
        onnx_bytes(proto.SerializeToString())(folder)

    return make


def width(end: str, size: int) -> Make:
    def change(proto: Any) -> None:
        getattr(proto.graph, end)[0].type.tensor_type.shape.dim[1].dim_value = size

    return model(change)


def external(location: str) -> Make:
    """Weights that lie in another file."""

    def change(proto: Any) -> None:
        (tensor,) = proto.graph.initializer
        size = len(tensor.raw_data)
        tensor.ClearField("raw_data")
        tensor.data_location = 1
        for key, value in (("location", location), ("offset", "0"), ("length", str(size))):
            fact = tensor.external_data.add()
            fact.key, fact.value = key, value

    return model(change)


def weights(value: float) -> Make:
    def change(proto: Any) -> None:
        (tensor,) = proto.graph.initializer
        tensor.raw_data = np.full(tuple(tensor.dims), value, dtype=np.float32).tobytes()

    return model(change)


def not_a_number(proto: Any) -> None:
    """Actions = obs @ W / 0: NaN for an observation of zeros."""
    from onnx import helper, numpy_helper

    proto.graph.node[0].output[0] = "product"
    proto.graph.initializer.append(numpy_helper.from_array(np.zeros(1, np.float32), "zero"))
    proto.graph.node.append(helper.make_node("Div", ["product", "zero"], ["actions"]))


def one_row(proto: Any) -> None:
    for value in (*proto.graph.input, *proto.graph.output):
        value.type.tensor_type.shape.dim[0].dim_value = 1


def doubles(proto: Any) -> None:
    for value in (*proto.graph.input, *proto.graph.output):
        value.type.tensor_type.elem_type = 11
    (tensor,) = proto.graph.initializer
    values = np.frombuffer(tensor.raw_data, np.float32).astype(np.float64)
    tensor.raw_data, tensor.data_type = values.tobytes(), 11


def pipe(name: str) -> Make:
    def make(folder: Path) -> None:
        (folder / name).unlink()
        os.mkfifo(folder / name)

    return make


def zero(name: str) -> Make:
    def make(folder: Path) -> None:
        (folder / name).unlink()
        (folder / name).symlink_to("/dev/zero")

    return make


POLICIES: dict[str, Make] = {
    "contract: gone": lambda folder: (folder / "contract.json").unlink(),
    "contract: empty": contract(b""),
    "contract: bytes": contract(bytes(range(256))),
    "contract: a list": contract(b"[1, 2]"),
    "contract: a number": contract(b"3"),
    "contract: 100,000 deep": contract(b"[" * 100_000 + b"]" * 100_000),
    "contract: a pipe": pipe("contract.json"),
    "contract: endless": zero("contract.json"),
    **{
        f"contract: without {key}": without(key)
        for key in ("joints", "kp", "kd", "action", "observation", "control_hz")
    },
    "contract: without a hash": without("onnx_sha256"),
    "contract: hash a number": stated("onnx_sha256", 5),
    "contract: another hash": stated("onnx_sha256", "0" * 64),
    "contract: schema 2": stated("schema", 2),
    "joints: a word": stated("joints", "left_knee_joint"),
    "joints: a number": stated("joints", 23),
    "joints: numbers": stated("joints", list(range(23))),
    "joints: one too few": edited(lambda c: c["joints"].pop()),
    "joints: one too many": edited(lambda c: c["joints"].append("tail_joint")),
    "kp: one too few": edited(lambda c: c["kp"].pop()),
    "kp: a number": stated("kp", 100.0),
    "kp: text": entry("kp", 3, "100"),
    "kp: null": entry("kp", 3, None),
    "kp: NaN": entry("kp", 3, float("nan")),
    "kp: infinite": entry("kp", 3, float("inf")),
    "kp: negative": entry("kp", 3, -100.0),
    "kp: another robot's": entry("kp", 3, 7.0),
    "kd: lists": stated("kd", [[1.0]] * 23),
    "kd: NaN": entry("kd", 0, float("nan")),
    "kd: a table": stated("kd", {"a": 1}),
    "control_hz: 0": stated("control_hz", 0),
    "control_hz: negative": stated("control_hz", -50),
    "control_hz: text": stated("control_hz", "50"),
    "control_hz: 1e300": stated("control_hz", 1e300),
    "physics_hz: NaN": stated("physics_hz", float("nan")),
    "default_pos: one too few": edited(lambda c: c["default_pos"].pop()),
    "default_pos: 1e9": entry("default_pos", 0, 1e9),
    "action: a word": stated("action", "reference"),
    "action: null": stated("action", None),
    "action: no scale": edited(lambda c: c["action"].pop("scale")),
    "scale: NaN": edited(lambda c: c["action"]["scale"].__setitem__(2, float("nan"))),
    "scale: infinite": edited(lambda c: c["action"]["scale"].__setitem__(2, float("inf"))),
    "scale: 1e9 rad": edited(lambda c: c["action"]["scale"].__setitem__(2, 1e9)),
    "scale: text": action("scale", "0.5"),
    "feed_forward: learned": action("feed_forward", "learned"),
    "feed_forward: a list": action("feed_forward", []),
    "base: a list": action("base", ["reference"]),
    "observation: a word": stated("observation", "demo"),
    "observation: of words": stated("observation", ["demo"]),
    "observation: no size": edited(lambda c: c["observation"][0].pop("size")),
    "observation: size text": edited(lambda c: c["observation"][0].update(size="3")),
    "observation: size negative": edited(lambda c: c["observation"][0].update(size=-3)),
    "observation: another order": edited(lambda c: c["observation"].reverse()),
    "observation: a part too few": edited(lambda c: c["observation"].pop()),
    "terms: a number": stated("terms", 5),
    "terms: unknown": stated("terms", ["magic"]),
    "now: null": stated("now", None),
    "history: 0": stated("history", 0),
    "history: true": stated("history", True),
    "history: a million": stated("history", 1_000_000),
    "ahead: NaN": edited(lambda c: c["ahead"].__setitem__(0, float("nan"))),
    "ahead: text": stated("ahead", "soon"),
    "ahead: one too many": edited(lambda c: c["ahead"].append(0.5)),
    "onnx: gone": lambda folder: (folder / "policy.onnx").unlink(),
    "onnx: a folder": lambda folder: ((folder / "policy.onnx").unlink(), (folder / "policy.onnx").mkdir()),
    "onnx: a pipe": pipe("policy.onnx"),
    "onnx: endless": zero("policy.onnx"),
    "onnx: empty": onnx_bytes(b""),
    "onnx: rubbish": onnx_bytes(bytes(range(256))),
    "onnx: text": onnx_bytes(b"hello\nworld\n"),
    "onnx: without a graph": model(lambda proto: proto.ClearField("graph")),
    "onnx: another input size": width("input", 10),
    "onnx: another output size": width("output", 22),
    "onnx: another name": model(lambda proto: proto.graph.input[0].__setattr__("name", "x")),
    "onnx: weights in /etc/passwd": external("/etc/passwd"),
    "onnx: weights above the folder": external("../../../../etc/passwd"),
    "onnx: weights beside it": external("weights.bin"),
    "onnx: an unknown operation": model(lambda proto: proto.graph.node[0].__setattr__("op_type", "Magic")),
    "onnx: another's operations": model(lambda proto: proto.graph.node[0].__setattr__("domain", "evil")),
    "onnx: NaN for an answer": model(not_a_number),
    "onnx: NaN for weights": weights(float("nan")),
    "onnx: one row only": model(one_row),
    "onnx: doubles": model(doubles),
}
