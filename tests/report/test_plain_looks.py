"""A robot that has no visible shape of its own is drawn whole, and its physics stays what it was."""

import os
import subprocess
import sys

import mujoco
import pytest

from bumblebee.report.films.looks import is_g1
from bumblebee.report.films.plain_looks import show
from bumblebee.robot.which import VARIABLE

DRAWN = """
import mujoco, numpy as np
from bumblebee.report.films.plain_looks import show
from bumblebee.robot.facts import FEET, HEAD
from bumblebee.robot.model import build_model, build_spec
plain, spec = build_model(), build_spec()
show(spec)
drawn = spec.compile()
assert np.array_equal(plain.body_mass, drawn.body_mass) and np.array_equal(plain.body_inertia, drawn.body_inertia)
added = [g for g in range(drawn.ngeom) if drawn.geom_group[g] == 2]
assert not any(drawn.geom_contype[g] | drawn.geom_conaffinity[g] for g in added)
kinds = {drawn.body(drawn.geom_bodyid[g]).name: drawn.geom_type[g] for g in added}
assert all(kinds[foot] == mujoco.mjtGeom.mjGEOM_BOX for foot in FEET)
assert kinds[HEAD[0]] == mujoco.mjtGeom.mjGEOM_SPHERE
assert (drawn.geom_rgba[drawn.geom_group != 4][:, 3] > 0).all()
print(len(added))
"""


def test_an_h1_has_bones_soles_and_a_head() -> None:
    command = [sys.executable, "-c", DRAWN]
    came = subprocess.run(command, env=os.environ | {VARIABLE: "h1"}, capture_output=True, text=True, timeout=120)
    assert came.returncode == 0, came.stderr
    assert int(came.stdout) > 15


@pytest.mark.parametrize("tint", [None, (1.0, 0.0, 0.0, 1.0)])
def test_an_arm_keeps_its_own_geoms_and_takes_a_tint(tint: tuple[float, ...] | None) -> None:
    spec = mujoco.MjSpec.from_string(
        '<mujoco><worldbody><geom name="floor" type="plane" size="1 1 1"/><body><joint/>'
        '<geom name="rod" size="0.1" rgba="0 1 0 1"/></body></worldbody></mujoco>'
    )
    assert not is_g1(spec)
    show(spec, tint=tint)
    model = spec.compile()
    assert model.ngeom == 2
    assert tuple(model.geom("rod").rgba) == (tint or (0.0, 1.0, 0.0, 1.0))
    assert tuple(model.geom("floor").rgba) != tint
