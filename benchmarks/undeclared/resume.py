"""A true robot started again in the middle of what it did: from its readings, as any model must.

What the readings determine is as it was: positions and speeds behind known faults, what filters, delay lines and heat
remember of the commands and readings before. What they do not determine is guessed from them, by `Law.settle`: the side
on which play touches, the twist of a shaft, the lean of a mount.
"""

from collections.abc import Callable, Sequence
from copy import copy
from typing import Any

import mujoco
import numpy as np

from bumblebee.stand_in.undeclared.declared import Declared
from bumblebee.stand_in.undeclared.law import Law, Seen
from bumblebee.stand_in.undeclared.signals import Line
from bumblebee.stand_in.undeclared.simulation import TrueRobots


def resumed(
    robot: Declared,
    moments: Sequence[Sequence[Law]],
    picks: np.ndarray,
    state: tuple[np.ndarray, np.ndarray],
    seen: Seen,
    time: np.ndarray,
    moved: Callable[[mujoco.MjModel, np.ndarray, np.ndarray], None] | None = None,
    guess: bool = True,
) -> TrueRobots:
    """W robots with the laws that one robot had at each of W moments.

    Args:
        robot: what is declared of it.
        moments: the laws at every tick, each with the memory of R robots.
        picks: (W, 2) robot and tick.
        state: (W, nq') and (W, nv') of the true model then.
        seen: what the sensors said then.
        time: (W,) since the start [s].
        moved: puts noise into a model's states (W, nq'), (W, nv'), in place.
        guess: whether what readings do not determine is guessed; else it is as it was.
    """
    laws = gathered(moments, picks)
    robots = TrueRobots(robot, laws, len(picks), np.random.default_rng(0))
    qpos, qvel = (x.copy() for x in state)
    if moved is not None:
        moved(robots.model, qpos, qvel)
    for law in laws if guess else ():
        law.settle(robots.model, seen, qpos, qvel)
    robots.resume(qpos, qvel, seen.torque, time)
    return robots


def gathered(moments: Sequence[Sequence[Law]], picks: np.ndarray) -> list[Law]:
    """The laws with the memory of robot r at tick k for each row (r, k) of `picks`; memory is what begins with `_`."""
    out = []
    for i, law in enumerate(moments[int(picks[0, 1])]):
        new = copy(law)
        for name in [n for n in vars(law) if n.startswith("_")]:
            setattr(new, name, _rows([vars(moments[k][i])[name] for k in picks[:, 1]], picks[:, 0]))
        out.append(new)
    return out


def _rows(values: list[Any], robots: np.ndarray) -> Any:
    """Row r of each value, (W,); what is not one number a robot is the same for all."""
    if isinstance(values[0], Line):
        line = copy(values[0])
        pasts = zip(*(value.past for value in values), strict=True)
        line.past = [_rows(list(past), robots) for past in pasts]
        return line
    if isinstance(values[0], np.ndarray):
        return np.array([value[r] for value, r in zip(values, robots, strict=True)])
    return values[0]
