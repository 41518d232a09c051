"""A path is simulated once, and what is known of one model is never told of another."""

import gc
import weakref
from dataclasses import replace

import numpy as np
import pytest

from bumblebee.diagnosis.residuals.problem import Problem
from bumblebee.diagnosis.simulation import roll as rolling
from bumblebee.diagnosis.simulation.simulate import residuals
from bumblebee.diagnosis.simulation.variation import Variation, vary
from bumblebee.sim.effects import single
from tests.diagnosis import arm
from tests.diagnosis.candidates.test_every_effect import robots

STEP = 0.005


def _left(problem: Problem, *some: Variation) -> np.ndarray:
    return residuals(problem.plant, problem.layout, problem.windows, some, STEP)


@pytest.fixture
def stepped(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """How many windows were stepped, call by call."""
    rows, real = [], rolling._stepped

    def counted(batch: object, running: object, control: np.ndarray, which: np.ndarray) -> rolling.Rolled:
        rows.append(len(which))
        return real(batch, running, control, which)  # type: ignore[arg-type]

    monkeypatch.setattr(rolling, "_stepped", counted)
    return rows


def test_the_same_again_is_not_simulated_and_anything_else_is(stepped: list[int]) -> None:
    problem, _ = robots()["arm"]
    problem = replace(problem, plant=replace(problem.plant))
    stepped.clear()
    size, windows = len(problem.windows), problem.windows
    rubs = [vary(problem.plant, [single("coulomb_friction", arm.JOINTS[0], value)]) for value in (0.1, 0.2)]
    first = _left(problem, rubs[0])
    both = _left(problem, *rubs, rubs[1])
    assert stepped == [size, size]
    assert np.array_equal(first[0], both[0]) and np.array_equal(both[1], both[2])
    assert not np.array_equal(both[0], both[1])
    late = replace(windows, out_time=windows.out_time - 0.001)
    assert not np.array_equal(_left(replace(problem, windows=late), rubs[0]), first)
    assert stepped == [size, size]
    _left(replace(problem, windows=replace(windows, command=1.01 * windows.command)), rubs[0])
    _left(replace(problem, windows=replace(windows, qvel=windows.qvel + 1e-12)), rubs[0])
    residuals(problem.plant, problem.layout, windows, [rubs[0]], 0.5 * STEP)
    assert stepped == [size] * 5


@pytest.mark.parametrize("robot", ["arm", "stander"])
def test_no_effect_is_taken_for_another(robot: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every candidate beside all others, where paths are kept, comes out as it does where none is."""
    problem, every = robots()[robot]
    some = [c for k, c in enumerate(every) if robot == "arm" or k % 20 == 0]
    made = [vary(problem.plant, [c.at(c.start)]) for c in some]
    known = [_left(problem, v) for v in made]
    assert all(np.array_equal(_left(problem, v), a, equal_nan=True) for v, a in zip(made[-3:], known[-3:], strict=True))
    monkeypatch.setattr(rolling, "_KEPT_BYTES", 0.0)
    rolling._known.clear()
    for c, v, told in zip(some, made, known, strict=True):
        assert np.array_equal(_left(problem, v), told, equal_nan=True), c


def test_a_plant_that_nobody_uses_any_more_goes_with_its_paths() -> None:
    problem, _ = robots()["arm"]
    plant = replace(problem.plant)
    _left(replace(problem, plant=plant), vary(plant, [single("coulomb_friction", arm.JOINTS[0], 0.1)]))
    assert plant in rolling._known
    gone = weakref.ref(plant)
    del plant
    gc.collect()
    assert gone() is None


def test_a_known_path_cannot_be_written_to() -> None:
    problem, _ = robots()["arm"]
    problem = replace(problem, plant=replace(problem.plant))
    _left(problem, vary(problem.plant, [single("coulomb_friction", arm.JOINTS[0], 0.1)]))
    (path,) = rolling._known[problem.plant].kept.values()
    with pytest.raises(ValueError, match="read-only"):
        path[0][:] = 0.0
