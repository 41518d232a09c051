"""mjlab's G1 tracking task, timed: a script for the Python environment of mjlab 1.6.0, which imports nothing of ours.

    python mjlab_loop.py MOTION.npz WORLDS SECONDS DEVICE

MOTION has fps, root_pos (T, 3) [m], root_quat (T, 4) wxyz, joint_names and joint_pos (T, J) [rad]; joints of mjlab's G1
that it does not name stay at zero. The last line of the output is JSON: control steps a second of the environment
under random actions, frames a second of the PPO loop as `mjlab.scripts.train` runs it, and the versions.
"""

import contextlib
import io
import json
import sys
import tempfile
import time
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path

import mujoco
import numpy as np
import torch
from mjlab.asset_zoo.robots.unitree_g1.g1_constants import get_spec
from mjlab.envs import ManagerBasedRlEnv
from mjlab.rl import MjlabOnPolicyRunner, RslRlVecEnvWrapper
from mjlab.tasks.tracking.config.g1.env_cfgs import unitree_g1_flat_tracking_env_cfg
from mjlab.tasks.tracking.config.g1.rl_cfg import unitree_g1_tracking_ppo_runner_cfg
from mjlab.utils.torch import configure_torch_backends

ROUND, ACTION = 25, 0.3


def convert(source, target):
    """Write the motion in mjlab's layout: joints and all bodies by forward kinematics of mjlab's own model."""
    given = np.load(source)
    model = get_spec().compile()
    data = mujoco.MjData(model)
    qpos = np.zeros((len(given["root_pos"]), model.nq))
    qpos[:, :3], qpos[:, 3:7] = given["root_pos"], given["root_quat"]
    for column, name in enumerate(given["joint_names"]):
        qpos[:, model.joint(str(name)).qposadr[0]] = given["joint_pos"][:, column]
    dt, last = 1.0 / float(given["fps"]), len(qpos) - 1
    qvel = np.zeros((len(qpos), model.nv))
    for i in range(len(qpos)):  # central differences
        before, after = max(i - 1, 0), min(i + 1, last)
        mujoco.mj_differentiatePos(model, qvel[i], (after - before) * dt, qpos[before], qpos[after])
    bodies = range(1, model.nbody)
    arrays = {name: np.zeros((len(qpos), model.nbody - 1, size)) for name, size in _BODY.items()}
    twist = np.zeros(6)
    for i in range(len(qpos)):
        data.qpos[:], data.qvel[:] = qpos[i], qvel[i]
        mujoco.mj_forward(model, data)
        arrays["body_pos_w"][i], arrays["body_quat_w"][i] = data.xpos[1:], data.xquat[1:]
        for body in bodies:
            mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY, body, twist, 0)
            arrays["body_ang_vel_w"][i, body - 1], arrays["body_lin_vel_w"][i, body - 1] = twist[:3], twist[3:]
    fps = np.array([float(given["fps"])])
    np.savez(target, fps=fps, joint_pos=qpos[:, 7:], joint_vel=qvel[:, 6:], **arrays)


_BODY = {"body_pos_w": 3, "body_quat_w": 4, "body_lin_vel_w": 3, "body_ang_vel_w": 3}


def timed(work, device):
    """Seconds that `work` takes."""
    if device != "cpu":
        torch.cuda.synchronize()
    began = time.perf_counter()
    work()
    if device != "cpu":
        torch.cuda.synchronize()
    return time.perf_counter() - began


@torch.inference_mode()
def environment_rate(env, seconds, device):
    """Control steps a second under random actions."""
    generator = torch.Generator(device).manual_seed(0)
    shape = (env.num_envs, env.num_actions)
    actions = [ACTION * torch.randn(shape, generator=generator, device=device) for _ in range(ROUND)]

    def turn():
        for action in actions:
            env.step(action)

    turn()
    spent, rounds = 0.0, 0
    while spent < seconds:
        spent, rounds = spent + timed(turn, device), rounds + 1
    return rounds * ROUND * env.num_envs / spent


def loop_rate(env, settings, seconds, device):
    """Frames a second of rsl_rl's `learn`, after three iterations that are not counted."""
    runner = MjlabOnPolicyRunner(env, asdict(settings), None, device)
    runner.learn(3, init_at_random_ep_len=True)
    one = timed(lambda: runner.learn(1), device)
    iterations = max(2, round(seconds / one))
    spent = timed(lambda: runner.learn(iterations), device)
    return iterations * settings.num_steps_per_env * env.num_envs / spent


def main():
    """Measure and print."""
    source, worlds, seconds, device = sys.argv[1:]
    configure_torch_backends()
    with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()):
        motion = Path(folder) / "motion.npz"
        convert(source, motion)
        config = unitree_g1_flat_tracking_env_cfg()
        config.scene.num_envs, config.seed = int(worlds), 0
        config.commands["motion"].motion_file = str(motion)
        env = RslRlVecEnvWrapper(ManagerBasedRlEnv(cfg=config, device=device))
        environment = environment_rate(env, float(seconds), device)
        loop = loop_rate(env, unitree_g1_tracking_ppo_runner_cfg(), float(seconds), device)
    versions = {name: version(wheel) for name, wheel in _WHEELS.items()}
    print(json.dumps({"environment": environment, "loop": loop, **versions}), flush=True)


_WHEELS = {
    "mjlab": "mjlab",
    "mujoco": "mujoco",
    "mujoco_warp": "mujoco-warp",
    "warp": "warp-lang",
    "rsl_rl": "rsl-rl-lib",
}

if __name__ == "__main__":
    main()
