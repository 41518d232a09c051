"""The Gated Transformer-XL: its mathematics against a plain one, its memory, and rsl_rl's own algorithms around it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import onnxruntime
import pytest
import torch
from rsl_rl.algorithms import PPO, Distillation
from tensordict import TensorDict
from torch import Tensor

from bumblebee.errors import BadInput
from bumblebee.evaluation.untrained import export_untrained
from bumblebee.learning.export import export_policy
from bumblebee.learning.generalist.attention import GatedBlock, GruGate
from bumblebee.learning.generalist.transformer import TransformerConfig, TransformerModel
from bumblebee.learning.policy import Policy, Shape, load_policy, model_config, new_actor
from bumblebee.tracking.config import EnvConfig
from bumblebee.tracking.presets import STUDENT
from tests.learning.tiny import env_of

SMALL = TransformerConfig(embedding=12, heads=3, memory=4, feed_forward=8, head=(16,))
SHAPE = Shape(6, 6, 23, SMALL.head, (), transformer=SMALL)


def policy(shape: Shape = SHAPE) -> Policy:
    """Untrained, but with a normaliser that has seen something, gates half open and all biases set."""
    torch.manual_seed(0)
    actor = new_actor(shape).train()
    actor.update_normalization({"policy": 1 + 2 * torch.randn(200, shape.observation)})
    for name, tensor in actor.named_parameters():
        if "bias" in name:
            torch.nn.init.normal_(tensor, std=0.5)
    return Policy(actor, {}, shape)


def windows(seen: Tensor, begun: int, memory: int) -> tuple[Tensor, Tensor]:
    """Windows of one robot's observations (T, D) from step `begun` on: the last M + 1 steps, and which there are."""
    steps = torch.arange(len(seen))[:, None] - torch.arange(memory, -1, -1)
    return seen[steps.clamp(min=0)], steps >= begun


def plain_block(block: GatedBlock, tokens: Tensor) -> Tensor:
    """The block over a whole sequence (T, E), one query, key and head at a time, in double precision."""
    own, block = block.attention, block.double()
    normed, head = block.before_attention(tokens), tokens.shape[1] // own.heads
    query, key, value = own.query(normed), own.key(normed), own.value(normed)
    seen = torch.zeros_like(tokens)
    rates = 10_000.0 ** (-torch.arange(0, tokens.shape[1], 2) / tokens.shape[1])
    for i in range(len(tokens)):
        for h in range(own.heads):
            part, scores = slice(h * head, (h + 1) * head), []
            sees = range(max(0, i - own.memory), i + 1)
            for j in sees:
                angle = (i - j) * rates.double()
                place = own.place(torch.cat((angle.sin(), angle.cos())))
                content = (query[i, part] + own.content_bias[h]) @ key[j, part]
                scores.append((content + (query[i, part] + own.place_bias[h]) @ place[part]) / head**0.5)
            weight = torch.stack(scores).softmax(0)
            seen[i, part] = sum(w * value[j, part] for w, j in zip(weight, sees, strict=True))
    value = block.after_attention(tokens, torch.relu(own.out(seen)))
    made = block.narrow(torch.relu(block.widen(block.before_forward(value))))
    return block.after_forward(value, torch.relu(made))


@torch.no_grad()
def test_step_by_step_is_a_whole_sequence_seen_through_a_window() -> None:
    """With memory carried; in one batch as PPO has it; of windows as DAgger has it; and by the formulas, one by one."""
    own = policy()
    seen = torch.randn(15, 6)
    act = own.follower()
    stepped = torch.cat([act(row[None]) for row in seen])
    tokens = own.actor.embedding(own.actor.obs_normalizer(seen))
    block = own.actor.block
    trajectory = {"policy": seen[:, None]}
    together = own.actor(trajectory, masks=torch.ones(15, 1, dtype=torch.bool), hidden_state=None)[:, 0]
    of_windows = own.actor.mlp(own.actor.latent_of_windows(*windows(seen, 0, SMALL.memory)))
    torch.testing.assert_close(together, stepped)
    torch.testing.assert_close(of_windows, stepped)
    by_formula = own.actor.double().mlp(plain_block(block, tokens.double()))
    torch.testing.assert_close(by_formula.float(), stepped)


def test_a_gate_is_the_formula_and_begins_near_the_identity() -> None:
    torch.manual_seed(0)
    gate = GruGate(5, 2.0)
    old, new = torch.randn(3, 5), torch.randn(3, 5)
    (wr, wz, wg), (ur, uz), ug = gate.of_new.weight.chunk(3), gate.of_old.weight.chunk(2), gate.of_kept.weight
    r = torch.sigmoid(new @ wr.T + old @ ur.T)
    z = torch.sigmoid(new @ wz.T + old @ uz.T - 2.0)
    expected = (1 - z) * old + z * torch.tanh(new @ wg.T + (r * old) @ ug.T)
    torch.testing.assert_close(gate(old, new), expected)
    far = [(GruGate(5, bias)(old, new) - old).abs().mean() for bias in (0.0, 2.0, 8.0)]
    assert far[0] > 2 * far[1] and far[2] < 0.01


