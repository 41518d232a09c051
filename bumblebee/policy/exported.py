"""A policy as it is deployed: the ONNX file and the contract that says what goes in and out."""

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.io.read import read_bytes, read_json
from bumblebee.policy.checks import check_fields, check_self_contained, check_tensors
from bumblebee.robot.facts import joint_names, joints
from bumblebee.robot.identity import require_robot
from bumblebee.robot.model import gains
from bumblebee.tracking.config import ObservationConfig
from bumblebee.tracking.observing.needs import needed
from bumblebee.tracking.observing.terms import expanded, parts

if TYPE_CHECKING:
    import onnxruntime

FEED_FORWARDS = (None, "quasi-static")
ACTION_BASES = ("reference", "default")
MAX_BYTES = 256 << 20  # of policy.onnx; ours have a few MB
_REQUIRED = ("joints", "kp", "kd", "control_hz", "action", "observation", "onnx_sha256")


@dataclass(frozen=True)
class ExportedPolicy:
    """An exported policy; `load` is the only way in, so that what runs is what the contract describes."""

    folder: Path
    """Where policy.onnx and contract.json lie."""
    contract: dict[str, Any]
    """contract.json."""
    session: "onnxruntime.InferenceSession"
    """One thread; input "obs" (N, D), output "actions" (N, J); with a memory also "memory" and "memory_next"."""

    @classmethod
    def load(cls, folder: Path) -> "ExportedPolicy":
        """Load and check a policy folder: the file's hash, joint order and observation layout must be this code's."""
        import onnxruntime

        folder = Path(folder)
        contract = read_policy_contract(folder / "contract.json")
        model = read_bytes(folder / "policy.onnx", MAX_BYTES)
        actual = hashlib.sha256(model).hexdigest()
        if actual != contract["onnx_sha256"]:
            raise BadInput(
                f"{folder / 'policy.onnx'}: sha256",
                f"{str(contract['onnx_sha256'])[:12]} as in contract.json",
                actual[:12],
                "Export the policy again.",
            )
        check_self_contained(folder / "policy.onnx", model)
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        options.log_severity_level = 4  # what it refuses becomes our one line
        try:
            session = onnxruntime.InferenceSession(model, options, providers=["CPUExecutionProvider"])
        except Exception as error:  # onnxruntime raises its own types for a file that is no model
            raise BadInput(folder / "policy.onnx", "an ONNX model", str(error)[:200]) from None
        policy = cls(folder, contract, session)
        _check_sizes(policy)
        _check_answer(policy)
        return policy

    @property
    def sha256(self) -> str:
        """Hash of the exported file."""
        return str(self.contract["onnx_sha256"])

    @property
    def scale(self) -> np.ndarray:
        """(J,) [rad] of joint target per unit of action."""
        return np.asarray(self.contract["action"]["scale"], dtype=np.float64)

    @property
    def seen(self) -> ObservationConfig:
        """Observation of the policy: terms and control steps."""
        return observed(self.contract)

    @property
    def ahead(self) -> int:
        """Number of further reference frames in the observation."""
        return ahead_frames(self.contract)

    @property
    def sensors(self) -> tuple[str, ...]:
        """Readings that it takes, names of `tracking.observing.needs.READINGS`; no other has any effect on it."""
        return _sensors(self.contract)

    @property
    def memory(self) -> tuple[int, int] | None:
        """(M, E) of what it remembers of one robot; None for a policy without a memory."""
        return memory_shape(self.contract)

    def empty_memory(self, robots: int) -> np.ndarray:
        """The memory (N, M, E) of robots at the start of their clips; (N, 0, 0) for a policy without one."""
        return np.zeros((robots, *(self.memory or (0, 0))), dtype=np.float32)

    def act(self, obs: np.ndarray) -> np.ndarray:
        """Actions (N, J) for observations (N, D), float32; with a memory, those at the start of a clip."""
        return self.advance(obs, self.empty_memory(len(obs)))[0]

    def advance(self, obs: np.ndarray, memory: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Actions (N, J) for observations (N, D) and the robots' memory (N, M, E); and their memory after it."""
        fed = {"obs": np.ascontiguousarray(obs, dtype=np.float32)}
        if self.memory is None:
            return self.session.run(["actions"], fed)[0], memory
        fed["memory"] = np.ascontiguousarray(memory, dtype=np.float32)
        actions, after = self.session.run(["actions", "memory_next"], fed)
        return actions, after


def read_policy_contract(path: Path) -> dict[str, Any]:
    """Read and check contract.json: keys, types, joint order, gains, rates and observation layout."""
    contract = read_json(path)
    missing = [key for key in _REQUIRED if key not in contract] if isinstance(contract, dict) else list(_REQUIRED)
    if missing:
        raise BadInput(f"{path}: field {missing[0]}", "a policy contract", "no such field", "Export the policy again.")
    check_fields(path, contract)
    require_robot(path, contract, len(contract["joints"]))
    _check_joints(path, contract)
    if contract["action"].get("feed_forward") not in FEED_FORWARDS:
        came = str(contract["action"]["feed_forward"])[:80]
        raise BadInput(f"{path}: action.feed_forward", str(FEED_FORWARDS), came)
    if contract["action"].setdefault("base", ACTION_BASES[0]) not in ACTION_BASES:
        raise BadInput(f"{path}: action.base", " or ".join(ACTION_BASES), str(contract["action"]["base"])[:80])
    seen = observed(contract)
    for key, terms in (("observation", seen.terms), ("observation_now", seen.now)):
        _check_parts(f"{path}: {key}", terms, contract, key)
    if contract.get("sensors", list(_sensors(contract))) != list(_sensors(contract)):
        expected, came = ", ".join(_sensors(contract)), str(contract["sensors"])[:80]
        raise BadInput(f"{path}: sensors", f"{expected}, as its terms take", came, "Export it with this version.")
    if "ahead" in contract and len(contract["ahead"]) != ahead_frames(contract):
        came = str(len(contract["ahead"]))
        raise BadInput(f"{path}: ahead", f"{ahead_frames(contract)} times, as in the observation", came)
    return contract


def _check_parts(where: str, terms: tuple[str, ...], contract: dict[str, Any], key: str) -> None:
    """Refuse a contract whose list of parts is not what this version makes of its terms."""
    expected = [[name, size] for name, size in parts(terms, len(contract["joints"]), ahead_frames(contract))]
    came = [[part["name"], part["size"]] for part in contract.get(key, [])]
    for index in range(max(len(expected), len(came))):
        one, other = (pair[index] if index < len(pair) else None for pair in (expected, came))
        if one != other:
            raise BadInput(f"{where}[{index}]", str(one), str(other), "Export it with this version.")


def observed(contract: dict[str, Any]) -> ObservationConfig:
    """Terms and control steps of the observation; contracts from before there was a choice name none.

    Raises:
        BadInput: if they are no terms or no number of steps.
    """
    terms, now = (tuple(map(str, contract.get(key, without))) for key, without in (("terms", ["demo"]), ("now", [])))
    history = contract.get("history", 1)
    if not isinstance(history, int) or history < 1:
        raise BadInput("contract.json: history", "a number of control steps", repr(history))
    return ObservationConfig(terms, history, now)


def _sensors(contract: dict[str, Any]) -> tuple[str, ...]:
    seen = observed(contract)
    return needed(expanded((*seen.terms, *seen.now)), len(contract["joints"]), ahead_frames(contract))


def memory_shape(contract: dict[str, Any]) -> tuple[int, int] | None:
    """(M, E) of one robot's memory; None where the contract has none."""
    stated = contract.get("memory")
    return None if stated is None else (stated["steps"], stated["size"])


def ahead_frames(contract: dict[str, Any]) -> int:
    """Number of further reference frames that the contract's observation holds."""
    return sum(
        str(part["name"]).startswith("ahead") and str(part["name"]).endswith("_joint_pos")
        for part in contract["observation"]
    )


def _check_joints(path: Path, contract: dict[str, Any]) -> None:
    expected, came = list(joint_names()), contract["joints"]
    if came != expected:
        index = next(
            (i for i, pair in enumerate(zip(expected, came, strict=False)) if pair[0] != pair[1]),
            min(len(expected), len(came)),
        )
        one, other = (str(names[index])[:80] if index < len(names) else "nothing" for names in (expected, came))
        raise BadInput(f"{path}: joints[{index}]", one, other, "The policy was made for another robot or joint order.")
    for field, values in {**contract, "action.scale": contract["action"]["scale"]}.items():
        if field in ("kp", "kd", "action.scale", "default_pos") and len(values) != len(expected):
            raise BadInput(f"{path}: {field}", f"{len(expected)} numbers", str(len(values)))
    servo = [gains(joint) for joint in joints()]
    for field, index in (("kp", 0), ("kd", 1)):
        declared = [pair[index] for pair in servo]
        if not np.allclose(contract[field], declared, rtol=1e-3):
            worst = int(np.argmax(np.abs(np.asarray(contract[field]) / declared - 1)))
            wanted = f"{declared[worst]:g}, the servo's gain"
            raise BadInput(f"{path}: {field}[{worst}]", wanted, f"{contract[field][worst]:g}", "Train with it.")


def _check_sizes(policy: ExportedPolicy) -> None:
    stated, seen = policy.contract, policy.seen
    size = seen.history * sum(part["size"] for part in stated["observation"])
    size += sum(part["size"] for part in stated.get("observation_now", []))
    wanted_in: dict[str, tuple[int, ...]] = {"obs": (size,)}
    wanted_out: dict[str, tuple[int, ...]] = {"actions": (len(stated["joints"]),)}
    if policy.memory is not None:
        wanted_in["memory"] = wanted_out["memory_next"] = policy.memory
    session, where = policy.session, policy.folder / "policy.onnx"
    check_tensors(f"{where}: inputs", session.get_inputs(), wanted_in, others=False)
    check_tensors(f"{where}: outputs", session.get_outputs(), wanted_out, others=True)


def _check_answer(policy: ExportedPolicy) -> None:
    """Ask the policy once, with a memory twice: whoever answers no finite numbers is not let near a robot."""
    (obs,) = (value for value in policy.session.get_inputs() if value.name == "obs")
    rows = 2  # the runner steps several robots at once
    zeros, memory = np.zeros((rows, obs.shape[-1])), policy.empty_memory(rows)
    where = policy.folder / "policy.onnx"
    try:
        actions, after = policy.advance(zeros, memory)
        if policy.memory is not None:
            actions, after = policy.advance(zeros, after)
    except Exception as error:  # onnxruntime raises its own types
        raise BadInput(where, f"actions for {rows} observations at once", str(error)[:200]) from None
    wanted = (rows, len(policy.contract["joints"]))
    if actions.shape != wanted or not np.isfinite(actions).all():
        came = f"shape {actions.shape}" if actions.shape != wanted else "NaN or infinity"
        raise BadInput(where, f"finite actions of shape {wanted} for an observation of zeros", came)
    if after.shape != memory.shape or not np.isfinite(after).all():
        came = f"shape {after.shape}" if after.shape != memory.shape else "NaN or infinity"
        raise BadInput(f"{where}: memory_next", f"a finite memory of shape {memory.shape}", came)
