"""Where the loop keeps things: every path below a workspace, in which each stage runs; dvc.yaml names the same."""

from pathlib import Path

DATA = Path("data")
"""Folders that the loop itself fills."""
RAW = Path("data/raw")
"""Where a user's motions and texts lie, a folder a set, kept by DVC."""
RETARGETS = Path("data/retargets")
"""The cache of retargeted motions, by content."""
ROBOT = Path("data/robot")
"""The robot's folder: one that comes along, or the user's."""
POLICY = Path("data/policy")
"""A policy of the user's own, which the loop may begin from."""
MOTIONS = Path("data/motions")
"""The library of all motions that could be read."""
FILTERED = Path("data/filtered")
"""The library of those that the robot can follow."""
CLUSTERS = Path("data/clusters")
LABELS = CLUSTERS / "labels.parquet"
"""The cluster of each motion."""
CLUSTERING = Path("models/clustering")
"""The autoencoder that clusters."""
SEALED_ROBOT = Path("data/sealed/robot.json")
"""File of what the stand-in robot has and nobody is told."""
BASE = Path("models/base")
"""The policy for all clusters that the experts begin from."""
GENERALIST = Path("models/generalist")
MODELS = Path("models")
EVALUATION = Path("data/evaluation")
EPISODES = EVALUATION / "episodes.parquet"
PUBLISHED = Path("data/published.json")
"""Which version of each model was registered, and which is its champion."""
REPORT = Path("reports/report.html")
INCOMING = Path("data/incoming")
"""Where a lab may put its measured rollouts."""
ROLLOUTS_OF_ROUND = "data/rollouts/r{round}"
"""A round's measured rollouts, as the default of a parameter."""
LISTED = (
    # Data sets: large, kept by DVC, and under the licences of whoever recorded them.
    *("data/motions/clips/*", "data/filtered/clips/*", "data/retargets/*"),
    *("data/rollouts/*.parquet", "data/measured/*.parquet"),
    # The stand-in robot's effects, which nobody who watches the loop is to see before the report.
    "data/sealed/*",
)
"""Patterns of outputs' files that runs in MLflow list and do not hold (`running/outputs.py`); `*` spans folders."""
SCRATCH = Path(".scratch")
"""Checkpoints of stages that are not done."""


def rollouts(round: int, cluster: str) -> Path:
    """A cluster's measured rollouts of a round."""
    return Path(ROLLOUTS_OF_ROUND.format(round=round)) / cluster


def measured(round: int) -> Path:
    """The rollouts of a round that were accepted, those set aside, and the declared model."""
    return Path(f"data/measured/r{round}")


def rejected(round: int) -> Path:
    """File of what was found wrong with a round of which nothing can be used."""
    return Path(f"data/rejected/r{round}")


def gate(round: int) -> Path:
    """The answer that let a round pass."""
    return Path(f"data/gates/round-{round}.json")


def diagnosis(round: int) -> Path:
    """Folder of a round's diagnosis: what the declared model lacks, the three files below and a page."""
    return Path(f"data/diagnosis/r{round}")


def diagnosis_document(round: int) -> Path:
    """Everything that the diagnosis found, and the rollouts that it fitted and held out."""
    return diagnosis(round) / "diagnosis.json"


def effects(round: int) -> Path:
    """The effects that it found."""
    return diagnosis(round) / "effects.yaml"


def corrected_model(round: int) -> Path:
    """The declared model with those of them that MuJoCo has."""
    return diagnosis(round) / "model.xml"


def compensation(round: int) -> Path:
    """The folder of what the runner undoes at the joints."""
    return Path(f"models/compensation/r{round}")


def compensation_plan(round: int) -> Path:
    """File of the compensation, as the runner reads it."""
    return compensation(round) / "compensation.json"


def delta(round: int, cluster: str) -> Path:
    """A cluster's delta action."""
    return Path(f"models/delta/r{round}/{cluster}")


def expert(round: int, cluster: str) -> Path:
    """A cluster's policy after a round; round 0 is that before any."""
    return experts(round) / cluster


def experts(round: int) -> Path:
    """The policies of all clusters after a round."""
    return Path(f"models/experts/r{round}")


def control(round: int, cluster: str, kind: str) -> Path:
    """Folder of the control: the training without the diagnosis."""
    return Path(f"models/control/r{round}/{cluster}/{kind}")
