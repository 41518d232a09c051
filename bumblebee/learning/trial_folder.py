"""Folder of an evaluation: a row a rollout, the robot's states of each and the motions that it followed."""

import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd
import torch

from bumblebee.errors import BadInput
from bumblebee.io.read import read_bytes
from bumblebee.io.write import write_folder
from bumblebee.motion.clip import Clip, clip_states
from bumblebee.tracking.terminations import FALL, beyond, success_threshold

TABLE, STATES = "trials.csv", "states.parquet"
ENDS = FELL, KEY_BODY_OFF, PELVIS_OFF, FOLLOWED = "fell", "key body off", "pelvis off", "followed to the end"
"""How a rollout ended."""
_COLUMNS = [f"q{i}" for i in range(30)]
_SIDES = ("robot", "motion")


@dataclass
class Kept:
    """States of rollouts, as `try_policy` hands them over: some 60 kB for 10 s."""

    clips: list[Clip] = field(default_factory=list)
    robots: list[np.ndarray] = field(default_factory=list)

    def add(self, clips: Sequence[Clip], states: np.ndarray) -> None:
        """Take states (F, N, 30) of robots that follow N clips, from their second frame on."""
        self.clips += clips
        self.robots += [np.nan_to_num(states[: clip.frames - 1, n]) for n, clip in enumerate(clips)]

    def write(self, out: Path, trials: pd.DataFrame) -> None:
        """Write the folder, whole or not at all; `trials` has a row for each rollout, in the order of `add`."""
        rows = zip(self.clips, self.robots, trials["success"], trials["share"], strict=True)
        table, buffer = trials.assign(ended=[ended(*row) for row in rows]), io.BytesIO()
        pd.concat(self._tables(), ignore_index=True).to_parquet(buffer, index=False)
        write_folder(out, {TABLE: table.to_csv(index=False), STATES: buffer.getvalue()})

    def _tables(self) -> Iterator[pd.DataFrame]:
        for number, (clip, robot) in enumerate(zip(self.clips, self.robots, strict=True)):
            for side, states in zip(_SIDES, (robot, clip_states(clip)[1:]), strict=True):
                table = pd.DataFrame(states.astype(np.float32), columns=_COLUMNS)
                yield table.assign(side=side, rollout=number, fps=clip.fps)


def ended(clip: Clip, robot: np.ndarray, success: bool, share: float) -> str:
    """How a rollout ended, one of `ENDS`.

    Args:
        clip: what it followed.
        robot: (F - 1, 30) states, from the clip's second frame on.
        success: whether it was never lost.
        share: part of the clip until it was lost.

    Returns:
        "fell" where the robot fell at any time, else which part was beyond the clip's threshold when it was lost.
    """
    if success:
        return FOLLOWED
    here, there = torch.from_numpy(robot), torch.from_numpy(clip_states(clip)[1:])
    if bool(beyond(FALL, here[:, 3:7], here[:, 2], there[:, 3:7], there[:, 2]).any()):
        return FELL
    lost = min(round(share * (clip.frames - 1)), len(robot) - 1)
    off = np.linalg.norm(robot[lost, :3] - clip.root_pos[lost + 1])
    return PELVIS_OFF if off > success_threshold(clip) else KEY_BODY_OFF


@dataclass(frozen=True)
class KeptRollout:
    """One rollout of an evaluation's folder."""

    name: str
    family: str
    ended: str
    share: float
    """Part of the motion until it was lost."""
    robot: np.ndarray
    """(F, 30) states."""
    motion: np.ndarray
    """(F, 30) states of what it followed."""
    fps: float


def is_kept(folder: Path) -> bool:
    """Whether a folder is an evaluation with its states."""
    return (folder / TABLE).is_file() and (folder / STATES).is_file()


def read_kept(folder: Path) -> list[KeptRollout]:
    """Read the rollouts of an evaluation's folder.

    Raises:
        BadInput: files that `evaluate` did not write, or that do not belong together.
    """
    try:
        trials = pd.read_csv(io.BytesIO(read_bytes(folder / TABLE)))
        states = pd.read_parquet(io.BytesIO(read_bytes(folder / STATES)))
        if unknown := set(trials["ended"]) - set(ENDS):
            raise ValueError(f"ended: {sorted(unknown)}")
        parts = dict(list(states.groupby(["rollout", "side"])))
        return [
            KeptRollout(
                str(row["name"]),
                "" if pd.isna(row["family"]) else str(row["family"]),
                str(row["ended"]),
                float(row["share"]),
                robot=parts[number, _SIDES[0]][_COLUMNS].to_numpy(np.float64),
                motion=parts[number, _SIDES[1]][_COLUMNS].to_numpy(np.float64),
                fps=float(parts[number, "robot"]["fps"].iloc[0]),
            )
            for number, row in enumerate(trials.to_dict("records"))
        ]
    except (OSError, ValueError, KeyError) as error:
        came = f"{type(error).__name__}: {error}"[:200]
        remedy = "`bumblebee evaluate POLICY MOTIONS --states FOLDER` writes one."
        raise BadInput(folder, f"{TABLE} and {STATES} of an evaluation", came, remedy) from None
