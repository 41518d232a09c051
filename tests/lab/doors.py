"""A workspace whose servers people reach over TLS, by the servers' own or through nginx; and who asks there."""

import base64
import json
import os
import shutil
import ssl
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import yaml

from flows import runs
from flows.environment import SERVERS
from flows.people import accounts as people
from flows.servers import servers
from tests.flows.servers.served import LIMIT, Served, make
from tests.lab import machines

DOCS = Path(__file__).parents[2] / "docs" / "lab.md"
NGINX = shutil.which("nginx", path=os.pathsep.join([os.environ.get("PATH", ""), "/usr/sbin"]))
PEOPLE = {"ann": ("leads", "robotics"), "bob": ("robotics",), "carl": ()}


def certificate(folder: Path) -> tuple[Path, Path]:
    """A certificate for localhost and its key, made here."""
    made, key = folder / "tls.pem", folder / "tls.key"
    words = [
        "openssl",
        "req",
        "-x509",
        "-newkey",
        "ec",
        "-pkeyopt",
        "ec_paramgen_curve:prime256v1",
        "-nodes",
        "-days",
        "2",
    ]
    words += [
        "-subj",
        "/CN=localhost",
        "-addext",
        "subjectAltName=DNS:localhost",
        "-keyout",
        str(key),
        "-out",
        str(made),
    ]
    subprocess.run(words, check=True, capture_output=True)
    key.chmod(0o600)
    return made, key


@dataclass(frozen=True)
class Doors(Served):
    """Servers with doors, and everybody's passwords."""

    prefect: str
    mlflow: str
    store: str
    certificate: Path
    passwords: dict[str, str] = field(default_factory=dict)

    def pair(self, who: str) -> str:
        """`name:password` of a name, of the workspace's own login, too; what is a pair stays as it is."""
        return who if ":" in who else f"{who}:{self.passwords.get(who, self.password)}"

    def code(self, url: str, who: str = "", body: Any = None, method: str = "", **headers: str) -> int:
        """The status of an answer."""
        return self.answer(url, who, body, method, **headers)[0]

    def answer(self, url: str, who: str = "", body: Any = None, method: str = "", **headers: str) -> tuple[int, bytes]:
        """Status and body; `who` is a name, or a whole `name:password`."""
        told = {"Content-Type": "application/json", **{key.replace("_", "-"): value for key, value in headers.items()}}
        if who:
            told["Authorization"] = "Basic " + base64.b64encode(self.pair(who).encode()).decode()
        data = None if body is None else json.dumps(body).encode()
        asked = urllib.request.Request(url, data, told, method=method or ("GET" if body is None else "POST"))
        context = ssl.create_default_context(cafile=str(self.certificate))
        opener = urllib.request.build_opener(
            urllib.request.ProxyHandler({}), urllib.request.HTTPSHandler(context=context)
        )
        try:
            with opener.open(asked, timeout=60) as reply:
                return int(reply.status), reply.read()
        except urllib.error.HTTPError as error:
            return error.code, error.read()

    def variables(self, who: str) -> dict[str, str]:
        """Variables of a person's program, as docs/lab.md says."""
        known = {"PATH": os.environ["PATH"], "PYTHONPATH": str(servers.HOME), "NO_PROXY": "localhost,127.0.0.1"}
        name, _, password = self.pair(who).partition(":")
        known |= {"PREFECT_API_URL": f"{self.prefect}/api", "PREFECT_API_AUTH_STRING": self.pair(who)}
        known |= {"PREFECT_API_SSL_CERT_FILE": str(self.certificate), "PREFECT_HOME": str(self.folder / f"of-{name}")}
        known |= {"MLFLOW_TRACKING_URI": self.mlflow, "MLFLOW_TRACKING_USERNAME": name}
        known |= {"MLFLOW_TRACKING_PASSWORD": password, "MLFLOW_TRACKING_SERVER_CERT_PATH": str(self.certificate)}
        return known | {"DO_NOT_TRACK": "true", "PREFECT_SERVER_ANALYTICS_ENABLED": "false"}

    def program(self, who: str, code: str, folder: Path, *options: str) -> subprocess.CompletedProcess[str]:
        """A program of somebody's, elsewhere."""
        return subprocess.run(
            [sys.executable, "-c", code, *options],
            cwd=folder,
            env=self.variables(who),
            capture_output=True,
            text=True,
            check=False,
            timeout=LIMIT,
        )


async def first_answer(served: Doors, token: str, path: str) -> str:
    """First answer of Prefect's server to a socket that logs in; "" where it closes it."""
    from websockets.asyncio.client import connect
    from websockets.exceptions import ConnectionClosed

    url = served.prefect.replace("https", "wss") + path
    context = ssl.create_default_context(cafile=str(served.certificate))
    try:
        async with connect(url, subprotocols=["prefect"], proxy=None, ssl=context) as socket:  # type: ignore[list-item]
            await socket.send(json.dumps({"type": "auth", "token": token}))
            return str(await socket.recv())
    except ConnectionClosed:
        return ""


