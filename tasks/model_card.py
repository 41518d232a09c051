"""The model card of a policy's version, in Markdown: what it takes and gives, made from what, how good, its limits."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from bumblebee.deploy.describe import action_sentence, joint_table, observation_size, observation_table, sensors_line
from bumblebee.motion.licence_terms import UNKNOWN, counted, restrictions
from bumblebee.robot.facts import KEY_BODIES

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
    name: str, policy: str, folder: Path, parent: str | None, evaluated: Evaluated, licences: Mapping[str, int]
) -> str:
    """The card, from contract.json and card.json of the policy's folder and its result.

    Args:
        name: the registered model.
        policy: the policy's name in the evaluation.
        folder: the exported policy.
        parent: name of the policy that it was trained from, None where there is none.
        evaluated: how it did.
        licences: licence -> number of motions, as `licences_of` has it.
    """
    contract = json.loads((folder / "contract.json").read_text())
    card = json.loads((folder / "card.json").read_text()) if (folder / "card.json").exists() else {}
    sections = {
        "Evaluated": _evaluated(evaluated),
        "Limits": _limits(),
        "Made from": _made(card, parent, licences),
        "Takes": _takes(contract),
        "Gives": _gives(contract),
    }
    lines = [f"# {name}: {policy}", "", summary(contract), ""]
    for title, told in sections.items():
        lines += [f"## {title}", "", *told, ""]
    return "\n".join(lines)


def summary(contract: Mapping[str, Any]) -> str:
    """One sentence."""
    size, joints = observation_size(dict(contract)), len(contract["joints"])
    return (
        f"Follows a reference motion with the whole body of the robot `{contract.get('robot', 'unknown')}`: "
        f"`obs` (N, {size}) float32 in, `actions` (N, {joints}) float32 out, {contract['control_hz']:g} times a second."
    )


def _takes(contract: dict[str, Any]) -> Iterator[str]:
    yield sensors_line(contract)
    yield ""
    history, now = int(contract.get("history", 1)), contract.get("observation_now", [])
    step = sum(part["size"] for part in contract["observation"])
    yield (
        f"`obs`: {history} control step{'s' if history > 1 else ''} of {step} entries"
        + (", the oldest first" if history > 1 else "")
        + (f", then {sum(p['size'] for p in now)} entries of the newest step alone." if now else ".")
    )
    if "memory" in contract:
        steps, entries = contract["memory"]["steps"], contract["memory"]["size"]
        yield f"`memory` (N, {steps}, {entries}): zeros at a clip's start, then `memory_next` of the step before."
    if history > 1:
        yield "Entries below are of the oldest step; the others follow in the same order."
    yield f"Normalisation is inside the file; joints in the order below; key bodies: {', '.join(KEY_BODIES)}."
    yield ""
    yield from observation_table(contract)


def _gives(contract: dict[str, Any]) -> Iterator[str]:
    yield f"`actions`: one number a joint. {action_sentence(contract)}"
    yield f"Trained with {contract.get('physics_hz', 0):g} physics steps a second." if "physics_hz" in contract else ""
    yield ""
    yield from joint_table(contract)


def _made(card: Mapping[str, Any], parent: str | None, licences: Mapping[str, int]) -> Iterator[str]:
    origin = parent or ", ".join(card.get("from", [])) or card.get("config", {}).get("init")
    yield f"- from: {origin or 'not said'}"
    if "stage" in card:
        yield f"- stage: {card['stage']}" + "".join(
            f", {key} {card[key]}" for key in ("cluster", "round") if card.get(key) is not None
        )
    if card.get("frames"):
        yield f"- training: {card['frames']:,} control steps on {len(card.get('training_clips', []))} clips"
    if card.get("kept") == "parent":
        yield "- training did not make it better: these are its parent's weights"
    seed = card.get("config", {}).get("seed")
    yield f"- seed: {seed}" if seed is not None else "- seed: not said"
    named = ", ".join(f"{licence} ({count})" for licence, count in licences.items())
    yield f"- licences of the motions: {named or UNKNOWN}"
    yield from (f"- **{line}**" for line in restrictions(licences))
    yield "- every input with its hash: `lineage.json` beside this card"


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


def _limits() -> Iterator[str]:
    yield "- **Simulation only.** No number here is from a real robot."
    yield "- **No safety layer.** Nothing checks its output: torque limits, a stop and a hoist are yours."
    yield "- It follows motions like those that it was trained on; it plans nothing and sees no obstacle."


def licences_of(library: Path) -> dict[str, int]:
    """The licences of a motion library's clips with their numbers; none where it does not say."""
    index = library / "index.parquet"
    if not index.exists():
        return {}
    table = pd.read_parquet(index)
    return counted(table["licence"].fillna("")) if "licence" in table else {UNKNOWN: len(table)}
