"""The declared model and its joints and actuators in the order of the log's columns.

Actuators of which a log cannot tell what they did: refused, for a simulation would hold them at a command of zero.

The columns have one command a joint. What a tendon or a propeller was told is in none of them; nor is the state of an
actuator that integrates its command, from which a window would have to start.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import mujoco
import numpy as np
from mujoco.batch import MODEL_FIELDS

from bumblebee.diagnosis.simulation.actuators import drive_law, take_target, take_torque
from bumblebee.diagnosis.simulation.conditions import Condition, refuse_unmade, set_gains, set_supply, with_loads
from bumblebee.diagnosis.simulation.failures import Failures
from bumblebee.diagnosis.thresholds.simulation import DriveProbe, SimulationThresholds
from bumblebee.errors import BadInput
from bumblebee.measured.rollout import Rollout
from bumblebee.robot.drives import ON_JOINT
from bumblebee.sim.effects import is_hidden
from bumblebee.sim.servo import actuator_of

_FREE, _BALL = int(mujoco.mjtJoint.mjJNT_FREE), int(mujoco.mjtJoint.mjJNT_BALL)
_PLACES = {
    int(mujoco.mjtTrn.mjTRN_TENDON): "a tendon",
    int(mujoco.mjtTrn.mjTRN_SITE): "a site",
    int(mujoco.mjtTrn.mjTRN_SLIDERCRANK): "a slider-crank",
    int(mujoco.mjtTrn.mjTRN_BODY): "a body",
}
_STATES = {
    int(mujoco.mjtDyn.mjDYN_INTEGRATOR): "integrates its command",
    int(mujoco.mjtDyn.mjDYN_MUSCLE): "is a muscle",
    int(mujoco.mjtDyn.mjDYN_USER): "has dynamics of a plugin",
    int(mujoco.mjtDyn.mjDYN_PID): "sums up its error or limits its rate",
    int(mujoco.mjtDyn.mjDYN_DCMOTOR): "has a current, an integral or a temperature of its own",
}


@dataclass(frozen=True, eq=False)
class Plant:
    """A model ready to be restarted from measured states. J joints in the log's order, nu actuators in the model's."""

    model: mujoco.MjModel
    """Compiled without delay buffers: delays act on the commands, which are known in advance."""
    joints: tuple[str, ...]
    """(J) names."""
    qpos: np.ndarray
    """(J,) addresses in qpos."""
    dof: np.ndarray
    """(J,) addresses in qvel."""
    actuator: np.ndarray
    """(J,) actuator that drives the joint, -1 for a passive joint."""
    torque_input: bool
    """Whether the commands are torques; else they are position targets."""
    floating: bool
    """Whether the model has a free base."""
    base_qpos: int
    """Address of the base's position in qpos."""
    base_dof: int
    """Address of the base's velocity in qvel."""
    delay: np.ndarray
    """(nu,) command delay [s] that the model declares."""
    offset: np.ndarray
    """(J,) encoder offset [rad] that the servos of the model declare."""
    scalable: np.ndarray
    """(J,) bool: the drive's gains stand in gainprm and biasprm; not so for a dcmotor or a passive joint."""
    spec: mujoco.MjSpec
    """Spec that it was made of, to be compiled again with effects that change its structure."""
    example: Rollout
    """A rollout whose columns it matches."""
    compiled: dict[tuple, "Plant"] = field(default_factory=dict, repr=False)
    """Plants of the same robot with play, flexible shafts or yielding springs, by their places."""
    thresholds: SimulationThresholds = field(default_factory=SimulationThresholds, repr=False)
    """Thresholds that it is simulated by."""
    condition: Condition = field(default_factory=Condition)
    """Condition of its model: what differs from the declared one."""
    others: tuple["Plant", ...] = field(default=(), repr=False)
    """Plants of this robot under the other conditions that rollouts were recorded under."""
    under: Mapping[str, int] = field(default_factory=dict, repr=False)
    """Rollout -> number of its condition, 0 for this plant's own and where it is not listed."""

    @property
    def every(self) -> tuple["Plant", ...]:
        """The robot under each condition, by number."""
        return (self, *self.others)

    def of(self, rollout: Rollout) -> "Plant":
        """The robot under the condition of a rollout."""
        return self.every[self.under.get(rollout.rollout_id, 0)]

    @cached_property
    def differing(self) -> tuple[str, ...]:
        """Names of the model's arrays that are not the same under all conditions."""
        models = [plant.model for plant in self.every]
        names = [n for n in sorted(MODEL_FIELDS) if isinstance(getattr(self.model, n, None), np.ndarray)]
        return tuple(
            n for n in names if any(not np.array_equal(getattr(models[0], n), getattr(m, n)) for m in models[1:])
        )

    failures: Failures = field(default_factory=Failures, repr=False)
    """Models of it that could not be made or simulated."""

    @property
    def bodies(self) -> tuple[str, ...]:
        """Named bodies that have a mass and can move."""
        model = self.model
        moving = [b for b in range(1, model.nbody) if model.body_mass[b] > 0 and model.body_weldid[b] != 0]
        return tuple(name for b in moving if (name := model.body(b).name))


