"""An arm with any effect of the catalogue, by equations of its own: 1 ms steps, explicit servo.

Effects are {(id, place): parameters in the catalogue's order}; "" is the whole arm. `gravity` [m/s^2] is the arm's own.
"""

import mujoco
import numpy as np

from bumblebee.measured.rollout import Rollout
from tests.diagnosis.arm import JOINTS, XML

Truth = dict[tuple[str, str], tuple[float, ...]]
_STICK = 0.002  # [rad/s]


def simulate(effects: Truth, count: int = 4, seconds: float = 4.0, seed: int = 0, noise: float = 1.0) -> list[Rollout]:
    """Rollouts at 50 Hz; encoder noise 0.5 mrad and 0.02 rad/s times `noise`."""
    rng = np.random.default_rng(seed)
    return [_rollout(effects, seconds, rng, f"r{i:02d}", noise) for i in range(count)]


def _model(effects: Truth) -> mujoco.MjModel:
    text = XML
    for (kind, place), values in effects.items():
        if kind in ("backlash", "series_elasticity"):
            start = text.index(f'<joint name="{place}"')
            end = text.index("/>", start) + 2
            axis = text[text.index('axis="', start) : end].split('"')[1]
            if kind == "backlash":
                more = f'range="{-values[0] / 2} {values[0] / 2}" limited="true" solreflimit="0.003 1" armature="2e-5"'
            else:
                more = f'stiffness="{values[0]}" damping="{1e-3 * values[0]}" armature="2e-5"'
            text = text[:end] + f'<joint name="{place}_second" axis="{axis}" {more}/>' + text[end:]
    model = mujoco.MjModel.from_xml_string(text)
    for (kind, place), values in effects.items():
        if kind == "link_com":
            model.body_ipos[model.body(place).id] = values
        elif kind == "link_inertia":
            model.body_inertia[model.body(place).id] = values
        elif kind == "link_mass":
            model.body_mass[model.body(place).id] = values[0]
        elif kind == "ground_slope":
            x, y = values
            model.opt.gravity[:] = 9.81 * np.array([-np.sin(y), np.sin(x), -np.cos(x) * np.cos(y)])
        elif kind == "gravity":  # where it points, whatever is declared
            model.opt.gravity[:] = values
    model.opt.timestep, model.opt.integrator = 0.001, mujoco.mjtIntegrator.mjINT_EULER
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
    mujoco.mj_setConst(model, mujoco.MjData(model))
    return model


