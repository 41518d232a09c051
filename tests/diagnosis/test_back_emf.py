"""A motor whose back-EMF takes its torque at speed: the supply leaves less of it, at each voltage another share."""

from dataclasses import replace

import numpy as np
import pytest

from bumblebee.diagnosis.config import DiagnosisConfig
from bumblebee.diagnosis.diagnose import diagnose
from bumblebee.diagnosis.thresholds.dataset import DatasetThresholds
from bumblebee.measured.rollout import Rollout
from tests.diagnosis import arm

INERTIA, KP, KD = 0.05, 20.0, 0.6  # [kg m^2, N m/rad, N m s/rad]
STALL, FREE, VOLTS = 3.0, 6.0, 12.0  # [N m] and no-load speed [rad/s], both at the nominal voltage [V]
XML = f"""<mujoco><custom><numeric name="nominal_voltage" data="{VOLTS}"/></custom>
<option timestep="0.002" gravity="0 0 0"/><worldbody><body name="wheel"><joint name="wheel" axis="0 0 1"/>
<inertial pos="0 0 0" mass="1" diaginertia=".03 .03 {INERTIA}"/></body></worldbody>
<actuator><position joint="wheel" kp="{KP}" kv="{KD}" forcerange="-{STALL} {STALL}"/></actuator></mujoco>"""
CONFIG = DiagnosisConfig(max_windows=50, max_holdout_windows=25, max_long_windows=6, report_windows=6, grow=False)


def driven(volts: float, free: float, seed: int) -> Rollout:
    """4 s at 50 Hz of a wheel on a DC motor, in NumPy at 0.25 ms: the drive sets a voltage for the torque it wants.

    The motor is one whose winding takes `VOLTS` at the stall torque and gives them back at the speed `free` [rad/s].
    """
    rng = np.random.default_rng(seed)
    time, dt = np.arange(200) / 50, 2.5e-4
    wide, pace, phase = rng.uniform(0.3, 0.8, 3), rng.uniform(0.3, 1.4, 3), rng.uniform(0, 6, 3)
    target = (wide * np.sin(2 * np.pi * pace * time[:, None] + phase)).sum(axis=1)
    states, (q, v) = np.empty((len(time), 2)), (target[0], 0.0)
    for k, wanted in enumerate(target):
        states[k] = q, v
        for _ in range(80):
            back = VOLTS * v / free  # [V] induced
            across = np.clip((KP * (wanted - q) - KD * v) * VOLTS / STALL + back, -volts, volts) - back
            v += dt * np.clip(across / VOLTS, -1.0, 1.0) * STALL / INERTIA
            q += dt * v
    states += rng.standard_normal(states.shape) * (2e-4, 1e-2)
    meta = {"conditions": {"supply_voltage": volts}}
    series = {"joint_pos": states[:, :1], "joint_vel": states[:, 1:], "joint_target": target[:, None]}
    return Rollout(f"v{volts:g}s{seed}", ("wheel",), 50.0, time, **series, meta=meta)


def found(free: float) -> list[dict]:
    rollouts = [driven(volts, free, seed) for seed, volts in enumerate([VOLTS, 9.0] * 3)]
    session = arm.session_of(rollouts, XML, DatasetThresholds())
    return diagnose(session, replace(CONFIG, beyond=False)).document["effects"]


@pytest.mark.slow
def test_back_emf_is_named_by_the_no_load_speed_at_the_nominal_voltage_from_runs_at_two() -> None:
    (entry,) = found(FREE)
    assert (entry["effect"], entry["where"]) == ("torque_speed_limit", ["wheel"])
    speed = entry["parameters"]["speed"]
    assert speed["value"] == pytest.approx(FREE, rel=0.05)
    assert speed["ci95"][0] < FREE < speed["ci95"][1]


def test_a_motor_whose_supply_is_far_above_its_back_emf_lacks_nothing() -> None:
    assert found(1e4) == []
