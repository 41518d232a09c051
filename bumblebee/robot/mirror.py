"""Left and right of the robot by its geometry: which joint or body stands where a mirror would put another."""

from functools import cache

import mujoco
import numpy as np

from bumblebee.errors import BadInput
from bumblebee.robot.facts import BODY_OF, ROBOT, joint_names
from bumblebee.robot.model import build_model

NEAR = 0.02  # m between a joint and its partner's reflection; makers' two sides differ by a millimetre


def other_side(body: str) -> str:
    """The key body on the other side; of the trunk, the body itself."""
    role = next(role for role, name in BODY_OF.items() if name == body)
    for side, other in (("left_", "right_"), ("right_", "left_")):
        if role.startswith(side):
            return BODY_OF[other + role.removeprefix(side)]
    return body


@cache
def mirrored_joints() -> tuple[list[int], list[float]]:
    """For each joint the one on its other side, and the sign that its angle gets there.

    Raises:
        BadInput: a joint without a partner where the mirror puts it: the robot's two sides differ.
    """
    return mirrored_joints_of(build_model())


def mirrored_joints_of(model: mujoco.MjModel) -> tuple[list[int], list[float]]:
    """See `mirrored_joints`; of a model with a floating base and hinges."""
    data = mujoco.MjData(model)
    data.qpos[:3], data.qpos[3:] = 0.0, 0.0
    data.qpos[3] = 1.0
    mujoco.mj_kinematics(model, data)
    anchor, axis = data.xanchor[1:], data.xaxis[1:]
    index, sign = [], []
    for number in range(model.njnt - 1):
        place, turn = anchor[number] * (1.0, -1.0, 1.0), axis[number] * (-1.0, 1.0, -1.0)
        away = np.linalg.norm(anchor - place, axis=1)
        along = axis @ turn
        # Several joints may share an anchor: of those that are near, the one about the same axis.
        partner = int(np.argmax(np.where(away < NEAR, np.abs(along), -1.0)))
        if away[partner] >= NEAR or abs(along[partner]) < 0.9:
            name = joint_names()[number] if number < len(joint_names()) else str(number)
            nearest = f"the nearest {away.min():.3f} m beside"
            raise BadInput(f"{ROBOT}: {name}", "a partner on the robot's other side", nearest)
        index.append(partner)
        sign.append(float(np.sign(along[partner])))
    return index, sign
