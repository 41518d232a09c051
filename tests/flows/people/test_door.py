"""The door: whatever comes from elsewhere reaches the application under a person's rights, or not at all."""

import asyncio
import json
from pathlib import Path
from typing import Any

import pytest

from flows.gates.page_answer import PageAnswers
from flows.people import accounts as people
from flows.people import login
from flows.people.accounts import WRONG, People
from flows.people.door import BODY, Door
from flows.people.rights import Rights
from tests.flows.people.test_rights import NUMBER

ADDRESS = "https://data.lab:4200"
HOST = ("host", "data.lab:4200")
ALIAS = "/api/2.0/mlflow/registered-models/alias"
RUNS = "/api/flow_runs/filter"


class Asked:
    """A door before an application that says what reached it."""

    def __init__(self, folder: Path, server: str = "mlflow", address: str = ADDRESS) -> None:
        self.passwords = {name: people.add(folder, name, groups) for name, groups in (("ann", ("leads",)), ("bob", ()))}
        self.folder, self.people = folder, People(folder)
        self.door = Door(self.app, server, address, self.people, Rights(promote="leads"), "secret")
        self.reached: list[dict[str, Any]] = []
        self.bodies: list[bytes] = []

    async def app(self, scope: Any, receive: Any, send: Any) -> None:
        self.reached.append(scope)
        if scope["type"] == "websocket":
            await receive()
            await send({"type": "websocket.accept"})
            self.bodies.append((await receive())["text"].encode())
            await send({"type": "websocket.send", "text": "first"})
            people.remove(self.folder, "bob")
            await send({"type": "websocket.send", "text": "second"})
            return
        self.bodies.append((await receive())["body"])
        await send({"type": "http.response.start", "status": 299, "headers": []})
        await send({"type": "http.response.body", "body": b"in"})

    def pair(self, name: str) -> tuple[str, str]:
        """The header of somebody's login."""
        return ("authorization", login_header(f"{name}:{self.passwords.get(name, 'secret')}"))

    def ask(
        self, *headers: tuple[str, str], method: str = "GET", path: str = "/x", body: bytes = b""
    ) -> tuple[int, str]:
        """Status and body of the answer."""
        sent: list[dict[str, Any]] = []

        async def receive() -> dict[str, Any]:
            return {"type": "http.request", "body": body, "more_body": False}

        async def send(message: Any) -> None:
            sent.append(message)

        scope: dict[str, Any] = {"type": "http", "scheme": "http", "method": method, "path": path, "query_string": b""}
        scope["headers"] = [(name.encode(), value.encode()) for name, value in headers]
        asyncio.run(self.door(scope, receive, send))
        return sent[0]["status"], sent[1]["body"].decode()

    def socket(self, first: str, path: str = "/api/events/out") -> list[dict[str, Any]]:
        """Messages to a socket whose first message is this."""
        sent: list[dict[str, Any]] = []
        messages = [{"type": "websocket.receive", "text": first}, {"type": "websocket.connect"}]

        async def receive() -> dict[str, Any]:
            return messages.pop()

        async def send(message: Any) -> None:
            sent.append(message)

        scope = {"type": "websocket", "scheme": "ws", "path": path, "headers": [(b"host", HOST[1].encode())]}
        asyncio.run(self.door(scope, receive, send))
        return sent


def login_header(pair: str) -> str:
    import base64

    return "Basic " + base64.b64encode(pair.encode()).decode()


def test_behind_the_door_stands_the_workspaces_login_and_nothing_of_the_persons(tmp_path: Path) -> None:
    asked = Asked(tmp_path)
    assert asked.ask(HOST, asked.pair("ann"), ("origin", ADDRESS)) == (299, "in")
    headers = asked.reached[0]["headers"]
    assert headers == [(b"host", b"data.lab:4200"), (b"authorization", login.header("secret").encode())]
    assert asked.reached[0]["scheme"] == "https"