@contextmanager
def serving(folder: Path) -> Iterator[tuple[servers.Addresses, "subprocess.Popen[str]"]]:
    """`make serve` in a workspace, until the block ends."""
    known = {name: value for name, value in os.environ.items() if not name.startswith(("PREFECT_API", "MLFLOW_TR"))}
    process = subprocess.Popen(
        [sys.executable, "-m", "flows.servers.serve"],
        cwd=folder,
        env={**known, "PYTHONPATH": str(servers.HOME)},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    try:
        end = time.monotonic() + LIMIT
        while (found := servers.running(folder)) is None:
            assert process.poll() is None and time.monotonic() < end, process.communicate()
            time.sleep(0.2)
        yield found, process
    finally:
        process.terminate()
        process.communicate(timeout=60)


def with_gate(folder: Path, lab: dict[str, Any], rule: str) -> Path:
    """A workspace of three small stages, the last behind a gate, on the lab's databases."""
    make(folder)
    (folder / "lab.yaml").write_text(yaml.safe_dump(lab))
    (folder / "params.yaml").write_text(f"clusters: [c0]\nrounds: []\nfinal_round: 0\ngate: {rule}\n")
    return folder


@contextmanager
def opened(folder: Path, lab: dict[str, Any], proxied: bool) -> Iterator[Doors]:
    """A workspace's doors, by the servers' own TLS or through nginx as docs/lab.md sets it up; `lab` may be empty."""
    made, key = certificate(folder.parent)
    ports = {name: machines.free_port() for name in ("prefect", "mlflow", "prefect_behind", "mlflow_behind", "store")}
    endpoint = lab["mlflow"]["s3_endpoint"] if lab else ""
    ports["store_behind"] = urlsplit(endpoint).port or 80
    behind = "_behind" if proxied else ""
    own = {name: f"https://localhost:{ports[name]}" for name in ("prefect", "mlflow")}
    own |= {f"{name}_listen": f"127.0.0.1:{ports[name + behind]}" for name in ("prefect", "mlflow")}
    own |= {} if proxied else {"certificate": str(made), "key": str(key)}
    own |= {"write": "robotics", "promote": "leads"}
    with_gate(folder, {**lab, "serve": own}, "{mode: ask, people: 2, group: robotics}")
    passwords = {name: people.add(folder / SERVERS, name, groups) for name, groups in PEOPLE.items()}
    with serving(folder) as (found, _), nginx(folder.parent, made, key, ports) if proxied else _nothing():
        password = runs.login.read(folder / SERVERS)
        assert password is not None
        store = f"https://localhost:{ports['store']}" if proxied else endpoint
        doors = Doors(folder, found, password, own["prefect"], own["mlflow"], store, made, passwords)
        end = time.monotonic() + LIMIT
        while not all(answers(url) for url in (doors.prefect, doors.mlflow)):
            assert time.monotonic() < end
            time.sleep(0.2)
        yield doors


def answers(url: str) -> bool:
    """Whether something listens there."""
    import socket

    with socket.socket() as asked:
        return asked.connect_ex(("127.0.0.1", urlsplit(url).port or 443)) == 0


@contextmanager
def _nothing() -> Iterator[None]:
    yield


@contextmanager
def nginx(folder: Path, made: Path, key: Path, ports: dict[str, int]) -> Iterator[None]:
    """Nginx with the lines of docs/lab.md."""
    text = DOCS.read_text().split("`/etc/nginx/conf.d/bumblebee.conf`:")[1].split("\nThe proxy passes")[0]
    texts = {"/etc/bumblebee/data.pem": str(made), "/etc/bumblebee/data.key": str(key)}
    texts |= {
        "listen 4200": f"listen 127.0.0.1:{ports['prefect']}",
        "listen 5000": f"listen 127.0.0.1:{ports['mlflow']}",
    }
    texts |= {"listen 8333": f"listen 127.0.0.1:{ports['store']}", "1:18333": f"1:{ports['store_behind']}"}
    texts |= {"1:14200": f"1:{ports['prefect_behind']}", "1:15000": f"1:{ports['mlflow_behind']}"}
    for old, new in texts.items():
        assert old in text
        text = text.replace(old, new)
    place = folder / "nginx"
    place.mkdir()
    parts = ("client_body", "proxy", "fastcgi", "uwsgi", "scgi")
    temporary = "".join(f"{part}_temp_path {place}/{part};\n" for part in parts)
    user = "user root;\n" if os.getuid() == 0 else ""
    http = f"http {{\naccess_log off;\n{temporary}{text}\n}}\n"
    (place / "nginx.conf").write_text(
        f"{user}daemon off;\npid {place}/pid;\nerror_log {place}/error.log;\nevents {{}}\n{http}"
    )
    process = subprocess.Popen(
        [NGINX or "nginx", "-p", str(place), "-c", str(place / "nginx.conf")], stderr=subprocess.PIPE
    )
    try:
        yield
        assert process.poll() is None, process.communicate()
    finally:
        process.terminate()
        process.wait(timeout=30)
