"""Measured rollouts made by plain MuJoCo, with the sensor noise of a good robot: a fixed arm, a pendulum, the G1."""

from functools import cache

import mujoco
import numpy as np

from bumblebee.measured.rollout import Rollout
from bumblebee.robot.facts import joint_names
from bumblebee.robot.model import build_model

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
