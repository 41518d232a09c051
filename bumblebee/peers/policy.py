"""A peer's policy: its ONNX file, held against its contract before anything runs."""

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import torch
from torch import Tensor

from bumblebee.errors import BadInput
from bumblebee.io.read import read_bytes
from bumblebee.peers.contract import PeerContract, read_contract
from bumblebee.policy.checks import check_self_contained

if TYPE_CHECKING:
    import onnxruntime

MAX_BYTES = 1 << 30  # of the ONNX file


@dataclass(frozen=True)
class Peer:
    """A policy that was read and fits its contract; `load` is the only way in."""

    contract: PeerContract
    session: "onnxruntime.InferenceSession"
    sha256: str
    """Hash of the ONNX file."""

    @classmethod
    def load(cls, onnx: str | Path, contract: str | Path) -> "Peer":
        """Read a policy and its contract.

        Args:
            onnx: the file: one input (N, width), one output (N, J) first; it may hold N at 1.
            contract: its contract file, or the name of one that comes along.

        Raises:
            BadInput: a file that is not there or is no ONNX model, or one that the contract does not describe.
        """
        import onnxruntime

        described = read_contract(contract)
        path = Path(onnx).expanduser()
        model = read_bytes(path, MAX_BYTES)
        sha256 = hashlib.sha256(model).hexdigest()
        if described.onnx_sha256 not in ("", sha256):
            expected = f"{described.onnx_sha256[:12]} as in {contract}"
            raise BadInput(f"{path}: sha256", expected, sha256[:12], "Give the file that the contract describes.")
        check_self_contained(path, model)
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        options.log_severity_level = 4
        try:
            session = onnxruntime.InferenceSession(model, options, providers=["CPUExecutionProvider"])
        except Exception as error:  # onnxruntime raises its own types for a file that is no model
            raise BadInput(path, "an ONNX model", str(error)[:200]) from None
        peer = cls(described, session, sha256)
        _check(path, contract, peer)
        return peer

    def act(self, seen: Tensor) -> Tensor:
        """Raw outputs (N, J) for inputs (N, width)."""
        (source,) = self.session.get_inputs()
        rows = seen.numpy().astype(np.float32)
        parts = rows[:, None] if source.shape[0] == 1 else [rows]
        outputs = [self.session.run([self.session.get_outputs()[0].name], {source.name: part})[0] for part in parts]
        return torch.from_numpy(np.concatenate(outputs).astype(np.float32))


def _check(path: Path, contract: str | Path, peer: Peer) -> None:
    """Refuse an input or output of another size than the contract's, and answers that are no numbers."""
    width, joints = peer.contract.width, len(peer.contract.joints)
    do = f"Is it another robot's, or is {contract} another policy's?"
    inputs = {value.name: list(value.shape) for value in peer.session.get_inputs()}
    shape = next(iter(inputs.values())) if len(inputs) == 1 else []
    if len(shape) != 2 or shape[1] != width:
        raise BadInput(f"{path}: inputs", f"one of shape (N, {width}), as the contract's", str(inputs)[:120], do)
    if peer.session.get_inputs()[0].type != "tensor(float)":
        raise BadInput(f"{path}: inputs", "tensor(float)", peer.session.get_inputs()[0].type)
    try:
        answer = peer.act(torch.zeros(2, width))
    except Exception as error:  # onnxruntime raises its own types
        raise BadInput(path, "outputs for an input of zeros", str(error)[:200]) from None
    if tuple(answer.shape) != (2, joints):
        expected = f"(N, {joints}), one number for each joint of the contract"
        raise BadInput(f"{path}: outputs", expected, f"{tuple(answer.shape)} for two inputs", do)
    if not bool(torch.isfinite(answer).all()):
        raise BadInput(f"{path}: outputs", "finite numbers for an input of zeros", "NaN or infinity")
