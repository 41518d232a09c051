#!/bin/bash
# mujoco 4.0.0. What a geometry may touch, and from what distance on, is kept a second time for each body, from compiling.
# So a `geom_contype` that is set on a compiled model to wake geometries wakes none, unless `body_contype` is set, too. And
# a `geom_margin` that is set there acts on bodies of one geometry (and adds up: two of 0.04 m make a contact from 0.08 m
# on), but finds nothing more on bodies of several, which are looked for by their bodies' margins first. A check for
# clearance written so is silent until bodies touch, or for good. The option `o_margin` with its enable flag holds for both.
# Seen, contacts at gaps of 0.03, 0.05 and 0.09 m: set later 1 1 0 and 0 0 0, overridden 1 0 0 and 1 0 0; woken 0, with bodies 1.
# Source: mjmodel.h (body_contype, body_conaffinity, body_margin, mjOption.o_margin); MuJoCo documentation, "Collision
# detection" (pairs of bodies before pairs of geometries).
set -euo pipefail
here=$(mktemp -d)
trap 'rm -rf "$here"' EXIT
python3 -m venv "$here/venv"
"$here/venv/bin/pip" install -q mujoco==4.0.0
cd "$here"
venv/bin/python - <<'PY'
import copy

import mujoco

GAPS = 0.03, 0.05, 0.09


def contacts(model: mujoco.MjModel) -> list[int]:
    found = []
    for gap in GAPS:
        data = mujoco.MjData(model)
        data.qpos[0] = -0.2 - gap
        mujoco.mj_forward(model, data)
        found.append(data.ncon)
    return found


for more, seen in ("", [1, 1, 0]), ('<geom type="sphere" size=".1" pos="-2 0 0"/>', [0, 0, 0]):
    declared = mujoco.MjModel.from_xml_string(f"""
    <mujoco><option gravity="0 0 0"/><worldbody><body><freejoint/><geom type="sphere" size=".1"/>{more}</body>
    <body><freejoint/><geom type="sphere" size=".1"/></body></worldbody></mujoco>""")
    later, override = copy.copy(declared), copy.copy(declared)
    later.geom_margin[:] = 0.04
    override.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_OVERRIDE)
    override.opt.o_margin = 0.04
    print("mujoco", mujoco.__version__, "geometries", declared.ngeom, "set later", contacts(later))
    print("overridden", contacts(override), "as compiled", contacts(declared))
    assert contacts(declared) == [0, 0, 0] and contacts(later) == seen and contacts(override) == [1, 0, 0]

asleep = mujoco.MjModel.from_xml_string("""
<mujoco><worldbody><body><freejoint/><geom type="sphere" size=".1" contype="0"/></body>
<body pos=".15 0 0"><freejoint/><geom type="sphere" size=".1" contype="0"/></body></worldbody></mujoco>""")
data, found = mujoco.MjData(asleep), []
for kinds in asleep.geom_contype, asleep.body_contype:
    kinds[:] = 1
    mujoco.mj_forward(asleep, data)
    found.append(data.ncon)
print("woken", found[0], "with bodies", found[1])
assert found == [0, 1]
PY
