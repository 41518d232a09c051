"""The text that every policy's card shares, in Markdown: what it takes and gives, made from what, its limits."""

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from bumblebee.motion.licences.terms import UNKNOWN, restrictions
from bumblebee.policy.describe import action_sentence, joint_table, observation_size, observation_table, sensors_line
from bumblebee.robot.facts import KEY_BODIES

CARD = "card.json"
"""File of a policy's folder: its card as plain data."""
NOTHING = "nothing"
"""Name of the start of a training that goes on from no policy."""


def card_text(title: str, contract: dict[str, Any], tried: Mapping[str, Iterable[str]], made: Iterable[str]) -> str:
    """A card: a sentence, how the policy was tried, limits, origin, observation and action.

    Args:
        title: its heading.
        contract: contract.json of the exported policy.
        tried: sections on how well it did, heading -> lines.
        made: lines of `made_from`.
    """
    sections = {**tried, "Limits": _limits(), "Made from": made, "Takes": _takes(contract), "Gives": _gives(contract)}
    lines = [f"# {title}", "", summary(contract), ""]
    for heading, told in sections.items():
        lines += [f"## {heading}", "", *told, ""]
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


def made_from(card: Mapping[str, Any], parent: str | None, licences: Mapping[str, int]) -> Iterator[str]:
    """Lines on parent, stage, training, seed and licences of the motions, those of its parents too."""
    origin = parent or ", ".join(card.get("from", [])) or card.get("config", {}).get("init")
    yield f"- from: {origin or 'not said'}"
    if "stage" in card:
        yield f"- stage: {card['stage']}" + "".join(
            f", {key} {card[key]}" for key in ("cluster", "round") if card.get(key) is not None
        )
    if "learner" in card:
        yield f"- learner: {card['learner']}"
    if card.get("frames"):
        yield f"- training: {card['frames']:,} control steps on {len(card.get('training_clips', []))} clips"
    if card.get("kept") == "parent":
        yield "- kept: these are its parent's weights"
    seed = card.get("config", {}).get("seed")
    yield f"- seed: {seed}" if seed is not None else "- seed: not said"
    named = ", ".join(f"{licence} ({count})" for licence, count in licences.items())
    yield f"- licences of the motions: {named or UNKNOWN}"
    yield from (f"- its weights have also learnt from {line}" for line in card.get("learnt_before", []))
    yield from (f"- **{line}**" for line in restrictions(licences))


def _limits() -> Iterator[str]:
    yield "- **Simulation only.** No number here is from a real robot."
    yield "- **No safety layer.** Nothing checks its output: torque limits, a stop and a hoist are yours."
    yield "- It follows motions like those that it was trained on; it plans nothing and sees no obstacle."
