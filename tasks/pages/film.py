"""The report's film: one motion that failed on the stand-in before the round and is followed after it, side by side."""

import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pandas as pd

from bumblebee.measured.rollout import Rollout, read_rollout
from bumblebee.motion.clip import Clip
from bumblebee.motion.store import read_library, write_library
from bumblebee.report.films.film_choice import COMPENSATED, Choice, won_back
from bumblebee.report.films.filmstrip import Film, film, film_pair
from bumblebee.report.page import Block, heading, note, still, text
from bumblebee.report.page import film as film_block
from bumblebee.report.results import LoopResults, RoundResults
from bumblebee.robot.model import build_spec
from tasks.on_robot.stand_in import cut, start_stand_in
from tasks.running import paths

_MOST, _LEAD = 3, 4.0  # candidates that are run; seconds of the film before the failure
_REAL_SPEED = "True joint angles and base pose at real speed; what has fallen stands still and pale."


def film_blocks(results: LoopResults, asked: str, seed: int) -> list[Block]:
    """Both runs side by side; where the round won no motion back, the last policy alone with a sentence.

    Args:
        results: the loop's, on the stand-in.
        asked: the motion to show; "" for the liveliest.
        seed: of the start state and the sensor noise where one run is shown alone.
    """
    episodes = pd.read_parquet(paths.EPISODES)
    speed = pd.read_csv(paths.CLUSTERS / "statistics.csv").set_index("name")["speed"].to_dict()
    if results.rounds:
        turn = results.rounds[-1]
        choices = won_back(episodes, speed, turn.n, turn.parent, asked)[:_MOST]
        if choices:
            return pair_blocks(choices, turn, results.contract)
    return alone(episodes, speed, asked, seed)


def pair_blocks(choices: list[Choice], turn: RoundResults, contract: dict[str, Any]) -> list[Block]:
    """The counted episodes run once more as they were; of several motions the first in which the robot falls."""
    clips = as_evaluated([choice.motion for choice in choices], contract)
    policies: dict[str, Path] = {}
    compensations, episodes = {}, []
    for choice in choices:
        folders = {
            "before": paths.expert(turn.parent, choice.cluster),
            choice.after: paths.expert(turn.parent if choice.after == COMPENSATED else turn.n, choice.cluster),
        }
        for side, folder in folders.items():
            key = f"{side}-{choice.cluster}"
            policies[key] = folder
            if side == COMPENSATED:
                compensations[key] = str(paths.compensation_plan(turn.n).resolve())
            episodes.append(
                {"rollout_id": f"{side}-{choice.motion}", "policy": key, "motion": choice.motion, "seed": choice.seed}
            )
    rollouts = run(policies, episodes, clips, contract.get("start_noise"), compensations)
    length = {clip.name: clip.frames for clip in clips}
    both = {c: (rollouts[f"before-{c.motion}"], rollouts[f"{c.after}-{c.motion}"]) for c in choices}
    choice = next((c for c, (before, _) in both.items() if before.frames < length[c.motion]), choices[0])
    return shown_pair(choice, *both[choice], length[choice.motion])


