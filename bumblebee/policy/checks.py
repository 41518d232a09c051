"""Is a policy folder what it claims to be: types and ranges in contract.json, a model that reads no other file."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from bumblebee.errors import BadInput

_MOST = 100_000  # entries of a list, numbers of a part
_LISTS: dict[str, tuple[float, float, str]] = {
    "kp": (0.0, 1e5, "N m/rad"),
    "kd": (0.0, 1e5, "N m s/rad"),
    "default_pos": (-6.3, 6.3, "rad"),
    "ahead": (0.0, 60.0, "s"),
}
_NUMBERS: dict[str, tuple[float, float, str]] = {"control_hz": (1, 1000, "Hz"), "physics_hz": (1, 100_000, "Hz")}
_TEXTS = ("joints", "terms", "now")


def check_fields(path: Path, contract: dict[str, Any]) -> None:
    """Types and ranges of what contract.json has; which of it must be there is asked before.

    Raises:
        BadInput: naming the field.
    """
    if "schema" in contract and (type(contract["schema"]) is not int or contract["schema"] != 1):
        raise BadInput(f"{path}: schema", "1", repr(contract["schema"])[:60], "Export it with this version.")
    for key, bounds in _NUMBERS.items():
        if key in contract:
            _check_number(f"{path}: {key}", contract[key], *bounds)
    for key, bounds in _LISTS.items():
        if key in contract:
            _check_list(f"{path}: {key}", contract[key], *bounds)
    for key in _TEXTS:
        if key in contract and not _is_list(contract[key], str):
            raise BadInput(f"{path}: {key}", "a list of names", repr(contract[key])[:60])
    action = contract["action"]
    if not isinstance(action, dict) or "scale" not in action:
        raise BadInput(f"{path}: action", "a table with scale", repr(action)[:60])
    _check_list(f"{path}: action.scale", action["scale"], 0.0, 10.0, "rad")
    if not isinstance(contract["onnx_sha256"], str):
        raise BadInput(f"{path}: onnx_sha256", "a hash", repr(contract["onnx_sha256"])[:60])
    for key in ("observation", "observation_now"):
        _check_parts(f"{path}: {key}", contract.get(key, []))
    history = contract.get("history", 1)
    if type(history) is not int or not 1 <= history <= 1000:
        raise BadInput(f"{path}: history", "a number of control steps from 1 to 1000", repr(history)[:60])
    if "memory" in contract:
        _check_memory(f"{path}: memory", contract["memory"])


def check_tensors(where: str, values: Sequence[Any], wanted: Mapping[str, tuple[int, ...]], others: bool) -> None:
    """Refuse a model whose inputs or outputs are not what its contract says.

    Args:
        where: file and side.
        values: onnxruntime's inputs or outputs.
        wanted: name -> shape of one robot's values, which stand behind the number of robots.
        others: whether further ones may be there.

    Raises:
        BadInput: naming what was expected.
    """
    types = {value.name: value.type for value in values}
    shapes = {value.name: list(value.shape) for value in values}
    fits = others or set(shapes) == set(wanted)
    for name, shape in wanted.items():
        came = shapes.get(name, [])
        fits = fits and len(came) == 1 + len(shape) and tuple(came[1:]) == shape
    if not fits:
        said = ", ".join(f"{name} (N, {', '.join(map(str, shape))})" for name, shape in wanted.items())
        raise BadInput(where, said, str(shapes)[:200])
    for name in wanted:
        if types[name] != "tensor(float)":
            raise BadInput(f"{where}: {name}", "tensor(float)", types[name])


def check_self_contained(path: Path, model: bytes) -> None:
    """Refuse a model whose weights lie in another file: the contract's hash does not cover that one.

    Raises:
        BadInput: no ONNX model, or one with external data.
    """
    import onnx

    try:
        proto = onnx.load_model_from_string(model)
    except Exception as error:  # protobuf raises its own types
        raise BadInput(path, "an ONNX model", str(error)[:200]) from None
    for tensor in _tensors(proto):
        if tensor.data_location == onnx.TensorProto.EXTERNAL or len(tensor.external_data):
            location = next((e.value for e in tensor.external_data if e.key == "location"), "")
            came = f"{tensor.name[:60]!r} in the file {location[:80]!r}"
            raise BadInput(path, "a model that holds its own weights", came, "Export the policy again.")


def _tensors(proto: Any) -> Iterator[Any]:
    """All tensors of a model, those of inner graphs, attributes and functions included."""
    waiting = [proto.graph, *proto.functions]
    while waiting:
        part = waiting.pop()
        yield from getattr(part, "initializer", ())
        for sparse in getattr(part, "sparse_initializer", ()):
            yield from (sparse.values, sparse.indices)
        for attribute in (a for node in part.node for a in node.attribute):
            yield from (attribute.t, *attribute.tensors)
            for sparse in (attribute.sparse_tensor, *attribute.sparse_tensors):
                yield from (sparse.values, sparse.indices)
            waiting += [attribute.g] if attribute.HasField("g") else []
            waiting += attribute.graphs


def _check_memory(where: str, memory: Any) -> None:
    if not isinstance(memory, dict) or set(memory) != {"steps", "size"}:
        raise BadInput(where, "a table with steps and size", repr(memory)[:60])
    for key, most in (("steps", 200), ("size", 4097)):  # a robot's memory then takes 3 MB at most
        if type(memory[key]) is not int or not 1 <= memory[key] <= most:
            raise BadInput(f"{where}.{key}", f"a whole number from 1 to {most}", repr(memory[key])[:60])


def _check_parts(where: str, parts: Any) -> None:
    if not _is_list(parts, dict):
        raise BadInput(where, "a list of parts, each with name and size", repr(parts)[:60])
    for index, part in enumerate(parts):
        if not isinstance(part.get("name"), str):
            raise BadInput(f"{where}[{index}]: name", "the name of a part", repr(part.get("name"))[:60])
        if type(part.get("size")) is not int or not 1 <= part["size"] <= _MOST:
            raise BadInput(f"{where}[{index}]: size", f"a whole number from 1 to {_MOST}", repr(part.get("size"))[:60])


def _check_list(where: str, values: Any, lower: float, upper: float, unit: str) -> None:
    if not isinstance(values, list) or len(values) > _MOST:
        raise BadInput(where, "a list of numbers", repr(values)[:60])
    for index, value in enumerate(values):
        _check_number(f"{where}[{index}]", value, lower, upper, unit)


def _check_number(where: str, value: Any, lower: float, upper: float, unit: str) -> None:
    if isinstance(value, bool) or not isinstance(value, int | float) or not lower <= value <= upper:
        raise BadInput(where, f"a number from {lower:g} to {upper:g} {unit}", repr(value)[:60])


def _is_list(values: Any, kind: type) -> bool:
    return isinstance(values, list) and len(values) <= _MOST and all(isinstance(value, kind) for value in values)
