"""Every other effect of the catalogue that adds no joint against its equation integrated in NumPy."""

from collections.abc import Callable

import mujoco
import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.sim.effects import CATALOGUE, Effect, add_to_spec, runtime_hooks, single, sloped
from tests.sim.hinge import (
    ARM,
    FINE,
    INERTIA,
    KD,
    KP,
    LIMIT,
    MASS,
    TOTAL,
    check,
    close,
    model_with,
    path,
    reference,
    servo,
    sign,
    swing,
)

TORQUES = {
    "stribeck_friction": ((0.8, 1.0), lambda t, q, v: servo(t, q, v) - 0.8 * np.exp(-(v**2)) * sign(v)),
    "load_dependent_friction": ((0.2,), lambda t, q, v: servo(t, q, v) - 0.2 * abs(servo(t, q, v)) * sign(v)),
    "quadratic_friction": ((0.4,), lambda t, q, v: servo(t, q, v) - 0.4 * v * abs(v)),
    "asymmetric_friction": ((0.6,), lambda t, q, v: servo(t, q, v) - 0.3),
    "torque_limit": ((2.0,), lambda t, q, v: float(np.clip(KP * (swing(t) - q) - KD * v, -2.0, 2.0))),
    "joint_spring": ((3.0, 0.7), lambda t, q, v: servo(t, q, v) - 3.0 * q + 0.7),
    "cogging": (
        (0.5, -0.3, 12.0),
        lambda t, q, v: servo(t, q, v) + 0.5 * np.sin(12 * q) - 0.3 * np.cos(12 * q),
    ),
    "strength_drift": ((0.9,), lambda t, q, v: (1 - 0.9 * t) * servo(t, q, v)),
}


@pytest.mark.parametrize("kind", TORQUES)
def test_a_torque_follows_its_equation(kind: str) -> None:
    """I a = servo + effect."""
    values, torque = TORQUES[kind]
    check([single(kind, "j", *values)], reference(torque), share=0.25 if kind == "stribeck_friction" else 0.15)


def test_friction_by_load_and_direction_follows_its_equation() -> None:
    """A share of 0.35 of the servo's torque forward and 0.05 backward."""

    def torque(t: float, q: float, v: float) -> float:
        return servo(t, q, v) - (0.2 + 0.15 * sign(v)) * abs(servo(t, q, v)) * sign(v)

    check([single("load_dependent_friction", "j", 0.2, 0.3)], reference(torque), share=0.15)


def test_friction_of_two_directions_holds_between_its_bounds() -> None:
    """Coulomb 1.0 with a difference of 0.8: a standing joint takes up to 1.4 N m one way and 0.6 the other."""
    effects = [single("coulomb_friction", "j", 1.0), single("asymmetric_friction", "j", 0.8)]
    for torque, moves in ((1.3, False), (1.5, True), (-0.5, False), (-0.7, True)):
        end = path(effects, lambda t, u=torque: u / KP, seconds=0.2)[-1, 0]
        assert (abs(end) > 2e-3) == moves


def test_torque_falls_with_speed_while_it_drives_the_motion() -> None:
    def torque(t: float, q: float, v: float) -> float:
        raw = KP * (1.0 - q) - KD * v
        return float(np.clip(raw, -LIMIT * (1 - max(-v, 0) / 4.0), LIMIT * (1 - max(v, 0) / 4.0)))

    check([single("torque_speed_limit", "j", 4.0)], reference(torque), target=lambda t: 1.0)


def test_a_lag_filters_the_servos_torque() -> None:
    state = [0.0]

    def torque(t: float, q: float, v: float) -> float:
        state[0] += FINE * (servo(t, q, v) - state[0]) / 0.02
        return state[0]

    check([single("torque_lag", "j", 0.02)], reference(torque), share=0.08)


def square(t: float) -> float:
    """A target that jumps every 0.1 s by several sizes."""
    return (0.0, 0.5, 0.3, -0.2, 0.4)[min(int(t / 0.1 + 1e-9), 4)]


