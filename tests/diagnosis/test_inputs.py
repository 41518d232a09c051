"""Logs of every kind: torques, any actuator, slides, uneven and fast stamps, gaps, reported torque."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.config import DiagnosisConfig
from bumblebee.diagnosis.dataset.smoothing import smooth_rollouts
from bumblebee.diagnosis.diagnose import diagnose
from bumblebee.diagnosis.gap.reported_torque import reported_torque
from bumblebee.diagnosis.replay import replay
from bumblebee.diagnosis.report.notes import latency_notes
from bumblebee.diagnosis.simulation.actuators import drive_law
from bumblebee.diagnosis.simulation.windows import choose_starts, cut
from bumblebee.diagnosis.thresholds.dataset import Smoothing
from bumblebee.diagnosis.thresholds.simulation import DriveProbe
from bumblebee.errors import BadInput
from bumblebee.measured.rollout import Rollout
from tests.diagnosis import cart
from tests.diagnosis.cart import session

SMALL = DiagnosisConfig(max_windows=30, max_holdout_windows=15, report_windows=6, grow=False, beyond=False)


def chi2(rollouts: list[Rollout], actuators: str = "motor") -> float:
    return replay(session(rollouts, actuators), budget=20)["0.2"]["chi2"]["value"]


@pytest.fixture(scope="module")
def torques() -> list[Rollout]:
    return cart.record(count=2)


@pytest.mark.parametrize("actuators", ["motor", "position", "dcmotor"])
def test_commanded_torques_act_alike_through_any_actuator(torques: list[Rollout], actuators: str) -> None:
    """Gears, position limits and a motor's back-EMF have no part in a torque that the drive was told to give."""
    assert 0.4 < chi2(torques, actuators) < 1.5
    assert chi2(torques, actuators) == pytest.approx(chi2(torques, "motor"), rel=1e-6)


def test_targets_act_alike_through_a_servo_a_dcmotor_and_logged_gains() -> None:
    rollouts = cart.record(count=2, torque=False)
    wanted = chi2(rollouts, "position")
    assert wanted < 2
    assert chi2(rollouts, "dcmotor_servo") == pytest.approx(wanted, rel=0.05)
    gains = {"kp": list(cart.KP), "kd": list(cart.KD)}
    assert chi2([replace(r, meta=gains) for r in rollouts], "motor") == pytest.approx(wanted, rel=0.05)


def test_targets_for_motors_of_unknown_gains_are_refused() -> None:
    with pytest.raises(BadInput, match="kp and kd"):
        session(cart.record(count=1, torque=False), "motor")


def test_actuators_of_several_inputs_are_refused() -> None:
    text = cart.xml("dcmotor_servo").replace('input="pos"', 'input="pos ff"')
    with pytest.raises(BadInput, match="one input"):
        drive_law(mujoco.MjModel.from_xml_string(text), "cart.xml", DriveProbe())


@pytest.mark.parametrize(("hz", "jitter", "most"), [(50.0, 0.3, 2.0), (500.0, 0.3, 2.0), (1000.0, 0.0, 12.0)])
def test_a_right_model_is_at_the_noise_at_any_rate(hz: float, jitter: float, most: float) -> None:
    """Smoothed over 20 ticks, at 1 kHz, the noise that is left is less than what two integrators differ by."""
    assert 0.4 < chi2(cart.record(count=2, hz=hz, jitter=jitter, seconds=2.0)) < most


@pytest.mark.parametrize("jitter", [0.0, 0.3])
def test_noise_is_read_off_even_and_uneven_logs_alike(jitter: float) -> None:
    made = session(cart.record(count=2, jitter=jitter, seconds=6.0))
    np.testing.assert_allclose(made.sigma, [3e-4, 3e-4, 0.01, 0.01], rtol=0.35)


def test_windows_last_as_long_as_asked_whatever_the_rate() -> None:
    rollouts = [cart.record(count=1, hz=hz, jitter=0.2, seconds=2.0)[0] for hz in (50.0, 200.0, 500.0)]
    made = session(rollouts)
    starts = choose_starts(rollouts, range(3), 0.2, 1000)
    windows = cut(made.plant, made.layout, rollouts, starts)
    assert set(windows.rollout) == {0, 1, 2}
    np.testing.assert_allclose(windows.out_time[:, -1], 0.2, atol=0.016)
    assert (np.diff(windows.out_time, axis=1) > 0.01).all()


