"""The frozen evaluation: everything that a success rate depends on, in one hashed JSON file.

Two evaluations are comparable only if their contracts have the same hash; anything else is refused, with the
names of the fields that differ. That is what makes a success rate reproducible by somebody else.
"""

import hashlib
import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.motion.clip import TRAVELS, Clip
from bumblebee.ranges import Range, Ranged
from bumblebee.tracking.terminations import LOOSE, TIGHT, success_threshold

SCHEMA = 1
ALIGNMENT = (
    "world frame; tick k of the episode against frame k of the clip; no alignment in space or time; "
    "the robot starts at the clip's first frame, lifted or lowered until its soles touch the floor"
)
ERRORS = (
    "MPJPE: mean |q - q_ref| over joints and frames [rad]; MPKPE: mean world distance of the key bodies over bodies "
    "and frames [mm]; frames before termination; averaged over episodes of a motion, then over motions"
)


@dataclass(frozen=True)
class Thresholds:
    """How far a key body may be from its reference, as `success_threshold` says it everywhere."""

    walking: float = LOOSE
    """Motions that travel [m]."""
    other: float = TIGHT
    """All others [m]."""


@dataclass(frozen=True)
class StartNoise(Ranged):
    """Standard deviation of the start state around the clip's first frame; drawn anew for every seed and motion."""

    joint_pos: Annotated[float, Range(least=0, most=10)] = 0.01
    """Joint angles [rad]."""
    joint_vel: Annotated[float, Range(least=0, most=100)] = 0.05
    """Joint speeds [rad/s]."""


@dataclass(frozen=True)
class Contract:
    """One frozen evaluation."""

    motions: tuple[dict[str, Any], ...]
    """Each with name, sha256 of its frames, family, split, frames, threshold_m."""
    seeds: tuple[int, ...]
    """One episode for each seed and motion."""
    thresholds: Thresholds = field(default_factory=Thresholds)
    """Keypoint thresholds of success."""
    start_noise: StartNoise = field(default_factory=StartNoise)
    """Start state noise."""
    engines: dict[str, dict[str, Any]] = field(default_factory=dict)
    """Engine name -> its settings (`engine_settings`, sensor noise); of a sealed robot only the file's hash."""
    fall: dict[str, float] = field(default_factory=dict)
    """When a robot counts as fallen, and how far a start may be lifted to stand on the floor."""
    alignment: str = ALIGNMENT
    """How frames are matched."""
    errors: str = ERRORS
    """How the two errors are averaged."""
    travels: float = TRAVELS
    """How far from its start the root of a motion that counts as walking comes [m]."""

    @property
    def sha256(self) -> str:
        """Hash of the content, keys sorted, without white space."""
        return hashlib.sha256(canonical(self._content()).encode()).hexdigest()

    def as_dict(self) -> dict[str, Any]:
        """Content and hash, as it is stored."""
        return {**self._content(), "sha256": self.sha256}

    def _content(self) -> dict[str, Any]:
        return {"schema": SCHEMA, **json.loads(json.dumps(asdict(self)))}


def canonical(value: object) -> str:
    """JSON that is equal exactly where the content is equal."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False)


def clip_digest(clip: Clip) -> str:
    """sha256 of a clip's rate, root and joint trajectories, rounded to 1e-6 so that storage does not matter."""
    digest = hashlib.sha256(f"{clip.fps:.6f}".encode())
    for values in (clip.root_pos, clip.root_quat, clip.joint_pos):
        rounded = np.round(np.asarray(values, dtype=np.float64), 6) + 0.0  # + 0.0: no negative nought
        digest.update(str(rounded.shape).encode() + rounded.tobytes())
    return digest.hexdigest()


def freeze(
    clips: list[Clip],
    seeds: tuple[int, ...],
    start_noise: StartNoise | None = None,
    engines: dict[str, dict[str, Any]] | None = None,
    fall: dict[str, float] | None = None,
) -> Contract:
    """The contract of evaluating on these clips with these seeds; motions are sorted by name."""
    motions = tuple(
        {
            "name": clip.name,
            "sha256": clip_digest(clip),
            "family": clip.family,
            "split": clip.split,
            "frames": len(clip.root_pos),
            "threshold_m": success_threshold(clip),
        }
        for clip in sorted(clips, key=lambda clip: clip.name)
    )
    return Contract(motions, tuple(seeds), Thresholds(), start_noise or StartNoise(), engines or {}, fall or {})


def write_contract(path: Path, contract: Contract) -> None:
    """Write the contract with its hash."""
    path.write_text(json.dumps(contract.as_dict(), indent=1) + "\n")


def read_contract(path: Path) -> dict[str, Any]:
    """Read a stored contract; one whose hash is not that of its content is refused."""
    try:
        stored = json.loads(Path(path).read_text())
        claimed = stored["sha256"]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise BadInput(path, "an evaluation contract with its sha256", f"{type(error).__name__}: {error}") from None
    content = {key: value for key, value in stored.items() if key != "sha256"}
    actual = hashlib.sha256(canonical(content).encode()).hexdigest()
    if actual != claimed:
        raise BadInput(
            f"{path}: field sha256",
            f"the hash of the content, {actual[:12]}",
            str(claimed)[:12],
            "It was edited: freeze it anew.",
        )
    return stored


def require_same(first: dict[str, Any], second: dict[str, Any], where: object) -> None:
    """Refuse to compare evaluations of different contracts (`Contract.as_dict`); names the fields that differ."""
    if first["sha256"] == second["sha256"]:
        return
    keys = sorted((set(first) | set(second)) - {"sha256"})
    differing = [key for key in keys if first.get(key) != second.get(key)]
    raise BadInput(
        f"{where}: {', '.join(differing) or 'sha256'}",
        f"the evaluation contract {first['sha256'][:12]}",
        f"contract {second['sha256'][:12]}",
        "Evaluate both under one contract before comparing them.",
    )
