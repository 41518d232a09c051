"""The gap report: a complete model lacks nothing, a lacking one what it lacks; what could not be tested is said."""

import copy
from dataclasses import fields, replace
from functools import cache
from pathlib import Path

import pytest

from bumblebee.diagnosis import gap as room
from bumblebee.diagnosis.config import DiagnosisConfig
from bumblebee.diagnosis.dataset.session import Session
from bumblebee.diagnosis.gap import Gap, gap, gap_page
from bumblebee.diagnosis.report import gap_summary
from bumblebee.diagnosis.thresholds import Thresholds
from bumblebee.diagnosis.thresholds.gap import GapPage, GapThresholds
from bumblebee.diagnosis.thresholds.report import ExampleWindows, ReportThresholds, Verdicts
from bumblebee.measured.rollout import write_rollout
from tests.commands.conftest import run
from tests.diagnosis import arm, cart
from tests.diagnosis.arm import SMALL, session_of

SPRING = ("spring", "j2", 1.5)
COUNT = 4
"""Rollouts of a case: two to fit at least, and some that take no part."""


def of(effects: dict[tuple[str, str], float], seed: int = 0, **given) -> Session:
    return session_of(arm.simulate(effects, count=COUNT, seed=seed, **given))


@cache
def reported(seed: int, *effects: tuple[str, str, float]) -> Gap:
    """The report of such rollouts, made once."""
    return gap(of({(kind, place): value for kind, place, value in effects}, seed), 20, SMALL)


def by(thresholds: Thresholds) -> DiagnosisConfig:
    return replace(SMALL, thresholds=thresholds)


def named(report: Gap) -> dict[str, list[str]]:
    """Joint that lacks a torque -> what that depends on."""
    entries = report.document["missing_torque"]
    return {joint: e["depends_on"] for joint, e in entries.items() if e["significant"]}


@pytest.fixture(scope="module")
def session() -> Session:
    return of({SPRING[:2]: SPRING[2]})


@pytest.mark.parametrize("seed", [0, 1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(2, 6))])
def test_nothing_depends_on_anything_where_the_model_is_complete(seed: int) -> None:
    assert named(reported(seed)) == {}


@pytest.mark.parametrize(
    "effect, joint, quantity",
    [
        (("coulomb_friction", "j2", 0.5), "j2", "velocity"),
        (("viscous_friction", "j3", 0.3), "j3", "velocity"),
        (SPRING, "j2", "position"),
        (("motor_strength", "j2", 0.8), "j2", "torque"),
    ],
)
def test_what_a_joint_lacks_is_named_with_what_it_depends_on(effect, joint: str, quantity: str) -> None:
    assert quantity in named(reported(0, effect))[joint]


@pytest.mark.parametrize("effect", [("torque_limit", "j2", 6.0), ("motor_strength", "j2", 0.8)])
def test_the_joint_that_is_wrong_stands_first_however_wrong_it_is(effect) -> None:
    assert next(iter(named(reported(3, effect)))) == "j2"


def test_the_missing_torque_is_as_large_as_the_friction_that_the_model_lacks() -> None:
    entry = reported(0, ("coulomb_friction", "j2", 0.5)).document["missing_torque"]["j2"]
    assert 0.3 < entry["structured_rms"] < 0.6


def test_a_gap_report_of_one_rollout_says_what_could_not_be_tested() -> None:
    report = gap(session_of(cart.record(count=1), cart.xml()), 20, SMALL)
    assert any("could not be tested" in text for text in report.document["warnings"])
    assert "WARNING: a single rollout" in gap_summary(report.document, report.examples)


def test_logs_without_a_stretch_of_a_windows_length_get_a_report_without_missing_torques(session: Session) -> None:
    made = gap(session, 20, replace(SMALL, horizon=60.0))
    assert made.document["missing_torque"] == {} and made.torque is None
    assert any("missing torques could not be tested" in note for note in made.document["notes"])
    assert "Too few windows" in gap_page(made)


def test_a_trace_is_not_called_nothing() -> None:
    report = replace(reported(0, SPRING), document=copy.deepcopy(reported(0, SPRING).document))
    entry = report.document["missing_torque"]["j3"]
    entry |= {"significant": False, "p": 1e-9}
    assert "too small or not confirmed" in gap_page(report)
    entry["p"] = 0.5
    assert "too small or not confirmed" not in gap_page(report)


def test_its_thresholds_are_settable(session: Session) -> None:
    before, rules = reported(0, SPRING), Thresholds()
    assert before.document["missing_torque"]["j2"]["significant"]
    tests = replace(rules.discrepancy.residual_tests, least_torque=1e9, excess_fitted=1e9, excess_alone=1e9)
    strict = replace(rules, discrepancy=replace(rules.discrepancy, residual_tests=tests))
    assert not any(e["significant"] for e in gap(session, 20, by(strict)).document["missing_torque"].values())
    short = replace(before, thresholds=replace(rules, gap=GapThresholds(page=GapPage(motions=1, pictures=0))))
    assert "and 3 more" in gap_page(short) and len(gap_page(short)) < len(gap_page(before))


def test_what_it_shares_with_a_diagnosis_is_settable(session: Session) -> None:
    rules = Thresholds()
    tests = replace(rules.discrepancy.residual_tests, least_torque=1e9, excess_fitted=1e9, excess_alone=1e9)
    made = gap(
        session,
        20,
        by(
            replace(
                rules,
                discrepancy=replace(rules.discrepancy, residual_tests=tests),
                report=ReportThresholds(example_windows=ExampleWindows(lengths=(0.2,)), verdicts=Verdicts(large=0.0)),
            )
        ),
    )
    assert all(e["time"][-1] == pytest.approx(0.2) for e in made.examples)
    assert "times the noise" in gap_page(made)
    assert "times the noise" in gap_summary(made.document, made.examples, made.thresholds.report)


def test_no_threshold_is_without_a_reader() -> None:
    source = "".join(path.read_text() for path in Path(room.__file__).parent.glob("*.py"))
    for concept in vars(GapThresholds()).values():
        unread = [f.name for f in fields(concept) if f".{f.name}" not in source]
        assert unread == [], type(concept).__name__


def test_joints_and_motions_of_any_name_are_reported_and_move_no_terminal(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Parentheses, commas and quotes in a joint's name; a motion's name that would clear the screen and ring."""
    names = ("j1", "elbow(1), it's", "j3^2")
    xml = arm.XML
    for old, new in zip(arm.JOINTS, names, strict=True):
        xml = xml.replace(f'"{old}"', f'"{new}"')
    (tmp_path / "model.xml").write_text(xml)
    for k, rollout in enumerate(arm.simulate({("spring", "j2"): 1.5}, count=3, seconds=4.0)):
        meta = rollout.meta | {"motion": f"wave {k}\x1b[2J\x07\u202e"}
        write_rollout(tmp_path / "set" / "rollouts" / f"r{k}.parquet",
                      replace(rollout, rollout_id=f"r{k}", joints=names, meta=meta))  # fmt: skip
    assert run("gap", tmp_path / "model.xml", tmp_path / "set", "--out", tmp_path / "gap") == 0
    said = capsys.readouterr().out
    assert all(sign.isprintable() or sign == "\n" for sign in said) and "wave 0\ufffd[2J" in said
    assert "elbow(1), it's" in said and "j3^2" in said
    page = (tmp_path / "gap" / "gap.html").read_text()
    assert page.index("Content-Security-Policy") < page.index("<style") and "default-src 'none'" in page
