"""The G1 under an exported policy that tracks embedded motions: squats, gestures, weight shifts."""

from functools import cache
from pathlib import Path

import numpy as np

from bumblebee.evaluation.contract import StartNoise
from bumblebee.motion.clip import Clip
from bumblebee.motion.embedded import EmbeddedConfig, make_library
from bumblebee.policy.episodes import start_states
from bumblebee.policy.exported import ExportedPolicy
from bumblebee.policy.runner import PolicyRunner, reference_library
from bumblebee.quaternions import conjugate, rotate
from bumblebee.robot.sensors import Sensors
from bumblebee.stand_in.undeclared.declared import Declared

_FAMILIES, _SHORTEST = ("stand", "squat"), 3.6  # [s]


@cache
def _policy(folder: str) -> ExportedPolicy:
    return ExportedPolicy.load(Path(folder))


@cache
def _clips() -> list[Clip]:
    every = make_library(EmbeddedConfig(families=_FAMILIES))
    return [clip for clip in every if clip.frames / clip.fps >= _SHORTEST]


class TrackPlan:
    """Each robot follows a clip of its own, drawn at random."""

    def __init__(self, robot: Declared, count: int, seconds: float, rng: np.random.Generator, policy: Path) -> None:
        chosen = [_clips()[i] for i in rng.choice(len(_clips()), count, replace=count > len(_clips()))]
        exported = _policy(str(policy))
        library = reference_library(exported, list({clip.name: clip for clip in chosen}.values()))
        self._runner = PolicyRunner(exported, library, [clip.name for clip in chosen])
        self.ticks = min(round(seconds * 50), min(clip.frames for clip in chosen) - 1)
        self._everyone = np.arange(count)
        rngs = [np.random.default_rng(s) for s in rng.integers(1 << 31, size=count)]
        self.qpos, self.qvel = start_states(chosen, rngs, StartNoise())
        self._hold = self._runner.hold()

    def target(self, tick: int, qpos: np.ndarray, qvel: np.ndarray) -> np.ndarray:
        """Target that the policy wants; it sees the state without noise."""
        joints = self._hold.shape[1]
        quat = qpos[:, 3:7] / np.linalg.norm(qpos[:, 3:7], axis=1, keepdims=True)
        sensors = Sensors(
            joint_pos=qpos[:, -joints:],
            joint_vel=qvel[:, -joints:],
            base_quat=quat,
            base_ang_vel=qvel[:, 3:6],
            base_lin_vel=rotate(conjugate(quat), qvel[:, :3]),
            base_pos=qpos[:, :3],
            joint_torque=np.zeros((len(qpos), joints)),
            foot_force=np.zeros((len(qpos), 2, 3)),
        )
        return self._runner.step(self._everyone, tick, sensors)[1].target
