"""Actors as ONNX graphs, written node by node: names and order are ours, and so is the file's hash."""

from typing import Any

import numpy as np
import torch
from rsl_rl.models import MLPModel
from torch import Tensor, nn

from bumblebee.learning.generalist.attention import GatedBlock, GruGate, WindowAttention
from bumblebee.learning.generalist.transformer import TransformerModel

OPSET, IR_VERSION = 17, 8  # read by every onnxruntime since 1.14


class Graph:
    """Nodes and weights in the order in which they are added."""

    def __init__(self) -> None:
        self.nodes: list[Any] = []
        self.weights: list[Any] = []

    def constant(self, name: str, values: Tensor | np.ndarray) -> str:
        """A weight of this name, float32; whole numbers stay as they are."""
        from onnx import numpy_helper

        array = values.detach().cpu().numpy().astype(np.float32) if isinstance(values, Tensor) else values
        self.weights.append(numpy_helper.from_array(np.ascontiguousarray(array), name))
        return name

    def add(self, kind: str, inputs: list[str], out: str, **attributes: Any) -> str:
        """A node with one output, whose name is returned."""
        from onnx import helper

        self.nodes.append(helper.make_node(kind, inputs, [out], **attributes))
        return out

    def linear(self, layer: nn.Linear, value: str, out: str) -> str:
        """A layer on (N, D) with its bias, on (..., D) without one."""
        if layer.bias is None:
            return self.add("MatMul", [value, self.constant(f"{out}_weight", layer.weight.T)], out)
        names = [self.constant(f"{out}_weight", layer.weight), self.constant(f"{out}_bias", layer.bias)]
        return self.add("Gemm", [value, *names], out, transB=1)

    def reshape(self, value: str, shape: list[int], out: str) -> str:
        """Another shape; 0 keeps a dimension."""
        return self.add("Reshape", [value, self.constant(f"{out}_shape", np.array(shape, dtype=np.int64))], out)

    def slice(self, value: str, axis: int, span: tuple[int, int], out: str) -> str:
        """Entries `span` along `axis`."""
        bounds = (("starts", span[0]), ("ends", span[1]), ("axes", axis))
        names = [self.constant(f"{out}_{name}", np.array([at], dtype=np.int64)) for name, at in bounds]
        return self.add("Slice", [value, *names], out)

    def pad_ones(self, value: str, axis: int, out: str) -> str:
        """(N, ., .) with a 1 after the end of `axis`."""
        pads = np.zeros(6, dtype=np.int64)
        pads[3 + axis] = 1
        names = [self.constant(f"{out}_pads", pads), self.constant(f"{out}_one", np.array(1.0, dtype=np.float32))]
        return self.add("Pad", [value, *names], out)


def normalised(graph: Graph, actor: MLPModel) -> str:
    """(obs - mean) / (std + eps)."""
    own = actor.obs_normalizer
    centred = graph.add("Sub", ["obs", graph.constant("mean", own._mean)], "centred")
    return graph.add("Div", [centred, graph.constant("scale", own._std + own.eps)], "scaled")


def layers(graph: Graph, modules: nn.Sequential, value: str, name: str = "layer") -> str:
    """Linear layers and ELUs, one after the other."""
    for index, layer in enumerate(modules):
        out = f"{name}{index}"
        if isinstance(layer, nn.Linear):
            value = graph.linear(layer, value, out)
        elif isinstance(layer, nn.ELU):
            value = graph.add("Elu", [value], out, alpha=layer.alpha)
        else:
            raise TypeError(f"no ONNX form for {type(layer).__name__} in the actor")
    return value


def behind_memory(graph: Graph, actor: TransformerModel, scaled: str) -> str:
    """The block's output (N, E) of one control step; "memory" goes in and "memory_next" out, (N, M, E + 1)."""
    memory, entries = actor.settings.memory_shape
    size = entries - 1
    token = layers(graph, actor.embedding, scaled, "embedding")
    row = graph.reshape(token, [0, 1, size], "token")
    kept = graph.slice("memory", 1, (1, memory), "kept")
    graph.add("Concat", [kept, graph.pad_ones(row, 2, "remembered")], "memory_next", axis=1)
    past = graph.slice("memory", 2, (0, size), "past")
    known = graph.pad_ones(graph.slice("memory", 2, (size, entries), "filled"), 1, "known")
    steps = graph.add("Concat", [past, row], "steps", axis=1)
    return _block(graph, actor.block, (token, steps, known))


