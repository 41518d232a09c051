"""A policy that follows a clip in the simulator while one looks on, and can be pushed."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch

from bumblebee.evaluation.contract import StartNoise
from bumblebee.motion.clip import Clip, clip_states
from bumblebee.policy.episodes import start_states
from bumblebee.policy.exported import ExportedPolicy
from bumblebee.policy.robots import CONTROL_HZ, NominalRobots
from bumblebee.policy.runner import PolicyRunner, reference_library
from bumblebee.report.replays.replay import Drawn
from bumblebee.tracking.terminations import FALL, beyond
from bumblebee.view.sources import REFERENCE

_ONE = np.array([0])
_REST = round(1.5 * CONTROL_HZ)  # control steps that a fallen robot lies, or one that is done stands
DIRECTIONS = {"front": (1.0, 0.0), "back": (-1.0, 0.0), "left": (0.0, 1.0), "right": (0.0, -1.0)}
"""Direction of a push -> horizontal direction that the robot is sent in, in its own frame."""


class LivePolicy:
    """One robot of the declared model under a policy; after the clip's end or a fall it begins again.

    Args:
        policy: what acts.
        clip: what it follows, 50 frames a second.
    """

    fps = CONTROL_HZ
    robots: Sequence[Drawn] = (Drawn("robot"), REFERENCE)
    curves: Mapping[str, Sequence[np.ndarray]] = {}
    lines: Sequence[str] = ()

    def __init__(self, policy: ExportedPolicy, clip: Clip) -> None:
        self._policy, self._clip = policy, clip
        self._reference = clip_states(clip)
        self.frames = clip.frames
        self._robots = NominalRobots(1, threads=1)
        self._state, self._speed = (self._robots.batch.bind(name) for name in ("qpos", "qvel"))
        self._fallen = False
        self._run = self._begin(0)

    def seek(self, frame: int) -> None:
        """Put the robot onto the motion at a frame, and let the policy go on from there."""
        self._fallen = False
        self._run = self._begin(min(max(frame, 0), self.frames - 2))

    def advance(self) -> int:
        """One control step."""
        run = self._run
        if run.rest >= _REST:
            self.seek(0)
            return 0
        sensors = self._robots.read()
        _, command = run.runner.step(_ONE, run.tick, sensors)
        self._robots.step(_ONE, command)
        frame = min(run.first + run.tick + 1, self.frames - 1)
        self._fallen = self._fallen or self._lies(frame)
        ended = self._fallen or run.first + run.tick + 1 >= self.frames
        self._run = replace(run, tick=run.tick + 1, rest=run.rest + ended)
        return frame

    def qpos(self) -> np.ndarray:
        """The robot's state and, through it, the reference's."""
        frame = min(self._run.first + self._run.tick, self.frames - 1)
        return np.concatenate([self._state[0], self._reference[frame]])

    def said(self) -> str:
        """How it goes."""
        if self._fallen:
            return "The robot fell; it begins again."
        frame = min(self._run.first + self._run.tick, self.frames - 1)
        off = np.abs(self._state[0, 7:] - self._reference[frame, 7:]).mean()
        return f"Mean joint error now: {1e3 * off:.0f} mrad"

    def push(self, direction: str, speed: float) -> None:
        """Change the base's velocity by `speed` [m/s] in one of `DIRECTIONS`, at once."""
        w, x, y, z = self._state[0, 3:7]
        heading = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
        ahead, aside = DIRECTIONS[direction]
        turn = np.array([[np.cos(heading), -np.sin(heading)], [np.sin(heading), np.cos(heading)]])
        self._speed[0, :2] += speed * (turn @ [ahead, aside])

    def _begin(self, first: int) -> "_Run":
        clip = _from(self._clip, first)
        runner = PolicyRunner(self._policy, reference_library(self._policy, [clip]), [clip.name])
        start = start_states([clip], [np.random.default_rng(0)], StartNoise(0.0, 0.0))
        self._robots.reset(*start, runner.hold())
        return _Run(runner, first)

    def _lies(self, frame: int) -> bool:
        """Whether the robot has fallen, by the rule that ends an episode."""
        state, wanted = (torch.as_tensor(s[None]) for s in (self._state[0].copy(), self._reference[frame]))
        return bool(beyond(FALL, state[:, 3:7], state[:, 2], wanted[:, 3:7], wanted[:, 2]))


@dataclass(frozen=True)
class _Run:
    runner: PolicyRunner
    first: int
    """Frame of the clip that it began at."""
    tick: int = 0
    rest: int = 0
    """Control steps since the end or the fall."""


def _from(clip: Clip, first: int) -> Clip:
    """The clip from a frame on."""
    parts = {name: getattr(clip, name)[first:] for name in ("root_pos", "root_quat", "joint_pos", "key_pos")}
    return replace(clip, **parts)
