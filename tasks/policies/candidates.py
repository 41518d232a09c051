"""Which policies are evaluated, which of them are one and the same, and what is compared with what."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

from bumblebee.compensation.file import read_compensation
from bumblebee.errors import BadInput
from bumblebee.evaluation.untrained import export_untrained
from bumblebee.learning.export import export_shipped
from bumblebee.policy.exported import read_policy_contract
from tasks.policies.came_along import came_along
from tasks.running import paths
from tasks.settings.control_config import ControlConfig
from tasks.settings.params import load, read


@dataclass(frozen=True)
class Candidate:
    """A policy that is evaluated."""

    policy: str
    """Name in the tables: untrained, shipped, base, expert-<cluster>-r<N>, the same with -compensated,
    control-<kind>-<cluster>-r<N>, generalist."""
    kind: str
    """untrained, shipped, base, expert, compensated, control-declared, control-delta or generalist."""
    folder: Path
    """The exported policy."""
    round: int | None = None
    """An expert's round."""
    cluster: str | None = None
    """An expert's cluster: it is run on that cluster's motions only."""
    compensation: Path | None = None
    """Compensation that its runner undoes at the joints: compensation.json."""

    @property
    def for_robot_only(self) -> bool:
        """Whether it says something about the robot alone: the declared model has nothing to make up for."""
        return self.kind == "compensated" or self.kind.startswith("control")

    def told(self) -> dict[str, Any]:
        """As it stands in summary.json; an export made for this evaluation alone has no folder."""
        folder = "" if self.kind in ("untrained", "shipped") else str(self.folder)
        return {**asdict(self), "folder": folder, "compensation": str(self.compensation or "")}


def candidates(scratch: Path | None, untrained: bool = True) -> tuple[list[Candidate], list[str]]:
    """The policies that are there, and the names of those that are not.

    Args:
        scratch: takes an export of the shipped policy, where base began from it, and an untrained one; None: neither.
        untrained: whether an untrained one is wanted.
    """
    params = read()
    clusters, rounds = params.get("clusters", []), params.get("rounds", [])
    wanted = [Candidate("base", "base", paths.BASE)]
    wanted += [expert(cluster, number) for number in (0, *(int(r["n"]) for r in rounds)) for cluster in clusters]
    wanted.append(Candidate("generalist", "generalist", paths.GENERALIST))
    found = [c for c in wanted if (c.folder / "contract.json").exists()]
    missing = [c.policy for c in wanted if c not in found]
    if not found:
        raise BadInput(paths.MODELS, "at least one exported policy", "none", "Train first.")
    kinds = load("control", ControlConfig).kinds if rounds else ()
    turns = [(cluster, int(r["n"]), int(r["parent"])) for r in rounds for cluster in clusters]
    found += [c for turn in turns for c in beside(*turn, kinds)]
    if came_along(paths.BASE) and scratch is not None:
        found.insert(0, Candidate("shipped", "shipped", export_shipped(scratch / "shipped")))
    if untrained and scratch is not None:
        export_untrained(found[0].folder, scratch / "untrained")
        found.insert(0, Candidate("untrained", "untrained", scratch / "untrained"))
    return found, missing


def expert(cluster: str, number: int) -> Candidate:
    """A cluster's expert of a round."""
    return Candidate(f"expert-{cluster}-r{number}", "expert", paths.expert(number, cluster), number, cluster)


def beside(cluster: str, number: int, parent: int, kinds: Sequence[str]) -> list[Candidate]:
    """Candidates that a round's refinement is held against, as far as they are there.

    The policy that it began from, compensated, and the same training without the diagnosis, of these `kinds`: what
    earlier settings left in the folder is not taken.
    """
    before, plan = expert(cluster, parent), paths.compensation_plan(number)
    found = [
        Candidate(f"control-{kind}-{cluster}-r{number}", f"control-{kind}", folder, number, cluster)
        for kind in kinds
        if (folder := paths.control(number, cluster, kind) / "policy").exists()
    ]
    if plan.exists() and (before.folder / "contract.json").exists():
        undone = plan if any(step.done for step in read_compensation(plan).plan) else None
        name = f"{before.policy}-compensated"
        found.insert(0, replace(before, policy=name, kind="compensated", compensation=undone))
    return found


def same(candidate: Candidate) -> tuple[str, str]:
    """Key of an episode beside motion and seed: the policy's file, and what its runner undoes."""
    return file_hash(candidate), str(candidate.compensation or "")


def file_hash(candidate: Candidate) -> str:
    """sha256 of the exported policy."""
    return str(read_policy_contract(candidate.folder / "contract.json")["onnx_sha256"])


def chain(found: list[Candidate]) -> list[tuple[str, str]]:
    """Pairs to compare: each step of the loop, the generalist with all before it, each round's controls."""
    rounds = sorted({c.round for c in found if c.kind == "expert" and c.round is not None})
    steps = ["untrained", "shipped", "base", *(f"experts-r{number}" for number in rounds), "generalist"]
    pairs = list(pairwise(steps))
    extra = [("base", steps[-2]), ("base", "generalist"), ("shipped", "generalist")]
    for before, after in pairwise(rounds):
        controls = [f"control-{kind}-r{after}" for kind in ("declared", "delta")]
        compensated = f"experts-r{before}-compensated"
        extra += [(f"experts-r{before}", compensated), (compensated, f"experts-r{after}")]
        extra += [(f"experts-r{before}", control) for control in controls]
        extra += [(control, f"experts-r{after}") for control in controls]
    return list(dict.fromkeys(pairs + [pair for pair in extra if pair[0] != pair[1]]))
