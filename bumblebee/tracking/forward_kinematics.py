"""Forward kinematics in torch: places of bodies from root pose and joint angles, batched and differentiable.

MuJoCo gives no gradients of its kinematics through torch. A kept library (pytorch_kinematics) takes one chain a robot
and has a parser of its own; here the model is compiled already. Time is counted in launches of small kernels, so all
chains of the robot are followed at once, padded to one length, and the gradient is that of mechanics: the moment about
each joint's axis of what pulls at the bodies that it carries.
"""

from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np
import torch
from torch import Tensor, nn

from bumblebee.errors import BadInput
from bumblebee.sim.rotations import rotate
from bumblebee.tracking.chains import Chains, chains_of


class ForwardKinematics(nn.Module):
    """Places of some bodies of a robot with a free base.

    Args:
        model: free base first, then hinges whose axes go through their bodies' origins.
        bodies: names, in the order of the result; the base's own among them if it is wanted.
        device: where the results are wanted.

    Raises:
        BadInput: for a model of another form.
    """

    def __init__(self, model: mujoco.MjModel, bodies: Sequence[str], device: torch.device | str = "cpu") -> None:
        super().__init__()
        hinges = range(1, model.njnt)
        free = model.njnt > 0 and model.jnt_type[0] == mujoco.mjtJoint.mjJNT_FREE
        centred = all(model.jnt_type[j] == mujoco.mjtJoint.mjJNT_HINGE and not model.jnt_pos[j].any() for j in hinges)
        if not (free and centred and (model.body_jntnum <= 1).all()):
            raise BadInput("model", "a free base, then hinges at the bodies' origins, one a body", "another form")
        chains = chains_of(model, [model.body(name).id for name in bodies])
        for name, table in _tables(chains).items():
            dtype = torch.long if table.dtype.kind == "i" else torch.float32
            self.register_buffer(name, torch.as_tensor(table, dtype=dtype, device=device), persistent=False)

    def forward(self, root_pos_w: Tensor, root_quat_w: Tensor, joint_pos: Tensor) -> tuple[Tensor, Tensor]:
        """Positions (B, K, 3) [m] and orientations (B, K, 4) wxyz of the bodies in the world.

        Args:
            root_pos_w: (B, 3) [m].
            root_quat_w: (B, 4) wxyz, of unit length; its gradient is that of turns alone.
            joint_pos: (B, J) [rad].
        """
        return _Places.apply(root_pos_w, root_quat_w, joint_pos, *self.buffers())


def _tables(chains: Chains) -> dict[str, np.ndarray]:
    """Constants that `_Places` takes after its inputs, in its order."""
    return {
        "column": chains.column.ravel(),
        "even": _after(chains.turn),
        "odd": _after(_times(chains.turn, np.insert(chains.axis, 0, 0.0, axis=-1))),
        "offset": chains.offset,
        "carrier": chains.carrier,
        "reach": chains.reach,
        "fixed": _after(chains.fixed),
        "place_of": chains.place_of,
        "axis": chains.joint_axis,
        "carries": chains.carries,
    }


def _times(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Products of quaternions (..., 4)."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for at in np.ndindex(out.shape[:-1]):
        mujoco.mju_mulQuat(out[at], np.broadcast_to(a, out.shape)[at], np.broadcast_to(b, out.shape)[at])
    return out


def _after(turn: np.ndarray) -> np.ndarray:
    """Matrices (..., 4, 4) whose product with a row q is the quaternion q times `turn` (..., 4)."""
    return _times(np.eye(4), turn[..., None, :])


class _Places(torch.autograd.Function):
    """`ForwardKinematics.forward` and its gradient, with the robot's tables as further arguments."""

    @staticmethod
    def forward(
        ctx: Any,
        root: Tensor,
        quat: Tensor,
        angle: Tensor,
        column: Tensor,
        even: Tensor,
        odd: Tensor,
        offset: Tensor,
        carrier: Tensor,
        reach: Tensor,
        fixed: Tensor,
        place_of: Tensor,
        axis: Tensor,
        carries: Tensor,
    ) -> tuple[Tensor, Tensor]:
        half = torch.nn.functional.pad(angle, (0, 1)).index_select(1, column).unflatten(1, even.shape[:2]) / 2
        cosine, sine = half.cos()[..., None, None], half.sin()[..., None, None]
        turns = [quat[:, None].expand(-1, even.shape[1], -1)]
        for own in torch.addcmul(cosine * even, sine, odd).unbind(1):
            turns.append(_turned_on(turns[-1], own))
        turn = torch.stack(turns, dim=1)  # (B, L + 1, C, 4), the base first
        places = [torch.zeros_like(turn[:, 0, :, 1:])]  # from the root
        for shift in _rotated(turn[:, :-1], offset).unbind(1):
            places.append(places[-1] + shift)
        turn, place = turn.flatten(1, 2), torch.stack(places, dim=1).flatten(1, 2)
        at = turn.index_select(1, carrier)
        found = place.index_select(1, carrier) + _rotated(at, reach)
        turned = _turned_on(at, fixed)
        axes, origins = _rotated(turn.index_select(1, place_of), axis), place.index_select(1, place_of)
        ctx.save_for_backward(quat, found, turned, axes, origins, carries)
        return root[:, None] + found, turned

    @staticmethod
    def backward(ctx: Any, pull: Tensor, twist: Tensor) -> tuple[Tensor | None, ...]:
        quat, found, turned, axes, origins, carries = ctx.saved_tensors
        tw, tv, qw, qv = twist[..., :1], twist[..., 1:], turned[..., :1], turned[..., 1:]
        moment = (qw * tv - tw * qv - torch.linalg.cross(tv, qv)) / 2 + torch.linalg.cross(found, pull)
        force, moment = (carries @ torch.cat((pull, moment), dim=-1)).split(3, dim=-1)  # (B, J + 1, 3), all last
        angle = (axes * (moment[:, :-1] - torch.linalg.cross(origins, force[:, :-1]))).sum(-1)
        m, w, v = moment[:, -1], quat[:, :1], quat[:, 1:]
        turn = 2 * torch.cat((-(m * v).sum(-1, keepdim=True), w * m + torch.linalg.cross(m, v)), dim=-1)
        return force[:, -1], turn, angle, *[None] * 10


def _turned_on(quat: Tensor, after: Tensor) -> Tensor:
    """Quaternions (..., 4) times those of the matrices (..., 4, 4) of `_after`."""
    return (quat[..., None] * after).sum(-2)


def _rotated(quat: Tensor, vectors: Tensor) -> Tensor:
    """Vectors (..., 3), of all robots alike, turned by quaternions (B, ..., 4)."""
    return rotate(quat, vectors.expand_as(quat[..., 1:]))
