"""The table: physics alone, environment, PPO loop, side by side; mjlab, several GPUs and growth on request.

    python -m benchmarks.throughput                                              # on two CPU threads
    python -m benchmarks.throughput --engine mujoco_warp --worlds 4096 8192      # on a GPU
    python -m benchmarks.throughput --engine mujoco_warp --worlds 8192 --update eager captured
    python -m benchmarks.throughput --engine mujoco_warp --worlds 4096 8192 --against mjlab --mjlab-site FOLDER
    python -m benchmarks.throughput --engine mujoco_warp --worlds 8192 --gpus 1 2 4
    python -m benchmarks.throughput --engine mujoco_warp --worlds 8192 --growth

What counts are the ratios.
"""

import argparse
import math
import sys
from dataclasses import replace
from pathlib import Path

import torch

from benchmarks.throughput.growth import print_growth
from benchmarks.throughput.measure import loop_rate, make_env, physics_and_environment, started, used_memory
from benchmarks.throughput.peer import Peer, mjlab_rates, print_beside
from benchmarks.throughput.several import print_several
from bumblebee.errors import EXIT_BAD_INPUT, BadInput
from bumblebee.learning.config import PpoConfig
from bumblebee.learning.ranks import check_gpus
from bumblebee.motion.clip import Clip
from bumblebee.motion.embedded import EmbeddedConfig, make_library
from bumblebee.sim.effects import Effect, read_effects
from bumblebee.tracking.config import EnvConfig
from bumblebee.tracking.sampling.library import MotionLibrary

UPDATES = ("eager", "captured")
"""rsl_rl's own update, and ours of `PpoConfig.captured`."""
GOALS = {"mujoco": {"environment": 0.8}, "mujoco_warp": {"environment": 0.75, "loop, captured": 0.65}}


def print_rows(
    config: EnvConfig, clips: list[Clip], ppos: dict[str, PpoConfig], seconds: float, effects: list[Effect]
) -> tuple[float, float]:
    """The rows of one configuration; the environment's rate and the last loop's."""
    before = used_memory("cpu" if config.engine == "mujoco" else "cuda:0")
    env = make_env(config, lambda device: MotionLibrary(clips, config.ahead, device=device), effects=effects)
    rates = physics_and_environment(env, seconds)
    loops = {f"loop, {update}": loop_rate(started(env, ppo), seconds) for update, ppo in ppos.items()}
    worlds, hz = config.num_worlds, config.physics_hz
    alone = {"physics": rates.physics, "commands held": rates.held, "mujoco.rollout": rates.rollout}
    alone = {name: value for name, value in alone.items() if not math.isnan(value)}
    rows = alone | {"environment": rates.environment} | {name: loop.frames for name, loop in loops.items()}
    for name, value in rows.items():
        goal, share = GOALS[config.engine].get(name, ""), value / rates.physics
        print(f"{worlds:6d}  {hz:4.0f} Hz   {name:14s} {value:14.0f}   {share:8.2f}   {goal}")
    shares = ", ".join(f"{rates.environment / value:.2f} of {name}" for name, value in alone.items())
    print(f"{'':16s}  environment: {shares}")
    for name, loop in loops.items():
        times = f"{1e3 * loop.iteration:.0f} ms, update {1e3 * loop.update:.1f} ms"
        print(f"{'':16s}  {name}: an iteration of {next(iter(ppos.values())).steps} steps {times}", flush=True)
    if env.device != "cpu":
        print(f"{'':16s}  memory {used_memory(env.device) - before:.1f} GiB", flush=True)
    return rates.environment, [loop.frames for loop in loops.values()][-1]


def parsed() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.throughput", description=__doc__.splitlines()[0])
    parser.add_argument("--engine", choices=("mujoco", "mujoco_warp"), default="mujoco")
    parser.add_argument("--worlds", type=int, nargs="+", default=[512])
    parser.add_argument("--physics-hz", type=float, nargs="+", default=[200.0])
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--seconds", type=float, default=5.0, help="of measuring, for each row")
    parser.add_argument("--compile", action="store_true", help="observations and rewards by torch's compiler")
    parser.add_argument("--steps", type=int, default=24, help="of an iteration of PPO")
    parser.add_argument("--hidden", type=int, nargs="+", default=[512, 256, 128])
    parser.add_argument("--update", choices=UPDATES, nargs="+", default=["eager"], help="of the loop, side by side")
    parser.add_argument("--effects", type=Path, help="an effects.yaml that the robot has")
    parser.add_argument("--against", choices=("mjlab",), help="its own tracking task on the same GPU, same worlds")
    parser.add_argument("--mjlab-python", default=sys.executable, help="the interpreter that has mjlab")
    parser.add_argument("--mjlab-site", default="", help="folders of packages to put before that interpreter's own")
    parser.add_argument("--gpus", type=int, nargs="+", help="instead: the loop on so many GPUs, at the first worlds")
    parser.add_argument("--growth", action="store_true", help="instead: with worlds, motions and history")
    return parser.parse_args()


def main() -> None:
    """Print the table that was asked for."""
    options = parsed()
    torch.set_num_threads(options.threads)
    ppo = PpoConfig(steps=options.steps, epochs=5, mini_batches=4, hidden=tuple(options.hidden))
    ppos = {update: replace(ppo, captured=update == "captured") for update in options.update}
    last = ppos[options.update[-1]]
    configs = [
        EnvConfig(options.engine, compile=options.compile, num_worlds=n, threads=options.threads, physics_hz=hz)
        for n in options.worlds
        for hz in options.physics_hz
    ]
    if options.gpus:
        check_gpus(max(options.gpus))
        print_several(options.gpus, configs[0], last, options.seconds)
        return
    if options.growth:
        print_growth(configs[0], make_library(EmbeddedConfig()), last, options.seconds)
        return
    clips = make_library(EmbeddedConfig(limit=7))
    effects = read_effects(options.effects) if options.effects else []
    print("worlds  physics   row             control steps/s  of physics  goal")
    for config in configs:
        environment, loop = print_rows(config, clips, ppos, options.seconds, effects)
        if options.against:
            peer = Peer(options.mjlab_python, options.mjlab_site)
            device = "cpu" if options.engine == "mujoco" else "cuda:0"
            rates = mjlab_rates(peer, clips, config.num_worlds, options.seconds, device)
            print_beside(rates, environment, loop, config.num_worlds)


if __name__ == "__main__":
    try:
        main()
    except BadInput as error:
        print(error, file=sys.stderr)
        raise SystemExit(EXIT_BAD_INPUT) from None
