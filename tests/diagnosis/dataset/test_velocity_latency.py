"""Velocities that are logged late: their age is found on each joint, and none is found where they are in step."""

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.dataset.session import make_session, open_session
from bumblebee.diagnosis.dataset.velocity_latency import age_note, in_step, velocity_ages, with_known_velocities
from bumblebee.diagnosis.replay import replay as errors
from bumblebee.diagnosis.thresholds.dataset import VelocityLatency
from bumblebee.measured.rollout import Rollout, write_rollout
from tests.diagnosis import arm, cart

RULE = VelocityLatency()
FREQUENCIES = np.array([0.4, 0.9, 1.7])


def log(seed: int, hz: float, ages: tuple[float, ...], jitter: float = 0.0, step: float = 0.0) -> Rollout:
    """20 s of sines on every joint, each velocity `ages` [s] old; positions in steps of `step` [rad]."""
    rng = np.random.default_rng(seed)
    time = cart.stamps(hz, 20.0, jitter, rng)
    size, phase = rng.uniform(0.1, 0.4, (3, len(ages))), rng.uniform(0, 6.28, (3, len(ages)))
    turn = 2 * np.pi * FREQUENCIES[:, None]
    angle = turn * time[:, None, None] + phase
    place = (size * np.sin(angle)).sum(axis=1) + 1e-4 * rng.standard_normal((len(time), len(ages)))
    speed = (size * turn * np.cos(angle - turn * np.array(ages))).sum(axis=1)
    place = np.round(place / step) * step if step else place
    speed = speed + 0.02 * rng.standard_normal(speed.shape)
    return Rollout(f"r{seed}", tuple(f"j{k}" for k in range(len(ages))), hz, time, place, speed, joint_torque_cmd=place)


@pytest.mark.parametrize(("hz", "jitter"), [(50.0, 0.0), (500.0, 0.3)])
def test_the_age_of_each_joint_is_found_and_taken_out(hz: float, jitter: float) -> None:
    """One is a whole period of the slow log old; one is in step."""
    ages = (0.019, 0.004 if hz > 50 else 0.017, 0.0)
    logs = [log(seed, hz, ages, jitter, step=0.0015) for seed in range(3)]
    found = velocity_ages(logs, RULE)
    np.testing.assert_allclose(found, ages, atol=6e-4)
    assert found[2] == 0
    after = [in_step(one, found) for one in logs]
    assert all(one.frames < was.frames for one, was in zip(after, logs, strict=True))
    np.testing.assert_allclose(velocity_ages(after, RULE), 0.0, atol=5e-4)
    assert age_note(logs[0].joints, found).count("ms") == 2


def test_logs_of_targets_are_left_as_they_are() -> None:
    logs = [log(seed, 50.0, (0.019, 0.017, 0.0)) for seed in range(3)]
    aimed = [replace(one, joint_torque_cmd=None, joint_target=one.joint_pos) for one in logs]
    assert velocity_ages(logs, RULE).any() and not velocity_ages(aimed, RULE).any()


def test_velocities_in_step_stay_as_logged() -> None:
    logs = [log(seed, 100.0, (0.0, 0.0)) for seed in range(3)]
    assert not velocity_ages(logs, RULE).any()
    assert in_step(logs[0], velocity_ages(logs, RULE)) is logs[0]
    assert age_note(logs[0].joints, np.zeros(2)) == ""


@pytest.mark.parametrize("age", [0.07, 0.18, 0.29])
@pytest.mark.parametrize("count", [1, 3])
def test_velocities_too_old_to_be_read_at_once_are_replaced_by_differences_of_the_positions(
    age: float, count: int
) -> None:
    logs = [log(seed, 100.0, (age, 0.0)) for seed in range(count)]
    found = velocity_ages(logs, RULE)
    np.testing.assert_allclose(found, (age, 0.0), atol=1e-3)
    made, (note,) = with_known_velocities(logs, RULE)
    np.testing.assert_allclose(made[0].joint_vel[:, 0], np.gradient(logs[0].joint_pos[:, 0], logs[0].time))
    np.testing.assert_array_equal(made[0].joint_vel[:, 1], logs[0].joint_vel[:, 1])
    assert f"too old to be used; differences of the positions take their place: j0 {1e3 * age:.0f}" in note


def test_a_right_model_with_velocities_of_180_ms_comes_near_the_noise() -> None:
    logs = cart.record(count=3, hz=250.0, seconds=6.0)
    old = [replace(one, joint_vel=_delayed(one, 0.18)) for one in logs]
    made = make_session(mujoco.MjSpec.from_string(cart.xml()), old, "cart", "memory")
    assert any("too old to be used" in note and "cart 180" in note for note in made.notes)
    assert errors(made, budget=20)["0.2"]["joint_pos_rmse"]["value"] < 0.01  # 0.57 with the velocities as logged