def test_the_workspaces_own_login_and_wrong_ones_open_nothing(tmp_path: Path) -> None:
    asked = Asked(tmp_path)
    right = asked.pair("ann")
    own = ("authorization", login.header("secret"))
    for headers in ((), (own,), (right, right), (("authorization", "Bearer x"),), (("authorization", "Basic %"),)):
        for method in ("GET", "POST", "OPTIONS", "DELETE"):
            assert asked.ask(HOST, *headers, method=method, path=ALIAS)[0] == 401
    assert asked.reached == []


def test_of_prefect_only_the_page_itself_is_shown_without_a_login(tmp_path: Path) -> None:
    asked = Asked(tmp_path, "prefect")
    for path in ("/", "/v2/runs", "/ui-settings", "/api/health"):
        assert asked.ask(HOST, path=path)[0] == 299
    own = ("authorization", login.header("secret"))
    for path, method in ((RUNS, "POST"), ("/api", "GET"), ("/api/admin/settings", "GET"), ("/", "POST")):
        asked.reached.clear()
        asked.ask(HOST, own, path=path, method=method)
        # Prefect itself refuses it, in the words that its page knows.
        assert all(name != b"authorization" for scope in asked.reached for name, _ in scope["headers"])


@pytest.mark.parametrize("host", ["evil.example", "data.lab", "data.lab:4201", "127.0.0.1:4200", "xdata.lab:4200", ""])
def test_another_name_for_this_machine_is_refused(tmp_path: Path, host: str) -> None:
    asked = Asked(tmp_path)
    assert asked.ask(("host", host), asked.pair("ann"))[0] == 403 and asked.reached == []


def test_without_a_port_the_usual_one_is_meant(tmp_path: Path) -> None:
    asked = Asked(tmp_path, address="https://data.lab")
    assert asked.ask(("host", "data.lab"), asked.pair("ann"), ("origin", "https://data.lab"))[0] == 299
    assert asked.ask(("host", "data.lab:443"), asked.pair("ann"))[0] == 299
    assert asked.ask(("host", "data.lab:444"), asked.pair("ann"))[0] == 403


@pytest.mark.parametrize("origin", ["http://data.lab:4200", "https://data.lab", "https://evil.example", "null"])
def test_another_origins_page_is_refused(tmp_path: Path, origin: str) -> None:
    asked = Asked(tmp_path)
    assert asked.ask(HOST, asked.pair("ann"), ("origin", origin))[0] == 403 and asked.reached == []


def test_what_a_person_may_not_do_is_refused_in_a_line_that_pages_and_clients_show(tmp_path: Path) -> None:
    asked = Asked(tmp_path)
    status, said = asked.ask(HOST, asked.pair("bob"), method="POST", path=ALIAS)
    assert status == 403 and json.loads(said)["message"] == json.loads(said)["detail"]
    assert "members of the group leads" in said and asked.reached == []
    assert asked.ask(HOST, asked.pair("ann"), method="POST", path=ALIAS)[0] == 299


def test_after_wrong_passwords_the_answer_is_to_wait(tmp_path: Path) -> None:
    asked = Asked(tmp_path)
    wrong = ("authorization", login_header("ann:guess"))
    assert [asked.ask(HOST, wrong)[0] for _ in range(WRONG + 1)] == [401] * WRONG + [429]
    assert asked.ask(HOST, asked.pair("bob"))[0] == 299


def test_a_run_may_be_cancelled_by_everybody_and_set_to_no_other_state(tmp_path: Path) -> None:
    asked = Asked(tmp_path, "prefect")
    path = f"/api/flow_runs/{NUMBER}/set_state"
    cancel = json.dumps({"state": {"type": "CANCELLING"}}).encode()
    assert asked.ask(HOST, asked.pair("bob"), method="POST", path=path, body=cancel)[0] == 299
    assert asked.bodies == [cancel]
    for body in (b'{"state": {"type": "COMPLETED"}}', b'{"state": []}', b"[", b"", b"[" * 100_000):
        assert asked.ask(HOST, asked.pair("bob"), method="POST", path=path, body=body)[0] == 403
    assert asked.ask(HOST, asked.pair("bob"), method="POST", path=path, body=b"x" * (BODY + 1))[0] == 413
    assert len(asked.reached) == 1


