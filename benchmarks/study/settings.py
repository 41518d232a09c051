"""Settings that the study fixes beforehand, and the file that holds a run to it."""

import hashlib
import json
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import yaml

from benchmarks.baselines.methods import OURS
from benchmarks.study.reward_arms import arms
from bumblebee.errors import BadInput
from bumblebee.learning.config import PAPER, PpoConfig
from bumblebee.tracking.config import EnvConfig
from bumblebee.tracking.presets import PAPER_RANDOMISATION, PAPER_TASK

FROZEN = "study.json"

TASK = EnvConfig(
    engine="mujoco_warp",
    num_worlds=8192,
    physics_hz=200.0,
    randomisation=PAPER_RANDOMISATION,
    threshold_start=0.8,
    threshold_end=0.35,
    threshold_share=0.4,
)
"""Our own task with the paper's randomisation: its printed rewards teach nothing (docs/decisions/paper-task.md)."""


@dataclass(frozen=True)
class Distilling:
    """Settings that the arms of the part `generalist` share."""

    iterations: int = 4000
    worlds: int = 4096
    steps: int = 2
    """Control steps of each world an iteration."""
    rate: float = 3e-4
    """Adam's."""
    capacity: int = 10_000_000
    """Samples that are kept."""
    margin: float = 0.05
    """Share of motions by which a generalist may follow fewer than its experts and still keeps their success."""

    @property
    def frames(self) -> float:
        """Control steps of all worlds."""
        return float(self.iterations * self.worlds * self.steps)


@dataclass(frozen=True)
class Study:
    """Seeds, budgets and settings, the same for every arm."""

    seeds: tuple[int, ...] = (0, 1, 2)
    """Seeds of the base policy, of everything trained on from it, and of its random clusters."""
    base_steps: float = 80e6
    """Control steps of a base policy, which learns from all training motions."""
    expert_steps: float = 16e6
    """Control steps of each expert; the one policy gets as many as all experts of a seed together."""
    paper_steps: float = 40e6
    """Control steps of each arm of the part `paper-task`."""
    env: EnvConfig = field(default_factory=lambda: TASK)
    """The task of a base policy."""
    paper_env: EnvConfig = field(default_factory=lambda: replace(PAPER_TASK, num_worlds=8192))
    """The paper's task, for the part `paper-task`."""
    paper_ppo: PpoConfig = PAPER
    """The paper's algorithm."""
    child_threshold: float = 0.35
    """Distance that ends an episode of what is trained on from a base policy, from its first step on [m]."""
    ppo: PpoConfig = field(default_factory=lambda: replace(OURS, symmetry=True))
    """The algorithm; its iterations follow from the steps."""
    child_rate: float = 3e-4
    """First learning rate of what is trained on; the rate adapts afterwards."""
    distil: Distilling = field(default_factory=Distilling)
    """The algorithm of the part `generalist`."""


PAPER_CHANGES: dict[str, tuple[str, ...]] = {
    "printed": (),
    "std": ("std",),
    "ramp": ("ramp",),
    "adaptive": ("adaptive",),
    "three": ("std", "ramp", "adaptive"),
    "three-std": ("ramp", "adaptive"),
    "three-ramp": ("std", "adaptive"),
    "three-adaptive": ("std", "ramp"),
    "reference": ("std", "ramp", "adaptive", "reference"),
    "floor": ("std", "ramp", "adaptive", "floor"),
    "actions": ("std", "ramp", "adaptive", "actions"),
    "limits": ("std", "ramp", "adaptive", "limits"),
    "feet": ("std", "ramp", "adaptive", "feet"),
    "kernels": ("std", "ramp", "adaptive", "kernels"),
    "ours": ("std", "ramp", "adaptive", "ours"),
    "ours-reference": ("std", "ramp", "adaptive", "ours", "reference"),
    "task": ("std", "adaptive", "task"),
    "algorithm": ("ours", "algorithm"),
    "algorithm-flat": ("ours", "algorithm", "flat"),
    "algorithm-reference": ("ours", "algorithm", "reference"),
    "algorithm-seen": ("ours", "algorithm", "seen"),
    "algorithm-ends": ("ours", "algorithm", "ends"),
    "task-algorithm": ("task", "algorithm"),
    "floor-algorithm": ("ramp", "floor", "algorithm"),
    "actions-algorithm": ("actions", "algorithm"),
    "limits-algorithm": ("limits", "algorithm"),
    "feet-algorithm": ("feet", "algorithm"),
    "kernels-algorithm": ("kernels", "algorithm"),
    "algorithm-std": ("ours", "algorithm", "std"),
    "ours-wide": ("adaptive", "ours", "wide"),
    "actions-seen": ("actions", "algorithm", "seen"),
}
"""Changes of the printed task by each arm of the part `paper-task`; rewards are in `reward_arms.py`."""


