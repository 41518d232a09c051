"""The task is one and the same in the simulator and in imagination."""

from dataclasses import replace

import pytest
import torch
from torch._dynamo.utils import counters

from bumblebee.learning.policy import new_actor, shape_of
from bumblebee.learning.world_model.body import packed
from bumblebee.learning.world_model.collector import Collector
from bumblebee.learning.world_model.dynamics import Dynamics
from bumblebee.learning.world_model.imagination import Imagination
from bumblebee.learning.world_model.memory import Memory, Starts
from bumblebee.motion.embedded import EmbeddedConfig, make_library
from bumblebee.robot.facts import KEY_BODIES
from bumblebee.sim.effects import single
from bumblebee.sim.engine_choice import make_engine
from bumblebee.tracking.config import EnvConfig, ObservationConfig, Randomisation, SensorConfig
from bumblebee.tracking.env import TrackingEnv
from bumblebee.tracking.mirror import augmentation
from bumblebee.tracking.model import task_model
from bumblebee.tracking.observing.terms import see
from bumblebee.tracking.sampling.library import MotionLibrary
from tests.learning.tiny import env_of
from tests.sim.test_effect_engine import engine_with

WORLDS, STEPS = 8, 60
NEITHER_KNEE = [i for i, name in enumerate(KEY_BODIES) if not name.startswith(("left_knee", "left_ankle"))]
"""Key bodies that a spring in the left knee does not carry: of these encoders tell the place."""


CONFIG = EnvConfig(
    num_worlds=WORLDS, threads=1, observation_noise=0.0, randomisation=Randomisation(push=0.0, gains=0.0)
)


@pytest.fixture(scope="module")
def env() -> TrackingEnv:
    engine = make_engine("mujoco", task_model(CONFIG), WORLDS, 1)
    return TrackingEnv(MotionLibrary(make_library(EmbeddedConfig(limit=5)), CONFIG.ahead), engine, CONFIG, seed=3)


def test_a_policy_of_imu_and_encoders_sees_the_same_in_both_and_its_critic_the_state() -> None:
    """Over whole episodes; the critic's further terms are those of a policy that sees them, and mirrored like them."""
    env, full = env_of(replace(CONFIG, observation=ObservationConfig(("imu",)), critic=("demo",))), env_of(CONFIG)
    imagination, generator, ended = Imagination(env, horizon=1), torch.Generator().manual_seed(0), 0
    for _ in range(STEPS):
        (state, ref), last = env.now, env._action
        shown = see(imagination.terms, imagination.state(packed(state))[0], ref, last)
        torch.testing.assert_close(shown, env.groups["policy"].exact, atol=1e-4, rtol=1e-4)
        seen, other = env.get_observations(), full.get_observations()
        assert torch.equal(seen["critic"][:, shown.shape[1] :], other["critic"])
        action = 0.5 * torch.randn(WORLDS, env.num_actions, generator=generator)
        done = env.step(action)[2]
        assert torch.equal(done, full.step(action)[2])
        ended += int(done.sum())
    assert ended > 0, "some episodes must end for this to say anything"
    both, _ = augmentation(env)(env, seen, None)
    mirrored, _ = augmentation(full)(full, other, None)
    assert both is not None and mirrored is not None
    assert torch.equal(both["critic"][:, shown.shape[1] :], mirrored["critic"])


def test_observation_reward_and_end_are_those_of_the_environment_over_whole_episodes(env: TrackingEnv) -> None:
    """With the simulator's own next states, torques and contact forces, everything is equal but for rounding."""
    imagination = Imagination(env, horizon=1)
    before = torch.zeros(2, WORLDS, env.num_actions)  # the last action and the one before it
    generator, compared, ended = torch.Generator().manual_seed(0), 0, 0
    for _ in range(STEPS):
        state, ref = env.now
        seen, _ = imagination.state(packed(state))
        shown = see(imagination.terms, seen, ref, before[0])
        torch.testing.assert_close(shown, env.groups["policy"].exact, atol=1e-4, rtol=1e-4)
        action = 0.5 * torch.randn(WORLDS, env.num_actions, generator=generator)
        target = imagination.targets(ref, action)
        made: dict[str, torch.Tensor] = {}
        original = env._earned

        def watched(outcome, made=made, original=original):
            made.update(after=packed(outcome.state), torque=outcome.torque, force=outcome.foot_force_w)
            return original(outcome)

        env._earned = watched
        _, reward, done, extras = env.step(action)
        env._earned = original
        step = imagination.step(state, made["after"], target, (action, *before), ref)
        for name, value in (("torque", made["torque"]), ("foot_force_w", made["force"])):
            object.__setattr__(step, name, value)
        torch.testing.assert_close(env.reward(step), reward, atol=1e-5, rtol=1e-4)
        lost = done & (extras["time_outs"] == 0)
        assert torch.equal(imagination.lost(step), lost)
        before = torch.stack((action, before[0])).masked_fill(done[None, :, None], 0.0)
        compared, ended = compared + WORLDS, ended + int(lost.sum())
    assert compared == STEPS * WORLDS and ended > 0, "some episodes must end for this to say anything"


