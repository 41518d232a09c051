"""Flights of references, the torques that they need, and where a policy loses a motion."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from benchmarks.flights import flights, needed_torques, push_off
from benchmarks.losses import losses, roll
from bumblebee.learning.policy import Policy, Shape, new_actor
from bumblebee.motion.clip import Clip
from bumblebee.motion.embedded import EmbeddedConfig, make_library
from bumblebee.motion.kinematics import lowest, make_clip
from bumblebee.robot.facts import stand_pose
from bumblebee.sim.sensors import load_model
from bumblebee.tracking.feed_forward import static_torques
from bumblebee.tracking.observing.terms import parts

STILL = make_library(EmbeddedConfig(limit=1))[0]


def standing(height: np.ndarray, name: str = "stand") -> Clip:
    """The relaxed stand, lifted by `height` (T,) [m] above the floor."""
    count = len(height)
    pose = np.tile(stand_pose(), (count, 1))
    root = np.zeros((count, 3))
    quat = np.tile([1.0, 0.0, 0.0, 0.0], (count, 1))
    root[:, 2] = height - lowest(root, quat, pose)
    return make_clip(name, 50.0, root, quat, pose)


def test_a_ballistic_flight_is_found_with_its_speed_and_fall():
    time = np.arange(80) / 50
    speed, start = 2.0, 0.8
    jump = np.clip(speed * (time - start) - 9.81 / 2 * (time - start) ** 2, 0, None) * (time > start)
    found = flights(standing(jump))
    assert len(found) == 1
    assert found[0].height == pytest.approx(speed**2 / 2 / 9.81, abs=0.01)
    assert found[0].acceleration == pytest.approx(-9.81, rel=0.03)
    # 5 cm up it has lost a little of its speed
    assert 1.4 < found[0].speed < 2.0
    assert found[0].torque > 1.5 * push_off(standing(np.zeros(80)), found[0].start).max()


def test_a_stand_has_no_flight():
    assert flights(standing(np.zeros(60))) == []


def test_a_still_stand_needs_its_static_torques():
    clip = standing(np.zeros(30))
    dynamic, static = needed_torques(clip, range(10, 20)), static_torques(clip)[10:20]
    # Both carry the same weight; where under the soles it is pushed is theirs to choose: some N m at the ankles.
    knees = [3, 9]
    assert np.allclose(dynamic[:, knees], static[:, knees], atol=6.0)
    assert np.allclose(dynamic[:, 12:], static[:, 12:], atol=0.5)
    assert np.abs(dynamic).max() < 40


def still_policy() -> Policy:
    """Says 0 at all times: the reference with its gravity lead is held."""
    size = sum(entries for _, entries in parts(("demo",), 23, 2))
    shape = Shape(size, size, 23, (4,), (0.1, 0.3))
    actor = new_actor(shape)
    with torch.no_grad():
        actor.mlp[-1].weight.zero_()
        actor.mlp[-1].bias.zero_()
    return Policy(actor, {}, shape)


def test_a_robot_that_stands_on_air_is_lost_where_the_reference_leaves_the_floor():
    model = load_model(physics_hz=200.0)
    lift = np.zeros(60)
    lift[30:] = np.linspace(0, 1.0, 30)
    clips = [standing(lift, "lifted"), standing(np.zeros(60))]
    whole = roll(still_policy(), clips, torch.zeros(2, dtype=torch.long), torch.full((2,), 59), model)
    assert 35 < whole.lost[0] < 50 and whole.lost[1] == -1
    table, jumps = losses(still_policy(), clips, model)
    assert table["lost_at"].notna().tolist() == [True, False]
    # the place itself is what cannot be followed, wherever the robot starts before it
    assert table.loc[0, ["passes_0.5s", "passes_1s", "passes_2s"]].tolist() == [False, False, False]
    assert table.loc[1, "passes_1s"] is None or np.isnan(table.loc[1, "passes_1s"])
    assert jumps["name"].tolist() == ["lifted"] and bool(jumps["lost_here"][0])
    assert jumps["rise"][0] < 0.1 < jumps["rise_wanted"][0]


def test_a_start_in_the_middle_follows_the_clip_from_there():
    clip = replace(STILL)
    model = load_model(physics_hz=200.0)
    rolled = roll(still_policy(), [clip], torch.tensor([50]), torch.tensor([5]), model)
    assert torch.allclose(rolled.wanted[:, 0], torch.as_tensor(clip.root_pos[51:56, 2]))
