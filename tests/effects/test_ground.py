"""Effects of the ground hold whichever settings a contact goes by: the larger, the first, or a named pair's."""

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.candidates import all_candidates
from bumblebee.diagnosis.simulation import make_plant
from bumblebee.diagnosis.simulation.variation import vary
from bumblebee.measured.rollout import Rollout
from bumblebee.sim.effects import add_to_spec, single

SLED = """<mujoco><option timestep=".002"/><worldbody>
<geom name="floor" type="plane" size="5 5 .1" friction="1" {floor}/>
<body name="sled" pos="0 0 .1"><freejoint/>
<geom name="sole" type="box" size=".2 .2 .1" mass="3" friction=".5" {sole}/>
<body name="arm"><joint name="j" axis="0 1 0"/><geom size=".05" mass=".1" contype="0" conaffinity="0"/></body></body>
</worldbody>{more}<actuator><position joint="j" kp="1" kv=".1"/></actuator></mujoco>"""
WAYS = {
    "the larger counts": ({"sole": "", "floor": "", "more": ""}, 1.0),
    "the sole's comes first": ({"sole": 'priority="1"', "floor": "", "more": ""}, 0.5),
    "the floor's comes first": ({"sole": "", "floor": 'priority="1"', "more": ""}, 1.0),
    "a named pair has its own": (
        {
            "sole": 'contype="0" conaffinity="0"',
            "floor": 'contype="0" conaffinity="0"',
            "more": '<contact><pair geom1="sole" geom2="floor" friction=".7 .7 .005 .0001 .0001"/></contact>',
        },
        0.7,
    ),
    "stiffness and damping": ({"sole": 'solref="-10000 -200"', "floor": "", "more": ""}, 1.0),
}


def slid(model: mujoco.MjModel) -> float:
    """Way [m] that the sled goes in 0.3 s, pushed off at 1 m/s."""
    data = mujoco.MjData(model)
    data.qvel[0] = 1.0
    mujoco.mj_step(model, data, 150)
    return float(data.qpos[0])


def sunk(model: mujoco.MjModel) -> float:
    """How deep [m] the sled stands in the floor."""
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 1500)
    return 0.1 - float(data.qpos[2])


def in_plain_terms(time: float, friction: float) -> mujoco.MjModel:
    """The sled and a floor that are both so soft and so rough: how deep a sled stands hangs on both."""
    soft = f'solref="{time} 1"'
    model = mujoco.MjModel.from_xml_string(SLED.format(sole=soft, floor=soft, more=""))
    model.geom_friction[:, 0] = friction
    return model


@pytest.mark.parametrize(("parts", "friction"), WAYS.values(), ids=WAYS)
def test_friction_and_softness_of_the_ground_are_read_and_written(parts: dict[str, str], friction: float) -> None:
    spec = mujoco.MjSpec.from_string(SLED.format(**parts))
    zeros = np.zeros((3, 1))
    base = {"base_pos": np.zeros((3, 3)), "base_quat": np.tile([1.0, 0.0, 0.0, 0.0], (3, 1))}
    base |= {"base_ang_vel": np.zeros((3, 3)), "base_lin_vel": np.zeros((3, 3))}
    log = Rollout("run", ("j",), 50.0, np.arange(3) / 50, zeros, zeros, joint_target=zeros, **base)
    plant = make_plant(spec, log, "sled")
    grounds = {c.effect: c for c in all_candidates(plant, [log], []) if c.where == "floor"}
    assert grounds["ground_friction"].nominal[0] == pytest.approx(friction)
    for effect, value, way in (("ground_friction", 0.2, slid), ("ground_compliance", 0.1, sunk)):
        changed, written = single(effect, "floor", value), spec.copy()
        add_to_spec(written, [changed])
        before, now = way(plant.model), way(vary(plant, [changed]).model)
        assert now == pytest.approx(way(written.compile()), rel=1e-6)
        assert now > 1.3 * before, (effect, before, now)
    assert now == pytest.approx(sunk(in_plain_terms(value, friction)), rel=0.02)  # not merely softer: as soft as told
