"""One run from a policy's folder to measured rollouts: load, meet the robot, refuse or go, write down."""

from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from bumblebee.compensation.file import read_compensation
from bumblebee.compensation.numbers import Compensation
from bumblebee.errors import BadInput
from bumblebee.measured.rollout import write_rollout
from bumblebee.motion.clip import Clip
from bumblebee.policy.exported import ExportedPolicy
from bumblebee.robot.facts import ROBOT
from bumblebee.robot.model import write_xml
from bumblebee.wire.clock import Clock
from bumblebee.wire.job import Job
from bumblebee.wire.journal import read_journal
from bumblebee.wire.links.link import open_link
from bumblebee.wire.messages import CARD, STATE
from bumblebee.wire.operator.console import Ended, operate
from bumblebee.wire.operator.watcher import Watcher
from bumblebee.wire.plan import ORDER_HZ, Plan
from bumblebee.wire.policy_end.brain import Brain
from bumblebee.wire.rollouts import new_id, rollout_of
from bumblebee.wire.safety.intake import numbers_for
from bumblebee.wire.safety.limits import Limits, drives_of
from bumblebee.wire.safety.phases import Ramps
from bumblebee.wire.safety.preflight import Wanted, check, meet, new_controller

JOURNAL = ".journal"
"""Ending of a journal's name."""


@dataclass(frozen=True)
class Run:
    """Policy, clip, wire and output of one run."""

    policy: Path
    clip: Clip
    wire: str
    out: Path
    """Dataset folder: a run adds `journals/ID.journal` and `rollouts/ID.parquet`."""
    at: str = ""
    compensation: Path | None = None
    limits: Limits = field(default_factory=Limits)
    ramps: Ramps = field(default_factory=Ramps)
    unattended: bool = False
    slow: float = 1.0
    operator: str = ""


def run(
    job: Run, say: Callable[[str], None] = lambda line: None, watcher: Watcher | None = None
) -> tuple[Ended, Path | None]:
    """Run a policy on a robot; how it ended, and the rollout, or None where the policy never carried the robot.

    Args:
        job: what is run.
        say: told what happens, line by line.
        watcher: who is shown the run, and may stop it.

    Raises:
        BadInput: anything that does not fit, before anything moves.
    """
    policy = ExportedPolicy.load(job.policy)
    compensation = read_compensation(job.compensation) if job.compensation else None
    wanted = _wanted(job, policy, compensation)
    every = ORDER_HZ / float(policy.contract["control_hz"])
    if every != round(every):
        came = f"{policy.contract['control_hz']:g}"
        raise BadInput(f"{job.policy}: control_hz", f"a whole part of {ORDER_HZ}", came, "Export it at 50 Hz.")
    link = open_link(job.wire, [STATE, CARD], job.at)
    try:
        card, state = meet(link, Clock(job.slow))
    finally:
        link.close()
    check(card, state, wanted)
    kind = "simulated" if card.simulated else "REAL"
    if watcher:
        hz = float(policy.contract["control_hz"])
        about = {"policy": job.policy.name, "motion": job.clip.name, "seconds": job.clip.duration, "hz": hz}
        watcher.show({"run": about | {"robot": f"{card.name}, {kind}"}})
    say(f"{card.name}, {kind}, {card.state_hz:g} states a second: nothing refused")
    controller, frames = new_controller(), job.clip.frames
    numbers, rest = numbers_for(policy.sensors), (job.unattended, job.limits, job.ramps)
    plan = Plan(controller, card.robot, round(every), frames, wanted.hold, numbers, *rest)
    journal, about = _journal(job, policy, compensation)
    to_guard = Job(job.wire, job.at, job.slow, plan, wanted.drives)
    ended = operate(to_guard, job.policy, job.clip, job.compensation, journal, about, say, watcher)
    return ended, write_down(journal, job.out)


def write_down(journal: Path, out: Path) -> Path | None:
    """Write the rollout of a journal into a dataset, beside the declared model; None for a run without one.

    Raises:
        BadInput: no journal, or a rollout of that name is there already.
    """
    about, rows = read_journal(journal)
    try:
        rollout = rollout_of(about, rows)
    except BadInput as few:
        if few.where == about["id"]:
            return None
        raise
    path = out / "rollouts" / f"{rollout.rollout_id}.parquet"
    write_rollout(path, rollout)
    if not (out / "model.xml").exists():
        write_xml(out / "model.xml")
    return path


def _wanted(job: Run, policy: ExportedPolicy, compensation: Compensation | None) -> Wanted:
    drives = drives_of(policy.contract)
    kp, kd = (drives.kp, drives.kd) if compensation is None else (compensation.kp, compensation.kd)
    hold = Brain(policy, job.clip, compensation).hold()
    largest = (np.maximum(drives.kp, kp), np.maximum(drives.kd, kd))
    numbers = numbers_for(policy.sensors)
    return Wanted(policy.contract, drives, *largest, job.clip, hold, numbers, job.limits, job.unattended)


def _journal(job: Run, policy: ExportedPolicy, compensation: Compensation | None) -> tuple[Path, dict[str, object]]:
    """A new journal's path, and what it says first."""
    folder, now = job.out / "journals", datetime.now(UTC)
    folder.mkdir(parents=True, exist_ok=True)
    name = new_id(job.clip.name, [*folder.glob(f"*{JOURNAL}"), *(job.out / "rollouts").glob("*.parquet")], now)
    about: dict[str, object] = {
        "id": name,
        "robot": ROBOT,
        "joints": list(policy.contract["joints"]),
        "control_hz": float(policy.contract["control_hz"]),
        "motion": job.clip.name,
        "policy": {"name": job.policy.name, "version": "", "sha256": policy.sha256},
        "recorded_at": now.isoformat(timespec="seconds"),
        "operator": job.operator,
    }
    if compensation is not None:
        about["compensation"] = compensation.sha256
    return folder / f"{name}{JOURNAL}", about
