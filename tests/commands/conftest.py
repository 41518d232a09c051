"""A dataset of two short rollouts, its model, and the command line, for the commands of the diagnosis."""

import sys
from pathlib import Path

import numpy as np
import pytest

from bumblebee import cli
from bumblebee.measured.rollout import Rollout, write_rollout

XML = """<mujoco><compiler angle="radian"/><option timestep="0.005"/><worldbody>
<body name="l"><joint name="j" axis="0 1 0" armature=".01"/>
<inertial pos="0 0 .1" mass="1" diaginertia=".01 .01 .01"/></body></worldbody>
<actuator><position name="j" joint="j" kp="30" kv="2"/></actuator></mujoco>"""


def run(*arguments: object) -> int:
    """Exit status of `bumblebee ARGUMENTS`."""
    before, sys.argv = sys.argv, ["bumblebee", *map(str, arguments)]
    try:
        cli.main()
    except SystemExit as end:
        return int(end.code or 0)
    finally:
        sys.argv = before
    return 0


@pytest.fixture
def data(tmp_path: Path) -> Path:
    """A dataset of two short rollouts that hang still but for a swing."""
    rng = np.random.default_rng(0)
    time = np.arange(60) / 50
    for name in ("a", "b"):
        q = 0.2 * np.sin(3 * time)[:, None] + 5e-4 * rng.standard_normal((60, 1))
        v = 0.6 * np.cos(3 * time)[:, None] + 0.02 * rng.standard_normal((60, 1))
        rollout = Rollout(name, ("j",), 50.0, time, q, v, joint_target=0.2 * np.sin(3 * time + 0.2)[:, None])
        write_rollout(tmp_path / "set" / "rollouts" / f"{name}.parquet", rollout)
    (tmp_path / "model.xml").write_text(XML)
    return tmp_path