def test_no_window_crosses_a_gap(torques: list[Rollout]) -> None:
    log = torques[0]
    late = replace(log, time=np.where(np.arange(log.frames) < 70, log.time, log.time + 0.5))
    for _, first, last in choose_starts([late], [0], 0.2, 1000):
        assert last < 70 or first >= 70
    assert len(choose_starts([late], [0], 0.2, 1000)) >= len(choose_starts([log], [0], 0.2, 1000)) - 2


def test_smoothing_leaves_the_noise_that_it_says() -> None:
    rng = np.random.default_rng(0)
    time = np.cumsum(rng.uniform(0.7, 1.3, 2000)) * 0.002
    place, speed = np.sin(9 * time)[:, None], 9 * np.cos(9 * time)[:, None]
    noisy = Rollout("a", ("j",), 500.0, time, place + 1e-3 * rng.standard_normal(place.shape),
                    speed + 0.07 * rng.standard_normal(speed.shape), joint_target=place)  # fmt: skip
    slow = replace(noisy, **{k: getattr(noisy, k)[::10] for k in ("time", "joint_pos", "joint_vel", "joint_target")})
    layout = session(cart.record(count=1)).layout.__class__({"joint_pos": slice(0, 1), "joint_vel": slice(1, 2)}, 2)
    (out,), sigma, count = smooth_rollouts([noisy], layout, np.array([1e-3, 0.07]), Smoothing())
    inner = slice(10, -10)
    assert count == 1 and sigma[1] < 0.035
    assert (out.joint_pos - place)[inner].std() == pytest.approx(sigma[0], rel=0.2)
    assert (out.joint_vel - speed)[inner].std() == pytest.approx(sigma[1], rel=0.2)
    (same,), sigma, count = smooth_rollouts([slow], layout, np.array([1e-3, 0.07]), Smoothing())
    assert count == 0 and same is slow and sigma.tolist() == [1e-3, 0.07]


@pytest.mark.parametrize(
    ("friction", "where"),
    [pytest.param((3.0, 0.0), "cart", marks=pytest.mark.slow), ((0.0, 0.15), "pole")],
    ids=["slide", "hinge"],
)
def test_friction_is_found_in_uneven_fast_torque_driven_logs(friction: tuple[float, float], where: str) -> None:
    """A slide's friction in N, a hinge's in N m, at 300 Hz with a third of jitter and the drive's torque beside it."""
    rollouts = cart.record(count=3, hz=300.0, jitter=0.3, seconds=3.0, friction=friction, reported=True)
    found = diagnose(session(rollouts), SMALL).document
    assert [(e["effect"], e["where"]) for e in found["effects"]] == [("coulomb_friction", [where])]
    value = found["effects"][0]["parameters"]["frictionloss"]["value"]
    assert value == pytest.approx(max(friction), rel=0.1)


def test_a_drives_own_torque_says_its_gain_and_delay() -> None:
    """Reported torque that is 0.8 of the declared servo's and two ticks late."""
    rollouts = cart.record(count=2, hz=200.0, torque=False, seconds=3.0)
    made = session(rollouts, "position")
    kp, kd = np.array(cart.KP), np.array(cart.KD)
    said = []
    for r in rollouts:
        torque = kp * (r.joint_target - r.joint_pos) - kd * r.joint_vel
        said.append(replace(r, joint_torque=0.8 * np.concatenate((torque[:2], torque[:-2]))))
    for entry in reported_torque(made.plant, said).values():
        assert entry["gain"] == pytest.approx(0.8, rel=0.02)
        assert entry["delay"] == pytest.approx(0.01, abs=1e-6)
    assert reported_torque(made.plant, rollouts) == {}


def test_a_logger_that_is_late_is_named_as_one_class_with_a_robot_that_is() -> None:
    """States 15 ms old come out as a delay of all joints, and the note says what else it may be."""
    rollouts = cart.record(count=3, latency=0.015, seconds=5.0)
    found = diagnose(session(rollouts), SMALL).document
    delays = [e for e in found["effects"] if e["effect"] == "command_delay"]
    assert {name for e in delays for name in e["where"] or cart.JOINTS} == set(cart.JOINTS)
    assert any("15" in note and "logger" in note for note in found["notes"])
    assert latency_notes([e for e in delays if e["where"] == ["cart"]], cart.JOINTS) == []
