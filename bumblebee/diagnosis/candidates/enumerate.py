"""The candidates: every effect of the catalogue on every place it can sit on, and the size of a first step."""

from collections.abc import Iterator, Sequence

import mujoco
import numpy as np

from bumblebee.diagnosis.candidates.candidate import Candidate
from bumblebee.diagnosis.candidates.signal_scales import Scales, scales_of
from bumblebee.diagnosis.simulation import Plant, declared_values, touching
from bumblebee.measured.rollout import Rollout

_STIFF = 0.03  # of a servo's own compliance
_HARMONICS = (*range(1, 25), 28, 30, 32, 36, 40, 42, 48, 50, 56, 60, 64, 72, 80, 84, 96, 100, 120, 128, 144)


def still_joints(plant: Plant, rollouts: Sequence[Rollout], sigma: np.ndarray) -> list[str]:
    """Joints that move no more than their sensors' noise: nothing can be said of them."""
    count = len(plant.joints)
    span = np.max([np.std(r.joint_pos, axis=0) for r in rollouts], axis=0)
    speed = np.max([np.std(r.joint_vel, axis=0) for r in rollouts], axis=0)
    still = (span < 2.5 * sigma[:count]) & (speed < 1.5 * sigma[count : 2 * count])
    return [name for name, s in zip(plant.joints, still, strict=True) if s]


def all_candidates(
    plant: Plant, rollouts: Sequence[Rollout], still: Sequence[str], model: mujoco.MjModel | None = None
) -> list[Candidate]:
    """Every candidate on joints that move, on bodies that they carry, on the ground and on the whole robot.

    The first steps follow from the servos of `model`, the declared one if none is given.
    """
    scales = scales_of(plant, rollouts, model)
    found: list[Candidate] = []
    for j, name in enumerate(plant.joints):
        if name not in still:
            found += [c for c in _on_joint(plant, scales, j, name)]
    found += _on_whole(plant)
    total = plant.model.body_mass.sum()
    for body in _carried(plant, still):
        found += _on_body(plant, body, total)
    if plant.floating:
        base = plant.model.body(int(plant.model.jnt_bodyid[plant.model.dof_jntid[plant.base_dof]])).name
        if base:
            found.append(Candidate("imu_offset", base, (0.0, 0.0), (0.01, 0.01), (0, 1)))
        for ground in _grounds(plant):
            for kind, share in (("ground_friction", -0.1), ("ground_compliance", 0.2)):
                value = declared_values(plant, kind, ground)[0]
                if value > 0:
                    found.append(Candidate(kind, ground, (value,), (share * value,)))
    return found