class _Drives:
    """Servos of the three joints and everything that is wrong with them."""

    def __init__(self, effects: Truth, model: mujoco.MjModel) -> None:
        self.e = effects
        self.kp, self.kd = model.actuator_gainprm[:, 0].copy(), -model.actuator_biasprm[:, 2]
        self.limit = model.actuator_forcerange[:, 1].copy()
        self.heat, self.lagged, self.centre = np.zeros(3), None, None
        self.known: dict[tuple[str, int], np.ndarray] = {}
        self.past: list[tuple[np.ndarray, np.ndarray]] = []

    def get(self, kind: str, index: int = 0, neutral: float = 0.0) -> np.ndarray:
        """A parameter on the three joints."""
        if (kind, index) not in self.known:
            self.known[kind, index] = self._look_up(kind, index, neutral)
        return self.known[kind, index]

    def _look_up(self, kind: str, index: int, neutral: float) -> np.ndarray:
        out = np.full(3, neutral)
        for (name, place), values in self.e.items():
            if name == kind and index < len(values):
                out[[JOINTS.index(place)] if place else slice(None)] = values[index]
        return out

    def reading(self) -> tuple[np.ndarray, np.ndarray]:
        """Readings of the encoders now."""
        back = np.round(self.get("encoder_delay") * 1000).astype(int)
        q, v = self.past[-1]
        if back.any():
            old = [self.past[max(0, len(self.past) - 1 - b)] for b in back]
            q, v = (np.array([pair[i][j] for j, pair in enumerate(old)]) for i in (0, 1))
        return q + self.get("encoder_offset"), v

    def torque(self, t: float, target: np.ndarray, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        strength = self.get("motor_strength", neutral=1.0)
        strength = strength - self.get("strength_drift") * t - self.get("thermal_fade") * self.heat
        seen_q, seen_v = self.reading()
        kp, kd = self.kp * self.get("kp", neutral=1.0), self.kd * self.get("kd", neutral=1.0)
        force = strength * (kp * (target - seen_q) - kd * seen_v)
        limit = np.minimum(self.limit, self.get("torque_limit", neutral=np.inf))
        left = limit * np.clip(1 - np.abs(v) / self.get("torque_speed_limit", neutral=np.inf), 0, 1)
        force = np.where(force * v > 0, np.clip(force, -left, left), np.clip(force, -limit, limit))
        self.heat += 0.001 * (force / self.limit) ** 2
        time = self.get("torque_lag")
        self.lagged = force if self.lagged is None else self.lagged
        self.lagged = self.lagged + (force - self.lagged) * np.where(time > 0, 1 - np.exp(-0.001 / (time + 1e-9)), 1)
        return self.lagged + self.passive(q, v, force)

    def passive(self, q: np.ndarray, v: np.ndarray, force: np.ndarray) -> np.ndarray:
        fall = np.exp(-((v / self.get("stribeck_friction", 1, 1.0)) ** 2))
        dry = self.get("coulomb_friction") + self.get("stribeck_friction") * fall
        way = np.where(v > 0, 0.5, -0.5) * self.get("load_dependent_friction", 1)
        dry = dry + (self.get("load_dependent_friction") + way) * np.abs(force)
        out = -dry * np.tanh(v / _STICK) - self.get("viscous_friction") * v - self.get("asymmetric_friction") / 2
        out += self.get("joint_spring", 1) - self.get("joint_spring") * q
        angle = self.get("cogging", 2) * q
        out += self.get("cogging") * np.sin(angle) + self.get("cogging", 1) * np.cos(angle)
        width = self.get("hysteresis", 1, 1.0)
        self.centre = q.copy() if self.centre is None else np.clip(self.centre, q - width, q + width)
        return out - self.get("hysteresis") * (q - self.centre) / width


def _rollout(effects: Truth, seconds: float, rng: np.random.Generator, name: str, noise: float) -> Rollout:
    model = _model(effects)
    data, drives, ticks = mujoco.MjData(model), _Drives(effects, model), round(seconds * 50)
    at = np.array([model.jnt_qposadr[model.joint(j).id] for j in JOINTS])
    time = np.arange(ticks) / 50
    amp, freq, phase = rng.uniform(0.2, 0.6, (3, 3)), rng.uniform(0.2, 1.5, (3, 3)), rng.uniform(0, 6.28, (3, 3))
    target = (amp * np.sin(2 * np.pi * freq * time[:, None, None] + phase)).sum(axis=1)
    data.qpos[at] = rng.uniform(-0.3, 0.3, 3)
    drives.past.append((data.qpos[at].copy(), data.qvel[at].copy()))
    kept = np.where(rng.random(ticks) < drives.get("dropped_commands")[0], 0, np.arange(ticks))
    arrived = np.maximum.accumulate(kept)
    position, velocity = [], []
    for tick in range(ticks):
        q, v = drives.reading()
        position.append(q)
        velocity.append(v)
        for cycle in range(20):
            late = np.floor((tick / 50 + cycle / 1000 - drives.get("command_delay")) * 50 + 1e-9)
            wanted = target[arrived[np.clip(late, 0, None).astype(int)], np.arange(3)]
            data.qfrc_applied[:] = 0.0
            now = tick / 50 + cycle / 1000
            data.qfrc_applied[at] = drives.torque(now, wanted, data.qpos[at].copy(), data.qvel[at].copy())
            for (kind, place), values in effects.items():
                if kind == "external_wrench":
                    data.xfrc_applied[model.body(place).id] = values
            mujoco.mj_step(model, data)
            drives.past.append((data.qpos[at].copy(), data.qvel[at].copy()))
    noisy_q = np.array(position) + noise * 5e-4 * rng.standard_normal((ticks, 3))
    noisy_v = np.array(velocity) + noise * 0.02 * rng.standard_normal((ticks, 3))
    return Rollout(name, JOINTS, 50.0, time + 3.0, noisy_q, noisy_v, joint_target=target)
