"""Torque that comes back with the angle: of a motor's poles and slots, and of a gear's teeth."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from bumblebee.effects.kind import INF, Given, Kind, Parameter
from bumblebee.effects.law import POSITION, Law, Rows, waves
from bumblebee.effects.places import OnJoint, Step


def _rows(data: Any, j: int) -> Rows:
    rule, travel = data.thresholds.term_library, float(np.ptp(data.q[..., j]))
    for n in rule.cogging_harmonics:
        if n * travel > rule.cogging_travel * np.pi:
            yield waves("{}")(n), POSITION, 2, float(n), waves("{}"), rule.harmonic_reach / travel


class Cogging(Kind):
    """The torque sine sin(periods q) + cosine cos(periods q), periods a turn of the joint.

    Those of a motor behind a gear, its own times the ratio, are found up to 1,000; less where the encoder is noisy.
    """

    rank = 90
    parameters = (
        Parameter("sine", "N m", -INF, INF),
        Parameter("cosine", "N m", -INF, INF),
        Parameter("periods", "1/turn", 0.1, 2000.0),
    )
    native, absent = False, 0.0
    experiment = "turn the unpowered joint slowly"
    law = Law(_rows, "q", lambda now, was: dict(zip(waves("{}")(now[2]), now[:2], strict=True)))

    def torque_at(self, q: Any, v: Any, *values: float) -> Any:
        sine, cosine, periods = values
        angle = periods * q
        return sine * np.sin(angle) + cosine * np.cos(angle)

    def steps(self, on: OnJoint) -> Iterator[Step]:
        rule = on.rules.joint
        for n in rule.harmonics if on.hinge else ():
            if n * on.travel > np.pi:
                sizes = (rule.cogging * on.torque, rule.cogging * on.torque, float(n))
                yield Step(sizes, free=(0, 1), shape=rule.shape / on.travel)

    def torque(self, along: Any, c: Any) -> Sequence[np.ndarray]:
        return [c.step[0] * np.sin(c.step[2] * along.q), c.step[1] * np.cos(c.step[2] * along.q)]

    def undo(self, draft: Any, effect: Given, columns: Sequence[int]) -> tuple[str, str]:
        sine, cosine, periods = effect.values()
        draft.cogging += [(int(column), sine, cosine, periods) for column in columns]
        return "its mean over the coming control period is fed forward", f"up to {np.hypot(sine, cosine):.3g} N m"
