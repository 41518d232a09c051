"""A world model that goes on in another simulator, and a policy through it and its residual."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from bumblebee.errors import BadInput
from bumblebee.learning.world_model.context import context_of
from bumblebee.learning.world_model.continuing import ContinuedTrainer, Frame, Parent, continue_model, fitting
from bumblebee.learning.world_model.residual import new_residual
from bumblebee.sim.sensors import load_model
from tests.learning.tiny import env_of
from tests.learning.world_model.test_trainer import SMALL, TASK

ALIKE = replace(TASK, randomisation=replace(TASK.randomisation, friction=(1.0, 1.0), gains=0.0, mass=0.0, push=0.0))


def still(seen: torch.Tensor) -> torch.Tensor:
    return torch.zeros(len(seen), 23)


@pytest.fixture(scope="module")
def parent() -> Parent:
    return continue_model(env_of(ALIKE), still, SMALL, None, 1).parent


def test_a_model_goes_on_part_by_part_as_it_is_normalised_and_the_parts_repeat(parent: Parent) -> None:
    first, again = (continue_model(env_of(ALIKE, seed=1), still, SMALL, parent, 2, seed=1) for _ in range(2))
    kept, went = parent.model.state_dict(), first.parent.model.state_dict()
    for name in ("mean", "std", "scale"):
        assert torch.equal(kept[name], went[name]), name
    assert not torch.equal(kept["layers.0.weight"], went["layers.0.weight"])
    for name, value in again.parent.model.state_dict().items():
        assert torch.equal(value, went[name]), name
    assert first.memory.full and first.loss == again.loss


def test_saved_and_loaded_alike_and_another_file_is_one_line(parent: Parent, tmp_path: Path) -> None:
    parent.save(tmp_path)
    loaded = Parent.load(tmp_path)
    assert loaded.frame == parent.frame
    for name, value in loaded.model.state_dict().items():
        assert torch.equal(value, parent.model.state_dict()[name]), name
    with pytest.raises(BadInput, match="expected a trained world model, came no such file"):
        Parent.load(tmp_path / "none")
    torch.save({"frame": {"joints": ["a"]}}, tmp_path / "model.pt")
    with pytest.raises(BadInput, match=r"model\.pt: expected a world model"):
        Parent.load(tmp_path)


def test_earlier_targets_that_a_later_servo_needs_have_no_weight_at_first(parent: Parent) -> None:
    longer = fitting(parent, replace(parent.frame, past=3, context=0), "x")
    body = torch.randn(5, 13 + 46)
    body[:, 3:7] = torch.nn.functional.normalize(body[:, 3:7])
    target, before, none = torch.randn(5, 23), torch.randn(5, 69), torch.zeros(5, 0)
    told = parent.model(body, target, before[:, :23], none)
    torch.testing.assert_close(longer(body, target, before, none), told)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"joints": ("a", "b")}, r"expected a world model of joints \('a', 'b'\), came joints \('left_hip"),
        ({"dt": 0.01}, "expected a world model of dt 0.01, came dt 0.02"),
        ({"context": 4}, "expected a world model of context 4, came context 0"),
        ({"past": 0}, "expected a world model of at most 0 earlier targets, came one of 1"),
    ],
)
def test_a_model_of_another_robot_or_simulator_is_one_line(parent: Parent, change: dict, said: str) -> None:
    with pytest.raises(BadInput, match=said):
        fitting(parent, Frame(**{**vars(parent.frame), **change}), "model.pt")


def test_a_policy_learns_through_the_residual_and_the_model_learns_from_the_simulator_alone(
    parent: Parent, tmp_path: Path
) -> None:
    config = replace(SMALL, iterations=1)
    wrong = new_residual(parent.model, (4,)).requires_grad_(False)
    wrong[-1].bias.fill_(3.0)
    trained = {}
    for name, residual in (("without", None), ("with", wrong)):
        trainer = ContinuedTrainer(env_of(ALIKE), config, tmp_path / name, parent, residual)
        own = trainer.model_update.model.state_dict()
        assert all(torch.equal(own[key], value) for key, value in parent.model.state_dict().items())
        trainer.train()
        trainer.save_checkpoint()
        trained[name] = trainer
    models = [each.model_update.model.state_dict() for each in trained.values()]
    assert all(torch.equal(models[0][key], value) for key, value in models[1].items())
    assert not torch.equal(models[0]["layers.0.weight"], parent.model.state_dict()["layers.0.weight"])
    assert (wrong[-1].bias == 3.0).all()
    actors = [each.policy_update.actor.mlp.state_dict() for each in trained.values()]
    assert any(not torch.equal(actors[0][key], value) for key, value in actors[1].items())
    again = ContinuedTrainer(env_of(ALIKE), config, tmp_path / "with", parent, wrong)
    assert again.iteration == 1 and again.frames == trained["with"].frames
    for key, value in again.policy_update.actor.mlp.state_dict().items():
        assert torch.equal(value, actors[1][key]), key


def test_the_numbers_in_which_worlds_differ_keep_their_order_from_draw_to_draw() -> None:
    model, rng = load_model(), np.random.default_rng(0)
    for _ in range(5):
        mass, gain = 1 + 0.1 * rng.standard_normal(40), 1 + 0.1 * rng.standard_normal(40)
        values = {
            "body_mass": mass[:, None] * model.body_mass,
            "actuator_gainprm": gain[:, None, None] * model.actuator_gainprm,
        }
        context = context_of(model, values, 40)
        assert context.shape == (40, 2)
        for column, own in zip(context.T, (mass, gain), strict=True):
            np.testing.assert_allclose(column, (own - own.mean()) / own.std(), atol=1e-5)
