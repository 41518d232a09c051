"""Whether a model fits logs at all: asked at import, where the map can still be mended."""

from collections.abc import Sequence
from pathlib import Path

from bumblebee.diagnosis.simulation import make_plants, refuse_unlogged
from bumblebee.errors import BadInput
from bumblebee.measured.model_file import load_spec
from bumblebee.measured.rollout import Rollout
from bumblebee.robot.drives import explicit_drives


def refuse_unmatched(model: Path, rollouts: Sequence[Rollout], where: object) -> None:
    """`BadInput`, the first rollout's, where a diagnosis could simulate none of them; `where` names the model."""
    spec = explicit_drives(load_spec(model))[0]
    refused: list[BadInput] = []
    for rollout in rollouts:
        try:
            refuse_unlogged(make_plants(spec, [rollout], where)[0], where)
            return
        except BadInput as error:
            refused.append(error)
    if refused:
        raise refused[0]
