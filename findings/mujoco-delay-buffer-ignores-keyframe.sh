#!/bin/bash
# mujoco 4.0.0. The buffer of a delayed actuator starts at 0, also after a reset to a keyframe whose `ctrl` holds the pose:
# a servo at rest at q = 1 with ctrl = 1 is pulled towards 0 until the delay has passed.
# Seen: force -50 N m in the first step, 0 without the delay. Source: MuJoCo XML reference, actuator/general, delay; keyframe.
set -euo pipefail
here=$(mktemp -d)
trap 'rm -rf "$here"' EXIT
python3 -m venv "$here/venv"
"$here/venv/bin/pip" install -q mujoco==4.0.0
cd "$here"
venv/bin/python - <<'PY'
import mujoco

forces = {}
for delay in ("", 'delay=".04" nsample="50" interp="zoh"'):
    model = mujoco.MjModel.from_xml_string(f"""
<mujoco><option timestep=".002" gravity="0 0 0"/><worldbody><body><joint name="j" axis="0 0 1"/>
<geom type="capsule" fromto="0 0 0 .3 0 0" size=".03" mass="1"/></body></worldbody>
<actuator><position joint="j" kp="50" kv="2" {delay}/></actuator>
<keyframe><key qpos="1" ctrl="1"/></keyframe></mujoco>""")
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_step(model, data)
    forces["delayed" if delay else "direct"] = float(data.actuator_force[0])
print("mujoco", mujoco.__version__, "first force", forces)
assert forces == {"direct": 0.0, "delayed": -50.0}
PY
