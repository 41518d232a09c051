"""The policy behind its questions: one clip, one robot; `policy_process` gives it the guard's."""

import math

import mujoco
import numpy as np
import torch
from torch import Tensor

from bumblebee.compensation.numbers import Compensation
from bumblebee.motion.clip import Clip
from bumblebee.policy.exported import ExportedPolicy
from bumblebee.policy.runner import PolicyRunner, reference_key
from bumblebee.robot.facts import KEY_BODIES
from bumblebee.robot.model import build_model
from bumblebee.robot.sensors import Sensors
from bumblebee.tracking.sampling.library import MotionLibrary, ReferenceFrame
from bumblebee.wire.messages import State
from bumblebee.wire.policy_end.align import Alignment, aligned
from bumblebee.wire.policy_end.questions import Answer, Question
from bumblebee.wire.safety.rules import Reference, Wish

_ONE = np.array([0])


class OneRobot:
    """Forward kinematics of one robot by MuJoCo: 20 us, where that over all frames of a motion takes 1 ms and more."""

    def __init__(self) -> None:
        self._model = build_model()
        self._data = mujoco.MjData(self._model)
        self._bodies = [self._model.body(name).id for name in KEY_BODIES]

    def __call__(self, root_pos: np.ndarray, root_quat: np.ndarray, joint_pos: np.ndarray) -> np.ndarray:
        """Positions of `KEY_BODIES`, (1, 14, 3) [m, world], from (1, 3) [m], (1, 4) [wxyz] and (1, 23) [rad]."""
        self._data.qpos[:3], self._data.qpos[3:7], self._data.qpos[7:] = root_pos[0], root_quat[0], joint_pos[0]
        mujoco.mj_kinematics(self._model, self._data)
        return self._data.xpos[None, self._bodies]


class OneClip(MotionLibrary):
    """One clip whose reference of every control tick is looked up before the run: a look costs a question 0.2 ms.

    Args:
        policy: what asks.
        clip: the clip.
    """

    def __init__(self, policy: ExportedPolicy, clip: Clip) -> None:
        super().__init__([clip], *reference_key(policy))
        self._hz = float(policy.contract["control_hz"])
        self._end = math.ceil(clip.duration * self._hz) + 1  # from here on it is the last frame, at rest
        time = torch.arange(self._end + 1) / self._hz
        self._all, self._tick = super().frames(torch.zeros(len(time), dtype=torch.long), time), -1

    def frames(self, ids: Tensor, time: Tensor) -> ReferenceFrame:
        """See `MotionLibrary.frames`; a lone time is a control tick's."""
        if len(time) > 1:
            return super().frames(ids, time)
        tick = min(round(float(time) * self._hz), self._end)
        if tick != self._tick:
            self._tick = tick
            self._frame = ReferenceFrame(*(values[tick : tick + 1] for values in vars(self._all).values()))
        return self._frame


class Brain:
    """Answers the guard's questions.

    Args:
        policy: what acts.
        clip: what it follows.
        compensation: what is undone at the joints; None for nothing.
    """

    def __init__(self, policy: ExportedPolicy, clip: Clip, compensation: Compensation | None = None) -> None:
        self._runner = PolicyRunner(policy, OneClip(policy, clip), [clip.name], compensation, OneRobot())
        self._clip = clip
        self._alignment: Alignment | None = None
        self._kp, self._kd = (np.asarray(policy.contract[key], dtype=np.float64) for key in ("kp", "kd"))

    def hold(self) -> np.ndarray:
        """Targets (J,) [rad] that carry the first frame."""
        return self._runner.hold()[0]

    @torch.inference_mode()
    def answer(self, question: Question) -> Answer:
        """The policy's answer; a question at tick 0 puts the clip's first frame where the robot is."""
        state, clip = question.state, self._clip
        if question.tick == 0 or self._alignment is None:
            self._alignment = aligned(state.base_pos, state.base_quat, clip.root_pos[0], clip.root_quat[0])
        action, command = self._runner.step(_ONE, question.tick, _sensors(state, self._alignment))
        zero = np.zeros_like(self._kp)
        wish = Wish(
            command.target[0],
            self._kp if command.kp is None else command.kp,
            self._kd if command.kd is None else command.kd,
            zero if command.torque is None else command.torque[0],
        )
        frame = min(question.tick, clip.frames - 1)
        quat = self._alignment.back(clip.root_quat[frame].astype(np.float64))
        reference = Reference(self._runner.untouched(_ONE, question.tick)[0], quat, float(clip.root_pos[frame, 2]))
        return Answer(question.tick, question.asked_ns, state.sequence, wish, reference, action[0])


def _sensors(state: State, alignment: Alignment) -> Sensors:
    pos, quat = alignment.seen(state.base_pos, state.base_quat)
    foot = np.zeros((1, 2, 3))
    foot[0, :, 2] = np.nan_to_num(state.foot_force)
    return Sensors(
        joint_pos=state.joint_pos[None],
        joint_vel=state.joint_vel[None],
        base_quat=quat[None],
        base_ang_vel=state.base_ang_vel[None],
        base_lin_vel=state.base_lin_vel[None],
        base_pos=pos[None],
        joint_torque=state.joint_torque[None],
        foot_force=foot,
    )
