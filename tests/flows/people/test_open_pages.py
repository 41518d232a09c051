"""Without a login the servers answer what SECURITY.md lists, and nothing else; every address is asked."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from flows.environment import environment
from flows.people.guard import ALIVE
from flows.servers import servers

OPEN = {"/", "/ui-settings", "/api/health", "/api/ready", ALIVE}
BESIDE = (
    "/docs",
    "/docs/oauth2-redirect",
    "/redoc",
    "/openapi.json",
    "/api",
    "/api/",
    "/api/docs",
    "/api/openapi.json",
)
ASK = """
import json, sys
from flows.people import guard
from flows.servers import front
from starlette.testclient import TestClient
from tests.flows.people.test_rights import of_mlflow, of_prefect

async def inner(scope, receive, send):  # MLflow's own is never reached
    await guard.reply(send, 299, "in")

prefect = sys.argv[1] == "prefect"
app = front.prefect_app(4200, "secret" * 8) if prefect else inner
client = TestClient(front.Guard(app, "secret" * 8, ask=not prefect), "http://127.0.0.1:4200", follow_redirects=False)
known = of_prefect() if prefect else of_mlflow()
paths = {path for method, path in known if method == "GET"} | set(json.loads(sys.argv[2]))
print(json.dumps({path: client.get(path).status_code for path in sorted(paths)}))
"""


@pytest.mark.parametrize("server", ["prefect", "mlflow"])
def test_without_a_login_nothing_is_answered_but_what_is_listed(tmp_path: Path, server: str) -> None:
    command = [sys.executable, "-c", ASK, server, json.dumps([*BESIDE, *OPEN])]
    clean = environment(tmp_path) | {"PYTHONPATH": str(servers.HOME), "OMP_NUM_THREADS": "1"}
    told = subprocess.check_output(command, cwd=servers.HOME, env=clean, text=True)
    answers = json.loads(told.splitlines()[-1])
    assert len(answers) > 50
    wanted = OPEN if server == "prefect" else {ALIVE}
    assert {path for path, status in answers.items() if status not in (401, 404)} == wanted


def test_the_list_stands_in_security_md() -> None:
    text = (servers.HOME / "SECURITY.md").read_text()
    assert [path for path in OPEN if f"`{path}`" not in text] == []
