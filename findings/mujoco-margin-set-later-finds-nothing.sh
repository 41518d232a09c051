#!/bin/bash
# mujoco 4.0.0. A `geom_margin` that is set on a compiled model acts on bodies of one geometry (and adds up: two of 0.04 m
# make a contact from 0.08 m on), but finds nothing more on bodies of several: pairs of those are first looked for with
# margins of bodies, kept from compiling. A check for clearance written so is silent until bodies touch. The option
# `o_margin` with its enable flag holds for both, as far as it says.
# Seen, contacts at gaps of 0.03, 0.05 and 0.09 m: set later 1 1 0 and 0 0 0, overridden 1 0 0 and 1 0 0.
# Source: MuJoCo documentation, "Collision detection" (body pairs before geom pairs) and mjOption.o_margin;
# PickNikRobotics/moveit_pro_example_ws pull request 811 (pairs of single geometries skip the step in between).
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
PY