@torch.no_grad()
def test_nothing_from_before_a_reset_reaches_the_actions() -> None:
    """One of two robots is reset: it acts as one that begins, whatever it had seen, NaN included; the other goes on."""
    own = policy()
    before, after = torch.randn(7, 2, 6), torch.randn(6, 2, 6)
    before[2, 1] = torch.nan
    actor, undisturbed, fresh = own.actor, own.follower(), own.follower()
    for row in before:
        actor({"policy": row})
        undisturbed(row.nan_to_num())
    actor.reset(torch.tensor([0, 1], dtype=torch.uint8))
    for row in after:
        acted = actor({"policy": row})
        torch.testing.assert_close(acted[1:], fresh(row)[1:])
        torch.testing.assert_close(acted[:1], undisturbed(row)[:1])
    actor.reset()
    torch.testing.assert_close(actor({"policy": after[0]}), own(after[0]))


def test_no_gradient_reaches_what_is_remembered() -> None:
    own = policy().actor
    seen = torch.randn(2, SMALL.memory + 1, 6, requires_grad=True)
    known = torch.ones(2, SMALL.memory + 1, dtype=torch.bool)
    own.latent_of_windows(seen, known).sum().backward()
    assert seen.grad is not None
    assert not seen.grad[:, :-1].any() and seen.grad[:, -1].abs().min() > 0


def test_onnx_with_its_memory_acts_as_torch_for_two_robots_with_resets(tmp_path: Path) -> None:
    """The paper's sizes, 50 steps; the second robot starts anew at step 20."""
    own = policy(Shape(1070, 1070, 23, (128,), (), ("student",), 10, transformer=TransformerConfig()))
    export_policy(tmp_path, own)
    session = onnxruntime.InferenceSession(tmp_path / "policy.onnx", providers=["CPUExecutionProvider"])
    memory, held = own.actor.empty_memory(2), np.zeros((2, 10, 205), dtype=np.float32)
    for step in range(50):
        if step == 20:
            memory, held[1] = memory * torch.tensor([1.0, 0.0])[:, None, None], 0.0
        seen = 1 + 2 * torch.randn(2, 1070)
        wanted, memory = own.advance(seen, memory)
        actions, held = session.run(["actions", "memory_next"], {"obs": seen.numpy(), "memory": held})
        np.testing.assert_allclose(actions, wanted.numpy(), atol=1e-5)
        np.testing.assert_allclose(held, memory.numpy(), atol=1e-5)
    assert np.abs(actions).max() > 1e-2


@torch.no_grad()
def test_two_minutes_leave_nothing_but_the_last_steps() -> None:
    """6,000 steps of two robots. One sees the same all the time: memory and actions stand still once that is full. The
    other sees noise: who begins M steps before the end acts the same there, who begins later does not.
    """
    own, reach = policy(), SMALL.memory + 1
    seen = torch.randn(6000, 2, 6)
    seen[:, 0] = seen[0, 0]
    memory, actions = None, []
    for step, row in enumerate(seen):
        action, memory = own.advance(row, memory)
        actions.append(action)
        if step == reach - 1:
            full = memory[0].clone()
    assert torch.equal(memory[0], full) and memory.abs().max() < 20
    assert torch.equal(actions[reach][0], actions[-1][0])

    def end(start: int) -> Tensor:
        act = own.follower()
        return [act(row) for row in seen[start:]][-1][1]

    torch.testing.assert_close(end(6000 - reach), actions[-1][1])
    assert (end(6000 - reach + 1) - actions[-1][1]).abs().max() > 1e-4


def test_saved_and_loaded_it_acts_alike_and_old_files_have_no_memory(tmp_path: Path) -> None:
    own = policy()
    own.save(tmp_path)
    loaded = load_policy(tmp_path)
    seen = torch.randn(4, 6)
    assert loaded.shape == own.shape and torch.equal(loaded(seen), own(seen))
    mlp = replace(SHAPE, hidden=(8,), transformer=None)
    Policy(new_actor(mlp), {}, mlp).save(tmp_path)
    content = torch.load(tmp_path / "policy.pt", weights_only=True)
    del content["shape"]["transformer"]
    torch.save(content, tmp_path / "policy.pt")
    assert load_policy(tmp_path).shape.memory is None


@pytest.mark.parametrize("change", [{"embedding": 4092}, {"memory": 10**9}, {"heads": 5}, {"width": 3}])
def test_a_file_whose_shape_is_not_its_weights_is_refused_before_it_takes_memory(
    tmp_path: Path, change: dict[str, int]
) -> None:
    policy().save(tmp_path)
    content = torch.load(tmp_path / "policy.pt", weights_only=True)
    content["shape"]["transformer"] |= change
    torch.save(content, tmp_path / "policy.pt")
    with pytest.raises(BadInput, match="a checkpoint of a policy") as refused:
        load_policy(tmp_path)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(("change", "word"), [({"heads": 5}, "heads"), ({"embedding": 9, "heads": 3}, "even")])
