"""The policy's 50 Hz step on the robot: from sensor readings to the drives' command.

The observation is the training environment's own (`tracking.observing.terms.see`), fed with forward kinematics of the
measured joints where the simulator would know the bodies' places.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import torch
from torch import Tensor

from bumblebee.compensation.numbers import Compensation
from bumblebee.compensation.runtime import Compensator
from bumblebee.motion.clip import Clip
from bumblebee.motion.kinematics import forward_key_positions
from bumblebee.policy.exported import ExportedPolicy
from bumblebee.robot.sensors import Sensors
from bumblebee.robot.servo_command import ServoCommand
from bumblebee.sim.engine import RobotState
from bumblebee.tracking.observing.observations import action_middle, joint_targets, middle_targets
from bumblebee.tracking.observing.terms import expanded, see
from bumblebee.tracking.sampling.library import AHEAD, MotionLibrary, ReferenceFrame

Keys = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]
"""Forward kinematics as `forward_key_positions`."""


def robot_state(sensors: Sensors, forward: Keys = forward_key_positions) -> RobotState:
    """The state that the observation takes, from readings alone; key bodies by forward kinematics."""
    keys = forward(sensors.base_pos, sensors.base_quat, sensors.joint_pos)
    return RobotState(
        root_pos_w=_float(sensors.base_pos),
        root_quat_w=_float(sensors.base_quat),
        root_lin_vel_b=_float(sensors.base_lin_vel),
        root_ang_vel_b=_float(sensors.base_ang_vel),
        joint_pos=_float(sensors.joint_pos),
        joint_vel=_float(sensors.joint_vel),
        key_pos_w=_float(keys),
    )


def _taken(sensors: Sensors, named: Sequence[str]) -> Sensors:
    """The readings with zeros for those of odometry that are not among the `named` ones, which may be no numbers."""
    known = np.array(["place" in named, "place" in named, "height" in named])
    speed = sensors.base_lin_vel if "velocity" in named else np.zeros_like(sensors.base_lin_vel)
    return replace(sensors, base_pos=np.where(known, sensors.base_pos, 0.0), base_lin_vel=speed)


class PolicyRunner:
    """One policy on B robots, each following its own clip from its first frame, and remembering it from there.

    Args:
        policy: what acts.
        library: the reference motions, as `reference_library` makes them for this policy.
        names: (B) the clip of each robot.
        compensation: what is undone at the joints; None for nothing.
        forward: forward kinematics; for one robot there is a faster one than for many.
    """

    def __init__(
        self,
        policy: ExportedPolicy,
        library: MotionLibrary,
        names: Sequence[str],
        compensation: Compensation | None = None,
        forward: Keys = forward_key_positions,
    ) -> None:
        self.policy, self._library, self._forward = policy, library, forward
        order = {name: index for index, name in enumerate(library.names)}
        self._ids = torch.tensor([order[name] for name in names])
        self._scale = torch.as_tensor(policy.scale, dtype=torch.float32)
        self._dt = 1.0 / float(policy.contract["control_hz"])
        self._last_action = torch.zeros(len(names), len(self._scale))
        self._readings = policy.sensors
        self._seen, self._middle = policy.seen, action_middle(policy.contract["action"]["base"])
        self._past: Tensor | None = None  # (B, H, D) terms of the last control steps, the oldest first
        self._memory = policy.empty_memory(len(names))
        self._begun = torch.zeros(len(names), dtype=torch.bool)
        self.compensation, self._undo = compensation, None
        if compensation is not None:
            self._undo = Compensator(compensation, library, self._ids.numpy(), self._dt)

    def hold(self) -> np.ndarray:
        """Joint targets (B, J) [rad] that carry each clip's first frame: what the servos hold before the start."""
        held = self._reference(np.arange(len(self._ids)), -1).hold_pos.numpy().astype(np.float64)
        return held if self._undo is None else self._undo.hold(held)

    def untouched(self, robots: np.ndarray, tick: int) -> np.ndarray:
        """Joint targets (n, J) [rad] of a policy that does nothing at control tick `tick`, as the drives are told."""
        target = middle_targets(self._reference(robots, tick), self._middle).numpy().astype(np.float64)
        return target if self._undo is None else self._undo.hold(target)

    def observe(self, robots: np.ndarray, tick: int, sensors: Sensors) -> Tensor:
        """Observations (n, D) of `robots` (n,) at control tick `tick`; sensors are those of these robots."""
        steps, now = self._look(robots, tick, self._seen_by_policy(sensors))
        return torch.cat((steps.flatten(1), now), dim=-1)

    def step(self, robots: np.ndarray, tick: int, sensors: Sensors) -> tuple[np.ndarray, ServoCommand]:
        """Actions (n, J) and the drives' command of `robots` (n,) at control tick `tick`."""
        rows, sensors = torch.as_tensor(robots), self._seen_by_policy(sensors)
        steps, now = self._look(robots, tick, sensors)
        memory = self._memory[robots] if tick else self.policy.empty_memory(len(rows))
        answer, self._memory[robots] = self.policy.advance(torch.cat((steps.flatten(1), now), dim=-1).numpy(), memory)
        action = torch.as_tensor(answer)
        self._last_action[rows] = action
        if self._past is None:
            self._past = torch.zeros(len(self._ids), *steps.shape[1:])
        self._past[rows], self._begun[rows] = steps, True
        wanted = joint_targets(self._reference(robots, tick), action, self._scale, self._middle)
        target = wanted.numpy().astype(np.float64)
        command = ServoCommand(target) if self._undo is None else self._undo.command(robots, tick, sensors, target)
        return action.numpy().astype(np.float64), command

    def _seen_by_policy(self, sensors: Sensors) -> Sensors:
        return sensors if self._undo is None else self._undo.seen(sensors)

    def _look(self, robots: np.ndarray, tick: int, sensors: Sensors) -> tuple[Tensor, Tensor]:
        """Observation of `robots` (n,) over time (n, H, D) and of the newest step alone (n, N).

        Before its first step a robot saw the same; tick 0 is a clip's first step, whatever was before it.
        """
        rows, seen, started = torch.as_tensor(robots), self._seen, tick > 0
        state, ref = robot_state(_taken(sensors, self._readings), self._forward), self._reference(robots, tick)
        terms, alone = (expanded(names) for names in (seen.terms, seen.now))
        last = self._last_action[rows] * started
        row = see(terms, state, ref, last)[:, None]
        before = row.expand(-1, seen.history, -1) if self._past is None else self._past[rows]
        steps = torch.where((self._begun[rows] & started)[:, None, None], torch.cat((before[:, 1:], row), dim=1), row)
        return steps, see(alone, state, ref, last) if alone else row[:, 0, :0]

    def _reference(self, robots: np.ndarray, tick: int) -> ReferenceFrame:
        ids = self._ids[torch.as_tensor(robots)]
        return self._library.frames(ids, torch.full((len(robots),), (tick + 1) * self._dt))


def reference_key(policy: ExportedPolicy) -> tuple[tuple[float, ...], bool]:
    """Key of the references that the policy needs: look-ahead times [s], and whether gravity is fed forward."""
    stated = policy.contract.get("ahead")
    ahead = tuple(map(float, stated)) if stated is not None else AHEAD[: policy.ahead]
    return ahead, policy.contract["action"].get("feed_forward") is not None


def reference_library(policy: ExportedPolicy, clips: Sequence[Clip]) -> MotionLibrary:
    """The clips as this policy was trained to see them; policies of equal `reference_key` can share one."""
    ahead, feed_forward = reference_key(policy)
    return MotionLibrary(clips, ahead, feed_forward)


def _float(values: np.ndarray) -> Tensor:
    return torch.as_tensor(np.asarray(values), dtype=torch.float32)
