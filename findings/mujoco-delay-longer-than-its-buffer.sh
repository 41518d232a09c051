#!/bin/bash
# mujoco 4.0.0. An actuator `delay` longer than its buffer (`nsample` steps) is cut to the buffer without a word: with steps
# of 2 ms, delay .04 and nsample 2 the command arrives after 2 steps, with nsample 10 after 10, with 50 after the 20 meant.
# Source: MuJoCo XML reference, actuator/general, delay and nsample.
set -euo pipefail
here=$(mktemp -d)
trap 'rm -rf "$here"' EXIT
python3 -m venv "$here/venv"
"$here/venv/bin/pip" install -q mujoco==4.0.0
cd "$here"
venv/bin/python - <<'PY'
import mujoco

late = {}
for nsample in (2, 10, 50):
    model = mujoco.MjModel.from_xml_string(f"""
<mujoco><option timestep=".002"/><worldbody><body><joint name="j" axis="0 0 1"/>
<geom type="capsule" fromto="0 0 0 .3 0 0" size=".03" mass="1"/></body></worldbody>
<actuator><position joint="j" kp="50" delay=".04" nsample="{nsample}" interp="zoh"/></actuator></mujoco>""")
    data = mujoco.MjData(model)
    data.ctrl[0] = 1.0
    forces = []
    for _ in range(40):
        mujoco.mj_step(model, data)
        forces.append(abs(data.actuator_force[0]))
    late[nsample] = next(step for step, force in enumerate(forces) if force > 1.0)
print("mujoco", mujoco.__version__, "nsample -> steps until the command acts", late)
assert late == {2: 2, 10: 10, 50: 20}
PY
