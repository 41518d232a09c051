"""A policy of which only the exported file is left is tried as the trained one is, with its history and memory."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

import bumblebee as bb
from bumblebee.learning.export import export_policy
from bumblebee.learning.generalist.transformer import TransformerConfig
from bumblebee.learning.policy import Policy, Shape, new_actor
from tests.policy.conftest import nod

OWN = TransformerConfig(embedding=12, heads=3, memory=4, feed_forward=8, head=(16,))
SHAPES = {
    "history": Shape(3 * 107, 107, 23, (8,), (), ("student",), history=3),
    "transformer": Shape(107, 107, 23, OWN.head, (), ("student",), transformer=OWN),
}


@pytest.fixture(params=SHAPES)
def pair(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[Policy, Path]:
    """An untrained policy and the folder with its exported file alone."""
    torch.manual_seed(1)
    shape = SHAPES[request.param]
    policy = Policy(new_actor(shape), {}, shape)
    export_policy(tmp_path, policy)
    return policy, tmp_path


def test_it_moves_the_robot_as_the_trained_policy_does(pair: tuple[Policy, Path]) -> None:
    """In the air, where no contact that is just touched makes a hair's difference large."""
    policy, folder = pair
    stand = nod(frames=12)
    lift = np.array([0.0, 0.0, 0.3])
    jump = replace(stand, root_pos=stand.root_pos + lift, key_pos=stand.key_pos + lift)
    trained, exported = bb.follow(policy, jump), bb.follow(folder, jump)
    assert exported.frames == trained.frames and np.abs(exported.joint_pos - trained.joint_pos).max() < 1e-4
    assert np.abs(trained.joint_pos - jump.joint_pos).max() > 0.02, "it acts, or the comparison says nothing"


def test_it_is_evaluated_with_the_columns_of_the_trained_policy(pair: tuple[Policy, Path]) -> None:
    policy, folder = pair
    motions = [nod(), nod(frames=12)]  # two of one name
    trained, exported = (bb.evaluate(one, motions, repeats=2, noise=1.0) for one in (policy, folder))
    assert list(exported.columns) == list(trained.columns) and list(exported["name"]) == list(trained["name"])
    assert exported["joint_error"].nunique() == 4, "each rollout has a start of its own"
    assert np.allclose(exported["joint_error"], trained["joint_error"], rtol=0.5)
