"""Measured rollouts as tensors to replay: where the robot was, what it was told, tick by tick.

The state of a recording is what the engine needs to start from (paper, section 3.3.2: base velocity, orientation,
angular velocity, joint positions and velocities). Velocities are the measured ones, not differences.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
import torch
from scipy.spatial.transform import Rotation
from torch import Tensor

from bumblebee.errors import BadInput
from bumblebee.measured.rollout import Rollout
from bumblebee.robot.facts import FEET, joint_names
from bumblebee.sim.engine import RobotState
from bumblebee.sim.rotations import rotate_inverse

_NEEDED = ("joint_target", "base_quat", "base_ang_vel", "base_lin_vel")


@dataclass(frozen=True)
class Recordings:
    """R rollouts laid end to end in N rows.

    `qpos` (N, 7 + J) and `qvel` (N, 6 + J) in MuJoCo's convention, joints as the encoders read them; `targets`
    (N, J) [rad]; `start` and `length` (R,) rows of each rollout; `ids` their names; `motions` what they follow, ""
    where a rollout does not say it.
    """

    qpos: Tensor
    qvel: Tensor
    targets: Tensor
    start: Tensor
    length: Tensor
    ids: tuple[str, ...]
    motions: tuple[str, ...]

    def to(self, device: torch.device | str) -> "Recordings":
        """Copy to a device."""
        moved = {name: getattr(self, name).to(device) for name in ("qpos", "qvel", "targets", "start", "length")}
        return Recordings(**moved, ids=self.ids, motions=self.motions)

    def windows(self, frames: int, stride: int) -> Tensor:
        """First rows of all windows of `frames` steps, every `stride` rows of each longer rollout, (W,)."""
        device = self.start.device
        rows = [
            torch.arange(int(first), int(first) + max(int(length) - frames, 0), stride, device=device)
            for first, length in zip(self.start, self.length, strict=True)
        ]
        return torch.cat(rows) if rows else torch.zeros(0, dtype=torch.long, device=device)

    def owner(self, rows: Tensor) -> Tensor:
        """Index of the rollout that each row belongs to."""
        return torch.bucketize(rows, self.start, right=True) - 1

    def motion(self, rows: Tensor) -> Tensor:
        """Index of the motion that each row belongs to, in the order in which motions come first."""
        order = {name: index for index, name in enumerate(dict.fromkeys(self.motions))}
        return torch.tensor([order[name] for name in self.motions], device=rows.device)[self.owner(rows)]


def recorded_state(recordings: Recordings, rows: Tensor | slice = slice(None)) -> RobotState:
    """Recorded rows, all or some, as states; the key bodies, which a delta action does not see, are left at zero."""
    qpos, qvel = recordings.qpos[rows], recordings.qvel[rows]
    return RobotState(
        root_pos_w=qpos[:, :3],
        root_quat_w=qpos[:, 3:7],
        root_lin_vel_b=rotate_inverse(qpos[:, 3:7], qvel[:, :3]),
        root_ang_vel_b=qvel[:, 3:6],
        joint_pos=qpos[:, 7:],
        joint_vel=qvel[:, 6:],
        key_pos_w=torch.zeros(len(qpos), 14, 3),
    )


def stack(rollouts: Sequence[Rollout], model: mujoco.MjModel) -> Recordings:
    """Lay rollouts of the G1 end to end, columns in `joint_names()` order.

    Raises:
        BadInput: for another robot, or if a column that the replay needs was not logged.
    """
    if not rollouts:
        raise BadInput("replay", "at least one measured rollout", "none")
    parts = [_states(rollout, model) for rollout in rollouts]
    lengths = torch.tensor([len(qpos) for qpos, _, _ in parts])
    qpos, qvel, targets = (torch.as_tensor(np.concatenate(c), dtype=torch.float32) for c in zip(*parts, strict=True))
    ids, motions = tuple(r.rollout_id for r in rollouts), tuple(str(r.meta.get("motion") or "") for r in rollouts)
    return Recordings(qpos, qvel, targets, lengths.cumsum(0) - lengths, lengths, ids, motions)


def _states(rollout: Rollout, model: mujoco.MjModel) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    target, quat, spin, speed = (_logged(rollout, column) for column in _NEEDED)
    if other := sorted(set(rollout.joints) ^ set(joint_names())):
        came = f"{len(rollout.joints)} joints, of which {other[0]} is in one alone"
        raise BadInput(f"{rollout.rollout_id}: joints", f"the G1's {len(joint_names())}", came, "Leave it out.")
    order = [rollout.joints.index(name) for name in joint_names()]
    joints = rollout.joint_pos[:, order]
    turn = Rotation.from_quat(quat, scalar_first=True)
    velocity_w = turn.apply(speed)
    position = (
        rollout.base_pos if rollout.base_pos is not None else _odometry(rollout.time, quat, joints, velocity_w, model)
    )
    qpos = np.concatenate([position, quat, joints], axis=1)
    qvel = np.concatenate([velocity_w, spin, rollout.joint_vel[:, order]], axis=1)
    return qpos, qvel, target[:, order]


def _logged(rollout: Rollout, column: str) -> np.ndarray:
    values = getattr(rollout, column)
    if values is None:
        do = "Log it, or leave the rollout out of the delta stage."
        raise BadInput(f"{rollout.rollout_id}: column {column}", "a logged column", "none", do)
    return values


def _odometry(
    time: np.ndarray, quat: np.ndarray, joints: np.ndarray, velocity_w: np.ndarray, model: mujoco.MjModel
) -> np.ndarray:
    """Root positions (T, 3) without motion capture: velocity integrated, height such that the lowest sole is at 0."""
    steps = np.diff(time)[:, None] * 0.5 * (velocity_w[1:] + velocity_w[:-1])
    position = np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    data = mujoco.MjData(model)
    soles = [g for g in range(model.ngeom) if model.body(model.geom_bodyid[g]).name in FEET]
    data.qpos[2], data.qpos[3:7], data.qpos[7:] = 0.0, quat[0], joints[0]
    mujoco.mj_kinematics(model, data)
    lowest = min(data.geom_xpos[g, 2] - model.geom_size[g, 0] for g in soles)
    return position - [0.0, 0.0, lowest]
