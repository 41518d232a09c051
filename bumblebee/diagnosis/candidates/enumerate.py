"""The candidates: every effect of the catalogue on every place it can sit on, and the size of a first step."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import mujoco
import numpy as np

from bumblebee.diagnosis.candidates.candidate import Candidate
from bumblebee.diagnosis.candidates.signal_scales import Scales, scales_of
from bumblebee.diagnosis.candidates.surfaces import surface_candidates
from bumblebee.diagnosis.simulation import Plant, declared_values, touching
from bumblebee.diagnosis.thresholds.candidates import BodySteps, CandidateThresholds, StillJoints
from bumblebee.measured.rollout import Rollout
from bumblebee.sim.effects import NO_SPEED_LIMIT

_FADE_SECONDS = 1.0
"""Shortest time over which a drive that fades is taken to fade [s]."""

_AXES = (0.0, 0.0)


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
    scales = scales_of(plant, rollouts, rules.scales, models)
    found: list[Candidate] = []
    for j, name in enumerate(plant.joints):
        if name not in still:
            found += _OnJoint(plant, scales, j, name, rules).every()
    found += _on_whole(plant, rules)
    total = plant.model.body_mass.sum()
    for body in _carried(plant, still):
        found += _on_body(plant, body, total, rules.body)
    found += _under_floating_base(plant, rules.body)
    found += surface_candidates(plant, rollouts, _carried(plant, still), rules.surface)
    return [replace(c, limits=rules.limits) for c in found]


@dataclass(frozen=True, eq=False)
class _OnJoint:
    """One joint, on which candidates are made."""

    plant: Plant
    scales: Scales
    j: int
    """Its column."""
    name: str
    rules: CandidateThresholds

    def every(self) -> Iterator[Candidate]:
        """All candidates on the joint."""
        plant, j = self.plant, self.j
        yield from self._friction()
        yield from self._springs()
        yield self._make("encoder_offset", self.rules.joint.offset)
        if plant.actuator[j] < 0:
            return
        yield from self._of_any_drive()
        if plant.scalable[j] and plant.torque_input:
            yield self._make("motor_strength", self.rules.drive.gain)
        elif plant.scalable[j]:
            yield from self._of_servo()
            yield from self._saturations()
            yield from self._limited_targets()

    def _make(
        self,
        kind: str,
        *step: float,
        free: tuple[int, ...] = (0,),
        start: Sequence[float] | None = None,
        shape: float = 0.0,
    ) -> Candidate:
        """A candidate of first steps `step`, absent at `start`, or where the declared model has it."""
        nominal = declared_values(self.plant, kind, self.name) if start is None else start
        return Candidate(kind, self.name, tuple(0.0 if np.isinf(x) else x for x in nominal), step, free, shape)

    @property
    def _torque(self) -> float:
        """Torque [N m] of a first step."""
        return self.rules.joint.torque * self.scales.torque[self.j]

    def _friction(self) -> Iterator[Candidate]:
        s, j, rule = self.scales, self.j, self.rules.joint
        yield self._make("coulomb_friction", self._torque)
        yield self._make("viscous_friction", self._torque / s.speed[j])
        yield self._make("quadratic_friction", self._torque / s.speed[j] ** 2)
        for share in rule.stribeck:
            speed = share * s.speed[j]
            yield self._make("stribeck_friction", self._torque, speed, start=(0.0, 0.0), shape=rule.shape * speed)
        yield self._make("asymmetric_friction", self._torque)
        yield self._make("armature", rule.inertia * s.inertia[j])

    def _springs(self) -> Iterator[Candidate]:
        plant, s, j, rule, none = self.plant, self.scales, self.j, self.rules.joint, (0.0, 0.0, 0.0)
        yield self._make("joint_spring", self._torque / max(s.travel[j], rule.spring_travel), self._torque, free=(0, 1))
        joint = plant.model.joint(self.name).id
        sprung = bool(plant.model.jnt_stiffness[joint])
        for share in rule.width:
            width = share * max(s.travel[j], rule.travel)
            for dahl in (1.0,) if sprung else (0.0, 1.0):  # MJCF has one spring a joint; Dahl's law is a hook
                yield self._make("hysteresis", self._torque, width, dahl, start=none, shape=rule.shape * width)
        hinge = plant.model.jnt_type[joint] == int(mujoco.mjtJoint.mjJNT_HINGE)
        for n in rule.harmonics if hinge else ():
            if n * s.travel[j] > np.pi:
                sizes = (rule.cogging * self._torque, rule.cogging * self._torque, float(n))
                yield self._make("cogging", *sizes, free=(0, 1), start=none, shape=rule.shape / s.travel[j])

    def _of_any_drive(self) -> Iterator[Candidate]:
        s, j, rule, soft = self.scales, self.j, self.rules.drive, self.rules.transmission
        yield self._make("load_dependent_friction", rule.load, 0.0)
        yield self._make("command_delay", rule.time)
        yield self._make("command_filter", rule.time)
        yield self._make("dropped_commands", rule.dropped)
        if s.peak[j] > 0 and self._ends_its_body():
            for encoder in (0.0, 1.0):  # on the motor, on the joint
                steps = (self._twist(encoder), encoder, soft.damping, soft.link_share)
                yield self._make("series_elasticity", *steps, start=(0.0,) * 4, shape=soft.damping_shape)
                gap = max(soft.backlash * s.travel[j], soft.least_backlash)
                yield self._make("backlash", gap, encoder, start=(0.0, 0.0))

    def _ends_its_body(self) -> bool:
        """Whether no other joint lies between it and its body: behind it alone there is room for a second hinge."""
        model = self.plant.model
        joint = int(model.joint(self.name).id)
        body = int(model.jnt_bodyid[joint])
        return joint == int(model.body_jntadr[body] + model.body_jntnum[body]) - 1

    def _twist(self, encoder: float) -> float:
        """Compliance [rad/(N m)] that matters; a servo that reads the joint behind a soft shaft would swing it up."""
        plant, s, j, rule = self.plant, self.scales, self.j, self.rules.transmission
        large, a = rule.twist * max(s.travel[j], self.rules.joint.travel) / s.peak[j], plant.actuator[j]
        gain = abs(plant.model.actuator_gear[a, 0] ** 2 * plant.model.actuator_biasprm[a, 1])
        return float(min(large, rule.stiff / gain) if encoder and gain else large)

    def _of_servo(self) -> Iterator[Candidate]:
        rule = self.rules.drive
        for kind in ("motor_strength", "kp", "kd"):
            yield self._make(kind, rule.gain)
        yield self._make("torque_lag", rule.time)
        yield self._make("encoder_delay", rule.time)
        for kind in ("strength_drift", "thermal_fade"):
            yield self._make(kind, rule.fade / max(self.scales.duration, _FADE_SECONDS))

    def _saturations(self) -> Iterator[Candidate]:
        s, j, rule = self.scales, self.j, self.rules.drive
        limit = declared_values(self.plant, "torque_limit", self.name)[0]
        for share in rule.limit:
            if s.peak[j] > 0 and share * s.peak[j] < limit:
                yield self._make("torque_limit", (share - 1.0) * s.peak[j], start=(min(limit, s.peak[j]),))
        if np.isfinite(limit):
            for factor in rule.speed_limit:
                yield self._make("torque_speed_limit", 1.0 / (factor * s.fastest[j]), start=(0.0,))

    def _limited_targets(self) -> Iterator[Candidate]:
        """Limits of what the drive makes of its targets, by how steep and how curved these are."""
        s, j, rule = self.scales, self.j, self.rules.drive
        if min(s.target_rate[j], s.target_turn[j]) <= 0:
            return
        for share in rule.target_rate:
            yield self._make("command_rate_limit", 1.0 / (share * s.target_rate[j]), start=(0.0,))
        none = (0.0, NO_SPEED_LIMIT)
        for share, fast in rule.target_turn:
            speed = fast * s.target_rate[j]
            steps = (1.0 / (share * s.target_turn[j]), speed - NO_SPEED_LIMIT if fast else 0.0)
            yield self._make("command_profile", *steps, start=none, shape=self.rules.joint.shape * speed)


def _on_whole(plant: Plant, rules: CandidateThresholds) -> list[Candidate]:
    rule = rules.drive
    found = _turned_gravity(plant, rules.body.slope)
    driven = plant.actuator >= 0
    if driven.sum() < 2:
        return found
    if np.ptp(plant.delay[plant.actuator[driven]]) == 0:
        found.append(Candidate("command_delay", "", (float(plant.delay[plant.actuator[driven]][0]),), (rule.time,)))
    found.append(Candidate("command_filter", "", (0.0,), (rule.time,)))
    found.append(Candidate("dropped_commands", "", (0.0,), (rule.dropped,)))
    if not plant.torque_input and plant.scalable[driven].all():
        found += [Candidate(kind, "", (0.0,), (rule.time,)) for kind in ("torque_lag", "encoder_delay")]
    return found


def _turned_gravity(plant: Plant, step: float) -> list[Candidate]:
    """Gravity from another direction: the two angles that turn it, not the one about the axis that it is next to."""
    gravity = np.abs(plant.model.opt.gravity)
    if not gravity.any():
        return []
    free = tuple(sorted(np.argsort(gravity, kind="stable")[:2].tolist()))
    steps = tuple(step if axis in free else 0.0 for axis in range(3))
    return [Candidate("ground_slope", "", (0.0,) * 3, steps, free)]


def _on_body(plant: Plant, body: str, total: float, rule: BodySteps) -> list[Candidate]:
    mass, alone = declared_values(plant, "link_mass", body)
    index = plant.model.body(body).id
    moments = plant.model.body_inertia[index]
    size = float(np.sqrt(1.5 * moments.sum() / mass))  # of a ball of this inertia, twice
    heavy = max(rule.mass * mass, rule.least_mass * total)
    weight, away = 9.81 * heavy, (max(rule.com * size, rule.least_com),) * 3
    turned = tuple(rule.moments * moments + rule.least_moment)
    return [
        Candidate("link_mass", body, (mass, alone), (heavy, 0.0)),
        Candidate("link_mass", body, (mass, alone), (heavy, 1.0)),
        Candidate("link_com", body, declared_values(plant, "link_com", body), away, (0, 1, 2)),
        Candidate("link_inertia", body, tuple(map(float, moments)), turned, (0, 1, 2)),
        Candidate("external_wrench", body, (0.0,) * 6, (*(weight,) * 3, 0.0, 0.0, 0.0), (0, 1, 2)),
    ]


def _under_floating_base(plant: Plant, rule: BodySteps) -> list[Candidate]:
    """The tilt of a floating base's sensor, and what the ground may be else."""
    if not plant.floating:
        return []
    found = []
    base = plant.model.body(int(plant.model.jnt_bodyid[plant.model.dof_jntid[plant.base_dof]])).name
    if base:
        found.append(Candidate("imu_offset", base, _AXES, (rule.tilt, rule.tilt), (0, 1)))
    for ground in _grounds(plant):
        for kind, share in (("ground_friction", rule.ground_friction), ("ground_compliance", rule.ground_compliance)):
            value = declared_values(plant, kind, ground)[0]
            if value > 0:
                found.append(Candidate(kind, ground, (value,), (share * value,)))
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
    return [model.geom(g).name for g in fixed if model.geom(g).name and touching(model, g)]
