#!/bin/bash
# mujoco 4.0.0. Removing the free joint of a robot (to clamp it to a stand) makes its base static, and the exemption of
# contacts between a body and its parent no longer holds: the base touches its own first links.
# Seen: 0 contacts with the free joint, 1 without, nothing else changed.
# Source: MuJoCo documentation, computation, collision detection (parent filter; bodies welded to the world).
set -euo pipefail
here=$(mktemp -d)
trap 'rm -rf "$here"' EXIT
python3 -m venv "$here/venv"
"$here/venv/bin/pip" install -q mujoco==4.0.0
cd "$here"
venv/bin/python - <<'PY'
import mujoco

spec = mujoco.MjSpec.from_string("""
<mujoco><worldbody><body name="base" pos="0 0 1"><freejoint/><geom type="sphere" size=".1" mass="1"/>
<body name="link"><joint axis="0 1 0"/><geom type="capsule" fromto="0 0 0 .3 0 0" size=".05"/></body></body>
</worldbody></mujoco>""")
contacts = []
for clamp in (False, True):
    if clamp:
        spec.delete(spec.joints[0])
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    contacts.append(data.ncon)
print("mujoco", mujoco.__version__, "contacts free, clamped:", contacts)
assert contacts == [0, 1]
PY
