"""The robot as a plan moves it: its servos at each gain, what will be logged of it, and the pose that it rests in."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import mujoco
import numpy as np

from bumblebee.diagnosis.dataset import Session, steps_of
from bumblebee.diagnosis.plan.config import Gain, PlanConfig
from bumblebee.diagnosis.simulation import Layout, Plant, layout_of, make_plant, refuse_unlogged
from bumblebee.diagnosis.thresholds.plan import SensorNoise, TrackingGains
from bumblebee.errors import BadInput
from bumblebee.measured.rollout import Rollout
from bumblebee.robot.drives import explicit_drives
from bumblebee.sim.effects import is_hidden
from bumblebee.sim.servo import servos_of

_SCALAR = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))


@dataclass(frozen=True, eq=False)
class Machine:
    """A robot of J joints."""

    name: str
    """Name of the model's file."""
    driven: dict[Gain, Plant]
    """Gains -> the robot whose servos follow position targets."""
    seen: dict[Gain, Plant]
    """Gains -> the robot as a diagnosis takes its logs: the same, or one that takes the logged torques."""
    layout: Layout
    """Layout of what is simulated, with the base's position."""
    seen_layout: Layout
    """Layout of what is logged."""
    sigma: np.ndarray
    """(D,) noise of what is logged."""
    rate: float
    """Rate of the targets [Hz]."""
    steps: tuple[float, float]
    """Simulation step [s] for residuals and for sensitivities."""
    qpos: np.ndarray
    """(nq,) the start pose of the declared model."""
    home: np.ndarray
    """(J,) targets that hold the start pose."""
    kp: np.ndarray
    """(J,) declared gains [N m/rad, N/m]; 0 for a joint without a drive, or where the model keeps them elsewhere."""
    kd: np.ndarray
    """(J,) [N m s/rad, N s/m]."""
    tracked: bool
    """Whether the drives take torques, and a servo of `kp` and `kd` beside them has to follow the targets."""

    @property
    def plant(self) -> Plant:
        """The robot at its declared gains."""
        return self.driven[Gain()]

    @property
    def joints(self) -> tuple[str, ...]:
        """(J) names, in the order of all columns."""
        return self.plant.joints

    @property
    def moved(self) -> np.ndarray:
        """(J,) bool: joints with a drive."""
        return self.plant.actuator >= 0


def make_machine(spec: mujoco.MjSpec, name: str, session: Session | None, config: PlanConfig) -> Machine:
    """The machine of a declared model, with what a dataset's session says of rate, noise and start."""
    rules = config.thresholds
    spec = session.spec if session else explicit_drives(spec)[0]
    joints = session.plant.joints if session else _joints(spec.compile(), name)
    rate = config.rate or (session.rollouts[0].control_hz if session else 50.0)
    torque = _takes_torque(spec, joints, rate, name)
    kp, kd = _gains(spec, joints, config, session, rules.plan.tracking) if torque else (None, None)
    driven, seen = {}, {}
    for gain in dict.fromkeys((Gain(), *config.all_gains)):
        scaled = _scaled(spec, gain, joints, name)
        gains = {} if kp is None or kd is None else {"kp": (gain.kp * kp).tolist(), "kd": (gain.kd * kd).tolist()}
        example = _example(scaled, joints, rate, gains, ("joint_target",))
        driven[gain] = make_plant(scaled, example, name, rules.simulation)
        refuse_unlogged(driven[gain], name)
        logged = _logged(session, torque)
        example = _example(scaled, joints, rate, gains, logged)
        seen[gain] = make_plant(scaled, example, name, rules.simulation)
    plant = driven[Gain()]
    if (plant.actuator < 0).all():
        raise BadInput(name, "a model with a drive on a hinge or slide", "none", "Add its actuators.")
    _refuse_untold(plant, name)
    seen_layout = session.layout if session else layout_of(plant, plant.floating)
    fine, search = steps_of(1.0 / rate, float(spec.option.timestep), plant.model.nv, rules.dataset.time_steps)
    qpos, home = start_pose(plant, session, config.start, name)
    servos = servos_of(plant.model, [int(plant.model.joint(j).id) for j in joints])
    return Machine(
        name=name,
        driven=driven,
        seen=seen,
        layout=layout_of(plant, plant.floating),
        seen_layout=seen_layout,
        sigma=session.sigma if session else _noise(seen_layout, rules.plan.noise),
        rate=rate,
        steps=(search, fine[1]),
        qpos=qpos,
        home=home,
        kp=np.maximum(-servos.bias[:, 1], 0.0),
        kd=np.maximum(-servos.bias[:, 2], 0.0),
        tracked=torque,
    )


def _refuse_untold(plant: Plant, name: str) -> None:
    """`BadInput` for a drive whose torque does not follow from gains alone: no limit of a run could be promised."""
    for joint, actuator, told in zip(plant.joints, plant.actuator, plant.scalable, strict=True):
        if actuator >= 0 and not told:
            raise BadInput(
                f"{name}: joint {joint!r}",
                "a drive whose torque follows from its gains",
                "another law: a dcmotor, a pid, a gain that is no constant",
                "Declare the position servo that it stands for.",
            )


