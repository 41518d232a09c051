"""How each effect of the catalogue is undone at the joint, or why it cannot be.

A rule puts an effect into the draft and says what is done. Effects' values are absolute, so that what counts is their
excess over the declared model; `motor_strength`, `kp` and `kd` are factors.
"""

from collections.abc import Callable, Sequence

import numpy as np

from bumblebee.deploy.compensation import Load
from bumblebee.deploy.compensation_draft import Draft
from bumblebee.sim.effects import CATALOGUE, Effect, read_term

Rule = Callable[[Draft, Effect, Sequence[int]], tuple[str, str]]
"""(draft, effect, columns of its joints) -> what is done, with which numbers."""


class CannotUndo(Exception):
    """An effect that no drive can undo; the text is the reason."""


NOT_UNDONE = {
    "torque_limit": "a torque that the motor does not have cannot be asked of it",
    "torque_speed_limit": "a torque that the motor does not have at speed cannot be asked of it",
    "dropped_commands": "that a command is lost is not known when it is sent",
    "command_filter": "a target that undoes it runs ahead of the reference by its speed, with the noise of that",
    "command_rate_limit": "the drive follows no target faster",
    "command_profile": "the drive follows no target faster",
    "encoder_quantisation": "what the encoder rounds away is not known",
    "backlash": "within its play the motor does not touch the link",
    "series_elasticity": "the bend of the shaft is not measured, and undoing it needs the load's acceleration",
    "link_inertia": "it asks for torque only as the whole body accelerates, which is not planned for",
    "ground_friction": "it is in the floor, not in a joint",
    "ground_compliance": "it is in the floor, not in a joint",
    "ground_slope": "it is in the floor or the mount, not in a joint",
    "surface_contact": "it is in what the robot touches, not in a joint",
    "thermal_fade": "it depends on the motor's heat, which is not measured",
    "strength_drift": "it depends on how long the robot has run since it was measured",
    "external_wrench": "it acts on a body of a floating robot: only the feet could answer it",
}


def undo(draft: Draft, effect: Effect, columns: Sequence[int]) -> tuple[str, str]:
    """Put an effect into the draft.

    Raises:
        CannotUndo: if it cannot be undone at the joint.
    """
    if effect.effect in NOT_UNDONE:
        raise CannotUndo(NOT_UNDONE[effect.effect])
    return _RULES[effect.effect](draft, effect, columns)


def _range(values: np.ndarray, unit: str, digits: int = 3) -> str:
    low, high = float(np.min(values)), float(np.max(values))
    text = f"{low:.{digits}g}" if np.isclose(low, high) else f"{low:.{digits}g} to {high:.{digits}g}"
    return f"{text} {unit}".strip()


def _encoder_offset(draft: Draft, effect: Effect, columns: Sequence[int]) -> tuple[str, str]:
    draft.arrays["encoder_offset"][columns] = effect.value()
    return "taken off the reading, added to the target", f"{effect.value():+.4g} rad"


def _imu_offset(draft: Draft, effect: Effect, columns: Sequence[int]) -> tuple[str, str]:
    draft.imu[:2] = effect.values()
    roll, pitch = effect.values()
    return "turned back out of the orientation reading", f"roll {roll:+.4g}, pitch {pitch:+.4g} rad"


def _factor(strength: bool, kp: bool, kd: bool) -> Rule:
    def rule(draft: Draft, effect: Effect, columns: Sequence[int]) -> tuple[str, str]:
        value = effect.value()
        if value <= 0:
            raise CannotUndo("a gain of nothing times anything is nothing")
        if strength:
            draft.arrays["strength"][columns] *= value
        if kp:
            draft.kp_factor[columns] *= value
        if kd:
            draft.kd_factor[columns] *= value
        what = "gains and torque sent are" if strength else f"the {'kp' if kp else 'kd'} sent is"
        return f"{what} divided by it", f"{value:.4g}, so times {1 / value:.4g}"

    return rule


