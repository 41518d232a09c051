"""Cost of the paper's task beside the demo's: control steps a second of the environment, part by part.

    python -m benchmarks.task_cost --engine mujoco --worlds 64 --seconds 2
    python -m benchmarks.task_cost --engine mujoco_warp --worlds 4096 8192        # on a GPU

Each row changes one thing of the demo's task at 200 Hz, the last is the paper's whole. The rows take turns, so that
what else the machine does falls on all of them.
"""

import argparse
from dataclasses import replace

import numpy as np
import torch

from benchmarks.throughput.measure import timed
from bumblebee.learning.generalist.teacher_student import make_env
from bumblebee.motion.embedded import EmbeddedConfig, make_library
from bumblebee.tracking.config import EnvConfig, Randomisation
from bumblebee.tracking.env import TrackingEnv
from bumblebee.tracking.presets import PAPER_RANDOMISATION, PAPER_TASK, STUDENT, TEACHER

STEPS = 25  # control steps of a turn


def rows(engine: str, worlds: int) -> dict[str, EnvConfig]:
    """The tasks to compare, by name."""
    demo = EnvConfig(engine=engine, num_worlds=worlds, physics_hz=200.0)  # type: ignore[arg-type]
    late = replace(Randomisation(), delay=PAPER_RANDOMISATION.delay)
    paper = replace(PAPER_TASK, engine=engine, num_worlds=worlds)
    return {
        "demo": demo,
        "teacher's 5 steps": replace(demo, observation=TEACHER),
        "and student's 10": replace(demo, observation=TEACHER, student=STUDENT),
        "delays": replace(demo, randomisation=late),
        "half rough ground": replace(demo, terrain=PAPER_TASK.terrain),
        "paper, flat": replace(paper, terrain=demo.terrain),
        "paper": paper,
    }


@torch.inference_mode()
def turn(env: TrackingEnv, actions: torch.Tensor) -> float:
    """Seconds of `STEPS` control steps."""
    steps = iter(actions)
    return timed(lambda: env.step(next(steps)), env.device, STEPS)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--engine", choices=("mujoco", "mujoco_warp"), default="mujoco")
    parser.add_argument("--worlds", type=int, nargs="+", default=[512])
    parser.add_argument("--seconds", type=float, default=3.0, help="of each row")
    options = parser.parse_args()
    clips = make_library(EmbeddedConfig(limit=7))
    print("worlds  task                control steps/s  of demo")
    for worlds in options.worlds:
        envs = {name: make_env(clips, task) for name, task in rows(options.engine, worlds).items()}
        spent: dict[str, list[float]] = {name: [] for name in envs}
        actions = 0.3 * torch.randn(STEPS, worlds, 23, generator=torch.Generator().manual_seed(0))
        actions = actions.to(next(iter(envs.values())).device)
        for env in envs.values():
            turn(env, actions)  # kernels are loaded and graphs recorded
            turn(env, actions)
        while sum(spent["demo"]) < options.seconds:
            for name, env in envs.items():
                spent[name].append(turn(env, actions))
        for name, env in envs.items():
            env.engine.check()
            rate = STEPS * worlds / float(np.median(spent[name]))
            share = float(np.median(np.array(spent["demo"]) / np.array(spent[name])))
            print(f"{worlds:6d}  {name:18s} {rate:16.0f}  {share:7.2f}", flush=True)


if __name__ == "__main__":
    main()
