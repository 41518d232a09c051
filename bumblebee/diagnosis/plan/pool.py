"""The stage of a plan, and the candidate motions that are safe on it."""

from collections.abc import Callable
from dataclasses import replace

import mujoco
import numpy as np

from bumblebee.diagnosis.dataset import Session, step_for
from bumblebee.diagnosis.plan.config import Gain, PlanConfig
from bumblebee.diagnosis.plan.contacts import Surroundings
from bumblebee.diagnosis.plan.findings import Findings, refuse_strange
from bumblebee.diagnosis.plan.limits import limits_of
from bumblebee.diagnosis.plan.machine import Machine, make_machine, without_gains
from bumblebee.diagnosis.plan.motions import FAMILIES, Motion, Scope, draw_motion
from bumblebee.diagnosis.plan.rehearsal import rehearse, settled
from bumblebee.diagnosis.plan.safety import LATE, Safe, judge, made_safe, weighed
from bumblebee.diagnosis.plan.stage import Stage
from bumblebee.diagnosis.plan.unknowns import Case, cases_of
from bumblebee.errors import BadInput
from bumblebee.sim.servo import servos_of

_STAND = "Choose a keyframe with --start or stronger gains, or hang the robot up and declare its base fixed."


def set_stage(
    spec: mujoco.MjSpec, name: str, config: PlanConfig, session: Session | None, findings: Findings | None
) -> Stage:
    """The robot at rest in its start pose, where it is safe; `BadInput` where limits are unknown or it is not."""
    _refuse_config(config)
    rules = config.thresholds.plan
    machine = make_machine(spec, name, session, config)
    if findings is not None:
        refuse_strange(findings, machine.plant)
    limits = limits_of(machine, session, config)
    step = _rough_step(machine, float((session.spec if session else spec).option.timestep), config)
    start = Surroundings(machine.plant, machine.qpos, rules.safety)
    machine = settled(machine, step, rules.motions.settle)
    refuse_fallen(machine, start)
    around = Surroundings(machine.plant, machine.qpos, rules.safety, findings.effects if findings else ())
    cases = cases_of(machine, limits, findings, (), rules.unknowns)
    support = _supporting(machine, around)
    scope = Scope(machine.home, machine.moved, support, limits, machine.rate, config.seconds, rules.motions)
    return resting(Stage(machine, limits, around, cases, scope, step, rules), cases)


def _rough_step(machine: Machine, declared: float, config: PlanConfig) -> float:
    """The step [s] in which most candidates are given up: for a small model no longer than the declared one."""
    rule = config.thresholds.dataset.time_steps
    if machine.plant.model.nv > rule.small_model:
        return machine.steps[1]
    return max(machine.steps[0], step_for(1.0 / machine.rate, min(rule.coarse, declared), rule))


