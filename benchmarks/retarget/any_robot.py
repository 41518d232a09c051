"""Motions of people on any humanoid, measured: `python -m benchmarks.retarget.any_robot PEOPLE --model M --mapping Y`.

`bumblebee.motion.filters.quality` knows the G1 and its table of facts. Here they are made of a tree,
the corners of its soles and its capsules, so that robots can be compared.
"""

import argparse
import json
import time
from pathlib import Path

import numpy as np

from benchmarks.retarget.table import markdown, summary
from bumblebee.motion.filters.quality import TOLERANCE, TOUCHES, at_times
from bumblebee.motion.human.motion import HumanMotion
from bumblebee.motion.reading.files import find_motions
from bumblebee.motion.retarget.collision import depths, obstacles, shape_heights
from bumblebee.motion.retarget.config import RetargetConfig
from bumblebee.motion.retarget.mapping import CORNERS, Robot, read_robot, this_robot
from bumblebee.motion.retarget.retarget import aim, fit
from bumblebee.motion.retarget.solve import Trajectory
from bumblebee.motion.retarget.tree import Poses, points, poses
from bumblebee.motion.stance import human_contacts


def measures(robot: Robot, at: Trajectory, fps: float, human: np.ndarray) -> dict[str, float]:
    """How good a trajectory is, in the units and by the rules of `bumblebee.motion.filters.quality`.

    Args:
        robot: with its tree and soles.
        at: T frames.
        fps: their rate [Hz].
        human: landmarks (T, 18, 3) [m] of the person at the same frames, which tell when a foot stands.
    """
    now = poses(robot.tree, at.root, at.turn, at.joint)
    contacts = human_contacts(human, fps)
    kept = obstacles(robot)
    deep = depths(now, kept)
    return {
        **_floor(robot, now, shape_heights(now, kept), contacts.any(axis=1)),
        **_skate(robot, now, fps, contacts),
        **_joints(robot, at.joint, fps),
        "self_penetration_mm": 1000 * float(deep.max()),
        "self_collision_frames": float((deep > TOUCHES).mean()),
    }


def _floor(robot: Robot, now: Poses, links: np.ndarray, standing: np.ndarray) -> dict[str, float]:
    soles = points(now, robot.sole_body, robot.sole)[..., 2] - robot.radius
    low = 1000 * np.minimum(soles.min(axis=1), links)
    above = np.maximum(low[standing], 0.0)
    return {
        "penetration_p1_mm": max(0.0, -float(np.percentile(low, 1))),
        "penetration_mm": max(0.0, -float(low.min())),
        "floating_p99_mm": float(np.percentile(above, 99)) if len(above) else float("nan"),
        "floating_mm": float(above.max()) if len(above) else float("nan"),
    }


def _skate(robot: Robot, now: Poses, fps: float, contacts: np.ndarray) -> dict[str, float]:
    """Horizontal speed of the lowest corner of each sole that stands in two frames in a row [mm/s]."""
    where = points(now, robot.sole_body, robot.sole).reshape(len(contacts), 2, CORNERS, 3)
    speed = np.linalg.norm(np.diff(where[..., :2], axis=0), axis=-1) * fps
    corner = (where[1:, ..., 2] + where[:-1, ..., 2]).argmin(axis=2)
    values = 1000 * np.take_along_axis(speed, corner[..., None], axis=2)[..., 0][contacts[1:] & contacts[:-1]]
    return {"skate_mm_s": float(values.mean()) if len(values) else float("nan")}


def _joints(robot: Robot, joint: np.ndarray, fps: float) -> dict[str, float]:
    excess = np.maximum(robot.tree.low - joint, joint - robot.tree.high)
    over = np.abs(np.diff(joint, axis=0)) * fps - robot.fastest
    return {
        "limit_frames": float((excess > TOLERANCE).any(axis=1).mean()),
        "velocity_share": float((over > 0).mean()),
        "jerk_rad_s3": float(np.abs(np.diff(joint, 3, axis=0)).mean()) * fps**3,
    }


def measured(robot: Robot, motion: HumanMotion, fps: float = 50.0) -> dict[str, float]:
    """One motion retargeted and measured, with its frames a second of one core."""
    config, began = RetargetConfig(), time.process_time()
    at = fit(aim(motion, robot, fps, config), robot, config)
    seconds = time.process_time() - began
    human = at_times(motion.positions, motion.fps, np.arange(len(at.root)) / fps)
    return {"frames_a_second": len(at.root) / max(seconds, 1e-9)} | measures(robot, at, fps, human)


def main() -> None:
    """Measure the people at a path on a robot, the G1 without one."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("people", type=Path, help="a file, folder or archive with motions of people")
    parser.add_argument("--model", type=Path, help="MJCF; with --mapping")
    parser.add_argument("--mapping", type=Path)
    parser.add_argument("--motions", nargs="+", help="names; all without")
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    robot = read_robot(options.model, options.mapping) if options.model else this_robot()
    rows = {}
    for found in find_motions(options.people):
        for motion in found.motions:
            if isinstance(motion, HumanMotion) and motion.name in (options.motions or [motion.name]):
                rows[motion.name] = measured(robot, motion)
                print(motion.name, {name: round(value, 3) for name, value in rows[motion.name].items()}, flush=True)
    options.out.write_text(json.dumps(rows, indent=1) + "\n")
    print(markdown({f"{robot.name} ({len(rows)})": summary(rows)}))


if __name__ == "__main__":
    main()
