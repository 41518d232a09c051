"""The robots of the benchmark: an arm of five joints, and the G1 on a floor."""

import mujoco

from bumblebee.robot.model import build_spec
from bumblebee.stand_in.undeclared.declared import Declared, describe

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


def declared(robot: str) -> Declared:
    """`arm` (five joints on a fixed base, no contact) or any other name: the G1 on a floor."""
    return describe(robot, mujoco.MjSpec.from_string(ARM_XML) if robot == "arm" else build_spec())