def shown_pair(choice: Choice, before: Rollout, after: Rollout, frames: int) -> list[Block]:
    """The film of both, or stills where nothing renders."""
    fails = choice.fails_at / before.control_hz
    start = max(fails - _LEAD, 0.0)
    shown = film_pair(before, after, model_xml(), start)
    headings = (f"before: {ended(before, frames, fails)}", f"{choice.after}: {ended(after, frames, None)}")
    since = f" The film begins {start:.1f} s after the start." if start else ""
    caption = f"The counted episodes themselves: the same start, the same sensor noise. {_REAL_SPEED}{since}"
    title = heading("The same motion on the robot, before and after")
    if shown.sheet is None:
        sides = [side for side in headings for _ in range(len(shown.stills) // 2)]
        pictures = [
            still(uri, f"{side}; {at:.1f} s", f"The robot {at:.1f} s after the start, {side}.")
            for side, (at, uri) in zip(sides, shown.stills, strict=True)
        ]
        return [title, text(f"'{choice.motion}'. {caption}"), *pictures, note(shown.note)]
    words = f"The robot twice during '{choice.motion}': left {headings[0]}, right {headings[1]}."
    return [title, film_block(shown.sheet, choice.motion, caption, words, headings)]


def ended(rollout: Rollout, frames: int, fails: float | None) -> str:
    """How an episode of `frames` ended; `fails` is when it left the motion [s], None if it did not."""
    if rollout.frames < frames:
        return f"falls after {rollout.frames / rollout.control_hz:.1f} s"
    return "followed to the end" if fails is None else f"leaves the motion after {fails:.1f} s"


def alone(episodes: pd.DataFrame, speed: dict[str, float], asked: str, seed: int) -> list[Block]:
    """One more episode of the generalist on the stand-in."""
    motion, why = chosen_alone(episodes, speed, asked)
    clips = read_library(paths.FILTERED, [motion])
    episode = {"rollout_id": "film", "policy": "generalist", "motion": motion, "seed": seed}
    rollout = run({"generalist": paths.GENERALIST}, [episode], clips)["film"]
    said = text(
        f"No motion that failed before the round was won back, so one policy is shown: '{motion}', {why}. It is one "
        "more episode, with its own start and sensor noise, and may end otherwise than those that were counted."
    )
    return [heading("A motion on the robot"), said, *alone_blocks(film(rollout, model_xml()), motion)]


def alone_blocks(shown: Film, motion: str) -> list[Block]:
    """The film of one run, or its stills."""
    if shown.sheet is not None:
        caption = "True joint angles and base pose at real speed. Arrow keys step on the slider."
        return [film_block(shown.sheet, f"Generalist: '{motion}'", caption, f"The robot during '{motion}'.")]
    stills = [still(uri, f"{at:.1f} s", f"The robot {at:.1f} s after the start.") for at, uri in shown.stills]
    return [*stills, note(shown.note)]


def chosen_alone(episodes: pd.DataFrame, speed: dict[str, float], asked: str) -> tuple[str, str]:
    """The motion asked for; else the liveliest that the generalist followed on the robot, else the longest followed."""
    if asked:
        return asked, "the motion that was asked for"
    own = episodes[(episodes["policy"] == "generalist") & (episodes["engine"] == "stand_in")]
    own = own.assign(speed=own["motion"].map(speed).fillna(0.0))
    good = own[own["success"]]
    if len(good):
        motion = good.sort_values("speed").iloc[-1]["motion"]
        return str(motion), "the fastest motion that the generalist followed to the end in the evaluation"
    motion = own.sort_values("frames").iloc[-1]["motion"]
    return str(motion), "the motion that the generalist followed longest in the evaluation, though not to the end"


def as_evaluated(names: Iterable[str], contract: dict[str, Any]) -> list[Clip]:
    """The clips as long as the evaluation's contract has them."""
    frames = {motion["name"]: motion["frames"] for motion in contract["motions"]}
    clips = read_library(paths.FILTERED, list(dict.fromkeys(names)))
    return [cut(clip, (frames[clip.name] - 0.5) / clip.fps) for clip in clips]


def run(
    policies: dict[str, Path],
    episodes: list[dict[str, Any]],
    clips: list[Clip],
    start_noise: dict[str, float] | None = None,
    compensations: dict[str, str] | None = None,
) -> dict[str, Rollout]:
    """Rollouts on the stand-in robot by their ids."""
    plan: dict[str, Any] = {"policies": {key: str(path.resolve()) for key, path in policies.items()}}
    plan |= {"episodes": episodes, "judged": True}
    plan |= {"start_noise": start_noise} if start_noise else {}
    plan |= {"compensations": compensations} if compensations else {}
    with tempfile.TemporaryDirectory() as folder:
        write_library(Path(folder) / "clips", clips)
        start_stand_in(plan, Path(folder) / "clips", Path(folder) / "rollouts", Path(folder), threads=2)
        return {
            e["rollout_id"]: read_rollout(Path(folder) / "rollouts" / f"{e['rollout_id']}.parquet") for e in episodes
        }


def model_xml() -> str:
    """MJCF of the declared robot, for drawing."""
    spec = build_spec()
    spec.compile()
    return str(spec.to_xml())
