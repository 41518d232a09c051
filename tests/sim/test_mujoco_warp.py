"""The GPU engine against MuJoCo: equal trajectories, rewards and observations; resets, overflows, bad input.

Without `mujoco_warp` all of this is skipped; without a GPU it runs on Warp's CPU device, and what only a GPU has is
skipped and listed.
"""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
import torch

pytest.importorskip("mujoco_warp", reason="the extra `gpu` is not installed")

from bumblebee.robot.facts import joint_names, stand_pose
from bumblebee.robot.model import build_spec
from bumblebee.sim.effects import add_to_spec, runtime_hooks, single
from bumblebee.sim.mujoco_cpu import MujocoCpu
from bumblebee.sim.mujoco_warp import MujocoWarp
from bumblebee.sim.sensors import add_foot_sensors, load_model
from bumblebee.tracking.config import EnvConfig, Randomisation
from bumblebee.tracking.env import TrackingEnv
from bumblebee.tracking.sampling.library import MotionLibrary
from bumblebee.tracking.worlds.randomisation import randomise_worlds
from tests.tracking.clips import waving

HAS_GPU = torch.cuda.is_available()
GPU = pytest.param("cuda", marks=[pytest.mark.gpu, pytest.mark.skipif(not HAS_GPU, reason="no NVIDIA GPU")])
STAND = torch.tensor(stand_pose(), dtype=torch.float32)
WORLDS, STEPS = 4, 20
QUIET = Randomisation(friction=(1.0, 1.0), gains=0.0, mass=0.0, push=0.0)
EFFECTS = [
    single("coulomb_friction", "left_knee_joint", 2.0),
    single("viscous_friction", "right_hip_pitch_joint", 1.5),
    single("armature", "left_elbow_joint", 0.02),
    single("motor_strength", "right_knee_joint", 0.8),
    single("command_delay", "left_ankle_pitch_joint", 0.012),
    single("encoder_offset", "waist_yaw_joint", 0.05),
    single("link_mass", "torso_link", 12.0),
    single("coupled_friction", "left_ankle_roll_joint", 0.5, 0.3, 1.0),
    single("coupled_damping", "right_ankle_roll_joint", 0.4, -0.8),
    single("coupled_armature", "left_hip_roll_joint", 0.02, 0.9),
]


