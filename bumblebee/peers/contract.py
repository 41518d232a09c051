"""The contract file of a peer's policy: facts in YAML that its ONNX file does not hold.

`twist2.yaml` beside this file is an example with all fields; docs/peers.md explains them.
"""

from collections.abc import Iterator, Mapping
from dataclasses import MISSING, dataclass, fields
from pathlib import Path
from typing import Annotated, Any, Literal

from bumblebee.errors import BadInput
from bumblebee.io.read import read_yaml
from bumblebee.peers import CONTRACTS
from bumblebee.peers.terms import TERMS
from bumblebee.ranges import Name, Range, Ranged, Size, Unfit
from bumblebee.robot.facts import HELD_JOINTS, joint_names

_KEYS = "docs/peers.md lists the fields."
_ROUNDING = 1e-6
Names = Annotated[tuple[Name, ...], Size(most=1000)]
Angles = Annotated[tuple[Annotated[float, Range(least=-6.3, most=6.3)], ...], Size(most=1000)]
Positive = Annotated[tuple[Annotated[float, Range(least=0, most=1e5)], ...], Size(most=1000)]
Optional = Annotated[tuple[Annotated[float, Range(least=0, most=1e5)], ...], Size(least=0, most=1000)]
Numbers = Annotated[tuple[Annotated[float, Range(least=-1e5, most=1e5)], ...], Size(most=1000)]


@dataclass(frozen=True)
class Term(Ranged):
    """One quantity of a group: what `peers.terms.TERMS` has under its name, scaled."""

    term: Name
    """Name in the table of terms."""
    scale: Annotated[float, Range(least=-1e4, most=1e4)] = 1.0
    """Factor on its values."""
    axes: Literal["x", "y", "z", "xy", "xz", "yz", "xyz"] = "xyz"
    """Axes that are kept of a vector."""
    zero: tuple[Name, ...] = ()
    """Joints whose value the policy sees as 0."""
    step: Annotated[int, Range(least=0, most=1000)] = 1
    """Control steps after now from which a term of the reference is taken."""

    def size(self, joints: int) -> int:
        """Number of values that it contributes."""
        kind = TERMS[self.term]
        if kind.size == 0:
            return joints
        return len(self.axes) if kind.size == len("xyz") else kind.size


@dataclass(frozen=True)
class Block(Ranged):
    """A stretch of the input: some groups now, at past control steps, or both."""

    groups: Names
    """Groups whose terms stand one after the other at each step."""
    past: Annotated[int, Range(least=0, most=1000)] = 0
    """Number of past control steps."""
    now: bool = True
    """Whether this control step is among them."""
    order: Literal["oldest_first", "newest_first"] = "oldest_first"
    """Order of the steps."""
    stacked: Literal["by_step", "by_term"] = "by_step"
    """A step with all its terms after the other, or a term with all its steps."""
    begin: Literal["zeros", "first"] = "zeros"
    """Values of the steps before the first one: zeros, or the first step's."""

    @property
    def steps(self) -> int:
        """Number of control steps in it."""
        return self.past + self.now


@dataclass(frozen=True)
class Action(Ranged):
    """From the output to joint targets: `around` + scale x clipped output."""

    scale: Numbers
    """[rad] for a unit of output: one number, or one a joint."""
    clip: Annotated[float, Range(above=0, most=1e6)] | None = None
    """Largest absolute output that counts."""
    around: Literal["default", "reference"] = "default"
    """Targets of an output of zero: `default_pos`, or the reference at the next control step."""
    remembered: Literal["raw", "clipped"] = "raw"
    """Output that the term `last_action` holds."""


@dataclass(frozen=True)
class PeerContract(Ranged):
    """Contents of a contract file. Lists with a number a joint have the order of `joints`."""

    robot: Literal["g1"]
    """Robot that the policy was trained for: motions and judges are the G1's."""
    name: Name
    """Name in tables."""
    joints: Names
    """Joints in the policy's order, by Unitree's names: all 23 of `bumblebee robot inspect`, and wrists or not."""
    default_pos: Angles
    """Angles [rad] that `joint_pos` is counted from."""
    kp: Positive
    """Stiffness [N m/rad] of the servos."""
    kd: Positive
    """Damping [N m s/rad] of the servos."""
    action: Action
    """From the output to joint targets."""
    groups: dict[Name, tuple[Term, ...]]
    """Named lists of terms."""
    input: tuple[Block, ...]
    """Parts of the ONNX file's input, in order."""
    control_hz: Annotated[float, Range(least=1, most=1000)] = 50.0
    """Rate of the policy [Hz]."""
    physics_hz: Annotated[float, Range(least=1, most=100_000)] = 200.0
    """Rate of the physics in its own simulation [Hz]."""
    effort_limit: Optional = ()
    """Largest torque that the servos ask for [N m]; the motors' own limits hold too. Empty: those alone."""
    armature: Optional = ()
    """Rotor inertia of the joints in its own simulation [kg m^2]; empty: the G1's."""
    floor_friction: Annotated[float, Range(least=0, most=10)] = 1.0
    """Sliding friction of the floor in its own simulation."""
    onnx_sha256: str = ""
    """Hash of the ONNX file that is described; empty: not checked."""

    @property
    def width(self) -> int:
        """Number of values in the input of one robot."""
        return sum(block.steps * sum(term.size(len(self.joints)) for term in self.terms(block)) for block in self.input)

    @property
    def every_joint(self) -> bool:
        """Whether it was trained for a G1 whose wrists move."""
        return bool(set(self.joints) & set(HELD_JOINTS))

    def terms(self, block: Block) -> Iterator[Term]:
        """Terms of a block at one step, in order."""
        return (term for group in block.groups for term in self.groups[group])


