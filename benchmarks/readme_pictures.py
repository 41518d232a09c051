"""The two moving pictures of README: the shipped policy on a clip, and on a wrong robot before and after a correction.

python -m benchmarks.readme_pictures                       # docs/pictures/follows.webp and docs/pictures/corrected.webp
python -m benchmarks.readme_pictures --effects found/effects.yaml     # correct what a diagnosis of that robot found

The wrong robot is the stand-in with three encoder offsets that no model declares. Without --effects the correction is
made from the true effects, as a diagnosis without an error would name them; no training takes place in either case.
"""

import argparse
from functools import partial
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from bumblebee.compensation.plan import compensate
from bumblebee.last_line import guarded
from bumblebee.measured.rollout import Rollout
from bumblebee.motion.clip import Clip
from bumblebee.motion.embedded import EmbeddedConfig, make
from bumblebee.motion.embedded.kinds import kinds
from bumblebee.policy.episodes import Episode, run_episodes
from bumblebee.policy.exported import ExportedPolicy
from bumblebee.report.films.film_file import write_film
from bumblebee.report.films.filmstrip import states
from bumblebee.report.films.render import render_frames
from bumblebee.robot.model import build_spec
from bumblebee.robot.sensors import NO_NOISE
from bumblebee.sim.effects import Effect, read_effects
from bumblebee.stand_in.body import StandInRobots
from bumblebee.stand_in.sealed import declared_g1, entry
from bumblebee.stand_in.undeclared.faults import peaks
from bumblebee.stand_in.undeclared.kinds import KINDS, Place
from bumblebee.view.shipped import shipped_policy

HOME = Path(__file__).parent.parent / "docs" / "pictures"
OFFSETS = {"left_ankle_pitch_joint": -0.25, "right_hip_pitch_joint": 0.2, "left_hip_roll_joint": 0.15}  # rad
_FPS = 12.5
_LARGEST = 1_500_000


def main(argv: list[str] | None = None) -> int:
    """Make both pictures."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--out", type=Path, default=HOME)
    options.add_argument("--effects", type=Path, help="effects.yaml of a diagnosis of this robot")
    given = options.parse_args(argv)
    return guarded(lambda: draw(given.out, read_effects(given.effects) if given.effects else true_effects()))


def draw(out: Path, effects: list[Effect]) -> None:
    """Write both pictures, and what they show."""
    with shipped_policy() as policy:
        follows = clip("kick_right")
        [one] = run(policy, follows, [], {})
        save(out / "follows.webp", film([one], [f"'{follows.name}', the shipped policy"]))
        walk = clip("walk")
        before, after = run(policy, walk, sealed(), {"after": compensate(effects)})
        said = [f"{name}: {ended(r, walk)}" for name, r in (("wrong robot", before), ("corrected", after))]
        save(out / "corrected.webp", film([before, after], said))
        print("\n".join(said))


def true_effects() -> list[Effect]:
    """The wrong robot's effects in the catalogue's words."""
    return [Effect("encoder_offset", (joint,), {"offset": offset}) for joint, offset in OFFSETS.items()]


def sealed() -> list[dict]:
    """The robot in the words of the stand-in's sealed file."""
    kind, robot = KINDS["encoder_offset"], declared_g1()
    drawn = {"axis": 0, "number": 8, "other": "right_knee_joint"}
    return [
        entry(kind, Place(robot, j, {**drawn, "sign": 1 if o > 0 else -1}, *peaks()[j]), abs(o))
        for j, o in OFFSETS.items()
    ]


def clip(name: str) -> Clip:
    """One motion of the embedded library."""
    return make(next(kind for kind in kinds() if kind.name == name), 0, EmbeddedConfig())


def run(policy: ExportedPolicy, motion: Clip, effects: list[dict], compensations: dict) -> list[Rollout]:
    """The policy as it is, then with each compensation, from the same start."""
    keys = ["before", *compensations]
    episodes = [Episode(key, key, motion.name, seed=0) for key in keys]
    robots = partial(StandInRobots, effects=effects)
    policies = dict.fromkeys(keys, policy)
    clips = {motion.name: motion}
    return run_episodes(robots, episodes, policies, clips, NO_NOISE, compensations=compensations, judged=True)


def ended(rollout: Rollout, motion: Clip) -> str:
    """How an episode ended."""
    if rollout.frames < motion.frames:
        return f"falls after {rollout.frames / rollout.control_hz:.1f} s"
    return "follows to the end"


def film(rollouts: list[Rollout], words: list[str]) -> list[Image.Image]:
    """Pictures of the rollouts side by side on one clock; one that has ended stands still."""
    step = round(rollouts[0].control_hz / _FPS)
    rows = np.arange(0, max(r.frames for r in rollouts), step)
    spec = build_spec()
    spec.compile()
    qpos = np.concatenate([states(r)[np.minimum(rows, r.frames - 1)] for r in rollouts])
    frames, how = render_frames(spec.to_xml(), qpos, 360, 400)
    if frames is None:
        raise RuntimeError(f"nothing can be rendered here: {how}")
    pictures = [
        Image.fromarray(np.concatenate(side, axis=1)) for side in zip(*np.split(frames, len(rollouts)), strict=True)
    ]
    for picture in pictures:
        pen = ImageDraw.Draw(picture)
        for number, text in enumerate(words):
            pen.text((360 * number + 12, 10), text, fill=(40, 44, 52), font_size=18)
    return pictures


def save(path: Path, pictures: list[Image.Image], fps: float = _FPS) -> None:
    """Write an animated picture that plays at real speed, over and over, in at most 1.5 MB."""
    frames = np.stack([np.asarray(picture) for picture in pictures])
    for quality in (80, 65, 50, 35):
        if (size := write_film(path, frames, fps, quality)) <= _LARGEST:
            break
    print(f"written: {path}, {len(pictures)} frames, {size / 1e6:.2f} MB")


if __name__ == "__main__":
    raise SystemExit(main())