def candidates(stage: Stage, config: PlanConfig, families: tuple[str, ...] = FAMILIES) -> list[Motion]:
    """The candidate motions of a seed, a family after the other."""
    gains = [gain for gain in config.all_gains if gain in stage.machine.driven]
    if not gains:
        why = "; ".join(f"{gain}: {reason}" for gain, reason in stage.restless.items())
        raise BadInput("--gains", "gains at which the robot rests in the start pose", why, "Allow 1, or others.")
    return [
        draw_motion(stage.scope, config.seed, k, gains[(k // len(families)) % len(gains)], families)
        for k in range(config.pool)
    ]


def safe_pool(stage: Stage, config: PlanConfig, families: tuple[str, ...] = FAMILIES) -> Safe:
    """The candidate motions of a seed, as far as they are safe."""
    return made_safe(stage, candidates(stage, config, families))


def surest(stage: Stage) -> Stage:
    """The stage with the declared and the diagnosed robot alone: the others' turn is when runs have been chosen."""
    return replace(stage, cases=[case for case in stage.cases if case.must])


def _refuse_config(config: PlanConfig) -> None:
    rule = config.thresholds.plan.motions
    least = rule.lead + 2 * rule.ramp + rule.rest + 1.0
    if not least <= config.seconds <= 600:
        raise BadInput("--seconds", f"{least:g} to 600: rests, ramps and a second between them", f"{config.seconds:g}")
    every = (*config.gains, *config.damping)
    if not config.gains or any(not 0.05 <= g <= 20 for g in every):
        came = ", ".join(f"{g:g}" for g in every) or "none"
        raise BadInput("--gains, --damping", "factors from 0.05 to 20", came)
    if config.rate is not None and not 5 <= config.rate <= 5000:
        raise BadInput("--rate", "5 to 5000 Hz", f"{config.rate:g}")


def refuse_none(safe: Safe, say: Callable[[str], None]) -> None:
    """`BadInput` where no motion is safe; says what others were given up for."""
    for reason, count in safe.refused.most_common(3):
        say(f"{count} motions discarded: {reason}")
    if not safe.motions:
        reason, count = safe.refused.most_common(1)[0]
        do = "Give more --minutes, or widen a limit." if reason == LATE else "Widen that limit."
        raise BadInput("plan", "a motion within all limits", f"none; {count} of them: {reason}", do)


def refuse_fallen(machine: Machine, start: Surroundings) -> None:
    """`BadInput` for a free base whose robot does not stand where it starts; `start` is around the start pose."""
    if not machine.plant.floating:
        return
    where, expected = f"{machine.name}: start pose", "a robot that stands on the floor under its servos"
    if not start.feet:
        raise BadInput(where, expected, "one that touches nothing", _STAND)
    if clash := start.clash(machine.qpos[None], np.zeros((1, machine.plant.model.nv)), _holding(machine)[None]):
        raise BadInput(where, expected, clash.reason, _STAND)


def _holding(machine: Machine) -> np.ndarray:
    """(J,) what the servos give at rest in the settled pose."""
    plant = machine.plant
    servos = servos_of(plant.model, [int(plant.model.joint(name).id) for name in machine.joints])
    still = np.zeros(len(machine.home))
    return servos.torque(machine.qpos[plant.qpos], still, machine.home * servos.gear)


def resting(stage: Stage, cases: list[Case]) -> Stage:
    """The stage with those of the cases that rest in the start pose within all limits, at every gain that is left.

    Cases that do not at the declared gains are left out, `BadInput` for one that must; and so are other gains at which
    one of the rest does not: the robot may be that one. Names of both are kept.
    """
    restless, out = dict(stage.restless), dict(stage.left_out)
    for case in cases:
        if not case.must and _unrest(stage, case, Gain()):
            out[case.name] = "does not even rest in the start pose"
            continue
        for gain in (
            gain for gain in stage.machine.driven if str(gain) not in restless and (case.must or gain != Gain())
        ):
            if found := _unrest(stage, case, gain):
                if gain == Gain():
                    raise BadInput(
                        f"{stage.machine.name}: start pose, {gain}, {case.name}",
                        "a robot that rests under its servos within the limits",
                        found,
                        _STAND if stage.machine.plant.floating else "Choose a keyframe with --start, or other limits.",
                    )
                restless[str(gain)] = f"{case.name}: {found}"
    stage = replace(stage, machine=without_gains(stage.machine, restless), restless=restless)
    return replace(stage, cases=[case for case in cases if case.name not in out], left_out=out)


def _unrest(stage: Stage, case: Case, gain: Gain) -> str:
    """Why a robot does not rest in the start pose; empty where it does."""
    machine = stage.machine
    still, ones = np.zeros((max(2, round(machine.rate)), len(machine.home))), np.ones(len(machine.home))
    hold = Motion(0, "holds", "", gain, machine.home, still, ones)
    runs = rehearse(machine, [hold], case.effects, stage.step, stage.rules.motions.settle)
    return judge(weighed(stage, case), runs, [hold])[0].reason


def _supporting(machine: Machine, around: Surroundings) -> np.ndarray:
    """(J,) bool: joints between a standing base and the world that its feet touch."""
    model = machine.plant.model
    below = set()
    for foot in around.feet:
        body = int(foot)
        while body:
            below.add(body)
            body = int(model.body_parentid[body])
    return np.array([int(model.jnt_bodyid[model.joint(name).id]) in below for name in machine.joints])
