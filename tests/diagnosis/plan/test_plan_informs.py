"""A plan is chosen for effects that it tells apart and intervals that it narrows."""

from dataclasses import replace

import mujoco
import numpy as np

from bumblebee.diagnosis.plan import findings_of, make_plan
from bumblebee.diagnosis.plan.choose import choose
from bumblebee.diagnosis.plan.predicted import classes, intervals
from bumblebee.diagnosis.plan.written.document import document
from tests.diagnosis.arm import XML
from tests.diagnosis.plan.made import LIMITS, planned


def cosines(plan, when: str) -> list[float]:
    return [row["cosine"][when] for row in classes(plan)]


def test_friction_and_kd_are_one_at_one_kd_and_two_at_another() -> None:
    one, two = planned(damping=False), planned(damping=True)
    assert {(r["if"]["effect"], r["not"]["effect"]) for r in classes(one)} == {
        ("viscous_friction", "kd"),
        ("kd", "viscous_friction"),
    }
    assert min(cosines(one, "before")) > 0.999 and min(cosines(one, "after")) > 0.999
    assert not any(r["resolved"]["after"] for r in classes(one))
    assert any("not expected to tell apart" in note for note in document(one, "")["notes"])
    assert max(cosines(two, "after")) < 0.94
    assert all(r["resolved"]["after"] for r in classes(two))
    assert 0.2 in {motion.gain.kd for motion in two.motions}


def test_chosen_runs_are_worth_more_than_the_same_number_drawn_at_random() -> None:
    plan = make_plan(mujoco.MjSpec.from_string(XML), "arm", replace(LIMITS, runs=10))
    picked = choose(plan.objective, plan.data, plan.runs, 2)
    best = plan.objective.value(plan.data + plan.runs[picked].sum(axis=0))
    rng = np.random.default_rng(0)
    drawn = [
        plan.objective.value(plan.data + plan.runs[rng.choice(len(plan.runs), 2, replace=False)].sum(axis=0))
        for _ in range(20)
    ]
    assert best >= max(drawn) - 1e-9
    assert best > np.mean(drawn) + 0.05


def test_more_data_never_widens_and_never_confuses() -> None:
    plan = planned()
    for row in intervals(plan):
        assert 0 < row["ratio"] < 1
        assert row["half_width"]["after"] < row["half_width"]["before"]
    for row in classes(plan):
        assert row["chi2"]["after"] >= row["chi2"]["before"] * (1 - 1e-6)


def test_the_width_that_is_predicted_scales_the_one_that_the_diagnosis_gave() -> None:
    plan = planned()
    row = next(r for r in intervals(plan) if r["effect"] == "viscous_friction")
    assert row["half_width"]["before"] == 0.1 or abs(row["half_width"]["before"] - 0.1) < 1e-9
    assert abs(row["half_width"]["after"] - 0.1 * row["ratio"]) < 1e-9


def test_a_plan_without_data_sees_every_joint() -> None:
    plan = make_plan(mujoco.MjSpec.from_string(XML), "arm", replace(LIMITS, runs=3))
    rows = document(plan, "")["predicted"]["usual"]["effects"]
    for joint in ("j1", "j2", "j3"):
        seen = {row["effect"]: row for row in rows if row["where"] == [joint]}
        assert seen["coulomb_friction"]["known"] and seen["coulomb_friction"]["half_width"]["after"] < 0.1
        assert seen["armature"]["half_width"]["after"] < 0.3 * seen["armature"]["half_width"]["before"]


def test_the_same_seed_gives_the_same_plan_and_another_seed_another() -> None:
    first = planned()
    again = planned.__wrapped__()
    for one, other in zip(first.motions, again.motions, strict=True):
        np.testing.assert_array_equal(one.targets, other.targets)
    other = planned(seed=5)
    assert any(not np.array_equal(a.targets, b.targets) for a, b in zip(first.motions, other.motions, strict=True))


def test_effects_without_a_candidate_are_said_and_not_asked_about() -> None:
    told = {"schema": 1, "effects": [{"effect": "discovered", "where": ["j2"], "parameters": {}, "equivalent": []}]}
    found = findings_of(told, [])
    assert found.listed == ()
