"""The PPO loop on several GPUs of one machine, beside the same loop on one.

    python -m benchmarks.throughput.several WORLDS SECONDS STEPS COMPILE CAPTURED LAYER...      # one of the processes

The first of the processes prints its result as a line of JSON, and how far the networks of the processes are apart at
the end, which is nothing.
"""

import json
import socket
import subprocess
import sys

from torch.nn.utils import parameters_to_vector

from benchmarks.throughput.measure import Loop, loop_rate, make_env, started
from bumblebee.errors import BadInput
from bumblebee.learning.config import PpoConfig
from bumblebee.learning.ranks import join, leave
from bumblebee.motion.embedded import EmbeddedConfig, make_library
from bumblebee.tracking.config import EnvConfig
from bumblebee.tracking.sampling.library import MotionLibrary

GOALS = {2: 1.8, 4: 3.5}
TORCHRUN = "torch.distributed.run"


def measured(gpus: int, config: EnvConfig, ppo: PpoConfig, seconds: float) -> Loop:
    """The loop on `gpus` GPUs, each with the worlds of `config`, as processes of torchrun.

    Raises:
        BadInput: if it did not come to an end, with its last line.
    """
    flags = int(config.compile), int(ppo.captured)
    own = [str(value) for value in (config.num_worlds, seconds, ppo.steps, *flags, *ppo.hidden)]
    start = ["-m", TORCHRUN, "--nproc-per-node", str(gpus), "--master-addr", "127.0.0.1", "--master-port", free_port()]
    module = ["-m", "benchmarks.throughput.several", *own]
    done = subprocess.run([sys.executable, *start, *module], capture_output=True, text=True)
    lines = [line for line in done.stdout.splitlines() if line.startswith("{")]
    if done.returncode or not lines:
        told = [line for line in done.stderr.splitlines() if "expected" in line or "Error" in line]
        raise BadInput(f"{gpus} GPUs", "a measured loop", (told or done.stderr.splitlines() or ["nothing"])[0])
    result = json.loads(lines[-1])
    if apart := result.pop("apart"):
        raise BadInput(f"{gpus} GPUs", "one network on all", f"some that are {apart:g} apart")
    return Loop(**result)


def free_port() -> str:
    """A port of this machine that nobody uses now."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return str(free.getsockname()[1])


def print_several(counts: list[int], config: EnvConfig, ppo: PpoConfig, seconds: float) -> None:
    """A row for each number of GPUs; the ratios are to the first."""
    print("GPUs  worlds each  loop frames/s  of the first  goal  iteration [ms]  update [ms]")
    first: tuple[int, float] | None = None
    for gpus in counts:
        loop = measured(gpus, config, ppo, seconds)
        first = first or (gpus, loop.frames)
        ratio, goal = loop.frames / first[1], GOALS.get(gpus, "") if first[0] == 1 else ""
        times = f"{1e3 * loop.iteration:14.0f}  {1e3 * loop.update:11.0f}"
        print(
            f"{gpus:4d}  {config.num_worlds:11d}  {loop.frames:13.0f}  {ratio:12.2f}  {goal!s:>4}  {times}", flush=True
        )


def main() -> None:
    """One process of several."""
    worlds, seconds, steps, compiled, captured, *hidden = sys.argv[1:]
    ranks = join()
    config = EnvConfig(engine="mujoco_warp", physics_hz=200.0, num_worlds=int(worlds), compile=bool(int(compiled)))
    layers = tuple(map(int, hidden))
    ppo = PpoConfig(steps=int(steps), epochs=5, mini_batches=4, hidden=layers, captured=bool(int(captured)))
    clips = make_library(EmbeddedConfig(limit=7))
    env = make_env(config, lambda device: MotionLibrary(clips, config.ahead, device=device), ranks)
    trainer = started(env, ppo, ranks)
    loop = loop_rate(trainer, float(seconds))
    networks = ranks.gather(parameters_to_vector(trainer.algorithm.actor.parameters()).detach().cpu())
    if networks is not None:
        apart = max(float((one - networks[0]).abs().max()) for one in networks)
        print(json.dumps(vars(loop) | {"apart": apart}), flush=True)
    leave()


if __name__ == "__main__":
    main()
