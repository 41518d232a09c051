"""One case: a sealed arm, a poor dataset of it, its diagnosis, the plan, and what the planned and random runs add."""

import time
import traceback
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from benchmarks.undeclared.detectable import make_eye
from benchmarks.undeclared.draw import draw_one
from benchmarks.undeclared.excite import HZ
from benchmarks.undeclared.flight import Flight, fly, rollouts
from benchmarks.undeclared.lottery import Case as Wanted
from benchmarks.undeclared.robots import declared
from bumblebee.diagnosis.dataset import Session, make_session
from bumblebee.diagnosis.diagnose import Diagnosis, diagnose
from bumblebee.diagnosis.plan import Gain, Motion, Plan, PlanConfig, findings_of, make_plan, safe_pool, set_stage
from bumblebee.measured.rollout import Rollout
from bumblebee.stand_in.undeclared.declared import Declared, describe
from bumblebee.stand_in.undeclared.kinds import CATALOGUE, fits
from bumblebee.stand_in.undeclared.law import Law

VERSION = 1
POOR = ("slow", "posture", "one")  # slow motions; small ones about one posture; one joint at a time
_ROLLOUTS, _SECONDS = 4, 5.0
# Their signature is a search of its own in the diagnosis, not a column; a plan cannot ask for them.
_LEFT_OUT = ("dropped_commands", "encoder_quantisation")
RATIO = 5.0  # times the size that a perfect test could see in the poor data
SPEED, TRAVEL = 5.0, 1.0  # limits of the arm [rad/s, rad]
RUNS, RUN_SECONDS = 4, 6.0


@dataclass(frozen=True)
class PlanCase:
    """One case to draw."""

    number: int
    kind: str
    poor: str
    gains: tuple[float, ...] = (1.0,)
    """Factors on kp that planned runs may have."""
    damping: tuple[float, ...] = ()
    """Factors on kd."""


def cases(seed: int, count: int) -> list[PlanCase]:
    """The first `count` of a seed: kinds in a random order, over and over."""
    names = [kind.name for kind in CATALOGUE if fits(kind, "arm") and kind.name not in _LEFT_OUT]
    rng = np.random.default_rng([seed, 31])
    out: list[PlanCase] = []
    while len(out) < count:
        for name in rng.permutation(names):
            out.append(PlanCase(len(out), str(name), POOR[int(rng.integers(len(POOR)))]))
    return out[:count]


class Targets:
    """Commands of R robots from a table (T, R, J)."""

    def __init__(self, targets: np.ndarray, qpos: np.ndarray) -> None:
        self._targets, self.ticks = targets, len(targets)
        self.qpos = np.broadcast_to(qpos, (targets.shape[1], qpos.shape[-1])).copy()
        self.qvel = np.zeros((targets.shape[1], targets.shape[2]))

    def target(self, tick: int, qpos: np.ndarray, qvel: np.ndarray) -> np.ndarray:
        """From the table; the arm does not look."""
        return self._targets[tick]


def poor_targets(kind: str, joints: int, rng: np.random.Generator) -> np.ndarray:
    """(T, R, J) targets [rad] that say little."""
    time = np.arange(round(_SECONDS * HZ)) / HZ
    posture = np.array([0.0, 0.5, 0.6, 0.0, 0.3])[:joints]
    low, high, reach = {"slow": (0.05, 0.25, 0.35), "posture": (0.3, 1.2, 0.06), "one": (0.1, 0.6, 0.25)}[kind]
    size = reach * rng.uniform(0.4, 1.0, (_ROLLOUTS, 2, joints, 1))
    rate, phase = rng.uniform(low, high, size.shape), rng.uniform(0, 2 * np.pi, size.shape)
    wave = (size * np.sin(2 * np.pi * rate * time + phase)).sum(axis=1)
    if kind == "one":
        moved = np.eye(joints)[rng.permutation(joints)[np.arange(_ROLLOUTS) % joints]]
        wave *= moved[:, :, None]
    return np.moveaxis(wave, -1, 0) + posture


def run_case(case: PlanCase, seed: int) -> dict[str, Any]:
    """Draw, diagnose, plan, fly, diagnose again; what goes wrong is in the line under `failed`."""
    line: dict[str, Any] = {"case": case.number, "kind": case.kind, "poor": case.poor, "version": VERSION}
    began = time.monotonic()
    try:
        line |= _run(case, seed)
    except Exception as error:  # a case that breaks is a result, too: of this case, not of the run
        line["failed"] = f"{type(error).__name__}: {error}"[:300]
        line["trace"] = traceback.format_exc(limit=-4)[-1200:]
    return line | {"seconds": round(time.monotonic() - began, 1)}


def _run(case: PlanCase, seed: int) -> dict[str, Any]:
    rng = np.random.default_rng([seed, case.number, 37])
    robot = declared("arm")
    truth, law, shown = _poor(case, robot, rng)
    before = diagnose(_session(robot, shown))
    line: dict[str, Any] = {"truth": truth, "before": score(truth, before)}
    if line["before"]["resolved"]:
        return line | {"skipped": "the poor data resolve it"}
    config = PlanConfig(
        runs=RUNS, seconds=RUN_SECONDS, speed={"": SPEED}, travel={"": TRAVEL}, seed=int(rng.integers(1 << 31)),
        gains=case.gains, damping=case.damping,
    )  # fmt: skip
    began = time.monotonic()
    found = findings_of(before.document, before.effects)
    plan = make_plan(robot.spec, "arm", config, _session(robot, shown), found)
    line["plan_seconds"] = round(time.monotonic() - began, 1)
    line["predicted"] = _predicted(plan)
    random = _random(robot, plan, config, _session(robot, shown), found)
    for name, motions in (("planned", plan.motions), ("random", random)):
        flights = [
            (at, fly(at, [law], Targets(motion.targets[:, None], plan.machine.qpos), rng))
            for motion in motions
            for at in [robot_at(robot, motion.gain)]
        ]
        line[f"kept_{name}"] = _kept(plan, [flight for _, flight in flights])
        logs = [rollouts(at, flight, 1.0, rng, f"x{k}") for k, (at, flight) in enumerate(flights)]
        both = [*shown, *(log for some in logs for log in some)]
        line[name] = score(truth, diagnose(_session(robot, both)), line["before"])
    return line


