"""Cost of a diagnosis: wall time, processor time and peak memory on generated rollouts of a standing G1.

    python -m benchmarks.diagnosis.diagnosis_cost                     6 rollouts, 20 motions x 8 rollouts, of 8 s
    python -m benchmarks.diagnosis.diagnosis_cost --rows small --kinds   the first with nothing to find
    python -m benchmarks.diagnosis.diagnosis_cost --rows small --kinds position_friction  ... a law of no catalogue
    python -m benchmarks.diagnosis.diagnosis_cost --keep FOLDER          the data and diagnoses are kept

The robot is the sealed benchmark's (1 ms, another integrator, effects of its own), three effects in it by default; it
balances under moving arms and a shifting weight. Each diagnosis is the command line in a process of its own, on the
processors that this one may use.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.undeclared.excite import StandPlan
from benchmarks.undeclared.flight import fly, rollouts
from benchmarks.undeclared.robots import declared
from bumblebee.measured.rollout import write_rollout
from bumblebee.stand_in.undeclared.kinds import KINDS, Place

SECONDS = 8.0
ROWS = {"small": (6, 1), "paper": (20, 8)}
"""Motions and rollouts of each."""
SEALED = {
    "coulomb_friction": ("left_shoulder_pitch_joint", 0.8),
    "command_delay": ("right_elbow_joint", 0.012),
    "link_mass": ("right_wrist_yaw_link", 0.5),
    "armature": ("right_shoulder_roll_joint", 1.0),
    "joint_spring": ("waist_yaw_joint", 4.0),
    "position_friction": ("left_shoulder_pitch_joint", 1.5),
    "gain_cycle": ("right_elbow_joint", 0.4),
}
"""Kind -> place and size: N m, s, share of the declared mass, share of the declared armature, N m/rad, N m, a share."""
_DEFAULT = ("coulomb_friction", "command_delay", "link_mass")
_START = 0.005  # [rad] by which repeats of a motion start apart


class _Some:
    """Some of a plan's robots."""

    def __init__(self, plan: StandPlan, rows: np.ndarray, moved: np.ndarray) -> None:
        self._plan, self._rows, self.ticks = plan, rows, plan.ticks
        self.qpos, self.qvel = plan.qpos[rows].copy(), plan.qvel[rows]
        self.qpos[:, -moved.shape[1] :] += moved

    def target(self, tick: int, qpos: np.ndarray, qvel: np.ndarray) -> np.ndarray:
        """Joint targets (R, J) [rad]."""
        every = self._plan.qpos.copy(), self._plan.qvel.copy()
        every[0][self._rows], every[1][self._rows] = qpos, qvel
        return self._plan.target(tick, *every)[self._rows]


def write_dataset(folder: Path, motions: int, repeats: int, kinds: Sequence[str], seed: int = 5) -> Path:
    """Write `folder`/rollouts of a robot with `kinds`, and the declared model beside them; return the model's path.

    Of twice as many motions those are taken that it stands through to the end.
    """
    robot = declared("stand")
    laws = [KINDS[kind].make(Place(robot, SEALED[kind][0], {}), SEALED[kind][1])[0] for kind in kinds]
    rng = np.random.default_rng(seed)
    plan = StandPlan(robot, 2 * motions, SECONDS, np.random.default_rng(seed))
    stood = fly(robot, laws, plan, np.random.default_rng(seed)).alive == plan.ticks
    rows = np.flatnonzero(stood)[:motions]
    (folder / "rollouts").mkdir(parents=True)
    for r in range(repeats):
        moved = _START * rng.standard_normal((len(rows), len(robot.joints))) * (r > 0)
        flight = fly(robot, laws, _Some(plan, rows, moved), np.random.default_rng([seed, r]))
        for made in rollouts(robot, flight, 1.0, rng, "m"):
            name = f"{made.rollout_id}-{r}"
            meta = {**made.meta, "motion": made.rollout_id}
            write_rollout(folder / "rollouts" / f"{name}.parquet", replace(made, rollout_id=name, meta=meta))
    model = folder / "declared.xml"
    model.write_text(robot.spec.to_xml(), encoding="utf-8")
    return model


def measure(model: Path, folder: Path, out: Path) -> tuple[float, float, float]:
    """Wall time [s], processor time [s] and peak memory [MB] of one diagnosis; its report goes to standard output."""
    return cost([sys.executable, "-m", "bumblebee.cli", "diagnose", str(model), str(folder), "--out", str(out)])


def cost(command: Sequence[str]) -> tuple[float, float, float]:
    """Wall time [s], processor time [s] and peak memory [MB] of one command and of the children that it waits for.

    Linux counts no less memory than this process itself has had when it starts the command.
    """
    began = time.monotonic()
    process = subprocess.Popen(command)
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise subprocess.CalledProcessError(process.returncode, command)
    unit = 1e6 if sys.platform == "darwin" else 1e3
    return time.monotonic() - began, used.ru_utime + used.ru_stime, used.ru_maxrss / unit


def main() -> None:
    """Generate the datasets, diagnose each, print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rows", choices=tuple(ROWS), nargs="+", default=list(ROWS))
    parser.add_argument("--kinds", choices=tuple(SEALED), nargs="*", default=list(_DEFAULT), help="effects to seal")
    parser.add_argument("--keep", type=Path, help="new folder for datasets and diagnoses; else they are thrown away")
    options = parser.parse_args()
    lines = []
    with tempfile.TemporaryDirectory() as scratch:
        for row in options.rows:
            folder = (options.keep or Path(scratch)) / row
            motions, repeats = ROWS[row]
            model = write_dataset(folder, motions, repeats, options.kinds)
            count = len(list((folder / "rollouts").iterdir()))
            wall, spent, memory = measure(model, folder, folder / "diagnosis")
            lines.append(f"{row:6s} {count:9d} {wall:8.0f} {spent:12.0f} {memory:8.0f}")
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    print(f"\nsealed: {', '.join(options.kinds) or 'nothing'}; {cores} processors")
    print("row     rollouts  wall [s]  processor [s]  peak [MB]")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
