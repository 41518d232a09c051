"""mjlab's G1 tracking task and PPO recipe on several motions: a script for the environment of mjlab 1.6.0.

    python -m benchmarks.mjlab.theirs join five.npz --out joined.npz
    python -m benchmarks.mjlab.theirs train joined.npz --minutes 8 --out results/mjlab
    python -m benchmarks.mjlab.theirs evaluate joined.npz --out results/mjlab

The task takes one motion file: here all motions joined. At the end of each motion it does what it does at the end of
its file, it draws a new start. Rewards, ends, noise, pushes, sampling and PPO are mjlab's. `evaluate` tries all actors
that were kept in its own simulator: from each motion's first frame, without noise, pushes and randomisation, lost where
the pelvis is .25 m too high or low or gravity along its z is off by .8.
"""

import argparse
import contextlib
import copy
import csv
import tempfile
import time
from dataclasses import asdict, fields
from pathlib import Path

import numpy as np
import torch

from benchmarks.mjlab.record import CURVE, write_followed
from benchmarks.throughput.mjlab_loop import convert
from mjlab.envs import ManagerBasedRlEnv
from mjlab.rl import MjlabOnPolicyRunner, RslRlVecEnvWrapper
from mjlab.tasks.tracking.config.g1.env_cfgs import unitree_g1_flat_tracking_env_cfg
from mjlab.tasks.tracking.config.g1.rl_cfg import unitree_g1_tracking_ppo_runner_cfg
from mjlab.tasks.tracking.mdp import MotionCommand, MotionCommandCfg
from mjlab.utils.lab_api.math import quat_apply_inverse
from mjlab.utils.torch import configure_torch_backends

BEGAN = time.time() - time.process_time()  # what was imported before counts too
HEIGHT, TILT = 0.25, 0.8


class Joined(MotionCommand):
    """The task's command on several motions in one file."""

    def __init__(self, cfg, env):
        super().__init__(cfg, env)
        with np.load(cfg.motion_file) as file:
            self.names = [str(name) for name in file["name"]]
            self.first, self.last = (torch.tensor(file[key], device=self.device) for key in ("first", "last"))

    def _update_command(self, env_ids=None):
        over = self.time_steps >= self.last[self.time_steps]
        if env_ids is not None:
            over &= torch.zeros_like(over).index_fill(0, env_ids, True)
        self.time_steps.copy_(torch.where(over, self.motion.time_step_total - 1, self.time_steps))
        super()._update_command(env_ids)


class Tried(Joined):
    """Each robot on a motion of its own, from the first frame."""

    def _uniform_sampling(self, env_ids):
        self.time_steps[env_ids] = self.first[env_ids % len(self.first)]


def started(config, command: type, worlds: int, options: argparse.Namespace):
    """Mjlab's environment with `command` on the motions, and its runner with its recipe."""

    class Config(MotionCommandCfg):
        def build(self, env):
            return command(self, env)

    own = config.commands["motion"]
    config.commands["motion"] = Config(**{field.name: getattr(own, field.name) for field in fields(own)})
    config.commands["motion"].motion_file = str(options.motions)
    config.scene.num_envs, config.seed = worlds, 0
    configure_torch_backends()
    env = RslRlVecEnvWrapper(ManagerBasedRlEnv(cfg=config, device=options.device))
    return env, MjlabOnPolicyRunner(env, asdict(unitree_g1_tracking_ppo_runner_cfg()), None, options.device)


def join(options: argparse.Namespace) -> None:
    """Write all motions in mjlab's layout, one behind the other, with where each begins and ends."""
    given, parts = dict(np.load(options.motions)), []
    frames, ends = given["frames"], np.cumsum(given["frames"])
    with tempfile.TemporaryDirectory() as folder:
        plain, made = Path(folder) / "plain.npz", Path(folder) / "made.npz"
        for begin, end in zip(ends - frames, ends, strict=True):
            arrays = {name: given[name][begin:end] for name in ("root_pos", "root_quat", "joint_pos")}
            np.savez(plain, fps=given["fps"], joint_names=given["joint_names"], **arrays)
            convert(plain, made)
            parts.append(dict(np.load(made)))
    joined = {key: np.concatenate([part[key] for part in parts]) for key in parts[0]} | {"fps": parts[0]["fps"]}
    about = {"name": given["name"], "first": ends - frames, "last": np.repeat(ends - 1, frames)}
    np.savez_compressed(options.out, **about, **joined)


