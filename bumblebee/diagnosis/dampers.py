"""A joint's position servo and its velocity servo as one: the declared kd then stands where every effect looks for it.

MJCF files of before `position kv=` give a joint a `position` and a `velocity` actuator. A log has one command a joint,
so the velocity servo is told to stand still and only damps.
"""

import mujoco

from bumblebee.sim.servo import ON_JOINT

_AFFINE = mujoco.mjtBias.mjBIAS_AFFINE


def fold_dampers(spec: mujoco.MjSpec) -> tuple[mujoco.MjSpec, list[str]]:
    """A copy in which each position servo has the gain of the velocity servos on its joint, and these have none.

    Also the names of the joints; where there are none the spec itself comes back. Actuators keep their number and
    order. A force limit of the position servo now holds for the sum, as a drive's current limit does; the velocity
    servo's own is dropped.
    """
    pairs = [(i, k) for i, a in enumerate(spec.actuators) if _follows_position(a) for k in _dampers_on(spec, a.target)]
    if not pairs:
        return spec, []
    spec = spec.copy()
    for i, k in pairs:
        servo, damper = spec.actuators[i], spec.actuators[k]
        bias = servo.biasprm.copy()
        bias[2] += damper.biasprm[2] * (damper.gear[0] / servo.gear[0]) ** 2
        servo.biasprm = bias
        damper.gainprm, damper.biasprm = 0 * damper.gainprm, 0 * damper.biasprm
    return spec, sorted({spec.actuators[i].target for i, _ in pairs})


def _follows_position(a: mujoco.MjsActuator) -> bool:
    return a.trntype in ON_JOINT and a.biastype == _AFFINE and a.biasprm[1] != 0


def _dampers_on(spec: mujoco.MjSpec, joint: str) -> list[int]:
    """Actuators on a joint that feed back its velocity alone."""
    there = [(k, a) for k, a in enumerate(spec.actuators) if a.trntype in ON_JOINT and a.target == joint]
    return [k for k, a in there if a.biastype == _AFFINE and a.biasprm[1] == 0 and a.biasprm[2] != 0]
