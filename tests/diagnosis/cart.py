"""A cart on a spring with a pendulum: one slide, one hinge; truth computed apart from the product, at any rate."""

import mujoco
import numpy as np

from bumblebee.diagnosis.dataset import Session
from bumblebee.diagnosis.thresholds.dataset import DatasetThresholds
from bumblebee.measured.rollout import Rollout
from tests.diagnosis.arm import session_of

JOINTS = ("cart", "pole")
KP, KD = (300.0, 12.0), (20.0, 1.0)  # N/m and N m/rad, N s/m and N m s/rad
_STEP = 0.0005  # [s] at most
BODIES = """<mujoco model="cart"><compiler angle="radian"/><option timestep="0.002" integrator="implicitfast"/>
<worldbody>
<body name="cart"><joint name="cart" type="slide" axis="1 0 0" stiffness="40" damping="2"/>
<inertial pos="0 0 0" mass="2" diaginertia=".02 .02 .02"/>
<body name="pole"><joint name="pole" axis="0 1 0" damping="0.02"/>
<inertial pos="0 0 -.25" mass=".6" diaginertia=".01 .01 .001"/></body></body></worldbody><actuator>"""
ACTUATORS = {
    "motor": '<motor name="cart" joint="cart" gear="5" ctrlrange="-60 60"/><motor name="pole" joint="pole" gear="2"/>',
    "position": '<position name="cart" joint="cart" kp="300" kv="20" ctrlrange="-1 1"/>'
    '<position name="pole" joint="pole" kp="12" kv="1" forcerange="-6 6"/>',
    "dcmotor": '<dcmotor name="cart" joint="cart" motorconst="2" resistance=".5"/>'
    '<dcmotor name="pole" joint="pole" motorconst=".1" resistance="1"/>',
    "dcmotor_servo": '<dcmotor name="cart" joint="cart" motorconst="2" resistance=".5" input="pos" '
    'controller="300 0 20"/><position name="pole" joint="pole" kp="12" kv="1"/>',
}


def xml(actuators: str = "motor") -> str:
    """The declared model with one of the kinds of `ACTUATORS`."""
    return f"{BODIES}{ACTUATORS[actuators]}</actuator></mujoco>"


def session(rollouts: list[Rollout], actuators: str = "motor") -> Session:
    """The rollouts matched with the declared model; searched at 1 ms, as a small robot is."""
    return session_of(rollouts, xml(actuators), DatasetThresholds())


def stamps(hz: float, seconds: float, jitter: float, rng: np.random.Generator) -> np.ndarray:
    """Time stamps (T,) [s] whose periods vary by the share `jitter`."""
    periods = (1 + jitter * rng.uniform(-1, 1, round(hz * seconds))) / hz
    return 7.0 + np.concatenate(([0.0], np.cumsum(periods)))


def record(
    count: int = 3,
    hz: float = 50.0,
    seconds: float = 4.0,
    torque: bool = True,
    jitter: float = 0.0,
    friction: tuple[float, float] = (0.0, 0.0),
    latency: float = 0.0,
    reported: bool = False,
    cubic: float = 0.0,
    drag: float = 0.0,
    seed: int = 0,
) -> list[Rollout]:
    """Rollouts under multisine commands.

    Args:
        count: how many.
        hz: rate of the log.
        seconds: length.
        torque: torques are commanded (and logged), else position targets of a servo with `KP`, `KD`.
        jitter: share by which periods vary.
        friction: dry friction of cart [N] and pole [N m].
        latency: the logger's states are this old [s].
        reported: the drive's torque is logged too.
        cubic: stiffness of a spring on the pole that the model lacks and no catalogue names, -k q^3 [N m/rad^3].
        drag: of the pole, -c v abs(v) [N m s^2/rad^2]; the catalogue's nearest name is viscous friction.
        seed: of commands and noise.
    """
    rng = np.random.default_rng(seed)
    model = mujoco.MjModel.from_xml_string(f"{BODIES}</actuator></mujoco>")
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_EULER
    given = dict(locals())
    return [_one(model, f"r{i:02d}", given) for i in range(count)]


def _one(model: mujoco.MjModel, name: str, given: dict) -> Rollout:
    rng, torque = given["rng"], given["torque"]
    data, time = mujoco.MjData(model), stamps(given["hz"], given["seconds"], given["jitter"], given["rng"])
    amp, freq, phase = rng.uniform(0.3, 1.0, (4, 2)), rng.uniform(0.3, 2.0, (4, 2)), rng.uniform(0, 6.28, (4, 2))
    size = np.array([12.0, 0.8]) if torque else np.array([0.12, 0.35])
    command = size * (amp * np.sin(2 * np.pi * freq * time[:, None, None] + phase)).sum(axis=1)
    data.qpos[:] = 0.1 * rng.standard_normal(2)
    states, torques, at = [], [], []
    for k in range(len(time)):
        count = int(np.ceil((time[k] - time[k - 1]) / _STEP)) if k else 0
        for n in range(count):
            model.opt.timestep = (time[k] - time[k - 1]) / count
            data.qfrc_applied[:] = _force(data, command[k - 1], given)
            mujoco.mj_step(model, data)
            at.append(time[k - 1] + (n + 1) * model.opt.timestep)
            states.append(np.concatenate((data.qpos, data.qvel)))
        torques.append(_drive(data, command[k], torque))
    grid = np.array([np.interp(time - given["latency"], at, np.array(states)[:, c]) for c in range(4)]).T
    keep = time > time[0] + 0.2  # the first states stand before the log
    noise = rng.standard_normal(grid.shape) * [3e-4, 3e-4, 0.01, 0.01]
    grid = grid + noise
    columns = {"joint_torque_cmd": command} if torque else {"joint_target": command}
    if given["reported"]:
        columns["joint_torque"] = np.array(torques) + 0.01 * rng.standard_normal((len(time), 2))
    columns = {key: value[keep] for key, value in columns.items()}
    return Rollout(name, JOINTS, float(given["hz"]), time[keep], grid[keep, :2], grid[keep, 2:], **columns)


def _drive(data: mujoco.MjData, command: np.ndarray, torque: bool) -> np.ndarray:
    return command if torque else np.array(KP) * (command - data.qpos) - np.array(KD) * data.qvel


def _force(data: mujoco.MjData, command: np.ndarray, given: dict) -> np.ndarray:
    force = _drive(data, command, given["torque"])
    force = force - np.array(given["friction"]) * np.tanh(data.qvel / 0.002)
    force[1] -= given["cubic"] * data.qpos[1] ** 3 + given["drag"] * data.qvel[1] * abs(data.qvel[1])
    return force
