"""The true robot: the declared one with at most two undeclared effects, simulated by equations of its own; its logs.

The effects are written into a compiled model, or act on commands and readings, in ways of this file: none of the
product's code is shared.
"""

from dataclasses import dataclass, field

import mujoco
import numpy as np

from benchmarks.any_robot_logs.robot import Robot, Size
from bumblebee.measured.rollout import Rollout

RATES = (20.0, 25.0, 50.0, 100.0, 200.0, 500.0, 1000.0, 2000.0)
KINDS = (
    "coulomb_friction", "viscous_friction", "armature", "motor_strength", "command_delay", "link_mass", "joint_spring",
    "encoder_offset",
)  # fmt: skip


@dataclass(frozen=True)
class Sealed:
    """One undeclared effect."""

    effect: str
    where: str
    size: float
    """N m, N m s/rad, kg m^2, factor, s, factor, N m/rad, rad."""


@dataclass
class Log:
    """How a case was recorded."""

    hz: float
    seconds: float
    rollouts: int
    jitter: float = 0.0
    dropped: float = 0.0
    """Share of rows that are missing."""
    quantum: float = 0.0
    """Step of the encoders [rad]."""
    noise: tuple[float, float] = (1e-4, 1e-2)
    """Noise of positions [rad] and velocities [rad/s]."""
    loud: float = 1.0
    """Times the usual size of the commands."""
    resting: bool = False
    base_pos: bool = True
    spoiled: str = ""
    """A mistake of the logger that ingestion is to find."""
    about: list[str] = field(default_factory=list)


def make_log(rng: np.random.Generator, size: Size, joints: int) -> Log:
    """Rate, length, faults."""
    hz, seconds = float(rng.choice(RATES)), float(rng.uniform(3.0, size.seconds))
    rollouts = int(rng.integers(1, size.rollouts + 1))
    rows = size.rows / max(1.0, 0.1 * joints)
    if hz * seconds * rollouts > rows:
        rollouts = max(1, int(rows / (hz * seconds)))
    seconds = max(3.0, min(seconds, rows / (hz * rollouts)))
    log = Log(hz, seconds, rollouts)
    log.noise = float(10 ** rng.uniform(-6, -3)), float(10 ** rng.uniform(-5, -1.3))
    draws = rng.random(7)
    log.jitter = float(rng.uniform(0.02, 0.3)) if draws[0] < 0.25 else 0.0
    log.dropped = float(rng.uniform(0.002, 0.04)) if draws[1] < 0.2 else 0.0
    log.quantum = float(10 ** rng.uniform(-4, -2.2)) if draws[2] < 0.25 else 0.0
    log.loud = 6.0 if draws[3] < 0.12 else 1.0
    log.resting = bool(draws[4] < 0.05)
    log.base_pos = bool(draws[5] < 0.6)
    if draws[6] < 0.08:
        log.spoiled = str(rng.choice(["nan", "short", "range", "reversed", "no command", "repeated"]))
    log.about = [f"{hz:g} Hz", f"{rollouts} x {seconds:.1f} s"]
    flags = {"jitter": log.jitter, "drop-outs": log.dropped, "quantised": log.quantum, "saturated": log.loud > 1}
    log.about += (
        [name for name, on in flags.items() if on] + ["at rest"] * log.resting + [log.spoiled] * bool(log.spoiled)
    )
    return log