def train(options: argparse.Namespace) -> None:
    """Train; `curve.csv`, and the actor every so often, named by training seconds and by those since the start."""
    env, runner = started(unitree_g1_flat_tracking_env_cfg(), Joined, options.worlds, options)
    each = runner.cfg["num_steps_per_env"] * env.num_envs
    options.out.mkdir(parents=True, exist_ok=True)
    iteration, kept, began, update = 0, 0.0, time.time(), runner.alg.update

    def told(*args, **kwargs):
        nonlocal iteration, kept
        losses = update(*args, **kwargs)
        iteration, seconds = iteration + 1, time.time() - began
        writer.writerow((iteration, iteration * each, round(seconds, 2), runner.alg.learning_rate))
        file.flush()
        started_s = time.time() - BEGAN
        if (over := started_s >= 60 * options.minutes) or seconds // options.every > kept:
            kept = seconds // options.every
            path = options.out / f"at-{seconds:.2f}-{started_s:.2f}.pt"
            torch.save(runner.alg.get_policy().state_dict(), path)
            print(f"{iteration} iterations, {iteration * each / 1e6:.1f} M steps, {seconds:.0f} s", flush=True)
        if over:
            raise TimeoutError
        return losses

    runner.alg.update = told
    with (options.out / CURVE).open("w", newline="") as file, contextlib.suppress(TimeoutError):
        writer = csv.writer(file)
        writer.writerow(("iteration", "frames", "seconds", "learning_rate"))
        runner.learn(10**6, init_at_random_ep_len=True)


@torch.no_grad()
def evaluate(options: argparse.Namespace) -> None:
    """Try all actors that were kept side by side, as many robots for each as there are motions; `followed.csv`."""
    paths = {tuple(map(float, path.stem.split("-")[1:])): path for path in options.out.glob("at-*.pt")}
    count = len(np.load(options.motions)["name"])
    config = unitree_g1_flat_tracking_env_cfg(play=True)
    motion, config.events, config.terminations = config.commands["motion"], {}, {}
    motion.sampling_mode, motion.joint_position_range = "uniform", (0.0, 0.0)
    env, runner = started(config, Tried, count * len(paths), options)
    command, robot = env.unwrapped.command_manager.get_term("motion"), env.unwrapped.scene["robot"].data
    actors = [copy.deepcopy(runner.get_inference_policy(options.device)) for _ in paths]
    for actor, path in zip(actors, paths.values(), strict=True):
        actor.load_state_dict(torch.load(path, map_location=options.device, weights_only=True))
    down = torch.tensor([0.0, 0.0, -1.0], device=options.device).expand(env.num_envs, 3)
    kept, running = torch.ones(2, env.num_envs, dtype=torch.bool, device=options.device)
    steps, length = torch.zeros(2, env.num_envs, device=options.device)
    pelvis, seen = command.body_indexes[0], env.get_observations()
    while running.any():
        frame, height, turn = command.time_steps.clone(), command.body_pos_w[:, 0, 2], command.body_quat_w[:, 0]
        acted = [actor(part) for actor, part in zip(actors, seen.split(count), strict=True)]
        seen = env.step(torch.cat(acted))[0]
        running &= command.time_steps > frame  # else it has begun anew, and what is seen now is the next start
        tilt = quat_apply_inverse(robot.body_link_quat_w[:, pelvis], down) - quat_apply_inverse(turn, down)
        high = (robot.body_link_pos_w[:, pelvis, 2] - height).abs() <= HEIGHT
        kept &= (high & (tilt[:, 2].abs() <= TILT)) | ~running
        steps, length = steps + (running & kept), length + running
    share, tried = (steps / length).tolist(), {}
    for row, (seconds, _) in enumerate(paths):
        results = zip(command.names, kept.tolist()[row * count :], share[row * count :], strict=False)
        tried[seconds] = {name: (followed, part) for name, followed, part in results}
    write_followed(options.out, "mjlab", dict(list(paths)), tried)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python -m benchmarks.mjlab.theirs", description=__doc__.splitlines()[0])
    parser.add_argument("work", choices=("join", "train", "evaluate"))
    parser.add_argument("motions", type=Path, help="for join the file of benchmarks.mjlab.motions, else that of join")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--minutes", type=float, default=8.0, help="until train ends, from the program's start")
    parser.add_argument("--every", type=float, default=15.0, help="seconds of training between actors that are kept")
    parser.add_argument("--worlds", type=int, default=4096)
    parser.add_argument("--device", default="cuda:0")
    given = parser.parse_args()
    globals()[given.work](given)
