"""Errors that a delta action by regression takes out, on stand-in robots that differ by one thing each.

    python -m benchmarks.delta_regression --motions study/motions --out delta.jsonl

A policy (the shipped one, or `--policy`) is recorded on each robot, with sensor noise and an odometry that drifts. Of
its motions every other one is learnt from, the rest judge, as the pipeline's gate does. A line of JSON a robot; robots
that stand in the file are not run again. Processors alone, seconds for recording and minutes for a fit.
"""

import argparse
import json
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import torch

from benchmarks.study.motions import read_motions
from benchmarks.study.on_robot import KEY, exported, run_on_robot
from bumblebee.errors import EXIT_BAD_INPUT, BadInput
from bumblebee.evaluation.thinning import thin
from bumblebee.io.write import write_file
from bumblebee.learning.delta import DeltaConfig, compare, learn_delta, replay_error, stack
from bumblebee.learning.pretrained import FOLDER
from bumblebee.measured.rollout import Rollout
from bumblebee.motion.clip import Clip
from bumblebee.policy.episodes import Episode
from bumblebee.sim.engine_choice import make_engine
from bumblebee.sim.sensors import load_model
from bumblebee.stand_in.process import BASES
from bumblebee.stand_in.sealed import SCHEMA, entry, seal
from bumblebee.stand_in.undeclared.kinds import KINDS
from tasks.on_robot.stand_in import cut
from tasks.seal import drawn_place

ANKLES = ("left_ankle_pitch_joint", "right_ankle_pitch_joint")
ROBOTS: dict[str, tuple[tuple[str, str, float], ...]] = {
    "as declared": (),
    "ankles at .6 of their strength": tuple(("motor_strength", name, 0.4) for name in ANKLES),
    "dead band of .05 rad in both ankles": tuple(("dead_band", name, 0.05) for name in ANKLES),
    "half the ground friction, compliant ground": (("ground_friction", "", 0.5), ("ground_compliance", "", 0.05)),
    "left hip at .7 of its strength": (("motor_strength", "left_hip_pitch_joint", 0.3),),
}
"""Name -> kind, place and size of what the robot has and the declared model lacks."""
MOTIONS, REPEATS, SECONDS, SEED, WORLDS = 20, 3, 8.0, 100, 64


def sealed(effects: Sequence[tuple[str, str, float]], file: Path) -> Path:
    """Write the robot's file as `tasks.seal` does."""
    rng = np.random.default_rng(0)
    entries = [entry(KINDS[kind], drawn_place(name, rng), amount) for kind, name, amount in effects]
    file.write_text(json.dumps({"schema": SCHEMA, "sealed": file.name, "effects": entries, "sha256": seal(entries)}))
    return file


def row(policy: Path, effects: Sequence[tuple[str, str, float]], clips: Sequence[Clip], repeats: int) -> dict[str, Any]:
    """Record the robot, fit, and judge by the other motions.

    Args:
        policy: folder of a trained policy.
        effects: see `ROBOTS`.
        clips: the motions, each recorded `repeats` times.
        repeats: recordings of a motion.
    """
    episodes = [Episode(f"{clip.name}-{run}", KEY, clip.name, SEED + run) for clip in clips for run in range(repeats)]
    with tempfile.TemporaryDirectory() as scratch:
        own, robot = exported(policy, Path(scratch) / "policy"), sealed(effects, Path(scratch) / "robot.json")
        rollouts = run_on_robot(own, robot, clips, episodes, BASES[1], False, 2)
    return fitted(rollouts)


def fitted(rollouts: Sequence[Rollout], config: DeltaConfig | None = None) -> dict[str, Any]:
    """Changes on the other motions by a fit to every other motion."""
    config, model = config or DeltaConfig(), load_model()
    names = sorted({str(rollout.meta["motion"]) for rollout in rollouts})
    learnt, judges = (
        stack([rollout for rollout in rollouts if rollout.meta["motion"] in part], model)
        for part in (names[::2], names[1::2])
    )
    nothing = torch.zeros(model.nu)
    engine = make_engine("mujoco", model, config.num_envs, 1)
    delta, fit = learn_delta(engine, learnt, config, nothing)
    judge = make_engine("mujoco", model, WORLDS, 1)
    gain = compare(
        replay_error(judge, judges, nothing, None), replay_error(judge, judges, nothing, delta), judges.motions
    )
    return {"learnt": len(learnt.ids), **asdict(gain), "fit": fit.to_dict("list")}


def table(rows: Sequence[Mapping[str, Any]]) -> str:
    """The rows as Markdown."""
    lines = ["| robot | rollouts | 0.2 s, none | fitted | change | 1 s, none | fitted | change | the gate |"]
    lines.append("|" + "---|" * 9)
    for own in rows:
        cells = [own["robot"], str(own["rollouts"])]
        for change in own["change"].values():
            told = f"{change['relative']:+.2f} [{change['low']:+.2f}, {change['high']:+.2f}]"
            nothing = change["without"] == change["with"]
            cells += [f"{change['without']:.4f}", "the same" if nothing else f"{change['with']:.4f}"]
            cells.append("nothing corrected" if nothing else told)
        lines.append("| " + " | ".join([*cells, "kept" if own["promoted"] else "not kept"]) + " |")
    return "\n".join(lines)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the robots that are not in the file yet, and print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.delta_regression", description=__doc__)
    parser.add_argument("--motions", type=Path, required=True, help="of `benchmarks.study prepare`")
    parser.add_argument("--policy", type=Path, default=FOLDER, help="folder of a trained policy; else the shipped one")
    parser.add_argument("--out", type=Path, required=True, help="lines of JSON, one a robot")
    options = parser.parse_args(argv)
    try:
        rows = read_rows(options.out)
        motions = read_motions(options.motions)
        names = thin(motions.labels[motions.labels["split"] == "train"], MOTIONS)
        by_name = {own.clip.name: own.clip for own in motions.training()}
        clips = [cut(by_name[name], SECONDS) for name in names]
        torch.set_num_threads(1)
        for robot in [name for name in ROBOTS if name not in {own["robot"] for own in rows}]:
            rows.append({"robot": robot, "motions": motions.hash})
            rows[-1] |= row(options.policy, ROBOTS[robot], clips, REPEATS)
            write_file(options.out, "".join(json.dumps(own) + "\n" for own in rows))
            print(f"{robot}: {rows[-1]['reason']}", flush=True)
    except BadInput as error:
        print(error)
        return EXIT_BAD_INPUT
    print(table(rows))
    return 0


def read_rows(file: Path) -> list[dict[str, Any]]:
    """Rows of earlier runs.

    Raises:
        BadInput: for another kind of file.
    """
    try:
        return [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []
    except ValueError:
        raise BadInput(file, "lines of JSON of this benchmark", "something else", "Choose another --out.") from None


if __name__ == "__main__":
    raise SystemExit(main())