def seal(rng: np.random.Generator, robot: Robot, model: mujoco.MjModel) -> list[Sealed]:
    """None, one or two undeclared effects of sizes that matter on this robot."""
    found: list[Sealed] = []
    for _ in range(int(rng.choice([0, 1, 2], p=[0.25, 0.5, 0.25]))):
        kind = str(rng.choice(KINDS))
        choices = [n for n, has in zip(robot.joints, robot.driven, strict=True) if has] or list(robot.joints)
        where = str(rng.choice(choices))
        joint = model.joint(where).id
        typical = _typical(model)[model.jnt_dofadr[joint]]
        if kind == "link_mass":
            where = model.body(int(model.jnt_bodyid[joint])).name
        sizes = {
            "coulomb_friction": 0.3 * typical, "viscous_friction": 0.3 * typical, "armature": 0.2 * typical,
            "motor_strength": 0.65, "command_delay": 0.02, "link_mass": 1.6, "joint_spring": 0.6 * typical,
            "encoder_offset": 0.06,
        }  # fmt: skip
        if not any((s.effect, s.where) == (kind, where) for s in found):
            found.append(Sealed(kind, where, float(sizes[kind] * rng.uniform(0.7, 1.5))))
    return found


def _typical(model: mujoco.MjModel) -> np.ndarray:
    """(nv,) torques [N m, N] that move each degree of freedom at 5 rad/s^2 in the reference pose."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return 5.0 * np.maximum(model.dof_M0, 1e-3) + 0.2 * np.abs(data.qfrc_bias)


def true_model(robot: Robot, sealed: list[Sealed], rng: np.random.Generator) -> mujoco.MjModel:
    """The robot with what is undeclared of its bodies and joints, in an integrator and step of its own."""
    spec = mujoco.MjSpec.from_string(robot.xml)
    for body in spec.bodies[1:]:
        body.simple = 0
    model = spec.compile()
    for one in sealed:
        if one.effect == "link_mass":
            body = model.body(one.where).id
            model.body_mass[body] *= one.size
            model.body_inertia[body] *= one.size
            continue
        dof = model.jnt_dofadr[model.joint(one.where).id]
        if one.effect == "coulomb_friction":
            model.dof_frictionloss[dof] += one.size
            model.dof_solref[dof], model.dof_solimp[dof, :2] = (0.002, 1.0), (0.99, 0.9999)
        elif one.effect == "viscous_friction":
            model.dof_damping[dof] += one.size
        elif one.effect == "armature":
            model.dof_armature[dof] += one.size
        elif one.effect == "joint_spring":
            model.jnt_stiffness[model.joint(one.where).id] += one.size
    if robot.drive not in ("position", "general"):
        _without_feedback(model, robot)
    model.opt.integrator = int(rng.integers(0, 4))
    model.opt.timestep = float(rng.choice([0.0005, 0.001]))
    mujoco.mj_setConst(model, mujoco.MjData(model))
    return model


def _without_feedback(model: mujoco.MjModel, robot: Robot) -> None:
    """Drives that are told a torque give it: neither back-EMF nor a position servo of their own is felt."""
    for name in robot.joints:
        a = _actuator(model, model.joint(name).id)
        if a >= 0 and (model.actuator_biasprm[a, 1] != 0 or model.actuator_gaintype[a] != mujoco.mjtGain.mjGAIN_FIXED):
            model.actuator_gaintype[a] = mujoco.mjtGain.mjGAIN_FIXED
            model.actuator_biastype[a] = mujoco.mjtBias.mjBIAS_NONE
            model.actuator_gainprm[a], model.actuator_biasprm[a] = 0.0, 0.0


@dataclass
class _Recorder:
    """One true robot under commands."""

    robot: Robot
    model: mujoco.MjModel
    sealed: list[Sealed]
    log: Log
    rng: np.random.Generator

    def __post_init__(self) -> None:
        model, names = self.model, self.robot.joints
        ids = [model.joint(n).id for n in names]
        self.at, self.dof = model.jnt_qposadr[ids], model.jnt_dofadr[ids]
        self.actuator = np.array([_actuator(model, j) for j in ids])
        self.typical = _typical(model)[self.dof]
        self.by_target = self.robot.drive in ("position", "general") or self.robot.motor_gains is not None
        self.strength = self._of("motor_strength", 1.0)
        self.offset, self.delay = self._of("encoder_offset", 0.0), self._of("command_delay", 0.0)

    def _of(self, kind: str, none: float) -> np.ndarray:
        sizes = {s.where: s.size for s in self.sealed if s.effect == kind}
        return np.array([sizes.get(name, none) for name in self.robot.joints])

    def one(self, name: str) -> Rollout:
        """A rollout under multisines."""
        rng, log, count = self.rng, self.log, len(self.robot.joints)
        rows = max(12, round(log.hz * log.seconds))
        periods = (1 + log.jitter * rng.uniform(-1, 1, rows)) / log.hz
        time = np.concatenate(([0.0], np.cumsum(periods)))[:rows]
        amp, freq = rng.uniform(0.3, 1.0, (3, count)), rng.uniform(0.2, 2.0, (3, count))
        wave = (amp * np.sin(2 * np.pi * freq * time[:, None, None] + rng.uniform(0, 6.28, (3, count)))).sum(axis=1)
        size = np.where(self.model.jnt_type[self.model.dof_jntid[self.dof]] == 2, 0.08, 0.35)
        wave = wave * log.loud * (size if self.by_target else 0.5 * self.typical) * (0.0 if log.resting else 1.0)
        return self._logged(name, time, *self._run(time, wave))

    def _run(self, time: np.ndarray, wave: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """qpos, qvel and what the log says was commanded, at each row."""
        model, data = self.model, mujoco.MjData(self.model)
        data.qpos[self.at] += 0.05 * self.rng.standard_normal(len(self.at))
        places, speeds, commands = [], [], []
        for k, now in enumerate(time):
            q, v = data.qpos[self.at] + self.offset, data.qvel[self.dof]
            commands.append(wave[k] if self.by_target else wave[k] - 0.3 * self.typical * (q + 0.5 * v))
            places.append(data.qpos.copy())
            speeds.append(data.qvel.copy())
            if k + 1 == len(time):
                break
            steps = max(1, int(np.ceil((time[k + 1] - now) / self.model.opt.timestep - 1e-9)))
            usual, model.opt.timestep = model.opt.timestep, (time[k + 1] - now) / steps
            for n in range(steps):
                self._drive(data, commands, time, now + n * model.opt.timestep)
                mujoco.mj_step(model, data)
            model.opt.timestep = usual
        return np.array(places), np.array(speeds), np.array(commands)

    def _drive(self, data: mujoco.MjData, commands: list[np.ndarray], time: np.ndarray, now: float) -> None:
        """Late commands into the drives, which read offset encoders and have a strength of their own."""
        model = self.model
        for j, a in enumerate(self.actuator):
            if a < 0:
                continue
            late = min(len(commands) - 1, max(0, int(np.searchsorted(time, now - self.delay[j] + 1e-9)) - 1))
            value, gear, gain = commands[late][j], model.actuator_gear[a, 0], model.actuator_gainprm[a, 0]
            servo = model.actuator_biasprm[a, 1] != 0
            if servo:
                data.ctrl[a] = gear * (value - self.offset[j])
            else:
                if self.robot.motor_gains is not None:
                    kp, kd = self.robot.motor_gains
                    value = kp * (value - data.qpos[self.at[j]] - self.offset[j]) - kd * data.qvel[self.dof[j]]
                data.ctrl[a] = 0.0
                data.qfrc_applied[self.dof[j]] = gear * self._within(a, self.strength[j] * value / gear, data)
                continue
            # A weaker drive: what its force lacks, computed from the last step's.
            data.qfrc_applied[self.dof[j]] = (self.strength[j] - 1) * gear * data.actuator_force[a] * (gain != 0)

    def _within(self, a: int, force: float, data: mujoco.MjData) -> float:
        """Damping that a drive adds for a force beside it: their sum keeps to the drive's limits."""
        if not self.model.actuator_forcelimited[a]:
            return force
        low, high = self.model.actuator_forcerange[a]
        return float(np.clip(force + data.actuator_force[a], low, high) - data.actuator_force[a])

    def _logged(self, name: str, time: np.ndarray, qpos: np.ndarray, qvel: np.ndarray, command: np.ndarray) -> Rollout:
        rng, log, robot = self.rng, self.log, self.robot
        place, speed = qpos[:, self.at] + self.offset, qvel[:, self.dof]
        place = place + log.noise[0] * rng.standard_normal(place.shape)
        speed = speed + log.noise[1] * rng.standard_normal(speed.shape)
        if log.quantum:
            place, speed = (
                np.round(place / log.quantum) * log.quantum,
                np.round(speed / (20 * log.quantum)) * 20 * log.quantum,
            )
        columns = {"joint_target" if self.by_target else "joint_torque_cmd": command}
        if robot.floating:
            noise = 1e-3 * rng.standard_normal((len(time), 10))
            quat = qpos[:, 3:7] + noise[:, :4]
            columns["base_quat"] = quat / np.linalg.norm(quat, axis=1, keepdims=True)
            columns["base_ang_vel"] = qvel[:, 3:6] + noise[:, 4:7]
            columns["base_lin_vel"] = np.array([_into(q, v) for q, v in zip(qpos[:, 3:7], qvel[:, :3], strict=True)])
            if log.base_pos:
                columns["base_pos"] = qpos[:, :3] + noise[:, 7:]
        meta = {}
        if robot.motor_gains is not None:
            meta = {k: [g] * len(robot.joints) for k, g in zip(("kp", "kd"), robot.motor_gains, strict=True)}
        keep = np.sort(rng.permutation(len(time))[: max(10, round(len(time) * (1 - log.dropped)))])
        columns = {k: v[keep] for k, v in columns.items()}
        made = Rollout(name, robot.joints, log.hz, time[keep] + 3.0, place[keep], speed[keep], meta=meta, **columns)
        return _spoiled(made, log.spoiled)


