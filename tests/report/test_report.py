"""The report says what the numbers allow, holds everything in itself, and runs nothing that came with the data."""

import base64
import re
from dataclasses import replace

import numpy as np
import pytest

from bumblebee.evaluation.intervals import bootstrap_mean, sign_flip_test
from bumblebee.measured.rollout import Rollout
from bumblebee.report.charts.loop_picture import Box, loop_picture
from bumblebee.report.films import filmstrip
from bumblebee.report.page import image
from bumblebee.report.sections.policy_sections import BEGAN, training_section
from bumblebee.report.truth import match
from bumblebee.report.wording import change, effect_line, number, percent, plural, shown, signed
from bumblebee.robot.facts import joint_names, stand_pose
from bumblebee.robot.model import build_spec
from tests.report.made import TRUTH, estimate, found, loop_results, page, page_of


def test_a_page_loads_nothing_and_runs_nothing() -> None:
    html = page([found()], [TRUTH])
    assert html.count("<script") == 1 and "&lt;script&gt;" in html  # the gate's answer was signed by "Ada <script>"
    assert not re.search(r'(src|href)="(?!data:|#)', html)
    assert "default-src 'none'" in html


def test_images_must_be_inside() -> None:
    with pytest.raises(ValueError, match="in itself"):
        image("https://example.org/a.png", "")


def test_a_found_effect_stands_beside_the_truth_with_its_error() -> None:
    html = page([found()], [TRUTH])
    assert '<td class="found">found</td>' in html
    assert "(\u22124.2 %, interval holds it)" in html
    assert "1 effect of the stand-in robot was not in its model; 1 found." in html


def test_a_missed_and_a_false_effect_are_said() -> None:
    html = page([found("viscous_friction", "right_knee_joint")], [TRUTH])
    assert '<td class="missed">not found</td>' in html
    assert "(not sealed)" in html
    assert "0 found, 1 reported that is not there" in html


def test_an_effect_of_the_same_class_counts_as_found_but_not_as_exact() -> None:
    other = found("kd", equivalent=[{"effect": "coulomb_friction", "where": ["left_knee_joint"]}])
    (pair,) = match([TRUTH], [other])
    assert pair.through == "class" and pair.relative_error is None


def test_an_exact_match_is_preferred_to_a_class() -> None:
    close = found("kd", equivalent=[{"effect": "coulomb_friction", "where": ["left_knee_joint"]}])
    pairs = match([TRUTH], [close, found()])
    assert [pair.through for pair in pairs] == ["exact", ""]


def test_nothing_sealed_and_nothing_found_is_said() -> None:
    assert "no false alarm" in page([], [])


def test_a_real_robot_has_no_truth_to_show() -> None:
    html = page([found()], None)
    assert "sealed in the stand-in" not in html and "1 effect found" in html
    assert html.count("Neither is your robot") == 1
    assert "Neither is your robot" not in page([found()], [TRUTH])


@pytest.mark.parametrize(
    ("low", "high", "p", "said"),
    [(0.1, 0.2, 0.01, "better"), (-0.2, -0.1, 0.05, "worse"), (-0.1, 0.1, 0.01, "no difference shown"),
     (0.1, 0.2, 0.06, "no difference shown"), (-0.2, -0.1, 0.5, "no difference shown")],
)  # fmt: skip
def test_claims_need_the_interval_and_the_test(low: float, high: float, p: float, said: str) -> None:
    assert shown(low, high, p) == said


@pytest.mark.parametrize(("motions", "said"), [(2, "no difference shown"), (6, "better")])
def test_two_motions_prove_nothing_however_alike_they_are(motions: int, said: str) -> None:
    gains = np.ones(motions)
    success = {"value": 1.0, "ci95": list(bootstrap_mean(gains)), "p": sign_flip_test(gains)}
    assert change({"success": success}).endswith(said)


def test_every_version_of_this_run_is_listed() -> None:
    assert "<td>3, 4</td>" in page([found()], [TRUTH])


def test_a_base_policy_that_was_not_made_here_is_said() -> None:
    made = loop_results([found()], [TRUTH])
    told = replace(made, began="shipped")
    for began, words in BEGAN.items():
        assert (words in page_of(replace(made, began=began)), words in page_of(made)) == (True, False)
    captions = "".join(f"{block.title} {block.caption}" for block in training_section(told).blocks)
    assert "from the policy that comes along" in captions and "from scratch" not in captions


