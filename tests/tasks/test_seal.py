"""Sealing: by seed, noticeable, on distinct places, nothing for the null robot."""

from dataclasses import replace

import pytest

from bumblebee.deploy.stand_in_effects import PARAMETERS, to_arrays
from bumblebee.errors import BadInput
from bumblebee.robot.facts import g1_bodies, joints
from bumblebee.robot.model import build_model, gains
from tasks.seal import SealConfig, draw


def test_the_seed_decides_and_others_draw_otherwise() -> None:
    draws = [draw(SealConfig(seed=seed)) for seed in range(20)]
    assert draws == [draw(SealConfig(seed=seed)) for seed in range(20)]
    assert len({str(effects) for effects in draws}) == 20


def test_effects_are_of_distinct_kinds_on_distinct_places_and_the_robot_takes_them() -> None:
    model = build_model()
    for seed in range(10):
        effects = draw(SealConfig(seed=seed, n_effects=4))
        assert len({e["effect"] for e in effects}) == len({e["where"][0] for e in effects}) == 4
        to_arrays(effects, model)


def test_a_null_robot_has_none() -> None:
    assert draw(SealConfig(n_effects=0)) == []


@pytest.mark.parametrize("kind", PARAMETERS)
def test_every_kind_is_noticeable_in_its_own_unit(kind: str) -> None:
    """Away from the declared value by a margin that a servo or a scale would feel, in every draw."""
    table = {joint.name: joint for joint in joints()}
    for seed in range(30):
        (effect,) = draw(SealConfig(seed=seed, kinds=(kind,), n_effects=1))
        value, place = effect["parameters"][PARAMETERS[kind]], effect["where"][0]
        if kind == "link_mass":
            assert value >= 1.29 * g1_bodies()[place]["mass"]
            continue
        kp, kd = gains(table[place])
        margin = {
            "coulomb_friction": value / kp >= 0.0149,
            "viscous_friction": value / kd >= 0.39,
            "armature": value >= 1.99 * table[place].armature,
            "motor_strength": 0.5 < value <= 0.81,
            "command_delay": 0.01 <= value <= 0.02,
            "encoder_offset": abs(value) >= 0.029,
        }
        assert margin[kind], (kind, value)


@pytest.mark.parametrize(
    "change", [{"kinds": ("gremlin",)}, {"joints": ("left_tail",)}, {"bodies": ("tail",)}, {"n_effects": 9}]
)
def test_what_does_not_exist_is_named(change: dict) -> None:
    with pytest.raises(BadInput, match=f"SealConfig.{next(iter(change))}"):
        draw(replace(SealConfig(), **change))