def _viscous(draft: Draft, effect: Effect, columns: Sequence[int]) -> tuple[str, str]:
    excess = effect.value() - draft.robot.model.dof_damping[draft.robot.dofs[columns]]
    draft.viscous[columns] = excess
    taken = (draft.robot.kd - draft.kd_wanted)[columns]
    rest = "" if np.allclose(taken, excess) else f", {_range(excess - taken, 'N m s/rad')} fed forward"
    return "kd sent is lower by it; the rest along the intended velocity", f"{_range(taken, 'N m s/rad')} off kd{rest}"


def _drag(draft: Draft, effect: Effect, columns: Sequence[int]) -> tuple[str, str]:
    excess = effect.value() - draft.robot.model.dof_dampingpoly[draft.robot.dofs[columns], 0]
    draft.terms += [(int(column), -float(more), "v*abs(v)") for column, more in zip(columns, excess, strict=True)]
    return "its torque at the intended velocity is sent against it", _range(excess, "N m s^2/rad^2")


def _coulomb(draft: Draft, effect: Effect, columns: Sequence[int]) -> tuple[str, str]:
    excess = effect.value() - draft.robot.model.dof_frictionloss[draft.robot.dofs[columns]]
    draft.arrays["dry"][columns] = excess
    return _along(draft), _range(draft.limits.friction_share * excess, "N m")


def _stribeck(draft: Draft, effect: Effect, columns: Sequence[int]) -> tuple[str, str]:
    stiction, speed = effect.values()
    draft.arrays["stiction"][columns], draft.arrays["stiction_speed"][columns] = stiction, speed
    return _along(draft), f"{draft.limits.friction_share * stiction:.3g} N m, gone at {speed:.3g} rad/s"


def _load_friction(draft: Draft, effect: Effect, columns: Sequence[int]) -> tuple[str, str]:
    draft.arrays["load_friction"][columns] = effect.value()
    coefficient, difference = effect.values()
    mean = ", the mean of both directions" if difference else ""
    size = draft.limits.friction_share * coefficient
    return f"{_along(draft)}, of the torque that the drive reports{mean}", f"{size:.3g} of it"


def _asymmetric(draft: Draft, effect: Effect, columns: Sequence[int]) -> tuple[str, str]:
    draft.arrays["asymmetry"][columns] = effect.value()
    return "half the difference is sent constantly", f"{0.5 * effect.value():+.3g} N m"


def _along(draft: Draft) -> str:
    return f"{100 * draft.limits.friction_share:.0f} % fed forward along the intended velocity"


def _cogging(draft: Draft, effect: Effect, columns: Sequence[int]) -> tuple[str, str]:
    sine, cosine, periods = effect.values()
    draft.cogging += [(int(column), sine, cosine, periods) for column in columns]
    return "its mean over the coming control period is fed forward", f"up to {np.hypot(sine, cosine):.3g} N m"


def _spring(draft: Draft, effect: Effect, columns: Sequence[int]) -> tuple[str, str]:
    stiffness, preload = effect.values()
    model = draft.robot.model
    for column in columns:
        joint = int(model.dof_jntid[draft.robot.dofs[column]])
        declared = float(np.ravel(model.jnt_stiffness[joint])[0])
        reference = float(model.qpos_spring[model.jnt_qposadr[joint]])
        draft.arrays["spring"][column] = stiffness - declared
        draft.arrays["preload"][column] = preload - declared * reference
    return "its torque at the measured angle is sent against it", f"{stiffness:.3g} N m/rad, {preload:+.3g} N m"


def _hysteresis(draft: Draft, effect: Effect, columns: Sequence[int]) -> tuple[str, str]:
    amplitude, width, dahl = effect.values()
    draft.hysteresis += [(int(column), amplitude, width, float(dahl)) for column in columns]
    share = draft.limits.friction_share
    return f"{100 * share:.0f} % fed forward along the reference's own path", f"up to {share * amplitude:.3g} N m"


