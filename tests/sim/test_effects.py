"""Each effect in MJCF against the same equation integrated in NumPy."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.sim.effects import CATALOGUE, Effect, add_to_spec, read_effects, runtime_hooks, single, write_effects

INERTIA, KP, KD, MASS, ARM = 0.05, 20.0, 1.0, 0.8, 0.3


def model_with(*effects: Effect, gravity: bool = False, servo: bool = True, step: float = 0.001) -> mujoco.MjModel:
    """One hinge about y, a point-like mass on an arm, a position servo; the effects added, through XML and back."""
    text = f"""<mujoco><compiler angle="radian"/><option timestep="{step}" gravity="0 0 {-9.81 if gravity else 0}"/>
    <worldbody><body name="link"><joint name="j" axis="0 1 0" armature="{INERTIA}"/>
    <inertial pos="{ARM} 0 0" mass="{MASS}" diaginertia="1e-6 1e-6 1e-6"/></body></worldbody><actuator>
    <position name="j" joint="j" kp="{KP if servo else 0}" kv="{KD if servo else 0}"/></actuator></mujoco>"""
    spec = mujoco.MjSpec.from_string(text)
    add_to_spec(spec, effects)
    spec.compile()
    return mujoco.MjModel.from_xml_string(spec.to_xml())


def run(model: mujoco.MjModel, seconds: float, speed: float = 0.0, target: float = 0.0) -> tuple[float, float]:
    """Position and speed after `seconds`."""
    data = mujoco.MjData(model)
    data.qvel[0], data.ctrl[0] = speed, target
    mujoco.mj_step(model, data, round(seconds / model.opt.timestep))
    return float(data.qpos[0]), float(data.qvel[0])


TOTAL = INERTIA + MASS * ARM**2


def test_coulomb_friction_slows_a_coasting_joint_evenly_and_holds_it() -> None:
    """v(t) = v0 - f t / I until it stops, and then it stays."""
    model = model_with(single("coulomb_friction", "j", 0.1), servo=False)
    assert run(model, 0.5, speed=2.0)[1] == pytest.approx(2.0 - 0.1 * 0.5 / TOTAL, rel=0.01)
    assert abs(run(model, 4.0, speed=0.5)[1]) < 1e-3


def test_coulomb_friction_sticks_under_a_load() -> None:
    """A load below the friction moves the joint by less than a milliradian in a second."""
    model = model_with(single("coulomb_friction", "j", 3.0), gravity=True, servo=False)
    assert MASS * 9.81 * ARM < 3.0
    assert abs(run(model, 1.0)[0]) < 2e-3


def test_viscous_friction_lets_speed_decay_exponentially() -> None:
    """v(t) = v0 exp(-d t / I)."""
    model = model_with(single("viscous_friction", "j", 0.2), servo=False)
    assert run(model, 0.5, speed=2.0)[1] == pytest.approx(2.0 * np.exp(-0.2 * 0.5 / TOTAL), rel=0.01)


@pytest.mark.parametrize(
    ("effect", "inertia", "kp", "kd"),
    [
        (single("armature", "j", 0.12), 0.12 + MASS * ARM**2, KP, KD),
        (single("motor_strength", "j", 0.7), TOTAL, 0.7 * KP, 0.7 * KD),
        (single("kp", "j", 0.7), TOTAL, 0.7 * KP, KD),
        (single("kd", "j", 0.7), TOTAL, KP, 0.7 * KD),
        (single("link_mass", "link", 1.6), INERTIA + 1.6 * ARM**2, KP, KD),
    ],
)
def test_a_servo_with_the_effect_follows_its_equation(effect: Effect, inertia: float, kp: float, kd: float) -> None:
    """I a = kp (u - q) - kd v, integrated here in steps of 10 us."""
    q = v = 0.0
    for _ in range(20_000):
        v += 1e-5 * (kp * (0.3 - q) - kd * v) / inertia
        q += 1e-5 * v
    position, speed = run(model_with(effect), 0.2, target=0.3)
    assert position == pytest.approx(q, abs=2e-3)
    assert speed == pytest.approx(v, abs=2e-2)


@pytest.mark.parametrize("step", [0.001, 0.005])
def test_a_delay_that_no_step_divides_is_kept_in_the_mean(step: float) -> None:
    """A delayed step command moves the joint as the undelayed one did 13 ms before."""
    late = model_with(single("command_delay", "j", 0.013), step=step)
    plain = model_with(step=step)
    assert run(late, 0.01, target=1.0)[0] == 0.0
    early, now = run(plain, 0.285, target=1.0)[0], run(plain, 0.290, target=1.0)[0]
    assert run(late, 0.300, target=1.0)[0] == pytest.approx(early + 0.4 * (now - early), abs=1.5e-3)


def test_an_encoder_offset_moves_where_the_servo_rests() -> None:
    """The reading settles at the target, the joint itself at target minus offset."""
    effect = single("encoder_offset", "j", 0.05)
    model = model_with(effect)
    position = run(model, 3.0, target=0.4)[0]
    assert position == pytest.approx(0.35, abs=1e-3)
    assert position + runtime_hooks([effect], model).encoder_offset[0] == pytest.approx(0.4, abs=1e-3)


def test_a_heavier_link_grows_in_inertia_only_where_its_mass_is_spread() -> None:
    declared = model_with().body("link").inertia
    assert model_with(single("link_mass", "link", 2 * MASS)).body("link").inertia == pytest.approx(declared)
    assert model_with(single("link_mass", "link", 2 * MASS, 1.0)).body("link").inertia == pytest.approx(2 * declared)


def test_a_heavier_link_sags_by_its_weight() -> None:
    """The servo's kp (u - q) balances m g l cos q."""
    q = run(model_with(single("link_mass", "link", 1.2), gravity=True), 5.0)[0]
    assert KP * -q == pytest.approx(-1.2 * 9.81 * ARM * np.cos(q), abs=0.02)


