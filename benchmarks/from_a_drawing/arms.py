"""Arms of 2 to 6 joints that stand upright, their drives position servos or motors under a loop of the lab's own.

The truth is plain MuJoCo at half a millisecond.
"""

import math
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import mujoco
import numpy as np

from benchmarks.from_a_drawing.case import MORE, Case
from bumblebee.diagnosis.dataset import open_session
from bumblebee.measured.rollout import Rollout, write_rollout

_AXES = ("0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "1 0 0")
_TRUE_STEP = 5e-4
STIFF = 'solreffriction="0.004 1" solimpfriction=".999 .999 .001"'
"""Dry friction that holds: by MuJoCo's own softness a joint creeps under it."""


@dataclass(frozen=True)
class Joint:
    """A joint, its link and its drive; SI."""

    axis: str
    length: float
    mass: float
    armature: float = 0.0
    dry: float = 0.0
    viscous: float = 0.0
    kp: float = 0.0
    kd: float = 0.0
    limit: float = 0.0


@dataclass(frozen=True)
class Arm:
    """Arm that was drawn."""

    joints: tuple[Joint, ...]
    servo: bool
    """Whether drives are position servos; else motors, and the lab's own loop at the log's rate."""
    hz: float
    noise: float
    """[rad] of the encoders."""
    more: str
    late: int
    """Ticks that commands are late."""
    gain: float
    """Factor on the true gains."""
    load: float
    """[kg] at the end."""


def draw(seed: int) -> Arm:
    """An arm of 2 to 6 joints."""
    rng = np.random.default_rng([19, seed])
    count, servo = int(rng.integers(2, 7)), bool(rng.random() < 0.7)
    hz = float(rng.choice([50, 100, 200])) if servo else 500.0
    sizes = [(float(rng.uniform(0.1, 0.4)), float(rng.uniform(0.5, 5.0) * 0.7**i)) for i in range(count)]
    bare = [Joint(_AXES[i], length, mass) for i, (length, mass) in enumerate(sizes)]
    model = mujoco.MjModel.from_xml_string(xml(bare, servo))
    data, inertia = mujoco.MjData(model), np.zeros((count, count))
    data.qpos[:] = 0.7
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, inertia)
    joints = []
    for i, link in enumerate(bare):
        own = max(float(inertia[i, i]), 1e-4)
        armature = own * float(np.exp(rng.uniform(math.log(0.2), math.log(5.0))))
        whole, frequency = own + armature, 2 * math.pi * float(rng.uniform(2.5, 6.0))
        held = 9.81 * sum(j.mass * sum(k.length for k in bare[i : n + 1]) for n, j in enumerate(bare) if n >= i)
        limit = 1.5 * held + 0.5 * whole * frequency**2
        kp, kd = whole * frequency**2, 2 * float(rng.uniform(0.5, 1.0)) * whole * frequency
        dry, viscous = float(rng.uniform(0.01, 0.05)) * limit, float(rng.uniform(0.0, 0.3)) * kd
        joints.append(replace(link, armature=armature, dry=dry, viscous=viscous, kp=kp, kd=kd, limit=limit))
    more = MORE[int(rng.integers(1, 4))] if rng.random() < 0.5 else MORE[0]
    if more == "other gains" and not servo:
        more = MORE[0]  # its own loop's gains are no part of the model
    return Arm(
        tuple(joints),
        servo,
        hz,
        float(np.exp(rng.uniform(math.log(5e-5), math.log(1e-3)))),
        more,
        int(rng.integers(1, 3)) if more == "late commands" else 0,
        float(2 ** rng.uniform(-1, 1)) if more == "other gains" else 1.0,
        float(rng.uniform(0.5, 1.5)) * joints[-1].mass if more == "a load" else 0.0,
    )


