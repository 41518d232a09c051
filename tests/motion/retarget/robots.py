"""Small robots for the tests: a humanoid with several hinges on a body and joints away from the bodies' origins."""

from pathlib import Path

import mujoco

from bumblebee.motion.retarget.mapping import Robot, make_robot

H1 = Path(__file__).resolve().parents[3] / "benchmarks/retarget/robots/h1"


def _leg(side: str, y: float) -> str:
    return f"""
    <body name="{side}_thigh" pos="0 {y} -0.05" quat="0.99 0.05 0.02 {y}">
      <joint name="{side}_hip_z" axis="0 0 1" pos="0 0 0.01" range="-90 90"/>
      <joint name="{side}_hip_x" axis="1 0 0" pos="0.01 0 0" range="-60 60"/>
      <joint name="{side}_hip_y" axis="0.1 1 0" range="-130 60"/>
      <geom type="capsule" size="0.04" fromto="0 0 -0.05 0 0 -0.25"/>
      <body name="{side}_shin" pos="0 0 -0.3">
        <joint name="{side}_knee" axis="0 1 0" pos="0.01 0 0.02" range="-5 140"/>
        <geom type="capsule" size="0.03" fromto="0 0 -0.05 0 0 -0.22"/>
        <body name="{side}_foot" pos="0 0 -0.3">
          <joint name="{side}_ankle" axis="0 1 0" range="-50 50"/>
          <geom type="sphere" size="0.03"/>
        </body>
      </body>
    </body>"""


def _arm(side: str, y: float) -> str:
    return f"""
    <body name="{side}_upper" pos="0 {y} 0.35">
      <joint name="{side}_shoulder_y" axis="0 1 0" range="-180 120"/>
      <joint name="{side}_shoulder_x" axis="1 0 0" pos="0 0.01 0" range="-150 150"/>
      <joint name="{side}_shoulder_z" axis="0 0 1" range="-120 120"/>
      <geom type="capsule" size="0.03" fromto="0 0 -0.04 0 0 -0.16"/>
      <body name="{side}_fore" pos="0 0 -0.2">
        <joint name="{side}_elbow" axis="0 1 0" range="-150 0"/>
        <geom type="capsule" size="0.03" fromto="0 0 -0.04 0 0 -0.18"/>
      </body>
    </body>"""


def small_model(extra: str = "", root: str = "<freejoint/>") -> mujoco.MjModel:
    """A humanoid without a waist, three hinges on one body at hips and shoulders, one at the ankles."""
    parts = "".join(_leg(s, y) + _arm(s, 2 * y) for s, y in (("left", 0.08), ("right", -0.08)))
    return mujoco.MjModel.from_xml_string(
        f"""<mujoco model="small"><compiler angle="degree" autolimits="true"/><worldbody>
        <body name="trunk" pos="0 0 0.7">{root}<geom type="capsule" size="0.08" fromto="0 0 0 0 0 0.3"/>{parts}</body>
        {extra}</worldbody></mujoco>"""
    )


def mapping() -> dict:
    """Mapping of the small humanoid."""
    points: dict = {"neck": ["trunk", [0.0, 0.0, 0.38]]}
    soles = {}
    for side in ("left", "right"):
        points |= {f"{side}_hip": f"{side}_thigh", f"{side}_knee": f"{side}_shin", f"{side}_ankle": f"{side}_foot"}
        points |= {f"{side}_shoulder": f"{side}_upper", f"{side}_elbow": f"{side}_fore"}
        points[f"{side}_wrist"] = [f"{side}_fore", [0.0, 0.0, -0.2]]
        corners = [[-0.04, 0.02, -0.04], [-0.04, -0.02, -0.04], [0.1, 0.02, -0.04], [0.1, -0.02, -0.04]]
        soles[side] = [f"{side}_foot", corners]
    return {"robot": "small", "points": points, "soles": soles, "sole_radius": 0.01}


def small() -> Robot:
    """The small humanoid."""
    return make_robot("small.yaml", mapping(), small_model())
