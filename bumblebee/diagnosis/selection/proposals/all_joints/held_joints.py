"""A joint that hardly moves is held by dry friction, not by a viscous one larger than its servo's own damping.

While a joint stands, any friction that is large enough holds it, and a fit ends anywhere. Where it moves, in another
motion, a viscous one of ten times its servo's damping keeps it back by as much, and dry friction by next to nothing.
"""

import numpy as np

from bumblebee.diagnosis.candidates import Candidate, effects_at
from bumblebee.diagnosis.estimation import Fit, cost_of
from bumblebee.diagnosis.residuals import Problem, window_weights
from bumblebee.sim.servo import servos_of

_DRY, _VISCOUS = "coulomb_friction", "viscous_friction"


def held_by_dry_friction(problem: Problem, fit: Fit) -> tuple[list[Candidate], np.ndarray]:
    """A fit's effects and values (P,) with dry friction alone on each such joint, wherever that does as well.

    Of some shares of the drive's limit the one that leaves least.
    """
    rule = problem.thresholds.selection.proposals.all_joints
    kept = {c: fit.of(c) for c in fit.chosen}
    weights = window_weights(fit.clean(problem))
    cost = cost_of(problem, fit.residual, weights)[0]
    for viscous in [c for c in fit.chosen if c.effect == _VISCOUS]:
        dry = next((c for c in kept if (c.effect, c.where) == (_DRY, viscous.where)), None)
        servo = servos_of(problem.plant.model, [int(problem.plant.model.joint(viscous.where).id)])
        own, limit = -float(servo.bias[0, 2]), float(servo.limit[0])
        if dry is None or own <= 0 or not np.isfinite(limit) or kept[viscous][0] - viscous.nominal[0] <= own:
            continue
        others = {c: value for c, value in kept.items() if c != viscous}
        sizes = [dry.clip(np.array([share * limit])) for share in rule.holding]
        tried = problem.residual(
            [effects_at(list(others), np.concatenate([*(others | {dry: s}).values()])) for s in sizes]
        )
        costs = [cost_of(problem, residual, weights)[0] for residual in tried]
        least = int(np.argmin(costs))
        if costs[least] <= (1 + rule.one_damping) * cost:
            kept, cost = others | {dry: sizes[least]}, min(cost, costs[least])
    return list(kept), np.concatenate(list(kept.values())) if kept else np.empty(0)