def read_contract(place: str | Path) -> PeerContract:
    """Read and check a contract file.

    Args:
        place: a file, or the name of one that comes along (`peers.CONTRACTS`).

    Raises:
        BadInput: no such file, a field that is missing, unknown or out of its range, or another robot.
    """
    path = CONTRACTS.get(str(place)) or Path(place).expanduser()
    table = _table(str(path), read_yaml(path))
    robot = table.get("robot")
    if robot is not None and robot != "g1":
        raise BadInput(f"{path}: robot", "g1", repr(robot)[:60], "Motions and models here are the G1's alone.")
    parts: dict[str, Any] = {}
    if "action" in table:
        action = _table(f"{path}: action", table["action"])
        scale = action.get("scale")
        parts["action"] = _made(f"{path}: action", Action, action | ({} if _is_list(scale) else {"scale": [scale]}))
    if "groups" in table:
        groups = _table(f"{path}: groups", table["groups"])
        parts["groups"] = {name: _rows(f"{path}: groups.{name}", Term, rows) for name, rows in groups.items()}
    if "input" in table:
        parts["input"] = _rows(f"{path}: input", Block, table["input"])
    contract = _made(str(path), PeerContract, table | parts)
    _check_rates(str(path), contract)
    _check_joints(str(path), contract)
    _check_terms(str(path), contract)
    return contract


def _table(where: str, value: Any) -> dict[str, Any]:
    if not isinstance(value, Mapping) or not all(isinstance(key, str) for key in value):
        raise BadInput(where, "fields and values", repr(value)[:60], _KEYS)
    return dict(value)


def _is_list(value: Any) -> bool:
    return isinstance(value, list)


def _rows(where: str, kind: type, rows: Any) -> tuple[Any, ...]:
    if not _is_list(rows) or not rows:
        raise BadInput(where, "a list", repr(rows)[:60], _KEYS)
    return tuple(_made(f"{where}[{i}]", kind, _table(f"{where}[{i}]", row)) for i, row in enumerate(rows))


def _made(where: str, kind: type, table: Mapping[str, Any]) -> Any:
    """An instance of a dataclass; every missing, unknown or unfit field is named."""
    known = {field.name: field.default is MISSING for field in fields(kind)}
    for name in table:
        if name not in known:
            raise BadInput(f"{where}: field {name[:60]}", f"a field among {', '.join(known)}", "another", _KEYS)
    for name, needed in known.items():
        if needed and name not in table:
            raise BadInput(f"{where}: field {name}", "a value", "no such field", _KEYS)
    try:
        return kind(**{name: tuple(value) if _is_list(value) else value for name, value in table.items()})
    except Unfit as error:
        raise BadInput(f"{where}: {error.where.partition('.')[2]}", error.expected, error.came, _KEYS) from None


def _check_rates(where: str, contract: PeerContract) -> None:
    """Refuse a physics rate of which no whole number of steps fits into a control step."""
    physics, control = contract.physics_hz, contract.control_hz
    if abs(physics / control - round(physics / control)) > _ROUNDING:
        raise BadInput(f"{where}: physics_hz", f"a multiple of control_hz, {control:g}", f"{physics:g}")


def _check_joints(where: str, contract: PeerContract) -> None:
    """Refuse another robot's joints, and lists of another length."""
    joints = contract.joints
    known, needed = joint_names(every=True), joint_names()
    for i, name in enumerate(joints):
        if name not in known or name in joints[:i]:
            raise BadInput(f"{where}: joints[{i}]", "each joint of the G1 once", name[:60], "Is it another robot's?")
    if missing := [name for name in needed if name not in joints]:
        raise BadInput(f"{where}: joints", f"all of the G1's {len(needed)}", f"no {missing[0]}")
    count = len(joints)
    lists = {name: getattr(contract, name) for name in ("default_pos", "kp", "kd", "effort_limit", "armature")}
    optional = ("effort_limit", "armature")
    for name, values in lists.items():
        if len(values) != count and (values or name not in optional):
            raise BadInput(f"{where}: {name}", f"{count} numbers, one a joint", str(len(values)))
    if len(contract.action.scale) not in (1, count):
        raise BadInput(f"{where}: action.scale", f"a number, or {count}", str(len(contract.action.scale)))


def _check_terms(where: str, contract: PeerContract) -> None:
    """Refuse unknown groups and terms, and options that a term does not have."""
    for name, terms in contract.groups.items():
        for i, term in enumerate(terms):
            place = f"{where}: groups.{name}[{i}]"
            if term.term not in TERMS:
                raise BadInput(f"{place}: term", f"one of {', '.join(TERMS)}", term.term[:60])
            kind = TERMS[term.term]
            if term.axes != "xyz" and kind.size != len("xyz"):
                raise BadInput(f"{place}: axes", f"none, {term.term} is no vector", term.axes)
            unknown = [joint for joint in term.zero if kind.size != 0 or joint not in contract.joints]
            if unknown:
                raise BadInput(
                    f"{place}: zero", "joints of the contract, of a term with a value a joint", unknown[0][:60]
                )
    for i, block in enumerate(contract.input):
        if unknown := [group for group in block.groups if group not in contract.groups]:
            among = ", ".join(contract.groups)
            raise BadInput(f"{where}: input[{i}]: groups", f"groups among {among}", unknown[0][:60])
        if not block.steps:
            raise BadInput(f"{where}: input[{i}]", "now, or past steps", "neither")
