"""Small motions for the tests: the G1 swaying on the floor, as arrays, clips, CSV files and pickles."""

from dataclasses import dataclass, replace
from pathlib import Path

import joblib
import numpy as np
import pytest

from bumblebee import quaternions
from bumblebee.motion.clip import Clip
from bumblebee.motion.kinematics import lowest, make_clip, sole_points
from bumblebee.motion.raw import RawMotion
from bumblebee.robot.facts import joint_names, joints, stand_pose


def standing(root_quat: np.ndarray, joint_pos: np.ndarray) -> np.ndarray:
    """Positions of the root with which the left sole stays where it is, and the robot on the floor."""
    root_pos = np.tile([0.0, 0.0, 0.8], (len(root_quat), 1))
    sole = sole_points(root_pos, root_quat, joint_pos)[:, 0].mean(axis=1)
    root_pos[:, :2] -= (sole - sole[0])[:, :2]
    root_pos[:, 2] -= lowest(root_pos, root_quat, joint_pos)
    return root_pos


@dataclass(frozen=True)
class Motions:
    """Makers of test motions; each starts from the same sway, which keeps every rule and every check."""

    folder: Path

    def raw(self, frames: int = 80, fps: float = 30.0, yaw: float = 0.4, **changed) -> RawMotion:
        time = np.arange(frames) / fps
        joint_pos = stand_pose() + 0.1 * np.sin(2 * np.pi * 0.5 * time)[:, None] * np.linspace(0.2, 1, 23)
        half = (yaw + 0.2 * np.sin(time)) / 2
        root_quat = np.stack([np.cos(half), 0 * half, 0 * half, np.sin(half)], axis=1)
        root_pos = standing(root_quat, joint_pos)
        raw = RawMotion("sway", fps, root_pos, root_quat, joint_pos, self.folder / "sway.csv")
        return replace(raw, **changed)

    def clip(self, name: str = "sway", frames: int = 80, **about) -> Clip:
        raw = self.raw(frames, fps=50.0)
        return make_clip(name, 50.0, raw.root_pos, raw.root_quat, raw.joint_pos, **about)

    def csv(self, raw: RawMotion, name: str = "sway.csv", dof: int = 29, header: str = "", order: str = "xyzw") -> Path:
        joints = np.zeros((len(raw.root_pos), dof))
        for column, joint in enumerate(joint_names()):
            joints[:, joint_names(every=dof == 29).index(joint)] = raw.joint_pos[:, column]
        quat = raw.root_quat[:, ["wxyz".index(axis) for axis in order]]
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        table = np.concatenate([raw.root_pos, quat, joints], axis=1)
        np.savetxt(path, table, fmt="%.9f", delimiter=",", header=header, comments="")
        return path

    def pickle(self, raw: RawMotion, name: str = "sway.pkl", compress: int | tuple = 0, **changed) -> Path:
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        joblib.dump({"sway": self.fields(raw, **changed)}, path, compress=compress)
        return path

    @staticmethod
    def fields(raw: RawMotion, **changed) -> dict:
        """ASAP's fields, `pose_aa` among them: it tells the layout of the joints and the quaternion's order."""
        return {
            "pose_aa": pose_of(raw),
            "root_trans_offset": raw.root_pos.astype(np.float32),
            "root_rot": raw.root_quat[:, [1, 2, 3, 0]],
            "dof": np.asfortranarray(raw.joint_pos.astype(np.float32)),
            "fps": int(raw.fps),
            **changed,
        }


def pose_of(raw: RawMotion, dof: int = 23, extended: int = 3) -> np.ndarray:
    """`pose_aa` (T, 1 + dof + extended, 3) [rad]: rotation vectors of the root, the joints and bodies without one."""
    pose = np.zeros((len(raw.root_pos), 1 + dof + extended, 3))
    pose[:, 0] = quaternions.rotation_vector(raw.root_quat)
    for column, joint in enumerate(joints()):
        pose[:, 1 + joint_names(every=dof == 29).index(joint.name)] = raw.joint_pos[:, column, None] * np.array(
            joint.axis
        )
    return pose


@pytest.fixture
def motions(tmp_path: Path) -> Motions:
    return Motions(tmp_path)
