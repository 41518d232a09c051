"""How throughput and memory grow with worlds, with motions and with the observations' history.

Motions are pieces of 8 s of the embedded walks, the last frame held where a walk is shorter, as many copies as wanted:
what a lookup costs depends on where it looks, not on what it finds. The copies are made on the device.
"""

from dataclasses import replace

import torch

from benchmarks.throughput.measure import environment_rate, loop_rate, make_env, started, used_memory
from bumblebee.learning.config import PpoConfig
from bumblebee.motion.clip import Clip
from bumblebee.tracking.config import EnvConfig, ObservationConfig
from bumblebee.tracking.sampling.library import MotionLibrary

FRAMES = 400  # of a motion of 8 s at 50 Hz
WORLDS = (1024, 4096, 8192, 16384)
MOTIONS = (100, 1000, 8179)
HISTORY = (5, 10)
HEADER = "worlds  motions  history   environment      loop  frames/s   GPU [GiB]  of these motions"


def copies(clips: list[Clip], count: int, ahead: tuple[float, ...], device: torch.device) -> MotionLibrary:
    """A library of `count` motions of `FRAMES` frames each, made of `clips`."""
    library = MotionLibrary(clips, ahead, feed_forward=False, device=device)
    steps = torch.arange(FRAMES, device=device)
    one = library.start[:, None] + torch.minimum(steps, library.length[:, None] - 1)  # (N, FRAMES)
    held = steps >= library.length[:, None]
    which = torch.arange(count, device=device) % len(library)
    library._rows = library._rows[one[which].flatten()]
    library._rows[held[which].flatten(), library._moving :] = 0.0
    library.length = torch.full((count,), FRAMES, device=device)
    library.start = torch.arange(count, device=device) * FRAMES
    return library


def row(config: EnvConfig, clips: list[Clip], motions: int, ppo: PpoConfig, seconds: float) -> str:
    """Measure one configuration, and give back its memory."""
    device = "cpu" if config.engine == "mujoco" else "cuda:0"
    before = used_memory(device)
    env = make_env(config, lambda where: copies(clips, motions, config.ahead, where))
    env_rate = environment_rate(env, seconds)
    loop = loop_rate(started(env, ppo), seconds)
    used = used_memory(device) - before
    motion_memory = env.library._rows.nelement() * env.library._rows.element_size() / 2**30
    history = config.observation.history
    return (
        f"{config.num_worlds:6d}  {motions:7d}  {history:7d}  {env_rate:12.0f}  {loop.frames:18.0f}"
        f"  {used:10.2f}  {motion_memory:17.2f}"
    )


def print_growth(config: EnvConfig, clips: list[Clip], ppo: PpoConfig, seconds: float) -> None:
    """One table: worlds at 100 motions, motions and history at the worlds of `config`."""
    walks = [clip for clip in clips if clip.family == "walk"] or clips
    print(HEADER)
    for worlds in WORLDS:
        print(row(replace(config, num_worlds=worlds), walks, MOTIONS[0], ppo, seconds), flush=True)
    for motions in MOTIONS[1:]:
        print(row(config, walks, motions, ppo, seconds), flush=True)
    for history in HISTORY:
        seen = ObservationConfig(terms=config.observation.terms, history=history)
        print(row(replace(config, observation=seen), walks, MOTIONS[0], ppo, seconds), flush=True)
