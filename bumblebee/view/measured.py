"""Measured windows beside what the declared and the corrected model make of them."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import mujoco

from bumblebee.diagnosis.dataset import open_session
from bumblebee.measured.model_file import load_spec
from bumblebee.report.replays.windows import SeenWindow, seen_windows
from bumblebee.sim.effects import Effect
from bumblebee.view.sources import Entry, Recorded


def window_entries(model: Path, dataset: Path, effects: Sequence[Effect] = ()) -> list[Entry]:
    """Windows of the logs, the one that the declared model misses most first.

    Args:
        model: the declared MJCF.
        dataset: folder of measured rollouts.
        effects: what a diagnosis found; with them the corrected model is drawn, too.

    Raises:
        BadInput: as `open_session`; effects that the model cannot have.
    """
    session = open_session(model, dataset)
    seen = seen_windows(session, effects)
    return [Entry(window.name, "", window.text, partial(_source, window, session.plant.joints)) for window in seen]


def spec_of(model: Path) -> Callable[[], mujoco.MjSpec]:
    """Spec to draw a model from: the G1 in its visible shape, any other robot by its own geoms."""
    return lambda: load_spec(model)


def _source(window: SeenWindow, joints: Sequence[str]) -> Recorded:
    """The measured robot and its models through each other; curves of the joints."""
    curves = {name: list(window.joints[:, :, j]) for j, name in enumerate(joints)}
    names = tuple(robot.name for robot in window.robots)
    return Recorded(window.states, window.fps, window.robots, window.text, curves, names)
