"""Methods that `benchmarks.baselines` can train: each with its own settings, and single settings changed by path."""

import json
from dataclasses import dataclass, fields, is_dataclass, replace
from pathlib import Path
from typing import Any

import yaml

from benchmarks.baselines.others.registry import BASELINES, baseline
from benchmarks.baselines.others.spec import Baseline, StudentConfig
from bumblebee.errors import BadInput
from bumblebee.learning.config import PAPER, PpoConfig
from bumblebee.learning.generalist.distill import PAPER_DAGGER, DistillConfig
from bumblebee.learning.rollout import Manner
from bumblebee.tracking.config import EnvConfig, Randomisation
from bumblebee.tracking.presets import PAPER_RANDOMISATION, PAPER_TASK, STUDENT

OURS = PpoConfig(
    steps=16, epochs=5, gamma=0.98, desired_kl=0.02, desired_kl_end=0.01, hidden=(512, 256, 128), initial_std=0.8
)
NO_RANDOMISATION = Randomisation(friction=(1.0, 1.0), gains=0.0, mass=0.0, push=0.0)
RANDOMISATIONS = {"none": NO_RANDOMISATION, "light": Randomisation(), "paper": PAPER_RANDOMISATION}
METHODS = ("ours", "paper", *BASELINES)
KEPT = ("method", "variety", "seed", "embedded")
"""Settings that a run which goes on may not change."""


@dataclass(frozen=True)
class Method:
    """Method of training: the task, the algorithm, and the student, if there is one."""

    name: str
    env: EnvConfig
    ppo: PpoConfig
    student: StudentConfig | DistillConfig | None = None
    baseline: Baseline | None = None

    @property
    def first(self) -> Manner:
        """How the policy that PPO trains is run."""
        return Manner(self.env.observation, self.baseline.scale if self.baseline else None)

    @property
    def tried(self) -> Manner:
        """How the policy that comes out in the end is run."""
        if self.baseline is not None:
            return Manner(self.baseline.tried or self.env.student, self.baseline.scale)
        return Manner(self.env.student) if self.student else self.first


def method(name: str) -> Method:
    """The method of that name with its own settings."""
    if name == "ours":
        return Method(name, EnvConfig(), OURS)
    if name == "paper":
        return Method(name, replace(PAPER_TASK, student=STUDENT), PAPER, PAPER_DAGGER)
    own = baseline(name)
    return Method(name, own.env, own.ppo, own.student, own)


def changed(settings: Any, changes: list[str]) -> Any:
    """A dataclass with the fields that `path.to.field=value` names replaced, values as in YAML."""
    for change in changes:
        path, _, value = change.partition("=")
        settings = _put(settings, path.split("."), yaml.safe_load(value), change)
    return settings


def _put(settings: Any, path: list[str], value: Any, change: str) -> Any:
    known = [field.name for field in fields(settings)] if is_dataclass(settings) else []
    if path[0] not in known:
        raise BadInput(f"--set {change}", " or ".join(known) or "no further field", path[0])
    old = getattr(settings, path[0])
    if len(path) > 1:
        return replace(settings, **{path[0]: _put(old, path[1:], value, change)})
    if isinstance(old, tuple):  # YAML takes 1e-4, without a point, for a word
        value = tuple(float(item) if old and isinstance(old[0], float) else item for item in value)
    elif isinstance(old, float):
        value = float(value)
    return replace(settings, **{path[0]: value})


def require_kept(settings: dict[str, Any], path: Path) -> None:
    """Refuse to go on with another method, seed or draw of motions than the run in this folder began with.

    Args:
        settings: of this call.
        path: those that the run began with; what they do not say may be anything.

    Raises:
        BadInput: if one of them differs, or the file is none of a run's.
    """
    try:
        began = dict(json.loads(path.read_text()))
    except (ValueError, TypeError) as error:
        raise BadInput(path, "the settings of a run", f"{type(error).__name__}: {error}") from None
    for name in KEPT:
        if name in began and began[name] != settings[name]:
            expected, came = f"{began[name]}, with which the run began", str(settings[name])
            raise BadInput(f"{path}: {name}", expected, came, "Another run needs another --out.")
