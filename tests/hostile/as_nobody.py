"""Attempts of another user of this machine on a workspace's open servers.

By hand, as root, with `make serve` open for that workspace: `python tests/hostile/as_nobody.py WORKSPACE`. Prints what
was tried as `nobody` and what came; status 1 if anything worked.
"""

import json
import os
import signal
import sys
import tempfile
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path

NOBODY = 65534
# (what, method, server, path, body, headers)
TRIALS = [
    ("read the runs", "POST", "prefect", "/api/flow_runs/filter", {}, {}),
    ("read the deployments", "POST", "prefect", "/api/deployments/filter", {}, {}),
    ("start a run in a folder of nobody's", "POST", "prefect", "/api/deployments/{deployment}/create_flow_run",
     {"parameters": {"workspace": "{folder}"}}, {}),
    ("resume a gate as Ada", "POST", "prefect", "/api/flow_runs/{run}/resume",
     {"run_input": {"approve": True, "by": "Ada", "note": ""}}, {}),
    ("read the settings", "GET", "prefect", "/api/admin/settings", None, {}),
    ("delete the database", "POST", "prefect", "/api/admin/database/clear", {"confirm": True}, {}),
    ("guess the login", "POST", "prefect", "/api/flow_runs/filter", {}, {"Authorization": "Basic YnVtYmxlYmVlOmE="}),
    ("a foreign host", "GET", "prefect", "/ui-settings", None, {"Host": "evil.example"}),
    ("a page of another origin", "GET", "prefect", "/ui-settings", None, {"Origin": "http://evil.example"}),
    ("ask for a cross-origin right", "OPTIONS", "prefect", "/api/flow_runs/filter", None,
     {"Origin": "http://evil.example", "Access-Control-Request-Method": "POST"}),
    ("move a champion", "POST", "mlflow", "/api/2.0/mlflow/registered-models/alias",
     {"name": "{model}", "alias": "champion", "version": "1"}, {}),
    ("read the models", "GET", "mlflow", "/api/2.0/mlflow/registered-models/search", None, {}),
    ("read the models as a page", "GET", "mlflow", "/ajax-api/2.0/mlflow/registered-models/search", None, {}),
    ("list the artifacts", "GET", "mlflow", "/api/2.0/mlflow-artifacts/artifacts", None, {}),
    ("write an artifact", "PUT", "mlflow", "/api/2.0/mlflow-artifacts/artifacts/runs/x", {}, {}),
    ("use the assistant", "POST", "mlflow", "/ajax-api/3.0/mlflow/assistant/message", {}, {}),
    ("send traces", "POST", "mlflow", "/v1/traces", {}, {}),
    ("read a page", "GET", "mlflow", "/", None, {}),
    ("a foreign host", "GET", "mlflow", "/health", None, {"Host": "evil.example"}),
    ("a page of another origin", "GET", "mlflow", "/health", None, {"Origin": "http://127.0.0.1:1"}),
]  # fmt: skip
OPENER = urllib.request.build_opener(urllib.request.ProxyHandler({}))
Row = tuple[str, int, str]  # what, 400 to 403 when it was refused, the answer


def attempts(plan: dict) -> Iterator[Row]:
    """Try everything, as whoever this process is."""
    for what, method, url, body, headers in plan["http"]:
        data = None if body is None else json.dumps(body).encode()
        asked = urllib.request.Request(url, data, {"Content-Type": "application/json", **headers}, method=method)
        try:
            with OPENER.open(asked, timeout=30) as reply:
                yield what, reply.status, "let in"
        except urllib.error.HTTPError as error:
            yield what, error.code, error.read(60).decode(errors="replace").strip()
    for what, path, flags in plan["files"]:
        yield attempt(what, "opened", lambda path=path, flags=flags: os.close(os.open(path, flags)))
    for pid in plan["pids"]:
        environ = Path(f"/proc/{pid}/environ")
        yield attempt(f"read the environment of process {pid}", "read", environ.read_bytes)
        words = Path(f"/proc/{pid}/cmdline").read_text()
        found = any(secret in words for secret in plan["secrets"])
        yield (
            f"find the login on the command line of process {pid}",
            0 if found else 403,
            "found" * found or "not there",
        )
        yield attempt(f"end process {pid}", "ended", lambda pid=pid: os.kill(pid, signal.SIGTERM))


def attempt(what: str, done: str, action: Callable[[], object]) -> Row:
    """Do it, and say what the system said."""
    try:
        action()
    except OSError as error:
        return what, 403, str(error.strerror)
    return what, 0, done


def as_nobody(plan: dict) -> list[Row]:
    """The attempts, from a process that has given up every right of root's."""
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(read)
        os.setgroups([])
        os.setresgid(NOBODY, NOBODY, NOBODY)
        os.setresuid(NOBODY, NOBODY, NOBODY)
        with os.fdopen(write, "w") as stream:
            stream.write(json.dumps(list(attempts(plan))))
        os._exit(0)
    os.close(write)
    with os.fdopen(read) as stream:
        rows = json.loads(stream.read())
    os.waitpid(child, 0)
    return rows


def main() -> int:
    """Try everything and print the table."""
    folder = Path(sys.argv[1]).resolve()
    inside = folder / ".servers"
    addresses = json.loads((inside / "addresses.json").read_text())
    secret = (inside / "login").read_text().strip()
    with tempfile.TemporaryDirectory() as own:
        os.chmod(own, 0o777)
        names = {"folder": own, **known(addresses, secret)}
        http = [
            (f"{server}: {what}", method, addresses[server] + filled(path, names), filled(body, names), headers)
            for what, method, server, path, body, headers in TRIALS
        ]
        files = [(f"read {name}", str(inside / name), os.O_RDONLY) for name in
                 ("", "login", "addresses.json", "mlflow.db", "prefect/prefect.db", "prefect.log")]  # fmt: skip
        files += [("write mlflow.db", str(inside / "mlflow.db"), os.O_RDWR)]
        files += [("put a file into .servers", str(inside / "x"), os.O_WRONLY | os.O_CREAT)]
        files += [("replace dvc.yaml", str(folder / "dvc.yaml"), os.O_RDWR)]
        plan = {"http": http, "files": files, "pids": [*addresses["pids"], addresses["keeper"]]}
        plan["secrets"] = [secret.partition(":")[2]]  # only to look for it on command lines
        rows = as_nobody(plan)
    print("| tried as nobody | answer |\n|---|---|")
    for what, status, words in rows:
        refused = 400 <= status < 404
        print(f"| {what} | {'' if refused else '**GOT THROUGH** '}{status} {' '.join(words.split())} |")
    through = [what for what, status, _ in rows if not 400 <= status < 404]
    print(f"\n{len(rows)} tried, {len(through)} got through")
    return 1 if through else 0


def known(addresses: dict, secret: str) -> dict[str, str]:
    """Names that an attacker who had guessed every number would use: a deployment, a suspended run, a model."""
    sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
    from flows.runs import ask

    password = secret.partition(":")[2]
    runs = ask(addresses["prefect"], password, "flow_runs/filter", {})
    deployments = ask(addresses["prefect"], password, "deployments/filter", {})
    names = {"run": next((run["id"] for run in runs if run["state_type"] == "PAUSED"), "0" * 32)}
    return {**names, "deployment": deployments[0]["id"] if deployments else "0" * 32, "model": "expert-c0"}


def filled(what: object, names: dict[str, str]) -> object:
    """The placeholders replaced."""
    text = json.dumps(what)
    for name, value in names.items():
        text = text.replace("{" + name + "}", value)
    return json.loads(text)


if __name__ == "__main__":
    raise SystemExit(main())
