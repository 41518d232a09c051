#!/bin/bash
# mujoco 4.0.0. `mujoco.rollout` gives no sign that a simulation diverged: MuJoCo resets the state, and the returned
# trajectory goes on at zero, finite, as if the robot had come to rest at its reference pose. The time stays behind, too.
# Seen: speeds of 253 and 639894 rad/s, then 0 to the end of 200 steps, all finite. Source: mujoco.rollout, docstring of Rollout.rollout.
set -euo pipefail
here=$(mktemp -d)
trap 'rm -rf "$here"' EXIT
python3 -m venv "$here/venv"
"$here/venv/bin/pip" install -q mujoco==4.0.0
cd "$here"
venv/bin/python - <<'PY'
import mujoco
import numpy as np
from mujoco import rollout

model = mujoco.MjModel.from_xml_string("""
<mujoco><option timestep=".01"/><worldbody><body><joint name="j" axis="0 0 1"/>
<geom type="capsule" fromto="0 0 0 .1 0 0" size=".02" mass=".05"/></body></worldbody>
<actuator><general joint="j" biastype="affine" biasprm="0 0 50"/></actuator></mujoco>""")
data = mujoco.MjData(model)
data.qvel[0] = 0.1
full = mujoco.mjtState.mjSTATE_FULLPHYSICS
start = np.zeros(mujoco.mj_stateSize(model, full))
mujoco.mj_getState(model, data, start, full)
states, _ = rollout.rollout(model, data, start[None], np.zeros((1, 200, 1)))
print("mujoco", mujoco.__version__, "first states", states[0, :3].tolist(), "last", states[0, -1].tolist())
assert np.isfinite(states).all() and states[0, 0, 2] > 0.1 and (states[0, 10:, 1:] == 0).all()
PY
