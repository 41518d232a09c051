"""How much of the simulator's speed is left for learning: physics alone, environment, whole loop, side by side.

    python -m benchmarks.throughput                                              # on two CPU threads
    python -m benchmarks.throughput --engine mujoco_warp --worlds 4096 8192      # on a GPU

Physics alone is the engine's step on the states that the environment has just reached, again and again within the same
run: half a second of the environment, half a second of physics from there, back. Actions are random around the
reference, so that robots fall and are reset. What counts are the ratios.
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
from bumblebee.sim.engines import make_engine
from bumblebee.sim.sensors import load_model
from bumblebee.tracking.config import EnvConfig
from bumblebee.tracking.env import TrackingEnv
from bumblebee.tracking.library import MotionLibrary

GOALS = {"mujoco": {"environment": 0.8}, "mujoco_warp": {"environment": 0.75}}
ROUND = 25  # control steps: short enough that robots without resets do not all lie on the floor


def make_env(config: EnvConfig, clips: list) -> TrackingEnv:
    """An environment of its own, so that the rows do not share states."""
    engine = make_engine(config.engine, load_model(physics_hz=config.physics_hz), config.num_worlds, config.threads)
    return TrackingEnv(MotionLibrary(clips, config.ahead, device=engine.device), engine, config)


def physics_step(env: TrackingEnv) -> Callable[[], None]:
    """One control period of the engine alone: no kinematics afterwards, no copies."""
    engine = env.engine
    if env.cfg.engine == "mujoco":
        return lambda: engine.batch.step(nstep=engine.substeps)
    import mujoco_warp
    import warp

    with warp.ScopedDevice(str(engine.device)), warp.ScopedCapture() as capture:
        for _ in range(engine.substeps):
            mujoco_warp.step(engine._model, engine._data)
    stream = warp.stream_from_torch(torch.cuda.current_stream())
    return lambda: warp.capture_launch(capture.graph, stream=stream)


def timed(work: Callable[[], object], device: str, times: int) -> float:
    """Seconds that `work` takes, `times` in a row."""
    if device != "cpu":
        torch.cuda.synchronize()
    began = time.perf_counter()
    for _ in range(times):
        work()
    if device != "cpu":
        torch.cuda.synchronize()
    return time.perf_counter() - began


@torch.inference_mode()
def physics_and_environment(env: TrackingEnv, seconds: float) -> tuple[float, float]:
    """Control steps a second of the physics alone and of the environment, on the same states."""
    generator = torch.Generator(env.device).manual_seed(0)
    actions = [
        0.3 * torch.randn(env.num_envs, env.num_actions, generator=generator, device=env.device) for _ in range(ROUND)
    ]
    for _ in range(2):
        for action in actions:
            env.step(action)
    alone = physics_step(env)
    spent, rounds = [0.0, 0.0], 0
    while sum(spent) < 2 * seconds:
        turn = iter(actions)
        whole = timed(lambda turn=turn: env.step(next(turn)), env.device, ROUND)
        kept = env.engine.state_dict()
        only = timed(alone, env.device, ROUND)
        env.engine.load_state_dict(kept)
        spent, rounds = [spent[0] + only, spent[1] + whole], rounds + 1
    steps = rounds * ROUND * env.num_envs
    return steps / spent[0], steps / spent[1]


def loop_rate(env: TrackingEnv, ppo: PpoConfig, seconds: float) -> tuple[float, float, float]:
    """Frames a second of the PPO loop, and its seconds an iteration, of which in the update."""
    trainer = Trainer(env, ppo, Path(tempfile.mkdtemp()))
    updates = [0.0]
    update = trainer.algorithm.update

    def counted() -> dict[str, float]:
        if env.device != "cpu":
            torch.cuda.synchronize()
        began = time.perf_counter()
        losses = update()
        if env.device != "cpu":
            torch.cuda.synchronize()
        updates[0] += time.perf_counter() - began
        return losses

    trainer._iterate()
    trainer._iterate()
    trainer.algorithm.update = counted
    spent, iterations = 0.0, 0
    while spent < seconds:
        spent, iterations = spent + timed(trainer._iterate, env.device, 1), iterations + 1
    return iterations * ppo.steps * env.num_envs / spent, spent / iterations, updates[0] / iterations


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--engine", choices=("mujoco", "mujoco_warp"), default="mujoco")
    parser.add_argument("--worlds", type=int, nargs="+", default=[512])
    parser.add_argument("--physics-hz", type=float, nargs="+", default=[200.0])
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--seconds", type=float, default=5.0)
    parser.add_argument("--compile", action="store_true", help="observations and rewards by torch's compiler")
    parser.add_argument("--steps", type=int, default=24, help="of an iteration of PPO")
    parser.add_argument("--hidden", type=int, nargs="+", default=[512, 256, 128])
    options = parser.parse_args()
    torch.set_num_threads(options.threads)
    clips = make_library(EmbeddedConfig(limit=7))
    ppo = PpoConfig(steps=options.steps, epochs=5, mini_batches=4, hidden=tuple(options.hidden))
    print("worlds  physics   row          control steps/s  of physics  goal")
    for worlds in options.worlds:
        for hz in options.physics_hz:
            config = EnvConfig(
                engine=options.engine,
                compile=options.compile,
                num_worlds=worlds,
                threads=options.threads,
                physics_hz=hz,
            )
            env = make_env(config, clips)
            alone, whole = physics_and_environment(env, options.seconds)
            loop, iteration, update = loop_rate(env, ppo, options.seconds)
            for name, value in {"physics": alone, "environment": whole, "PPO loop": loop}.items():
                goal = GOALS[options.engine].get(name, "")
                print(
                    f"{worlds:6d}  {hz:4.0f} Hz   {name:11s} {value:14.0f}   {value / alone:8.2f}   {goal}", flush=True
                )
            print(f"{'':16s}  an iteration of {ppo.steps} steps {1e3 * iteration:.0f} ms, update {1e3 * update:.0f} ms")
            if env.device != "cpu":
                print(f"{'':16s}  memory in use {torch.cuda.device_memory_used() / 2**30:.1f} GiB", flush=True)
            del env


if __name__ == "__main__":
    main()
