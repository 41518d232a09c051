"""The contract's settings of an engine follow the model that runs."""

import pytest

from bumblebee.evaluation.engines import engine_settings
from bumblebee.sim.sensors import load_model


def test_settings_are_the_models_own() -> None:
    told = engine_settings(load_model(physics_hz=500))
    assert told["timestep"] == pytest.approx(0.002)
    assert told["integrator"] == "implicitfast" and told["actuators"] == "position servos"
    assert engine_settings(load_model(physics_hz=500)) == told


@pytest.mark.parametrize("field", ["body_mass", "dof_frictionloss", "actuator_gainprm", "geom_friction"])
def test_another_robot_has_another_hash(field: str) -> None:
    model = load_model()
    before = engine_settings(model)["model_sha256"]
    getattr(model, field)[7:8] += 0.01
    assert engine_settings(model)["model_sha256"] != before