def shaped(
    follow: Callable[[float, float, float], tuple[float, float]], late: float = 0.0
) -> Callable[[float, float, float], float]:
    """The servo's torque where its set-point y, of speed w, goes by `follow(y, w, target)` in a step of FINE.

    The target is `late` [s].
    """
    state = [0.0, 0.0]

    def torque(t: float, q: float, v: float) -> float:
        state[:] = follow(*state, square(max(t - late, 0.0)))
        return float(np.clip(KP * (state[0] - q) - KD * v, -LIMIT, LIMIT))

    return torque


def _profile(y: float, w: float, u: float) -> tuple[float, float]:
    """Bang-bang to rest at u: speed up unless braking with all there is would overshoot."""
    acceleration, limit = 40.0, 2.5
    wanted = np.sign(u - y) * min(limit, np.sqrt(2 * acceleration * abs(u - y)))
    w += float(np.clip(wanted - w, -FINE * acceleration, FINE * acceleration))
    return y + FINE * w, w


SETPOINTS = {
    "command_filter": ((0.03,), lambda y, w, u: (y + FINE * (u - y) / 0.03, 0.0)),
    "command_rate_limit": ((3.0,), lambda y, w, u: (y + float(np.clip(u - y, -FINE * 3.0, FINE * 3.0)), 0.0)),
    "command_profile": ((40.0, 2.5), _profile),
}


@pytest.mark.parametrize("kind", SETPOINTS)
def test_a_servo_follows_its_set_point(kind: str) -> None:
    values, follow = SETPOINTS[kind]
    check([single(kind, "j", *values)], reference(shaped(follow)), share=0.03, target=square)


@pytest.mark.parametrize("kind", SETPOINTS)
def test_a_set_point_follows_a_late_command(kind: str) -> None:
    values, follow = SETPOINTS[kind]
    late = reference(shaped(follow, 0.0325))
    check([single("command_delay", "j", 0.0325), single(kind, "j", *values)], late, share=0.03, target=square)


def test_torque_lags_behind_a_late_command() -> None:
    state = [0.0]

    def torque(t: float, q: float, v: float) -> float:
        wanted = np.clip(KP * (square(max(t - 0.0325, 0.0)) - q) - KD * v, -LIMIT, LIMIT)
        state[0] += FINE * (wanted - state[0]) / 0.02
        return state[0]

    check([single("command_delay", "j", 0.0325), single("torque_lag", "j", 0.02)], reference(torque), target=square)


def test_a_joint_has_one_set_point() -> None:
    effects = [single("command_filter", "j", 0.03), single("command_rate_limit", "j", 3.0)]
    with pytest.raises(BadInput, match="command_rate_limit on joint 'j'"):
        runtime_hooks(effects, model_with())


def test_an_old_reading_reaches_the_servo() -> None:
    seen: list[tuple[float, float]] = []

    def torque(t: float, q: float, v: float) -> float:
        seen.append((q, v))
        return servo(t, *seen[max(0, len(seen) - 1 - round(0.0125 / FINE))])

    check([single("encoder_delay", "", 0.0125)], reference(torque), share=0.08)


def test_a_rounded_reading_reaches_the_servo() -> None:
    def torque(t: float, q: float, v: float) -> float:
        return servo(t, round(q / 0.1) * 0.1, v)

    check([single("encoder_quantisation", "j", 0.1)], reference(torque), share=0.35)


def test_heat_takes_strength() -> None:
    heat = [0.0]

    def torque(t: float, q: float, v: float) -> float:
        strength = 1 - 0.9 * heat[0]
        force = float(np.clip(strength * (KP * (4 * swing(t) - q) - KD * v), -LIMIT, LIMIT))
        heat[0] += FINE * (force / LIMIT) ** 2
        return force

    check([single("thermal_fade", "j", 0.9)], reference(torque), share=0.1, target=lambda t: 4 * swing(t))


@pytest.mark.parametrize(
    ("effect", "arm", "inertia"),
    [
        (single("link_com", "link", 0.36, 0.0, 0.0), 0.36, INERTIA + MASS * 0.36**2),
        (single("link_inertia", "link", 0.02, 0.03, 0.02), ARM, TOTAL + 0.03),
    ],
)
def test_a_shifted_centre_of_mass_and_another_inertia_swing_as_a_pendulum(
    effect: Effect, arm: float, inertia: float
) -> None:
    """I a = m g l cos q - d v."""
    options = {"gravity": 9.81, "kp": 0.0, "kd": 0.1}

    def fall(arm: float, inertia: float) -> np.ndarray:
        return reference(lambda t, q, v: MASS * 9.81 * arm * np.cos(q) - 0.1 * v, inertia=inertia)

    mine, plain = path([effect], lambda t: 0.0, **options), path([], lambda t: 0.0, **options)
    close(mine, plain, fall(arm, inertia), fall(ARM, TOTAL))


