"""A gate in the flow: nothing is chosen beforehand, and an answer from Prefect's page holds only for what was shown."""

import json
import logging
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from prefect.states import Cancelled

from bumblebee.measured.rollout import Rollout, write_rollout
from flows.gates import gate_page, gate_question
from flows.loop import WAITING, outcome
from flows.stages import Stage
from tasks.approvals import gate

STAGE = Stage("gate@1", "python -m tasks.gate --round 1", frozenset(), frozenset())
EVIL = "wave|<script>alert(1)</script> [click](http://evil.example)"


class Suspended(Exception):
    """How a run's process ends at a gate."""


class Page:
    """Prefect's page, as far as a gate sees it: questions by name, and the answers given to them."""

    def __init__(self) -> None:
        self.shown: dict[str, str] = {}
        self.given: dict[str, dict[str, Any]] = {}

    def suspend(self, wait_for_input: Any, timeout: None, key: str) -> Any:
        if key in self.given:
            return wait_for_input(**self.given[key])
        self.shown[key] = wait_for_input._description
        raise Suspended(key)

    def answer(self, answer: str, by: str, seen: str, note: str = "") -> None:
        """To the last question."""
        self.given[list(self.shown)[-1]] = {"answer": answer, "by": by, "seen": seen, "note": note}


@pytest.fixture
def page(monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture) -> Page:
    made = Page()
    caplog.set_level(logging.INFO)
    monkeypatch.setattr(gate_question, "suspend_flow_run", made.suspend)
    monkeypatch.setattr(gate_question, "answered", made.given.get)
    monkeypatch.setattr(gate_question, "create_markdown_artifact", lambda text, **options: "the-artifact")
    monkeypatch.setattr(gate_question, "get_run_logger", lambda: logging.getLogger("gates"))
    monkeypatch.setenv("PREFECT__RUNTIME__DEPLOYMENT__ID", "here")
    monkeypatch.setenv("PREFECT__RUNTIME__FLOW_RUN__UI_URL", "http://localhost/run")
    return made


@pytest.fixture
def place(tmp_path: Path) -> gate.Gate:
    made = gate.Gate(tmp_path, 1)
    (tmp_path / "params.yaml").write_text("gate: {mode: ask}\n")
    come_in(made, 4)
    return made


def come_in(place: gate.Gate, accepted: int, motion: str = "wave") -> None:
    folder = place.summary.parent
    folder.mkdir(parents=True, exist_ok=True)
    verdicts = {motion: {"accepted": accepted, "quarantined": 0}}
    counts = {"accepted": accepted, "quarantined": 0, "seconds": 8.0, "by_rule": {}, "joints": ["elbow"]}
    place.summary.write_text(json.dumps(counts | {"by_motion": verdicts, "by_cluster": verdicts}))
    (folder / "findings.csv").write_text("file,rule,fatal,message\n")
    time = np.linspace(0.0, 1.0, 20)
    moves = {"time": time, "joint_pos": np.sin(time)[:, None], "joint_vel": np.cos(time)[:, None]}
    rollout = Rollout(
        "a", ("elbow",), 20.0, **moves, joint_target=np.sin(time)[:, None] + 0.01, meta={"motion": motion}
    )
    (folder / "rollouts" / "a.parquet").unlink(missing_ok=True)
    write_rollout(folder / "rollouts" / "a.parquet", rollout)


def ask(place: gate.Gate) -> None:
    with pytest.raises(Suspended):
        gate_question.hold(place.workspace, STAGE)


def test_the_dialog_has_no_answer_beforehand_and_shows_the_hash(place: gate.Gate, page: Page) -> None:
    ask(place)
    seen = gate.request(place)["seen"]["sha256"]
    schema = gate_question.form(seen[:12], "").model_json_schema()
    assert "default" not in schema["properties"]["answer"] and "default" not in schema["properties"]["by"]
    assert {"answer", "by"} <= set(schema["required"]) and schema["properties"]["seen"]["default"] == seen[:12]
    (question,) = page.shown.values()
    assert seen[:12] in question and "(../../artifacts/artifact/the-artifact)" in question


def test_an_answer_on_the_page_is_written_with_how_its_author_was_known(place: gate.Gate, page: Page) -> None:
    ask(place)
    page.answer("approve", "Ada", gate.seen_of(place.summary)["sha256"][:12])
    assert gate_question.hold(place.workspace, STAGE) is None
    table = gate.read_approval(place.approval)
    assert (table["status"], table["by"]) == ("approved", "Ada") and "login" in table["known_by"]["how"]


def test_an_answer_to_data_that_changed_meanwhile_is_asked_for_anew(place: gate.Gate, page: Page) -> None:
    ask(place)
    page.answer("approve", "Ada", gate.seen_of(place.summary)["sha256"][:12])
    come_in(place, 5)
    ask(place)
    assert gate.verdict(place) == "pending" and len(page.shown) == 2
    page.answer("reject", "Ada", gate.seen_of(place.summary)["sha256"][:12])
    assert gate_question.hold(place.workspace, STAGE) is None
    assert gate.verdict(place) == "rejected"


