"""Measured rollouts made by plain MuJoCo, with the sensor noise of a good robot: a fixed arm, a pendulum, the G1."""

from functools import cache

import mujoco
import numpy as np

from bumblebee.measured.rollout import Rollout
from bumblebee.motion.clip import Clip, velocities
from bumblebee.motion.embedded import EmbeddedConfig, make
from bumblebee.motion.embedded.kinds import kinds
from bumblebee.robot.facts import joint_names
from bumblebee.robot.model import build_model
from bumblebee.tracking.feed_forward import lead_angles

ARM = """
<mujoco><compiler angle="radian"/><option timestep="0.002" integrator="implicitfast"/><worldbody><body pos="0 0 1">
<joint name="shoulder" axis="0 1 0" range="-2 2" limited="true" armature="0.02" damping="0.2"/>
<geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.03" mass="0.8" contype="0" conaffinity="0"/>
<body pos="0 0 -0.3"><joint name="elbow" axis="0 1 0" range="-2.4 2.4" limited="true" armature="0.02" damping="0.2"/>
<geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.03" mass="0.5" contype="0" conaffinity="0"/>
<body pos="0 0 -0.3"><joint name="wrist" axis="1 0 0" range="-1.8 1.8" limited="true" armature="0.02" damping="0.2"/>
<geom type="capsule" fromto="0 0 0 0 0 -0.1" size="0.02" mass="0.2" contype="0" conaffinity="0"/>
</body></body></body></worldbody><actuator>ACTUATORS</actuator></mujoco>
"""
ARM_JOINTS = ("shoulder", "elbow", "wrist")


@cache
def arm_model(kind: str = "position") -> mujoco.MjModel:
    """An arm of three hinges with position servos (kp 40, kd 2) or torque motors."""
    options = 'kp="40" kv="2" forcerange="-20 20"' if kind == "position" else ""
    lines = "".join(f'<{kind} name="{name}" joint="{name}" {options}/>' for name in ARM_JOINTS)
    return mujoco.MjModel.from_xml_string(ARM.replace("ACTUATORS", lines))


@cache
def g1_model() -> mujoco.MjModel:
    """The declared G1."""
    return build_model()


def excitation(rng: np.random.Generator, time: np.ndarray, joints: int, size: float) -> np.ndarray:
    """(T, J) sums of three sines of 0.2 to 2 Hz with random phases."""
    rate = rng.uniform(0.2, 2.0, (3, joints))
    phase = rng.uniform(0, 2 * np.pi, (3, joints))
    waves = np.sin(2 * np.pi * rate[:, None] * time[None, :, None] + phase[:, None])
    return size * waves.mean(axis=0)


@cache
def arm_rollout(
    seed: int, kind: str = "position", size: float = 0.8, hz: float = 50.0, seconds: float = 6.0
) -> Rollout:
    """The arm following a random target, or driven by random torques."""
    rng = np.random.default_rng(seed)
    model = arm_model(kind)
    data = mujoco.MjData(model)
    time = np.arange(round(seconds * hz)) / hz
    command = excitation(rng, time, 3, size if kind == "position" else 4 * size)
    states = []
    for k in range(len(time)):
        states.append(np.concatenate([data.qpos, data.qvel]))
        data.ctrl[:] = command[k]
        mujoco.mj_step(model, data, round(1 / hz / model.opt.timestep))
    states = np.array(states)
    columns = {"joint_target": command} if kind == "position" else {"joint_torque_cmd": command}
    meta = {"robot": "arm", "motion": f"wave {seed}", "cluster": "c0"}
    if kind == "position":
        meta |= {"kp": [40.0] * 3, "kd": [2.0] * 3}
    noisy = noise(rng, states[:, :3], 5e-4), noise(rng, states[:, 3:], 0.02)
    return Rollout(f"arm-{kind}-{seed}", ARM_JOINTS, hz, time + rng.uniform(0, 9), *noisy, **columns, meta=meta)


@cache
def g1_rollout(seed: int, size: float = 0.15, seconds: float = 4.0, heading: float | None = None) -> Rollout:
    """The G1 under random targets about its stand: it sways when small, falls and thrashes when large."""
    rng = np.random.default_rng(seed)
    model = g1_model()
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    heading = rng.uniform(-np.pi, np.pi) if heading is None else heading
    data.qpos[3:7] = [np.cos(heading / 2), 0, 0, np.sin(heading / 2)]
    time = np.arange(round(seconds * 50)) * 0.02
    command = model.key_qpos[0, 7:] + excitation(rng, time, 23, size) * np.minimum(1, time / 0.5)[:, None]
    if size == 0:
        command = np.tile(model.key_qpos[0, 7:], (len(time), 1))
    states = []
    for k in range(len(time)):
        states.append(np.concatenate([data.qpos, data.qvel]))
        data.ctrl[:] = command[k]
        mujoco.mj_step(model, data, 4)
    return _floating(rng, np.array(states), time, command, f"g1-{seed}-{size:g}")