def record(robot: Robot, sealed: list[Sealed], log: Log, rng: np.random.Generator) -> list[Rollout]:
    """All rollouts of a case."""
    recorder = _Recorder(robot, true_model(robot, sealed, rng), sealed, log, rng)
    return [recorder.one(f"run{k}") for k in range(log.rollouts)]


def _actuator(model: mujoco.MjModel, joint: int) -> int:
    """The first drive on a joint that follows a position, else the first; -1 for none."""
    there = [a for a in range(model.nu) if model.actuator_trntype[a] == 0 and model.actuator_trnid[a, 0] == joint]
    return next((a for a in there if model.actuator_biasprm[a, 1] != 0), there[0] if there else -1)


def _into(quat: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """World to base frame."""
    inverse, out = np.zeros(4), np.zeros(3)
    mujoco.mju_negQuat(inverse, quat / np.linalg.norm(quat))
    mujoco.mju_rotVecQuat(out, vector, inverse)
    return out


def _spoiled(rollout: Rollout, how: str) -> Rollout:
    """A mistake of the logger, in place."""
    middle = rollout.frames // 2
    if how == "nan":
        rollout.joint_pos[middle, 0] = np.nan
    elif how == "range":
        rollout.joint_pos[middle:, 0] += 50.0
    elif how == "reversed":
        rollout.joint_vel[:, 0] *= -1
    elif how == "repeated":
        rollout.joint_pos[middle:], rollout.joint_vel[middle:] = rollout.joint_pos[middle], rollout.joint_vel[middle]
    elif how in ("short", "no command"):
        names = [c for c in rollout.columns if how == "short" or c not in ("joint_target", "joint_torque_cmd")]
        rows = 6 if how == "short" else rollout.frames
        columns = {c: getattr(rollout, c)[:rows] for c in names}
        return Rollout(
            rollout.rollout_id, rollout.joints, rollout.control_hz, rollout.time[:rows], meta=rollout.meta, **columns
        )
    return rollout
