"""Both servers as they are, and their pages in a browser: a run, its stages, a gate's answer, a champion."""

import asyncio
import json
import os
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
import yaml

from flows.loop import WAITING
from flows.people import login
from flows.servers import servers
from tasks.approvals import gate
from tests.flows.servers.served import CHROMIUM, LIMIT, Served, make, register

if TYPE_CHECKING:
    from playwright.sync_api import Page


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    folder = make(tmp_path_factory.mktemp("pages") / "lab")
    register(folder)
    before = {name: value for name, value in os.environ.items() if not name.startswith(("PREFECT_API", "MLFLOW_TR"))}
    command = [sys.executable, "-m", "flows.servers.serve"]
    process = subprocess.Popen(command, cwd=folder, env=before, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    end = time.monotonic() + LIMIT
    while (found := servers.running(folder)) is None:
        assert process.poll() is None and time.monotonic() < end, process.communicate()
        time.sleep(0.2)
    password = login.read(folder / ".servers")
    assert password is not None
    yield Served(folder, found, password)
    process.terminate()
    said = process.communicate(timeout=60)[0].decode()
    assert process.returncode == 0 and "servers stopped" in said and password not in said
    for log in (folder / ".servers").glob("*.log"):
        assert password not in log.read_text()


def code(url: str, method: str = "GET", body: Any = None, **headers: str) -> int:
    """The status of an answer."""
    data = None if body is None else json.dumps(body).encode()
    headers = {name.replace("_", "-"): value for name, value in headers.items()}
    asked = urllib.request.Request(url, data, {"Content-Type": "application/json", **headers}, method=method)
    try:
        with urllib.request.build_opener(urllib.request.ProxyHandler({})).open(asked, timeout=60) as reply:
            return int(reply.status)
    except urllib.error.HTTPError as error:
        return error.code


PREFECT = [
    ("POST", "flow_runs/filter", {}),
    ("POST", "deployments/filter", {}),
    ("POST", "flow_runs/", {}),
    ("GET", "admin/settings", None),
    ("POST", "admin/database/clear", {"confirm": True}),
]
MLFLOW = [
    ("GET", "/", None),
    ("GET", "/health", None),
    ("GET", "/api/2.0/mlflow/registered-models/search", None),
    ("GET", "/ajax-api/2.0/mlflow/registered-models/search", None),
    ("POST", "/api/2.0/mlflow/registered-models/alias", {"name": "expert-c0", "alias": "champion", "version": "1"}),
    ("GET", "/api/2.0/mlflow-artifacts/artifacts", None),
    ("PUT", "/api/2.0/mlflow-artifacts/artifacts/x", {}),
    ("POST", "/ajax-api/3.0/mlflow/assistant/message", {}),
    ("POST", "/v1/traces", {}),
    ("POST", "/graphql", {}),
]


def test_without_the_login_neither_server_does_anything(served: Served):
    wrong = login.header("guess")
    for method, what, body in PREFECT:
        assert code(f"{served.addresses.prefect}/api/{what}", method, body) == 401, what
        assert code(f"{served.addresses.prefect}/api/{what}", method, body, Authorization=wrong) == 401, what
    for method, what, body in MLFLOW:
        assert code(served.addresses.mlflow + what, method, body) == 401, what
        assert code(served.addresses.mlflow + what, method, body, Authorization=wrong) == 401, what


def test_with_the_login_a_foreign_host_or_page_is_refused_all_the_same(served: Served):
    right = login.header(served.password)
    search = f"{served.addresses.mlflow}/api/2.0/mlflow/registered-models/search"
    filtered = f"{served.addresses.prefect}/api/flow_runs/filter"
    assert code(search, Authorization=right) == 200 and code(filtered, "POST", {}, Authorization=right) == 200
    for foreign in ({"Host": "evil.example"}, {"Origin": "http://evil.example"}, {"Origin": "null"}):
        assert code(search, Authorization=right, **foreign) == 403
        assert code(filtered, "POST", {}, Authorization=right, **foreign) == 403


def test_prefects_sockets_want_the_login_too(served: Served):
    from websockets.asyncio.client import connect
    from websockets.exceptions import ConnectionClosed

    async def first_answer(token: str, path: str) -> str:
        url = served.addresses.prefect.replace("http", "ws") + path
        async with connect(url, subprotocols=["prefect"], proxy=None) as socket:  # type: ignore[list-item]
            await socket.send(json.dumps({"type": "auth", "token": token}))
            return str(await socket.recv())

    for path in ("/api/events/in", "/api/events/out", "/api/logs/out"):
        with pytest.raises(ConnectionClosed):
            asyncio.run(first_answer("guess", path))
    assert "auth_success" in asyncio.run(first_answer(login.pair(served.password), "/api/events/out"))


def test_a_run_in_another_folder_fails_with_one_line_before_anything_there_is_read(served: Served, tmp_path: Path):
    (tmp_path / "dvc.yaml").write_text(yaml.safe_dump({"stages": {"x": {"cmd": "touch mark", "outs": ["mark"]}}}))
    before = sorted(tmp_path.rglob("*"))
    run = served.start(workspace=str(tmp_path))
    state = served.until(run["id"], "Failed", "Crashed", "Completed")
    assert state["name"] == "Failed" and state["message"].count("\n") == 0
    assert f"the run's workspace: expected {served.folder} or none" in state["message"]
    assert sorted(tmp_path.rglob("*")) == before


@pytest.fixture(scope="module")
def page(served: Served) -> Iterator["Page"]:
    if CHROMIUM is None:
        pytest.skip("no Chromium on the path: install chromium to try the pages")
    from playwright.sync_api import sync_playwright

    user = {"username": login.USER, "password": served.password, "origin": served.addresses.mlflow}
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        context = browser.new_context(viewport={"width": 1440, "height": 900}, http_credentials=user)
        context.set_default_timeout(LIMIT * 1000)
        left: list[str] = []
        own = (served.addresses.prefect, served.addresses.mlflow, "data:", "blob:")
        context.on("request", lambda request: None if request.url.startswith(own) else left.append(request.url))
        context.on("response", lambda reply: None if reply.url.startswith(own) else left.append(reply.url))
        yield context.new_page()
        browser.close()
    assert left == [], "a page called another machine"


def look(page: "Page", name: str) -> None:
    """Keep pictures where PAGES_SHOTS says, wide and narrow."""
    if folder := os.environ.get("PAGES_SHOTS"):
        for width in (390, 1440):
            page.set_viewport_size({"width": width, "height": 900})
            page.wait_for_timeout(1500)
            page.screenshot(path=Path(folder) / f"{name}-{width}.png")


def resume_on(page: "Page") -> None:
    """Press the open dialog's button until Prefect takes the answer; its database may be busy for a moment."""
    for _ in range(20):
        with page.expect_response(lambda reply: reply.url.endswith("/resume")) as told:
            page.get_by_role("dialog").get_by_role("button", name="Resume").click()
        if told.value.status != 503:
            break
    assert told.value.json()["status"] == "ACCEPT", told.value.text()


@pytest.mark.browser
def test_a_person_logs_in_watches_a_run_and_answers_its_gate_on_prefects_page(served: Served, page: "Page"):
    run = served.start()
    page.goto(f"{served.addresses.prefect}/v2/runs/flow-run/{run['id']}")
    shown = page.get_by_placeholder("admin:pass")
    shown.wait_for()
    hint = "getComputedStyle(document.querySelector('form:has([placeholder])'), '::before').content"
    assert ".servers/login" in page.evaluate(hint)
    look(page, "prefect-login")
    shown.fill(login.pair(served.password))
    page.get_by_role("button", name="Login").click()
    page.get_by_role("tab", name="Task Runs").wait_for()
    served.until(run["id"], "Suspended")
    page.goto(f"{served.addresses.prefect}/v2/runs/flow-run/{run['id']}?tab=TaskRuns")
    page.get_by_role("tab", name="Task Runs").click()
    for stage in ("one", "two"):
        page.get_by_role("link", name=stage, exact=True).wait_for()
    look(page, "prefect-run")
    page.get_by_role("button", name="Open menu").click()
    page.get_by_role("menuitem", name="Resume").click()
    dialog = page.get_by_role("dialog")
    dialog.get_by_text("3 files accepted").wait_for()
    look(page, "prefect-gate")
    dialog.get_by_text("Select", exact=True).click()
    page.get_by_role("option", name="approve").click()
    dialog.locator("textarea").first.fill("Ada")
    resume_on(page)
    assert served.until(run["id"], "Completed", "Failed", "Crashed")["name"] == "Completed"
    answer = json.loads((served.folder / "data" / "approvals" / "round-1.json").read_text())
    assert (answer["status"], answer["by"]) == ("approved", "Ada")
    assert answer["known_by"]["how"].startswith("Prefect's page")
    assert (served.folder / "g.txt").exists()


def test_more_asked_for_on_prefects_page_ends_the_run_waiting_and_other_data_are_asked_about_anew(served: Served):
    """By the call that the page makes."""
    place = gate.Gate(served.folder, 1)
    summary = json.loads(place.summary.read_text())
    for accepted in (5, 9):
        place.summary.write_text(json.dumps(summary | {"accepted": accepted}))
        seen = gate.request(place)["seen"]["sha256"][:12]
        run = served.start()
        served.until(run["id"], "Suspended")
        given = {"answer": "more" if accepted == 5 else "approve", "by": "Ada", "seen": seen, "note": "the wet floor"}
        assert served.resume(run["id"], **given)["status"] == "ACCEPT"
        ended = served.until(run["id"], WAITING, "Completed")
        assert ended["name"] == (WAITING if accepted == 5 else "Completed")
    answer = gate.read_approval(place.approval)
    assert (answer["status"], answer["history"][-1]["status"]) == ("approved", "more")


@pytest.mark.browser
def test_the_older_page_of_prefect_finds_its_server_too(served: Served, page: "Page"):
    page.context.add_cookies([{"name": "prefect_ui_version", "value": "v1", "url": served.addresses.prefect}])
    page.goto(f"{served.addresses.prefect}/deployments")
    page.get_by_text("demo").first.wait_for()
    assert page.get_by_text("Can't connect to Server API").count() == 0


@pytest.mark.browser
def test_mlflows_page_opens_on_the_models_with_nothing_over_them(served: Served, page: "Page"):
    page.goto(served.addresses.mlflow)
    page.get_by_role("link", name="expert-c0").first.wait_for()
    assert page.get_by_role("dialog").count() == page.get_by_text("Ask questions about").count() == 0
    page.get_by_text("champion").first.wait_for()
    look(page, "mlflow-registry")
