"""The candidates: every effect of the catalogue on every place it can sit on, and the size of a first step."""

from collections.abc import Sequence
from dataclasses import replace

import mujoco
import numpy as np

from bumblebee.diagnosis.candidates.candidate import Candidate
from bumblebee.diagnosis.candidates.signal_scales import Scales, scales_of
from bumblebee.diagnosis.candidates.surfaces import surface_candidates
from bumblebee.diagnosis.simulation import Plant, declared_values, spot
from bumblebee.diagnosis.thresholds.candidates import BodySteps, CandidateThresholds, StillJoints
from bumblebee.effects.coupled import joint_before
from bumblebee.effects.native import pairs_of, touching
from bumblebee.effects.places import OnBody, OnJoint, OnRobot, Step
from bumblebee.measured.rollout import Rollout
from bumblebee.sim.effects import CATALOGUE, Kind


def still_joints(
    plant: Plant, rollouts: Sequence[Rollout], sigma: np.ndarray, rule: StillJoints | None = None
) -> list[str]:
    """Joints that move no more than their sensors' noise: nothing can be said of them."""
    rule, count = rule or StillJoints(), len(plant.joints)
    span = np.max([np.std(r.joint_pos, axis=0) for r in rollouts], axis=0)
    speed = np.max([np.std(r.joint_vel, axis=0) for r in rollouts], axis=0)
    still = (span < rule.place * sigma[:count]) & (speed < rule.speed * sigma[count : 2 * count])
    return [name for name, s in zip(plant.joints, still, strict=True) if s]


def all_candidates(
    plant: Plant,
    rollouts: Sequence[Rollout],
    still: Sequence[str],
    rules: CandidateThresholds | None = None,
    models: Sequence[mujoco.MjModel] = (),
) -> list[Candidate]:
    """Every candidate on joints that move, on bodies that they carry, on the ground and on the whole robot.

    The first steps follow from the servos of `models`, one for each condition, the declared ones if none are given.
    """
    rules = rules or CandidateThresholds()
    scales, bodies = scales_of(plant, rollouts, rules.scales, models), _carried(plant, still)
    found: list[Candidate] = []
    for j, name in enumerate(plant.joints):
        if name not in still:
            found += _made(plant, _fitting(plant, j), name, _on_joint(plant, scales, j, still, rules))
    found += _on_whole(plant, rules)
    for body in bodies:
        found += _made(plant, _sitting("body"), body, OnBody(spot(plant, body), rules.body))
    found += _under_floating_base(plant, rules.body)
    found += surface_candidates(plant, rollouts, bodies, rules.surface)
    return [replace(c, limits=rules.limits) for c in found]


def _sitting(on: str, base: bool = False) -> list[Kind]:
    return [kind for kind in CATALOGUE.values() if kind.on == on and kind.base == base]


def _made(plant: Plant, kinds: Sequence[Kind], place: str, on: object) -> list[Candidate]:
    """Candidates of some kinds on a place."""
    return [_candidate(plant, kind, place, step) for kind in kinds for step in kind.steps(on)]


def _candidate(plant: Plant, kind: Kind, place: str, step: Step) -> Candidate:
    """A candidate, absent where its first step says or where the declared model has it."""
    nominal = declared_values(plant, kind.id, place) if step.start is None else step.start
    absent = tuple(0.0 if np.isinf(x) else x for x in nominal)
    return Candidate(kind.id, place, absent, step.step, step.free, step.shape)


def _fitting(plant: Plant, j: int) -> list[Kind]:
    """Kinds that a joint with such a drive can have."""
    driven, scaled = bool(plant.actuator[j] >= 0), bool(plant.scalable[j])
    has = {"": True, "any": driven, "scaled": driven and scaled}
    has["position"] = has["scaled"] and not plant.torque_input
    return [kind for kind in _sitting("joint") if has[kind.drive]]


def _on_joint(plant: Plant, scales: Scales, j: int, still: Sequence[str], rules: CandidateThresholds) -> OnJoint:
    before = joint_before(plant.model, plant.joints[j])
    moved = before in plant.joints and before not in still and plant.actuator[plant.joints.index(before)] >= 0
    return OnJoint(
        spot(plant, plant.joints[j]),
        before if moved else "",
        rules,
        torque=rules.joint.torque * scales.torque[j],
        peak=scales.peak[j],
        speed=scales.speed[j],
        fastest=scales.fastest[j],
        travel=scales.travel[j],
        inertia=scales.inertia[j],
        target_rate=scales.target_rate[j],
        target_turn=scales.target_turn[j],
        duration=scales.duration,
    )


def _on_whole(plant: Plant, rules: CandidateThresholds) -> list[Candidate]:
    """Effects of the whole robot, and those of all drives at once where there are several."""
    driven = plant.actuator >= 0
    on = OnRobot(plant.model, rules, plant.delay[plant.actuator[driven]])
    found = _made(plant, _sitting("whole"), "", on)
    has = {"": True, "any": True, "scaled": bool(plant.scalable[driven].all())}
    has["position"] = has["scaled"] and not plant.torque_input
    together = [kind for kind in _sitting("joint") if has[kind.drive]] if driven.sum() > 1 else []
    return found + [_candidate(plant, kind, "", step) for kind in together for step in kind.steps_together(on)]


def _under_floating_base(plant: Plant, rule: BodySteps) -> list[Candidate]:
    """Candidates of a floating base, and of the ground."""
    if not plant.floating:
        return []
    found = []
    base = plant.model.body(int(plant.model.jnt_bodyid[plant.model.dof_jntid[plant.base_dof]])).name
    if base:
        found += _made(plant, _sitting("body", base=True), base, OnBody(spot(plant, base), rule))
    for ground in _grounds(plant):
        found += _made(plant, _sitting("geom"), ground, OnBody(spot(plant, ground), rule))
    return found


def _carried(plant: Plant, still: Sequence[str]) -> list[str]:
    """Bodies that a floating base or a joint that moves carries."""
    model = plant.model
    moving = {int(model.jnt_bodyid[model.joint(n).id]) for n in plant.joints if n not in still}
    names = []
    for name in plant.bodies:
        body = model.body(name).id
        chain = set()
        while body:
            chain.add(body)
            body = int(model.body_parentid[body])
        if plant.floating or chain & moving:
            names.append(name)
    return names


def _grounds(plant: Plant) -> list[str]:
    """Named geometries of the world that a moving body can touch."""
    model = plant.model
    fixed = [g for g in range(model.ngeom) if model.body_weldid[model.geom_bodyid[g]] == 0]
    met = [g for g in fixed if touching(model, g) or len(pairs_of(model, g))]
    return [model.geom(g).name for g in met if model.geom(g).name]