def start_pose(plant: Plant, session: Session | None, start: str | None, name: str) -> tuple[np.ndarray, np.ndarray]:
    """State (nq,) and targets (J,) that a run starts and ends in.

    The keyframe `start` if one is named; else where a fixed robot's dataset begins, the first keyframe, or the model's
    reference pose.
    """
    model = plant.model
    keys = [model.key(k).name for k in range(model.nkey)]
    if start is not None and start not in keys:
        raise BadInput("--start", f"a keyframe of {name}", repr(start)[:80], f"It has: {', '.join(keys) or 'none'}.")
    qpos = model.qpos0.copy()
    if start is not None or (keys and (plant.floating or session is None)):
        qpos = model.key(keys.index(start) if start is not None else 0).qpos.copy()
    elif session is not None and not plant.floating:
        first = session.rollouts[0]
        shown = first.joint_pos if first.joint_target is None else first.joint_target
        qpos[plant.qpos] = shown[0]
    return qpos, qpos[plant.qpos].copy()


def at_rest(machine: Machine, qpos: np.ndarray) -> Machine:
    """The machine whose rehearsals begin in the state `qpos` (nq,); its targets stay."""
    return replace(machine, qpos=qpos)


def without_gains(machine: Machine, names: Collection[str]) -> Machine:
    """The machine without the gains of these names."""
    driven, seen = (
        {gain: plant for gain, plant in some.items() if str(gain) not in names}
        for some in (machine.driven, machine.seen)
    )
    return replace(machine, driven=driven, seen=seen)


def _joints(model: mujoco.MjModel, name: str) -> tuple[str, ...]:
    kinds = model.jnt_type
    names = [model.joint(j).name for j in range(model.njnt) if int(kinds[j]) in _SCALAR]
    if "" in names:
        raise BadInput(name, "joints with names, by which targets are told", "a joint without one")
    return tuple(n for n in names if not is_hidden(n))


def _takes_torque(spec: mujoco.MjSpec, joints: Sequence[str], rate: float, name: str) -> bool:
    """Whether no drive of the model follows a position."""
    return make_plant(spec, _example(spec, joints, rate, {}, ("joint_target", "joint_torque_cmd")), name).torque_input


def _logged(session: Session | None, torque: bool) -> tuple[str, ...]:
    """Command columns that the diagnosis will find in the runs' logs."""
    if session is not None and session.rollouts[0].joint_target is None:
        return ("joint_torque_cmd",)
    return ("joint_target", "joint_torque_cmd") if torque else ("joint_target",)


def _gains(
    spec: mujoco.MjSpec, joints: Sequence[str], config: PlanConfig, session: Session | None, rule: TrackingGains
) -> tuple[np.ndarray, np.ndarray]:
    """Gains (J,), (J,) of the tracking servo: as told, as the dataset has them, or soft ones by the joints' inertia."""
    meta = session.rollouts[0].meta if session else {}
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    inertia = np.diag(full)[[int(model.jnt_dofadr[model.joint(j).id]) for j in joints]]
    circle = 2 * np.pi * rule.frequency
    kp = np.array(meta.get("kp") or inertia * circle**2, dtype=float)
    kd = np.array(meta.get("kd") or 2 * rule.damping * inertia * circle, dtype=float)
    return (
        kp if config.kp is None else np.full(len(joints), config.kp),
        kd if config.kd is None else np.full(len(joints), config.kd),
    )


def _scaled(spec: mujoco.MjSpec, factor: Gain, joints: Sequence[str], name: str) -> mujoco.MjSpec:
    """The model with factors on its position servos' gains."""
    if factor == Gain():
        return spec
    model, spec = spec.compile(), spec.copy()
    servos = servos_of(model, [int(model.joint(j).id) for j in joints])
    for column, a in enumerate(servos.actuator):
        if a < 0:
            continue
        actuator = spec.actuators[int(a)]
        if int(model.actuator_gaintype[a]) != int(mujoco.mjtGain.mjGAIN_FIXED):
            raise BadInput("--gains, --damping", "servos whose gains stand in gainprm", f"{joints[column]!r} of {name}")
        if servos.bias[column, 1] != 0:  # a motor's tracking servo is scaled where it is made
            gain, bias = actuator.gainprm.copy(), actuator.biasprm.copy()
            gain[0], bias[:2], bias[2] = factor.kp * gain[0], factor.kp * bias[:2], factor.kd * bias[2]
            actuator.gainprm, actuator.biasprm = gain, bias
    return spec


def _example(
    spec: mujoco.MjSpec, joints: Sequence[str], rate: float, gains: dict[str, list[float]], logged: Sequence[str]
) -> Rollout:
    """A rollout of the columns that a run's log has."""
    model = spec.compile()
    zeros = np.zeros((3, len(joints)))
    columns = {name: zeros for name in logged}
    if int(mujoco.mjtJoint.mjJNT_FREE) in model.jnt_type:
        columns |= {"base_pos": np.zeros((3, 3)), "base_quat": np.tile([1.0, 0, 0, 0], (3, 1))}
        columns |= {"base_ang_vel": np.zeros((3, 3)), "base_lin_vel": np.zeros((3, 3))}
    return Rollout("plan", tuple(joints), rate, np.arange(3) / rate, zeros, zeros, meta=gains, **columns)


def _noise(layout: Layout, rule: SensorNoise) -> np.ndarray:
    out = np.empty(layout.size)
    for name, part in layout.slices.items():
        out[part] = getattr(rule, name)
    return out
