"""The gap report: what could not be tested stands in it, and its thresholds are settable."""

from dataclasses import fields, replace
from pathlib import Path

import mujoco
import pytest

from bumblebee.diagnosis import gap as room
from bumblebee.diagnosis.dataset.session import Session, make_session
from bumblebee.diagnosis.gap import gap, gap_page
from bumblebee.diagnosis.report import gap_summary
from bumblebee.diagnosis.thresholds.gap import GapThresholds
from bumblebee.diagnosis.thresholds.report import ExampleWindows, ReportThresholds, Verdicts
from tests.diagnosis import arm, cart


@pytest.fixture(scope="module")
def session() -> Session:
    rollouts = arm.simulate({("spring", "j2"): 1.5})
    return make_session(mujoco.MjSpec.from_string(arm.XML), rollouts, "arm", "memory")


def test_a_gap_report_of_one_rollout_says_what_could_not_be_tested():
    report = gap(make_session(mujoco.MjSpec.from_string(cart.xml()), cart.record(count=1), "cart", "memory"))
    assert any("could not be tested" in text for text in report.document["warnings"])
    assert "WARNING: a single rollout" in gap_summary(report.document, report.examples)


def test_its_thresholds_are_settable(session: Session) -> None:
    before, rules = gap(session), GapThresholds()
    assert any(e["significant"] for e in before.document["missing_torque"].values())
    strict = replace(rules, dependence=replace(rules.dependence, least=1e9))
    assert not any(e["significant"] for e in gap(session, thresholds=strict).document["missing_torque"].values())
    long = replace(
        rules, missing_torque=replace(rules.missing_torque, span=0.08, fewest=20), page=replace(rules.page, motions=1)
    )
    made = gap(session, thresholds=long)
    assert len(made.torque) < len(before.torque)
    assert "0.08 s" in gap_page(made) and "and 2 more" in gap_page(made)
    none = replace(rules, missing_torque=replace(rules.missing_torque, fewest=10**9))
    assert gap(session, thresholds=none).document["missing_torque"] == {}


def test_what_it_shares_with_a_diagnosis_is_settable(session: Session) -> None:
    rules = ReportThresholds(example_windows=ExampleWindows(lengths=(0.2,)), verdicts=Verdicts(large=0.0))
    strict = replace(GapThresholds().dependence, least=1e9)
    made = gap(session, thresholds=GapThresholds(dependence=strict), report=rules)
    assert all(e["time"][-1] == pytest.approx(0.2) for e in made.examples)
    assert "times the noise" in gap_page(made)
    assert "times the noise" in gap_summary(made.document, made.examples, made.report)


def test_no_threshold_is_without_a_reader() -> None:
    source = "".join(path.read_text() for path in Path(room.__file__).parent.glob("*.py"))
    for concept in vars(GapThresholds()).values():
        unread = [f.name for f in fields(concept) if f".{f.name}" not in source]
        assert unread == [], type(concept).__name__
