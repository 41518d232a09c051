"""A 3D replay in one file: the page's own client with the recording in it, for `file://` and without a network."""

import re
from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np

from bumblebee.errors import BadInput
from bumblebee.view.scene import Picture
from bumblebee.view.server import open_server, stop
from bumblebee.view.sources import Source

LARGEST = 3_000_000
"""Bytes of a replay."""
_FPS = 20.0  # pictures a second of a replay, at most
_FOREIGN = re.compile(r"<(?:script|link)[^>]+(?:src|href)=[\"']https?://")


def replay_html(source: Source, picture: Picture, seconds: float = 10.0) -> str:
    """Record a source from its first frame.

    Args:
        source: what is recorded.
        picture: where it is drawn meanwhile.
        seconds: length of the recording at most [s].

    Returns:
        A whole HTML document, which asks for nothing from elsewhere.

    Raises:
        BadInput: the document has more than `LARGEST` bytes.
    """
    picture.choose(source.robots)
    source.seek(0)
    picture.show(source.qpos())
    recording = picture.server.get_scene_serializer()
    step = max(round(source.fps / _FPS), 1)
    for _ in np.arange(min(source.frames - 1, round(seconds * source.fps)) // step):
        for _ in range(step):
            source.advance()
        recording.insert_sleep(step / source.fps)
        picture.show(source.qpos())
    text = recording.as_html()
    assert not _FOREIGN.search(text)
    if len(text.encode()) > LARGEST:
        raise BadInput(
            "--seconds", f"a replay of at most {LARGEST / 1e6:g} MB", f"{len(text) / 1e6:.1f} MB", "Show less."
        )
    return text


def record(
    source: Source,
    meshes: Path | None = None,
    seconds: float = 10.0,
    make: Callable[[], mujoco.MjSpec] | None = None,
) -> str:
    """`replay_html` by a server of its own, which is gone afterwards."""
    server = open_server(0)
    try:
        return replay_html(source, Picture(server, meshes, make), seconds)
    finally:
        stop(server)
