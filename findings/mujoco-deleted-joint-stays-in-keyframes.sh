#!/bin/bash
# mujoco 4.0.0. `MjSpec.delete(joint)` shortens the keyframes only if the spec was compiled before: the same two deletions on a spec
# fresh from its XML end in "keyframe ... invalid qpos size", after a first compile() they succeed.
# Seen: compiled before: nq 1 and a key of one angle; fresh: ValueError. Source: mujoco.MjSpec, delete; MuJoCo model editing.
set -euo pipefail
here=$(mktemp -d)
trap 'rm -rf "$here"' EXIT
python3 -m venv "$here/venv"
"$here/venv/bin/pip" install -q mujoco==4.0.0
cd "$here"
venv/bin/python - <<'PY'
import mujoco

XML = """
<mujoco><worldbody><body><joint name="hip" axis="0 1 0"/><geom size=".1"/>
<body pos="0 0 -.3"><joint name="knee" axis="0 1 0"/><geom size=".1"/></body></body></worldbody>
<actuator><motor name="knee" joint="knee"/></actuator><keyframe><key qpos=".1 .2"/></keyframe></mujoco>"""
seen = {}
for before in (True, False):
    spec = mujoco.MjSpec.from_string(XML)
    if before:
        spec.compile()
    spec.delete(spec.actuators[0])
    spec.delete(spec.joint("knee"))
    try:
        model = spec.compile()
        seen[before] = (model.nq, model.key_qpos.tolist())
    except ValueError as error:
        seen[before] = str(error).splitlines()[0]
print("mujoco", mujoco.__version__, "compiled before -> result", seen)
assert seen[True] == (1, [[0.1]]) and "invalid qpos size" in seen[False]
PY
