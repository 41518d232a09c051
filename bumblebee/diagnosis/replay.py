"""The error block of any model on any rollouts, without a diagnosis."""

import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from bumblebee.diagnosis.error_block import error_block, horizon_whiteners, horizon_windows
from bumblebee.diagnosis.session import Session
from bumblebee.diagnosis.variation import vary
from bumblebee.errors import BadInput
from bumblebee.sim.effects import CATALOGUE, Effect


def replay(session: Session, effects: Sequence[Effect] = (), budget: int = 120, seed: int = 0) -> dict[str, Any]:
    """Horizon -> errors of the session's model with `effects`, on all its rollouts."""
    for effect in effects:
        for place in effect.where:
            names = session.plant.joints if CATALOGUE[effect.effect].on == "joint" else session.plant.bodies
            if place not in names:
                kind = CATALOGUE[effect.effect].on
                raise BadInput(f"effect {effect.effect}: where", f"a {kind} of the model", repr(place)[:80])
    ids = list(range(len(session.rollouts)))
    windows = horizon_windows(session.plant, session.layout, session.rollouts, ids, budget)
    variation = vary(session.plant, effects)
    common = (session.plant, session.layout, windows)
    whiteners = horizon_whiteners(*common, variation, session.sigma, session.steps[1], seed)
    return error_block(*common, whiteners, variation, session.steps[0], seed)


def write_json(path: Path, document: dict[str, Any]) -> None:
    """Write JSON; the file appears whole or not at all."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}.part")
    temporary.parent.mkdir(parents=True, exist_ok=True)
    temporary.write_text(json.dumps(document, indent=1, allow_nan=False))
    os.replace(temporary, path)
