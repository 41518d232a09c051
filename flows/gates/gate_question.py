"""The question at a gate: show what came, wait for a person, write down the answer given on Prefect's page."""

from itertools import count
from pathlib import Path
from typing import Any, Literal

from prefect import get_run_logger, runtime, suspend_flow_run
from prefect.artifacts import create_markdown_artifact
from prefect.input import RunInput, read_flow_run_input
from pydantic import Field, create_model

from bumblebee.errors import BadInput
from flows.gates import gate_page
from flows.stages import Stage
from tasks.approvals import gate, words
from tasks.gate import asked, rule
from tasks.lab.serve import read_serve

SEEN = "Hash of what was shown to you: the answer holds for nothing else."
CHOICE = "approve: the round goes on; reject: it stops here; more: it waits for more rollouts, and the note says which."
PAGE = {"how": "Prefect's page: whoever holds the login of this workspace"}  # more cannot be known of who clicked


class GateAnswer(RunInput):
    """Answer of a person on Prefect's page; nothing is chosen beforehand."""

    answer: Literal["approve", "reject", "more"] = Field(description=CHOICE)
    by: str = Field(description="Your name.", min_length=1, max_length=gate.LONGEST)
    seen: str = Field(description=SEEN)
    note: str = Field(default="", description="Why; with `more` what is wanted.", max_length=gate.LONGEST)


def hold(folder: Path, stage: Stage) -> str | None:
    """Ask at a gate whose round has come in; None when the gate stage can run (it passes, or says who rejected).

    A run that Prefect started as a deployment is suspended: its process ends, the question stands on Prefect's page,
    and the answer starts it again, after any restart. Any other run gets the line that says how to answer, to end with,
    and every run does where somebody asked for more: no answer but other data lets it go on.
    """
    place = gate.Gate(folder.resolve(), int(stage.option("round") or 0))
    own = rule(folder)
    if not place.summary.exists():
        return None
    if own.mode == "auto" and gate.settle(place, True, own.people)["status"] != "more":
        return None  # settled here where the intake's files came from a cache, and no stage ran that could
    request = asked(place)
    deployed = runtime.deployment.id is not None
    if deployed and request["status"] == "pending":
        request = ask(place, request)
    elif deployed:
        say_if_late(request)
    if request["status"] not in gate.WAITS:
        return None
    show(place, request)
    then = "; then start again, it goes on from here" if request["status"] == "pending" else ""
    return words.how_to_answer(place.workspace, request) + then


def show(place: gate.Gate, request: dict[str, Any], run: str | None = None) -> str:
    """Put what came on a page of its own; its number."""
    text = f"What came in round {place.round}; an answer to it names {words.short(request)}"
    made = create_markdown_artifact(
        gate_page.page(request, place, run or ""), key=f"gate-round-{place.round}", description=text
    )
    return str(made)


def ask(place: gate.Gate, request: dict[str, Any]) -> dict[str, Any]:
    """Suspend the run until a person answers what it shows; the request with that answer.

    One that cannot be taken is asked for anew.

    The pause is named after the hash of what is shown: data that change meanwhile are another pause with a question of
    its own, and the answer to the first is never applied to them.
    """
    log = get_run_logger()
    for attempt in count():
        key = pause_key(request, attempt)
        description = None
        if answered(key) is None:  # the run comes here again after the answer
            personal = read_serve(place.workspace) is not None
            asked_of = gate_page.asked_of(rule(place.workspace), personal)
            description = gate_page.question(request, show(place, request, runtime.flow_run.id)) + asked_of
            log.warning(gate_page.where_to_answer(place.round, runtime.flow_run.ui_url))
        model = form(words.short(request), description)
        given: Any = suspend_flow_run(wait_for_input=model, timeout=None, key=key)
        if (found := asked(place))["status"] != "pending":  # by a terminal or a personal login, which resumed this run
            return found
        try:
            author = gate.Author(given.by, PAGE)
            table = gate.decide(place, given.answer, author, given.seen, given.note, rule=rule(place.workspace))
            log.info(f"round {place.round}: {words.said(table)}")
            return table
        except BadInput as error:
            log.warning(f"the answer of {words.one_line(given.by)} on the page was not taken: {error}")
        request = asked(place)
        if request["status"] != "pending":
            return request
    raise AssertionError("count() has no end")


def form(seen: str, description: str | None) -> type[GateAnswer]:
    """The form of one question, with the hash of what it shows filled in."""
    filled: Any = (str, Field(default=seen, description=SEEN))
    made: type[GateAnswer] = create_model("GateAnswer", __base__=GateAnswer, seen=filled)
    made._description = description
    return made


def pause_key(request: dict[str, Any], attempt: int) -> str:
    """The name of one question: round, what it shows, how often it was asked in vain."""
    return f"gate-{request['round']}-{words.short(request)}-{attempt}"


def answered(key: str) -> dict[str, Any] | None:
    """Answer on Prefect's page to the question of this name, if anything."""
    found = read_flow_run_input(f"suspended-{key}-response")
    return found if isinstance(found, dict) else None


def say_if_late(request: dict[str, Any]) -> None:
    """Log an answer from the page that came after another one: it was not taken."""
    given = answered(pause_key(request, 0)) or {}
    if given and gate.ANSWERS.get(str(given.get("answer"))) != request["status"]:
        late = words.one_line(f"{given.get('answer')} by {given.get('by')}")
        get_run_logger().warning(f"{late} on the page came too late: round {request['round']} is {words.said(request)}")
