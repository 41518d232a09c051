"""How much of the simulator's speed is left for learning: physics alone, environment, whole loop, side by side.

Run: python -m benchmarks.throughput [--worlds 512] [--threads 2] [--seconds 5]. The ratios are what counts; the same
physics (random actions around the reference) is measured in each row.
"""

import argparse
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import torch

from bumblebee.learning.config import PpoConfig
from bumblebee.learning.ppo import Trainer
from bumblebee.motion.embedded import EmbeddedConfig, make_library
from bumblebee.sim.mujoco_cpu import MujocoCpu
from bumblebee.sim.sensors import load_model
from bumblebee.tracking.config import EnvConfig
from bumblebee.tracking.env import TrackingEnv
from bumblebee.tracking.library import MotionLibrary


def rate(work: Callable[[], int], seconds: float) -> float:
    """Control steps a second of `work`, which returns how many it did."""
    work()
    began, done = time.perf_counter(), 0
    while time.perf_counter() - began < seconds:
        done += work()
    return done / (time.perf_counter() - began)


def make_env(config: EnvConfig, clips: list) -> TrackingEnv:
    """An environment of its own, so that the rows do not share states."""
    engine = MujocoCpu(load_model(physics_hz=config.physics_hz), config.num_worlds, threads=config.threads)
    return TrackingEnv(MotionLibrary(clips, config.ahead), engine, config)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--worlds", type=int, default=512)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--seconds", type=float, default=5.0)
    options = parser.parse_args()
    torch.set_num_threads(options.threads)
    clips = make_library(EmbeddedConfig(limit=7))
    print("physics   row          steps/s  of physics alone")
    for physics_hz in (200.0, 100.0):
        config = EnvConfig(num_worlds=options.worlds, threads=options.threads, physics_hz=physics_hz)
        env, only_env = make_env(config, clips), make_env(config, clips)
        n = config.num_worlds

        def physics(env: TrackingEnv = env, n: int = n) -> int:
            """The batch's steps alone, with the environment's restarts outside the clock."""
            env.engine.batch.step(nstep=env.engine.substeps)
            return n

        def act(env: TrackingEnv = only_env, n: int = n) -> int:
            env.step(0.5 * torch.randn(n, 23))
            return n

        ppo = PpoConfig()
        trainer = Trainer(make_env(config, clips), ppo, Path(tempfile.mkdtemp()))

        def loop(trainer: Trainer = trainer, steps: int = ppo.steps * n) -> int:
            trainer._iterate()
            return steps

        with torch.inference_mode():
            for _ in range(10):
                env.step(0.5 * torch.randn(n, 23))
            alone = rate(physics, options.seconds)
            whole = rate(act, options.seconds)
        rows = {"physics": alone, "environment": whole, "PPO loop": rate(loop, options.seconds)}
        for name, value in rows.items():
            print(f"{physics_hz:4.0f} Hz   {name:11s} {value:8.0f}  {value / alone:.2f}")


if __name__ == "__main__":
    main()
