"""A hinge with effects in the simulator, and the same equation integrated in NumPy.

One hinge about y with inertia INERTIA + MASS ARM^2, a position servo, steps of 1 ms; NumPy takes steps of 0.1 ms.
"""

from collections.abc import Callable

import mujoco
import numpy as np
from mujoco.batch import Batch

from bumblebee.sim.effects import Effect, StepHooks, add_to_spec, runtime_hooks

INERTIA, KP, KD, MASS, ARM, LIMIT = 0.05, 20.0, 1.0, 0.8, 0.3, 15.0
TOTAL = INERTIA + MASS * ARM**2
FINE = 1e-4


def model_with(
    *effects: Effect, gravity: float = 0.0, kp: float = KP, kd: float = KD, degrees: bool = False
) -> mujoco.MjModel:
    """The hinge with the effects, through XML and back."""
    unit = "degree" if degrees else "radian"
    text = f"""<mujoco><compiler angle="{unit}"/><option timestep="0.001" gravity="0 0 {-gravity}"/>
    <worldbody><body name="link"><joint name="j" axis="0 1 0" armature="{INERTIA}"/>
    <inertial pos="{ARM} 0 0" mass="{MASS}" diaginertia="1e-6 1e-6 1e-6"/></body></worldbody><actuator>
    <position name="j" joint="j" kp="{kp}" kv="{kd}" forcerange="-{LIMIT} {LIMIT}"/></actuator>
    <keyframe><key name="up" qpos="0.1"/></keyframe></mujoco>"""
    spec = mujoco.MjSpec.from_string(text)
    add_to_spec(spec, effects)
    spec.compile()
    return mujoco.MjModel.from_xml_string(spec.to_xml())


def path(
    effects: list[Effect], target: Callable[[float], float], seconds: float = 0.4, speed: float = 0.0, **options: float
) -> np.ndarray:
    """Positions of the encoder's joint (T, 2) with velocities, one a millisecond, with hooks running."""
    model = model_with(*effects, **options)
    batch = Batch(model, 1, 1)
    batch.qvel[0, 0] = speed
    hooks = StepHooks(runtime_hooks(effects, model), model, batch)
    hooks.reset(np.array([0]))
    out = []
    for k in range(round(seconds * 1000)):
        batch.ctrl[0, 0] = target(k * 0.001)
        hooks.apply()
        batch.step()
        out.append((batch.qpos[0, 0], batch.qvel[0, 0]))
    return np.array(out)


def reference(
    torque: Callable[[float, float, float], float], seconds: float = 0.4, speed: float = 0.0, inertia: float = TOTAL
) -> np.ndarray:
    """Integrate by semi-implicit Euler in fine steps; `torque(t, q, v)` is all that acts."""
    q, v, out = 0.0, speed, []
    every = round(0.001 / FINE)
    for k in range(round(seconds / FINE)):
        v += FINE * torque(k * FINE, q, v) / inertia
        q += FINE * v
        if (k + 1) % every == 0:
            out.append((q, v))
    return np.array(out)


def close(mine: np.ndarray, plain: np.ndarray, other: np.ndarray, without: np.ndarray, share: float = 0.06) -> None:
    """The effect changes something, and both simulations by the same, to a share of the change."""
    change = other - without
    size = np.abs(change).max(axis=0)
    assert (size > [2e-3, 2e-2]).all()
    assert (np.abs(mine - plain - change).max(axis=0) < share * size).all()


def check(effects: list[Effect], other: np.ndarray, share: float = 0.06, target: Callable | None = None) -> None:
    """A path with hooks against a reference, both less their own without the effect."""
    target = target or swing
    plain, without = both(target)
    close(path(effects, target), plain, other, without, share)


def swing(t: float) -> float:
    return 0.5 * np.sin(2 * np.pi * 3 * t)


def servo(t: float, q: float, v: float) -> float:
    return float(np.clip(KP * (swing(t) - q) - KD * v, -LIMIT, LIMIT))


def both(target: Callable[[float], float] = swing) -> tuple[np.ndarray, np.ndarray]:
    """The servo without an effect, in MuJoCo and in NumPy."""
    torque = lambda t, q, v: float(np.clip(KP * (target(t) - q) - KD * v, -LIMIT, LIMIT))  # noqa: E731
    return path([], target), reference(torque)


def sign(v: float) -> float:
    return float(np.tanh(v / 1e-3))
