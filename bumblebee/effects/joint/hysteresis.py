"""A spring that yields, or friction that builds up over a path: it holds where it was left."""

from collections.abc import Iterator, Sequence
from typing import Any

import mujoco
import numpy as np

from bumblebee.effects.hinges import angle_of, joint_of
from bumblebee.effects.kind import INF, Given, Kind, Parameter
from bumblebee.effects.places import OnJoint, Spot, Step
from bumblebee.errors import BadInput


class Hysteresis(Kind):
    """-amplitude z; `dahl` 0: a spring that yields at the width; 1: Dahl's law, which turns round smoothly, a hook.

    The interval is that of both forms, if neither is refuted.
    """

    rank = 80
    parameters = (
        Parameter("amplitude", "N m", 0.0, INF),
        Parameter("width", "rad", 1e-5, 3.0),
        Parameter("dahl", "", 0.0, 1.0, 0.0, choice=True),
    )
    hooked = "dahl"
    structural = True
    absent = 0.0
    beside = ("joint_spring", "asymmetric_friction")
    experiment = "move to and fro by small angles"
    law = "no term remembers a path"

    def add(self, spec: mujoco.MjSpec, place: str, *values: float) -> None:
        (amplitude, width, dahl), joint = values, joint_of(spec, place)
        if dahl:
            return
        if joint.stiffness[0]:
            raise BadInput(f"hysteresis on joint {place!r}", "a joint without a spring", "one with a stiffness")
        joint.stiffness = [amplitude / width, *joint.stiffness[1:]]
        joint.springyield = width * angle_of(spec, joint)

    def write(self, spot: Spot, *values: float) -> None:
        amplitude, width, dahl = values
        if not dahl:
            spot.model.jnt_stiffness[spot.joint], spot.model.jnt_springyield[spot.joint] = amplitude / width, width

    def reshapes(self, values: Sequence[float]) -> bool:
        return not values[2]

    def hook(self, making: Any, effect: Given) -> None:
        amplitude, width, dahl = effect.values()
        if dahl:
            making.append("hysteresis", [(column, amplitude, width) for column in making.columns(effect)])

    def steps(self, on: OnJoint) -> Iterator[Step]:
        rule = on.rules.joint
        sprung = bool(on.spot.model.jnt_stiffness[on.spot.joint])
        for share in rule.width:
            width = share * max(on.travel, rule.travel)
            for dahl in (1.0,) if sprung else (0.0, 1.0):  # MJCF has one spring a joint; Dahl's law is a hook
                yield Step((on.torque, width, dahl), shape=rule.shape * width)

    def torque(self, along: Any, c: Any) -> Sequence[np.ndarray]:
        return [-c.step[0] * (along.bent(c.step[1]) if c.step[2] else along.yielded(c.step[1]))]

    def undo(self, draft: Any, effect: Given, columns: Sequence[int]) -> tuple[str, str]:
        amplitude, width, dahl = effect.values()
        draft.hysteresis += [(int(column), amplitude, width, float(dahl)) for column in columns]
        share = draft.limits.friction_share
        return f"{100 * share:.0f} % fed forward along the reference's own path", f"up to {share * amplitude:.3g} N m"
