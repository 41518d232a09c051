"""A robot that is bolted down on a mount that is not level: gravity comes from another direction than is declared."""

import numpy as np
import pytest

from bumblebee.diagnosis.diagnose import diagnose
from bumblebee.diagnosis.thresholds.dataset import DatasetThresholds
from bumblebee.measured.rollout import Rollout
from tests.diagnosis import arm
from tests.diagnosis.strange_arm import simulate
from tests.diagnosis.test_catalogue import CONFIG

ON_A_WALL = arm.XML.replace("<option ", '<option gravity="-9.81 0 0" ')
MASS, REACH, INERTIA, KP, KD = 1.0, 0.2, 0.05, 15.0, 0.8  # [kg, m, kg m^2 about the hinge, N m/rad, N m s/rad]
PENDULUM = f"""<mujoco><option timestep="0.002"/><worldbody><body name="rod"><joint name="hinge" axis="0 1 0"/>
<inertial pos="0 0 {REACH}" mass="{MASS}" diaginertia="{INERTIA - MASS * REACH**2} {INERTIA - MASS * REACH**2} 0.001"/>
</body></worldbody><actuator><position joint="hinge" kp="{KP}" kv="{KD}"/></actuator></mujoco>"""


def found(rollouts: list[Rollout], xml: str = arm.XML) -> dict:
    return diagnose(arm.session_of(rollouts, xml, DatasetThresholds()), CONFIG).document


def named(document: dict) -> list[tuple[str, list[str]]]:
    return [(e["effect"], e["where"]) for e in document["effects"]]


def test_a_mount_that_is_not_level_is_named_with_both_angles() -> None:
    document = found(simulate({("ground_slope", ""): (0.05, -0.03)}, seed=3))
    assert named(document) == [("ground_slope", [])]
    turned = document["effects"][0]["parameters"]
    for axis, truth in (("x", 0.05), ("y", -0.03)):
        low, high = turned[axis]["ci95"]
        assert low < truth < high < low + 0.01
    assert "z" not in turned
    degrees = np.degrees(np.hypot(0.05, 0.03))
    (note,) = [n for n in document["notes"] if "the mount is not level" in n]
    assert float(note.split(" degrees")[0].split()[-1]) == pytest.approx(degrees, abs=0.2)


def test_it_stands_beside_an_encoder_that_is_off() -> None:
    truth = {("encoder_offset", "j3"): (0.03,), ("ground_slope", ""): (0.05, -0.03)}
    document = found(simulate(truth, seed=5))
    assert sorted(named(document)) == [("encoder_offset", ["j3"]), ("ground_slope", [])]


@pytest.mark.parametrize(
    "truth",
    [
        {("encoder_offset", "j2"): (0.03,)},
        pytest.param({("link_com", "l3"): (0.04, 0.02, 0.12)}, marks=pytest.mark.slow),
        pytest.param({("link_mass", "l3"): (0.9,)}, marks=pytest.mark.slow),
        pytest.param({("external_wrench", "l3"): (1.0, 0.5, 0.0, 0.0, 0.0, 0.0)}, marks=pytest.mark.slow),
    ],
    ids=lambda truth: next(iter(truth))[0],
)
def test_what_pulls_on_one_link_alone_is_not_called_a_tilt(truth: dict) -> None:
    (key,) = truth
    assert named(found(simulate(truth, seed=5))) == [(key[0], [key[1]])]


def test_on_a_wall_gravity_turns_about_the_axes_that_it_is_not_along() -> None:
    """By small angles y and z gravity along -x gets the parts that the cross product says."""
    y, z = 0.05, 0.03
    document = found(simulate({("gravity", ""): (-9.79, -9.81 * z, 9.81 * y)}, seed=3), ON_A_WALL)
    assert named(document) == [("ground_slope", [])]
    turned = document["effects"][0]["parameters"]
    for axis, truth in (("y", y), ("z", z)):
        low, high = turned[axis]["ci95"]
        assert low < truth < high < low + 0.02
    assert turned["x"]["value"] == 0.0


def test_an_arm_on_a_wall_that_is_level_lacks_nothing() -> None:
    assert named(found(simulate({("gravity", ""): (-9.81, 0.0, 0.0)}, seed=3), ON_A_WALL)) == []


@pytest.mark.parametrize(("tilt", "offset"), [(0.05, 0.0), (0.0, 0.05)])
def test_of_one_hinge_a_tilt_and_an_encoder_that_is_off_are_one_class(tilt: float, offset: float) -> None:
    """Nobody can tell: the servo and the log have the same reading, and gravity is off by the same angle."""
    (entry,) = found([swing(tilt, offset, seed) for seed in range(4)], PENDULUM)["effects"]
    assert entry["effect"] == "encoder_offset"  # met more often
    assert {"effect": "ground_slope", "where": []} in entry["equivalent"]
    assert "put a level on the mount, or bolt it down turned by 180 degrees" in entry["separate_by"]


def swing(tilt: float, offset: float, seed: int) -> Rollout:
    """4 s of an upright rod on a servo at 50 Hz; integrated in NumPy at 0.5 ms."""
    rng = np.random.default_rng(seed)
    time, dt = np.arange(200) / 50, 5e-4
    size, pace, phase = rng.uniform(0.2, 0.6, 3), rng.uniform(0.2, 1.5, 3), rng.uniform(0, 6, 3)
    target = (size * np.sin(2 * np.pi * pace * time[:, None] + phase)).sum(axis=1)
    states, (q, v) = np.empty((len(time), 2)), (rng.uniform(-0.3, 0.3), 0.0)
    for k, wanted in enumerate(target):
        states[k] = q + offset, v
        for _ in range(40):
            torque = KP * (wanted - q - offset) - KD * v + MASS * 9.81 * REACH * np.sin(q - tilt)
            v += dt * torque / INERTIA
            q += dt * v
    states += rng.standard_normal(states.shape) * (5e-4, 2e-2)
    return Rollout(f"r{seed}", ("hinge",), 50.0, time, states[:, :1], states[:, 1:], joint_target=target[:, None])
