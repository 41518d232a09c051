#!/bin/bash
# mink 1.3.0 with daqp. A joint slightly beyond its range has a solution under `ConfigurationLimit` alone (it is sent back at
# once) and none when a `VelocityLimit` is added, since both cannot hold: a measured pose at an end stop ends in an exception.
# Seen: -65 rad/s alone, NoSolutionFound with both. Source: mink.limits.
set -euo pipefail
here=$(mktemp -d)
trap 'rm -rf "$here"' EXIT
python3 -m venv "$here/venv"
"$here/venv/bin/pip" install -q mink==1.3.0 daqp==0.11.0 mujoco==4.0.0
cd "$here"
venv/bin/python - <<'PY'
from importlib.metadata import version

import mink
import mujoco
import numpy as np

model = mujoco.MjModel.from_xml_string("""
<mujoco><compiler angle="radian"/><worldbody><body><joint name="j" axis="0 0 1" range="-1 1"/>
<geom type="capsule" fromto="0 0 0 .3 0 0" size=".03" mass="1"/></body></worldbody></mujoco>""")
configuration = mink.Configuration(model)
configuration.update(np.array([1.3]))
task = mink.PostureTask(model, cost=1.0)
task.set_target(np.array([0.0]))
limits = [mink.ConfigurationLimit(model)]
alone = mink.solve_ik(configuration, [task], dt=0.02, solver="daqp", limits=limits, safety_break=False)
try:
    limits.append(mink.VelocityLimit(model, {"j": 1.0}))
    both = mink.solve_ik(configuration, [task], dt=0.02, solver="daqp", limits=limits, safety_break=False)
except mink.NoSolutionFound as error:
    both = error
print("mink", version("mink"), "alone", alone, "both", repr(both))
assert abs(alone[0] + 65.0) < 1e-6 and isinstance(both, mink.NoSolutionFound)
PY