def test_heads_that_do_not_divide_the_embedding_are_refused(change: dict[str, int], word: str) -> None:
    with pytest.raises(BadInput, match=word):
        TransformerConfig(**change)


def test_the_defaults_are_the_papers() -> None:
    own = TransformerConfig()
    assert (own.embedding, own.heads, own.memory, own.feed_forward, own.head) == (204, 6, 10, 128, (128,))
    assert (own.embedding // own.heads, own.memory_shape) == (34, (10, 205))


def test_an_untrained_one_of_the_same_shape_can_be_exported(tmp_path: Path) -> None:
    """Success before training is measured with other weights, finite actions, and a memory of the same shape."""
    (tmp_path / "trained").mkdir()
    export_policy(tmp_path / "trained", policy())
    export_untrained(tmp_path / "trained", tmp_path / "fresh")
    fed = {"obs": np.ones((2, 6), np.float32), "memory": np.zeros((2, 4, 13), np.float32)}
    sessions = [onnxruntime.InferenceSession(tmp_path / name / "policy.onnx") for name in ("trained", "fresh")]
    one, other = (session.run(["actions"], fed)[0] for session in sessions)
    assert np.isfinite(other).all() and not np.allclose(one, other)


SETTINGS = {"class_name": "bumblebee.learning.generalist.transformer:TransformerModel", **model_config((16,), 0.5)}
SETTINGS |= {"settings": {"embedding": 12, "heads": 3, "memory": 4, "feed_forward": 8}}


def test_rsl_rls_ppo_trains_it_by_its_name() -> None:
    """Two iterations with restarts inside; its own recomputation in batches gives the actions that were taken."""
    env = env_of(EnvConfig(num_worlds=4, threads=1, ahead=(), observation=STUDENT, episode_seconds=0.1))
    plain = {"class_name": "MLPModel", **model_config((16,), None)}
    settings = {
        "num_steps_per_env": 12,
        "obs_groups": {"actor": ["policy"], "critic": ["critic"]},
        "algorithm": {"class_name": "PPO", "rnd_cfg": None, "symmetry_cfg": None, "num_mini_batches": 1},
        "actor": SETTINGS,
        "critic": plain,
        "multi_gpu": None,
    }
    ppo = PPO.construct_algorithm(env.get_observations(), env, settings, env.device)
    assert isinstance(ppo.actor, TransformerModel)
    weights = [tensor.clone() for tensor in ppo.actor.parameters()]
    for _ in range(2):
        observations = env.get_observations()
        with torch.inference_mode():
            for _ in range(12):
                observations, *rest = env.step(ppo.act(observations))
                ppo.process_env_step(observations, *rest)
            ppo.compute_returns(observations)
        assert ppo.storage.dones.any()
        batch = next(iter(ppo.storage.recurrent_mini_batch_generator(1, 1)))
        with torch.no_grad():
            ppo.actor(
                batch.observations, masks=batch.masks, hidden_state=batch.hidden_states[0], stochastic_output=True
            )
        torch.testing.assert_close(ppo.actor.output_mean, batch.old_distribution_params[0], atol=1e-4, rtol=0)
        losses = ppo.update()
    assert np.isfinite(list(losses.values())).all()
    moved = [not torch.equal(*pair) for pair in zip(weights, ppo.actor.parameters(), strict=True)]
    assert sum(moved) >= len(moved) - 1


def test_rsl_rls_distillation_trains_it_by_its_name() -> None:
    torch.manual_seed(0)
    env = env_of(EnvConfig(num_worlds=4, threads=1, ahead=(), student=STUDENT, episode_seconds=0.1))
    settings = {
        "num_steps_per_env": 6,
        "obs_groups": {"student": ["student"], "teacher": ["policy"]},
        "algorithm": {"class_name": "Distillation", "num_learning_epochs": 4, "gradient_length": 6},
        "student": SETTINGS,
        "teacher": {"class_name": "MLPModel", **model_config((16,), 0.5)},
        "multi_gpu": None,
    }
    observations = env.get_observations()
    own = Distillation.construct_algorithm(observations, env, settings, env.device)
    torch.nn.init.normal_(own.teacher.mlp[-1].bias, std=0.5)
    losses = []
    for _ in range(8):
        with torch.inference_mode():
            for _ in range(6):
                observations, *rest = env.step(own.act(observations))
                own.process_env_step(observations, *rest)
        losses.append(own.update()["behavior"])
    assert isinstance(own.student, TransformerModel) and losses[-1] < losses[0]


def test_a_batch_holds_what_its_settings_say() -> None:
    """A mapping is held to the same ranges."""
    example = TensorDict({"policy": torch.zeros(1, 6)}, batch_size=[1])
    with pytest.raises(BadInput, match="heads"):
        TransformerModel(example, {"actor": ["policy"]}, "actor", 2, {"heads": 5}, **model_config((8,), 1.0))
