"""`compensation.json`: a compensation as a file, written whole, and checked when it is read: a robot will obey it."""

import dataclasses
import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from bumblebee.compensation.draft import DeclaredRobot
from bumblebee.compensation.limits import CompensationLimits
from bumblebee.compensation.numbers import JOINT_ARRAYS, Compensation, Load, PlannedEffect, as_table
from bumblebee.errors import BadInput
from bumblebee.io.limits import Limits
from bumblebee.io.read import read_json
from bumblebee.io.write import refuse_foreign, refuse_overlap, try_output, write_file
from bumblebee.ranges import Unfit
from bumblebee.robot.facts import ROBOT, joint_names, robot_bodies
from bumblebee.robot.model import build_model
from bumblebee.sim.effects import read_term

_LIMITS = Limits(text_bytes=4 << 20, nodes=60_000)
_AGAIN = "Make it again with `bumblebee compensate`."
_LARGEST = 1e4  # of any number in SI units that has no limit of its own
_LONGEST = 1000  # characters of a text
_KEYS = (
    {"schema", "robot", "effects_sha256", "joints", "limits", "imu", "cogging", "hysteresis", "terms"}
    | {"loads", "plan"}
    | set(JOINT_ARRAYS)
)  # fmt: skip


def write_compensation(path: Path, compensation: Compensation) -> None:
    """Write `compensation.json`; it appears whole or not at all."""
    write_file(path, json.dumps(as_table(compensation), indent=1) + "\n")


def claim_compensation(out: Path, overwrite: bool, inputs: Sequence[Path]) -> None:
    """See that a compensation may be written at `out`, before the work; else `BadInput`."""
    refuse_overlap(out, inputs)
    refuse_foreign(out, _is_ours, "a compensation")
    if os.path.lexists(out) and not overwrite:
        raise BadInput(out, "a file that does not exist yet", "a compensation from before", "Add --overwrite.")
    try_output(out)


def table_of(compensation: Compensation) -> str:
    """The plan as lines of text: effect, where, what is done, with which numbers, or why not."""
    rows = [
        (
            step.effect,
            ", ".join(step.where) or "whole robot",
            f"{step.done}: {step.size}" if step.done else f"NOT UNDONE: {step.why_not}",
        )
        for step in compensation.plan
    ]
    if not rows:
        return "no effect, nothing to undo"
    first, second = (max(len(row[i]) for row in rows) for i in (0, 1))
    return "\n".join(f"{effect:<{first}}  {place:<{min(second, 60)}}  {text}" for effect, place, text in rows)


def read_compensation(path: Path) -> Compensation:
    """Read `compensation.json`; whatever is not what `bumblebee compensate` writes is named in a `BadInput`."""
    table = read_json(Path(path), _LIMITS)
    _keys(path, table, _KEYS)
    _same(f"{path}: schema", table["schema"], 1)
    _same(f"{path}: robot", table["robot"], ROBOT)
    _same(f"{path}: joints", table["joints"], list(joint_names()))
    arrays = {name: _numbers(f"{path}: {name}", table[name], len(joint_names())) for name in JOINT_ARRAYS}
    compensation = Compensation(
        joints=joint_names(),
        imu=_numbers(f"{path}: imu", table["imu"], 3),
        cogging=tuple(_row(f"{path}: cogging[{i}]", row, 4) for i, row in _list(path, table, "cogging")),
        hysteresis=tuple(_row(f"{path}: hysteresis[{i}]", row, 4) for i, row in _list(path, table, "hysteresis")),
        terms=tuple(_term(f"{path}: terms[{i}]", row) for i, row in _list(path, table, "terms")),
        loads=tuple(_load(f"{path}: loads[{i}]", entry) for i, entry in _list(path, table, "loads")),
        limits=_limits(path, table["limits"]),
        effects_sha256=_text(f"{path}: effects_sha256", table["effects_sha256"]),
        plan=tuple(_planned(f"{path}: plan[{i}]", entry) for i, entry in _list(path, table, "plan")),
        **arrays,
    )
    check_within(compensation, path)
    return compensation


