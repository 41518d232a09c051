"""Where a fit of all joints begins: which usual effects, beside what, and at which values."""

from collections.abc import Callable, Sequence

import numpy as np

from bumblebee.diagnosis.candidates import (
    USUAL,
    USUAL_OF_ROBOT,
    Candidate,
    absent,
    clipped,
)
from bumblebee.diagnosis.estimation import Fit
from bumblebee.diagnosis.residuals import Problem
from bumblebee.sim.servo import servos_of

_STRENGTH = "motor_strength"
_GAIN = "kp"
Begun = tuple[Sequence[Candidate], np.ndarray]
"""Effects and the values (P,) that their fit begins with."""


def usual_effects(candidates: Sequence[Candidate]) -> list[Candidate]:
    """Candidates that every joint of a real robot has."""
    return [c for c in candidates if (c.effect in USUAL and c.where) or (c.effect in USUAL_OF_ROBOT and not c.where)]


def is_whole(c: Candidate) -> bool:
    """Whether a mass takes the moments along, as another link of the same shape would; other effects do."""
    return c.effect != "link_mass" or c.step[1] != 0


def sets_of(usual: Sequence[Candidate], candidates: Sequence[Candidate]) -> tuple[list[Candidate], ...]:
    """Usual effects at every drive's declared strength; then what comes beside them: strengths, and servos' `kp`."""
    strengths = [c for c in usual if c.effect == _STRENGTH]
    gains = [c for c in candidates if c.effect == _GAIN]
    return [c for c in usual if c.effect != _STRENGTH], strengths, gains


def likely_values(problem: Problem, chosen: Sequence[Candidate]) -> np.ndarray:
    """Values (P,) from which the fit of a free base begins: rotors and friction of likely sizes where none is declared.

    From none at all the way leads past the truth: a joint without a rotor follows its servo at once, and one that
    hardly moves is held by any viscous friction that is large enough. A servo is tuned for what it moves: a rotor
    begins as kd^2 / (4 kp), which kp and the joint's whole damping would damp critically, dry friction at a share of
    the drive's limit. All else is absent.
    """
    values = []
    for c in chosen:
        value = np.array(absent([c]))
        if value[0] == 0 and c.effect in _LIKELY:
            value[0] = _LIKELY[c.effect](problem, int(problem.plant.model.joint(c.where).id))
        values.append(value)
    return clipped(chosen, np.concatenate(values))


def _rotor(problem: Problem, joint: int) -> float:
    """Inertia [kg m^2], of a slide [kg], that a joint's servo would damp critically; 0 without one."""
    model = problem.plant.model
    bias = servos_of(model, [joint]).bias[0]
    stiffness, damping = -float(bias[1]), max(-float(bias[2]), 0.0) + float(model.dof_damping[model.jnt_dofadr[joint]])
    return damping**2 / (4 * stiffness) if stiffness > 0 else 0.0


def _dry(problem: Problem, joint: int) -> float:
    """Dry friction [N m], of a slide [N]; 0 where the drive has no limit."""
    limit = float(servos_of(problem.plant.model, [joint]).limit[0])
    share = problem.thresholds.selection.proposals.all_joints.likely_dry
    return share * limit if np.isfinite(limit) else 0.0


_LIKELY: dict[str, Callable[[Problem, int], float]] = {"armature": _rotor, "coulomb_friction": _dry}


def beside(fit: Fit, others: Sequence[Candidate]) -> Begun:
    """The effects of a fit where they are, and others from where they are absent."""
    there = {(c.effect, c.where) for c in fit.chosen}
    more = [c for c in others if (c.effect, c.where) not in there]
    return [*fit.chosen, *more], np.concatenate((fit.values, absent(more)))
