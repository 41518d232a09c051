"""Measured windows beside what the declared and the corrected model make of them."""

from collections.abc import Callable, Sequence
from pathlib import Path

import mujoco
import numpy as np

from bumblebee.diagnosis.dataset import Session, open_session
from bumblebee.diagnosis.simulation import Windows, choose_starts, cut, residuals, vary_or_refuse
from bumblebee.diagnosis.thresholds.report import ExampleWindows
from bumblebee.measured.model_file import load_spec
from bumblebee.quaternions import conjugate, from_rotation_vector, multiply
from bumblebee.sim.effects import Effect
from bumblebee.view.drawing import FOUND, GHOST, Drawn
from bumblebee.view.sources import Entry, Recorded, beside

_ROBOTS = (Drawn("measured"), Drawn("declared", GHOST), Drawn("corrected", FOUND))
_EVERY = 10_000  # ticks of a window, all of which are drawn


def window_entries(model: Path, dataset: Path, effects: Sequence[Effect] = ()) -> list[Entry]:
    """Windows of the logs, the one that the declared model misses most first.

    Args:
        model: the declared MJCF.
        dataset: folder of measured rollouts.
        effects: what a diagnosis found; with them the corrected model is drawn, too.

    Raises:
        BadInput: as `open_session`; effects that the model cannot have.
    """
    session, rule = open_session(model, dataset), ExampleWindows()
    ids = session.holdout or session.train
    starts: list[tuple[int, int, int]] = []
    for length in rule.lengths:
        starts = starts or choose_starts(session.rollouts, ids, length, rule.windows, session.plant.thresholds.windows)
    windows = cut(session.plant, session.layout, session.rollouts, starts, outputs=_EVERY)
    models = [vary_or_refuse(session.plant, chosen) for chosen in ([], effects)[: 2 if effects else 1]]
    left = residuals(session.plant, session.layout, windows, models, session.steps[0])
    joints = left[..., session.layout.slices["joint_pos"]]
    error = np.sqrt((joints**2).mean(axis=(2, 3)))  # (V, W); NaN where a simulation diverged
    order = np.argsort(-np.nan_to_num(error[0], nan=np.inf))
    return [_entry(session, windows, left, error[:, w], int(w)) for w in order]


def spec_of(model: Path) -> Callable[[], mujoco.MjSpec]:
    """Spec to draw a model from: the G1 in its visible shape, any other robot by its own geoms."""
    return lambda: load_spec(model)


def _entry(session: Session, windows: Windows, left: np.ndarray, error: np.ndarray, w: int) -> Entry:
    rollout = session.rollouts[windows.rollout[w]]
    start = float(rollout.time[windows.start[w]] - rollout.time[0])
    names = ("declared model", "corrected model")
    text = ", ".join(f"{name} {1e3 * e:.1f} mrad off" for name, e in zip(names, error, strict=False))
    name = f"{rollout.rollout_id} from {start:.2f} s"
    return Entry(name, "", text, lambda: _source(session, windows, left[:, w], w))


def _source(session: Session, windows: Windows, left: np.ndarray, w: int) -> Recorded:
    """The measured robot and its models through each other; curves of the joints."""
    layout, plant = session.layout, session.plant
    joints = layout.slices["joint_pos"]
    shown = [_states(session, windows, w, None), *(_states(session, windows, w, part) for part in left)]
    robots = _ROBOTS[: len(shown)]
    made = beside(list(zip(robots, shown, strict=True)), 1.0 / float(np.median(np.diff(windows.out_time[w]))))
    measured = windows.measured[w][:, joints]
    lines = [measured, *(measured - part[:, joints] for part in left)]
    made.curves = {name: [line[:, j] for line in lines] for j, name in enumerate(plant.joints)}
    made.lines = tuple(robot.name for robot in robots)
    return made


def _states(session: Session, windows: Windows, w: int, left: np.ndarray | None) -> np.ndarray:
    """(N, nq) states; `left` (N, D) is what the measured readings exceed those of a model by."""
    layout, plant, measured = session.layout, session.plant, windows.measured[w]
    seen = measured if left is None else measured - left
    qpos = np.tile(windows.qpos[w], (len(seen), 1))
    qpos[:, plant.qpos] = seen[:, layout.slices["joint_pos"]]
    if plant.floating and windows.quat is not None:
        at, quat = plant.base_qpos, windows.quat[w]
        if left is not None:
            quat = multiply(quat, conjugate(from_rotation_vector(left[:, layout.slices["base_rot"]])))
        qpos[:, at + 3 : at + 7] = quat
        if "base_pos" in layout.slices:
            qpos[:, at : at + 3] = seen[:, layout.slices["base_pos"]]
    return np.nan_to_num(qpos)
