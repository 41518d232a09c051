"""A lab's shared servers: `lab.yaml` in the workspace says where PostgreSQL and S3 are; without it all is here.

With its section `ray`, which may be left out, stages run on several machines.

    prefect:
      database: postgresql://bumblebee@db.lab/prefect
    mlflow:
      database: postgresql://bumblebee@db.lab/mlflow
      artifacts: s3://bumblebee/mlflow
      s3_endpoint: https://s3.lab:8333     # left out for Amazon's
    ray:
      address: head.lab:6379
      remote: /shared/bumblebee/dvc        # of DVC; or s3://BUCKET/FOLDER, ssh://HOST/FOLDER
      memory: {base: 12, distill: 24}      # GiB that a stage needs; may be left out, as the next
      checkpoint_seconds: 60               # at least, between a running stage's checkpoints on the remote

The sections `serve` and `tracking` are read by `tasks/lab/serve.py`; with these alone, all is here, too.

No secret stands in it: PostgreSQL's password comes from `~/.pgpass` (or PGPASSFILE), S3's keys from
`~/.aws/credentials` (or AWS_SHARED_CREDENTIALS_FILE, AWS_PROFILE), Ray's token from `~/.ray/auth_token` (or
RAY_AUTH_TOKEN_PATH), as these programs' own clients read them.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from bumblebee.errors import BadInput
from bumblebee.io.read import read_yaml

FILE = "lab.yaml"
OF_RAY = {"RAY_AUTH_MODE": "token", "RAY_USAGE_STATS_ENABLED": "0"}
DATABASE = "postgresql://USER@HOST[:PORT]/DATABASE"
BUCKET = re.compile(r"s3://[a-z0-9][a-z0-9.-]{1,61}[a-z0-9](/[A-Za-z0-9._/-]+)?")

AUTO = "auto"
GIB, SECONDS = (0.001, 1e6), (1.0, 86_400.0)
CLUSTER = re.compile(r"[A-Za-z0-9.-]+:([1-9][0-9]{0,4})")
REMOTE = re.compile(r"(s3://[a-z0-9.-]+|ssh://([A-Za-z0-9._-]+@)?[A-Za-z0-9.-]+(:\d{1,5})?)?/[A-Za-z0-9._/-]+")


@dataclass(frozen=True)
class PrefectLab:
    """Where Prefect's server keeps its runs."""

    database: str
    """As `DATABASE`."""

    @property
    def connection(self) -> str:
        """As Prefect's setting takes it."""
        return self.database.replace("postgresql://", "postgresql+asyncpg://", 1)


@dataclass(frozen=True)
class MlflowLab:
    """Where runs, models and their files are."""

    database: str
    """As `DATABASE`."""
    artifacts: str
    """`s3://BUCKET/FOLDER`."""
    s3_endpoint: str = ""
    """Address of an S3 server; Amazon's without."""

    @property
    def connection(self) -> str:
        """As SQLAlchemy takes it, with the driver that comes along."""
        return self.database.replace("postgresql://", "postgresql+psycopg2://", 1)

    @property
    def bucket(self) -> str:
        """The bucket's name."""
        return urlsplit(self.artifacts).netloc

    @property
    def folder(self) -> str:
        """The folder in it, without slashes at its ends."""
        return urlsplit(self.artifacts).path.strip("/")


@dataclass(frozen=True)
class RayLab:
    """The standing cluster on which stages run, and where its machines exchange what they make."""

    address: str
    """`HOST:PORT` of its head, or `auto`: what the variable RAY_ADDRESS says."""
    remote: str
    """Remote of DVC: a folder that every machine sees, `s3://BUCKET/FOLDER` or `ssh://HOST/FOLDER`."""
    memory: Mapping[str, float] = field(default_factory=dict)
    """Memory that a stage needs, by its name without cluster and round [GiB]; here and not in params.yaml, whose change
    would make the stage stale. Ray gives of a machine what `ray start --memory` stated, most of it without."""
    checkpoint_seconds: float = 60.0
    """At least so long between two checkpoints of a running stage that go to the remote [s]."""


@dataclass(frozen=True)
class Lab:
    """The whole file."""

    prefect: PrefectLab
    mlflow: MlflowLab
    ray: RayLab | None = None
    """None: stages run on the machine of the flow."""

    @property
    def variables(self) -> dict[str, str]:
        """Variables that processes of the servers and stages get beside their environment; nothing secret."""
        found = {"PREFECT_API_DATABASE_CONNECTION_URL": self.prefect.connection}
        if self.mlflow.s3_endpoint:
            found["MLFLOW_S3_ENDPOINT_URL"] = self.mlflow.s3_endpoint
        return found | (OF_RAY if self.ray is not None else {})


KINDS: dict[str, Any] = {"prefect": PrefectLab, "mlflow": MlflowLab, "ray": RayLab}
ELSEWHERE = ("serve", "tracking")  # sections that tasks/lab/serve.py reads


