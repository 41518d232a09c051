"""Cells of the command line: import, gap, diagnose and replay on a one-joint robot, hit, looked at, started again."""

import subprocess
import time
from collections.abc import Sequence
from pathlib import Path

import mujoco
import numpy as np
import pandas as pd

from benchmarks.kills.cell import SIGNALS, Cell, Outcome
from benchmarks.kills.loop import disk
from benchmarks.kills.processes import last_line, orphans, start, wait_end
from bumblebee.measured.rollout import Rollout, write_rollout
from flows.environment import environment
from flows.workspace import HOME

XML = """<mujoco><compiler angle="radian"/><option timestep="0.002"/><worldbody>
<body name="link"><joint name="joint" axis="0 1 0" armature="0.01" damping="0.05"{friction}/>
<inertial pos="0 0 -0.1" mass="1" diaginertia="0.01 0.01 0.01"/></body></worldbody>
<actuator><position name="joint" joint="joint" kp="30" kv="1"/></actuator></mujoco>"""
RATE, SECONDS, COUNT, LOGS = 50, 8.0, 6, 50
DELAY = {"diagnose": 6.0, "gap": 2.5, "replay": 2.5, "import": 2.0}  # [s] from the start to the blow


def cells() -> list[Cell]:
    """Every command with every signal, a full disk, one without write access, and two at once."""
    ways = (*SIGNALS, "disk full", "read-only", "two at once")
    return [Cell(command, "arm", how) for command in DELAY for how in ways]


def run(cell: Cell, scratch: Path) -> Outcome:
    """One cell; the inputs must be as they were, and the output whole or not there."""
    inputs, place = scratch / "inputs", scratch / "place"
    if not inputs.exists():
        make_inputs(inputs)
    log = scratch / "log.txt"
    log.write_bytes(b"")
    before = contents(inputs)
    with disk(place, cell.how in ("disk full", "read-only")) as fill:
        words = command_line(cell.target, inputs, place)
        if cell.how == "disk full":
            fill(True)
        elif cell.how == "read-only":
            remount(place, "ro")
        status, seconds, alive = blow(cell, words, log)
        said, half = last_line(log), [str(path.relative_to(place)) for path in place.glob("out*") if empty(path)]
        remount(place, "rw") if cell.how == "read-only" else fill(False)
        again = 0
        if not (place / output_name(cell.target)).exists():
            again, _ = wait_end(start(words, HOME, environment(scratch), cell.name, log))
            half += [path.name for path in place.iterdir() if path.name.startswith(".out")]
    lost = [name for name, data in before.items() if contents(inputs).get(name) != data]
    refused = cell.how in ("disk full", "read-only") and status != 2
    half += [f"status {status} for a disk that takes nothing"] if refused else []
    traceback = "Traceback (most recent call last)" in log.read_text(errors="replace")
    return Outcome(cell.name, round(seconds, 1), status, said, tuple(lost), tuple(alive), tuple(half), traceback, again)


def blow(cell: Cell, words: Sequence[str], log: Path) -> tuple[int | None, float, list[str]]:
    """Start, hit, wait; (status, seconds until the end, orphans)."""
    env = environment(log.parent)
    running = start(words, HOME, env, cell.name, log)
    if cell.how in SIGNALS:
        time.sleep(DELAY[cell.target])
        if running.poll() is None:
            running.send_signal(SIGNALS[cell.how])
    second = start(words, HOME, env, cell.name, log) if cell.how == "two at once" else None
    status, seconds = wait_end(running)
    if second is not None:
        other, _ = wait_end(second)
        status = status if other in (0, 2) else other  # the slower one may find that its place is taken
    return status, seconds, orphans(cell.name)


def command_line(command: str, inputs: Path, place: Path) -> list[str]:
    """Arguments after `python`."""
    model, data = str(inputs / "model.xml"), str(inputs / "data")
    words = ["-m", "bumblebee.cli", command]
    if command == "import":
        columns = ["--kind", "csv", "--columns", str(inputs / "map.yaml"), "--model", model]
        return [*words, str(inputs / "logs"), str(place / "out"), *columns]
    if command == "replay":
        return [*words, model, data, "--out", str(place / "out.json")]
    return [*words, model, data, "--out", str(place / "out")]


def output_name(command: str) -> str:
    """Name of what a command leaves in its place."""
    return "out.json" if command == "replay" else "out"


def make_inputs(folder: Path) -> None:
    """A declared model, rollouts of the same robot with dry friction, the same as CSV with a map."""
    (folder / "logs").mkdir(parents=True)
    (folder / "model.xml").write_text(XML.format(friction=""))
    model = mujoco.MjModel.from_xml_string(XML.format(friction=' frictionloss="0.3"'))
    rng = np.random.default_rng(0)
    for number in range(COUNT):
        time_, place, speed, target = simulate(model, rng)
        rollout = Rollout(f"r{number}", ("joint",), RATE, time_, place, speed, joint_target=target)
        write_rollout(folder / "data" / "rollouts" / f"r{number}.parquet", rollout)
        table = np.column_stack([time_, place, speed, target])
        for copy in range(LOGS):  # so that reading them takes a while
            frame = pd.DataFrame(table, columns=["t", "q", "v", "u"])
            frame.to_csv(folder / "logs" / f"r{number}-{copy}.csv", index=False)
    (folder / "map.yaml").write_text(
        "joints: [joint]\ntime: t\ncolumns: {joint_pos: [q], joint_vel: [v], joint_target: [u]}\n"
    )


def simulate(model: mujoco.MjModel, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Stamps (T,) [s], position, velocity and target (T, 1) [rad] of a slow wander with encoder noise."""
    data, frames = mujoco.MjData(model), int(SECONDS * RATE)
    phase, rate = rng.uniform(0, 6.28, 3), rng.uniform(1.0, 6.0, 3)
    at = np.arange(frames) / RATE
    target = 0.25 * np.sin(at[:, None] * rate + phase).sum(axis=1, keepdims=True)
    place, speed = np.empty((frames, 1)), np.empty((frames, 1))
    for k in range(frames):
        place[k], speed[k] = data.qpos, data.qvel
        data.ctrl[:] = target[k]
        mujoco.mj_step(model, data, round(1 / RATE / model.opt.timestep))
    place += 3e-4 * rng.standard_normal(place.shape)
    speed += 1e-2 * rng.standard_normal(speed.shape)
    return at, place, speed, target


def contents(folder: Path) -> dict[str, bytes]:
    """Every file below a folder."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def empty(path: Path) -> bool:
    """Whether an output holds nothing, or a file of nothing."""
    if path.is_file():
        return path.stat().st_size == 0
    files = [file for file in path.rglob("*") if file.is_file()]
    return not files or any(file.stat().st_size == 0 for file in files)


def remount(place: Path, mode: str) -> None:
    """Take the write access of a disk away, or give it back."""
    subprocess.run(["mount", "-o", f"remount,{mode}", str(place)], check=True)
