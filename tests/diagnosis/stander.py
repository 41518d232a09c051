"""A body that stands on four balls on a floor and swings an arm; truth at 1 ms by Euler steps, its states kept."""

import mujoco
import numpy as np

from bumblebee.measured.rollout import Rollout

XML = """<mujoco model="stander"><compiler angle="radian"/>
<option timestep="0.005" integrator="implicitfast"/><worldbody>
<geom name="floor" type="plane" size="5 5 .1"/>
<body name="trunk" pos="0 0 .2"><freejoint/>
<inertial pos="0 0 0" mass="6" diaginertia=".06 .06 .08"/>
<geom type="sphere" size=".02" pos=".12 .1 -.18"/><geom type="sphere" size=".02" pos=".12 -.1 -.18"/>
<geom type="sphere" size=".02" pos="-.12 .1 -.18"/><geom type="sphere" size=".02" pos="-.12 -.1 -.18"/>
<body name="arm" pos="0 0 .1"><joint name="swing" axis="0 1 0" armature=".01"/>
<inertial pos="0 0 .2" mass="1.5" diaginertia=".02 .02 .002"/></body></body></worldbody>
<actuator><position name="swing" joint="swing" kp="40" kv="2" forcerange="-40 40"/></actuator></mujoco>"""
NOISE = {"q": 5e-4, "v": 0.02, "quat": 0.002, "gyro": 0.01, "odometry": 0.02, "place": 0.001}


def simulate(
    mass: float = 1.5, count: int = 2, seconds: float = 4.0, seed: int = 0, xml: str = XML
) -> tuple[list[Rollout], np.ndarray]:
    """Rollouts at 50 Hz of the stander whose arm weighs `mass` [kg], and the true heights (count, T) [m]."""
    rng = np.random.default_rng(seed)
    model = mujoco.MjModel.from_xml_string(xml)
    model.opt.timestep, model.opt.integrator = 0.001, int(mujoco.mjtIntegrator.mjINT_EULER)
    model.body_mass[model.body("arm").id] = mass
    mujoco.mj_setConst(model, mujoco.MjData(model))
    made = [_rollout(model, seconds, rng, f"r{i:02d}") for i in range(count)]
    return [m[0] for m in made], np.stack([m[1] for m in made])


def _rollout(model: mujoco.MjModel, seconds: float, rng: np.random.Generator, name: str) -> tuple[Rollout, np.ndarray]:
    data, ticks = mujoco.MjData(model), round(seconds * 50)
    time = np.arange(ticks) / 50
    amp, rate, phase = rng.uniform(0.1, 0.3, 3), rng.uniform(0.3, 1.5, 3), rng.uniform(0, 6.28, 3)
    target = (amp * np.sin(2 * np.pi * rate * time[:, None] + phase)).sum(axis=1)[:, None]
    mujoco.mj_step(model, data, 300)
    qpos, qvel = [], []
    for tick in range(ticks):
        qpos.append(data.qpos.copy())
        qvel.append(data.qvel.copy())
        data.ctrl[:] = target[tick]
        mujoco.mj_step(model, data, 20)
    q, v = np.array(qpos), np.array(qvel)
    noise = {n: s * rng.standard_normal((ticks, 1 if n in "qv" else 3)) for n, s in NOISE.items()}
    quat, base = np.empty((ticks, 4)), np.empty((ticks, 3))
    turn, back = np.empty(4), np.empty(4)
    for k in range(ticks):
        mujoco.mju_axisAngle2Quat(
            turn, noise["quat"][k] / np.linalg.norm(noise["quat"][k]), np.linalg.norm(noise["quat"][k])
        )
        mujoco.mju_mulQuat(quat[k], q[k, 3:7], turn)
        mujoco.mju_negQuat(back, q[k, 3:7])
        mujoco.mju_rotVecQuat(base[k], v[k, :3], back)
    rollout = Rollout(
        name, ("swing",), 50.0, time + 1.0, q[:, 7:] + noise["q"], v[:, 6:] + noise["v"], joint_target=target,
        base_pos=q[:, :3] + noise["place"], base_quat=quat, base_ang_vel=v[:, 3:6] + noise["gyro"],
        base_lin_vel=base + noise["odometry"],
    )  # fmt: skip
    return rollout, q[:, 2]