def test_effects_survive_their_file(tmp_path: Path) -> None:
    """Write and read back every kind."""
    effects = [single(kind, "a: [b", *(max(p.lower, 0.03) for p in c.parameters)) for kind, c in CATALOGUE.items()]
    effects[-1] = Effect("discovered", ("a: [b",), {"sin(12*q)": 0.3, "friction(q[b]^2)": -1e-3})
    write_effects(tmp_path / "effects.yaml", effects)
    assert read_effects(tmp_path / "effects.yaml") == effects


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("schema: 2\neffects: []", "schema"),
        ("schema: 1\neffects: []\nextra: 1", "extra"),
        ("schema: 1\neffects: [{effect: magic, where: [j], parameters: {}}]", "magic"),
        ("schema: 1\neffects: [{effect: armature, where: [j], parameters: {mass: 1}}]", "mass"),
        ("schema: 1\neffects: [{effect: armature, where: [j], parameters: {armature: .nan}}]", "armature"),
        ("schema: 1\neffects: [{effect: armature, where: [j], parameters: {armature: -1}}]", "armature"),
        ("schema: 1\neffects: [{effect: armature, where: j, parameters: {armature: 1}}]", "where"),
        ("!!python/object/apply:os.getcwd []", "YAML"),
        ("[", "YAML"),
    ],
)
def test_a_file_that_is_not_the_catalogues_is_named(tmp_path: Path, text: str, named: str) -> None:
    """One line that names key or value."""
    (tmp_path / "effects.yaml").write_text(text)
    with pytest.raises(BadInput, match=named):
        read_effects(tmp_path / "effects.yaml")


def test_an_effect_on_a_joint_that_is_not_there_is_refused() -> None:
    """Both the spec and the hooks name the place."""
    with pytest.raises(BadInput, match="nobody"):
        model_with(single("armature", "nobody", 1.0))
    with pytest.raises(BadInput, match="nobody"):
        runtime_hooks([single("encoder_offset", "nobody", 0.1)], model_with())