def load_compensations(plan: Mapping[str, Any], where: object) -> dict[str, Compensation]:
    """The compensations of a stand-in's plan: `"compensations": {key of a policy: path of compensation.json}`.

    Raises:
        BadInput: for a key that is no policy of the plan, or a file that cannot be used.
    """
    named = plan.get("compensations", {})
    if not isinstance(named, dict) or not all(isinstance(value, str) for value in named.values()):
        raise BadInput(f"{where}: compensations", "policies' keys with paths of compensation.json", repr(named)[:80])
    policies = plan.get("policies", {})
    if unknown := [key for key in named if key not in policies]:
        raise BadInput(f"{where}: compensations", f"keys among {', '.join(map(str, policies))}", repr(unknown[0])[:80])
    return {key: read_compensation(Path(path)) for key, path in named.items()}


def check_within(compensation: Compensation, where: object) -> None:
    """Refuse numbers beyond the compensation's own limits, whoever made them."""
    c, limits, robot = compensation, compensation.limits, DeclaredRobot.of(build_model())
    held = {
        "kp": (c.kp / robot.kp, limits.gain_least, limits.gain_most),
        "kd": (c.kd / robot.kd, limits.gain_least * limits.damping_left, limits.gain_most),
        "encoder_offset": (c.encoder_offset, -limits.offset, limits.offset),
        "encoder_delay": (c.encoder_delay, 0.0, limits.look_ahead),
        "lead_time": (c.lead_time, -limits.look_ahead, limits.look_ahead),
        "torque_lead": (c.torque_lead, 0.0, limits.look_ahead),
        "strength": (c.strength, limits.gain_least / limits.gain_most, limits.gain_most / limits.gain_least),
        "stiction_speed": (c.stiction_speed, 1e-3, 100.0),
        "load_friction": (c.load_friction, 0.0, 2.0),
        "imu": (np.array([np.linalg.norm(c.imu)]), 0.0, limits.imu),
    }
    for name, (values, low, high) in held.items():
        margin = 1e-9 * max(1.0, high)
        bad = (values < low - margin) | (values > high + margin)
        if bad.any():
            index = int(np.argmax(bad))
            expected = f"{low:.4g} to {high:.4g}{' times the declared gain' if name in ('kp', 'kd') else ''}"
            raise BadInput(f"{where}: {name}[{index}]", expected, f"{values[index]:.4g}", _AGAIN)


def _keys(where: object, table: Any, keys: set[str]) -> None:
    if not isinstance(table, dict) or set(table) != keys:
        came = type(table).__name__ if not isinstance(table, dict) else ""
        if isinstance(table, dict):
            lacking, unknown = sorted(keys - set(table)), sorted(map(str, set(table) - keys))
            came = f"no key {lacking[0]}" if lacking else f"the unknown key {unknown[0][:80]!r}"
        raise BadInput(where, "a compensation", came, _AGAIN)


def _same(where: str, came: Any, expected: Any) -> None:
    if type(came) is not type(expected) or came != expected:
        wanted = "the G1's 23 joints in order" if isinstance(expected, list) else repr(expected)
        raise BadInput(where, wanted, repr(came)[:80], _AGAIN)


def _number(where: str, value: Any) -> float:
    if not isinstance(value, int | float) or isinstance(value, bool) or not -_LARGEST <= value <= _LARGEST:
        raise BadInput(where, f"a number of at most {_LARGEST:g}", repr(value)[:80], _AGAIN)
    return float(value)


def _numbers(where: str, values: Any, count: int) -> np.ndarray:
    if not isinstance(values, list) or len(values) != count:
        came = f"{len(values)}" if isinstance(values, list) else type(values).__name__
        raise BadInput(where, f"{count} numbers", came, _AGAIN)
    return np.array([_number(f"{where}[{i}]", value) for i, value in enumerate(values)])


