"""A servo with a pendulum, recorded under several conditions; its truth is computed apart from the product.

One hinge: I q'' = clip(strength (kp (target - q) - kd q'), limit) - viscous q' - dry sgn(q') - m g l sin q, in steps of
0.5 ms. A load is a point mass below the axis.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bumblebee.measured.rollout import Rollout

MASS, ARM, ROTOR, GRAVITY = 0.5, 0.1, 0.004, 9.81  # [kg], [m], [kg m^2], [m/s^2]
KP, KD, LIMIT = 1.0, 0.04, 1.5  # declared; [N m/rad], [N m s/rad], [N m]
SERVO = f'<position name="servo" joint="hip" kp="{KP}" kv="{KD}" forcerange="-{LIMIT} {LIMIT}"/>'
MOTOR = f'<motor name="servo" joint="hip" forcerange="-{LIMIT} {LIMIT}" forcelimited="true"/>'
NOISE = (5e-4, 0.01)  # [rad], [rad/s]
_STEP = 5e-4  # [s]


def xml(drive: str = SERVO, custom: str = "") -> str:
    """The declared model."""
    return f"""<mujoco model="servo"><compiler angle="radian"/><option timestep="0.002" integrator="implicitfast"/>
<custom>{custom}</custom><worldbody><body name="link"><joint name="hip" axis="0 1 0" armature="{ROTOR}"/>
<inertial pos="0 0 -{ARM}" mass="{MASS}" diaginertia="1e-6 1e-6 1e-6"/></body></worldbody>
<actuator>{drive}</actuator></mujoco>"""


@dataclass(frozen=True)
class Truth:
    """Effects that the servo has and the model lacks."""

    viscous: float = 0.0
    """[N m s/rad]"""
    dry: float = 0.0
    """[N m]"""
    strength: float = 1.0
    kd: float = 1.0
    """Factor."""
    rotor: float = ROTOR
    """[kg m^2]"""


@dataclass(frozen=True)
class Setting:
    """Setting of one rollout."""

    kp: float = KP
    kd: float = KD
    load: float = 0.0
    """[kg]"""
    at: float = 2 * ARM
    """Place of the load below the axis [m]."""
    supply: float = 1.0
    """Share of the torque limit."""
    stated: bool = True
    """Whether the metadata say so."""

    def meta(self) -> dict:
        """Metadata of the rollout."""
        if not self.stated:
            return {}
        loads = [{"body": "link", "kg": self.load, "position": [0.0, 0.0, -self.at]}] if self.load else []
        conditions = {"added_mass": loads} if loads else {}
        conditions |= {"supply_voltage": 12.0 * self.supply} if self.supply != 1 else {}
        return {"kp": [self.kp], "kd": [self.kd]} | ({"conditions": conditions} if conditions else {})


def record(
    settings: Sequence[Setting], truth: Truth | None = None, each: int = 2, seconds: float = 6.0, seed: int = 0
) -> list[Rollout]:
    """`each` rollouts at 100 Hz under every setting, of other targets each."""
    rng, truth = np.random.default_rng(seed), truth or Truth()
    every = [s for s in settings for _ in range(each)]
    time = np.arange(round(100 * seconds)) / 100
    amplitude, frequency, phase = (rng.uniform(*ends, (4, len(every))) for ends in ((0.1, 0.5), (0.2, 2.0), (0, 6.28)))
    target = (amplitude * np.sin(2 * np.pi * frequency * time[:, None, None] + phase)).sum(axis=1)
    q, v = _course(every, truth, target)
    q, v = (x + sigma * rng.standard_normal(x.shape) for x, sigma in zip((q, v), NOISE, strict=True))
    return [
        Rollout(f"r{k:02d}", ("hip",), 100.0, time, q[:, [k]], v[:, [k]], joint_target=target[:, [k]], meta=s.meta())
        for k, s in enumerate(every)
    ]


def _course(every: Sequence[Setting], truth: Truth, target: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions and velocities (T, R) at the ticks; all rollouts at once."""
    kp, kd, load, at, supply = (np.array([getattr(s, n) for s in every]) for n in ("kp", "kd", "load", "at", "supply"))
    inertia = truth.rotor + 1e-6 + MASS * ARM**2 + load * at**2
    weight, limit = GRAVITY * (MASS * ARM + load * at), LIMIT * supply
    q, v, places, speeds = np.zeros(len(every)), np.zeros(len(every)), [], []
    for wanted in target:
        places.append(q.copy())
        speeds.append(v.copy())
        for _ in range(round(0.01 / _STEP)):
            torque = np.clip(truth.strength * (kp * (wanted - q) - truth.kd * kd * v), -limit, limit)
            torque = torque - weight * np.sin(q) - truth.viscous * v
            v = v + _STEP / inertia * torque
            dry = _STEP / inertia * truth.dry
            v = np.sign(v) * np.maximum(np.abs(v) - dry, 0.0)  # it stops and does not turn round
            q = q + _STEP * v
    return np.array(places), np.array(speeds)
