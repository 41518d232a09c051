"""What is declared of each robot: the model that the diagnosis gets, and the figures that the truth starts from."""

from dataclasses import dataclass

import mujoco
import numpy as np

from bumblebee.robot.model import build_spec

ARM_XML = """<mujoco model="bench_arm">
<compiler angle="radian"/>
<option timestep="0.005" integrator="implicitfast"/>
<worldbody>
 <body name="base"><inertial pos="0 0 .05" mass="3" diaginertia=".02 .02 .02"/>
 <body name="shoulder" pos="0 0 .12"><joint name="yaw" axis="0 0 1" armature=".03"/>
  <inertial pos=".015 .005 .06" mass="1.6" diaginertia=".009 .008 .006"/>
 <body name="upper" pos="0 .02 .10"><joint name="lift" axis="0 1 0" armature=".03"/>
  <inertial pos=".012 .004 .14" mass="1.3" diaginertia=".012 .012 .002"/>
 <body name="fore" pos="0 0 .28"><joint name="elbow" axis="0 1 0" armature=".02"/>
  <inertial pos=".02 .006 .09" mass=".9" diaginertia=".006 .006 .001"/>
 <body name="roller" pos="0 0 .16"><joint name="roll" axis="0 0 1" armature=".008"/>
  <inertial pos=".018 .012 .03" mass=".5" diaginertia=".0012 .0012 .0007"/>
 <body name="hand" pos="0 0 .07"><joint name="wrist" axis="0 1 0" armature=".006"/>
  <inertial pos=".02 .015 .07" mass=".45" diaginertia=".0012 .0013 .0006"/>
 </body></body></body></body></body></body>
</worldbody>
<actuator>
 <position name="yaw" joint="yaw" kp="90" kv="5" forcerange="-40 40"/>
 <position name="lift" joint="lift" kp="120" kv="6" forcerange="-50 50"/>
 <position name="elbow" joint="elbow" kp="70" kv="3.5" forcerange="-30 30"/>
 <position name="roll" joint="roll" kp="25" kv="1" forcerange="-12 12"/>
 <position name="wrist" joint="wrist" kp="25" kv="1" forcerange="-12 12"/>
</actuator></mujoco>"""


@dataclass(frozen=True, eq=False)
class Declared:
    """One robot as its maker describes it; J joints in the model's order."""

    name: str
    spec: mujoco.MjSpec
    """5 ms, position servos."""
    joints: tuple[str, ...]
    bodies: tuple[str, ...]
    """Bodies that move and have a mass."""
    kp: np.ndarray
    """(J,) [N m/rad]."""
    kd: np.ndarray
    """(J,) [N m s/rad]."""
    limit: np.ndarray
    """(J,) [N m]."""
    armature: np.ndarray
    """(J,) [kg m^2]."""
    friction: np.ndarray
    """(J,) declared dry friction [N m]."""
    damping: np.ndarray
    """(J,) [N m s/rad]."""
    mass: dict[str, float]
    """Body -> [kg]."""
    floating: bool


def declared(robot: str) -> Declared:
    """`arm` (five joints on a fixed base, no contact) or any other name: the G1 on a floor."""
    spec = mujoco.MjSpec.from_string(ARM_XML) if robot == "arm" else build_spec()
    model = spec.compile()
    hinges = [j for j in range(model.njnt) if model.jnt_type[j] == int(mujoco.mjtJoint.mjJNT_HINGE)]
    dofs = model.jnt_dofadr[hinges]
    servo = {int(model.actuator_trnid[a, 0]): a for a in range(model.nu)}
    rows = [servo[j] for j in hinges]
    moving = [b for b in range(1, model.nbody) if model.body_weldid[b] and model.body_mass[b] > 0]
    return Declared(
        name=robot,
        spec=spec,
        joints=tuple(model.joint(j).name for j in hinges),
        bodies=tuple(model.body(b).name for b in moving),
        kp=model.actuator_gainprm[rows, 0].copy(),
        kd=-model.actuator_biasprm[rows, 2],
        limit=model.actuator_forcerange[rows, 1].copy(),
        armature=model.dof_armature[dofs].copy(),
        friction=model.dof_frictionloss[dofs].copy(),
        damping=model.dof_damping[dofs].copy(),
        mass={model.body(b).name: float(model.body_mass[b]) for b in moving},
        floating=robot != "arm",
    )
