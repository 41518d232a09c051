"""Conditions of a rollout's recording, as far as they change the declared model.

| condition | in the declared model |
|---|---|
| kp, kd | gains of the position servos; of motors that follow targets, the PD loop before them |
| added_mass | a body without a joint, fixed to the one that carries it; of 0 kg in the other rollouts |
| supply_voltage | torque limits, and speeds at which no torque is left, times voltage over the nominal one, where |
|   | the model declares that: `<custom><numeric name="nominal_voltage" data="7.4"/></custom>` |

Gains are what was in force: a voltage does not scale them. All other conditions are labels.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from bumblebee.errors import BadInput
from bumblebee.measured.conditions import AddedMass, added_masses
from bumblebee.measured.rollout import Rollout
from bumblebee.robot.drives import follows_position

NOMINAL_VOLTAGE = "nominal_voltage"
"""Name of the numeric by which a model declares its supply voltage [V]."""


@dataclass(frozen=True)
class Condition:
    """Differences from the declared model; the empty one is the declared model."""

    kp: tuple[float, ...] = ()
    """(J,) [N m/rad] at the joints, or () for the declared ones."""
    kd: tuple[float, ...] = ()
    """(J,) [N m s/rad], or () for the declared ones."""
    loads: tuple[AddedMass, ...] = ()
    """Added mass of every body that carries one in some rollout; it may be 0 kg in this one."""
    supply: float = 1.0
    """Supply voltage as a share of the nominal one."""

    def like(self, other: "Condition", relative: float) -> bool:
        """Whether two conditions differ by no more than rounding does."""
        if self.loads != other.loads or (len(self.kp), len(self.kd)) != (len(other.kp), len(other.kd)):
            return False
        mine, theirs = ([*c.kp, *c.kd, c.supply] for c in (self, other))
        return bool(np.allclose(mine, theirs, rtol=relative, atol=1e-12))


@dataclass(frozen=True, eq=False)
class Declared:
    """Declared values that conditions change."""

    gains: tuple[np.ndarray, np.ndarray]
    """(J,) kp and kd of the joints; NaN where the model has none and the logs must state them."""
    settable: np.ndarray
    """(J,) bool: joints whose drives follow targets by gains that can be set."""
    volts: float | None
    """Nominal supply voltage."""
    relative: float
    """Difference below which gains, or a voltage, are the declared ones."""


def condition_of(rollout: Rollout, declared: Declared) -> Condition:
    """Conditions in a rollout's metadata that the model can have otherwise."""
    kp, kd = (_stated(rollout, key, gains, declared) for key, gains in zip(("kp", "kd"), declared.gains, strict=True))
    volts = (rollout.meta.get("conditions") or {}).get("supply_voltage")
    share = 1.0 if declared.volts is None or volts is None else float(volts) / declared.volts
    supply = 1.0 if abs(share - 1.0) <= declared.relative else share
    return Condition(kp, kd, tuple(added_masses(rollout.meta)), supply)


def _stated(rollout: Rollout, key: str, gains: np.ndarray, declared: Declared) -> tuple[float, ...]:
    values = rollout.meta.get(key)
    if values is None or np.isclose(values, gains, rtol=declared.relative, atol=1e-9)[declared.settable].all():
        return ()
    return tuple(map(float, values))


def in_words(condition: Condition, joints: Sequence[str]) -> str:
    """A condition in words: gains of the first joints, loads, voltage."""
    said = []
    for key, values in (("kp", condition.kp), ("kd", condition.kd)):
        listed = ", ".join(f"{joint} {value:.4g}" for joint, value in zip(joints[:2], values[:2], strict=False))
        said += [f"{key} {listed}{' ...' if len(values) > 2 else ''}"] if values else []
    said += [f"{load.kg:g} kg added on {load.body}" for load in condition.loads if load.kg]
    said += [f"supply voltage {condition.supply:.3g} of the nominal one"] if condition.supply != 1.0 else []
    return " and ".join(said) or "as declared"


