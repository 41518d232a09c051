"""Results of a finished loop, as plain values: everything that the report's sections read."""

from dataclasses import dataclass, field
from typing import Any, Literal

import pandas as pd

Json = dict[str, Any]


@dataclass(frozen=True)
class RoundResults:
    """One turn with the robot."""

    n: int
    """Its number."""
    intake: Json
    """data/measured/rN/summary.json."""
    gate: Json
    """data/gates/round-N.json."""
    diagnosis: Json
    """data/diagnosis/rN/diagnosis.json."""
    deltas: dict[str, Json]
    """Cluster -> card of its delta action."""
    parent: int = 0
    """The round whose experts ran on the robot in it."""
    compensation: Json | None = None
    """data/compensation/rN/compensation.json; None where nothing was planned."""


@dataclass(frozen=True)
class LoopResults:
    """All of it."""

    library: pd.DataFrame
    """Index of the motions read: name, family, split, source, licence, duration ..."""
    skipped: pd.DataFrame
    """Files that could not be read: file, reason."""
    drops: pd.DataFrame
    """Motions that the filter dropped: motion, rule, value, limit, explanation."""
    labels: pd.DataFrame
    """Motion -> cluster, with its place in the latent plane."""
    elbow: pd.DataFrame
    """K -> within-cluster sum of squares."""
    clusters: Json
    """data/clusters/summary.json."""
    curves: dict[str, pd.DataFrame]
    """Policy -> learning curve."""
    evaluation: Json
    """data/evaluation/summary.json."""
    contract: Json
    """data/evaluation/contract.json."""
    published: Json
    """data/published.json."""
    sealed: Json | None
    """data/sealed/robot.json, opened at the very end, with the latency of the `wire`; None where the measured rollouts
    are of the user's robot."""
    rounds: tuple[RoundResults, ...] = ()
    """The turns with the robot."""
    began: Literal["scratch", "shipped", "own"] = "scratch"
    """Where the base policy went on from: nothing, a policy that comes along, or the lab's own."""
    base_trained_on: bool = False
    """Whether the base stage kept a policy of its own training, and not the one that it went on from."""

    points: pd.DataFrame | None = None
    """Points of the map, a row a motion; None where the clustering kept none."""
    learners: dict[str, str] = field(default_factory=dict)
    """Policy, named as in `curves` -> the learner that trained it, as the settings name it."""
    players: dict[str, str] = field(default_factory=dict)
    """Markup of the 3D replays: "motions", and "windows-rN" for each round."""
    wire: float | None = None
    """Median latency of the wire that the stand-in's rollouts came over, by its own stamps [s]; None for none."""

    @property
    def real_robot(self) -> bool:
        """Whether the measured rollouts came from the user's robot and not from the stand-in."""
        return self.sealed is None
