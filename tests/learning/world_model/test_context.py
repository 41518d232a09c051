"""The model is told in what worlds differ: a column means one thing, whatever was drawn."""

import numpy as np
import torch

from bumblebee.learning.world_model.context import context_of
from bumblebee.tracking.config import EnvConfig, Randomisation
from bumblebee.tracking.model import task_model
from bumblebee.tracking.worlds.randomisation import draw_fields

WORLDS = 16


def test_columns_have_an_order_of_their_own_whatever_was_drawn() -> None:
    """A model is learned by ranks whose worlds differ, and is continued in others."""
    model = task_model(EnvConfig())
    random = Randomisation(mass=0.2, gains=0.1, friction=(0.5, 1.5))
    orders = []
    for seed in (0, 1, 2):
        drawn = draw_fields(model, random, WORLDS, seed)
        context = context_of(model, drawn, WORLDS).double()
        wanted = np.concatenate(
            (
                drawn["geom_friction"][:, :1, 0] / model.geom_friction[:1, 0],
                drawn["actuator_gainprm"][:, :, 0] / model.actuator_gainprm[:, 0],
                drawn["actuator_biasprm"][:, :, 2] / model.actuator_biasprm[:, 2],
                drawn["body_mass"][:, 1:] / model.body_mass[1:],
            ),
            axis=1,
        )
        wanted = torch.from_numpy((wanted - wanted.mean(0)) / wanted.std(0))
        alike = (context.T @ wanted / WORLDS - 1).abs() < 1e-5
        assert context.shape == wanted.shape and alike.any(0).all()
        orders.append(alike.double().argmax(0).tolist())
    assert orders[0] == orders[1] == orders[2]


def test_worlds_that_are_alike_need_no_context() -> None:
    assert context_of(task_model(EnvConfig()), {}, WORLDS).shape == (WORLDS, 0)