def make_plant(
    spec: mujoco.MjSpec,
    rollout: Rollout,
    where: object,
    thresholds: SimulationThresholds | None = None,
    condition: Condition | None = None,
) -> Plant:
    """Match the model's joints and actuators with the columns of `rollout`; `where` names the model in errors.

    The model is the declared one under a `condition`, if one is given.
    """
    rules, condition = thresholds or SimulationThresholds(), condition or Condition()
    declared, spec = spec, with_loads(spec, condition.loads, where)
    delay = np.array([a.delay if a.nsample else 0.0 for a in spec.actuators])
    for actuator in spec.actuators:
        actuator.nsample, actuator.delay = 0, 0.0
    torque_input = _set_inputs(spec, rollout, where, rules.drive)
    set_gains(spec, rollout.joints, condition)
    model = _with_movable_bodies(spec)
    refuse_unmade(model, condition.loads, where)
    set_supply(model, condition.supply)
    model.opt.iterations = max(rules.solver.iterations, model.opt.iterations)
    model.opt.ls_iterations = max(rules.solver.line_search, model.opt.ls_iterations)
    free, joints = _match_joints(model, rollout, where)
    actuator = np.array([actuator_of(model, j) for j in joints], dtype=int)
    law = drive_law(model, where, rules.drive)
    offset = np.zeros(len(joints))
    for column, a in enumerate(actuator):
        if a >= 0 and law.simple[a] and model.actuator_biasprm[a, 1] != 0:
            offset[column] = model.actuator_biasprm[a, 0] / model.actuator_biasprm[a, 1] / model.actuator_gear[a, 0]
    return Plant(
        model=model,
        joints=rollout.joints,
        qpos=model.jnt_qposadr[joints].astype(int),
        dof=model.jnt_dofadr[joints].astype(int),
        actuator=actuator,
        torque_input=torque_input,
        floating=free >= 0,
        base_qpos=int(model.jnt_qposadr[free]) if free >= 0 else 0,
        base_dof=int(model.jnt_dofadr[free]) if free >= 0 else 0,
        delay=delay if len(delay) else np.zeros(model.nu),
        offset=offset,
        scalable=np.array([a >= 0 and bool(law.simple[a]) for a in actuator]),
        spec=declared,
        example=rollout,
        thresholds=rules,
        condition=condition,
    )


def _with_movable_bodies(spec: mujoco.MjSpec) -> mujoco.MjModel:
    """Compile `spec` so that every body may get another mass, centre and inertia.

    A body alone on slides or a free joint, centred on its frame, is compiled as `simple`: of its rows in the mass
    matrix the diagonal alone is stored, and MuJoCo refuses a centre that is moved afterwards.
    """
    model = spec.compile()
    simple = [b for b in range(1, model.nbody) if model.body_simple[b]]
    if not simple:
        return model
    for body in spec.bodies[1:]:
        if body.id in simple:
            body.simple = 0
    return spec.compile()


def plant_by(plant: Plant, thresholds: SimulationThresholds) -> Plant:
    """The plant simulated by other thresholds, of which nothing has failed yet."""
    if thresholds == plant.thresholds:
        return replace(plant, failures=Failures())
    own = make_plant(plant.spec, plant.example, "declared model", thresholds, plant.condition)
    return replace(own, others=tuple(plant_by(other, thresholds) for other in plant.others), under=plant.under)


