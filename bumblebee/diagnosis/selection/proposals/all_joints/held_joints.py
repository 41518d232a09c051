"""A joint that hardly moves is held by dry friction, not by a damping of several times its servo's own.

While a joint stands, any friction that is large enough holds it, and a fit of viscous friction and of the servo's kd
ends anywhere. Where it moves, in another motion, ten times the damping keeps it back by as much, and dry friction by
next to nothing.
"""

import numpy as np

from bumblebee.diagnosis.candidates import Candidate, effects_at
from bumblebee.diagnosis.estimation import Fit, cost_of
from bumblebee.diagnosis.residuals import Problem, window_weights
from bumblebee.sim.servo import servos_of

_DRY, _VISCOUS, _GAIN = "coulomb_friction", "viscous_friction", "kd"


def held_by_dry_friction(problem: Problem, fit: Fit) -> tuple[list[Candidate], np.ndarray]:
    """A fit's effects and values (P,) with dry friction alone on each such joint, wherever that does as well.

    Asked is where the damping is more than twice the servo's declared one; of some shares of the drive's limit the one
    that leaves least is taken.
    """
    rule = problem.thresholds.selection.proposals.all_joints
    kept = {c: fit.of(c) for c in fit.chosen}
    weights = window_weights(fit.clean(problem))
    cost = cost_of(problem, fit.residual, weights)[0]
    for dry in [c for c in fit.chosen if c.effect == _DRY]:
        damping = [c for c in fit.chosen if c.where == dry.where and c.effect in (_VISCOUS, _GAIN)]
        servo = servos_of(problem.plant.model, [int(problem.plant.model.joint(dry.where).id)])
        own, limit = -float(servo.bias[0, 2]), float(servo.limit[0])
        more = sum(float(kept[c][0] - c.nominal[0]) * (own if c.effect == _GAIN else 1.0) for c in damping)
        if own <= 0 or not np.isfinite(limit) or more <= own:
            continue
        others = {c: value for c, value in kept.items() if c not in damping}
        sizes = [dry.clip(np.array([share * limit])) for share in rule.holding]
        sets = [effects_at(list(others), np.concatenate([*(others | {dry: size}).values()])) for size in sizes]
        costs = [cost_of(problem, residual, weights)[0] for residual in problem.residual(sets)]
        least = int(np.argmin(costs))
        if costs[least] <= (1 + rule.one_damping) * cost:
            kept, cost = others | {dry: sizes[least]}, min(cost, costs[least])
    return list(kept), np.concatenate(list(kept.values())) if kept else np.empty(0)
