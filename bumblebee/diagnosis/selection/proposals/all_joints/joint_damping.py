"""A servo's kd and its joint's viscous friction are one sum: told as friction where there is more, else as a lower kd.

Fitted together they may end anywhere along it, a third of the gain and seven times the friction among them. A friction
cannot be less than none, so kd is for what the declared gain has too much. A servo that is told target velocities, or
that reaches its limit, tells the two apart, and both stay.
"""

import numpy as np

from bumblebee.diagnosis.candidates import Candidate, effects_at
from bumblebee.diagnosis.estimation import Fit, cost_of
from bumblebee.diagnosis.residuals import Problem, window_weights
from bumblebee.sim.servo import servos_of

_GAIN, _FRICTION, _STRENGTH = "kd", "viscous_friction", "motor_strength"


def one_damping(problem: Problem, fit: Fit) -> tuple[list[Candidate], np.ndarray]:
    """A fit's effects and values (P,) with one effect on each joint's damping, wherever that does as well."""
    rule = problem.thresholds.selection.proposals.all_joints
    chosen, values = list(fit.chosen), [fit.of(c) for c in fit.chosen]
    weights = window_weights(fit.clean(problem))
    cost = cost_of(problem, fit.residual, weights)[0]
    for where in sorted({c.where for c in chosen if c.effect == _GAIN}):
        mine = {c.effect: k for k, c in enumerate(chosen) if c.where == where and c.effect in (_GAIN, _FRICTION)}
        if len(mine) < 2:
            continue
        gain, friction = chosen[mine[_GAIN]], chosen[mine[_FRICTION]]
        joint = int(problem.plant.model.joint(where).id)
        strength = next((float(fit.of(c)[0]) for c in chosen if (c.effect, c.where) == (_STRENGTH, where)), 1.0)
        declared = -strength * float(servos_of(problem.plant.model, [joint]).bias[0, 2])
        nominal = friction.nominal[0]
        more = (float(values[mine[_GAIN]][0]) - 1.0) * declared + float(values[mine[_FRICTION]][0]) - nominal
        left, value = (friction, nominal + more) if more >= 0 or declared <= 0 else (gain, 1.0 + more / declared)
        kept = [k for k in range(len(chosen)) if k not in mine.values()]
        less, those = [*(chosen[k] for k in kept), left], [*(values[k] for k in kept), left.clip([value])]
        new = cost_of(problem, problem.residual([effects_at(less, np.concatenate(those))])[0], weights)[0]
        if new <= (1 + rule.one_damping) * cost:
            chosen, values, cost = less, those, min(cost, new)
    return chosen, np.concatenate(values) if values else np.empty(0)
