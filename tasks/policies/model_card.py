"""The model card of a policy's version, in Markdown: what it takes and gives, made from what, how good, its limits."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from bumblebee.motion.licences.terms import UNKNOWN, counted
from bumblebee.policy.card_text import card_text, made_from

ROBOTS = {
    "stand_in": "the stand-in robot (a second simulation, with effects that the model does not declare)",
    "nominal": "the declared model (the simulation that it was trained in)",
}


@dataclass(frozen=True)
class Evaluated:
    """How a policy did in the frozen evaluation."""

    contract: str
    """sha256 of the evaluation's contract."""
    engine: str
    """Its robot."""
    result: Mapping[str, Any]
    """The entry of summary.json over all motions."""


def model_card(
    name: str,
    policy: str,
    folder: Path,
    parent: str | None,
    evaluated: Evaluated,
    licences: Mapping[str, int],
    learnt_before: Sequence[str] = (),
) -> str:
    """The card, from contract.json and card.json of the policy's folder and its result.

    Args:
        name: the registered model.
        policy: the policy's name in the evaluation.
        folder: the exported policy.
        parent: name of the policy that it was trained from, None where there is none.
        evaluated: how it did.
        licences: licence -> number of motions, as `licences_of` has it.
        learnt_before: lines on what the policy that the loop went on from had learnt from.
    """
    contract = json.loads((folder / "contract.json").read_text())
    card = json.loads((folder / "card.json").read_text()) if (folder / "card.json").exists() else {}
    card |= {"learnt_before": list(learnt_before)}
    lineage = "- every input with its hash: `lineage.json` beside this card"
    made = [*made_from(card, parent, licences), lineage]
    return card_text(f"{name}: {policy}", contract, {"Evaluated": _evaluated(evaluated)}, made)


def _evaluated(evaluated: Evaluated) -> Iterator[str]:
    result, success = evaluated.result, evaluated.result["success"]
    yield f"On {ROBOTS.get(evaluated.engine, evaluated.engine)}, by the evaluation {evaluated.contract[:12]}:"
    yield ""
    yield f"- followed {_share(success)} of {result['n']} runs over {success.get('motions', 'some')} motions"
    for key, title, unit in (("mpjpe_rad", "error of joint angles", "rad"), ("mpkpe_mm", "of key bodies", "mm")):
        if result.get(key, {}).get("value") is not None:
            yield f"- {title}: {_number(result[key], unit)}"


def _share(success: Mapping[str, Any]) -> str:
    low, high = success.get("ci95") or (None, None)
    if success["value"] is None:
        return "none that counts"
    interval = "" if low is None or high is None else f" (95 % interval {100 * low:.0f} to {100 * high:.0f})"
    return f"{100 * success['value']:.0f} %{interval}"


def _number(value: Mapping[str, Any], unit: str) -> str:
    low, high = value.get("ci95") or (None, None)
    interval = "" if low is None or high is None else f" (95 % interval {low:.3g} to {high:.3g})"
    return f"{value['value']:.3g} {unit}{interval}"


def licences_of(library: Path) -> dict[str, int]:
    """The licences of a motion library's clips with their numbers; none where it does not say."""
    index = library / "index.parquet"
    if not index.exists():
        return {}
    table = pd.read_parquet(index)
    return counted(table["licence"].fillna("")) if "licence" in table else {UNKNOWN: len(table)}
