"""A three-joint arm whose truth is computed apart from the product: 1 ms steps, its own servo, its own effects.

And what every test of a room does first with rollouts, whatever robot made them: `session_of`, `problem_of`.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import mujoco
import numpy as np

from bumblebee.diagnosis.config import DiagnosisConfig
from bumblebee.diagnosis.dataset import Session, make_session
from bumblebee.diagnosis.residuals import Problem, make_problem
from bumblebee.diagnosis.simulation import choose_starts, cut
from bumblebee.diagnosis.thresholds.dataset import DatasetThresholds, TimeSteps
from bumblebee.measured.rollout import Rollout
from bumblebee.sim.effects import Effect

SMALL = DiagnosisConfig(
    max_windows=22, max_holdout_windows=12, max_long_windows=6, report_windows=6, grow=False
)  # fmt: skip
SEARCHED_COARSELY = DatasetThresholds(time_steps=TimeSteps(small_model=0))
"""The search at steps of 2 ms, as for larger robots, at half the cost; the last fit and the document at 1 ms."""
JOINTS = ("j1", "j2", "j3")
XML = """<mujoco model="arm"><compiler angle="radian"/><option timestep="0.005" integrator="implicitfast"/><worldbody>
<body name="l1" pos="0 0 1"><joint name="j1" axis="0 0 1" armature="0.01"/>
<inertial pos="0.02 0 .1" mass="1.2" diaginertia=".01 .01 .006"/>
<body name="l2" pos="0 0 .2"><joint name="j2" axis="0 1 0" armature="0.01"/>
<inertial pos="0 0 .15" mass="1" diaginertia=".009 .009 .002"/>
<body name="l3" pos="0 0 .3"><joint name="j3" axis="0 1 0" armature="0.006"/>
<inertial pos="0.01 0.02 .12" mass=".7" diaginertia=".005 .005 .001"/></body></body></body></worldbody>
<actuator><position name="j1" joint="j1" kp="40" kv="3" forcerange="-40 40"/>
<position name="j2" joint="j2" kp="60" kv="4" forcerange="-40 40"/>
<position name="j3" joint="j3" kp="30" kv="2" forcerange="-20 20"/></actuator></mujoco>"""


def session_of(rollouts: list[Rollout], xml: str = XML, thresholds: DatasetThresholds = SEARCHED_COARSELY) -> Session:
    """The rollouts matched with the declared model `xml`, the arm's if none is given."""
    return make_session(mujoco.MjSpec.from_string(xml), rollouts, "declared", "memory", thresholds=thresholds)


def problem_of(
    session: Session,
    ids: Sequence[int],
    budget: int,
    effects: Sequence[Effect] = (),
    seed: int = 0,
    seconds: float = 0.2,
) -> Problem:
    """The whitened residuals of at most `budget` windows of `seconds` out of the rollouts `ids`."""
    starts = choose_starts(session.rollouts, ids, seconds, budget)
    windows = cut(session.plant, session.layout, session.rollouts, starts)
    rng = np.random.default_rng(seed)
    return make_problem(session.plant, session.layout, windows, session.sigma, session.steps, effects, rng)


def simulate(
    effects: dict[tuple[str, str], float],
    count: int = 3,
    seconds: float = 4.0,
    seed: int = 0,
    still: int | None = None,
    gains: tuple[float, float] | None = None,
    xml: str = XML,
    passive: Callable[[np.ndarray, np.ndarray], np.ndarray] | None = None,
) -> list[Rollout]:
    """Rollouts at 50 Hz of the arm with `effects` {(id, place): value}; joint `still` is neither moved nor free.

    `xml` is the true arm where it is not the declared one; `passive` a torque (3,) more, by q and v (3,).
    With `gains`, factors of kp and kd, the servos have these times their declared ones, and the metadata say so.
    """
    rng = np.random.default_rng(seed)
    model = mujoco.MjModel.from_xml_string(xml)
    kp, kd = model.actuator_gainprm[:, 0].copy(), -model.actuator_biasprm[:, 2]
    kp, kd = (kp, kd) if gains is None else (gains[0] * kp, gains[1] * kd)
    limit = model.actuator_forcerange[:, 1].copy()
    model.opt.timestep, model.opt.integrator = 0.001, mujoco.mjtIntegrator.mjINT_EULER
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
    table = {kind: np.full(3, start) for kind, start in _NEUTRAL.items()}
    for (kind, place), value in effects.items():
        if kind == "link_mass":
            model.body_mass[model.body(place).id] = value
        elif kind == "torque_limit":
            limit[JOINTS.index(place)] = value
        elif kind == "armature":
            model.dof_armature[JOINTS.index(place)] = value
        else:
            table[kind][JOINTS.index(place)] = value
    mujoco.mj_setConst(model, mujoco.MjData(model))
    made = [_rollout(model, kp, kd, limit, table, seconds, rng, f"r{i:02d}", still, passive) for i in range(count)]
    return made if gains is None else [replace(r, meta={"kp": kp.tolist(), "kd": kd.tolist()}) for r in made]


_NEUTRAL = {
    "coulomb_friction": 0.0,
    "viscous_friction": 0.0,
    "motor_strength": 1.0,
    "command_delay": 0.0,
    "encoder_offset": 0.0,
    "spring": 0.0,
}


def _rollout(model, kp, kd, limit, table, seconds, rng, name, still, passive) -> Rollout:
    data, ticks = mujoco.MjData(model), round(seconds * 50)
    time = np.arange(ticks) / 50
    amp, freq, phase = rng.uniform(0.2, 0.6, (3, 3)), rng.uniform(0.2, 1.5, (3, 3)), rng.uniform(0, 6.28, (3, 3))
    target = (amp * np.sin(2 * np.pi * freq * time[:, None, None] + phase)).sum(axis=1)
    data.qpos[:] = rng.uniform(-0.3, 0.3, 3)
    if still is not None:
        target[:, still] = data.qpos[still] = 0.0
    position, velocity = [], []
    for tick in range(ticks):
        position.append(data.qpos + table["encoder_offset"])
        velocity.append(data.qvel.copy())
        for cycle in range(20):
            sent = np.clip(np.floor((tick / 50 + cycle / 1000 - table["command_delay"]) * 50 + 1e-9), 0, None)
            wanted = target[sent.astype(int), np.arange(3)]
            error = wanted - data.qpos - table["encoder_offset"]
            torque = np.clip(table["motor_strength"] * (kp * error - kd * data.qvel), -limit, limit)
            torque -= table["viscous_friction"] * data.qvel + table["coulomb_friction"] * np.tanh(data.qvel / 0.002)
            data.qfrc_applied[:] = torque + table["spring"] * np.sin(8 * data.qpos)
            if passive is not None:
                data.qfrc_applied[:] += passive(data.qpos, data.qvel)
            if still is not None:
                data.qvel[still] = data.qfrc_applied[still] = 0.0
                data.qpos[still] = 0.0
            mujoco.mj_step(model, data)
    noisy_q = np.array(position) + 5e-4 * rng.standard_normal((ticks, 3))
    noisy_v = np.array(velocity) + 0.02 * rng.standard_normal((ticks, 3))
    if still is not None:
        noisy_q[:, still] -= np.array(position)[:, still]
        noisy_v[:, still] -= np.array(velocity)[:, still]
    return Rollout(name, JOINTS, 50.0, time + 3.0, noisy_q, noisy_v, joint_target=target)
