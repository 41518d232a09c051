"""Stage compensate: what the runner undoes at the joints, from a round's effects: -> models/compensation/r<round>.

No training: the policy that was measured is tried again with it in the evaluation, and a lab can use it the same day.
Effects that no drive can undo, or only beyond a limit, are left out here; the plan says which, and why.
"""

from dataclasses import dataclass, field
from pathlib import Path

from bumblebee.deploy.compensation_file import table_of, write_compensation
from bumblebee.deploy.compensation_limits import CompensationLimits
from bumblebee.deploy.compensation_plan import compensate_file
from bumblebee.ranges import Ranged
from tasks.stage import load, log_run, output_folder, run_stage


@dataclass(frozen=True)
class CompensateConfig(Ranged):
    """How much may be undone."""

    limits: CompensationLimits = field(default_factory=CompensationLimits)
    """Bounds on what is sent to the drives."""


def main(round: int) -> None:
    """Fill models/compensation/r<round>."""
    config = load("compensate", CompensateConfig)
    found, target = Path(f"data/diagnosis/r{round}/effects.yaml"), Path(f"models/compensation/r{round}")
    compensation = compensate_file(found, limits=config.limits, leave_out=True)
    with output_folder(target) as folder:
        write_compensation(folder / "compensation.json", compensation)
    undone = sum(bool(step.done) for step in compensation.plan)
    print(table_of(compensation))
    print(f"round {round}: {undone} of {len(compensation.plan)} effects undone at the joint")
    metrics = {"effects": len(compensation.plan), "undone": undone}
    log_run("compensate", round=round, params=config, metrics=metrics, artifacts=[target])


if __name__ == "__main__":
    run_stage(main)
