"""The value beyond the horizon: what it learns, and what gradient it gives the policy."""

import torch
from rsl_rl.models import MLPModel
from tensordict import TensorDict

from bumblebee.learning.policy import model_config
from bumblebee.learning.world_model.critic import Critic, error, objective, targets
from bumblebee.learning.world_model.imagination import Rollout

GAMMA, H = 0.9, 4


def rollout(reward: torch.Tensor, lost: torch.Tensor | None = None, left: int = 100) -> Rollout:
    steps, robots = reward.shape
    lost = torch.zeros(steps, robots, dtype=torch.bool) if lost is None else lost
    return Rollout.of(torch.zeros(steps, robots, 2), torch.zeros(robots, 2), reward, lost, torch.full((robots,), left))


def lost_at(step: int) -> torch.Tensor:
    lost = torch.zeros(H, 1, dtype=torch.bool)
    lost[step:] = True
    return lost


def test_with_lambda_of_one_the_target_is_the_discounted_sum_and_the_last_value():
    reward, values = torch.rand(H, 3), torch.rand(H + 1, 3)
    found = targets(rollout(reward), values, GAMMA, trace=1.0)
    discount = GAMMA ** torch.arange(H)[:, None]
    by_hand = (1 - GAMMA) * (discount * reward).sum(0) + GAMMA**H * values[-1]
    torch.testing.assert_close(found[0], by_hand)


def test_with_lambda_of_zero_the_target_looks_one_step_ahead():
    reward, values = torch.rand(H, 3), torch.rand(H + 1, 3)
    found = targets(rollout(reward), values, GAMMA, trace=0.0)
    torch.testing.assert_close(found, (1 - GAMMA) * reward + GAMMA * values[1:])


def test_a_steady_reward_is_its_own_value():
    found = targets(rollout(torch.full((H, 1), 2.5)), torch.full((H + 1, 1), 2.5), GAMMA, trace=0.5)
    torch.testing.assert_close(found, torch.full((H, 1), 2.5))


def test_nothing_follows_a_failure():
    ended = rollout(torch.ones(H, 1), lost_at(1))
    assert ended.alive[:, 0].tolist() == [True, True, False, False, False] and not ended.over.any()
    assert ended.reward[:, 0].tolist() == [1.0, 1.0, 0.0, 0.0]
    found = targets(ended, torch.full((H + 1, 1), 7.0), GAMMA, trace=0.5)
    torch.testing.assert_close(found[1], torch.tensor([1 - GAMMA]))
    assert found[0] < 7.0 * GAMMA, "to live is worth more"


def test_a_clips_end_is_no_failure():
    ended = rollout(torch.full((H, 1), 2.0), left=2)
    assert ended.over[:, 0].tolist() == [False, True, False, False]
    assert ended.alive[:, 0].tolist() == [True, True, False, False, False]
    found = targets(ended, torch.full((H + 1, 1), 2.0), GAMMA, trace=0.5)
    torch.testing.assert_close(found[:2], torch.full((2, 1), 2.0))


def test_a_failure_in_the_clips_last_step_is_a_failure():
    ended = rollout(torch.ones(H, 1), lost_at(1), left=2)
    assert not ended.over.any() and not ended.alive[2:].any()


def test_the_policys_gradient_leads_through_the_last_value_unless_the_robot_failed():
    last = torch.ones(2, requires_grad=True)
    lost = torch.zeros(H, 2, dtype=torch.bool)
    lost[2, 1] = True
    reward = torch.rand(H, 2, requires_grad=True)
    imagined = rollout(reward, lost)
    at_last, at_reward = torch.autograd.grad(objective(imagined, last, GAMMA), (last, reward))
    torch.testing.assert_close(at_last, torch.tensor([GAMMA**H / (1 - GAMMA) / H / 2, 0.0]))
    discount = GAMMA ** torch.arange(H) / H / 2
    torch.testing.assert_close(at_reward[:, 0], discount)
    torch.testing.assert_close(at_reward[:, 1], discount * torch.tensor([1.0, 1, 1, 0]))


def test_what_the_value_predicts_after_an_end_counts_for_nothing():
    values = torch.zeros(H, 1)
    values[2:] = 100.0
    assert error(rollout(torch.ones(H, 1), lost_at(1)), values, torch.zeros(H, 1)) == 0


def test_the_average_follows_the_network_slowly_and_a_new_value_gives_the_policy_no_gradient():
    critic, seen = Critic(2, 2, (8,)), torch.rand(5, 2, requires_grad=True)
    assert not torch.autograd.grad(critic.steady(seen).sum(), seen)[0].any()
    with torch.no_grad():
        critic.network[-1].bias.fill_(1.0)
    critic.follow(0.25)
    torch.testing.assert_close(critic.steady(seen), torch.full((5,), 0.25))
    torch.testing.assert_close(critic(seen), torch.ones(5))


def ppo_critic(entries: int) -> MLPModel:
    """An untrained critic as PPO has it, which knows the mean and the spread of what it sees."""
    seen = TensorDict({"critic": torch.zeros(1, entries)}, batch_size=[1])
    made = MLPModel(seen, {"critic": ["critic"]}, "critic", 1, **model_config((8, 4), None))
    made.obs_normalizer.update(3.0 + 2.0 * torch.randn(64, entries))
    return made.eval()


def test_ppo_values_a_state_as_the_value_does_whatever_it_sees_beside():
    critic, ppo, seen = Critic(3, 5, (8, 4)), ppo_critic(5), torch.randn(6, 5)
    torch.nn.init.normal_(critic.average[-1].weight)
    critic.normalizer.train().update(1.0 + torch.randn(64, 5))
    ppo.load_state_dict(critic.to_ppo(0.5))
    wanted = 0.5 * critic.steady(critic.normalised(seen[:, :3]))
    torch.testing.assert_close(ppo(TensorDict({"critic": seen}, batch_size=[6]))[:, 0], wanted)


def test_the_value_begins_as_a_critic_of_ppo_for_which_all_beside_is_usual():
    critic, ppo, seen = Critic(3, 5, (8, 4)), ppo_critic(5), torch.randn(6, 5)
    critic.from_ppo(ppo.state_dict(), 0.5)
    seen[:, 3:] = ppo.obs_normalizer.mean[3:]
    valued = critic.normalised(seen[:, :3])
    wanted = ppo(TensorDict({"critic": seen}, batch_size=[6]))[:, 0] / 0.5
    torch.testing.assert_close(critic.steady(valued), wanted)
    torch.testing.assert_close(critic(valued), wanted)
    again = Critic(3, 5, (8, 4))
    again.from_ppo(critic.to_ppo(0.5), 0.5)
    torch.testing.assert_close(again(again.normalised(seen[:, :3])), wanted)
