"""Drop the motions that break a rule, or that a policy cannot follow: data/motions -> data/filtered, with the reasons.

`decisions.csv` has a row for each motion, `drops.csv` one for each rule that a dropped motion breaks.
"""

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import pandas as pd

from bumblebee.errors import BadInput
from bumblebee.io.read import read_yaml
from bumblebee.motion.clip import Clip
from bumblebee.motion.filters.decisions import Accounting, Decision, accounting, decisions_table, drops_table
from bumblebee.motion.filters.overrule import by_clip, read_overrules
from bumblebee.motion.filters.rules import FilterConfig, violations
from bumblebee.motion.store import Library, map_clips, write_library
from bumblebee.progress import progress
from bumblebee.ranges import Line
from tasks.policies.policy_filter import PolicyFilter, loaded, unfollowed
from tasks.running import paths
from tasks.running.stage import load, log_run, output_folder, run_stage
from tasks.settings.filter_files import files_named
from tasks.settings.params import FILE

PIPELINE = Path("dvc.yaml")


@dataclass(frozen=True)
class FilterStageConfig(FilterConfig):
    """The rules' limits, a policy that must follow, and a person's word against both."""

    overrule: Line = ""
    """A CSV or YAML file with `motion, decision, reason, who`, which overrules single decisions; nothing: none does."""
    policy: PolicyFilter = field(default_factory=PolicyFilter)
    """The filter of H2O: which policy must be able to follow a motion; off without one."""


def main() -> None:
    """Filter the library; the result is a library of its own."""
    config = load("filter", FilterStageConfig)
    require_tracked(config)
    library = Library(paths.MOTIONS)
    if not len(library):
        raise BadInput(paths.MOTIONS, "at least one motion", "a library of none", "See skipped.csv there.")
    decisions = decide(library, config)
    tell(decisions)
    kept = {one.motion for one in decisions if one.decision == "keep"}
    if not kept:
        first = drops_table(decisions).iloc[0]
        came = f"all {len(library)} dropped; the first: {first['motion']}: {first['explanation']}"
        raise BadInput(paths.MOTIONS, "at least one motion within the limits", came, "Check the limits under `filter`.")
    with output_folder(paths.FILTERED) as folder:
        write_library(folder, (clip for clip in library if clip.name in kept))
        drops_table(decisions).to_csv(folder / "drops.csv", index=False)
        decisions_table(decisions).to_csv(folder / "decisions.csv", index=False)
    log_run("filter", params=config, metrics=metrics(accounting(decisions)))


def decide(library: Library, config: FilterStageConfig) -> list[Decision]:
    """The decision about each motion of the library, in the index's order; the rules on all cores."""
    words = {}
    if config.overrule:
        path = Path(config.overrule)
        words = by_clip(read_overrules(path), library.names, path)
    decisions = []
    with progress(len(library), "filtering by rules", "motions") as bar:
        broken = map_clips(library.folder, partial(violations, config=config))
        for name, rows in zip(library.names, broken, strict=True):
            decisions.append(Decision(name, tuple(rows), words.get(name)))
            bar.update(1)
    if not config.policy.source:
        return decisions
    # What the rules drop is not tried: H2O's filter, too, sees motions that are kinematically sound.
    sound = {one.motion for one in decisions if not one.broken}
    failed = try_policy(library, sound, config.policy)
    return [replace(one, broken=(failed[one.motion],)) if one.motion in failed else one for one in decisions]


def try_policy(library: Library, names: set[str], config: PolicyFilter) -> dict[str, dict[str, object]]:
    """The motions that the policy cannot follow, each with the row that says why."""
    found: dict[str, dict[str, object]] = {}
    lengths = {name: int(frames) for name, frames in zip(library.names, library.index["frames"], strict=True)}
    lengths = {name: frames for name, frames in lengths.items() if name in names}
    with loaded(config) as policy, progress(sum(lengths.values()), "filtering by policy", "ticks") as bar:
        for some in _batches(library, lengths, config.at_once):
            found |= unfollowed(policy, some, config, bar.update)
    return found


def _batches(library: Library, lengths: Mapping[str, int], size: int) -> Iterator[list[Clip]]:
    """The clips, so many at a time, those of similar length together: all wait for the longest."""
    order = sorted(lengths, key=lambda name: -lengths[name])
    for first in range(0, len(order), size):
        yield library.select(order[first : first + size])


def require_tracked(config: FilterStageConfig) -> None:
    """Refuse files under `filter` that DVC would not look at: changed, they would leave the old decisions standing.

    Workspaces name them in their dvc.yaml by themselves; in a checkout it is done by hand.
    """
    if "DVC_STAGE" not in os.environ:
        return
    deps = read_yaml(PIPELINE)["stages"]["filter"]["deps"]
    for key, path in files_named({"filter": {"overrule": config.overrule, "policy": {"source": config.policy.source}}}):
        if path not in deps:
            came = f"{path}, which is no dependency of the stage"
            remedy = f"Add it to the deps of the stage filter in {PIPELINE}."
            raise BadInput(f"{FILE}: {key}", "a file that DVC looks at", came, remedy)


def metrics(counts: Accounting) -> dict[str, float]:
    """Counts for MLflow: kept, dropped, overruled, and dropped by rule."""
    by_rule = {f"dropped/{rule}": float(count) for rule, count in counts.by_rule.items()}
    first = {f"first_reason/{rule}": float(count) for rule, count in counts.by_first_reason.items()}
    words = {"kept_by_word": counts.kept_by_word, "dropped_by_word": counts.dropped_by_word}
    return {"read": counts.read, "kept": counts.kept, "dropped": counts.dropped, **words, **by_rule, **first}


def tell(decisions: Sequence[Decision]) -> None:
    """One line of counts, one for each rule broken with its worst case, one for each overruled decision."""
    counts = accounting(decisions)
    print(f"{counts.kept} of {counts.read} clips kept, {counts.dropped} dropped -> {paths.FILTERED}")
    if counts.dropped:
        parts = ", ".join(f"{rule} {count}" for rule, count in counts.by_first_reason.items())
        print(f"dropped by first reason: {parts}; together {sum(counts.by_first_reason.values())}")
    broken = pd.DataFrame([row for one in decisions for row in one.broken])
    for rule, count in counts.by_rule.items():
        group = broken[broken["rule"] == rule]
        worst = group.loc[group["value"].idxmax()]
        print(f"{rule}: {count}; the worst is {worst['motion']}: {worst['explanation']}")
    for one in decisions:
        if one.overrule:
            against = "" if one.decision == one.by_rules else ", against the rules"
            print(f"overruled: {one.motion}: {one.decision}{against} ({one.overrule.who}: {one.overrule.reason})")


if __name__ == "__main__":
    run_stage(main)
