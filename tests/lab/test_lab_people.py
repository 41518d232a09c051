"""Both servers for people from elsewhere, over their own TLS and through nginx: who gets in, and who may what."""

import asyncio
import json
import os
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from flows.environment import SERVERS
from flows.people import accounts as people
from tasks.approvals import gate
from tasks.lab.checks import check_lab
from tasks.lab.servers import Lab, MlflowLab, PrefectLab
from tests.flows.servers.served import CHROMIUM, asks_not_yet
from tests.lab import doors
from tests.lab.conftest import LabOnThisMachine
from tests.lab.doors import Doors, first_answer
from tests.lab.programs import FLOW, LOG, LOOK, MODEL, STAGE


@pytest.fixture(scope="module", params=["its own TLS", "nginx"])
def served(
    request: pytest.FixtureRequest, lab: LabOnThisMachine, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Doors]:
    proxied = request.param == "nginx"
    if proxied and doors.NGINX is None:
        (pytest.fail if "BUMBLEBEE_LAB_TEST" in os.environ else pytest.skip)("no nginx here (Debian: nginx-light)")
    with doors.opened(tmp_path_factory.mktemp("people") / "shared", lab.content(), proxied) as made:
        yield made


def looks(served: Doors) -> list[tuple[str, Any]]:
    """Something to look at on each server."""
    return [
        (f"{served.prefect}/api/flow_runs/filter", {}),
        (f"{served.mlflow}/api/2.0/mlflow/registered-models/search?max_results=9", None),
        (f"{served.mlflow}/", None),
    ]


def test_a_login_is_asked_for_and_only_peoples_own_are_right(served: Doors) -> None:
    for url, body in looks(served):
        assert served.code(url, "", body) == 401
        assert served.code(url, "ann:guess", body) == 401
        assert served.code(url, "bumblebee", body) == 401, "the workspace's own login works on its machine alone"
        assert served.code(url, "eve:" + served.passwords["ann"], body) == 401
        for name in served.passwords:
            assert served.code(url, name, body) == 200
    assert served.code(f"{served.prefect}/") == 200, "Prefect's page, which then asks for the login"


def test_another_host_or_page_is_refused_with_a_right_login_too(served: Doors) -> None:
    for url, body in looks(served):
        for headers in ({"Host": "evil.example"}, {"Origin": "https://evil.example"}, {"Origin": "null"}):
            assert served.code(url, "ann", body, **headers) in (403, 404), headers
        assert served.code(url, "ann", body, Origin="/".join(url.split("/")[:3])) == 200


def test_who_is_removed_is_out_at_once(served: Doors) -> None:
    url, _ = looks(served)[1]
    password = people.add(served.folder / SERVERS, "dora", ())
    assert served.code(url, f"dora:{password}") == 200
    people.remove(served.folder / SERVERS, "dora")
    assert served.code(url, f"dora:{password}") == 401


def name_of(served: Doors) -> str:
    """A model of these doors: all have one database."""
    return f"expert-{served.mlflow.rpartition(':')[2]}"


def test_only_the_group_of_lab_yaml_moves_a_champion_and_everybody_sees_it(served: Doors, tmp_path: Path) -> None:
    model, at = name_of(served), f"{served.mlflow}/api/2.0/mlflow/registered-models"
    done = served.program("ann", MODEL, tmp_path, model)
    assert done.returncode == 0, done.stderr[-2000:]
    body = {"name": model, "alias": "champion", "version": "1"}
    for name in ("bob", "carl"):
        for method, what in (("POST", "alias"), ("DELETE", "alias"), ("DELETE", "delete"), ("POST", "set-tag")):
            code, said = served.answer(f"{at}/{what}", name, body, method)
            assert code == 403 and b"members of the group leads may do this (lab.yaml, serve.promote)" in said
    done = served.program("bob", MODEL, tmp_path, model)
    assert done.returncode and "members of the group leads may do this" in done.stderr
    done = served.program("carl", LOOK, tmp_path, model)
    assert done.returncode == 0 and done.stdout.startswith("1 ["), done.stderr[-2000:]


def test_writers_log_runs_with_files_and_readers_do_not(served: Doors, tmp_path: Path) -> None:
    assert "members of the group robotics" in served.program("carl", LOG, tmp_path).stderr
    done = served.program("bob", LOG, tmp_path)
    assert done.returncode == 0, done.stderr[-2000:]
    run = done.stdout.split()[-1]
    found = json.loads(served.answer(f"{served.mlflow}/api/2.0/mlflow/runs/get?run_id={run}", "carl")[1])["run"]
    assert found["data"]["metrics"][0]["value"] == 0.5
    assert served.answer(f"{served.mlflow}/get-artifact?run_id={run}&path=file.txt", "carl") == (200, b"a file")
    assert served.code(f"{served.mlflow}/api/2.0/mlflow/runs/delete", "bob", {"run_id": run}) == 403
    files = f"{served.mlflow}/api/2.0/mlflow-artifacts/artifacts"
    for path in ("runs/models/m-1/artifacts/policy.onnx", "x/%252e%252e/models/m-1/f", "x/m%256fdels/m-1/f"):
        assert served.code(f"{files}/{path}", "bob", {}, method="PUT") in (400, 403)
    assert served.code(f"{served.mlflow}/api/2.0/mlflow/runs/delete", "ann", {"run_id": run}) == 200