def _match_joints(model: mujoco.MjModel, rollout: Rollout, where: object) -> tuple[int, np.ndarray]:
    """The free joint's id (-1: none) and the id of every logged joint."""
    kinds = model.jnt_type.astype(int)
    names = {model.joint(j).name: j for j in range(model.njnt)}
    free = [j for j in range(model.njnt) if kinds[j] == _FREE]
    if len(free) > 1 or (kinds == _BALL).any():
        raise BadInput(where, "hinge and slide joints and at most one free base", "ball joints or several free bodies")
    for name in rollout.joints:
        if name not in names or kinds[names[name]] == _FREE:
            raise BadInput(f"{where}: joint {name!r} of {rollout.rollout_id}", "a hinge or slide of the model", "none")
    if missing := [n for n, j in names.items() if kinds[j] != _FREE and n not in rollout.joints and not is_hidden(n)]:
        raise BadInput(f"{rollout.rollout_id}: joints", f"joint {missing[0]!r} of {where}", "no column for it")
    if free:
        for column in ("base_quat", "base_ang_vel", "base_lin_vel"):
            if getattr(rollout, column) is None:
                raise BadInput(f"{rollout.rollout_id}: column {column}", "a column, the base floats", "none")
    return (free[0] if free else -1), np.array([names[n] for n in rollout.joints], dtype=int)


def _set_inputs(spec: mujoco.MjSpec, rollout: Rollout, where: object, rule: DriveProbe) -> bool:
    """Make every actuator of `spec` on a logged joint take what was logged; True if that is torque.

    Position targets where they were logged and the model has servos (or the gains are known); torques else.
    """
    model = spec.compile()
    law = drive_law(model, where, rule)
    names = {model.joint(j).name: j for j in range(model.njnt)}
    drives = {name: actuator_of(model, names[name]) for name in rollout.joints if name in names}
    drives = {name: a for name, a in drives.items() if a >= 0}
    servo = any(law.servo[a] for a in drives.values())
    if rollout.joint_target is None and rollout.joint_torque_cmd is None:
        raise BadInput(f"{rollout.rollout_id}: column joint_target", "joint_target or joint_torque_cmd", "neither")
    torque = rollout.joint_target is None or (not servo and rollout.joint_torque_cmd is not None)
    kp, kd = rollout.meta.get("kp"), rollout.meta.get("kd")
    motor = int(mujoco.mjtGain.mjGAIN_FIXED)
    for name, a in drives.items():
        actuator = spec.actuators[a]
        if torque and (law.servo[a] or int(model.actuator_gaintype[a]) != motor):
            take_torque(actuator)
        elif not torque and not law.servo[a]:
            if kp is None or kd is None:
                raise BadInput(
                    f"{where}: actuator {actuator.name!r}",
                    "a position servo, or kp and kd in the rollouts' metadata",
                    f"a motor and position targets in {rollout.rollout_id}",
                    "Import with `meta: {kp: [...], kd: [...]}` in the map, a number a joint.",
                )
            column = rollout.joints.index(name)
            take_target(actuator, float(kp[column]), float(kd[column]))
    return torque


def refuse_unlogged(plant: Plant, where: object) -> None:
    """`BadInput` for an actuator that is on no joint, or whose state the log lacks; `where` names the model.

    A tendon that no command can tighten is none of these: an actuator without gain and bias does nothing.
    """
    model = plant.model
    for a in range(model.nu):
        name, place = model.actuator(a).name or f"number {a}", int(model.actuator_trntype[a])
        if not (np.any(model.actuator_gainprm[a]) or np.any(model.actuator_biasprm[a])):
            continue
        if place not in ON_JOINT:
            raise BadInput(
                f"{where}: actuator {name!r}",
                "actuators on hinges and slides, whose commands are in the log",
                f"one on {_PLACES.get(place, 'something else')}, for which there is no column",
                "Take it out of the model, or drive the joints themselves.",
            )
        if (kind := int(model.actuator_dyntype[a])) in _STATES and model.actuator_actnum[a]:
            raise BadInput(
                f"{where}: actuator {name!r}",
                "a motor, a servo or a dcmotor",
                f"one that {_STATES[kind]}: its state is in no column",
                "Declare the servo that it stands for.",
            )
