"""Nobody but the owner gets in: the secret's file, the guard before both servers, whose workspace it is."""

import asyncio
import os
import stat
from pathlib import Path
from typing import Any

import pytest

from bumblebee.errors import BadInput
from flows.environment import environment, without_login
from flows.people import guard, login
from flows.servers import front
from flows.servers.first_look import LoginHint

HOST = ("host", "127.0.0.1:4321")
OWN = ("origin", "http://127.0.0.1:4321")
LOGIN = ("authorization", login.header("secret"))


def ask(
    *headers: tuple[str, str], method: str = "GET", kind: str = "http", path: str = "/x", demand: bool = True
) -> Any:
    """(status, headers, body) that the guard answers, or the first message of a WebSocket; 299 when it hands on."""
    sent: list[dict[str, Any]] = []

    async def app(scope: Any, receive: Any, send: Any) -> None:
        if kind == "websocket":
            await send({"type": "websocket.accept"})
            return
        more = [(b"access-control-allow-origin", b"*"), (b"x-frame-options", b"ALLOW")]
        await send({"type": "http.response.start", "status": 299, "headers": more})
        await send({"type": "http.response.body", "body": b"in"})

    async def receive() -> dict[str, Any]:
        return {"type": "websocket.connect"}

    async def send(message: Any) -> None:
        sent.append(message)

    scope = {"type": kind, "method": method, "path": path, "query_string": b"nonce=n"}
    scope["headers"] = [(name.encode(), value.encode()) for name, value in headers]
    asyncio.run(guard.Guard(app, "secret", demand)(scope, receive, send))
    if kind == "websocket":
        return sent[0]["type"]
    return sent[0]["status"], dict(sent[0]["headers"]), sent[1]["body"]


def test_only_the_login_opens_the_door_whatever_the_method():
    wrong = ("authorization", login.header("guess"))
    for method in ("GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"):
        assert ask(HOST, LOGIN, method=method)[0] == 299
        for headers in ((HOST,), (HOST, wrong), (HOST, LOGIN, LOGIN), (HOST, ("authorization", "Basic"))):
            status, answer, _ = ask(*headers, method=method)
            assert status == 401 and answer[b"www-authenticate"].startswith(b"Basic")


def test_who_is_asked_for_the_login_is_told_user_and_file_in_the_answer_and_in_its_realm():
    _, headers, body = ask(HOST)
    said = body.decode().strip()
    assert "user bumblebee" in said and ".servers/login" in said
    assert f'realm="{said}"'.encode() in headers[b"www-authenticate"]


def test_prefects_pages_say_above_their_logins_field_what_to_give_and_everything_else_stays():
    page, sent = b"<html><head></head><body>", []

    async def app(scope: Any, receive: Any, send: Any) -> None:
        packed = any(name == b"accept-encoding" for name, _ in scope["headers"])
        content = b"packed" if packed else page
        headers = [(b"content-length", b"%d" % len(content)), (b"x-kept", b"1")]
        await send({"type": "http.response.start", "status": 200, "headers": headers})
        await send({"type": "http.response.body", "body": content})

    async def send(message: Any) -> None:
        sent.append(message)

    for kind in (b"text/html,*/*", b"*/*"):
        headers = [(b"accept", kind), (b"accept-encoding", b"gzip")]
        asyncio.run(LoginHint(app)({"type": "http", "headers": headers}, None, send))
    html, other = sent[1]["body"].decode(), sent[3]
    assert "whole line of the file .servers/login" in html.partition("</head>")[0] and html.endswith("<body>")
    assert sent[0]["headers"] == [(b"x-kept", b"1")]  # its length is another
    assert other["body"] == b"packed" and len(sent[2]["headers"]) == 2


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1.evil.example", "127.0.0.1:1@evil", "", "10.0.0.1:4321"])
def test_a_foreign_name_for_this_machine_is_refused_with_and_without_login(host: str):
    assert ask(("host", host), LOGIN)[0] == 403
    assert ask(("host", host), kind="websocket") == "websocket.close"
    assert ask(HOST, ("host", host), LOGIN)[0] == 403
    assert ask(LOGIN)[0] == 403


