"""An arm whose hand touches a table that its model lacks; the truth is a simulation of its own, with a slab."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.candidates import Candidate, all_candidates
from bumblebee.diagnosis.comparison import Holdout
from bumblebee.diagnosis.config import DiagnosisConfig
from bumblebee.diagnosis.diagnose import diagnose
from bumblebee.diagnosis.estimation import Fit, gauss_newton
from bumblebee.diagnosis.residuals import Problem, window_weights
from bumblebee.diagnosis.selection.proposals.surface_contact import is_still_confirmed, surface_trials
from bumblebee.diagnosis.simulation import choose_starts, cut, residuals, vary
from bumblebee.measured.rollout import Rollout
from bumblebee.sim.effects import single
from tests.diagnosis import arm, stander

CONFIG = DiagnosisConfig(max_windows=60, max_holdout_windows=30, report_windows=20, grow=False, beyond=False)
TOP, TIP = 1.56, (0.0, 0.0, 0.25)
KNOB = f'<geom type="sphere" size=".001" pos="{TIP[0]} {TIP[1]} {TIP[2]}" mass="0"/>'
SLAB = f'<geom type="box" size="3 3 .1" pos="0 0 {TOP - 0.1}"/>'
TRUTH = arm.XML.replace('<inertial pos="0.01 0.02 .12"', f'{KNOB}<inertial pos="0.01 0.02 .12"').replace(
    "<worldbody>", f"<worldbody>{SLAB}"
)


def tip_heights(rollouts: list[Rollout], point: tuple[float, ...] = TIP) -> np.ndarray:
    """Heights (T,) [m] of a point of the hand at all ticks."""
    model = mujoco.MjModel.from_xml_string(arm.XML)
    data, body = mujoco.MjData(model), mujoco.MjModel.from_xml_string(arm.XML).body("l3").id
    out = []
    for rollout in rollouts:
        for q in rollout.joint_pos:
            data.qpos[:] = q
            mujoco.mj_kinematics(model, data)
            out.append(data.xpos[body, 2] + data.xmat[body, 6:9] @ np.array(point))
    return np.array(out)


@pytest.fixture(scope="module")
def touching() -> list[Rollout]:
    return arm.simulate({}, count=6, seconds=8.0, seed=3, xml=TRUTH)


@pytest.fixture(scope="module")
def windows(touching: list[Rollout]) -> tuple[Problem, Fit, list[Candidate]]:
    """The windows, what the declared model leaves of them, and the candidates."""
    session = arm.session_of(touching)
    problem = arm.problem_of(session, range(4), 60)
    fit = gauss_newton(problem, (), (), window_weights(problem.residual([[]])[0]))
    return problem, fit, all_candidates(session.plant, session.rollouts, [])


def test_the_table_is_found_and_what_remains_is_noise(touching: list[Rollout]) -> None:
    low = tip_heights(touching) < TOP + 0.004
    assert 0.05 < low.mean() < 0.4  # it touches at times
    found = diagnose(arm.session_of(touching), CONFIG)
    assert [(e.effect, e.where) for e in found.effects] == [("surface_contact", ("l3",))]
    height, x, y, z, _ = found.effects[0].values()
    above = tip_heights(touching, (x, y, z)) - height
    assert np.abs(above[low]).mean() < 0.01  # [m] where the tip touches, so does the point
    (entry,) = found.document["effects"]
    assert entry["native"] and entry["parameters"]["height"]["nominal"] is None
    assert entry["parameters"]["x"]["ci95"] == [None, None]  # the data do not tell
    low, high = entry["parameters"]["height"]["ci95"]
    assert low < height < high < low + 0.02
    error = found.document["error"]["after"]["0.2"]["joint_pos_rmse"]["value"]
    assert error < 0.2 * found.document["error"]["before"]["0.2"]["joint_pos_rmse"]["value"]
    (note,) = [n for n in found.document["notes"] if "touches something level" in n]
    assert "l3" in note and "r00" in note


def test_without_a_table_and_on_a_body_where_one_was_refused_none_is_tried(
    windows: tuple[Problem, Fit, list[Candidate]],
) -> None:
    problem, fit, candidates = windows
    weights = window_weights(fit.residual)
    (trial,) = surface_trials(problem, fit, candidates, weights)
    assert trial.candidate.where == "l3" and trial.cost < 0.5 * fit.cost
    refused = [replace(trial.candidate, step=(0.1, 0, 0, 0, -0.5))]
    assert all(t.candidate.where != "l3" for t in surface_trials(problem, fit, candidates, weights, refused))
    free = arm.session_of(arm.simulate({}, count=2, seconds=8.0, seed=3))
    other = arm.problem_of(free, range(2), 60)
    weights = window_weights(other.residual([[]])[0])
    nothing = gauss_newton(other, (), (), weights)
    assert not surface_trials(other, nothing, all_candidates(free.plant, free.rollouts, []), weights)


def test_a_chosen_contact_is_asked_again_after_1_s(
    touching: list[Rollout], windows: tuple[Problem, Fit, list[Candidate]]
) -> None:
    """At its height it stays; too high, or where the later windows are of an arm without a table, it does not."""
    problem, fit, candidates = windows
    hand = next(c for c in candidates if c.effect == "surface_contact" and c.where == "l3")
    weights = window_weights(fit.residual)

    def confirmed(height: float, rollouts: list[Rollout]) -> bool:
        starts = choose_starts(rollouts, range(len(rollouts)), 1.0, 60)
        later = cut(problem.plant, problem.layout, rollouts, starts, outputs=1)
        chosen = gauss_newton(problem, (hand,), np.array([height, *TIP, 0.5]), weights, iterations=0)
        return is_still_confirmed(problem, chosen, hand, Holdout(None, later, later))

    assert confirmed(TOP, touching)
    assert not confirmed(TOP + 0.1, touching)
    assert not confirmed(TOP, arm.simulate({}, count=6, seconds=8.0, seed=3))


def test_the_friction_of_a_contact_is_bounded(windows: tuple[Problem, Fit, list[Candidate]]) -> None:
    hand = next(c for c in windows[2] if c.effect == "surface_contact")
    assert hand.at([TOP, *TIP, 3.2]).values() == (TOP, *TIP, 1.0)


def test_surfaces_in_one_batch_are_what_each_is_alone(windows: tuple[Problem, Fit, list[Candidate]]) -> None:
    problem, _, candidates = windows
    hand = next(c for c in candidates if c.effect == "surface_contact" and c.where == "l3")
    models = [[hand.at([TOP + d, *TIP, 0.5])] for d in (0.0, 0.01)]
    one, other = (vary(problem.plant, effects) for effects in models)
    assert one.beside(other) and not one.beside(vary(problem.plant, []))
    assert not one.beside(vary(problem.plant, [*models[0], single("stribeck_friction", "j1", 0.1, 0.1)]))
    steps = problem.plant, problem.layout, problem.windows
    both = residuals(*steps, [one, other], 0.001)
    np.testing.assert_array_equal(both[0], residuals(*steps, [one], 0.001)[0])
    np.testing.assert_array_equal(both[1], residuals(*steps, [other], 0.001)[0])
    assert np.abs(both[0] - both[1]).max() > 1e-3


def test_only_hands_and_fingers_of_a_fixed_robot_that_rise_and_sink_may_touch(
    windows: tuple[Problem, Fit, list[Candidate]],
) -> None:
    _, _, candidates = windows
    assert {c.where for c in candidates if c.effect == "surface_contact"} == {"l2", "l3"}  # l2 carries but l3
    rollouts, xml = stander.simulate(seconds=3.0)[0], stander.XML
    standing = arm.session_of(rollouts, xml)
    assert not [c for c in all_candidates(standing.plant, rollouts, []) if c.effect == "surface_contact"]