@pytest.mark.parametrize(
    "body",
    [
        b'{"name": "x", "artifact_location": "file:///etc"}',
        b'{"name": "x", "artifactLocation": "/etc"}',
        b'{"name": "x", "artifact_location": "mlflow-artifacts:/a/../../etc"}',
        b'{"name": "x", "artifact_location": "mlflow-artifacts://evil.example/a"}',
        b'{"name": "x", "artifact_location": "mlflow-artifacts:/a", "artifactLocation": "s3://evil/a"}',
        b'{"name": "x", "artifact_location": 3}',
        b'"{\\"name\\": \\"x\\", \\"artifact_location\\": \\"/etc\\"}"',
        b"",
    ],
)
def test_nobody_makes_an_experiment_whose_files_lie_elsewhere(tmp_path: Path, body: bytes) -> None:
    asked, path = Asked(tmp_path), "/api/2.0/mlflow/experiments/create"
    assert asked.ask(HOST, asked.pair("ann"), method="POST", path=path, body=body)[0] == 403 and asked.reached == []
    for good in (b'{"name": "x"}', b'{"name": "x", "artifact_location": "mlflow-artifacts:/runs"}'):
        assert asked.ask(HOST, asked.pair("ann"), method="POST", path=path, body=good)[0] == 299


def test_where_prefect_does_not_say_what_a_run_asks_no_answer_gets_past_the_door(tmp_path: Path) -> None:
    asked = Asked(tmp_path, "prefect")
    asked.door.answers = PageAnswers(tmp_path)
    status, said = asked.ask(HOST, asked.pair("bob"), method="POST", path=f"/api/flow_runs/{NUMBER}/resume", body=b"{}")
    assert status == 503 and "try again" in said
    assert [scope["method"] for scope in asked.reached] == ["GET"]


def test_a_socket_logs_in_as_a_person_and_is_closed_when_that_one_is_removed(tmp_path: Path) -> None:
    asked = Asked(tmp_path, "prefect")
    first = json.dumps({"type": "auth", "token": f"bob:{asked.passwords['bob']}"})
    said = asked.socket(first)
    assert json.loads(asked.bodies[0]) == {"type": "auth", "token": login.pair("secret")}
    assert [message["type"] for message in said] == ["websocket.accept", "websocket.send", "websocket.close"]


@pytest.mark.parametrize("first", ["", "[]", "{}", '{"type": "auth", "token": 3}', '{"type": "auth"}', "own", "wrong"])
def test_a_socket_without_a_persons_login_brings_prefect_an_empty_one(tmp_path: Path, first: str) -> None:
    asked = Asked(tmp_path, "prefect")
    tokens = {"own": login.pair("secret"), "wrong": "ann:guess"}
    asked.socket(json.dumps({"type": "auth", "token": tokens[first]}) if first in tokens else first)
    assert json.loads(asked.bodies[0]) == {"type": "auth", "token": ""}


@pytest.mark.parametrize("path", ["/api/events/in", "/api/work_pools/x/workers/connect", "/api/other"])
def test_sockets_that_a_person_may_not_use_bring_an_empty_login_too(tmp_path: Path, path: str) -> None:
    asked = Asked(tmp_path, "prefect")
    asked.socket(json.dumps({"type": "auth", "token": f"bob:{asked.passwords['bob']}"}), path)
    assert json.loads(asked.bodies[0])["token"] == ""


def test_mlflow_has_no_sockets(tmp_path: Path) -> None:
    asked = Asked(tmp_path)
    assert asked.socket("")[0]["type"] == "websocket.close" and asked.reached == []
