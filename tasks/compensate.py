"""Stage compensate: what the runner undoes at the joints, from a round's effects: -> models/compensation/r<round>.

No training: the policy that was measured is tried again with it in the evaluation, and a lab can use it the same day.
Effects that no drive can undo, or only beyond a limit, are left out here; the plan says which, and why.
"""

from dataclasses import dataclass, field, replace
from pathlib import Path

from bumblebee.compensation.evidence import why_unproven
from bumblebee.compensation.file import table_of, write_compensation
from bumblebee.compensation.limits import CompensationLimits
from bumblebee.compensation.numbers import Compensation, PlannedEffect
from bumblebee.compensation.plan import compensate
from bumblebee.io.read import file_hash, read_json
from bumblebee.ranges import Ranged
from bumblebee.sim.effects import Effect, read_effects
from tasks.running import paths
from tasks.running.stage import load, log_run, output_folder, run_stage
from tasks.sections import parent_of


@dataclass(frozen=True)
class CompensateConfig(Ranged):
    """How much may be undone."""

    limits: CompensationLimits = field(default_factory=CompensationLimits)
    """Bounds on what is sent to the drives."""


def main(round: int) -> None:
    """Fill models/compensation/r<round>."""
    config = load("compensate", CompensateConfig)
    found, target = paths.effects(round), paths.compensation(round)
    compensation = undone_after(parent_of(round), found, config.limits)
    with output_folder(target) as folder:
        write_compensation(folder / paths.compensation_plan(round).name, compensation)
    undone = sum(bool(step.done) for step in compensation.plan)
    print(table_of(compensation))
    print(f"round {round}: {undone} of {len(compensation.plan)} effects undone at the joint")
    metrics = {"effects": len(compensation.plan), "undone": undone}
    log_run("compensate", round=round, params=config, metrics=metrics)


def undone_after(parent: int, found: Path, limits: CompensationLimits) -> Compensation:
    """Compensation of the effects `found` for experts of the round `parent`.

    What that round's own diagnosis found they were trained with, and to undo it again would be to do it twice. It is
    left out also where a cluster's expert stayed what it was. Nothing is undone where held-out rollouts show no
    better model.
    """
    effects = read_effects(found)
    document = found.parent / "diagnosis.json"
    unproven = why_unproven(read_json(document)) if document.is_file() else ""
    trained = read_effects(paths.effects(parent)) if parent else []
    known = {_key(effect) for effect in trained}
    why = {
        index: f"the experts were trained with it in round {parent}" if _key(effect) in known else unproven
        for index, effect in enumerate(effects)
    }
    new = [effect for index, effect in enumerate(effects) if not why[index]]
    made = compensate(new, None, limits, leave_out=True, where=found, effects_sha256=file_hash(found))
    left = tuple(PlannedEffect(e.effect, e.where, "", "", why[i]) for i, e in enumerate(effects) if why[i])
    return replace(made, plan=(*made.plan, *left))


def _key(effect: Effect) -> tuple[str, frozenset[str]]:
    """Key that an effect has in every round."""
    return effect.effect, frozenset(effect.where)


if __name__ == "__main__":
    run_stage(main)
