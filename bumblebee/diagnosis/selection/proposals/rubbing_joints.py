"""Which joints' friction is asked for more than it has."""

from collections.abc import Sequence

from bumblebee.diagnosis.selection.screening import restless
from bumblebee.diagnosis.selection.state import SearchState


def worth_asking(run: SearchState, rubbing: Sequence[str]) -> list[str]:
    """Joints with friction that are worth asking: all, or of many those of the shortlist that lack most torque.

    Among several members on each of thirty joints one is always worth its number by chance, and each costs a refit.
    """
    rule = run.problem.thresholds.selection.proposals.friction_family
    if len(rubbing) <= rule.few_joints:
        return list(rubbing)
    left, every = run.small_fit().clean(run.small), len(run.problem.plant.joints)
    worst = [where for where in restless(run.small, run.white, left, every) if where in rubbing]
    return worst[: run.config.shortlist]
