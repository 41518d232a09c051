"""Warnings stand in the document, the terminal and the page, and no comfort beside them."""

import copy

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.dataset.session import make_session
from bumblebee.diagnosis.dataset.undriven import commanded_undriven
from bumblebee.diagnosis.gap.gap import gap
from bumblebee.diagnosis.report.gain_by_horizon import gain_of, whole_model
from bumblebee.diagnosis.report.headline import trusted
from bumblebee.diagnosis.report.notes import unexplained_error, what_is_left, worse_horizons
from bumblebee.diagnosis.report.page import render_report
from bumblebee.diagnosis.report.terminal import summary
from bumblebee.diagnosis.thresholds.report import ReportThresholds, Verdicts
from bumblebee.errors import BadInput
from tests.diagnosis import cart


def document(after: float, effects: bool = False) -> dict:
    """A robot of one hinge whose error after 0.2 s is `after` times the noise; nothing significant is left."""

    def block(value: float) -> dict:
        entry = {"value": value, "ci95": None, "unit": "rad"}
        return {"0.2": {"joint_pos_rmse": entry | {"per_joint": {"j": entry}}}}

    effect = {"effect": "armature", "where": ["j"], "parameters": {}, "equivalent": [], "explains": 0.5,
              "evidence": {"p": 0.0}}  # fmt: skip
    return {
        "effects": [effect] if effects else [],
        "unexplained": {"significant": False, "p": 0.4, "where": [], "depends_on": [], "description": ""},
        "error": {"before": block(0.002 * after), "after": block(0.002 * after), "floor": block(0.002)},
        "holdout": ["a"],
        "units": {"j": {"position": "rad", "velocity": "rad/s", "torque": "N m"}},
    }


def test_a_large_error_without_an_effect_is_said_and_nothing_comforts():
    made = document(80.0)
    made["warnings"] = unexplained_error(made, Verdicts())
    assert "160 mrad" in made["warnings"][0] and "no effect of the catalogue explains it" in made["warnings"][0]
    for text in (summary(made), render_report(made, [])):
        assert "no effect of the catalogue explains it" in text
        assert "structure in the residual (p" not in text and "No effect of the catalogue is missing" not in text


def test_a_page_with_a_red_box_never_trusts_the_model_as_a_whole():
    entries = {name: {"joint_pos_rmse": {"value": 0.1}, "base_pos_rmse": {"value": 0.01}} for name in ("0.2", "1.0")}
    after = {
        "0.2": {"joint_pos_rmse": {"value": 0.01}, "base_pos_rmse": {"value": 0.005}},
        "1.0": {"joint_pos_rmse": {"value": 0.05}, "base_pos_rmse": {"value": 0.03}},
    }
    gone = [{"what": "joints", "share": 0.9, "ci95": [0.8, 1.0], "before": 0.1, "after": 0.01, "floor": 0.005}]
    made = {"error": {"before": entries, "after": after, "floor": {}}, "effects": [],
            "summary": {"removed": {"0.2": gone, "1.0": gone}}}  # fmt: skip
    rules = ReportThresholds()
    assert len(worse_horizons(made["error"], rules.verdicts)) == 1
    said = whole_model(gain_of(made, rules), warned=False)
    assert "as a whole" not in said and "worse than the declared one after 1.0 s (base)" in said
    better = {**made, "error": {"before": entries, "after": {"0.2": after["0.2"], "1.0": after["0.2"]}, "floor": {}}}
    better["summary"] = {**better["summary"], "trust": [{"group": "", "wide": False, "alike": False}]}
    assert "as a whole" in trusted(better, rules)
    for box in ({"warnings": ["a single rollout"]}, {"set_aside": [{"rollout": "c", "reason": "row 7"}]}):
        assert trusted({**better, **box}, rules).startswith("Read the warnings before you use the corrected model")


def test_a_large_error_beside_effects_is_said_too():
    assert "the effects found do not explain that" in unexplained_error(document(5.0, effects=True), Verdicts())[0]


def test_an_error_at_the_noise_warns_of_nothing():
    made = document(1.1)
    assert unexplained_error(made, Verdicts()) == []
    assert what_is_left(made, Verdicts()) == "no significant structure in the residual"
    assert "No effect of the catalogue is missing" in render_report(made, [])


def test_one_rollout_says_what_could_not_be_tested(diagnosed):
    made = diagnosed({("motor_strength", "j3"): 0.85}, 5, count=1).document
    assert any("single rollout" in text for text in made["warnings"])
    assert "WARNING: a single rollout" in summary(made)
    assert "single rollout" in render_report(made, []).split("<h2>")[0]


def undriven(*names: str) -> str:
    text = cart.xml("position")
    for name in names:
        begin = text.index(f'<position name="{name}"')
        text = text[:begin] + text[text.index("/>", begin) + 2 :]
    return text


def test_commands_that_nothing_takes_are_said_or_refused():
    rollouts = cart.record(count=2, torque=False, seconds=1.0)
    some = make_session(mujoco.MjSpec.from_string(undriven("pole")), rollouts, "cart", "memory")
    assert commanded_undriven(some.plant, rollouts) == ["pole"]
    assert "pole" in some.warnings[0] and any("pole" in text for text in gap(some).document["warnings"])
    with pytest.raises(BadInput, match="without actuators"):
        make_session(mujoco.MjSpec.from_string(undriven("pole", "cart")), rollouts, "cart", "memory")


def test_a_joint_that_is_told_nothing_needs_no_actuator():
    rollouts = [copy.copy(r) for r in cart.record(count=2, torque=False, seconds=1.0)]
    for rollout in rollouts:
        object.__setattr__(rollout, "joint_target", np.zeros_like(rollout.joint_target))
    made = make_session(mujoco.MjSpec.from_string(undriven("pole", "cart")), rollouts, "cart", "memory")
    assert made.warnings == ()


def test_the_page_counts_every_rollout_once():
    made = document(1.1) | {"train": ["a", "b", "c"], "accept": ["c"], "holdout": ["d"]}
    assert "rollouts: 2 for identification, 1 for validation, 1 held out" in render_report(made, [])
    made |= {"accept": ["d"]}
    assert "rollouts: 3 for identification, 1 held out and used for validation" in render_report(made, [])
