"""Effects as native MJCF: added to an editable spec, so that the corrected model loads in plain MuJoCo.

| effect | MJCF |
|---|---|
| coulomb_friction, viscous_friction, armature | joint frictionloss (stiff), damping, armature |
| quadratic_friction | the second coefficient of the joint's damping, -c v abs(v) |
| asymmetric_friction | a constant torque, as a weak spring with a far reference, beside the dry friction |
| motor_strength, kp, kd | the servo's gainprm and biasprm |
| torque_limit | the servo's forcerange |
| command_delay | actuator delay, nsample, interp="linear": the mean of the held, delayed command over each step |
| encoder_offset | biasprm[0] = biasprm[1] * offset: a servo's part; the reading's part is a runtime hook |
| joint_spring, hysteresis | joint stiffness with springref; with springyield |
| backlash, series_elasticity | a second hinge on the same axis, with a range; with a stiffness. nq grows |
| the same, encoder on the joint | a rotor of its own: a weightless body on such a hinge, whose inertia is a tendon's |
| link_mass, link_com, link_inertia | the body's inertial; the moments with the mass where `spread` says so |
| ground_friction, ground_compliance | friction, solref of the geometry and of what can touch it |
| ground_slope | gravity |
| surface_contact | a sphere of 1 mm on the body, a plane of the world, and a contact pair of these two |

The others need `sim.effects.hooks` at run time.
"""

from collections.abc import Sequence

import mujoco

from bumblebee.effects.catalogue import CATALOGUE, Effect
from bumblebee.robot.drives import ON_JOINT


def in_order(effects: Sequence[Effect]) -> list[Effect]:
    """Effects in the order in which a model gets them: what goes by another's gain or spring comes after it."""
    order = list(CATALOGUE)
    return sorted(effects, key=lambda e: (CATALOGUE[e.effect].last, order.index(e.effect)))


def add_to_spec(spec: mujoco.MjSpec, effects: Sequence[Effect]) -> None:
    """Add every effect that MuJoCo can express to `spec`, in place."""
    for effect in in_order(effects):
        kind = CATALOGUE[effect.effect]
        for place in (effect.where or _everywhere(spec, kind.whole)) if kind.added else ():
            kind.add(spec, place, *effect.values())


def _everywhere(spec: mujoco.MjSpec, whole: bool) -> tuple[str, ...]:
    """The places that `where: []` stands for."""
    return tuple(dict.fromkeys(a.target for a in spec.actuators if a.trntype in ON_JOINT)) if whole else ("",)