def test_without_the_database_a_stage_logs_and_a_policy_is_fetched_through_the_server(
    served: Doors, tmp_path: Path
) -> None:
    (tmp_path / "lab.yaml").write_text(f"tracking: {served.mlflow}\n")
    done = served.program("ann", STAGE, tmp_path)
    assert done.returncode == 0, done.stderr[-2000:]
    assert not (tmp_path / ".servers" / "mlflow.db").exists()
    run = done.stdout.split()[0]
    found = json.loads(served.answer(f"{served.mlflow}/api/2.0/mlflow/runs/get?run_id={run}", "carl")[1])["run"]
    assert {"key": "cluster", "value": "c0"} in found["data"]["tags"]
    fetch = "import sys; from tasks.policies.fetch import main; sys.exit(main(sys.argv[1:]))"
    options = ["of-a-laptop@champion", "--out", str(tmp_path / "fetched"), "--server", served.mlflow]
    (tmp_path / "elsewhere").mkdir()
    done = served.program("carl", fetch, tmp_path / "elsewhere", *options)
    assert done.returncode == 0, done.stderr[-2000:]
    policy = (tmp_path / "policy" / "policy.onnx").read_bytes()
    assert (tmp_path / "fetched" / "policy.onnx").read_bytes() == policy
    options[2] += "-again"
    done = served.program("carl:guess", fetch, tmp_path / "elsewhere", *options)
    assert done.returncode == 2 and done.stderr.count("\n") == 1 and "a login that it knows" in done.stderr
    done = served.program("carl", fetch, tmp_path / "elsewhere", "nobody@champion", *options[1:])
    assert done.returncode == 2 and done.stderr.count("\n") == 1 and "models: " in done.stderr


def test_a_flow_of_a_writer_runs_elsewhere_and_nobody_changes_which_code_runs_here(
    served: Doors, tmp_path: Path
) -> None:
    done = served.program("bob", FLOW, tmp_path)
    assert done.returncode == 0, done.stderr[-2000:]
    names = [flow["name"] for flow in served.ask("flows/filter")]
    assert "of-a-laptop" in names
    (deployment, *_) = served.ask("deployments/filter")
    change = f"{served.prefect}/api/deployments/{deployment['id']}"
    for name in served.passwords:
        assert served.code(change, name, {"entrypoint": "evil.py:f"}, method="PATCH") == 403
        assert served.code(f"{served.prefect}/api/admin/database/clear", name, {"confirm": True}) == 403
        assert served.code(f"{served.prefect}/api/block_documents/filter", name, {"include_secrets": True}) == 403
        assert served.code(f"{served.mlflow}/ajax-api/3.0/mlflow/assistant/message", name, {}) == 403


def test_prefects_sockets_want_a_login_of_ones_own_too(served: Doors) -> None:
    for token in ("ann:guess", served.pair("bumblebee"), ""):
        assert asyncio.run(first_answer(served, token, "/api/events/out")) == ""
    for name in served.passwords:
        for path in ("/api/events/out", "/api/logs/out"):
            assert "auth_success" in asyncio.run(first_answer(served, served.pair(name), path))
    assert asyncio.run(first_answer(served, served.pair("carl"), "/api/events/in")) == ""
    assert "auth_success" in asyncio.run(first_answer(served, served.pair("bob"), "/api/events/in"))


def came_in(served: Doors, accepted: int) -> gate.Gate:
    """Another round's data, about which nobody has answered."""
    place = gate.Gate(served.folder, 1)
    summary = json.loads(place.summary.read_text())
    place.summary.write_text(json.dumps(summary | {"accepted": accepted}))
    gate.request(place, people=2)  # as stage ingest does
    return place


def resumed(served: Doors, run: str, who: str, place: gate.Gate, verb: str = "approve", **more: str) -> dict[str, Any]:
    """Answer to the page, by the call that it makes."""
    seen = gate.seen_of(place.summary)["sha256"][:12]
    given = {"answer": verb, "by": "whoever", "seen": seen, "note": "", **more}
    while True:
        code, body = served.answer(f"{served.prefect}/api/flow_runs/{run}/resume", who, {"run_input": given})
        assert code in (200, 201)
        if not asks_not_yet(told := dict(json.loads(body))):
            return told
        time.sleep(0.3)


def test_two_people_of_the_group_answer_a_gate_on_the_page_under_their_own_names(served: Doors) -> None:
    place = came_in(served, 20)
    run = served.start()["id"]
    served.until(run, "Suspended")
    told = resumed(served, run, "carl", place)
    assert told["status"] == "REJECT" and "a member of the group robotics" in told["details"]["reason"]
    told = resumed(served, run, "ann", place)
    assert told["status"] == "REJECT" and "your answer is kept" in told["details"]["reason"]
    told = resumed(served, run, "ann", place)
    assert told["status"] == "REJECT" and "a second one by ann" in told["details"]["reason"]
    told = resumed(served, run, "bob", place, seen="f" * 12)
    assert told["status"] == "REJECT" and "--seen: expected" in told["details"]["reason"]
    assert resumed(served, run, "bob", place)["status"] == "ACCEPT"
    assert served.until(run, "Completed")["name"] == "Completed"
    table = gate.read_approval(place.approval)
    assert [one["known_by"] for one in (*table["approvals"], table)] == [
        {"how": "personal login", "user": "ann", "groups": ["leads", "robotics"]},
        {"how": "personal login", "user": "bob", "groups": ["robotics"]},
    ]


