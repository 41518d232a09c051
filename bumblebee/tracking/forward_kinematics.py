"""Forward kinematics in torch: places of bodies from root pose and joint angles, batched and differentiable.

MuJoCo gives no gradients of its kinematics through torch. A kept library (pytorch_kinematics) takes one chain a robot
and has a parser of its own; here the model is compiled already, and all bodies of a level are one operation.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import torch
from torch import Tensor

from bumblebee.errors import BadInput
from bumblebee.sim.rotations import multiply, rotate


@dataclass(frozen=True)
class _Level:
    """Bodies of one depth of the tree."""

    parent: Tensor
    """(n,) places of their parents in the list of bodies so far."""
    offset: Tensor
    """(n, 3) [m] in the parent's frame."""
    turn: Tensor
    """(n, 4) fixed orientation in the parent's frame, wxyz."""
    joint: Tensor
    """(n,) column of the joint angles; the last column, which is always 0, for a body without a joint."""
    axis: Tensor
    """(n, 3) axis of the hinge in the body's frame."""


class ForwardKinematics:
    """Places of some bodies of a robot with a free base.

    Args:
        model: free base first, then hinges whose axes go through their bodies' origins.
        bodies: names, in the order of the result; the base's own among them if it is wanted.
        device: where the results are wanted.

    Raises:
        BadInput: for a model of another form.
    """

    def __init__(self, model: mujoco.MjModel, bodies: Sequence[str], device: torch.device | str = "cpu") -> None:
        hinges = range(1, model.njnt)
        free = model.njnt > 0 and model.jnt_type[0] == mujoco.mjtJoint.mjJNT_FREE
        centred = all(model.jnt_type[j] == mujoco.mjtJoint.mjJNT_HINGE and not model.jnt_pos[j].any() for j in hinges)
        if not (free and centred and (model.body_jntnum <= 1).all()):
            raise BadInput("model", "a free base, then hinges at the bodies' origins, one a body", "another form")
        base, wanted = int(model.jnt_bodyid[0]), [model.body(name).id for name in bodies]
        order, depth = [base], {base: 0}
        needed = _between(model, wanted, base)
        for body in needed:  # parents come first
            depth[body] = depth[int(model.body_parentid[body])] + 1
        self._levels: list[_Level] = []
        for at in range(1, max(depth.values()) + 1):
            own = [body for body in needed if depth[body] == at]
            self._levels.append(_level(model, own, order, device))
            order += own
        self._chosen = torch.tensor([order.index(body) for body in wanted], device=device)

    def __call__(self, root_pos_w: Tensor, root_quat_w: Tensor, joint_pos: Tensor) -> tuple[Tensor, Tensor]:
        """Positions (B, K, 3) [m] and orientations (B, K, 4) wxyz of the bodies in the world.

        Args:
            root_pos_w: (B, 3) [m].
            root_quat_w: (B, 4) wxyz, of unit length.
            joint_pos: (B, J) [rad].
        """
        half = torch.nn.functional.pad(joint_pos, (0, 1))[..., None] / 2
        cosine, sine = half.cos(), half.sin()  # (B, J + 1, 1)
        place, turn = root_pos_w[:, None], root_quat_w[:, None]
        for level in self._levels:
            above = turn.index_select(1, level.parent)
            moved = rotate(above, level.offset.expand_as(above[..., 1:]))
            cos, sin = (part.index_select(1, level.joint) for part in (cosine, sine))
            own = torch.cat((cos, sin * level.axis), dim=-1)
            turn = torch.cat((turn, multiply(multiply(above, level.turn.expand_as(above)), own)), dim=1)
            place = torch.cat((place, place.index_select(1, level.parent) + moved), dim=1)
        return place.index_select(1, self._chosen), turn.index_select(1, self._chosen)


def _between(model: mujoco.MjModel, bodies: Sequence[int], base: int) -> list[int]:
    """Bodies from the base (not included) to `bodies` (included), parents first."""
    found: set[int] = set()
    for body in bodies:
        while body not in (base, 0):
            found.add(body)
            body = int(model.body_parentid[body])
    return sorted(found)


def _level(model: mujoco.MjModel, own: list[int], order: Sequence[int], device: torch.device | str) -> _Level:
    joints = [int(model.body_jntadr[body]) for body in own]  # -1 without a joint

    def column(values: object) -> Tensor:
        return torch.as_tensor(values, dtype=torch.float32, device=device)

    return _Level(
        parent=torch.tensor([order.index(int(model.body_parentid[body])) for body in own], device=device),
        offset=column(model.body_pos[own]),
        turn=column(model.body_quat[own]),
        joint=torch.tensor([(j if j > 0 else model.njnt) - 1 for j in joints], device=device),
        axis=column(model.jnt_axis[joints]),
    )
