"""A baseline: inverse kinematics frame by frame with mink, in the manner of GMR (YanjieZe/GMR, a228afb).

Two stages a frame, each started from the frame before: first the orientations of all limbs with the positions of
pelvis and feet, then all positions, too; weights, damping and stopping rule are GMR's (`smplx_to_g1.json`,
`motion_retarget.py`), as is the limit on joint positions. What differs: orientations are made of landmarks
(`frames.py`), the feet's targets are the ankles (GMR's model has a toe link), sizes come from the skeleton and not
from a table, and speeds are not limited, as in GMR's first versions (with its later limit of 3 pi rad/s, at steps of
2 ms, the first frames lag behind the person).

mink is no dependency of BumbleBee: `pip install mink==1.3.0 daqp`.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.retarget.frames import orientations
from benchmarks.retarget.landmarks import scaled
from bumblebee.motion.human.motion import LANDMARKS, HumanMotion
from bumblebee.motion.raw import RawMotion
from bumblebee.robot.model import build_model

# body: landmark, then weights of position and orientation in the first and the second stage.
_TASKS: dict[str, tuple[str, tuple[float, float], tuple[float, float]]] = {
    "pelvis": ("pelvis", (100, 10), (100, 5)),
    "torso_link": ("chest", (0, 10), (0, 10)),
}
for _side in ("left", "right"):
    _TASKS |= {
        f"{_side}_hip_roll_link": (f"{_side}_hip", (0, 10), (10, 5)),
        f"{_side}_knee_link": (f"{_side}_knee", (0, 10), (10, 5)),
        f"{_side}_ankle_roll_link": (f"{_side}_ankle", (100, 10), (100, 50)),
        f"{_side}_shoulder_yaw_link": (f"{_side}_shoulder", (0, 10), (10, 5)),
        f"{_side}_elbow_link": (f"{_side}_elbow", (0, 10), (10, 5)),
        f"{_side}_wrist_yaw_link": (f"{_side}_wrist", (0, 10), (10, 5)),
    }
_DAMPING, _MOST, _ENOUGH = 0.5, 10, 1e-3  # GMR's: damping, further iterations a stage, decrease of the error


def retarget(motion: HumanMotion) -> RawMotion:
    """The motion on the G1 at its own rate."""
    positions = scaled(motion.positions)
    turns = orientations(positions)
    solver = _Solver()
    qpos = np.stack([solver.frame(positions[t], {b: r[t] for b, r in turns.items()}) for t in range(len(positions))])
    return RawMotion(motion.name, motion.fps, qpos[:, :3], qpos[:, 3:7], qpos[:, 7:], motion.file)


class _Solver:
    """The robot's configuration, carried from frame to frame."""

    def __init__(self) -> None:
        import mink

        self.mink = mink
        self.model = build_model()
        self.configuration = mink.Configuration(self.model)
        self.configuration.update_from_keyframe("stand")
        self.limits = [mink.ConfigurationLimit(self.model)]
        self.stages = [self._tasks(0), self._tasks(1)]
        self.started = False

    def frame(self, positions: np.ndarray, turns: Mapping[str, np.ndarray]) -> np.ndarray:
        """The qpos of the frame with landmarks (18, 3) and rotation matrices of the bodies."""
        if not self.started:  # as in GMR the joints start from a stand; the root starts where the person is
            qpos = self.configuration.data.qpos.copy()
            qpos[:3] = positions[0]
            qpos[3:7] = np.roll(Rotation.from_matrix(turns["pelvis"]).as_quat(), 1)
            self.configuration.update(qpos)
            self.started = True
        for stage in self.stages:
            for body, task in stage.items():
                task.set_target(self._target(positions[LANDMARKS.index(_TASKS[body][0])], turns[body]))
            self._descend(list(stage.values()))
        return self.configuration.data.qpos.copy()

    def _descend(self, tasks: list[Any]) -> None:
        """Steps until the error falls by less than GMR's limit."""
        error = self._error(tasks)
        for _ in range(_MOST + 1):
            step = self.model.opt.timestep
            velocity = self.mink.solve_ik(self.configuration, tasks, step, "daqp", _DAMPING, limits=self.limits)
            self.configuration.integrate_inplace(velocity, step)
            before, error = error, self._error(tasks)
            if before - error <= _ENOUGH:
                return

    def _error(self, tasks: list[Any]) -> float:
        return float(np.linalg.norm(np.concatenate([task.compute_error(self.configuration) for task in tasks])))

    def _target(self, position: np.ndarray, turn: np.ndarray) -> Any:
        quat = np.roll(Rotation.from_matrix(turn).as_quat(), 1)
        return self.mink.SE3.from_rotation_and_translation(self.mink.SO3(quat), position)

    def _tasks(self, stage: int) -> dict[str, Any]:
        """Tasks of mink of a stage by body."""
        made = {}
        for body, (_, *weights) in _TASKS.items():
            place, turn = weights[stage]
            made[body] = self.mink.FrameTask(body, "body", position_cost=place, orientation_cost=turn, lm_damping=1.0)
        return made