def read_lab(workspace: Path) -> Lab | None:
    """The workspace's `lab.yaml`; None where there is none, or none that names databases.

    Raises:
        BadInput: for an unknown or missing key, an address of another form, or one with a password in it.
    """
    path = Path(workspace) / FILE
    if not path.exists():
        return None
    content = read_yaml(path)
    if isinstance(content, dict) and content and not set(content) - set(ELSEWHERE):
        return None
    parts: dict[str, Any] = {}
    for name, kind in KINDS.items():
        if name == "ray" and isinstance(content, dict) and name not in content:
            continue
        numbers = _take_numbers(content["ray"], f"{path}: ray") if name == "ray" else {}
        names = [own.name for own in fields(kind) if own.name not in ("memory", "checkpoint_seconds")]
        parts[name] = kind(**_strings(content, name, names, path), **numbers)
    if isinstance(content, dict) and (more := sorted(map(str, set(content) - set(parts) - set(ELSEWHERE)))):
        raise BadInput(f"{path}: {more[0]}", " or ".join((*KINDS, *ELSEWHERE)), "an unknown key")
    lab = Lab(**parts)
    for where, url in (("prefect", lab.prefect.database), ("mlflow", lab.mlflow.database)):
        _check_database(f"{path}: {where}.database", url)
    if not BUCKET.fullmatch(lab.mlflow.artifacts):
        raise BadInput(f"{path}: mlflow.artifacts", "s3://BUCKET/FOLDER", form(lab.mlflow.artifacts))
    if lab.mlflow.s3_endpoint and not re.fullmatch(r"https?://[A-Za-z0-9.-]+(:\d{1,5})?", lab.mlflow.s3_endpoint):
        raise BadInput(f"{path}: mlflow.s3_endpoint", "https://HOST[:PORT]", form(lab.mlflow.s3_endpoint))
    if lab.prefect.database == lab.mlflow.database:
        raise BadInput(f"{path}: mlflow.database", "another database than Prefect's", "the same one")
    if lab.ray is not None:
        _check_ray(lab.ray, f"{path}: ray")
    return lab


def form(address: str) -> str:
    """How an address that is refused looks, without its words: a secret may stand in any part of it."""
    found = re.match(r"[a-z][a-z0-9+.-]{1,15}://", address)
    parts = [name for sign, name in (("@", "a user"), ("?", "a query"), ("#", "a fragment")) if sign in address]
    shown = ", ".join(([f"{found[0]}..."] if found else []) + parts)
    return f"another form ({shown})" if shown else "another form"


def on_cluster(workspace: Path) -> bool:
    """Whether the workspace's stages run on a lab's Ray cluster."""
    lab = read_lab(workspace)
    return lab is not None and lab.ray is not None


def _strings(content: Any, section: str, names: list[str], path: Path) -> dict[str, str]:
    """The section's values, all of them texts."""
    own = content.get(section) if isinstance(content, dict) else None
    if not isinstance(own, dict):
        raise BadInput(f"{path}: {section}", f"a mapping with {', '.join(names)}", type(own).__name__)
    for name in names:
        if name != "s3_endpoint" and name not in own:
            raise BadInput(f"{path}: {section}.{name}", "an address", "no such key")
    for name, value in own.items():
        if name not in names:
            raise BadInput(f"{path}: {section}.{name}", " or ".join(names), "an unknown key")
        if not isinstance(value, str):
            raise BadInput(f"{path}: {section}.{name}", "a text", type(value).__name__)
    return dict(own)


def _take_numbers(section: Any, where: str) -> dict[str, Any]:
    """Numbers of the section, taken out of it."""
    found: dict[str, Any] = {}
    if not isinstance(section, dict):
        return found
    if "checkpoint_seconds" in section:
        seconds = section.pop("checkpoint_seconds")
        found["checkpoint_seconds"] = _number(seconds, f"{where}.checkpoint_seconds", SECONDS)
    if "memory" in section:
        memory = section.pop("memory")
        if not isinstance(memory, dict):
            raise BadInput(f"{where}.memory", "GiB by stage, such as {base: 12}", type(memory).__name__)
        found["memory"] = {str(name): _number(own, f"{where}.memory.{name}", GIB) for name, own in memory.items()}
    return found


def _number(value: Any, where: str, limits: tuple[float, float]) -> float:
    least, most = limits
    if isinstance(value, bool) or not isinstance(value, int | float) or not least <= value <= most:
        came = type(value).__name__ if isinstance(value, str) else repr(value)
        raise BadInput(where, f"a number from {least:g} to {most:g}", came[:80])
    return float(value)


def _check_ray(ray: RayLab, where: str) -> None:
    """Refuse what is no address of a cluster or no place for DVC."""
    port = CLUSTER.fullmatch(ray.address)
    if ray.address != AUTO and (not port or int(port[1]) > 65535):
        raise BadInput(f"{where}.address", f"HOST:PORT of the cluster's head, or {AUTO}", form(ray.address))
    if not REMOTE.fullmatch(ray.remote):
        expected = "a folder from / on, s3://BUCKET/FOLDER or ssh://HOST/FOLDER"
        raise BadInput(f"{where}.remote", expected, form(ray.remote))


def _check_database(where: str, url: str) -> None:
    """Refuse what is no PostgreSQL address, and a password, which would stand in files and process lists."""
    try:
        parts = urlsplit(url)
        known = parts.scheme == "postgresql" and parts.username and parts.hostname and (parts.port or 1)
    except ValueError:
        raise BadInput(where, DATABASE, "no address") from None
    if parts.password is not None:
        raise BadInput(where, f"{DATABASE}, without a password", "one with it", "Put the password into ~/.pgpass.")
    if not known or not re.fullmatch(r"/[A-Za-z0-9_-]+", parts.path) or parts.query or parts.fragment:
        raise BadInput(where, DATABASE, form(url))