def _list(path: Path, table: dict[str, Any], name: str) -> list[tuple[int, Any]]:
    if not isinstance(table[name], list):
        raise BadInput(f"{path}: {name}", "a list", type(table[name]).__name__, _AGAIN)
    return list(enumerate(table[name]))


def _column(where: str, value: Any) -> int:
    if type(value) is not int or not 0 <= value < len(joint_names()):
        raise BadInput(where, "the number of a joint first", repr(value)[:80], _AGAIN)
    return value


def _row(where: str, row: Any, count: int) -> Any:
    """(joint, three numbers), the last but one a width or the last a number of periods: not zero."""
    if not isinstance(row, list) or len(row) != count:
        raise BadInput(where, f"a joint and {count - 1} numbers", repr(row)[:80], _AGAIN)
    numbers = [_number(where, value) for value in row[1:]]
    if "hysteresis" in where and numbers[1] <= 0:
        raise BadInput(where, "a width above 0", f"{numbers[1]:g}", _AGAIN)
    return (_column(where, row[0]), *numbers)


def _term(where: str, row: Any) -> tuple[int, float, str]:
    if not isinstance(row, list) or len(row) != 3:
        raise BadInput(where, "a joint, a coefficient and a formula", repr(row)[:80], _AGAIN)
    term = read_term(_text(where, row[2], 2000))
    names = set(joint_names())
    if term.states or {"tau", "t"} & term.names or "tau[" in term.text or not names.issuperset(term.others):
        raise BadInput(where, "a formula of angles, velocities and targets", repr(row[2])[:80], _AGAIN)
    return _column(where, row[0]), _number(where, row[1]), term.text


def _load(where: str, entry: Any) -> Load:
    _keys(where, entry, {"body", "mass", "com"})
    if entry["body"] not in robot_bodies():
        raise BadInput(f"{where}.body", "a body of the G1", repr(entry["body"])[:80], _AGAIN)
    mass = _numbers(f"{where}.mass", entry["mass"], 2)
    if not (mass > 0).all():
        raise BadInput(f"{where}.mass", "masses above 0", repr(entry["mass"])[:80], _AGAIN)
    if not isinstance(entry["com"], list) or len(entry["com"]) != 2:
        raise BadInput(f"{where}.com", "two places", repr(entry["com"])[:80], _AGAIN)
    com = [_numbers(f"{where}.com[{i}]", place, 3).tolist() for i, place in enumerate(entry["com"])]
    return Load(entry["body"], (float(mass[0]), float(mass[1])), (tuple(com[0]), tuple(com[1])))


def _planned(where: str, entry: Any) -> PlannedEffect:
    names = [f.name for f in dataclasses.fields(PlannedEffect)]
    _keys(where, entry, set(names))
    if not isinstance(entry["where"], list):
        raise BadInput(f"{where}.where", "a list", type(entry["where"]).__name__, _AGAIN)
    texts = {name: _text(f"{where}.{name}", entry[name]) for name in names if name != "where"}
    return PlannedEffect(where=tuple(_text(f"{where}.where", place) for place in entry["where"]), **texts)


def _limits(path: Path, table: Any) -> CompensationLimits:
    _keys(f"{path}: limits", table, {f.name for f in dataclasses.fields(CompensationLimits)})
    try:
        return CompensationLimits(**{key: _number(f"{path}: limits.{key}", value) for key, value in table.items()})
    except Unfit as error:
        raise BadInput(f"{path}: limits.{error.field}", error.expected, error.came, _AGAIN) from None


def _text(where: str, value: Any, longest: int = _LONGEST) -> str:
    if not isinstance(value, str) or len(value) > longest or not all(sign.isprintable() for sign in value):
        raise BadInput(where, f"one line of at most {longest} characters", repr(value)[:80], _AGAIN)
    return value


def _is_ours(path: Path) -> bool:
    try:
        read_compensation(path)
    except BadInput:
        return False
    return True
