"""How long stages take: from earlier runs of this workspace, else typical, both scaled by what this run has shown."""

import heapq
import json
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from statistics import median

from bumblebee.errors import BadInput
from bumblebee.io.write import write_file
from flows.environment import SERVERS
from flows.stages import Stage

KEPT = 5  # runs of a stage that are remembered
ESTIMATE = "estimate"  # source of what earlier runs of this workspace do not tell

TYPICAL = {
    "motions": 11, "seal": 40, "filter": 6, "base": 32, "cluster": 20, "experts": 60, "rollouts": 15, "ingest": 7,
    "gate": 3, "diagnose": 200, "compensate": 6, "delta": 14, "refine": 95,
    "control": 110, "distill": 12, "evaluate": 17, "publish": 10, "report": 8,
}  # fmt: skip
"""Seconds on two cores. Training from docs/reports (2026-11-21, embedded demo), `diagnose` from docs/diagnosis.md, the
rest from one `make smoke`: what counts is their shares, the scale comes from the run itself."""
_OTHER = 20.0
_TRUST = 30.0  # seconds that must have been seen before a run's own pace counts half


@dataclass(frozen=True)
class Expectation:
    """Seconds by stage, and where they come from, in words."""

    seconds: dict[str, float]
    source: str


def path(workspace: Path) -> Path:
    """The file with the durations of earlier runs."""
    return workspace / SERVERS / "durations.json"


def read(workspace: Path) -> dict[str, list[float]]:
    """Stage -> seconds of its last runs, oldest first; whatever cannot be read is as if it were not there."""
    try:
        table = json.loads(path(workspace).read_text())
    except (OSError, ValueError):
        return {}
    stages = table.items() if isinstance(table, dict) else ()
    good = {name: [float(v) for v in values if _seconds(v)] for name, values in stages if isinstance(values, list)}
    return {name: values for name, values in good.items() if values}


def _seconds(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and 0 <= value < 1e7


def remember(workspace: Path, name: str, seconds: float) -> None:
    """Add a stage's duration; a folder that cannot be written costs the memory and nothing else."""
    table = read(workspace)
    table[name] = [*table.get(name, []), round(seconds, 2)][-KEPT:]
    with suppress(BadInput):
        write_file(path(workspace), json.dumps(table, indent=1, sort_keys=True))


def expect(stages: Iterable[Stage], earlier: Mapping[str, list[float]], seen: Mapping[str, float]) -> Expectation:
    """Expected time of each stage.

    Args:
        stages: the run's stages.
        earlier: stage -> seconds of its runs before this one.
        seen: stage -> seconds that it took in this run.
    """
    stages = list(stages)
    known = {stage.name: median(earlier[stage.name]) for stage in stages if stage.name in earlier}
    typical = {stage.name: _typical(stage.name) for stage in stages}
    measured = {name: median(values) for name, values in earlier.items()} | dict(seen)
    scale = (sum(measured.values()) + _TRUST) / (sum(_typical(name) for name in measured) + _TRUST)
    seconds = {name: known.get(name, scale * value) for name, value in typical.items()}
    compared = [name for name in seen if name in known]
    pace = (sum(seen[name] for name in compared) + _TRUST) / (sum(known[name] for name in compared) + _TRUST)
    seconds = {name: value * pace if name in known else value for name, value in seconds.items()}
    most = max((len(earlier[name]) for name in known), default=0)
    told = "from this workspace's last run" if most == 1 else "from this workspace's earlier runs"
    return Expectation(seconds, told if known.keys() >= typical.keys() - seen.keys() and known else ESTIMATE)


def _typical(name: str) -> float:
    return float(TYPICAL.get(name.partition("@")[0], _OTHER))


def seconds_left(
    stages: Iterable[Stage],
    expected: Mapping[str, float],
    done: Iterable[str],
    elapsed: Mapping[str, float],
    width: int,
) -> float:
    """Seconds until all stages are done, `width` side by side, each after those that it needs.

    Args:
        stages: the run's stages, each after those that it needs.
        expected: seconds by stage.
        done: stages that have ended.
        elapsed: seconds since the start, of those that run.
        width: stages that can run at once.
    """
    ended, stages = set(done), list(stages)
    names = {stage.name for stage in stages}
    finish = {name: 0.0 for name in ended}
    for name, since in elapsed.items():
        finish[name] = max(expected[name] - since, 0.1 * since)  # who is late stays late a while
    free = sorted([finish[name] for name in elapsed] + [0.0] * max(width - len(elapsed), 0))
    for stage in stages:
        if stage.name in finish:
            continue
        ready = max((finish.get(need, 0.0) for need in stage.needs & names), default=0.0)
        start = max(ready, heapq.heappop(free))
        finish[stage.name] = start + expected[stage.name]
        heapq.heappush(free, finish[stage.name])
    return max(finish.values(), default=0.0)