def test_an_answer_with_another_hash_is_refused_and_asked_for_anew(
    place: gate.Gate, page: Page, caplog: pytest.LogCaptureFixture
) -> None:
    ask(place)
    page.answer("approve", "Ada", "f" * 12)
    ask(place)
    assert gate.verdict(place) == "pending" and "the answer of Ada on the page was not taken" in caplog.text
    page.answer("approve", "Ada", gate.seen_of(place.summary)["sha256"][:12])
    assert gate_question.hold(place.workspace, STAGE) is None
    assert gate.verdict(place) == "approved"


def test_an_answer_on_the_page_after_one_in_a_terminal_is_not_taken_and_says_so(
    place: gate.Gate, page: Page, caplog: pytest.LogCaptureFixture
) -> None:
    ask(place)
    seen = gate.seen_of(place.summary)["sha256"]
    gate.answer(place, False, gate.unix_user("Bob"), seen)
    page.answer("approve", "Ada", seen[:12])
    assert gate_question.hold(place.workspace, STAGE) is None
    assert gate.verdict(place) == "rejected" and "too late" in caplog.text and "rejected by Bob" in caplog.text


def test_an_automatic_answer_does_not_pass_a_gate_that_asks(place: gate.Gate, page: Page) -> None:
    gate.settle(place, automatic=True)
    ask(place)


def test_the_page_holds_tables_plots_and_commands_and_no_markup_from_outside(place: gate.Gate) -> None:
    come_in(place, 4, motion=EVIL)
    text = gate_page.page(gate.request(place), place)
    assert "| elbow | 10.0 |" in text.replace("\\", "") and "data:image/svg+xml;base64," in text
    assert f"bumblebee gate approve 1 --workspace {place.workspace} --seen " in text
    assert "<script" not in text and "[click]" not in text and "http://" not in text


def test_a_run_that_waits_at_a_gate_has_not_failed_and_is_not_complete() -> None:
    state = outcome({}, [STAGE], "gate@1")
    assert state.name == WAITING and not state.is_failed() and not state.is_completed()
    assert state.type == Cancelled().type


def test_where_two_must_approve_the_page_says_so_and_its_answer_is_not_taken(
    place: gate.Gate, page: Page, caplog: pytest.LogCaptureFixture
) -> None:
    (place.workspace / "params.yaml").write_text("gate: {mode: ask, people: 2}\n")
    ask(place)
    (question,) = page.shown.values()
    assert "2 people must answer, each by `bumblebee gate` in a terminal" in question
    seen = gate.seen_of(place.summary)["sha256"]
    page.answer("approve", "Ada", seen[:12])
    ask(place)
    assert gate.verdict(place, people=2) == "pending" and "a login of their own" in caplog.text
    for login in ("ann", "bob"):
        author = gate.Author(login, {"how": "unix user", "user": login, "uid": 1, "host": "lab"})
        gate.answer(place, True, author, seen, rule=gate.GateConfig(people=2))
    page.answer("approve", "bob", seen[:12])  # as the terminal resumes the run
    assert gate_question.hold(place.workspace, STAGE) is None
    assert gate.verdict(place, people=2) == "approved" and "too late" not in caplog.text


def test_more_asked_for_on_the_page_ends_the_run_waiting_until_other_data_come(place: gate.Gate, page: Page) -> None:
    ask(place)
    seen = gate.seen_of(place.summary)["sha256"][:12]
    page.answer("more", "Ada", seen, note="the wet floor")
    for _ in range(2):  # and so does each run that starts without them
        told = gate_question.hold(place.workspace, STAGE)
        assert (
            told is not None and "more asked for by Ada" in told and "the wet floor" in told and "add rollouts" in told
        )
    assert gate.verdict(place) == "more" and len(page.shown) == 1
    come_in(place, 9)
    ask(place)
    assert gate.verdict(place) == "pending" and len(page.shown) == 2


def test_more_without_a_note_is_not_taken_on_the_page(
    place: gate.Gate, page: Page, caplog: pytest.LogCaptureFixture
) -> None:
    ask(place)
    page.answer("more", "Ada", gate.seen_of(place.summary)["sha256"][:12])
    ask(place)
    assert gate.verdict(place) == "pending" and "expected what is wanted" in caplog.text


def test_more_asked_for_in_a_terminal_ends_the_suspended_run_so(
    place: gate.Gate, page: Page, caplog: pytest.LogCaptureFixture
) -> None:
    ask(place)
    seen = gate.seen_of(place.summary)["sha256"]
    gate.decide(place, "more", gate.unix_user("Bob"), seen, "the wet floor")
    page.answer("more", "Bob", seen[:12], note="the wet floor")  # as the terminal resumes the run
    told = gate_question.hold(place.workspace, STAGE)
    assert told is not None and "more asked for by Bob" in told and "too late" not in caplog.text


def test_a_gate_that_answers_itself_does_not_overrule_who_asked_for_more(place: gate.Gate, page: Page) -> None:
    gate.decide(place, "more", gate.unix_user("Bob"), gate.request(place)["seen"]["sha256"], "the wet floor")
    (place.workspace / "params.yaml").write_text("gate: {mode: auto}\n")
    assert "more asked for by Bob" in str(gate_question.hold(place.workspace, STAGE))


def test_the_page_says_who_asked_for_more(place: gate.Gate) -> None:
    gate.decide(place, "more", gate.unix_user("Bob"), gate.request(place)["seen"]["sha256"], EVIL)
    text = gate_page.page(gate.request(place), place)
    assert "**more asked for by Bob" in text and "Add rollouts" in text and " more 1 --workspace " in text
    assert "<script" not in text and "[click]" not in text
