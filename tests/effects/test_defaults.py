"""Effects add nothing of a model's defaults, and where they change it it stays changed."""

import mujoco
import numpy as np
import pytest

from bumblebee.sim.effects import Effect, add_to_spec, single

ARM = """<mujoco><compiler {compiler}/><option timestep=".001"/><default>{default}</default><worldbody>
<body name="upper"><joint name="a" axis="0 1 0" armature=".05" {joint}/>
<geom type="capsule" fromto="0 0 0 .3 0 0" size=".03" mass="1"/>
<body name="lower" pos=".3 0 0"><joint name="b" axis="0 1 0" armature=".02" {joint}/>
<geom type="capsule" fromto="0 0 0 .3 0 0" size=".03" mass=".5"/></body></body></worldbody>
<actuator><position joint="a" kp="50" kv="2"/><position name="b" joint="b" kp="30" kv="1"/>{more}</actuator></mujoco>"""
JOINT = 'damping="1" frictionloss=".1" stiffness="2" range="-.5 .5"'


def moved(effect: Effect, **parts: str) -> np.ndarray:
    """Positions (T, 2) [rad] of the declared joints of a swinging arm with the effect."""
    model = made(effect, **parts)
    data, path = mujoco.MjData(model), []
    at = [model.joint(name).qposadr[0] for name in "ab"]
    for k in range(300):
        data.ctrl[:2] = 0.4 * np.sin(0.01 * k + np.arange(2))
        mujoco.mj_step(model, data)
        path.append(data.qpos[at])
    return np.array(path)


def made(effect: Effect, **parts: str) -> mujoco.MjModel:
    empty = dict.fromkeys(("compiler", "default", "joint", "more"), "")
    spec = mujoco.MjSpec.from_string(ARM.format(**empty | parts))
    add_to_spec(spec, [effect])
    return spec.compile()


@pytest.mark.parametrize(
    ("effect", "default"),
    [
        (single("backlash", "b", 0.05), f"<joint {JOINT}/>"),
        (single("series_elasticity", "b", 40.0), f"<joint {JOINT}/>"),
        (
            single("coupled_armature", "b", 0.05, 1.0),
            '<tendon damping=".3" frictionloss=".2" stiffness="3" armature=".1"/>',
        ),
        (single("surface_contact", "lower", -0.05, 0.3, 0.0, 0.0, 1.0), '<pair margin=".5" solref=".1 1"/>'),
    ],
    ids=lambda value: value.effect if isinstance(value, Effect) else "",
)
def test_what_an_effect_adds_takes_nothing_from_defaults(effect: Effect, default: str) -> None:
    stated = JOINT if "joint" in default else ""
    np.testing.assert_array_equal(moved(effect, default=default, joint=stated), moved(effect, joint=stated))


@pytest.mark.parametrize("compiler", ['inertiafromgeom="true"', 'settotalmass="3"'])
def test_a_mass_is_that_which_was_found_where_the_model_has_masses_made(compiler: str) -> None:
    model, declared = (
        made(single("link_mass", "lower", 1.5), compiler=compiler),
        made(single("kp", "b", 1.0), compiler=compiler),
    )
    assert model.body("lower").mass[0] == pytest.approx(1.5)
    assert model.body("upper").mass[0] == pytest.approx(declared.body("upper").mass[0])
