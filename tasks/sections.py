"""Which dataclass each section of params.yaml is: `python -m tasks.sections` checks the whole file at once."""

from collections.abc import Iterable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from bumblebee.errors import BadInput
from tasks import params

SECTIONS = {
    "seal": "tasks.seal:SealConfig",
    "motions": "tasks.motions:MotionsConfig",
    "filter": "bumblebee.motion.filter:FilterConfig",
    "cluster": "bumblebee.clustering.config:ClusterConfig",
    "base": "tasks.base:BaseConfig",
    "experts": "tasks.experts:ExpertsConfig",
    "rollouts": "tasks.rollouts:RolloutsConfig",
    "ingest": "tasks.ingest:IngestConfig",
    "gate": "bumblebee.measured.gate:GateConfig",
    "diagnose": "tasks.diagnose:DiagnoseConfig",
    "delta": "bumblebee.learning.delta:DeltaConfig",
    "refine": "tasks.refine:RefineConfig",
    "distill": "bumblebee.learning.distill:DistillConfig",
    "evaluate": "tasks.evaluate:EvaluateConfig",
    "publish": "tasks.publish:PublishConfig",
    "report": "tasks.report:ReportConfig",
}
LOOP = ("clusters", "rounds", "final_round")


@dataclass(frozen=True)
class Round:
    """One turn of the loop."""

    n: int
    """Its number, from 1."""
    parent: int
    """The round whose experts act on the robot in it; 0 are the experts fine-tuned from base."""


@dataclass(frozen=True)
class Loop:
    """The loop's shape: the keys of params.yaml that belong to no stage."""

    clusters: tuple[str, ...]
    """Names of the clusters, slowest motions first; their number is K."""
    rounds: tuple[Round, ...]
    """The rounds, each after its parent; may be empty."""
    final_round: int
    """The round whose experts are distilled, evaluated and published."""


def loop(path: Path = params.FILE) -> Loop:
    """The loop's shape, consistent in itself.

    Raises:
        BadInput: naming the key that does not fit.
    """
    content = params.read(path)
    shape = params.build(Loop, {key: content[key] for key in LOOP if key in content}, path, "")
    if not shape.clusters or len(set(shape.clusters)) < len(shape.clusters):
        raise BadInput(f"{path}: clusters", "distinct names, at least one", str(list(shape.clusters)))
    for name in shape.clusters:
        if not name.replace("_", "").isalnum():
            raise BadInput(f"{path}: clusters", "names of letters, digits and _", repr(name))
    for index, item in enumerate(shape.rounds):
        if item.n != index + 1 or item.parent != index:
            expected = f"n: {index + 1}, parent: {index} (each round follows the one before)"
            raise BadInput(f"{path}: rounds[{index}]", expected, f"n: {item.n}, parent: {item.parent}")
    if not 0 <= shape.final_round <= len(shape.rounds):
        known = f"0 to {len(shape.rounds)}, the rounds there are"
        raise BadInput(f"{path}: final_round", known, str(shape.final_round))
    return shape


def check_names(content: Iterable[str], path: Path) -> None:
    """Refuse a key at the top of the file that nothing reads.

    Raises:
        BadInput: naming it and the known key most like it.
    """
    known = [*LOOP, *SECTIONS]
    for section in content:
        if section not in known:
            nearest = params.nearest(str(section), known)
            raise BadInput(f"{path}: {section}", "a known section", "an unknown one", nearest)


def check(path: Path = params.FILE) -> dict[str, Any]:
    """Every section as its dataclass, and the loop's shape under "".

    Raises:
        BadInput: for the first thing in the file that is wrong.
    """
    check_names(params.read(path), path)
    found: dict[str, Any] = {"": loop(path)}
    for section, place in SECTIONS.items():
        module, _, name = place.partition(":")
        found[section] = params.load(section, getattr(import_module(module), name), path)
    return found


if __name__ == "__main__":
    from tasks.stage import run_stage

    run_stage(lambda: check())
