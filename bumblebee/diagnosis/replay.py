"""The error block of any model on any rollouts, without a diagnosis."""

from collections.abc import Sequence
from typing import Any

from bumblebee.diagnosis.dataset import Session
from bumblebee.diagnosis.report import error_block, horizon_whiteners, horizon_windows
from bumblebee.diagnosis.simulation import vary_or_refuse
from bumblebee.diagnosis.thresholds.report import PredictionError
from bumblebee.errors import BadInput
from bumblebee.sim.effects import CATALOGUE, Effect


def replay(
    session: Session,
    effects: Sequence[Effect] = (),
    budget: int = 120,
    seed: int = 0,
    rule: PredictionError | None = None,
) -> dict[str, Any]:
    """Horizon -> errors of the session's model with `effects`, on all its rollouts."""
    for effect in effects:
        _known(session, effect)
    ids = list(range(len(session.rollouts)))
    cuts = horizon_windows(session, ids, budget, rule)
    variation = vary_or_refuse(session.plant, effects)
    whiteners = horizon_whiteners(cuts, variation, session.sigma, session.steps[1], seed)
    errors = error_block(cuts, whiteners, variation, session.steps[0], seed)
    for named, came in session.plant.failures.reasons:
        raise BadInput(f"effects {named}", "a model that MuJoCo can simulate", came)
    return errors


def _known(session: Session, effect: Effect) -> None:
    """`BadInput` for a place that the model does not have."""
    kind, plant = CATALOGUE[effect.effect].on, session.plant
    geoms = {plant.model.geom(g).name for g in range(plant.model.ngeom)}
    names = {"joint": plant.joints, "body": plant.bodies, "geom": geoms, "whole": ()}[kind]
    for place in effect.where:
        if place not in names:
            raise BadInput(f"effect {effect.effect}: where", f"a {kind} of the model", repr(place)[:80])
