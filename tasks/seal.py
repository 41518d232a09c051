"""Stage seal: draws the stand-in robot's undeclared effects by seed and seals them in data/sealed/robot.json.

Only the stand-in's process reads that file, and the report at the very end. With a real robot this stage has no use.
"""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from bumblebee.deploy.stand_in_effects import PARAMETERS, seal
from bumblebee.ranges import Name, Range, Ranged, Seed
from bumblebee.robot.facts import g1_bodies, joint_names, joints
from bumblebee.robot.model import gains
from tasks.stage import load, output_file, run_stage

OUT = Path("data/sealed/robot.json")
UNITS = {
    "coulomb_friction": "N m",
    "viscous_friction": "N m s/rad",
    "armature": "kg m^2",
    "motor_strength": "",
    "command_delay": "s",
    "encoder_offset": "rad",
    "link_mass": "kg",
}


@dataclass(frozen=True)
class SealConfig(Ranged):
    """What may be sealed."""

    seed: Seed = 7
    """Of the draw."""
    n_effects: Annotated[int, Range(least=0, most=1000)] = 2
    """Number of effects, each of another kind on another joint or body; 0: the diagnosis' null test."""
    kinds: tuple[Name, ...] = tuple(PARAMETERS)
    """Kinds to draw from."""
    joints: tuple[Name, ...] = tuple(
        f"{side}_{name}_joint"
        for side in ("left", "right")
        for name in ("hip_pitch", "knee", "ankle_pitch", "shoulder_pitch", "elbow")
    )
    """Joints to draw from: those that most motions move."""
    bodies: tuple[Name, ...] = ("torso_link", "pelvis", "left_knee_link", "right_knee_link")
    """Bodies to draw from for `link_mass`."""

    def __post_init__(self) -> None:
        """Refuse names that do not exist, and more effects than kinds or joints."""
        super().__post_init__()
        self.require_names("kinds", PARAMETERS)
        self.require_names("joints", joint_names())
        self.require_names("bodies", g1_bodies())
        self.require(bool(self.bodies) or "link_mass" not in self.kinds, "bodies", "at least one for link_mass")
        most = min(len(self.kinds), len(self.joints))
        self.require(self.n_effects <= most, "n_effects", f"at most {most}, as many as there are kinds and joints")


def main() -> None:
    """Draw and seal."""
    config = load("seal", SealConfig)
    effects = draw(config)
    sealed: dict[str, Any] = {
        "schema": 1,
        "sealed": "Undeclared effects of the stand-in robot, for its process and the final report only.",
        "seed": config.seed,
        "effects": effects,
        "sha256": seal(effects),
    }
    with output_file(OUT) as path:
        path.write_text(json.dumps(sealed, indent=1) + "\n")
    print(f"sealed {len(effects)} effects, sha256 {sealed['sha256'][:12]}")


def draw(config: SealConfig) -> list[dict[str, Any]]:
    """The effects as they stand in the file; the same configuration gives the same effects."""
    rng = np.random.default_rng(config.seed)
    kinds = rng.permutation(config.kinds)[: config.n_effects]
    places = iter(rng.permutation(config.joints))
    effects = []
    for kind in map(str, kinds):
        place = str(rng.choice(config.bodies)) if kind == "link_mass" else str(next(places))
        value = size(kind, place, rng)
        parameter = {PARAMETERS[kind]: value}
        effects.append({"effect": kind, "where": [place], "parameters": parameter, "unit": UNITS[kind]})
    return effects


def size(kind: str, place: str, rng: np.random.Generator) -> float:
    """A noticeable size of an effect, absolute: what the joint or body then has, not what is added to it."""
    share = float(rng.uniform())
    if kind == "link_mass":
        declared = float(g1_bodies()[place]["mass"])
        return round(declared * (1.3 + 0.3 * share), 3)
    joint = next(joint for joint in joints() if joint.name == place)
    kp, kd = gains(joint)
    sizes = {
        "coulomb_friction": kp * (0.015 + 0.015 * share),  # holds the joint up to 0.015-0.03 rad off its target
        "viscous_friction": kd * (0.4 + 0.4 * share),
        "armature": joint.armature * (2.0 + share),
        "motor_strength": 0.65 + 0.15 * share,
        "command_delay": round(0.010 + 0.010 * share, 3),  # the stand-in delays by whole milliseconds
        "encoder_offset": (0.03 + 0.03 * share) * float(rng.choice([-1, 1])),
    }
    return round(sizes[kind], 5)


if __name__ == "__main__":
    run_stage(main, logs=False)
