"""Measured windows beside what the declared and the corrected model make of the same commands, as robot states."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bumblebee.diagnosis.dataset import Session
from bumblebee.diagnosis.report import Inlay
from bumblebee.diagnosis.simulation import Windows, choose_starts, cut, residuals, vary_or_refuse
from bumblebee.diagnosis.thresholds.report import ExampleWindows
from bumblebee.quaternions import conjugate, from_rotation_vector, multiply
from bumblebee.report.replays.replay import FOUND, GHOST, Drawn, Take, part
from bumblebee.report.replays.replay_page import holder, player, script, style
from bumblebee.report.replays.shape import shape
from bumblebee.sim.effects import Effect

_ROBOTS = (Drawn("measured"), Drawn("declared", GHOST), Drawn("corrected", FOUND))
_EVERY = 10_000  # ticks of a window, all of which are drawn


@dataclass(frozen=True)
class SeenWindow:
    """One window of a measured rollout and its simulations from the same initial state."""

    name: str
    error: tuple[float, ...]
    """RMS joint error of the declared model and, with effects, of the corrected one [rad or m]; NaN if it diverged."""
    states: np.ndarray
    """(N, R * nq): measured, declared, corrected side by side."""
    joints: np.ndarray
    """(R, N, J) joint positions, measured and simulated [rad or m]."""
    fps: float

    @property
    def robots(self) -> tuple[Drawn, ...]:
        """Which robots the states are of."""
        return _ROBOTS[: len(self.joints)]

    @property
    def text(self) -> str:
        """How far the models are off."""
        named = zip(("declared model", "corrected model"), self.error, strict=False)
        return ", ".join(f"{name} {_off(error)}" for name, error in named)


def _off(error: float) -> str:
    return f"{1e3 * error:.1f} mrad off" if np.isfinite(error) else "diverged"


def seen_windows(session: Session, effects: Sequence[Effect] = ()) -> list[SeenWindow]:
    """Windows of the held-out logs, the one that the declared model misses most first.

    Args:
        session: measured rollouts and their declared model.
        effects: those of a diagnosis; with them the corrected model is simulated, too.

    Raises:
        BadInput: effects that the model cannot have.
    """
    rule, ids = ExampleWindows(), session.holdout or session.train
    starts: list[tuple[int, int, int]] = []
    for length in rule.lengths:
        starts = starts or choose_starts(session.rollouts, ids, length, rule.windows, session.plant.thresholds.windows)
    windows = cut(session.plant, session.layout, session.rollouts, starts, outputs=_EVERY)
    models = [vary_or_refuse(session.plant, chosen) for chosen in ([], effects)[: 2 if effects else 1]]
    left = residuals(session.plant, session.layout, windows, models, session.steps[0])
    joints = left[..., session.layout.slices["joint_pos"]]
    error = np.sqrt((joints**2).mean(axis=(2, 3)))  # (V, W)
    order = np.argsort(-np.nan_to_num(error[0], nan=np.inf))
    return [_window(session, windows, left[:, w], error[:, w], int(w)) for w in order]


def window_takes(session: Session, effects: Sequence[Effect] = (), group: str = "windows") -> list[Take]:
    """The worst and the median window of the declared model, and with effects those of the corrected one.

    Args:
        session: measured rollouts and their declared model.
        effects: those of a diagnosis.
        group: figure of the page that shows them.
    """
    seen, drawn, takes = seen_windows(session, effects), shape(session.spec), []
    for which, model in enumerate(("declared", "corrected")[: 2 if effects else 1]):
        order = sorted(seen, key=lambda window: -np.nan_to_num(window.error[which], nan=np.inf))
        for rank, window in (("worst", order[0]), ("median", order[len(order) // 2])):
            name = f"{rank} window of the {model} model"
            note = f"{window.name}: {window.text}"
            takes.append(Take(name, group, window.states, window.fps, window.robots, drawn, note))
    return takes


def windows_inlay(session: Session, effects: Sequence[Effect] = ()) -> Inlay:
    """The 3D replays of a diagnosis' page."""
    takes = window_takes(session, effects)
    made = part(takes)
    shown = player(takes[0], "Measured and simulated", f"From the measured state, with the same commands. {made.note}")
    return Inlay(f"{shown}{holder(made)}", style(), script())


def _window(session: Session, windows: Windows, left: np.ndarray, error: np.ndarray, w: int) -> SeenWindow:
    rollout, joints = session.rollouts[windows.rollout[w]], session.layout.slices["joint_pos"]
    start = float(rollout.time[windows.start[w]] - rollout.time[0])
    states = [_states(session, windows, w, None), *(_states(session, windows, w, part) for part in left)]
    measured = windows.measured[w][:, joints]
    return SeenWindow(
        f"{rollout.rollout_id} from {start:.2f} s",
        tuple(error.tolist()),
        np.concatenate(states, axis=1),
        np.stack([measured, *(measured - part[:, joints] for part in left)]),
        1.0 / float(np.median(np.diff(windows.out_time[w]))),
    )


def _states(session: Session, windows: Windows, w: int, left: np.ndarray | None) -> np.ndarray:
    """(N, nq) states; `left` (N, D) is by how much the measured readings exceed those of a model."""
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