@pytest.fixture(scope="module", params=["cpu", GPU])
def device(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return converged(load_model())


def converged(robot: mujoco.MjModel) -> mujoco.MjModel:
    """With solver iterations to spare: cut short, two solvers stop at two places."""
    robot.opt.iterations, robot.opt.ls_iterations = 50, 50
    return robot


def targets(step: int, device: str = "cpu") -> torch.Tensor:
    """A slow swing of all joints by up to 0.2 rad, another phase in each world."""
    phase = torch.arange(WORLDS)[:, None] + torch.arange(23)[None] / 3
    return (STAND + 0.2 * torch.sin(2 * torch.pi * step / 40 + phase)).to(device)


def started(engine: MujocoCpu | MujocoWarp) -> None:
    """All worlds at the stand, 1 cm above the floor, with a little speed."""
    generator = torch.Generator().manual_seed(0)
    qpos = torch.tensor(engine.model.key_qpos[0], dtype=torch.float32).repeat(WORLDS, 1)
    qpos[:, 2] += 0.01
    qvel = 0.2 * torch.randn(WORLDS, engine.model.nv, generator=generator)
    where = engine.device
    rows = torch.ones(WORLDS, dtype=torch.bool, device=where)
    engine.reset(rows, qpos.to(where), qvel.to(where), STAND.repeat(WORLDS, 1).to(where))
    engine.settle()


def compare(plain: MujocoCpu, warp: MujocoWarp, device: str) -> None:
    """20 control steps side by side: float32 and another contact solver's order cost at most these differences."""
    started(plain)
    started(warp)
    for step in range(STEPS):
        plain.step(targets(step))
        warp.step(targets(step, device))
        a, b = plain.state(), warp.state()
        for name, tolerance in (
            ("root_pos_w", 2e-3),  # m
            ("root_quat_w", 2e-3),
            ("joint_pos", 5e-3),  # rad
            ("key_pos_w", 4e-3),  # m
            ("root_lin_vel_b", 0.03),  # m/s
            ("joint_vel", 0.3),  # rad/s
        ):
            x, y = getattr(a, name), getattr(b, name).cpu()
            torch.testing.assert_close(x, y, atol=tolerance, rtol=0, msg=lambda m, n=name, s=step: f"{n}, {s}: {m}")
        torch.testing.assert_close(plain.torque(), warp.torque().cpu(), atol=3.0, rtol=0.05)  # N m
        assert not warp.unstable().any()
    warp.check()
    weight = float(plain.model.body_mass.sum() * 9.81)
    forces = plain.foot_force_w(), warp.foot_force_w().cpu()
    torch.testing.assert_close(*forces, atol=0.1 * weight, rtol=0)
    assert forces[0][..., 2].sum(1).max() > 0.3 * weight
    torch.testing.assert_close(plain.foot_quat_w(), warp.foot_quat_w().cpu(), atol=5e-3, rtol=0)


def test_both_engines_move_alike(model: mujoco.MjModel, device: str) -> None:
    """From equal states, under equal commands, for 20 control steps of 4 physics steps."""
    compare(MujocoCpu(model, WORLDS, threads=1), MujocoWarp(model, WORLDS, device=device), device)


def test_both_engines_have_the_same_effects(device: str) -> None:
    """Dry and viscous friction, rotor inertia, weak motor, delay, encoder offset and mass of effects.yaml."""
    spec = build_spec()
    add_to_spec(spec, EFFECTS)
    add_foot_sensors(spec)
    robot = converged(spec.compile())
    hooks = runtime_hooks(EFFECTS, robot)
    plain = MujocoCpu(robot, WORLDS, threads=1, hooks=hooks)
    warp = MujocoWarp(robot, WORLDS, hooks=hooks, device=device)
    compare(plain, warp, device)
    a, b = plain.state().read_key_pos_w, warp.state().read_key_pos_w
    assert a is not None and b is not None
    torch.testing.assert_close(a, b.cpu(), atol=4e-3, rtol=0)
    waist = joint_names().index("waist_yaw_joint")
    true = warp.state_dict()["qpos"][:, 7 + waist]
    torch.testing.assert_close(warp.state().joint_pos[:, waist].cpu(), true + 0.05)


def test_worlds_that_differ_differ_alike(model: mujoco.MjModel, device: str) -> None:
    """Friction, gains, strengths, dry friction and masses of each world are the same in both engines."""
    spread = Randomisation(friction=(0.5, 1.5), gains=0.2, strength=0.2, mass=0.2, frictionloss=1.0)
    plain, warp = MujocoCpu(model, WORLDS, threads=1), MujocoWarp(model, WORLDS, device=device)
    for engine in (plain, warp):
        randomise_worlds(engine, spread, seed=1)
    compare(plain, warp, device)


def test_rewards_and_observations_are_equal(device: str) -> None:
    """The whole task on both engines: what the policy sees, what the critic sees, what a step earns."""
    config = EnvConfig(num_worlds=WORLDS, reset_noise=0.0, observation_noise=0.0, start_share=1.0, randomisation=QUIET)
    robot = converged(load_model(physics_hz=200))
    clips = [waving("a", 60), waving("b", 90)]
    envs = [
        TrackingEnv(MotionLibrary(clips, config.ahead, device=engine.device), engine, config, share)
        for share, engine in (
            (0, MujocoCpu(robot, WORLDS, threads=1)),
            (0, MujocoWarp(robot, WORLDS, device=device)),
        )
    ]
    if device == "cuda":  # another generator: put both on the same clips
        envs[1].load_state_dict({**envs[1].state_dict(), "clip": envs[0].clip, "frame": torch.zeros(WORLDS)})
    assert torch.equal(envs[0].clip, envs[1].clip.cpu())
    generator = torch.Generator().manual_seed(2)
    for _ in range(STEPS):
        action = 0.3 * torch.randn(WORLDS, 23, generator=generator)
        (seen, reward, done, _), (seen_w, reward_w, done_w, _) = (env.step(action.to(env.device)) for env in envs)
        torch.testing.assert_close(reward, reward_w.cpu(), atol=2e-3, rtol=0)
        torch.testing.assert_close(seen["policy"], seen_w["policy"].cpu(), atol=0.5, rtol=0)
        assert (seen["policy"] - seen_w["policy"].cpu()).abs().mean() < 0.01
        assert (seen["critic"] - seen_w["critic"].cpu()).abs().mean() < 0.01
        assert not done.any() and not done_w.any()


def test_a_reset_touches_only_the_chosen_worlds(model: mujoco.MjModel, device: str) -> None:
    """By mask and by index alike; a world that was no number is healed and reported until then."""
    engine = MujocoWarp(model, WORLDS, device=device)
    started(engine)
    for step in range(3):
        engine.step(targets(step, device))
    before = engine.state_dict()
    broken = {**before, "qvel": before["qvel"].clone()}
    broken["qvel"][1, 0] = float("nan")
    for chosen in (torch.tensor([1]), torch.tensor([False, True, False, False])):
        engine.load_state_dict(broken)
        engine.step(targets(3, device))
        assert engine.unstable().tolist() == [False, True, False, False]
        held = engine.state_dict()
        qpos = torch.tensor(model.key_qpos[0], dtype=torch.float32, device=device).repeat(WORLDS, 1)
        values = (qpos, torch.zeros(WORLDS, model.nv, device=device), STAND.repeat(WORLDS, 1).to(device))
        some = values if chosen.dtype == torch.bool else tuple(value[1:2] for value in values)
        engine.reset(chosen.to(device), *some)
        engine.settle()
        others = [0, 2, 3]
        torch.testing.assert_close(engine.state_dict()["qpos"][others], held["qpos"][others], rtol=0, atol=0)
        torch.testing.assert_close(engine.state().root_pos_w[1].cpu(), qpos[1, :3].cpu())
        for step in range(3):
            engine.step(targets(step, device))
        assert not engine.unstable().any()
        assert torch.isfinite(engine.state().key_pos_w).all()


def test_a_saved_world_goes_on_as_if_nothing_had_happened(model: mujoco.MjModel, device: str) -> None:
    """Saving and loading between two steps leaves the trajectory within rounding."""
    first, second = (MujocoWarp(model, WORLDS, device=device) for _ in range(2))
    started(first)
    for step in range(4):
        first.step(targets(step, device))
    second.load_state_dict(first.state_dict())
    for step in range(4, 8):
        first.step(targets(step, device))
        second.step(targets(step, device))
    torch.testing.assert_close(first.state().joint_pos, second.state().joint_pos, atol=1e-5, rtol=0)


@pytest.mark.gpu
@pytest.mark.skipif(not HAS_GPU, reason="no NVIDIA GPU")
def test_recorded_and_eager_steps_are_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    """The environment with its graphs and without: the same rewards and observations from the same states."""
    from bumblebee.sim import cuda_graph

    config = EnvConfig(num_worlds=64, episode_seconds=0.2)
    robot = load_model(physics_hz=200)

    def rollout(eager_calls: int) -> torch.Tensor:
        monkeypatch.setattr(cuda_graph, "_EAGER_CALLS", eager_calls)
        engine = MujocoWarp(robot, 64)
        env = TrackingEnv(MotionLibrary([waving("a", 60), waving("b", 90)], device="cuda"), engine, config, 3)
        generator = torch.Generator("cuda").manual_seed(0)
        rows = []
        for _ in range(25):
            seen, reward, done, _ = env.step(0.3 * torch.randn(64, 23, generator=generator, device="cuda"))
            rows.append(torch.cat([seen["critic"][:, :9], reward[:, None], done[:, None].float()], 1))
        return torch.stack(rows)

    recorded, eager = rollout(2), rollout(1000)
    torch.testing.assert_close(recorded[:4], eager[:4], atol=1e-2, rtol=0)  # before the order of sums has spread
    assert (recorded - eager).abs().mean() < 1e-3
    assert torch.equal(recorded[..., -1], eager[..., -1])  # the ends of episodes, those of 0.2 s included


def test_the_environment_restarts_by_mask(device: str) -> None:
    """Episodes cut after 0.1 s begin anew in every world, with finite observations, again and again."""
    config = replace(EnvConfig(), num_worlds=WORLDS, episode_seconds=0.1, reset_noise=0.5)
    engine = MujocoWarp(load_model(physics_hz=100), WORLDS, device=device)
    env = TrackingEnv(MotionLibrary([waving("a", 60), waving("b", 90)], device=engine.device), engine, config)
    dones = np.zeros(WORLDS)
    for _ in range(12):
        seen, _, done, _ = env.step(torch.zeros(WORLDS, 23, device=engine.device))
        dones += done.cpu().numpy()
        assert torch.isfinite(seen["critic"]).all()
        assert (env.episode_length_buf[done] == 0).all() and (env.episode_length_buf[~done] > 0).all()
    assert (dones >= 2).all()
