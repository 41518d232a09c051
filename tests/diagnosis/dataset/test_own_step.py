"""Logs of a simulation of the declared model itself: its own steps, and no fit across a step of a stiff servo."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.dataset import Session, make_session
from bumblebee.diagnosis.gap import gap
from bumblebee.diagnosis.thresholds.dataset import DatasetThresholds
from bumblebee.measured.rollout import Rollout
from tests.diagnosis.arm import SMALL

XML = """<mujoco><compiler angle="radian"/><option timestep="0.002"/><worldbody><body pos="0 0 1">
<joint name="shoulder" axis="0 1 0" armature=".01" damping=".1"/>
<geom type="capsule" fromto="0 0 0 .3 0 0" size=".03" mass="1" contype="0" conaffinity="0"/>
<body pos=".3 0 0"><joint name="elbow" axis="0 1 0" armature=".01" damping=".1"/>
<geom type="capsule" fromto="0 0 0 .25 0 0" size=".025" mass=".6" contype="0" conaffinity="0"/>
</body></body></worldbody><actuator><position joint="shoulder" kp="200" kv="4"/>
<position joint="elbow" kp="200" kv="4"/></actuator></mujoco>"""
NOISE = 1e-4, 2e-3


def logged(hz: int, step: float = 0.002, friction: float = 0.0, noise: tuple[float, float] = NOISE) -> list[Rollout]:
    """The declared arm in steps of `step` s, its targets steps every half second; `friction` is in no declaration."""
    model = mujoco.MjModel.from_xml_string(XML)
    model.opt.timestep, model.dof_frictionloss[:] = step, friction
    out = []
    for seed in range(3):
        rng, data, time = np.random.default_rng(seed), mujoco.MjData(model), np.arange(4 * hz) / hz
        target = np.repeat(rng.uniform(-0.6, 0.6, (8, 2)), hz // 2, axis=0)
        states = []
        for wanted in target:
            states.append((data.qpos.copy(), data.qvel.copy()))
            data.ctrl[:] = wanted
            mujoco.mj_step(model, data, round(1 / hz / step))
        read = np.array(states) + np.array(noise)[:, None] * rng.standard_normal((len(time), 2, 2))
        out.append(Rollout(f"r{seed}", ("shoulder", "elbow"), float(hz), time, read[:, 0], read[:, 1], target))
    return out


def opened(rollouts: list[Rollout]) -> Session:
    return make_session(mujoco.MjSpec.from_string(XML), rollouts, "arm", "memory")


@pytest.mark.parametrize("hz", [100, 500])
def test_logs_of_the_declared_model_itself_are_near_their_noise(hz: int) -> None:
    """In steps of a millisecond they were ten times their noise off, and smoothed across the steps a hundred times."""
    session = opened(logged(hz))
    assert session.steps[0] == pytest.approx(0.002) and any("own time steps of 2 ms" in n for n in session.notes)
    document = gap(session, 60, SMALL).document
    assert not any(entry["significant"] for entry in document["missing_torque"].values())
    for horizon in ("0.2", "1.0"):
        error, floor = (document[which][horizon]["joint_pos_rmse"]["value"] for which in ("error", "floor"))
        assert error < 3 * floor


@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_a_robot_s_logs_are_simulated_in_short_steps(friction: float) -> None:
    """A truth of finer steps says nothing for the model's own, whether or not the model lacks something."""
    session = opened(logged(100, 0.00025, friction))
    assert session.steps[0] == pytest.approx(0.001) and not any("own time steps" in n for n in session.notes)


def test_a_reading_at_a_step_of_a_servo_stays_as_it_is() -> None:
    """A cubic over twenty milliseconds is no motion of a servo that answers in ten."""
    read, true = logged(500), logged(500, noise=(0.0, 0.0))
    session = opened(read)
    off = np.abs(session.rollouts[0].joint_pos - true[0].joint_pos)
    assert off.max() < 8 * NOISE[0] and np.median(off) < 0.5 * NOISE[0]
    rules = DatasetThresholds()
    everywhere = replace(rules, smoothing=replace(rules.smoothing, bent=np.inf))
    bent = make_session(mujoco.MjSpec.from_string(XML), read, "arm", "memory", thresholds=everywhere)
    assert np.abs(bent.rollouts[0].joint_pos - true[0].joint_pos).max() > 20 * NOISE[0]
