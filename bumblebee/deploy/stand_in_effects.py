"""The stand-in's own reading of sealed effects: arrays that its simulation multiplies, adds and delays with.

Independent of `bumblebee.sim.effects` on purpose: what the diagnosis finds must not share code with what it looks for.
"""

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from bumblebee.errors import BadInput

PARAMETERS = {
    "coulomb_friction": "frictionloss",
    "viscous_friction": "damping",
    "armature": "armature",
    "motor_strength": "factor",
    "command_delay": "delay",
    "encoder_offset": "offset",
    "link_mass": "mass",
}
STEP_MS = 1


@dataclass(frozen=True)
class SealedEffects:
    """What is undeclared in this robot; J joints in the model's order.

    `coulomb` (J,) [N m], `viscous` (J,) [N m s/rad], `strength` (J,) factor on the servo's torque, `delay_ms` (J,)
    whole milliseconds of command delay, `offset` (J,) [rad] that encoders add, `armature` {dof: kg m^2}, `mass`
    {body id: kg}.
    """

    coulomb: np.ndarray
    viscous: np.ndarray
    strength: np.ndarray
    delay_ms: np.ndarray
    offset: np.ndarray
    armature: dict[int, float]
    mass: dict[int, float]


def read_sealed(path: Path) -> list[dict[str, Any]]:
    """The effects in a sealed file; one whose seal (sha256 of the effects) is broken is refused."""
    try:
        sealed = json.loads(Path(path).read_text())
        effects, claimed = sealed["effects"], sealed["sha256"]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise BadInput(path, "a sealed robot with effects and sha256", f"{type(error).__name__}: {error}") from None
    if seal(effects) != claimed:
        raise BadInput(
            f"{path}: field sha256", seal(effects)[:12], str(claimed)[:12], "The seal is broken: seal it anew."
        )
    return effects


def seal(effects: list[dict[str, Any]]) -> str:
    """sha256 of the effects as canonical JSON."""
    return hashlib.sha256(json.dumps(effects, sort_keys=True, separators=(",", ":")).encode()).hexdigest()


def to_arrays(effects: list[dict[str, Any]], model: mujoco.MjModel, where: object = "effects") -> SealedEffects:
    """Effects as arrays over the model's joints (all actuated hinges, in order)."""
    joints = [model.joint(i).name for i in range(1, model.njnt)]
    neutral = np.zeros(len(joints))
    found = SealedEffects(neutral.copy(), neutral.copy(), neutral + 1, neutral.copy(), neutral.copy(), {}, {})
    for index, effect in enumerate(effects):
        place = f"{where}: effects[{index}]"
        kind, names = effect.get("effect"), effect.get("where", [])
        if kind not in PARAMETERS:
            raise BadInput(place, f"one of {', '.join(PARAMETERS)}", str(kind))
        value = effect.get("parameters", {}).get(PARAMETERS[kind])
        if not isinstance(value, int | float) or not np.isfinite(value):
            raise BadInput(f"{place}: {kind}.{PARAMETERS[kind]}", "a number", str(value))
        if kind == "link_mass":
            found.mass.update({_body(model, name, place): float(value) for name in names})
        else:
            _set_joints(found, kind, [_index(joints, name, place) for name in names or joints], float(value))
    return found


def _set_joints(found: SealedEffects, kind: str, joints: list[int], value: float) -> None:
    if kind == "armature":
        found.armature.update(dict.fromkeys((6 + joint for joint in joints), value))
        return
    rows = {
        "coulomb_friction": found.coulomb,
        "viscous_friction": found.viscous,
        "motor_strength": found.strength,
        "command_delay": found.delay_ms,
        "encoder_offset": found.offset,
    }
    rows[kind][joints] = round(value * 1000 / STEP_MS) if kind == "command_delay" else value


def _index(names: list[str], name: str, place: str) -> int:
    if name not in names:
        raise BadInput(f"{place}: where", "a joint of the model", str(name))
    return names.index(name)


def _body(model: mujoco.MjModel, name: str, place: str) -> int:
    body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name)
    if body < 0:
        raise BadInput(f"{place}: where", "a body of the model", str(name))
    return body
