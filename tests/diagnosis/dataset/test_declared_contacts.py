"""Contacts of the declared model that are closed where nothing touches are left out and named; real ones stay."""

import re

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.dataset.session import Session, make_session
from bumblebee.diagnosis.output import corrected_xml
from bumblebee.measured.checks.reversed_command import share_for_reversed
from bumblebee.measured.checks.thresholds import Thresholds
from bumblebee.measured.checks.view import View
from bumblebee.measured.rollout import Rollout
from tests.diagnosis import stander
from tests.diagnosis.simulation.test_conditions import errors

ARM = """<mujoco model="arm"><compiler angle="radian"/><option timestep=".002" integrator="implicitfast"/><worldbody>
{base}<body {name}><inertial pos="0 0 0" mass="1" diaginertia=".01 .01 .01"/>{pedestal}
<body name="upper" pos="0 0 .2"><joint name="a" axis="0 1 0" damping=".3"/>
<geom type="capsule" fromto="0 0 0 .3 0 0" size=".03" mass="1"/>
<body name="fore" pos=".3 0 0"><joint name="b" axis="0 1 0" damping=".2"/>
<geom type="capsule" fromto="0 0 0 .25 0 0" size=".02" mass=".5"/></body></body></body></worldbody>{contact}
<actuator><position joint="a" kp="60" kv="3"/><position joint="b" kp="30" kv="1.5"/></actuator></mujoco>"""
BOX = '<geom type="box" size=".1 .1 .2"/>'
TABLE = '<geom name="table" type="plane" size="2 2 .1"/>'
FIXED = {
    "in the world": {"base": BOX},
    "a body of its own": {"name": 'name="pedestal"', "pedestal": BOX},
    "without a name": {"pedestal": BOX},
}


def arm(base: str = "", name: str = "", pedestal: str = "", contact: str = "") -> str:
    return ARM.format(base=base, name=name, pedestal=pedestal, contact=contact)


def record(xml: str, centre: tuple[float, float] = (0.0, 0.0)) -> list[Rollout]:
    """Three rollouts at 50 Hz around targets `centre` [rad]."""
    rng, model, out = np.random.default_rng(0), mujoco.MjModel.from_xml_string(xml), []
    model.opt.timestep, model.opt.integrator = 0.001, int(mujoco.mjtIntegrator.mjINT_EULER)
    time = np.arange(150) / 50
    for number in range(3):
        data, states = mujoco.MjData(model), []
        data.qpos[:] = centre
        rate, phase = rng.uniform(1, 8, (3, 2)), rng.uniform(0, 6.28, (3, 2))
        target = np.array(centre) + 0.25 * np.sin(rate * time[:, None, None] + phase).sum(axis=1)
        for wanted in target:
            states.append(np.concatenate((data.qpos, data.qvel)))
            data.ctrl[:] = wanted
            mujoco.mj_step(model, data, 20)
        states += [5e-4, 5e-4, 0.02, 0.02] * rng.standard_normal((len(time), 4))
        q, v = np.split(np.array(states), 2, axis=1)
        out.append(Rollout(f"r{number}", ("a", "b"), 50.0, time, q, v, joint_target=target))
    return out


def session(xml: str, rollouts: list[Rollout]) -> Session:
    return make_session(mujoco.MjSpec.from_string(xml), rollouts, "arm", "memory")


@pytest.mark.parametrize("fixed", FIXED.values(), ids=list(FIXED))
def test_a_fixed_base_that_a_link_overlaps_is_named_and_does_not_touch_it(fixed: dict[str, str]) -> None:
    made = session(arm(**fixed), record(arm()))
    assert len(made.warnings) == 1 and "with upper" in made.warnings[0]
    assert errors(made).max() < 5e-3
    written = mujoco.MjModel.from_xml_string(corrected_xml(made.spec, [])[0])
    assert written.nexclude == 1


@pytest.mark.parametrize("fixed", FIXED.values(), ids=list(FIXED))
def test_the_printed_exclusion_settles_it(fixed: dict[str, str]) -> None:
    rollouts = record(arm())
    first = session(arm(**fixed), rollouts)
    printed = re.search(r"<contact>.*</contact>", first.warnings[0])
    assert printed is not None
    named = (
        {"name": f'name="{name[1]}"'} if (name := re.search('body number 1 named "(.*)"', first.warnings[0])) else {}
    )
    settled = session(arm(**fixed | named, contact=printed[0]), rollouts)
    assert settled.warnings == ()
    np.testing.assert_array_equal(errors(settled), errors(first))


def test_a_table_that_is_pressed_on_stays_and_is_named_beside_a_base_that_is_left_out() -> None:
    declared = arm(TABLE, name='name="pedestal"', pedestal=BOX)
    made = session(declared, record(arm(TABLE), centre=(0.3, 0.5)))
    assert "pedestal with upper" in made.warnings[0] and "fore" not in made.warnings[0]
    assert [note for note in made.notes if "stay" in note and note.endswith("world with fore")]
    assert errors(made, column=1).max() < 5e-3


def test_feet_of_a_floating_base_are_not_asked() -> None:
    rollouts, _ = stander.simulate()
    made = make_session(mujoco.MjSpec.from_string(stander.XML), rollouts, "stander", "memory")
    assert not made.warnings and not [note for note in made.notes if "contact" in note]


def test_a_base_that_is_overlapped_does_not_turn_a_commands_sign() -> None:
    view = View("r0", record(arm())[0], mujoco.MjModel.from_xml_string(arm(BOX)), None, Thresholds())
    assert [share_for_reversed(view, joint, by_target=True) for joint in range(2)] == [0, 0]