def test_a_slope_turns_gravity() -> None:
    model = model_with(single("ground_slope", "", 0.0, 0.2), gravity=9.81)
    np.testing.assert_allclose(model.opt.gravity, [-9.81 * np.sin(0.2), 0.0, -9.81 * np.cos(0.2)], atol=1e-4)


def test_gravity_that_is_declared_along_x_turns_about_y_and_z() -> None:
    """By two small turns its parts along y and z are those of the cross product."""
    turned = sloped((-9.81, 0.0, 0.0), 0.0, 0.02, -0.01)
    np.testing.assert_allclose(turned[1:], [9.81 * 0.01, 9.81 * 0.02], rtol=1e-3)
    assert np.linalg.norm(turned) == pytest.approx(9.81)


def test_a_wrench_pushes_the_link() -> None:
    """40 N downwards at the centre of mass and 2 N m about y."""
    effect = single("external_wrench", "link", 0.0, 0.0, -40.0, 0.0, 2.0, 0.0)
    pushed = reference(lambda t, q, v: np.clip(-KP * q - KD * v, -LIMIT, LIMIT) + 40 * ARM * np.cos(q) + 2.0)
    check([effect], pushed, target=lambda t: 0.0)


BOX = """<mujoco><option timestep="0.001"/><worldbody><geom name="floor" type="plane" size="2 2 1"/>
<body name="box" pos="0 0 0.03"><freejoint/><geom name="box" type="box" size=".1 .1 .03" mass="1"/></body>
</worldbody></mujoco>"""


def box_with(effect: Effect, push: float) -> mujoco.MjData:
    spec = mujoco.MjSpec.from_string(BOX)
    add_to_spec(spec, [effect])
    spec.compile()
    model = mujoco.MjModel.from_xml_string(spec.to_xml())
    data = mujoco.MjData(model)
    data.xfrc_applied[1, 0] = push
    mujoco.mj_step(model, data, 1000)
    return data


@pytest.mark.parametrize("friction", [0.3, 1.5])
def test_a_box_slides_when_it_is_pushed_harder_than_friction(friction: float) -> None:
    """Coulomb's law on both sides of the declared coefficient 1."""
    weight = 9.81
    assert abs(box_with(single("ground_friction", "floor", friction), 0.8 * friction * weight).qvel[0]) < 0.05
    sliding = box_with(single("ground_friction", "floor", friction), 1.4 * friction * weight).qvel[0]
    assert sliding == pytest.approx(0.4 * friction * weight, rel=0.15)


def test_a_soft_floor_gives_way() -> None:
    """Penetration grows with the square of the contact's time constant."""
    sunk = [0.03 - box_with(single("ground_compliance", "floor", time), 0.0).qpos[2] for time in (0.02, 0.06)]
    assert 4 < sunk[1] / sunk[0] < 12


def test_places_that_are_not_there_are_named() -> None:
    for kind, value in (
        ("link_com", (0, 0, 0)),
        ("ground_friction", (1,)),
        ("backlash", (0.1,)),
        ("cogging", (1, 1, 1)),
    ):
        with pytest.raises(BadInput, match="nobody"):
            effect = single(kind, "nobody", *value)
            runtime_hooks([effect], model_with(effect))


def test_every_id_says_truly_whether_mjcf_carries_it() -> None:
    """A native effect needs no hook; the hook of another does something."""
    places = {"joint": "j", "body": "link", "geom": "floor", "whole": ""}
    for name, kind in CATALOGUE.items():
        if name == "discovered":
            continue  # has terms in place of values: tests/sim/test_discovered.py
        model = model_with() if kind.on != "geom" else mujoco.MjModel.from_xml_string(BOX)
        values = [max(p.lower, 0.03) for p in kind.parameters if p.default is None]
        assert runtime_hooks([single(name, places[kind.on], *values)], model).empty == kind.native, name
