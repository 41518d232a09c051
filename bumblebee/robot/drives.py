"""The drives of any MJCF model in one form: what MuJoCo makes of them when it compiles, written out in the spec.

| MJCF | in the one form |
|---|---|
| servo `dampratio`, joint `springdamper` | the compiled stiffness and damping |
| joint `actuatorfrcrange`, motor `ctrlrange` | the tighter range as the drive's `forcerange` |
| `position` and `velocity` servo of one joint | one servo with both gains, one torque limit |
| `delay` longer than its buffer of `nsample` steps | the delay that the buffer allows |

MuJoCo works out ratios from the inertia at every compile: left as they are, they follow each change of the model.
The model moves as before: MuJoCo 4 treats a joint's force range as it treats that of its only drive, damping included.
"""

from collections.abc import Iterator

import mujoco
import numpy as np

ON_JOINT = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
_SCALAR = (int(mujoco.mjtJoint.mjJNT_SLIDE), int(mujoco.mjtJoint.mjJNT_HINGE))
_LINEAR = 1  # interpolation of a delay buffer
_ROUNDING = 1e-6  # of a step: 0.02 s are ten steps of 0.002 s


def explicit_drives(spec: mujoco.MjSpec) -> tuple[mujoco.MjSpec, list[str]]:
    """A copy of a model that compiles, its drives in the one form; and a line for each change that a user should know.

    Actuators keep their number and order. A second call changes nothing.
    """
    spec, model = spec.copy(), spec.compile()
    if model.nu != len(spec.actuators):  # actuators of several inputs
        return spec, []
    notes = _delays(spec)
    _resolve_damping(spec, model)
    folded = _fold_dampers(spec)
    for actuator, joint in _only_drives(spec):
        if ranges := _force_ranges(actuator, joint, model):
            actuator.forcerange = [max(low for low, _ in ranges), min(high for _, high in ranges)]
            actuator.forcelimited = mujoco.mjtLimited.mjLIMITED_TRUE
        if model.jnt_actfrclimited[joint.id]:
            joint.actfrclimited, joint.actfrcrange = mujoco.mjtLimited.mjLIMITED_FALSE, [0.0, 0.0]
    if folded:
        names = ", ".join(folded[:6])
        notes.append(f"position and velocity actuators combined into one servo with one torque limit: {names}")
    return spec, notes


def follows_position(a: mujoco.MjsActuator) -> bool:
    """Whether an actuator on a joint feeds its position back by an affine law."""
    return a.trntype in ON_JOINT and a.biastype == mujoco.mjtBias.mjBIAS_AFFINE and a.biasprm[1] != 0


def buffer_length(delay: float, step: float) -> int:
    """Samples of a delay buffer that hold a `delay` [s] at physics steps of `step` [s], with room for interpolation."""
    return int(np.ceil(delay / step - _ROUNDING)) + 2


def _delays(spec: mujoco.MjSpec) -> list[str]:
    notes, step = [], spec.option.timestep
    for a in spec.actuators:
        if not a.nsample or not a.delay:
            continue
        whole = a.delay if a.interp == _LINEAR else step * np.ceil(a.delay / step - _ROUNDING)
        delay = min(whole, a.nsample * step)
        if delay < a.delay - _ROUNDING * step:
            notes.append(
                f"actuator {a.name!r}: declared delay of {a.delay:g} s is longer than its buffer "
                f"(nsample {a.nsample}): {delay:g} s, as MuJoCo simulates it"
            )
        a.delay = delay
    return notes


def _resolve_damping(spec: mujoco.MjSpec, model: mujoco.MjModel) -> None:
    """Write the damping and stiffness that MuJoCo has worked out from ratios and time constants."""
    for a in spec.actuators:
        if a.biastype == mujoco.mjtBias.mjBIAS_AFFINE and a.biasprm[2] > 0:
            a.biasprm = [*a.biasprm[:2], model.actuator_biasprm[a.id, 2], *a.biasprm[3:]]
    for joint in spec.joints:
        if (np.asarray(joint.springdamper) > 0).all():
            joint.stiffness = [model.jnt_stiffness[joint.id], *joint.stiffness[1:]]
            joint.damping = [model.dof_damping[model.jnt_dofadr[joint.id]], *joint.damping[1:]]
            joint.springdamper = [0.0, 0.0]


def _fold_dampers(spec: mujoco.MjSpec) -> list[str]:
    """Give each position servo the gain of the velocity servos on its joint, which then have none; the joints' names.

    MJCF files of before `position kv=` give a joint a `position` and a `velocity` actuator. A log has one command a
    joint, so the velocity servo is told to stand still and only damps. A force limit of the position servo then holds
    for the sum, as a drive's current limit does; the velocity servo's own is dropped.
    """
    folded = set()
    for servo in filter(follows_position, spec.actuators):
        for damper in _dampers_on(spec, servo.target):
            bias = servo.biasprm.copy()
            bias[2] += damper.biasprm[2] * (damper.gear[0] / servo.gear[0]) ** 2
            servo.biasprm = bias
            damper.gainprm, damper.biasprm = 0 * damper.gainprm, 0 * damper.biasprm
            folded.add(servo.target)
    return sorted(folded)


def _dampers_on(spec: mujoco.MjSpec, joint: str) -> list[mujoco.MjsActuator]:
    """Actuators on a joint that feed back its velocity alone."""
    there = [a for a in spec.actuators if a.trntype in ON_JOINT and a.target == joint]
    return [a for a in there if a.biastype == mujoco.mjtBias.mjBIAS_AFFINE and a.biasprm[1] == 0 and a.biasprm[2] != 0]


def _only_drives(spec: mujoco.MjSpec) -> Iterator[tuple[mujoco.MjsActuator, mujoco.MjsJoint]]:
    """Hinges and slides that one actuator alone drives, with it.

    Where there are several the joint's range holds for their sum, which no range of one says; where gravity
    compensation counts as the actuators' (`actuatorgravcomp`) it holds for that, too.
    """
    live = [a for a in spec.actuators if a.trntype in ON_JOINT and (np.any(a.gainprm) or np.any(a.biasprm))]
    targets = [a.target for a in live]
    for a in live:
        joint = spec.joint(a.target)
        if targets.count(a.target) == 1 and int(joint.type) in _SCALAR and not joint.actgravcomp and a.gear[0]:
            yield a, joint


def _force_ranges(a: mujoco.MjsActuator, joint: mujoco.MjsJoint, model: mujoco.MjModel) -> list[np.ndarray]:
    """The declared ranges (2,) of an actuator's force [N m, N]."""
    ranges = []
    if model.actuator_forcelimited[a.id]:
        ranges.append(model.actuator_forcerange[a.id])
    if model.jnt_actfrclimited[joint.id]:
        ranges.append(np.sort(model.jnt_actfrcrange[joint.id] / a.gear[0]))
    takes_force = a.gaintype == mujoco.mjtGain.mjGAIN_FIXED and a.biastype == mujoco.mjtBias.mjBIAS_NONE
    if takes_force and model.actuator_ctrllimited[a.id]:
        ranges.append(np.sort(a.gainprm[0] * model.actuator_ctrlrange[a.id]))
    return ranges


def force_limit(model: mujoco.MjModel, actuator: int) -> float:
    """Largest force [N m, N] that an actuator's range allows both ways; of a range to one side that side's."""
    low, high = model.actuator_forcerange[actuator]
    return float(min(-low, high) if low < 0 < high else max(-low, high))