def with_all_loads(conditions: Sequence[Condition]) -> list[Condition]:
    """The conditions, each with a load wherever one of them has one, if of 0 kg: their models have one structure."""
    places = sorted({(x.body, x.position) for c in conditions for x in c.loads})
    out = []
    for c in conditions:
        kg = {place: sum(x.kg for x in c.loads if (x.body, x.position) == place) for place in places}
        loads = tuple(AddedMass(body, kg[body, at], at) for body, at in places)
        out.append(Condition(c.kp, c.kd, loads, c.supply))
    return out


def declared_gains(spec: mujoco.MjSpec, joints: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
    """Gains kp [N m/rad] and kd [N m s/rad] (J,) of the joints' position servos; NaN where there is none."""
    kp, kd = np.full(len(joints), np.nan), np.full(len(joints), np.nan)
    for joint, a in _servos(spec, joints).items():
        column = joints.index(joint)
        kp[column], kd[column] = -a.biasprm[1:3] * a.gear[0] ** 2
    return kp, kd


def set_gains(spec: mujoco.MjSpec, joints: Sequence[str], condition: Condition) -> None:
    """Give the joints' position servos the gains of a condition."""
    for joint, a in _servos(spec, joints).items():
        column = joints.index(joint)
        _gain(a, *(values[column] if values else None for values in (condition.kp, condition.kd)))


def _servos(spec: mujoco.MjSpec, joints: Sequence[str]) -> dict[str, mujoco.MjsActuator]:
    """Joint -> the first position servo on it whose gains stand in gainprm and biasprm."""
    found: dict[str, mujoco.MjsActuator] = {}
    for a in spec.actuators:
        if a.target in joints and follows_position(a) and a.gaintype == mujoco.mjtGain.mjGAIN_FIXED:
            found.setdefault(a.target, a)
    return found


def _gain(actuator: mujoco.MjsActuator, kp: float | None, kd: float | None) -> None:
    """Give a position servo the gains kp [N m/rad] and kd [N m s/rad] at its joint; None leaves what is declared."""
    gain, bias, gear = actuator.gainprm.copy(), actuator.biasprm.copy(), actuator.gear[0]
    factor = 1.0 if kp is None else kp / (-bias[1] * gear**2)
    if abs(factor - 1.0) > 1e-12:
        gain[0], bias[:2] = gain[0] * factor, bias[:2] * factor  # a declared offset of the encoder stays
    if kd is not None:
        bias[2] = -kd / gear**2
    actuator.gainprm, actuator.biasprm = gain, bias


def refuse_unmade(model: mujoco.MjModel, loads: Sequence[AddedMass], where: object) -> None:
    """`BadInput` where the compiler has not made the loads as they are: it scales or merges bodies in some models."""
    names = [model.body(b).name for b in range(model.nbody)]
    for load in loads:
        parent = names.index(load.body)
        made = [b for b in range(model.nbody) if not names[b] and model.body_parentid[b] == parent]
        if not any(np.isclose(model.body_mass[b], load.kg) for b in made):
            raise BadInput(
                f"{where}: compiler",
                f"a model to which {load.kg:g} kg can be added on {load.body}",
                "settotalmass, inertiafromgeom or fusestatic",
                "Take that out of the declared model.",
            )


def with_loads(spec: mujoco.MjSpec, loads: Sequence[AddedMass], where: object) -> mujoco.MjSpec:
    """A copy with the loads, each a body of its own without a name and a joint; `where` names the model in errors."""
    spec = spec.copy()
    for load in loads:
        carrier = spec.body(load.body)
        if carrier is None:
            raise BadInput(f"conditions: added_mass: body {load.body!r}", f"a body of {where}", "no such body")
        body = carrier.add_body(pos=load.position)
        body.mass, body.inertia, body.explicitinertial = load.kg, (0.0, 0.0, 0.0), True
        body.ipos = (0.0, 0.0, 0.0)
    return spec


def set_supply(model: mujoco.MjModel, share: float) -> None:
    """Scale what the drives of a compiled model can give with the supply voltage, a share of the nominal one."""
    limited = model.actuator_forcelimited.astype(bool)
    model.actuator_forcerange[limited] *= share


def nominal_voltage(model: mujoco.MjModel) -> float | None:
    """The supply voltage [V] that a model declares, if it does."""
    index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_NUMERIC, NOMINAL_VOLTAGE)
    value = float(model.numeric_data[model.numeric_adr[index]]) if index >= 0 else 0.0
    return value if value > 0 else None