def test_the_reward_has_gradients_with_respect_to_the_state_also_at_the_reference(env: TrackingEnv) -> None:
    imagination = Imagination(env, horizon=1)
    frames = torch.zeros(WORLDS, dtype=torch.long)
    ref = imagination.references(torch.arange(WORLDS) % len(env.library), frames)[0]
    still = torch.zeros(WORLDS, env.num_actions)
    parts = (ref.root_pos_w, ref.root_quat_w, torch.zeros(WORLDS, 6), ref.joint_pos, ref.joint_vel)
    body = torch.cat(parts, dim=-1).requires_grad_()
    state, _ = imagination.state(body.detach())
    step = imagination.step(state, body, imagination.targets(ref, still), (still, still, still), ref)
    (gradient,) = torch.autograd.grad(env.reward(step).sum(), body)
    assert torch.isfinite(gradient).all() and gradient.abs().sum() > 0


@pytest.mark.parametrize("encoder", [0.0, 1.0])
def test_key_bodies_and_servos_are_the_robots_own_where_its_corrected_model_has_a_hinge_more(encoder: float) -> None:
    """A spring in the left knee; joints after it keep their places, and all of them their gains."""
    config = replace(CONFIG, sensors=SensorConfig(encoder_offset=0.02))
    engine = engine_with(single("series_elasticity", "left_knee_joint", 200.0, encoder), worlds=WORLDS)
    env = TrackingEnv(MotionLibrary(make_library(EmbeddedConfig(limit=2)), config.ahead), engine, config, seed=3)
    imagination, state = Imagination(env, horizon=1), env.now[0]
    assert engine.model.njnt == 25
    assert (imagination._kp > 0).all() and len(imagination._kp) == env.num_actions
    seen = imagination.state(packed(state))[0].key_pos_w
    torch.testing.assert_close(seen[:, NEITHER_KNEE], state.key_pos_w[:, NEITHER_KNEE], atol=1e-4, rtol=0)
    assert env.errors is not None and env.errors.now.shape == (WORLDS, env.num_actions + 6)


def test_servos_torques_are_those_of_the_engine_where_it_holds_still(env: TrackingEnv) -> None:
    imagination = Imagination(env, horizon=1)
    state, ref = env.now
    target = imagination.targets(ref, torch.zeros(WORLDS, env.num_actions))
    step = imagination.step(state, packed(state), target, (target, target, target), ref)
    model = env.engine.model
    by_hand = model.actuator_gainprm[:, 0] * (target - state.joint_pos).numpy()
    by_hand += model.actuator_biasprm[:, 2] * state.joint_vel.numpy()
    limit = model.actuator_forcerange[:, 1]
    torch.testing.assert_close(step.torque, torch.tensor(by_hand.clip(-limit, limit), dtype=torch.float32))


def test_a_rollout_gives_the_policy_gradients_through_what_it_sees_last_and_traces_as_one_graph(
    env: TrackingEnv,
) -> None:
    torch.manual_seed(0)
    memory = Memory(2, torch.zeros(WORLDS, 0), env.num_actions)
    actor = new_actor(shape_of(env, (16,)))
    collect = Collector(env, memory, 0.1)
    for _ in range(2):
        collect(lambda seen: actor({"policy": seen}))
    model, starts = Dynamics(env.num_actions, (16,), env.dt), memory.starts(4)
    imagination, weights, found = Imagination(env, horizon=3), list(actor.mlp.parameters()), []
    graphs = counters["stats"]["unique_graphs"]
    for backend in (None, "aot_eager"):
        if backend is not None:
            imagination._advanced = torch.compile(imagination._advance, backend=backend, fullgraph=True, dynamic=False)
        rollout = imagination.rollout(lambda seen: actor({"policy": seen}), model, starts)
        found.append((rollout.seen, *torch.autograd.grad(rollout.after.sum() + rollout.reward.sum(), weights)))
    assert rollout.seen.shape == (3, 4, actor.obs_dim) and rollout.reward.shape == (3, 4)
    assert all(torch.isfinite(gradient).all() and gradient.any() for gradient in found[0][1:])
    torch.testing.assert_close(*found, rtol=1e-3, atol=1e-3)
    assert counters["stats"]["unique_graphs"] - graphs == 1, "the first step must look like the later ones"


