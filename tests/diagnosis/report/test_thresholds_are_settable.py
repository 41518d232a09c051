"""Every threshold of the report can be set for a whole diagnosis, and each is read somewhere."""

from dataclasses import fields, replace
from pathlib import Path

import pytest

from bumblebee.diagnosis import report as room
from bumblebee.diagnosis.config import DiagnosisConfig
from bumblebee.diagnosis.dataset.session import Session
from bumblebee.diagnosis.diagnose import Diagnosis, diagnose
from bumblebee.diagnosis.output import contents
from bumblebee.diagnosis.replay import replay
from bumblebee.diagnosis.report import summary
from bumblebee.diagnosis.report.page import render_report
from bumblebee.diagnosis.thresholds import Thresholds
from bumblebee.diagnosis.thresholds.report import (
    Effects,
    ExampleWindows,
    Listing,
    PredictionError,
    ReportThresholds,
    Verdicts,
)
from bumblebee.diagnosis.thresholds.selection import Confounding, Forward, SelectionThresholds, ToldApart
from tests.diagnosis import arm

TRUTH = {("spring", "j2"): 1.5, ("command_delay", "j1"): 0.01}
RULES = ReportThresholds(
    prediction_error=PredictionError(whitened=(("0.02", 3), ("0.2", 3), ("1.0", 3))),
    effects=Effects(experiments=0),
    example_windows=ExampleWindows(lengths=(0.2,), ticks=5),
    verdicts=Verdicts(large=0.0),
    listing=Listing(effects=1, detectable=1, equivalent=1),
)


def config(**rooms: object) -> DiagnosisConfig:
    """Two effects, no look at their rivals, which the report has no part in, and classes by sensitivities alone."""
    classes = Confounding(told_apart=ToldApart(chi_square=1e9))
    selection = SelectionThresholds(forward=Forward(swaps=0), confounding=classes)
    return replace(arm.SMALL, beyond=False, thresholds=Thresholds(selection=selection, **rooms))


@pytest.fixture(scope="module")
def session() -> Session:
    return arm.session_of(arm.simulate(TRUTH))


@pytest.fixture(scope="module")
def set_(session: Session) -> Diagnosis:
    return diagnose(session, config(report=RULES))


@pytest.fixture(scope="module")
def default(session: Session) -> Diagnosis:
    return diagnose(session, config())


def test_the_document_goes_by_what_was_set(set_: Diagnosis, default: Diagnosis) -> None:
    before, after = default.document, set_.document
    assert [e["effect"] for e in before["effects"]] == [e["effect"] for e in after["effects"]]
    assert any(e.get("separate_by") for e in before["effects"])
    assert not any(e.get("separate_by") for e in after["effects"])
    assert not any("still errs" in text for text in before["warnings"])
    assert any("still errs" in text for text in after["warnings"])
    errors = [made["error"]["before"]["0.2"] for made in (before, after)]
    assert errors[0]["joint_pos_rmse"] == errors[1]["joint_pos_rmse"] and errors[0]["chi2"] != errors[1]["chi2"]


def test_page_and_terminal_go_by_what_was_set(set_: Diagnosis, default: Diagnosis) -> None:
    strict = replace(RULES, verdicts=Verdicts(large=0.0, worse=0.0))  # every model is called worse
    rooms = replace(set_.problem.thresholds, report=strict)
    told = replace(set_, problem=replace(set_.problem, thresholds=rooms))
    page, usual = (contents(made)["report.html"] for made in (told, default))
    assert "WORSE" in page and "WORSE" not in usual
    assert "Do not trust the corrected model" in page and "more in diagnosis.json" in page
    better = render_report(set_.document, [], RULES)
    assert "and 1 more" in better and "and 1 more" not in usual
    assert page.count("<svg") == 3 and len(page) < len(usual)
    assert "WORSE" in summary(set_.document, strict) and "WORSE" not in summary(default.document)


def test_the_intervals_of_replay_go_by_what_was_set(session: Session) -> None:
    few, many = (replay(session, budget=6, rule=PredictionError(resamples=n)) for n in (7, 400))
    assert few["0.2"]["chi2"]["value"] == many["0.2"]["chi2"]["value"]
    assert few["0.2"]["chi2"]["ci95"] != many["0.2"]["chi2"]["ci95"]


def test_no_threshold_is_without_a_reader() -> None:
    source = "".join(path.read_text() for path in Path(room.__file__).parent.glob("*.py"))
    for concept in vars(ReportThresholds()).values():
        unread = [f.name for f in fields(concept) if f".{f.name}" not in source]
        assert unread == [], type(concept).__name__