def xml(joints: Sequence[Joint], servo: bool, rotors: bool = False, gain: float = 1.0, load: float = 0.0) -> str:
    """MJCF of an arm; with `rotors` the true one: armature and friction, servos of `gain` times the gains, a load."""
    bodies, drives = "", ""
    for i, j in enumerate(joints):
        own = f' armature="{j.armature}" frictionloss="{j.dry}" damping="{j.viscous}" {STIFF}' if rotors else ""
        mass = j.mass + (load if i == len(joints) - 1 else 0.0)
        place = 'pos="0 0 1"' if i == 0 else f'pos="0 0 {joints[i - 1].length}"'
        bodies += f'<body name="link{i}" {place}><joint name="joint{i}" axis="{j.axis}"{own}/>'
        bodies += (
            f'<geom type="capsule" fromto="0 0 0 0 0 {j.length}" size=".03" mass="{mass}" contype="0" conaffinity="0"/>'
        )
        limit = f'forcerange="-{j.limit or 1} {j.limit or 1}"'
        if servo:
            drives += f'<position joint="joint{i}" kp="{gain * j.kp}" kv="{j.kd}" {limit}/>'
        else:
            drives += f'<motor joint="joint{i}" {limit}/>'
    step = _TRUE_STEP if rotors else 2e-3
    return (
        f'<mujoco><option timestep="{step}" integrator="implicitfast"/><worldbody>{bodies}{"</body>" * len(joints)}'
        f"</worldbody><actuator>{drives}</actuator></mujoco>"
    )


def rollouts(arm: Arm, seed: int, count: int = 8, seconds: float = 8.0) -> list[Rollout]:
    """Rollouts that the true arm's logger writes."""
    rng, joints = np.random.default_rng([20, seed]), len(arm.joints)
    model = mujoco.MjModel.from_xml_string(xml(arm.joints, arm.servo, True, arm.gain, arm.load))
    kp, kd = np.array([j.kp for j in arm.joints]), np.array([j.kd for j in arm.joints])
    ticks, steps = round(seconds * arm.hz), round(1 / (arm.hz * _TRUE_STEP))
    time, names, made = np.arange(ticks) / arm.hz, tuple(f"joint{i}" for i in range(joints)), []
    for number in range(count):
        frequency, phase = rng.uniform(0.1, 1.2, (2, 4, joints)) * [[[1.0]], [[6.0]]]
        amplitude = rng.uniform(0.05, 0.3, (4, joints)) / (0.5 + frequency)
        target = rng.uniform(-0.5, 0.5, joints) + np.sum(
            amplitude * np.sin(2 * np.pi * frequency * time[:, None, None] + phase), axis=1
        )
        data = mujoco.MjData(model)
        data.qpos[:] = target[0]
        position, velocity, sent = np.zeros((3, ticks, joints))
        for k in range(-round(arm.hz / 2), ticks):  # half a second to come to rest at the first target
            sent[max(k, 0)] = target[max(k, 0)]
            if not arm.servo:
                sent[max(k, 0)] = kp * (target[max(k, 0)] - data.qpos) - kd * data.qvel
            position[max(k, 0)], velocity[max(k, 0)] = data.qpos, data.qvel
            data.ctrl[:] = sent[max(k - arm.late, 0)]
            for _ in range(steps):
                mujoco.mj_step(model, data)
        position += arm.noise * rng.standard_normal(position.shape)
        velocity += 0.2 * arm.noise * arm.hz * rng.standard_normal(velocity.shape)
        command = {"joint_target" if arm.servo else "joint_torque_cmd": sent}
        made.append(Rollout(f"run{number}", names, arm.hz, time, position, velocity, **command))
    return made


def case(seed: int) -> Case:
    """One arm with its logs."""
    arm = draw(seed)
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        (folder / "rollouts").mkdir()
        (folder / "model.xml").write_text(xml(arm.joints, arm.servo))
        for rollout in rollouts(arm, seed):
            write_rollout(folder / "rollouts" / f"{rollout.rollout_id}.parquet", rollout)
        session = open_session(folder / "model.xml", folder)
    sizes = {
        "armature": {f"joint{i}": j.armature for i, j in enumerate(arm.joints)},
        "coulomb_friction": {f"joint{i}": j.dry for i, j in enumerate(arm.joints)},
    }
    row = {"robot": "arm", "joints": len(arm.joints), "servo": arm.servo, "hz": arm.hz, "noise": arm.noise}
    return Case(session, sizes, row | {"more": arm.more})
