"""Promotion that asks people: the alias waits for them, and an answer holds for this policy and these figures alone."""

import getpass
import json
import shlex
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from bumblebee.errors import BadInput
from bumblebee.learning.export import write_export
from bumblebee.tracking.sampling.library import AHEAD
from flows.gates.gate_cli import app
from tasks import publish
from tasks.approvals import gate, ledger
from tasks.approvals.promotion import answer as promotion_answer
from tasks.approvals.promotion import gate as promotion_gate
from tasks.approvals.promotion.approved import let_through
from tests.policy.conftest import linear_onnx
from tests.tasks import test_publish as of_publish
from tests.tasks.approvals.test_gate_people import person
from tests.tasks.test_publish import PARAMS, evaluated, trained_again, written


class Registry(of_publish.Registry):
    """That of the tests of publish, which keeps what is asked here, too."""

    def register(self, name: str, folder: Path, tags: dict[str, str], metrics: dict[str, Any], card: str) -> str:
        same = [number for number, made in enumerate(self.versions, 1) if made == (name, tags)]
        return str(same[0]) if same else super().register(name, folder, tags, metrics, card)

    def version_tags(self, name: str, version: str) -> dict[str, str] | None:
        return self.versions[int(version) - 1][1]

    def version_card(self, name: str, version: str) -> str:
        return f"card of {version}"


class Killed(Exception):
    """How a process ends in the midst of it."""


def killed(*given: str) -> None:
    raise Killed