def test_the_page_says_which_learner_trained_a_policy_and_draws_its_own_columns() -> None:
    made = loop_results([found()], [TRUTH])
    refined = made.curves["base"].assign(loss_model=[0.5, 0.3, 0.2], alive=[0.8, 0.9, 0.97])
    by = {"expert-c0 r0": "ppo", "expert-c0 r1": "world_model"}
    told = replace(made, curves=made.curves | {"expert-c0 r1": refined}, learners=by)
    drawn = {block.title: block for block in training_section(told).blocks if block.title.startswith("Experts")}
    assert [name for name, _ in drawn["Experts: imagined steps before an end"].rows] == ["expert-c0 r1"]
    assert [name for name, _ in drawn["Experts: episodes that end well"].rows] == ["expert-c0 r0", "expert-c0 r1"]
    said = "Learner ppo: expert-c0 r0. Learner world_model: expert-c0 r1."
    assert all(said in block.caption for block in drawn.values()) and said in page_of(told)


def test_a_name_with_a_dollar_is_no_formula_in_a_figure() -> None:
    assert page([found()], [TRUTH], name="$x_{$").count("data:image/svg") > 1


def test_every_figure_says_what_it_is_and_shows_in_words() -> None:
    html = page([found()], [TRUTH])
    images = re.findall(r'<figure><figcaption><b>(.*?)</b></figcaption><img [^>]*alt="(.*?)"', html, re.S)
    assert len(images) == html.count("<img ") > 1
    assert all(title and len(alt) > 20 for title, alt in images)


def test_numbers_that_say_nothing_are_said_in_words() -> None:
    same = {"success": {"value": 0.0, "ci95": [0.0, 0.0], "p": 1.0}}
    assert change(same) == "the same on every motion: no difference shown"
    few = {"success": {"value": 0.5, "ci95": [-4.08, 5.08], "p": 1.0}}
    assert "[\u2212100, +100]" in change(few)
    assert number({"value": 0.076, "ci95": [-0.196, 0.347]}) == "0.076 [0.000, 0.347]"
    assert signed(-0.2) == "0" and signed(3.4) == "+3"
    assert (plural(1, "motion"), plural(2, "policy")) == ("1 motion", "2 policies")


def test_percent() -> None:
    assert percent(estimate(0.91, 0.05)) == "91 % [86, 96]"
    assert percent({"value": None, "ci95": [None, None]}) == "–"


def test_titles_in_the_picture_are_escaped() -> None:
    assert "<i>" not in loop_picture([Box("<i>", "&")], [Box("<i>", "<i>")], "<i>")


def test_a_stick_figure_stands_in_where_nothing_renders(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(filmstrip, "render_frames", lambda *_: (None, "egl: no device"))
    spec = build_spec()
    spec.compile()
    rows = 20
    rollout = Rollout(
        "r", joint_names(), 50, np.arange(rows) / 50, np.tile(stand_pose(), (rows, 1)), np.zeros((rows, 23)),
        joint_target=np.zeros((rows, 23)), base_quat=np.tile([1.0, 0, 0, 0], (rows, 1)),
        base_pos=np.tile([0, 0, 0.784], (rows, 1)),
    )  # fmt: skip
    shown_film = filmstrip.film(rollout, spec.to_xml(), panels=3)
    assert shown_film.sheet is None and "no device" in shown_film.note
    kind, data = shown_film.stills[0][1].split(",", 1)
    assert len(shown_film.stills) == 3
    assert kind.startswith("data:image/svg+xml") and b"<path" in base64.b64decode(data)


def test_a_discovered_effect_is_told_by_its_terms() -> None:
    terms = [{"term": "sin(12*q)", "coefficient": 0.31, "ci95": [0.3, 0.32]}, {"term": "v", "coefficient": -1.0}]
    name, value, _ = effect_line({"effect": "discovered", "where": ["knee"], "parameters": {"terms": terms}})
    assert name == "discovered on knee"
    assert value == "sin(12*q) 0.31 [0.3, 0.32]; v -1"