TASK_PARTS: dict[str, tuple[str, ...]] = {
    "reference": ("action",),
    "seen": ("observation", "observation_noise", "ahead"),
    "flat": ("terrain",),
    "ends": ("threshold_start", "threshold_end", "threshold_share"),
}
"""Fields of the printed task that a change takes from our own."""


PROPRIOCEPTION = ("gravity_b", "root_ang_vel_b", "joint_pos", "joint_vel", "last_action")
"""Terms that the arms with a history see over ten steps."""
WIDE: dict[str, Any] = {
    "friction": (0.3, 1.5),
    "gains": 0.35,
    "strength": 0.3,
    "mass": 0.3,
    "frictionloss": 2.0,
    "push": 1.0,
    "delay": (0.0, 0.06),
}
"""Ranges that the arm `wide` draws from instead of the paper's."""
ROBUST_CHANGES: dict[str, tuple[str, ...]] = {
    "judged": ("own",),
    "place": ("own", "blind"),
    "history": ("history",),
    "loose": ("loose",),
    "wide": ("wide",),
    "place-history": ("own", "blind", "history"),
    "default": ("default",),
    "place-loose": ("own", "blind", "loose"),
}
"""Changes of the base policy's task in each arm of the part `robust`."""


def settings_of(study: Study, name: str, child: bool) -> tuple[EnvConfig, PpoConfig]:
    """Task and algorithm by name.

    Args:
        study: the study's settings.
        name: "ours", "robust-" and an arm of `ROBUST_CHANGES`, or "paper-" and an arm of `PAPER_CHANGES`.
        child: whether a base policy is trained on: the curriculum is over, the first rate is gentler.
    """
    if name.startswith("robust-"):
        env = study.env
        for change in ROBUST_CHANGES[name.removeprefix("robust-")]:
            env = _changed(env, change)
        return env, study.ppo
    if name == "ours":
        if not child:
            return study.env, study.ppo
        limit = study.child_threshold
        env = replace(study.env, threshold_start=limit, threshold_end=limit)
        return env, replace(study.ppo, learning_rate=study.child_rate)
    env, ppo = study.paper_env, study.paper_ppo
    for change in PAPER_CHANGES[name.removeprefix("paper-")]:
        env, ppo = _deviated(env, ppo, change)
    return env, ppo


def _changed(env: EnvConfig, change: str) -> EnvConfig:
    if change == "own":
        return replace(env, place="own")
    if change == "loose":
        return replace(env, threshold_end=env.threshold_start)
    if change == "wide":
        return replace(env, randomisation=replace(env.randomisation, **WIDE))
    if change == "default":
        return replace(env, action="default")
    seen = env.observation
    if change == "blind":
        return replace(env, observation=replace(seen, terms=("demo_in_place",)))
    return replace(env, observation=replace(seen, terms=PROPRIOCEPTION, history=10, now=seen.terms))


