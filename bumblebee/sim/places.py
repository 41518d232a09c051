"""Where the bodies of many robots are, from their positions alone.

A step of `mujoco.batch` leaves the bodies where its last physics step began. To ask it for their later places computes
contacts and constraints too, and to keep those for the next step takes a `MjData` a world, whose memory is slower than
computing the kinematics here.
"""

import copy
from collections.abc import Mapping

import mujoco
import numpy as np
from mujoco.batch import Batch

_POS = int(mujoco.mjtStage.mjSTAGE_POS)
_FIELDS = {"body_pos", "body_quat", "jnt_pos", "jnt_axis", "qpos0"}


class Places:
    """The bodies of `num_worlds` copies of `model`, found on `threads` threads."""

    def __init__(self, model: mujoco.MjModel, num_worlds: int, threads: int) -> None:
        self._batch = Batch(_kinematics_only(model), num_worlds, threads)
        self._qpos = self._batch.bind("qpos")
        self.xpos, self.xquat = self._batch.bind("xpos"), self._batch.bind("xquat")
        """(B, bodies, 3) [m] and (B, bodies, 4) wxyz in the world."""

    def find(self, qpos: np.ndarray, ids: np.ndarray | None = None) -> None:
        """Put the bodies of all worlds, or of the worlds `ids` (n,), where positions qpos (B, nq) or (n, nq) say."""
        if ids is not None and len(ids) == 0:
            return
        self._qpos[slice(None) if ids is None else ids] = qpos
        self._batch.forward(ids=ids, stage=_POS)

    def set_fields(self, fields: Mapping[str, np.ndarray]) -> None:
        """See `Engine.set_fields`: those that move bodies."""
        for name in _FIELDS & set(fields):
            self._batch.expand(name)[:] = fields[name]


def _kinematics_only(model: mujoco.MjModel) -> mujoco.MjModel:
    """The model for kinematics alone: nothing touches anything, nothing is felt."""
    ghost = copy.copy(model)
    off = mujoco.mjtDisableBit
    ghost.opt.disableflags |= int(off.mjDSBL_CONTACT) | int(off.mjDSBL_CONSTRAINT) | int(off.mjDSBL_SENSOR)
    return ghost
