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
    """A first-order lag of one joint's target."""

    def drive(told: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        out = told.copy()
        for k in range(1, len(told)):
            out[k, joint] = out[k - 1, joint] + (told[k - 1, joint] - out[k - 1, joint]) * 0.001 / time
        return out

    return drive


def limited(joint: int, rate: float) -> Drive:
    """A set-point that follows the target by at most `rate` [rad/s]."""

    def drive(told: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        out = told.copy()
        for k in range(1, len(told)):
            away = told[k - 1, joint] - out[k - 1, joint]
            out[k, joint] = out[k - 1, joint] + np.clip(away, -0.001 * rate, 0.001 * rate)
        return out

    return drive


def profiled(joint: int, acceleration: float, speed: float) -> Drive:
    """A set-point that speeds up and slows down by `acceleration` [rad/s^2] and goes at most at `speed` [rad/s].

    As a drive's firmware does it: every millisecond it takes the speed from which it could just stop at the target.
    """

    def drive(told: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        out, now = told.copy(), 0.0
        for k in range(1, len(told)):
            away = told[k - 1, joint] - out[k - 1, joint]
            wanted = np.sign(away) * min(speed, np.sqrt(2 * acceleration * abs(away)))
            now += np.clip(wanted - now, -0.001 * acceleration, 0.001 * acceleration)
            out[k, joint] = out[k - 1, joint] + 0.001 * now
            if abs(away) < 1e-5 and abs(now) < 2e-3 * acceleration:
                out[k, joint], now = told[k - 1, joint], 0.0
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