@cache
def clip_and_lead(name: str) -> tuple[Clip, np.ndarray]:
    """An embedded clip and its gravity feed-forward (T, 23) [rad]."""
    kind = next(kind for kind in kinds() if kind.name == name)
    clip = make(kind, 0, EmbeddedConfig())
    return clip, lead_angles(clip)


@cache
def tracked_rollout(name: str) -> Rollout:
    """A clip that is tracked without error under feed-forward targets: position = clip, target = clip + lead."""
    clip, lead = clip_and_lead(name)
    speed = velocities(clip)
    columns = (clip.root_pos, clip.root_quat, clip.joint_pos)
    columns += (speed.root_lin_vel_w, speed.root_ang_vel_b, speed.joint_vel)
    time = np.arange(clip.frames) * 0.02
    states = np.concatenate(columns, axis=1)
    return _floating(np.random.default_rng(0), states, time, clip.joint_pos + lead, f"tracked-{name}")


@cache
def clip_rollout(name: str, fault: str = "", held: bool = True, seconds: float = 4.0) -> Rollout:
    """The G1 under a clip's feed-forward targets, its base held to the clip by a soft wrench or left to fall.

    Args:
        name: of the embedded clip.
        fault: weak (gains x 0.5), friction (0.5 to 4 N m), delay (30 ms), offset (encoders, 0.08 rad) or none.
        held: whether the wrench is there; without it the targets have no feedback and the robot falls.
        seconds: at most so long.
    """
    rng = np.random.default_rng(0)
    clip, lead = clip_and_lead(name)
    model = build_model()
    if fault == "weak":
        model.actuator_gainprm[:, 0] *= 0.5
        model.actuator_biasprm[:, 1:3] *= 0.5
    if fault == "friction":
        model.dof_frictionloss[6:] = rng.uniform(0.5, 4.0, 23)
    offset = rng.uniform(-0.08, 0.08, 23) * (fault == "offset")
    late = 6 * (fault == "delay")  # steps of 5 ms
    frames = min(clip.frames - 1, round(50 * seconds))
    target = (clip.joint_pos + lead)[1 : frames + 1] + rng.normal(0, 0.03, (frames, 23))
    data, states, line = mujoco.MjData(model), [], [target[0]] * late
    data.qpos[:] = np.concatenate([clip.root_pos[0], clip.root_quat[0], clip.joint_pos[0]])
    for k in range(frames):
        states.append(np.concatenate([data.qpos[:7], data.qpos[7:] + offset, data.qvel]))
        for _ in range(4):
            line.append(target[k])
            data.ctrl[:] = line[-1 - late] - offset
            if held:
                _hold(data, clip.root_pos[k], clip.root_quat[k])
            mujoco.mj_step(model, data)
    return _floating(rng, np.array(states), np.arange(frames) * 0.02, target, f"{fault or 'good'}-{held}-{name}")


def _hold(data: mujoco.MjData, place: np.ndarray, quat: np.ndarray) -> None:
    """A soft wrench on the base towards a pose."""
    tilt = np.zeros(3)
    mujoco.mju_subQuat(tilt, quat, data.qpos[3:7])
    torque = 150 * tilt - 15 * data.qvel[3:6]
    data.xfrc_applied[1, :3] = 1500 * (place - data.qpos[:3]) - 150 * data.qvel[:3]
    mujoco.mju_rotVecQuat(data.xfrc_applied[1, 3:], torque, data.qpos[3:7])


def _floating(
    rng: np.random.Generator, states: np.ndarray, time: np.ndarray, command: np.ndarray, name: str
) -> Rollout:
    quat, world = states[:, 3:7], states[:, 30:33]
    lin_b = np.array([_turn(q, v) for q, v in zip(quat, world, strict=True)])
    quat = noise(rng, quat, 0.002)
    return Rollout(
        name,
        joint_names(),
        50.0,
        time,
        noise(rng, states[:, 7:30], 5e-4),
        noise(rng, states[:, 36:], 0.02),
        joint_target=command,
        base_quat=quat / np.linalg.norm(quat, axis=1, keepdims=True),
        base_ang_vel=noise(rng, states[:, 33:36], 0.01),
        base_lin_vel=noise(rng, lin_b, 0.02),
        base_pos=noise(rng, states[:, :3], 0.002),
        meta={"robot": "g1_23dof", "motion": name, "cluster": "c1"},
    )


def _turn(quat: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """World to base frame, by MuJoCo's own functions."""
    inverse, out = np.zeros(4), np.zeros(3)
    mujoco.mju_negQuat(inverse, quat)
    mujoco.mju_rotVecQuat(out, vector, inverse)
    return out


def noise(rng: np.random.Generator, values: np.ndarray, size: float) -> np.ndarray:
    """Values with white noise."""
    return values + size * rng.standard_normal(values.shape)