def _block(graph: Graph, block: GatedBlock, values: tuple[str, str, str]) -> str:
    """`GatedBlock` of the newest step: `values` are it (N, E), all steps (N, M + 1, E), which of them are known."""
    token, steps, known = values
    normed = _norm(graph, block.before_attention, steps, "normed")
    seen = graph.add("Relu", [_attention(graph, block.attention, normed, known)], "seen")
    value = _gate(graph, block.after_attention, (token, seen), "gate0")
    wide = graph.linear(block.widen, _norm(graph, block.before_forward, value, "narrowed"), "wide")
    made = graph.linear(block.narrow, graph.add("Relu", [wide], "widened"), "narrow")
    return _gate(graph, block.after_forward, (value, graph.add("Relu", [made], "made")), "gate1")


def _attention(graph: Graph, own: WindowAttention, normed: str, known: str) -> str:
    """`WindowAttention` of the newest of M + 1 steps, (N, E)."""
    heads, reach, size = own.heads, own.memory + 1, own.query.in_features
    head = size // heads
    newest = graph.slice(normed, 1, (own.memory, reach), "newest")
    query = graph.reshape(graph.linear(own.query, newest, "query"), [0, 1, heads, head], "query_heads")
    parts = []
    for name, bias in (("content", own.content_bias), ("place", own.place_bias)):
        moved = graph.add("Add", [query, graph.constant(f"{name}_bias", bias[None, None])], f"{name}_query")
        parts.append(graph.add("Transpose", [moved], f"{name}_by_head", perm=(0, 2, 1, 3)))
    key = graph.reshape(graph.linear(own.key, normed, "key"), [0, reach, heads, head], "key_heads")
    key = graph.add("Transpose", [key], "key_by_head", perm=(0, 2, 3, 1))
    value = graph.reshape(graph.linear(own.value, normed, "value"), [0, reach, heads, head], "value_heads")
    value = graph.add("Transpose", [value], "value_by_head", perm=(0, 2, 1, 3))
    with torch.no_grad():
        table = own.place(own.distances).view(reach, heads, head).permute(1, 2, 0)
    places = graph.add("MatMul", [parts[1], graph.constant("places", table)], "place_score")
    score = graph.add("Add", [graph.add("MatMul", [parts[0], key], "content_score"), places], "score")
    score = graph.add(
        "Mul", [score, graph.constant("per_head", np.array(head**-0.5, dtype=np.float32))], "scaled_score"
    )
    held = graph.reshape(known, [0, 1, 1, reach], "known_by_head")
    held = graph.add("Greater", [held, graph.constant("half", np.array(0.5, dtype=np.float32))], "held")
    score = graph.add("Where", [held, score, graph.constant("never", np.array(-np.inf, dtype=np.float32))], "masked")
    weight = graph.add("Softmax", [score], "attended", axis=-1)
    merged = graph.add("Transpose", [graph.add("MatMul", [weight, value], "mixed")], "merged", perm=(0, 2, 1, 3))
    return graph.linear(own.out, graph.reshape(merged, [0, size], "all_heads"), "attention")


def _gate(graph: Graph, gate: GruGate, values: tuple[str, str], name: str) -> str:
    """`GruGate` of (old, new), (N, E) each."""
    old, new = values
    size = gate.of_kept.in_features
    of_new, of_old = graph.linear(gate.of_new, new, f"{name}_new"), graph.linear(gate.of_old, old, f"{name}_old")
    sums = []
    for index in range(2):
        span = (index * size, (index + 1) * size)
        pair = [graph.slice(part, 1, span, f"{part}_{index}") for part in (of_new, of_old)]
        sums.append(graph.add("Add", pair, f"{name}_sum{index}"))
    keep = graph.add("Sigmoid", [sums[0]], f"{name}_keep")
    late = graph.add("Sub", [sums[1], graph.constant(f"{name}_bias", gate.bias)], f"{name}_late")
    update = graph.add("Sigmoid", [late], f"{name}_update")
    kept = graph.linear(gate.of_kept, graph.add("Mul", [keep, old], f"{name}_kept"), f"{name}_of_kept")
    fresh = graph.add("Add", [graph.slice(of_new, 1, (2 * size, 3 * size), f"{name}_fresh"), kept], f"{name}_both")
    fresh = graph.add("Tanh", [fresh], f"{name}_tanh")
    step = graph.add("Mul", [update, graph.add("Sub", [fresh, old], f"{name}_away")], f"{name}_step")
    return graph.add("Add", [old, step], f"{name}_out")


def _norm(graph: Graph, norm: nn.LayerNorm, value: str, out: str) -> str:
    names = [graph.constant(f"{out}_scale", norm.weight), graph.constant(f"{out}_shift", norm.bias)]
    return graph.add("LayerNormalization", [value, *names], out, axis=-1, epsilon=norm.eps)
