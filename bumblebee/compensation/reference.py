"""Reference motions as a compensation needs them: targets, velocities, accelerations, holding torques."""

from collections.abc import Sequence

import mujoco
import numpy as np
import torch

from bumblebee.compensation.numbers import Compensation, Load
from bumblebee.errors import BadInput
from bumblebee.motion.clip import Clip, differences, velocities
from bumblebee.robot.facts import joint_names, joints
from bumblebee.robot.model import build_model
from bumblebee.sim.effects import bent
from bumblebee.tracking.feed_forward import static_torques
from bumblebee.tracking.sampling.library import MotionLibrary


class ReferenceTable:
    """Rows of several clips, looked up at times that differ by joint.

    Args:
        compensation: what is asked for; columns that it does not need are zeros.
        library: the clips.

    Raises:
        BadInput: if the weight of a load asks for more torque on a clip than may be sent.
    """

    def __init__(self, compensation: Compensation, library: MotionLibrary) -> None:
        self._fps = library.fps
        self._frames = np.array([clip.frames for clip in library.clips])
        self._start = np.cumsum(self._frames) - self._frames
        names = ("hold", "lead", "speed", "acceleration", "weight", "bent")
        rows: dict[str, list[np.ndarray]] = {name: [] for name in names}
        for index, clip in enumerate(library.clips):
            time = torch.arange(clip.frames) / library.fps
            frames = library.frames(torch.full((clip.frames,), index), time)
            rows["hold"].append(frames.hold_pos.numpy())
            rows["lead"].append(frames.lead.numpy())
            speed = velocities(clip).joint_vel
            rows["speed"].append(speed)
            rows["acceleration"].append(differences(speed, clip.fps))
            weight = _weight(compensation, clip)
            _check_weight(compensation, clip, weight)
            rows["weight"].append(weight)
            rows["bent"].append(_bent(compensation, clip))
        self._rows = {name: np.concatenate(parts).astype(np.float64) for name, parts in rows.items()}

    def at(self, name: str, clips: np.ndarray, frame: np.ndarray) -> np.ndarray:
        """Values (n, J) of the clips (n,) at frames (J,), fractions included; at rest beyond a clip's end."""
        last = (self._frames[clips] - 1)[:, None]
        place = np.clip(frame[None], 0.0, last)
        low = np.floor(place).astype(int)
        share = place - low
        columns, first = np.arange(len(frame)), self._start[clips][:, None]
        table = self._rows[name]
        value = (1 - share) * table[first + low, columns] + share * table[first + np.minimum(low + 1, last), columns]
        moving = name in ("speed", "acceleration")
        return np.where(frame[None] <= last, value, 0.0) if moving else value


def _weight(compensation: Compensation, clip: Clip) -> np.ndarray:
    """Torques (T, J) [N m] that the loads' weight adds to what holds the clip."""
    if not compensation.loads:
        return np.zeros(clip.joint_pos.shape)
    declared, true = (static_torques(clip, _model(compensation.loads, which)) for which in (0, 1))
    return true - declared


def _model(loads: Sequence[Load], which: int) -> mujoco.MjModel:
    """The G1 with the declared (0) or the true (1) masses."""
    model = build_model()
    for load in loads:
        body = model.body(load.body).id
        model.body_mass[body], model.body_ipos[body] = load.mass[which], load.com[which]
    mujoco.mj_setConst(model, mujoco.MjData(model))
    return model


def _check_weight(compensation: Compensation, clip: Clip, weight: np.ndarray) -> None:
    effort = np.array([joint.effort_limit for joint in joints()])
    share = np.abs(weight / compensation.strength / effort).max(axis=0)
    worst, most = int(np.argmax(share)), compensation.limits.torque_share
    if share[worst] > most:
        raise BadInput(
            f"compensation on the motion {clip.name}: {joint_names()[worst]}",
            f"feed-forward torque of at most {most:g} of the effort limit",
            f"{share[worst]:.2g} for the weight of {', '.join(load.body for load in compensation.loads)}",
            "Leave the link's mass out, or the motion.",
        )


def _bent(compensation: Compensation, clip: Clip) -> np.ndarray:
    """Torque (T, J) [N m] against which the hysteresis on the reference's own path acts, from unloaded on."""
    out = np.zeros(clip.joint_pos.shape)
    for column, amplitude, width, dahl in compensation.hysteresis:
        path = np.diff(clip.joint_pos[:, column].astype(np.float64))
        z = np.zeros(1)
        for t, way in enumerate(path, 1):
            z = bent(z, np.array([way]), width) if dahl else np.clip(z + way / width, -1.0, 1.0)
            out[t, column] += amplitude * z[0]
    return out
