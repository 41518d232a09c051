"""A motor's cogging behind a gear, of any number of periods in a turn of the joint, by slow logs and by fast ones."""

from dataclasses import replace
from functools import cache, partial

import numpy as np
import pytest

from bumblebee.diagnosis.config import DiagnosisConfig
from bumblebee.diagnosis.diagnose import diagnose
from bumblebee.diagnosis.selection.proposals.torque_ripple import KIND, promising, ripple_trials
from bumblebee.diagnosis.selection.state import SearchState
from bumblebee.diagnosis.selection.steps import go
from bumblebee.diagnosis.thresholds.dataset import DatasetThresholds
from bumblebee.measured.rollout import Rollout
from tests.diagnosis import arm
from tests.diagnosis.selection.test_swap import begun
from tests.diagnosis.strange_arm import simulate

GEAR, SLOTS, SIZE, PHASE = 30.25, 7, 0.2, 0.6  # ratio, periods in a turn of the motor, [N m] and [rad] at the joint
INERTIA, KP, KD = 0.05, 20.0, 1.0  # [kg m^2, N m/rad, N m s/rad]
XML = f"""<mujoco><option timestep="0.002" gravity="0 0 0"/><worldbody><body name="wheel">
<joint name="wheel" axis="0 0 1"/><inertial pos="0 0 0" mass="1" diaginertia=".03 .03 {INERTIA}"/></body></worldbody>
<actuator><position joint="wheel" kp="{KP}" kv="{KD}"/></actuator></mujoco>"""
CONFIG = DiagnosisConfig(max_windows=50, max_holdout_windows=25, max_long_windows=6, report_windows=6, grow=False)


def turned(size: float, hz: int, seed: int) -> Rollout:
    """4 s of a wheel on a motor that cogs by `size` [N m] at the joint; integrated in NumPy at 0.25 ms."""
    rng = np.random.default_rng(seed)
    time, dt, cycles = np.arange(4 * hz) / hz, 2.5e-4, round(4000 / hz)
    wide, pace, phase = rng.uniform(0.2, 0.6, 3), rng.uniform(0.2, 1.2, 3), rng.uniform(0, 6, 3)
    target = (wide * np.sin(2 * np.pi * pace * time[:, None] + phase)).sum(axis=1)
    states, (q, v) = np.empty((len(time), 2)), (target[0], 0.0)
    for k, wanted in enumerate(target):
        states[k] = q, v
        for _ in range(cycles):
            motor = GEAR * q
            v += dt * (KP * (wanted - q) - KD * v + size * np.sin(SLOTS * motor + PHASE)) / INERTIA
            q += dt * v
    states += rng.standard_normal(states.shape) * (2e-4, 1e-2)
    return Rollout(f"r{seed}", ("wheel",), float(hz), time, states[:, :1], states[:, 1:], joint_target=target[:, None])


def found(rollouts: list[Rollout]) -> dict:
    return diagnose(arm.session_of(rollouts, XML, DatasetThresholds()), replace(CONFIG, beyond=False)).document


@pytest.mark.parametrize("hz", [50, pytest.param(1000, marks=pytest.mark.slow)])
def test_a_geared_motors_cogging_is_named_with_its_periods_whatever_the_logs_rate(hz: int) -> None:
    """At 50 Hz the joint passes up to three waves between two readings."""
    rollouts = [turned(SIZE, hz, seed) for seed in range(4)]
    most = max(np.abs(r.joint_vel).max() for r in rollouts) * GEAR * SLOTS / (2 * np.pi)  # waves a second
    assert hz == 1000 or most > 2 * 25
    (entry,) = found(rollouts)["effects"]
    assert (entry["effect"], entry["where"]) == ("cogging", ["wheel"])
    low, high = entry["parameters"]["periods"]["ci95"]
    assert low < GEAR * SLOTS < high < low + 2.0
    size = np.hypot(entry["parameters"]["sine"]["value"], entry["parameters"]["cosine"]["value"])
    assert size == pytest.approx(SIZE, rel=0.1)


def test_a_geared_motor_that_does_not_cog_lacks_nothing() -> None:
    assert found([turned(0.0, 50, seed) for seed in range(4)])["effects"] == []


@cache
def cogging(periods: float) -> SearchState:
    """A search at its beginning on an arm that cogs; who asks its joints clears what was asked."""
    return begun(arm.XML, simulate({("cogging", "j1"): (0.3, 0.2, periods)}, seed=5), {})


@pytest.mark.parametrize("periods", [60.5, 151.3])
def test_the_highest_peak_of_the_joint_that_cogs_is_there_and_no_other_joint_has_one(periods: float) -> None:
    run = cogging(periods)
    like = {c.where: c for c in run.candidates if c.effect == KIND}
    (best, steps, _), *_ = promising(run, like["j1"])
    assert best.step[2] == pytest.approx(periods, abs=0.5)
    assert steps * best.step[:2] == pytest.approx([0.3, 0.2], rel=0.3)
    assert promising(run, like["j2"]) == []


def test_a_joint_is_asked_once_and_one_that_is_not_off_never() -> None:
    run = cogging(151.3)
    run.hopeless.clear()
    assert [t.candidate.where for t in go(run, ripple_trials)] == ["j1"]
    assert go(run, ripple_trials) == []
    assert go(begun(arm.XML, simulate({}, seed=5), {}), ripple_trials) == []


def test_a_ripple_that_is_faint_beside_what_was_tried_waits() -> None:
    run = cogging(151.3)
    run.hopeless.clear()
    (trial,) = go(run, ripple_trials)
    run.hopeless.clear()
    much = replace(trial, cost=run.fit.cost - 100.0 * (run.fit.cost - trial.cost))
    assert go(run, partial(ripple_trials, tried=[much])) == [] and not run.hopeless
    assert [t.candidate.where for t in go(run, partial(ripple_trials, tried=[trial]))] == ["j1"]
