#!/bin/bash
# mujoco 4.0.0 against 3.17.0. With `implicitfast`, a servo whose joint has `actuatorfrcrange` loses its implicit damping
# while the limit is reached since 4.0, so that a light joint rings between both limits for ever; under 3.17 it comes to rest.
# Robots of Unitree and of MuJoCo Menagerie state their limits that way.
# Seen after 10 s: 4.0.0 20.9 rad/s, 3.17.0 below 1e-6. Source: MuJoCo documentation, computation, integrators.
set -euo pipefail
here=$(mktemp -d)
trap 'rm -rf "$here"' EXIT
cat > "$here/ring.py" <<'PY'
import mujoco

model = mujoco.MjModel.from_xml_string("""
<mujoco><option timestep=".005" integrator="implicitfast" gravity="0 0 0"/><worldbody><body>
<joint name="j" axis="0 0 1" armature=".001" actuatorfrcrange="-5 5"/>
<geom type="capsule" fromto="0 0 0 .1 0 0" size=".02" mass=".05"/></body></worldbody>
<actuator><position joint="j" kp="400" kv="20"/></actuator></mujoco>""")
data = mujoco.MjData(model)
data.ctrl[0] = 1.0
speeds = []
for _ in range(2000):
    mujoco.mj_step(model, data)
    speeds.append(abs(data.qvel[0]))
last = max(speeds[-100:])
print("mujoco", mujoco.__version__, "largest speed of the last half second", last)
assert last > 10.0 if mujoco.__version__.startswith("4.") else last < 1e-6
PY
for version in 3.17.0 4.0.0; do
  python3 -m venv "$here/$version"
  "$here/$version/bin/pip" install -q "mujoco==$version"
  "$here/$version/bin/python" "$here/ring.py"
done
