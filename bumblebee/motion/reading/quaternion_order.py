"""The order of the root's quaternion, told by the whole motion: a foot that stands does not move.

Read in the wrong order a robot turns to another side, lies, or walks backwards, while its root and its legs go on as
before, so that the foot which should stand is carried along. Of 169 motions on the G1 at 5 headings each, the wrong
order moved the foot that moves least at least 1.2 times as fast, 5 times in the median.
"""

from dataclasses import replace

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.motion.kinematics import sole_points
from bumblebee.motion.raw import RawMotion, as_wxyz
from bumblebee.motion.reading.remedy import say

_PAIRS = 300  # of neighbouring frames, spread over the motion
_SURE = 0.85  # of the speed in the order that does not hold


def settled(raw: RawMotion) -> RawMotion:
    """The motion with its root's quaternions in the order that holds, and a note where that is not the format's.

    Args:
        raw: finite, with quaternions of length 1.

    Raises:
        BadInput: the motion does not tell the order and nobody states it, or tells another than the file states.
    """
    if raw.order_from == "known":
        return raw
    speeds = {order: standing_speed(raw, order) for order in dict.fromkeys((raw.quat_order, "xyzw", "wxyz"))}
    best = min(speeds, key=lambda order: speeds[order])
    sure = all(speeds[best] < _SURE * speed for order, speed in speeds.items() if order != best)
    if (sure and best == raw.quat_order) or (not sure and raw.order_from == "file"):
        return raw
    seen = " and ".join(f"{speed:.2g} m/s as {order}" for order, speed in speeds.items())
    if sure and not raw.order_from:
        note = f"root quaternions {best}: the foot that stands moves at {seen}"
        return replace(raw, root_quat=_read_as(raw, best), quat_order=best, order_from="file", notes=(*raw.notes, note))
    wanted = "the order of the root's quaternion" + (f", {raw.quat_order} as the file says" if raw.order_from else "")
    came = f"a motion that {'contradicts it' if sure else 'does not tell it'} (the foot that stands moves at {seen})"
    do = say({"quaternion": "xyzw"}, {"quaternion": "wxyz"})
    raise BadInput(f"{raw.where}, root quaternion", wanted, came, do)


def standing_speed(raw: RawMotion, order: str) -> float:
    """Mean speed of whichever sole moves least, with the file's quaternions in an order [m/s]."""
    starts = np.unique(np.linspace(0, len(raw.root_pos) - 2, _PAIRS).round().astype(int))
    pair = np.stack([starts, starts + 1])  # (2, N)
    rows = pair.reshape(-1)
    soles = sole_points(raw.root_pos[rows], _read_as(raw, order)[rows], raw.joint_pos[rows]).reshape(2, -1, 2, 4, 3)
    moved = np.linalg.norm(soles[1] - soles[0], axis=-1).mean(axis=-1)  # (N, 2)
    return float(moved.min(axis=1).mean()) * raw.fps


def _read_as(raw: RawMotion, order: str) -> np.ndarray:
    """The file's quaternions (T, 4) taken for those of an order, as wxyz."""
    file = raw.root_quat[:, ["wxyz".index(part) for part in raw.quat_order]]
    return as_wxyz(file, order)