def test_no_check_judges_by_velocities_that_are_too_old(tmp_path: Path) -> None:
    """With velocities of another time the response seems to oppose the command, and the recording is set aside."""
    logs = arm.simulate({}, count=4, seconds=6.0, seed=2)
    for one in logs:
        old = replace(one, joint_vel=_delayed(one, 0.18))
        write_rollout(tmp_path / "set" / "rollouts" / f"{one.rollout_id}.parquet", old)
    (tmp_path / "model.xml").write_text(arm.XML)
    session = open_session(tmp_path / "model.xml", tmp_path / "set")
    assert len(session.rollouts) == 4
    assert sum("too old to be used" in note for note in session.notes) == 1


def _delayed(one: Rollout, age: float) -> np.ndarray:
    return np.stack([np.interp(one.time - age, one.time, v) for v in one.joint_vel.T], axis=1)


@pytest.mark.parametrize("step", [0.0005, 0.001])
def test_half_a_step_of_a_simulation_is_no_age(step: float) -> None:
    """Positions moved by the new velocities lie half a step off; so do simulated logs, which are in step."""
    rng = np.random.default_rng(0)
    fine = np.arange(round(20 / step)) * step
    turn, phase = 2 * np.pi * FREQUENCIES, rng.uniform(0, 6.28, 3)
    speed = (0.2 * turn * np.cos(turn * fine[:, None] + phase)).sum(axis=1)
    place = np.cumsum(speed) * step
    every = round(0.01 / step)
    one = Rollout("a", ("j",), 100.0, fine[::every], place[::every, None], speed[::every, None],
                  joint_torque_cmd=place[::every, None])  # fmt: skip
    assert not velocity_ages([one, one, one], RULE).any()


def test_short_or_still_logs_say_nothing() -> None:
    short = log(0, 50.0, (0.02,))
    few = replace(short, **{k: getattr(short, k)[:30] for k in ("time", "joint_pos", "joint_vel", "joint_torque_cmd")})
    assert not velocity_ages([few], RULE).any()
    still = replace(short, joint_pos=np.zeros_like(short.joint_pos), joint_vel=np.zeros_like(short.joint_vel))
    assert not velocity_ages([still, still, still], RULE).any()


def test_a_right_model_with_late_velocities_comes_near_the_noise() -> None:
    """The session moves filtered velocities by the mean age of the filter, 4.2 ms, and half a step; and says so."""
    logs = cart.record(count=3, hz=250.0, seconds=6.0)
    late = [replace(one, joint_vel=_filtered(one, 0.006)) for one in logs]

    def after(rollouts: list[Rollout]) -> tuple[float, list[str]]:
        made = make_session(mujoco.MjSpec.from_string(cart.xml()), rollouts, "cart", "memory")
        return errors(made, budget=20)["0.2"]["joint_pos_rmse"]["value"], made.notes

    right, notes = after(logs)
    assert not any("older" in note for note in notes)
    moved, notes = after(late)
    assert any("lag the positions" in note and "cart 4.4 ms" in note for note in notes)
    assert moved < 2 * right  # 13 mrad as logged, 1.4 with velocities in step


def _filtered(one: Rollout, constant: float) -> np.ndarray:
    """Velocities through a first-order filter; their mean age is period * (1 - share) / share."""
    out = one.joint_vel.copy()
    for k in range(1, len(out)):
        share = 1 - np.exp(-(one.time[k] - one.time[k - 1]) / constant)
        out[k] = out[k - 1] + share * (one.joint_vel[k] - out[k - 1])
    return out


@pytest.mark.parametrize("integrator", ["Euler", "implicitfast"])
def test_half_a_step_of_a_simulator_is_no_age(integrator: str) -> None:
    """Positions that are moved by the new velocities are half a step ahead; without noise that is significant."""
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><option timestep="0.001" integrator="{integrator}"/><worldbody><body><joint name="j" axis="0 1 0"
        damping=".01" armature=".002"/><inertial pos="0 0 .1" mass=".5" diaginertia=".01 .01 .01"/></body></worldbody>
        <actuator><motor joint="j"/></actuator></mujoco>"""
    )
    data, logs, time = mujoco.MjData(model), [], np.arange(1500) / 100.0
    for seed in range(3):
        mujoco.mj_resetData(model, data)
        phases = np.random.default_rng(seed).uniform(0, 6, 3)
        told = (0.4 * np.sin(np.array([3, 7, 11]) * time[:, None] + phases)).sum(axis=1)
        rows = []
        for torque in told:
            rows.append((data.qpos[0], data.qvel[0], torque - data.qpos[0] - 0.3 * data.qvel[0]))
            data.ctrl[0] = rows[-1][2]
            mujoco.mj_step(model, data, 10)
        q, v, u = np.array(rows).T[..., None]
        logs.append(Rollout(f"r{seed}", ("j",), 100.0, time, q, v, joint_torque_cmd=u))
    assert not velocity_ages(logs, RULE).any()
    assert velocity_ages(logs, replace(RULE, least=3e-4)).any()
