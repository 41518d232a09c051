"""Rollouts that are held out by what was different when they were recorded, instead of by motion.

An effect that is right at one gain is right at another; a stand-in for it is not. So the error on gains, loads or
grounds that took no part is the harder and the better test of a diagnosis.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from bumblebee.diagnosis.simulation import Condition, Plant, in_words
from bumblebee.diagnosis.thresholds.dataset import Conditions
from bumblebee.errors import BadInput
from bumblebee.measured.conditions import Value, stated_conditions
from bumblebee.measured.rollout import Rollout

_OPTION = "--hold-out"


@dataclass(frozen=True)
class HeldOut:
    """A condition and the values of it that take no part in fit and acceptance."""

    name: str
    values: tuple[Value, ...]
    rule: Conditions = field(default_factory=Conditions)
    """Which numbers are the same."""

    def entry(self) -> dict[str, Any]:
        """As a diagnosis tells it."""
        return {"by": "condition", "condition": self.name, "values": list(self.values)}

    def note(self) -> str:
        """The held-out rollouts in words."""
        listed = ", ".join(map(_said, self.values))
        return f"held out are rollouts with {self.name} = {listed}: they took no part in the fit or in acceptance"

    def lost_notes(self, lost: Sequence[tuple[Rollout, str]]) -> list[str]:
        """A note on rollouts that were to be held out and were set aside, with their reasons."""
        listed = [f"{r.rollout_id} ({self.name} = {_said(v)})" for r, _ in lost if (v := self.of(r)) is not None]
        return [f"to be held out, but set aside: {', '.join(listed)}"] * bool(listed)

    def of(self, rollout: Rollout) -> Value | None:
        """A rollout's value of the condition."""
        return stated_conditions(rollout.meta, rollout.joints).get(self.name)

    def matches(self, value: Value | None) -> bool:
        """Whether a rollout of this value is held out; one that states none is not."""
        return value is not None and any(self.same(value, own) for own in self.values)

    def same(self, a: Value, b: Value) -> bool:
        """Whether two values are one: texts to the letter, numbers but for rounding."""
        if isinstance(a, str) or isinstance(b, str):
            return _said(a) == _said(b)
        return abs(a - b) <= self.rule.relative * max(abs(a), abs(b))


def read_held_out(text: str) -> HeldOut:
    """NAME=VALUE[,VALUE ...], as the command line has it."""
    name, sign, rest = (part.strip() for part in text.partition("="))
    values = [part.strip() for part in rest.split(",")]
    if not sign or not name or not all(values):
        raise BadInput(_OPTION, "NAME=VALUE[,VALUE ...] of a condition, such as gain=200,800", repr(text)[:80])
    return HeldOut(name, tuple(map(_value, values)))


def split_by(
    rollouts: Sequence[Rollout], held: HeldOut, lost: Sequence[tuple[Rollout, str]] = ()
) -> tuple[list[int], list[int]]:
    """Indices to fit and to hold out; `lost` are rollouts to hold out that were set aside, with the reason of each.

    Raises:
        BadInput: the condition parts the rollouts in no two sets.
    """
    stated = [stated_conditions(r.meta, r.joints) for r in rollouts]
    if not any(held.name in one for one in stated):
        names = sorted({name for one in stated for name in one})
        raise BadInput(_OPTION, f"a condition that the rollouts state ({', '.join(names[:12]) or 'none'})", held.name)
    known = _sorted({one[held.name] for one in stated if held.name in one})
    for value in held.values:
        if any(held.same(value, own) for own in known):
            continue
        aside = [why for r, why in lost if (own := held.of(r)) is not None and held.same(value, own)]
        if not aside:
            listed = ", ".join(_said(own) for own in known[:12])
            raise BadInput(f"{_OPTION} {held.name}", f"values that rollouts have ({listed})", _said(value))
    away = [i for i, one in enumerate(stated) if held.matches(one.get(held.name))]
    if not away:
        raise BadInput(f"{_OPTION} {held.name}", "rollouts that can be used", f"{len(lost)} set aside: {lost[0][1]}")
    if len(away) == len(rollouts):
        raise BadInput(f"{_OPTION} {held.name}", "at least one rollout to fit", "all rollouts held out")
    return [i for i in range(len(rollouts)) if i not in away], away


def varied(rollouts: Sequence[Rollout]) -> dict[str, list[dict[str, Any]]]:
    """Condition -> its values with the rollouts of each, of those that have two values or more; the rest is no news."""
    stated = [(r.rollout_id, stated_conditions(r.meta, r.joints)) for r in rollouts]
    out = {}
    for name in dict.fromkeys(name for _, one in stated for name in one):
        values = _sorted({one[name] for _, one in stated if name in one})
        groups: list[dict[str, Any]] = [
            {"value": v, "rollouts": [i for i, one in stated if one.get(name) == v]} for v in values
        ]
        unstated = [i for i, one in stated if name not in one]
        groups += [{"value": None, "rollouts": unstated}] if unstated else []
        if len(groups) > 1:
            out[name] = groups
    return out


def condition_notes(plant: Plant, rollouts: Sequence[Rollout], rule: Conditions) -> list[str]:
    """A line on what rollouts were simulated with instead of what the model declares, where they say so."""
    counts: dict[int, int] = {}
    for rollout in rollouts:
        number = plant.under.get(rollout.rollout_id, 0)
        counts[number] = counts.get(number, 0) + 1
    said = [f"{in_words(plant.every[k].condition, plant.joints)} ({n} rollouts)" for k, n in sorted(counts.items())]
    if all(plant.every[k].condition == Condition() for k in counts):
        return []
    more = f"; and {len(said) - rule.told} more" if len(said) > rule.told else ""
    return [f"rollouts are simulated as their metadata state: {'; '.join(said[: rule.told])}{more}"]


def _sorted(values: set[Value]) -> list[Value]:
    return sorted(values, key=lambda value: (isinstance(value, str), value))


def _value(text: str) -> Value:
    try:
        return float(text)
    except ValueError:
        return text


def _said(value: Value) -> str:
    return value if isinstance(value, str) else f"{value:g}"
