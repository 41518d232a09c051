"""At which horizons the corrected model is better than the declared one, at which worse, at which neither."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from bumblebee.diagnosis.simulation import pick, rows
from bumblebee.diagnosis.thresholds.report import ReportThresholds, Verdicts

_BETTER, _WORSE, _FLOOR, _OPEN = "better", "worse", "at the noise floor", "open"


Kinds = Mapping[str, tuple[str, ...]]
"""Horizon [s], as the block `summary` writes it -> kinds of joints: "joints", or "hinges" and "slides"."""


@dataclass(frozen=True)
class GainByHorizon:
    """Every kind of joint at every horizon is in one of the four."""

    better: Kinds
    """Surely better."""
    worse: Kinds
    """Surely worse."""
    floor: Kinds
    """The declared model is at the noise floor, and the corrected one too."""
    open: Kinds
    """Neither is sure."""

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of joints that the block tells apart."""
        every = (self.better, self.worse, self.floor, self.open)
        return tuple(dict.fromkeys(kind for part in every for kinds in part.values() for kind in kinds))

    @property
    def whole(self) -> bool:
        """Whether it is surely better for all kinds at all horizons at which the declared one is off the floor."""
        return bool(self.better) and not self.worse and not self.open

    @property
    def nothing_to_gain(self) -> bool:
        """Whether the declared model is at the noise floor at every horizon."""
        return bool(self.floor) and not (self.better or self.worse or self.open)


def harms(removed: Mapping[str, Sequence[Mapping[str, Any]]]) -> bool:
    """Whether the corrected model is surely worse at some horizon and surely better at none, by intervals alone."""
    intervals = [entry["ci95"] for entries in removed.values() for entry in entries if entry["ci95"]]
    return any(high < 0 for _, high in intervals) and not any(low > 0 for low, _ in intervals)


def before_and_after(removed: Mapping[str, Sequence[Mapping[str, Any]]]) -> str:
    """The errors of each horizon before and after, in one line."""
    return ", ".join(
        f"{entry['what']} after {horizon} s {entry['before']:.3g} to {entry['after']:.3g} {entry['unit']}"
        for horizon, entries in removed.items()
        for entry in entries
    )


def gain_by_horizon(removed: Mapping[str, Sequence[Mapping[str, Any]]], rules: ReportThresholds) -> GainByHorizon:
    """From the entries of each horizon in `summary.removed`."""
    verdicts = {name: {e["what"]: _verdict(e, rules) for e in entries} for name, entries in removed.items()}

    def are(verdict: str) -> Kinds:
        kinds = {name: tuple(kind for kind, v in found.items() if v == verdict) for name, found in verdicts.items()}
        return {name: some for name, some in kinds.items() if some}

    return GainByHorizon(are(_BETTER), are(_WORSE), are(_FLOOR), are(_OPEN))


def gain_of(document: Mapping[str, Any], rules: ReportThresholds) -> GainByHorizon:
    """The one verdict of a document: from `summary.removed`, and worse wherever a warning says so."""
    gain = gain_by_horizon(document["summary"]["removed"], rules)
    worse: dict[str, tuple[str, ...]] = dict(gain.worse)
    for name, what in worse_measures(document["error"], rules.verdicts):
        worse[name] = (*worse.get(name, ()), *([] if what in worse.get(name, ()) else [what]))

    def rest(part: Kinds) -> dict[str, tuple[str, ...]]:
        left = {name: tuple(kind for kind in kinds if kind not in worse.get(name, ())) for name, kinds in part.items()}
        return {name: kinds for name, kinds in left.items() if kinds}

    return GainByHorizon(rest(gain.better), worse, rest(gain.floor), rest(gain.open))


def worse_measures(error: Mapping[str, Any], rule: Verdicts) -> list[tuple[str, str]]:
    """(horizon, "base" or kind of joints) where the corrected model's RMS position error is larger."""
    return [(horizon, what) for horizon, what, *_ in worse_rows(error, rule)]


def worse_rows(error: Mapping[str, Any], rule: Verdicts) -> list[tuple[str, str, str, float, float]]:
    """(horizon, what, unit, declared, corrected) of every position that the corrected model predicts worse."""
    found = []
    for horizon, measures in error["before"].items():
        for _, unit, scale, key in rows(measures):
            if key[0] not in ("joint_pos_rmse", "base_pos_rmse"):
                continue
            before, after = (pick(error[part].get(horizon, {}), key).get("value") for part in ("before", "after"))
            if before is not None and after is not None and after > rule.worse * before:
                what = "base" if key[0].startswith("base") else f"{key[1] or 'joint'}s"
                found.append((horizon, what, unit, scale * before, scale * after))
    return found


def _verdict(entry: Mapping[str, Any], rules: ReportThresholds) -> str:
    """By the whole interval of the share that is gone where there is one."""
    if leaves_floor(entry, rules):
        return _WORSE
    if entry["share"] is None and entry["floor"] is not None:
        return _FLOOR
    if entry["ci95"]:
        low, high = entry["ci95"]
        return _BETTER if low > 0 else _WORSE if high < 0 else _OPEN
    if rules.verdicts.worse * entry["after"] < entry["before"]:
        return _BETTER
    return _WORSE if entry["after"] > rules.verdicts.worse * entry["before"] else _OPEN


def leaves_floor(entry: Mapping[str, Any], rules: ReportThresholds) -> bool:
    """Whether the declared model is at the noise floor and the corrected one is not."""
    if entry["share"] is not None or entry["floor"] is None:
        return False
    least = max(rules.matters.noise * entry["floor"], rules.verdicts.worse * entry["before"])
    return bool(entry["after"] > least)


def whole_model(gain: GainByHorizon, warned: bool) -> str:
    """Whether to trust the corrected model as a whole, only where it is better, or not; without a full stop.

    Args:
        gain: verdicts by horizon.
        warned: whether the document carries a warning, beside which nothing is trusted as a whole.
    """
    floor = [f"the declared model is at the noise floor {_after(gain, gain.floor)}"] if gain.floor else []
    rest = [f"not surely better {_after(gain, gain.open)}"] if gain.open else []
    worse = [f"it is worse than the declared one {_after(gain, gain.worse)}"] if gain.worse else []
    if gain.whole:
        said = "; ".join([f"better {_after(gain, gain.better)}", *floor])
        trust = (
            "Read the warnings before you use the corrected model" if warned else "Trust the corrected model as a whole"
        )
        return f"{trust} ({said})"
    if gain.better:
        others = ", ".join([*worse, *rest, *floor])
        return f"Trust the corrected model only where it is better, {_after(gain, gain.better)}: {others}"
    if gain.nothing_to_gain:
        return f"There is nothing to gain: {floor[0]}"
    return f"Do not trust the corrected model: {'; '.join(['at no horizon is it surely better', *worse, *floor])}"


def _after(gain: GainByHorizon, where: Kinds) -> str:
    """The horizons, with the kinds of joints where not all are meant."""
    alike: dict[tuple[str, ...], list[str]] = {}
    for name, kinds in where.items():
        alike.setdefault(kinds, []).append(name)
    parts = [
        f"{', '.join(names)} s" + ("" if set(kinds) == set(gain.kinds) else f" ({' and '.join(kinds)})")
        for kinds, names in alike.items()
    ]
    return f"after {', '.join(parts)}"