def test_references_are_those_of_the_coming_steps_and_a_rollout_stops_at_the_clips_end(env: TrackingEnv) -> None:
    imagination = Imagination(env, horizon=3)
    first, *_, last = imagination.references(env.clip, env.frame)
    torch.testing.assert_close(first.joint_pos, env.now[1].joint_pos)
    torch.testing.assert_close(last.key_pos_w, env.library.frames(env.clip, (env.frame + 4) * env.dt).key_pos_w)
    clip = torch.arange(WORLDS) % len(env.library)
    frame = env.library.length[clip] - 3  # two steps lead to the last frame
    ref, still = env.library.frames(clip, frame * env.dt), torch.zeros(WORLDS, env.num_actions)
    body = torch.cat((ref.root_pos_w, ref.root_quat_w, torch.zeros(WORLDS, 6), ref.joint_pos, 0 * still), dim=-1)
    starts = Starts(body, ref.hold_pos, still, still.clone(), clip, frame, torch.zeros(WORLDS, 0))
    model = Dynamics(env.num_actions, (16,), env.dt)
    with torch.no_grad():
        model.layers[-1].weight.zero_()  # it stands still
        rollout = imagination.rollout(lambda seen: torch.zeros(len(seen), env.num_actions), model, starts)
    assert rollout.alive[:2].all() and rollout.over[1].all()
    assert not rollout.alive[2:].any() and rollout.over.sum() == WORLDS and not rollout.reward[2].any()


def test_the_imagined_policy_sees_through_the_environments_sensors() -> None:
    """As noisy as there; the value sees what is true."""
    task = EnvConfig(num_worlds=4, threads=1)
    noisy = env_of(task)
    memory, shown = Memory(2, torch.zeros(4, 0), noisy.num_actions), []
    for _ in range(2):
        Collector(noisy, memory, 0.0)(lambda seen: torch.zeros(len(seen), noisy.num_actions))

    def act(seen: torch.Tensor) -> torch.Tensor:
        shown.append(seen)
        return torch.zeros(len(seen), noisy.num_actions)

    rollout = Imagination(noisy, horizon=2).rollout(
        act, Dynamics(noisy.num_actions, (16,), noisy.dt), memory.starts(64)
    )
    levels = noisy.groups["policy"].levels
    error = (torch.stack(shown) - rollout.seen).abs().amax((0, 1))
    assert (error <= levels + 1e-5).all() and (error >= 0.8 * levels - 1e-5).all()


def test_the_value_sees_the_environments_terms_for_the_critic_and_the_policy_does_not() -> None:
    task = EnvConfig(num_worlds=4, threads=1, observation=ObservationConfig(terms=("imu",)), critic=("demo",))
    own = env_of(task)
    imagination, shown = Imagination(own, horizon=2), []
    memory = Memory(2, torch.zeros(4, 0), own.num_actions)
    for _ in range(2):
        seen = Collector(own, memory, 0.0)(lambda seen: torch.zeros(len(seen), own.num_actions))
    assert imagination.value_size > seen["policy"].shape[1]

    def act(seen: torch.Tensor) -> torch.Tensor:
        shown.append(seen)
        return torch.zeros(len(seen), own.num_actions)

    with torch.no_grad():
        rollout = imagination.rollout(act, Dynamics(own.num_actions, (16,), own.dt), memory.starts(4))
    assert rollout.seen.shape == (2, 4, imagination.value_size) == (2, *rollout.after.shape)
    assert shown[0].shape == seen["policy"].shape
    state, ref = own.now
    exact = see(imagination.terms, state, ref, torch.zeros(4, own.num_actions))
    valued = imagination._valued(exact, state, ref, torch.zeros(4, own.num_actions))
    torch.testing.assert_close(valued, own.get_observations()["critic"][:, : imagination.value_size])