def _poor(case: PlanCase, robot: Declared, rng: np.random.Generator) -> tuple[dict[str, Any], Law, list[Rollout]]:
    """The truth's entry, its law, and the poor rollouts of the robot with it."""
    targets = poor_targets(case.poor, len(robot.joints), rng)
    seeds = [int(s) for s in rng.integers(1 << 31, size=2)]

    def run(laws: list[Law]) -> Flight:
        return fly(robot, laws, Targets(targets, targets[0]), np.random.default_rng(seeds[0]))

    null = run([])
    eye = make_eye(robot, null, 1.0, np.random.default_rng(seeds[1]))
    wanted = Wanted(case.number, "arm", "single", (case.kind,), RATIO, 1.0, _ROLLOUTS, False)
    truth, law = draw_one(case.kind, wanted, robot, null, eye, run, rng)
    return truth, law, rollouts(robot, run([law]), 1.0, rng, "r")


def robot_at(robot: Declared, gain: Gain) -> Declared:
    """The robot with its servos' gains set to other values, which its logs state."""
    if gain == Gain():
        return robot
    spec = robot.spec.copy()
    for actuator in spec.actuators:
        bias, first = actuator.biasprm.copy(), actuator.gainprm.copy()
        first[0], bias[1], bias[2] = gain.kp * first[0], gain.kp * bias[1], gain.kd * bias[2]
        actuator.gainprm, actuator.biasprm = first, bias
    return describe(robot.name, spec)


def _random(robot: Declared, plan: Plan, config: PlanConfig, session: Session, found: Any) -> list[Motion]:
    """As many random multisines of the same length, within the same limits, safe on the same robots as the plan."""
    other = replace(config, pool=4 * RUNS, seed=config.seed + 1, gains=(1.0,), damping=())
    stage = replace(set_stage(robot.spec, "arm", other, session, found), cases=plan.cases)
    safe = safe_pool(stage, other, ("multisine",)).motions[:RUNS]
    if len(safe) < RUNS:
        raise ValueError("too few random motions are safe")
    return safe


def _kept(plan: Plan, flights: Sequence[Flight]) -> dict[str, float]:
    """Largest shares of the plan's limits that the true robot reached, by its readings."""
    limits, home, joints = plan.limits, plan.machine.home, len(plan.machine.joints)
    out = dict.fromkeys(("travel", "speed", "torque"), 0.0)
    for flight in flights:
        q, v = flight.qpos[..., -joints:], flight.qvel[..., -joints:]
        room = np.where(q > home, limits.high - home, home - limits.low)
        shares = np.abs(q - home) / room, np.abs(v) / limits.speed, np.abs(flight.torque) / limits.torque
        out = {name: max(out[name], float(share.max())) for name, share in zip(out, shares, strict=True)}
    return out


def _predicted(plan: Plan) -> dict[str, Any]:
    total = plan.data + plan.runs.sum(axis=0)
    return {
        "classes": plan.objective.resolved(total),
        "families": [m.family for m in plan.motions],
        "gains": [str(m.gain) for m in plan.motions],
        "unasked": list(plan.basis.unasked),
        "kept": float(plan.reached.max()),
    }


def _session(robot: Declared, shown: Sequence[Rollout]) -> Session:
    return make_session(robot.spec, list(shown), robot.name, "sealed rollouts")


def score(truth: dict[str, Any], found: Diagnosis, before: dict[str, Any] | None = None) -> dict[str, Any]:
    """Whether the true effect is named first, its class, and the width of its interval, relative to the change."""
    entries = found.document["effects"]
    exact = [e for e in entries if e["effect"] == truth["effect"] and e["where"] == truth["where"]]
    first = bool(entries) and bool(exact) and entries[0] is exact[0]
    members = len(exact[0]["equivalent"]) if exact else None
    was = before["class"] if before else None
    name = next(iter(truth["parameters"]))
    ends = exact[0]["parameters"].get(name, {}).get("ci95") if exact else None
    width = None if ends is None or None in ends else float(ends[1] - ends[0])
    known = ends is not None and all(
        e is None or (e <= truth["parameters"][name] if k == 0 else e >= truth["parameters"][name])
        for k, e in enumerate(ends)
    )
    return {
        "named": [f"{e['effect']} {' '.join(e['where'])}".strip() for e in entries],
        "classes": [len(e["equivalent"]) for e in entries],
        "in_class": any(
            (o["effect"], o["where"]) == (truth["effect"], truth["where"]) for e in entries for o in e["equivalent"]
        ),
        "first": first,
        "class": members,
        "equivalent": [f"{o['effect']} {' '.join(o['where'])}".strip() for e in exact for o in e["equivalent"]],
        "resolved": first and members == 0,
        "smaller": first and (members == 0 or (was is not None and members is not None and members < was)),
        "width": width,
        "covered": known if exact else None,
        "parameter": name,
    }
