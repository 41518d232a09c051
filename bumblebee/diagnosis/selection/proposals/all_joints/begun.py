"""Where a fit of all joints begins: which usual effects, beside what, and at which values."""

from collections.abc import Sequence

import numpy as np

from bumblebee.diagnosis.candidates import (
    USUAL,
    USUAL_OF_ROBOT,
    USUAL_OF_TORQUE,
    Candidate,
    absent,
    clipped,
)
from bumblebee.diagnosis.estimation import Fit
from bumblebee.diagnosis.residuals import Problem
from bumblebee.sim.servo import servos_of

_STRENGTH = "motor_strength"
_GAIN = "kp"
_DAMPING = "kd"
ROTOR = "armature"
Begun = tuple[Sequence[Candidate], np.ndarray]
"""Effects and the values (P,) that their fit begins with."""


def usual_effects(candidates: Sequence[Candidate], torque: bool = False) -> list[Candidate]:
    """Of `candidates` those that every joint of a real robot has; `torque`: whose drives are told torques."""
    kinds = USUAL_OF_TORQUE if torque else USUAL
    return [c for c in candidates if (c.effect in kinds and c.where) or (c.effect in USUAL_OF_ROBOT and not c.where)]


def is_whole(c: Candidate) -> bool:
    """Whether a mass takes the moments along, as another link of the same shape would; other effects do."""
    return c.effect != "link_mass" or c.step[1] != 0


def sets_of_small(
    usual: Sequence[Candidate], candidates: Sequence[Candidate], loads: Sequence[Fit]
) -> list[list[Begun]]:
    """Usual effects at every drive's declared strength; beside a load; with strengths; with servos' `kp` for those."""
    declared = [c for c in usual if c.effect != _STRENGTH]
    gains = [c for c in candidates if c.effect == _GAIN]
    loaded = [_beside_load(load, declared) for load in loads]
    sets = [declared, list(usual), [*declared, *gains] if gains else []]
    begun: list[list[Begun]] = [[(s, absent(s))] for k, s in enumerate(sets) if s and s not in sets[:k]]
    return [begun[0], loaded, *begun[1:]]


def sets_of_large(problem: Problem, usual: Sequence[Candidate]) -> list[list[Begun]]:
    """Friction, rotors and offsets from rotors that fit the servos; then every usual effect from where it is absent.

    Servos' kd and strengths come later: a robot of thirty joints takes half a minute a step.
    """
    first = [c for c in usual if c.effect not in (_STRENGTH, _DAMPING)]
    return [[(first, _with_rotors(problem, first))], [(list(usual), absent(usual))]]


def _with_rotors(problem: Problem, chosen: Sequence[Candidate]) -> np.ndarray:
    """Values (P,) from which a fit begins: effects absent, but for the rotors that a drawing left out.

    A servo is tuned for the inertia that it moves: where kp and kd would damp a joint of kd^2 / (4 kp) critically, a
    rotor declared to be next to nothing begins with that.
    """
    model, least = problem.plant.model, problem.thresholds.selection.proposals.all_joints.no_rotor
    values = []
    for c in chosen:
        value = np.array(absent([c]))
        if c.effect == ROTOR:
            servo = servos_of(model, [int(model.joint(c.where).id)])
            stiffness, damping = -float(servo.bias[0, 1]), -float(servo.bias[0, 2])
            tuned = damping**2 / (4 * stiffness) if stiffness > 0 < damping else 0.0
            if value[0] < least * tuned:
                value[0] = tuned
        values.append(value)
    return clipped(chosen, np.concatenate(values))


def beside(fit: Fit, others: Sequence[Candidate]) -> Begun:
    """The effects of a fit where they are, and others from where they are absent."""
    there = {(c.effect, c.where) for c in fit.chosen}
    more = [c for c in others if (c.effect, c.where) not in there]
    return [*fit.chosen, *more], np.concatenate((fit.values, absent(more)))


def _beside_load(load: Fit, others: Sequence[Candidate]) -> Begun:
    """The mass where it is, and others from where they are absent.

    Its centre among these: fitted without them it may have taken the place of what a joint lacks.
    """
    mass, *centre = load.chosen
    more = [*centre, *others]
    return [mass, *more], np.concatenate((load.of(mass), absent(more)))
