#!/bin/bash
# mujoco 4.0.0. `dampratio` is turned into kv at each compile of an MjSpec, from the inertia of that moment: whoever edits
# an armature or a mass in a spec and compiles again has another damping, too, without having touched the actuator.
# Seen: kv 2.546, after armature 0 -> 0.5 kv 10.319. Source: MuJoCo XML reference, actuator/position, dampratio.
set -euo pipefail
here=$(mktemp -d)
trap 'rm -rf "$here"' EXIT
python3 -m venv "$here/venv"
"$here/venv/bin/pip" install -q mujoco==4.0.0
cd "$here"
venv/bin/python - <<'PY'
import mujoco

spec = mujoco.MjSpec.from_string("""
<mujoco><worldbody><body><joint name="j" axis="0 1 0"/>
<geom type="capsule" fromto="0 0 0 0 0 -.3" size=".03" mass="1"/></body></worldbody>
<actuator><position joint="j" kp="50" dampratio="1"/></actuator></mujoco>""")
kv = []
for armature in (0.0, 0.5):
    spec.joints[0].armature = armature
    kv.append(-float(spec.compile().actuator_biasprm[0, 2]))
print("mujoco", mujoco.__version__, "kv", kv)
assert abs(kv[0] - 2.5457) < 1e-3 and abs(kv[1] - 10.3189) < 1e-3
PY