def test_a_tunnel_may_lead_to_another_port():
    assert ask(("host", "localhost:8080"), ("origin", "http://localhost:8080"), LOGIN)[0] == 299


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "http://127.0.0.1:9999", "https://127.0.0.1:4321"])
def test_another_origins_page_is_refused_whatever_it_asks(origin: str):
    for method in ("GET", "POST", "OPTIONS"):
        assert ask(HOST, ("origin", origin), LOGIN, method=method)[0] == 403
    assert ask(HOST, ("origin", origin), kind="websocket") == "websocket.close"
    assert ask(HOST, OWN, LOGIN, method="POST")[0] == 299
    assert ask(HOST, OWN, LOGIN, kind="websocket") == "websocket.accept"
    assert ask(HOST, kind="websocket") == "websocket.close"


def test_a_link_to_the_page_may_stand_anywhere_but_nothing_else_comes_from_another_site():
    cross = ("sec-fetch-site", "cross-site")
    assert ask(HOST, LOGIN, cross, ("sec-fetch-mode", "navigate"))[0] == 299
    assert ask(HOST, LOGIN, cross, ("sec-fetch-mode", "no-cors"))[0] == 403
    assert ask(HOST, LOGIN, cross, ("sec-fetch-mode", "navigate"), method="POST")[0] == 403


def test_every_answer_forbids_the_page_to_call_another_machine_or_to_be_framed():
    for answer in (ask(HOST, LOGIN)[1], ask(HOST)[1]):
        policy = answer[b"content-security-policy"].decode()
        assert "http" not in policy and "*" not in policy and "connect-src 'self'" in policy
        assert answer[b"x-frame-options"] == b"SAMEORIGIN" and b"access-control-allow-origin" not in answer


def test_that_a_server_is_ours_is_proved_without_the_password():
    status, _, body = ask(HOST, path=guard.ALIVE)
    assert (status, body.decode().strip()) == (200, guard.proof("secret", "n"))
    assert b"secret" not in body and guard.proof("secret", "n") != guard.proof("secret", "m")
    assert ask(("host", "evil.example"), path=guard.ALIVE)[0] == 403


def test_the_secret_is_made_for_the_owner_alone_and_kept(tmp_path: Path):
    old = os.umask(0)
    try:
        folder = login.private(tmp_path / ".servers")
        first = login.ensure(folder)
    finally:
        os.umask(old)
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    assert stat.S_IMODE((folder / login.NAME).stat().st_mode) == 0o600
    assert login.ensure(folder) == first == login.read(folder) and len(first) >= 40


@pytest.mark.parametrize("spoil", ["readable", "link", "empty", "folder"])
def test_a_secret_that_others_could_know_is_replaced(tmp_path: Path, spoil: str):
    folder = login.private(tmp_path / ".servers")
    first, path = login.ensure(folder), folder / login.NAME
    if spoil == "readable":
        path.chmod(0o644)
    elif spoil == "link":
        path.rename(tmp_path / "known")
        path.symlink_to(tmp_path / "known")
    elif spoil == "empty":
        path.write_text("")
    else:
        path.unlink()
        assert login.read(folder) is None
    assert login.read(folder) is None
    again = login.ensure(folder)
    assert again != first and login.read(folder) == again


def test_a_folder_that_was_open_to_all_is_closed_and_a_link_is_refused(tmp_path: Path):
    (tmp_path / "open").mkdir(mode=0o755)
    assert stat.S_IMODE(login.private(tmp_path / "open").stat().st_mode) == 0o700
    (tmp_path / "link").symlink_to(tmp_path / "open")
    with pytest.raises(BadInput, match="a folder of your own, came a link"):
        login.private(tmp_path / "link")


def test_programs_of_the_owner_get_the_login_and_stages_do_not(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("PREFECT_API_AUTH_STRING", "of:another")
    monkeypatch.setenv("NO_PROXY", "example.org")
    assert "PREFECT_API_AUTH_STRING" not in environment(tmp_path)
    password = login.ensure(login.private(tmp_path / ".servers"))
    found = environment(tmp_path)
    assert found["PREFECT_API_AUTH_STRING"] == f"bumblebee:{password}"
    assert found["NO_PROXY"] == "example.org,127.0.0.1,localhost"
    assert not any(password in value for value in without_login(found).values())


def test_mlflow_still_reads_the_settings_that_we_hand_to_its_application():
    from mlflow.environment_variables import _MLFLOW_SGI_NAME
    from mlflow.server import constants

    names = {getattr(constants, f"{name}_ENV_VAR") for name in (
        "BACKEND_STORE_URI", "REGISTRY_STORE_URI", "ARTIFACT_ROOT", "ARTIFACTS_DESTINATION", "SERVE_ARTIFACTS"
    )}  # fmt: skip
    assert set(front.MLFLOW) == names | {_MLFLOW_SGI_NAME.name}