def test_of_two_answers_one_wins_and_the_other_is_told(served: Doors) -> None:
    place = came_in(served, 30)
    run = served.start()["id"]
    served.until(run, "Suspended")
    assert resumed(served, run, "bob", place, "reject", note="wet")["status"] == "ACCEPT"
    told = resumed(served, run, "ann", place)
    assert told["status"] != "ACCEPT"
    assert "Cannot resume" in told["details"]["reason"] or "rejected by" in told["details"]["reason"]
    assert gate.read_approval(place.approval)["status"] == "rejected"


def test_a_run_can_be_cancelled_but_not_set_to_another_state_and_no_answer_is_slipped_in(served: Doors) -> None:
    place = came_in(served, 40)
    run = served.start()["id"]
    key = served.until(run, "Suspended")["state_details"]["pause_key"]
    base = f"{served.prefect}/api/flow_runs/{run}"
    given = {"key": f"suspended-{key}-response", "value": json.dumps({"answer": "approve"})}
    for name in served.passwords:
        assert served.code(f"{base}/input", name, given) == 403
    assert served.code(f"{base}/set_state", "carl", {"state": {"type": "COMPLETED"}}) == 403
    assert served.code(f"{base}/set_state", "carl", {"state": {"type": "CANCELLED"}, "force": True}) in (200, 201)
    served.until(run, "Cancelled")
    assert gate.request(place)["status"] == "pending"


@pytest.mark.browser
def test_the_pages_work_in_a_browser_and_call_nobody_else(served: Doors) -> None:
    if CHROMIUM is None:
        pytest.skip("no Chromium on the path: install chromium to try the pages")
    from playwright.sync_api import sync_playwright

    place = came_in(served, 50)
    run = served.start()["id"]
    served.until(run, "Suspended")
    own = (served.prefect, served.mlflow, "data:", "blob:")
    left: list[str] = []
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        user = {"username": "ann", "password": served.passwords["ann"], "origin": served.mlflow}
        context = browser.new_context(
            viewport={"width": 1440, "height": 900}, http_credentials=user, ignore_https_errors=True
        )
        context.set_default_timeout(120_000)
        context.on("request", lambda request: None if request.url.startswith(own) else left.append(request.url))
        page = context.new_page()
        page.goto(f"{served.prefect}/v2/runs/flow-run/{run}")
        page.get_by_placeholder("admin:pass").fill("ann:guess")
        page.get_by_role("button", name="Login").click()
        page.get_by_placeholder("admin:pass").fill(served.pair("ann"))
        page.get_by_role("button", name="Login").click()
        page.get_by_role("tab", name="Task Runs").wait_for()
        page.get_by_role("button", name="Open menu").click()
        page.get_by_role("menuitem", name="Resume").click()
        dialog = page.get_by_role("dialog")
        dialog.get_by_text("here with a login of their own").wait_for()
        dialog.get_by_text("Select", exact=True).click()
        page.get_by_role("option", name="approve").click()
        dialog.locator("textarea").first.fill("Ann")
        dialog.get_by_role("button", name="Resume").click()
        page.get_by_text("your answer is kept").wait_for()
        page.goto(f"{served.mlflow}/#/models")
        page.get_by_text(name_of(served)).first.wait_for()
        browser.close()
    assert left == [], "a page called another machine"
    assert gate.read_approval(place.approval)["approvals"][0]["known_by"]["user"] == "ann"


def test_the_store_answers_there_too(served: Doors, lab: LabOnThisMachine, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("AWS_CA_BUNDLE", str(served.certificate))
    own = MlflowLab(**{**lab.content()["mlflow"], "s3_endpoint": served.store})
    check_lab(Lab(PrefectLab(lab.postgres.url("prefect")), own), served.folder)


def test_what_prefect_says_of_its_settings_holds_no_secret(served: Doors, lab: LabOnThisMachine) -> None:
    code, said = served.answer(f"{served.prefect}/api/admin/settings", "carl")
    assert code == 200
    assert not any(secret.encode() in said for secret in (served.password, lab.password, lab.secret))


def test_no_password_stands_in_a_file_or_a_command_line(served: Doors) -> None:
    secrets = [password.encode() for password in served.passwords.values()]
    for file in (served.folder / SERVERS).rglob("*"):
        if file.is_file():
            content = file.read_bytes()
            assert not any(secret in content for secret in secrets), file
    assert (served.folder / SERVERS / people.FILE).stat().st_mode & 0o077 == 0
    for line in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            content = line.read_bytes()
        except OSError:
            continue
        assert not any(secret in content for secret in secrets)