def _armature(draft: Draft, effect: Effect, columns: Sequence[int]) -> tuple[str, str]:
    excess = effect.value() - draft.robot.model.dof_armature[draft.robot.dofs[columns]]
    draft.arrays["armature"][columns] = excess
    return "fed forward with the reference's acceleration", _range(excess, "kg m^2")


def _mass(draft: Draft, effect: Effect, columns: Sequence[int]) -> tuple[str, str]:
    added = []
    for body in effect.where:
        load = _load(draft, body)
        draft.loads[body] = Load(body, (load.mass[0], effect.value()), load.com)
        added.append(effect.value() - load.mass[0])
    return "its weight along the reference is fed forward", f"{_range(np.array(added), 'kg')} more"


def _com(draft: Draft, effect: Effect, columns: Sequence[int]) -> tuple[str, str]:
    moved = []
    for body in effect.where:
        load = _load(draft, body)
        draft.loads[body] = Load(body, load.mass, (load.com[0], effect.values()))
        moved.append(float(np.linalg.norm(np.subtract(effect.values(), load.com[0]))))
    return "its weight along the reference is fed forward", f"{_range(1000 * np.array(moved), 'mm')} away"


def _load(draft: Draft, body: str) -> Load:
    model = draft.robot.model
    mass, com = float(model.body(body).mass[0]), tuple(map(float, model.body(body).ipos))
    return draft.loads.get(body, Load(body, (mass, mass), (com, com)))


def _late(name: str, what: str) -> Rule:
    def rule(draft: Draft, effect: Effect, columns: Sequence[int]) -> tuple[str, str]:
        draft.arrays[name][columns] = effect.value()
        return what, f"{1000 * effect.value():.3g} ms"

    return rule


def _discovered(draft: Draft, effect: Effect, columns: Sequence[int]) -> tuple[str, str]:
    for text, coefficient in effect.parameters.items():
        term = read_term(text)
        if term.states:
            raise CannotUndo(f"it remembers ({term.states[0][0]}), and nobody reads what")
        if "tau" in term.names or "tau[" in text:
            raise CannotUndo("it depends on the drive's torque at the same instant")
        if "t" in term.names:
            raise CannotUndo("it depends on how long the robot has run since it was measured")
        draft.terms += [(int(column), float(coefficient), term.text) for column in columns]
    rubs = all(read_term(text).rubs for text in effect.parameters)
    how = _along(draft) if rubs else "its value at the measured angle and the intended velocity is sent against it"
    return how, " ".join(f"{value:+.3g} {text[:40]}" for text, value in effect.parameters.items())[:120]


_EARLY = "the reference's part is sent that much earlier, corrections are carried on; answers to what is read stay late"
_LAG = "feed-forward torque is sent that much earlier; the drive's loop takes up its lag in what follows a target"
_CARRIED = "readings are carried on by their velocity, the drive is told where the joint was; its damping stays late"
_RULES: dict[str, Rule] = {
    "encoder_offset": _encoder_offset,
    "imu_offset": _imu_offset,
    "motor_strength": _factor(True, False, False),
    "kp": _factor(False, True, False),
    "kd": _factor(False, False, True),
    "viscous_friction": _viscous,
    "coulomb_friction": _coulomb,
    "quadratic_friction": _drag,
    "stribeck_friction": _stribeck,
    "load_dependent_friction": _load_friction,
    "asymmetric_friction": _asymmetric,
    "cogging": _cogging,
    "joint_spring": _spring,
    "hysteresis": _hysteresis,
    "armature": _armature,
    "link_mass": _mass,
    "link_com": _com,
    "command_delay": _late("command_delay", _EARLY),
    "torque_lag": _late("torque_lag", _LAG),
    "encoder_delay": _late("encoder_delay", _CARRIED),
    "discovered": _discovered,
}
if missing := CATALOGUE.keys() ^ (_RULES.keys() | NOT_UNDONE.keys()):
    raise TypeError(f"compensation_rules.py needs a rule or a reason for each effect; not so: {sorted(missing)}")