@pytest.fixture
def registry(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Registry:
    """In a workspace where every policy succeeds."""
    monkeypatch.chdir(tmp_path)
    made = Registry()
    for module in (publish, promotion_gate):
        monkeypatch.setattr(module, "registry", made)
    monkeypatch.setattr(publish, "path_hash", lambda folder: "hash")
    monkeypatch.setattr(publish, "log_run", lambda *_, **__: None)
    settings("mode: ask")
    for folder in ("models/base", "models/experts/r0/c0", "models/experts/r0/c1", "models/generalist"):
        Path(folder).mkdir(parents=True)
        write_export(Path(folder), linear_onnx(0.0), AHEAD)
    evaluated("abc")
    return made


def settings(promotion: str) -> None:
    text = PARAMS.replace("publish: {}", f"publish: {{replace_incomparable: true, promotion: {{{promotion}}}}}")
    Path("params.yaml").write_text(text + "gate: {}\n")


def place(model: str = "generalist") -> promotion_gate.Promotion:
    return promotion_gate.Promotion(Path.cwd(), model)


def say(verb: str, login: str = "ann", model: str = "generalist", **more: Any) -> dict[str, Any]:
    seen = promotion_answer.asked(place(model))["seen"]["sha256"]
    promotion_answer.given(place(model), verb, person(login), seen, "because", more.get("change", False))
    return gate.read_approval(place(model).approval)


def test_versions_are_made_and_wait_and_the_stage_ends(registry: Registry, capsys: pytest.CaptureFixture[str]) -> None:
    publish.main()
    assert registry.champions == {} and len(registry.versions) == 3
    facts = written()["models"]["generalist"]
    assert facts["champion"] is None and not facts["promoted"] and "asks people" in facts["reason"]
    assert promotion_answer.asked(place())["status"] == "pending"
    said = capsys.readouterr().out
    assert "promotion of generalist waits for an answer" in said
    assert f"bumblebee gate approve generalist --workspace {Path.cwd()} --seen " in said


def test_an_approval_moves_the_alias_of_this_model_alone_and_says_who_saw_what(registry: Registry) -> None:
    publish.main()
    table = say("approve")
    version = written()["models"]["generalist"]["version"]
    assert registry.champions == {"generalist": version} and registry.described == {"generalist": f"card of {version}"}
    (line,) = [entry["answer"] for entry in ledger.check(Path("data/approvals"))]
    policy = gate.file_hash(Path("models/generalist/policy.onnx"))
    assert (line["model"], line["status"], line["known_by"]["user"]) == ("generalist", "approved", "ann")
    assert line["seen"] == table["seen"] and line["seen"]["onnx_sha256"] == policy
    assert (line["seen"]["version"], line["seen"]["success"], line["seen"]["champion"]) == (version, 1.0, None)


@pytest.mark.parametrize(("verb", "status"), [("reject", "rejected"), ("more", "more")])
def test_no_and_more_leave_the_champion_also_when_the_stage_runs_again(
    registry: Registry, verb: str, status: str, capsys: pytest.CaptureFixture[str]
) -> None:
    publish.main()
    assert say(verb)["status"] == status
    capsys.readouterr()
    publish.main()
    assert registry.champions == {} and promotion_answer.asked(place())["status"] == status
    assert "because" in capsys.readouterr().out
    with pytest.raises(BadInput, match=r"promotion of generalist: expected no answer yet.*Ann.*--change"):
        say("approve", "bob")
    assert say("approve", "bob", change=True)["status"] == "approved" and "generalist" in registry.champions


def test_two_people_approve_before_the_alias_moves(registry: Registry) -> None:
    settings("mode: ask, people: 2")
    publish.main()
    assert say("approve", "ann")["status"] == "pending" and registry.champions == {}
    with pytest.raises(BadInput, match="a second one by ann"):
        say("approve", "ann")
    publish.main()  # changes nothing of it
    assert say("approve", "bob")["status"] == "approved" and "generalist" in registry.champions


def test_only_the_groups_members_answer_and_the_line_names_the_setting(registry: Registry) -> None:
    settings("mode: ask, group: no-such-group-here")
    publish.main()
    with pytest.raises(BadInput, match=r"publish\.promotion\.group: expected a group of this machine"):
        say("approve")


def test_a_policy_that_changed_since_voids_approvals_and_is_published_first(registry: Registry) -> None:
    settings("mode: ask, people: 2")
    publish.main()
    say("approve", "ann")
    trained_again()
    with pytest.raises(BadInput, match=r"expected the policy\.onnx that was published, came another one.*publish"):
        say("approve", "bob")
    assert registry.champions == {}
    publish.main()
    table = promotion_answer.asked(place())
    assert table["status"] == "pending" and not table.get("approvals") and table["history"][-1]["by"] == "Ann"
    assert say("approve", "bob")["status"] == "pending" and registry.champions == {}


def test_other_figures_of_the_same_policy_are_asked_about_anew(registry: Registry) -> None:
    settings("mode: ask, people: 2")
    publish.main()
    before = promotion_answer.asked(place())["seen"]["sha256"]
    say("approve", "ann")
    evaluated("another")
    publish.main()
    with pytest.raises(BadInput, match="--seen"):
        promotion_answer.given(place(), "approve", person("bob"), before, "", False)
    assert say("approve", "bob")["status"] == "pending"


def test_a_champion_that_others_made_meanwhile_is_compared_first(registry: Registry) -> None:
    publish.main()
    registry.champions["generalist"] = "1"
    with pytest.raises(BadInput, match=r"expected champion none, with which it was compared, came version 1\."):
        say("approve")
    assert promotion_answer.asked(place())["status"] == "pending"


def test_an_approval_whose_process_was_killed_before_the_alias_moved_is_made_up_for(
    registry: Registry, monkeypatch: pytest.MonkeyPatch
) -> None:
    publish.main()
    for again in (publish.main, lambda: say("approve", "bob")):
        with monkeypatch.context() as patched:
            patched.setattr(registry, "set_alias", killed)
            with pytest.raises(Killed):
                say("approve", change=True)
        assert registry.champions == {} and promotion_answer.asked(place())["status"] == "approved"
        again()
        assert registry.champions.pop("generalist") == written()["models"]["generalist"]["version"]


def test_a_version_that_the_numbers_hold_back_is_not_asked_about(registry: Registry) -> None:
    publish.main()
    say("approve")
    publish.main()  # the same file again
    assert "proposal" not in written()["models"]["generalist"]
    with pytest.raises(BadInput, match="promotion of generalist: expected a version that is proposed, came none"):
        say("approve")


def test_a_version_that_is_champion_is_not_rejected_any_more(registry: Registry) -> None:
    publish.main()
    say("approve")
    version = registry.champions["generalist"]
    with pytest.raises(BadInput, match=rf"expected a version that is not champion yet, came version {version}"):
        say("reject", "bob", change=True)
    assert promotion_answer.asked(place())["status"] == "approved"


def test_without_asking_all_is_as_before(registry: Registry) -> None:
    settings("mode: auto")
    publish.main()
    assert set(registry.champions) == {"base", "expert-c0", "generalist"} and not Path("data/approvals").exists()
    assert all("proposal" not in facts for facts in written()["models"].values())


def test_later_versions_of_one_run_are_measured_by_the_one_that_waits(registry: Registry) -> None:
    """As they would be by the champion, were nobody asked."""
    publish.main()
    standard = publish.Standard("abc", "stand_in", False, asks=True)
    candidate = next(one for one in publish.candidates(publish.loop()) if one.model == "generalist")
    proposed = written()["models"]["generalist"]["proposal"]
    good, bad = ({"value": v, "ci95": [v, v]} for v in (1.0, 0.2))
    rest = {"mpjpe_rad": {"value": 0.1}, "mpkpe_mm": {"value": 30.0}, "episodes": 1, "motions": 1}
    trained_again()
    related = publish.against_parent(None)
    shown = json.loads(Path("data/evaluation/summary.json").read_text())["results"][0]
    for success, version in ((good, "4"), (bad, proposed["version"])):
        result = {**shown, **rest, "success": success}
        facts = publish.publish(candidate, result, standard, related, proposed)
        assert facts["proposal"]["version"] == version


def test_the_command_lists_shows_and_answers_it_under_the_login(registry: Registry) -> None:
    publish.main()

    def typed(*words: str) -> str:
        result = CliRunner().invoke(app, list(words))
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        return " ".join(result.output.split())

    assert "generalist" in typed("list") and "base" in typed("list")
    seen = promotion_answer.asked(place())["seen"]["sha256"][:12]
    shown = typed("show", "generalist")
    assert "policy.onnx" in shown and seen in shown and "gate approve generalist" in shown
    assert f"--seen {seen} --note WHY" in shown  # a rejection says why
    said = typed("approve", "generalist", "--seen", seen)
    assert f"approved by {getpass.getuser()}" in said and "is champion" in said
    assert "generalist" in registry.champions
    with pytest.raises(BadInput, match="a round, or a model's name"):
        typed("show", "../x")
    with pytest.raises(BadInput, match="expected a version that is proposed"):
        typed("show", "nothing-of-that-name")


def test_only_the_file_that_people_approved_last_is_let_onto_a_robot(registry: Registry) -> None:
    here, file = Path.cwd(), Path("models/generalist/policy.onnx")
    assert "no person was asked" in let_through("generalist", file, here)
    publish.main()
    for verb, status in ((None, "no answer"), ("reject", "rejected"), ("more", "more")):
        if verb:
            say(verb, change=verb == "more")
        with pytest.raises(BadInput, match=f"generalist.*came {status}") as refused:
            let_through("generalist", file, here)
    shown = str(refused.value).partition("Run: bumblebee gate ")[2]
    assert CliRunner().invoke(app, shlex.split(shown)).exit_code == 0
    assert say("approve", change=True)["status"] == "approved"
    assert "approved by" in let_through("generalist", file, here)
    with pytest.raises(BadInput, match="no answer"):
        let_through("generalist", Path("params.yaml"), here)
