"""The true robots: apart from the diagnosis, neutral without effects, and right in the laws that they do have."""

import ast
from pathlib import Path

import numpy as np
import pytest

import benchmarks.undeclared as package
import bumblebee.stand_in.undeclared as undeclared
from benchmarks.undeclared.excite import make_plan
from benchmarks.undeclared.flight import fly, rollouts
from benchmarks.undeclared.robots import declared
from bumblebee.robot.servo_command import ServoCommand
from bumblebee.stand_in.undeclared.bodies import Slope
from bumblebee.stand_in.undeclared.friction import Armature, Coulomb, Hysteresis
from bumblebee.stand_in.undeclared.gears import Backlash, Elastic
from bumblebee.stand_in.undeclared.kinds import KINDS, Place, fits, places
from bumblebee.stand_in.undeclared.law import World
from bumblebee.stand_in.undeclared.signals import Line
from bumblebee.stand_in.undeclared.simulation import TrueRobots

ARM = declared("arm")
APART = ("robots", "excite", "flight", "resume", "restarts", "detectable", "lottery", "draw", "tracking")


def _imports(path: Path) -> set[str]:
    tree = ast.parse(path.read_text())
    found = {n.module or "" for n in ast.walk(tree) if isinstance(n, ast.ImportFrom)}
    return found | {a.name for n in ast.walk(tree) if isinstance(n, ast.Import) for a in n.names}


def test_truth_and_lottery_import_nothing_of_the_diagnosis_or_of_the_simulators_effects():
    home = Path(package.__file__).parent
    body = Path(undeclared.__file__).parent
    files = [*body.glob("*.py"), *(home / f"{name}.py" for name in APART)]
    assert len(files) > 18
    for file in files:
        for name in _imports(file):
            assert not name.startswith(("bumblebee.diagnosis", "bumblebee.sim")), (file.name, name)


def _fly(laws, seconds=0.6, count=1, seed=0):
    plan = make_plan(ARM, count, seconds, np.random.default_rng(seed))
    return fly(ARM, laws, plan, np.random.default_rng(1))


def test_same_seed_gives_the_same_flight_and_the_same_noise():
    first, second = _fly([]), _fly([])
    np.testing.assert_array_equal(first.qpos, second.qpos)
    one, two = (rollouts(ARM, first, 1.0, np.random.default_rng(3), "r") for _ in range(2))
    assert [r.rollout_id for r in one] == [] and two == []  # a second is too short to be a rollout
    longer = _fly([], seconds=1.5)
    a, b = (rollouts(ARM, longer, 2.0, np.random.default_rng(3), "r") for _ in range(2))
    np.testing.assert_array_equal(a[0].joint_vel, b[0].joint_vel)
    assert np.std(a[0].joint_vel - longer.qvel[:, 0]) == pytest.approx(0.04, rel=0.1)


@pytest.mark.parametrize("name", [n for n, k in KINDS.items() if fits(k, "arm")])
def test_every_kind_changes_the_motion_at_a_large_size_and_hardly_at_a_tiny_one(name):
    kind = KINDS[name]
    where = places(kind, ARM)[min(1, len(places(kind, ARM)) - 1)]
    null = _fly([])
    j = ARM.joints.index(where) if where in ARM.joints else 0
    peaks = (np.abs(null.torque[..., j]).max(), np.abs(null.qvel[..., j]).max())
    rate = np.abs(np.diff(null.target[..., j], axis=0)).max() * 50
    draw = {"sign": 1, "axis": 0, "number": 8, "other": ARM.joints[2]}
    place = Place(ARM, where, draw, *map(float, (*peaks, rate)))
    large = _fly([kind.make(place, kind.most(place))[0]])
    assert np.isfinite(large.qpos).all()
    moved = np.abs(large.qpos - null.qpos).max()
    assert moved > 1e-4
    tiny = max(kind.least(place), 1e-4 * kind.first(place))
    small = _fly([kind.make(place, tiny)[0]])
    assert np.abs(small.qpos - null.qpos).max() < 0.3 * moved


def test_dry_friction_holds_a_joint_that_is_pushed_less_than_its_level():
    robots = TrueRobots(ARM, [Coulomb("yaw", 2.0)], 1, np.random.default_rng(0))
    target = np.zeros((1, 5))
    robots.reset(np.zeros((1, 5)), np.zeros((1, 5)), target)
    target[0, 0] = 1.5 / ARM.kp[0]  # asks for 1.5 N m
    for _ in range(25):
        robots.step(ServoCommand(target))
    assert abs(robots.state()[0][0, 0]) < 2e-4
    target[0, 0] = 4.0 / ARM.kp[0]
    for _ in range(25):
        robots.step(ServoCommand(target))
    assert robots.state()[0][0, 0] > 0.01


@pytest.mark.parametrize("on_motor", [False, True])
def test_backlash_without_a_gap_is_the_declared_joint(on_motor):
    null, law = _fly([]), _fly([Backlash("elbow", 1e-9, on_motor)])
    assert np.abs(null.qpos - law.qpos).max() < 2e-4


def test_a_heavier_rotor_and_a_soft_shaft_on_one_joint_do_not_count_the_rotor_twice():
    laws = [Elastic("elbow", 2000.0), Armature("elbow", 0.05)]
    robots = TrueRobots(ARM, laws, 1, np.random.default_rng(0))
    left = robots.model.dof_armature[robots.model.joint("elbow").dofadr[0]]
    assert left == pytest.approx(0.005) and laws[0]._rotor == pytest.approx(0.045)


def test_hysteresis_dissipates_work_in_a_closed_cycle_and_stays_bounded():
    law = Hysteresis("yaw", 1.0)
    world = World(("yaw",), 1, 0.001, np.random.default_rng(0))
    law.start(world, np.zeros((1, 1)))
    work, largest = 0.0, 0.0
    for k in range(2000):
        world.v = np.array([[0.5 * np.sin(2 * np.pi * k / 1000)]])
        push = np.zeros((1, 1))
        law.passive(world, push)
        work, largest = work + push[0, 0] * world.v[0, 0] * 0.001, max(largest, abs(push[0, 0]))
    assert work < 0 and largest <= 1.0


@pytest.mark.parametrize("delay", [0.0, 0.0004, 0.003, 0.0075])
def test_a_delay_line_delays_a_ramp_by_its_delay(delay):
    line = Line(delay, 0.001, np.zeros(1))
    out = [float(line.push(np.array([k * 0.001]))[0]) for k in range(40)]
    assert out[-1] == pytest.approx(0.039 - delay, abs=1e-9)
    assert float(line.ahead(np.array([0.040]))[0]) == pytest.approx(0.040 - delay, abs=1e-9)


def test_a_slope_turns_gravity_and_keeps_its_size():
    model = ARM.spec.compile()
    Slope(0, 0.1).model(model)
    assert np.linalg.norm(model.opt.gravity) == pytest.approx(9.81)
    assert np.arctan2(-model.opt.gravity[0], -model.opt.gravity[2]) == pytest.approx(0.1)
