"""The arm of `arm.py` whose drives make something of their targets; the truth at 1 ms, apart from the product."""

from collections.abc import Callable

import mujoco
import numpy as np

from bumblebee.measured.rollout import Rollout
from tests.diagnosis import arm

Drive = Callable[[np.ndarray, np.random.Generator], np.ndarray]
"""Targets as the drives get them, (K, 3) one a millisecond and held over each control period -> what they follow."""
TICK = 20  # ms


def filtered(joint: int, time: float) -> Drive:
    """A first-order lag of one joint's target, the mean over each millisecond."""

    def drive(told: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        out, now, keep = told.copy(), told[0, joint], np.exp(-0.001 / time)
        for k, u in enumerate(told[:, joint]):
            out[k, joint] = u + (now - u) * (1 - keep) * time / 0.001
            now = u + (now - u) * keep
        return out

    return drive


def limited(joint: int, rate: float) -> Drive:
    """A set-point that follows the target by at most `rate` [rad/s], the mean over each millisecond."""

    def drive(told: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        out, now = told.copy(), told[0, joint]
        for k, u in enumerate(told[:, joint]):
            before, now = now, now + np.clip(u - now, -0.001 * rate, 0.001 * rate)
            out[k, joint] = 0.5 * (before + now)
        return out

    return drive


def profiled(joint: int, acceleration: float, speed: float) -> Drive:
    """A set-point that speeds up and slows down by `acceleration` [rad/s^2] and goes at most at `speed` [rad/s].

    As a drive's firmware does it: every twentieth of a millisecond it takes the speed from which it can just stop.
    """

    def drive(told: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        out, now, pace, dt = told.copy(), told[0, joint], 0.0, 0.001 / 20
        most = acceleration * dt
        for k, u in enumerate(told[:, joint].tolist()):
            total = 0.0
            for _ in range(20):
                away = u - now
                wanted = min(speed, np.sqrt(0.25 * most**2 + 2 * acceleration * abs(away)) - 0.5 * most)
                gain = (wanted if away > 0 else -wanted) - pace
                pace += min(max(gain, -most), most)
                now += dt * pace
                total += now
            out[k, joint] = total / 20
        return out

    return drive


def late(joint: int, delay: float) -> Drive:
    """One joint's targets arrive late."""

    def drive(told: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        out, back = told.copy(), round(1000 * delay)
        out[back:, joint], out[:back, joint] = told[: len(told) - back, joint], told[0, joint]
        return out

    return drive


def losing(joint: int | None, share: float) -> Drive:
    """Targets of one joint, or (None) of all at once, get lost; the one before goes on."""

    def drive(told: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        out, some = told.copy(), slice(None) if joint is None else joint
        for k in range(TICK, len(told), TICK):
            if rng.random() < share:
                out[k : k + TICK, some] = out[k - 1, some]
        return out

    return drive


def simulate(drive: Drive, count: int = 4, seconds: float = 4.0, seed: int = 0) -> list[Rollout]:
    """Rollouts at 50 Hz under the multisine targets of `arm.py`."""
    rng = np.random.default_rng(seed)
    model = mujoco.MjModel.from_xml_string(arm.XML)
    kp, kd = model.actuator_gainprm[:, 0].copy(), -model.actuator_biasprm[:, 2]
    limit = model.actuator_forcerange[:, 1].copy()
    model.opt.timestep, model.opt.integrator = 0.001, mujoco.mjtIntegrator.mjINT_EULER
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
    return [_rollout(model, (kp, kd, limit), drive, seconds, rng, f"r{i:02d}") for i in range(count)]


def _rollout(model, servo, drive, seconds, rng, name) -> Rollout:
    kp, kd, limit = servo
    data, ticks = mujoco.MjData(model), round(seconds * 50)
    time = np.arange(ticks) / 50
    amp, freq, phase = rng.uniform(0.2, 0.6, (3, 3)), rng.uniform(0.2, 1.5, (3, 3)), rng.uniform(0, 6.28, (3, 3))
    target = (amp * np.sin(2 * np.pi * freq * time[:, None, None] + phase)).sum(axis=1)
    wanted = drive(np.repeat(target, TICK, axis=0), rng)
    data.qpos[:] = target[0] + rng.uniform(-0.3, 0.3, 3)
    position, velocity = [], []
    for k in range(ticks * TICK):
        if k % TICK == 0:
            position.append(data.qpos.copy())
            velocity.append(data.qvel.copy())
        data.qfrc_applied[:] = np.clip(kp * (wanted[k] - data.qpos) - kd * data.qvel, -limit, limit)
        mujoco.mj_step(model, data)
    noisy_q = np.array(position) + 5e-4 * rng.standard_normal((ticks, 3))
    noisy_v = np.array(velocity) + 0.02 * rng.standard_normal((ticks, 3))
    return Rollout(name, arm.JOINTS, 50.0, time + 3.0, noisy_q, noisy_v, joint_target=target)
