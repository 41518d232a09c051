"""A 3D replay of something that can be shown, in one file that opens without a server or a network."""

from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np

from bumblebee.report.replay import Take, part
from bumblebee.report.replay_page import replay_page
from bumblebee.report.shape import shape
from bumblebee.robot.model import build_spec
from bumblebee.view.sources import Source


def record(
    source: Source,
    name: str = "",
    meshes: Path | None = None,
    seconds: float = 10.0,
    make: Callable[[], mujoco.MjSpec] | None = None,
) -> str:
    """Record a source from its first frame.

    Args:
        source: what is recorded.
        name: heading of the page.
        meshes: folder of the G1's meshes; None for primitives.
        seconds: length of the recording at most [s].
        make: spec of another robot than the G1.

    Returns:
        A whole HTML document of at most `LARGEST` bytes and the player's 40 kB, which asks for nothing from elsewhere.
    """
    source.seek(0)
    states = [source.qpos().copy()]
    for _ in range(min(source.frames - 1, round(seconds * source.fps))):
        source.advance()
        states.append(source.qpos().copy())
    drawn = shape(make() if make else build_spec(), meshes)
    take = Take(name, "replay", np.stack(states), source.fps, tuple(source.robots), drawn, source.said())
    return replay_page(take, part([take]))
