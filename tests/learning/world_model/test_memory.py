"""Samples that the networks learn from: rows that belong together, in order, of one episode."""

import pytest
import torch

from bumblebee.learning.world_model.collector import Collector
from bumblebee.learning.world_model.dynamics import Dynamics, past_targets
from bumblebee.learning.world_model.memory import Memory
from bumblebee.tracking.config import EnvConfig, Randomisation
from tests.learning.tiny import env_of

STEPS, WORLDS, JOINTS = 10, 3, 2


def counted(steps: int, broken_at: int | None = None) -> Memory:
    """Worlds whose every entry is 100 * world + step."""
    memory = Memory(STEPS, torch.arange(WORLDS)[:, None].float(), JOINTS)
    for step in range(steps):
        value = (100 * torch.arange(WORLDS) + step)[:, None].float()
        columns = dict.fromkeys(("target", "before", "action", "earlier"), value.expand(-1, JOINTS))
        memory.begin(value[:, 0].long(), value[:, 0].long(), body=value.expand(-1, 13 + 2 * JOINTS), **columns)
        memory.end(torch.full((WORLDS,), step == broken_at))
    return memory


@pytest.mark.parametrize("steps", [STEPS, STEPS + 1, 3 * STEPS + 7])
def test_a_window_is_one_worlds_steps_in_a_row_from_the_oldest_kept_to_the_newest(steps: int) -> None:
    torch.manual_seed(0)
    window = counted(steps).windows(4, 500)
    first = window.bodies[0, :, 0]
    assert torch.equal(window.bodies[:, :, 0], first + torch.arange(5)[:, None])
    assert torch.equal(window.targets[:, :, 0], first + torch.arange(4)[:, None])
    assert torch.equal(window.before[:, 0], first) and torch.equal(window.context[:, 0], first // 100)
    assert window.valid.all()
    at = first % 100
    assert at.min() == steps - STEPS and at.max() == steps - 5, "the last body of a window is the newest kept"


def test_a_window_is_valid_up_to_the_step_before_a_break() -> None:
    torch.manual_seed(0)
    window = counted(STEPS, broken_at=6).windows(4, 500)
    step = window.bodies[:-1, :, 0] % 100
    first = step[0]
    assert torch.equal(window.valid, (step < 6) | (first > 6))


def test_imagination_begins_anywhere_in_the_memory() -> None:
    torch.manual_seed(0)
    starts = counted(STEPS + 4).starts(500)
    assert sorted({int(value) % 100 for value in starts.body[:, 0]}) == list(range(4, STEPS + 4))
    for column in (starts.before[:, 0], starts.action[:, 0], starts.clip, starts.frame):
        assert torch.equal(column.float(), starts.body[:, 0])


def test_every_row_follows_from_the_one_before_or_from_a_reset() -> None:
    """Targets, actions and frames of collected steps, over ends by failure, by the clip's end and by time."""
    task = EnvConfig(num_worlds=8, threads=1, episode_seconds=0.5, threshold_start=0.3, threshold_end=0.3)
    env = env_of(task)
    memory = Memory(50, torch.zeros(8, 0), env.num_actions)
    collect, resets = Collector(env, memory, 2.0), []
    for _ in range(50):
        collect(lambda seen: 0.3 * torch.ones(len(seen), env.num_actions))
        resets.append(env.episode_length_buf == 0)
    after = {name: column[1:] for name, column in memory.columns.items()}
    earlier = {name: column[:-1] for name, column in memory.columns.items()}
    fresh = torch.stack(resets)[:-1]
    assert fresh.sum() > 8 and (~fresh).any()
    assert (memory.broken[:-1] | ~fresh).all()
    goes = ~fresh
    for name, source in (("before", earlier["target"]), ("earlier", earlier["action"])):
        assert torch.equal(after[name][goes], source[goes]), name
    assert torch.equal(memory.clip[1:][goes], memory.clip[:-1][goes])
    assert torch.equal(memory.frame[1:][goes], memory.frame[:-1][goes] + 1)
    assert not after["action"][fresh].any() and not after["earlier"][fresh].any()
    held = env.library.frames(memory.clip.flatten(), memory.frame.flatten() * env.dt).hold_pos.unflatten(0, (50, 8))
    assert torch.equal(after["before"][fresh], held[1:][fresh])
    coming = env.library.frames(memory.clip.flatten(), (memory.frame.flatten() + 1) * env.dt).hold_pos
    taken = (memory.columns["target"] - coming.unflatten(0, (50, 8))) / env.scale
    torch.testing.assert_close(after["action"][goes], taken[:-1][goes], atol=1e-4, rtol=1e-4)


def test_as_many_earlier_targets_are_kept_as_may_still_act() -> None:
    """Commands that are two control steps late at most; a step's own targets may then act in the two after it."""
    late = Randomisation(delay=(0.02, 0.04), push=0.0)
    env = env_of(EnvConfig(num_worlds=4, threads=1, randomisation=late, episode_seconds=0.2))
    past = past_targets(0.04, env.dt)
    assert [past_targets(delay, 0.02) for delay in (0.0, 0.02, 0.021, 0.04)] == [1, 1, 2, 2] and past == 2
    memory = Memory(20, torch.zeros(4, 0), env.num_actions, past)
    collect, resets = Collector(env, memory, 0.5), []
    for _ in range(20):
        collect(lambda seen: torch.zeros(len(seen), env.num_actions))
        resets.append(env.episode_length_buf == 0)
    last, earlier = memory.columns["before"].chunk(2, dim=-1)
    fresh = torch.stack(resets)[:-1]
    assert torch.equal(last[1:][~fresh], memory.columns["target"][:-1][~fresh])
    assert torch.equal(earlier[1:][~fresh], last[:-1][~fresh])
    assert fresh.any() and torch.equal(earlier[1:][fresh], last[1:][fresh])
    window = memory.windows(3, 10)
    model = Dynamics(env.num_actions, (8,), env.dt, past=past)
    found = model.unrolled(window.bodies[0], window.targets, window.before, window.context)
    before = torch.cat((window.targets[1], window.targets[0]), dim=-1)
    torch.testing.assert_close(found[2], model(found[1], window.targets[2], before, window.context))


def test_a_push_breaks_a_window() -> None:
    task = EnvConfig(num_worlds=8, threads=1, randomisation=Randomisation(push=1.0, push_interval=0.1))
    env = env_of(task)
    pushed, push = [], env.engine.push
    env.engine.push = lambda velocity: (pushed.append(velocity.any(-1)), push(velocity))[1]  # type: ignore[method-assign]
    memory = Memory(1, torch.zeros(8, 0), env.num_actions)
    collect, some = Collector(env, memory, 0.0), 0
    for _ in range(30):
        pushed.clear()
        collect(lambda seen: torch.zeros(len(seen), env.num_actions))
        hit = pushed[0] if pushed else torch.zeros(8, dtype=torch.bool)
        assert torch.equal(env.pushes.pushed, hit)
        assert torch.equal(memory.broken[0], hit | (env.episode_length_buf == 0))
        some += int(hit.sum())
    assert some > 0