def _deviated(env: EnvConfig, ppo: PpoConfig, change: str) -> tuple[EnvConfig, PpoConfig]:
    if change == "std":
        return env, replace(ppo, initial_std=0.2)
    if change == "adaptive":
        rates = {"learning_rate": 3e-4, "learning_rate_range": (1e-5, 1e-3)}
        return env, replace(ppo, schedule="adaptive", desired_kl=0.015, desired_kl_end=0.01, **rates)
    if change == "wide":
        return env, replace(ppo, initial_std=OURS.initial_std)
    if change == "algorithm":
        return env, OURS
    if change == "task":
        return replace(TASK, engine=env.engine, num_worlds=env.num_worlds, physics_hz=env.physics_hz), ppo
    if change in TASK_PARTS:
        return replace(env, **{name: getattr(TASK, name) for name in TASK_PARTS[change]}), ppo
    if change not in ("ramp", "floor"):
        return replace(env, reward=arms()[change].rewards), ppo
    ramp = {"ramp_start": 0.05, "ramp_share": 0.5} if change == "ramp" else {"floor": 0.0}
    return replace(env, reward=replace(env.reward, **ramp)), ppo


SMALL = Study(
    seeds=(0,),
    base_steps=2048,
    expert_steps=1024,
    env=replace(TASK, engine="mujoco", num_worlds=16, physics_hz=100.0, threads=1),
    ppo=replace(OURS, steps=16, epochs=2, hidden=(32, 32), symmetry=True),
    paper_steps=512,
    paper_env=replace(PAPER_TASK, engine="mujoco", num_worlds=16, physics_hz=100.0, threads=1),
    paper_ppo=replace(PAPER, steps=16, epochs=1, hidden=(32, 32)),
    distil=Distilling(iterations=3, worlds=8, steps=4, capacity=4000),
)
"""Study in seconds on two cores: it shows that every part runs, and nothing else."""


def freeze(out: Path, study: Any, **inputs: Any) -> str:
    """Write what the run in `out` is held to, or compare with what it began with; returns the hash of it.

    Args:
        out: the run's folder, made where there is none.
        study: its settings, a dataclass.
        inputs: plain values that results depend on beside them, such as the hash of the motions.

    Raises:
        BadInput: if the run began with others.
    """
    stated = json.loads(json.dumps({"study": asdict(study), **inputs}))
    path = Path(out) / FROZEN
    if path.exists():
        began = _read(path)
        different = sorted(_differences(began, stated))
        stated = began
        if different:
            came = ", ".join(different[:4]) + (f" and {len(different) - 4} more" if len(different) > 4 else "")
            raise BadInput(
                path, "the settings and motions that the run began with", f"others: {came}", "Use a new --out."
            )
    else:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(stated, indent=1) + "\n")
    return hashlib.sha256(json.dumps(stated, sort_keys=True).encode()).hexdigest()[:12]


def frozen(out: Path) -> dict[str, Any]:
    """Content that `freeze` wrote.

    Raises:
        BadInput: if nothing was begun there.
    """
    path = Path(out) / FROZEN
    if not path.exists():
        raise BadInput(path, "the settings of a run", "no such file", "Begin the run first.")
    return _read(path)


def sha256(path: Path) -> str:
    """Hash of a file's bytes."""
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()


def _read(path: Path) -> dict[str, Any]:
    try:
        return dict(json.loads(path.read_text()))
    except (ValueError, TypeError) as error:
        raise BadInput(path, "the settings of a study", f"{type(error).__name__}: {error}") from None


def _differences(began: Any, now: Any, place: str = "") -> list[str]:
    """Dotted places at which two nested mappings differ."""
    if isinstance(began, dict) and isinstance(now, dict):
        # What the run's beginning does not say is a setting of later code, at its default.
        keys = sorted(began)
        return [d for key in keys for d in _differences(began.get(key), now.get(key), f"{place}{key}.")]
    return [] if began == now else [f"{place.rstrip('.')} {yaml.safe_dump(began, default_flow_style=True).split()[0]}"]
