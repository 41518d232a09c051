"""At which horizons the corrected model is better than the declared one, at which worse, at which neither."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from bumblebee.diagnosis.thresholds.report import ReportThresholds

_BETTER, _WORSE, _FLOOR, _OPEN = "better", "worse", "at the noise floor", "open"


@dataclass(frozen=True)
class GainByHorizon:
    """Horizons [s], as the block `summary` writes them, each in one of the four."""

    better: tuple[str, ...]
    """Surely better for some kind of joint; every other kind is so too, or at the noise floor before."""
    worse: Mapping[str, tuple[str, ...]]
    """Surely worse, with the kinds of joints that are."""
    floor: tuple[str, ...]
    """The declared model is at the noise floor."""
    open: tuple[str, ...]
    """Neither is sure."""
    kinds: tuple[str, ...]
    """Kinds of joints that the block tells apart: "joints", or "hinges" and "slides"."""

    @property
    def nothing_to_gain(self) -> bool:
        """Whether the declared model is at the noise floor at every horizon."""
        return bool(self.floor) and not (self.better or self.worse or self.open)


def gain_by_horizon(removed: Mapping[str, Sequence[Mapping[str, Any]]], rules: ReportThresholds) -> GainByHorizon:
    """From the entries of each horizon in `summary.removed`."""
    verdicts = {name: [_verdict(entry, rules) for entry in entries] for name, entries in removed.items() if entries}

    def are(*allowed: str) -> list[str]:
        return [name for name, found in verdicts.items() if set(found) <= set(allowed)]

    floor = are(_FLOOR)
    better = [name for name in are(_BETTER, _FLOOR) if name not in floor]
    worse = {
        name: tuple(entry["what"] for entry, verdict in zip(removed[name], found, strict=True) if verdict == _WORSE)
        for name, found in verdicts.items()
        if _WORSE in found
    }
    rest = [name for name in verdicts if name not in (*floor, *better, *worse)]
    kinds = dict.fromkeys(entry["what"] for entries in removed.values() for entry in entries)
    return GainByHorizon(tuple(better), worse, tuple(floor), tuple(rest), tuple(kinds))


def _verdict(entry: Mapping[str, Any], rules: ReportThresholds) -> str:
    """By the whole interval of the share that is gone where there is one."""
    if leaves_floor(entry, rules):
        return _WORSE
    if entry["share"] is None and entry["floor"] is not None:
        return _FLOOR
    if entry["ci95"]:
        low, high = entry["ci95"]
        return _BETTER if low > 0 else _WORSE if high < 0 else _OPEN
    if entry["after"] < entry["before"]:
        return _BETTER
    return _WORSE if entry["after"] > rules.verdicts.worse * entry["before"] else _OPEN


def leaves_floor(entry: Mapping[str, Any], rules: ReportThresholds) -> bool:
    """Whether the declared model is at the noise floor and the corrected one is not."""
    if entry["share"] is not None or entry["floor"] is None:
        return False
    least = max(rules.matters.noise * entry["floor"], rules.verdicts.worse * entry["before"])
    return bool(entry["after"] > least)


def whole_model(gain: GainByHorizon) -> str:
    """Whether to trust the corrected model as a whole, at some horizons, or not; without a full stop."""
    floor = [f"the declared model is at the noise floor after {_seconds(gain.floor)}"] if gain.floor else []
    rest = [f"not surely after {_seconds(gain.open)}"] if gain.open else []
    if gain.better and not gain.worse:
        said = "; ".join([f"better after {_seconds(gain.better)}", *rest, *floor])
        return f"Trust the corrected model as a whole ({said})"
    if gain.better:
        aside = f" ({'; '.join([*rest, *floor])})" if rest or floor else ""
        return (
            f"Trust the corrected model only for the horizons at which it is better, {_seconds(gain.better)}{aside}: "
            f"after {_worse(gain)} it is worse than the declared one"
        )
    if gain.nothing_to_gain:
        return f"There is nothing to gain: {floor[0]}"
    both = f" for both {' and '.join(gain.kinds)}" if len(gain.kinds) > 1 else ""
    worse = [f"it is worse than the declared one after {_worse(gain)}"] if gain.worse else []
    said = [f"at no horizon is it surely better{both}", *worse, *floor]
    return f"Do not trust the corrected model: {'; '.join(said)}"


def _seconds(horizons: Sequence[str]) -> str:
    return f"{', '.join(horizons)} s"


def _worse(gain: GainByHorizon) -> str:
    """The horizons, with the kinds of joints where not all are worse."""
    if all(len(kinds) == len(gain.kinds) for kinds in gain.worse.values()):
        return _seconds(list(gain.worse))
    return ", ".join(f"{name} s ({' and '.join(kinds)})" for name, kinds in gain.worse.items())