def _on_joint(plant: Plant, s: Scales, j: int, name: str) -> Iterator[Candidate]:
    def make(
        kind: str, *step: float, free: tuple[int, ...] = (0,), start: Sequence[float] | None = None, shape: float = 0.0
    ) -> Candidate:
        nominal = declared_values(plant, kind, name) if start is None else start
        return Candidate(kind, name, tuple(0.0 if np.isinf(x) else x for x in nominal), step, free, shape)

    tenth = 0.1 * s.torque[j]
    yield make("coulomb_friction", tenth)
    yield make("viscous_friction", tenth / s.speed[j])
    for share in (0.3, 1.0):
        speed = share * s.speed[j]
        yield make("stribeck_friction", tenth, speed, start=(0.0, 0.0), shape=0.3 * speed)
    yield make("asymmetric_friction", tenth)
    yield make("armature", 0.1 * s.inertia[j])
    yield make("joint_spring", tenth / max(s.travel[j], 0.05), tenth, free=(0, 1))
    joint = plant.model.joint(name).id
    sprung = bool(plant.model.jnt_stiffness[joint])
    for share in (0.03, 0.2):
        width = share * max(s.travel[j], 0.02)
        for dahl in (1.0,) if sprung else (0.0, 1.0):  # MJCF has one spring a joint; Dahl's law is a hook
            yield make("hysteresis", tenth, width, dahl, start=(0.0, 0.0, 0.0), shape=0.3 * width)
    hinge = plant.model.jnt_type[joint] == int(mujoco.mjtJoint.mjJNT_HINGE)
    for n in _HARMONICS if hinge else ():
        if n * s.travel[j] > np.pi:
            sizes = (0.5 * tenth, 0.5 * tenth, float(n))
            yield make("cogging", *sizes, free=(0, 1), start=(0.0, 0.0, 0.0), shape=0.3 / s.travel[j])
    yield make("encoder_offset", 0.01)
    if plant.actuator[j] < 0:
        return
    yield make("load_dependent_friction", 0.05)
    yield make("command_delay", 0.005)
    yield make("dropped_commands", 0.2)
    if s.peak[j] > 0:
        for encoder in (0.0, 1.0):  # on the motor, on the joint
            steps = (_twist(plant, s, j, encoder), encoder, 1e-3, 0.1)
            yield make("series_elasticity", *steps, start=(0.0,) * 4, shape=3e-4)
            yield make("backlash", max(0.01 * s.travel[j], 0.002), encoder, start=(0.0, 0.0))
    if not plant.scalable[j] or plant.torque_input:
        if plant.torque_input and plant.scalable[j]:
            yield make("motor_strength", -0.1)
        return
    for kind in ("motor_strength", "kp", "kd"):
        yield make(kind, -0.1)
    yield make("torque_lag", 0.005)
    yield make("encoder_delay", 0.005)
    yield make("strength_drift", 0.1 / max(s.duration, 1.0))
    yield make("thermal_fade", 0.1 / max(s.duration, 1.0))
    limit = declared_values(plant, "torque_limit", name)[0]
    for share in (0.9, 0.6, 0.35):
        if s.peak[j] > 0 and share * s.peak[j] < limit:
            yield make("torque_limit", (share - 1.0) * s.peak[j], start=(min(limit, s.peak[j]),))
    if np.isfinite(limit):
        for factor in (0.6, 1.5, 4.0):
            yield make("torque_speed_limit", 1.0 / (factor * s.fastest[j]), start=(0.0,))


def _twist(plant: Plant, s: Scales, j: int, encoder: float) -> float:
    """Compliance [rad/(N m)] that matters; a servo that reads the joint behind a soft shaft would swing it up."""
    large, a = 0.02 * max(s.travel[j], 0.02) / s.peak[j], plant.actuator[j]
    gain = abs(plant.model.actuator_gear[a, 0] ** 2 * plant.model.actuator_biasprm[a, 1])
    return float(min(large, _STIFF / gain) if encoder and gain else large)


def _on_whole(plant: Plant) -> list[Candidate]:
    found = [Candidate("ground_slope", "", (0.0, 0.0), (0.01, 0.01), (0, 1))]
    driven = plant.actuator >= 0
    if driven.sum() < 2:
        return found
    if np.ptp(plant.delay[plant.actuator[driven]]) == 0:
        found.append(Candidate("command_delay", "", (float(plant.delay[plant.actuator[driven]][0]),), (0.005,)))
    found.append(Candidate("dropped_commands", "", (0.0,), (0.2,)))
    if not plant.torque_input and plant.scalable[driven].all():
        found += [Candidate("torque_lag", "", (0.0,), (0.005,)), Candidate("encoder_delay", "", (0.0,), (0.005,))]
    return found


def _on_body(plant: Plant, body: str, total: float) -> list[Candidate]:
    mass, alone = declared_values(plant, "link_mass", body)
    index = plant.model.body(body).id
    moments = plant.model.body_inertia[index]
    size = float(np.sqrt(1.5 * moments.sum() / mass))  # of a ball of this inertia, twice
    heavy = max(0.2 * mass, 0.01 * total)
    weight = 9.81 * heavy
    return [
        Candidate("link_mass", body, (mass, alone), (heavy, 0.0)),
        Candidate("link_mass", body, (mass, alone), (heavy, 1.0)),
        Candidate("link_com", body, declared_values(plant, "link_com", body), (max(0.1 * size, 0.01),) * 3, (0, 1, 2)),
        Candidate("link_inertia", body, tuple(map(float, moments)), tuple(0.3 * moments + 1e-5), (0, 1, 2)),
        Candidate("external_wrench", body, (0.0,) * 6, (*(weight,) * 3, 0.0, 0.0, 0.0), (0, 1, 2)),
    ]


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
