"""Before anything starts: do the lab's databases and its store answer, may we write, and are their versions known?

Every fault is one line that names what to do. `psycopg2` and `boto3` come with the extra `lab`.
"""

import contextlib
import importlib
import os
import re
import secrets
import time
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from bumblebee.errors import BadInput
from tasks.lab.servers import FILE, Lab, MlflowLab

ANSWER = 10  # [s] within which a server must
CLOCKS = 30.0  # [s] by which this machine's clock and a database's may differ
MIGRATIONS = {
    "prefect": ("prefect", "server/database/_migrations/versions/postgresql"),
    "mlflow": ("mlflow", "store/db_migrations/versions"),
}
"""Package and folder of the files that say which versions of its tables a program knows."""


def check_lab(lab: Lab, workspace: Path) -> None:
    """Refuse what would fail later.

    Raises:
        BadInput: naming the first fault.
    """
    for module, package in (("psycopg2", "psycopg2-binary"), ("boto3", "boto3")):
        if find_spec(module) is None:
            do = "In the checkout: pip install -e '.[lab]'"
            raise BadInput(Path(workspace) / FILE, f"the package {package}", "none", do)
    for name, url in (("prefect", lab.prefect.database), ("mlflow", lab.mlflow.database)):
        _check_database(name, url, f"{Path(workspace) / FILE}: {name}.database")
    _check_store(lab.mlflow, f"{Path(workspace) / FILE}: mlflow.artifacts")


def revisions(name: str) -> tuple[set[str], set[str]]:
    """Versions of its tables that the installed program can read, and the newest of them; of `MIGRATIONS`' names."""
    package, folder = MIGRATIONS[name]
    spec = find_spec(package)
    assert spec is not None and spec.submodule_search_locations
    texts = [file.read_text() for file in (Path(spec.submodule_search_locations[0]) / folder).glob("*.py")]
    known, before = ({word for text in texts for line in re.findall(rf"^{key}\s*=(.*)", text, re.MULTILINE)
                      for word in re.findall(r"\w{6,}", line)} for key in ("revision", "down_revision"))  # fmt: skip
    return known, known - before


def _check_database(name: str, url: str, where: str) -> None:
    psycopg2 = importlib.import_module("psycopg2")
    try:
        with contextlib.closing(psycopg2.connect(url, connect_timeout=ANSWER)) as connection:
            connection.autocommit = True
            with connection.cursor() as cursor:
                _check_opened(cursor, name, where)
    except psycopg2.OperationalError as error:
        do = "Is it running, does it know this user and database, and is the password in ~/.pgpass?"
        raise BadInput(where, f"{url} to answer", _first_line(error), do) from None
    except psycopg2.Error as error:
        raise BadInput(where, f"{url} to be usable", _first_line(error)) from None


def _check_opened(cursor: Any, name: str, where: str) -> None:
    cursor.execute("SELECT has_schema_privilege(current_schema(), 'CREATE'), extract(epoch FROM clock_timestamp())")
    may_create, clock = cursor.fetchone()
    if not may_create:
        raise BadInput(where, "a database in which its user may make tables", "one to read", "Make the user its owner.")
    away = abs(float(clock) - time.time())
    if away > CLOCKS:
        do = "Set the clocks, for instance by NTP: times of runs and logins depend on them."
        raise BadInput(where, f"clocks that differ by at most {CLOCKS:g} s", f"{away:.0f} s", do)
    if name == "prefect":
        cursor.execute("SELECT 1 FROM pg_extension WHERE extname = 'pg_trgm'")
        if cursor.fetchone() is None:
            _make_extension(cursor, where)
    cursor.execute("SELECT to_regclass('alembic_version')")
    if cursor.fetchone()[0] is None:
        return  # a new database
    cursor.execute("SELECT version_num FROM alembic_version")
    unknown = sorted({row[0] for row in cursor.fetchall()} - revisions(name)[0])
    if unknown:
        do = f"Install the version of {name} that made it, or give another database."
        raise BadInput(where, f"tables that this version of {name} knows", f"newer ones ({unknown[0]})", do)


def _make_extension(cursor: Any, where: str) -> None:
    psycopg2 = importlib.import_module("psycopg2")
    try:
        cursor.execute("CREATE EXTENSION pg_trgm")
    except psycopg2.Error as error:
        do = "As its administrator: CREATE EXTENSION pg_trgm; (Debian: package postgresql)."
        raise BadInput(where, "the extension pg_trgm, which Prefect needs", _first_line(error), do) from None


def _check_store(own: MlflowLab, where: str) -> None:
    """Write, read and remove one small object."""
    client, key = s3_client(own), "/".join(filter(None, (own.folder, f".check-{secrets.token_hex(8)}")))
    errors = importlib.import_module("botocore.exceptions")
    try:
        client.put_object(Bucket=own.bucket, Key=key, Body=b"bumblebee")
        client.get_object(Bucket=own.bucket, Key=key)["Body"].read()
        client.delete_object(Bucket=own.bucket, Key=key)
    except errors.NoCredentialsError:
        do = "Put the keys into ~/.aws/credentials, or name another profile by AWS_PROFILE."
        raise BadInput(where, f"keys for {own.artifacts}", "none", do) from None
    except (errors.ClientError, errors.BotoCoreError, OSError) as error:
        at = own.s3_endpoint or "Amazon's S3"
        do = "Is the bucket there, and may these keys write to it?"
        raise BadInput(where, f"{own.artifacts} at {at} to be writable", _first_line(error), do) from None


def s3_client(own: MlflowLab) -> Any:
    """A client of the lab's store that gives up soon."""
    config = importlib.import_module("botocore.config").Config(
        connect_timeout=ANSWER, read_timeout=ANSWER, retries={"max_attempts": 1}
    )
    region = os.environ.get("AWS_DEFAULT_REGION", "us-east-1")
    return (
        importlib.import_module("boto3.session")
        .Session()
        .client(  # the shared one keeps keys of before
            "s3", endpoint_url=own.s3_endpoint or None, config=config, region_name=region
        )
    )


def _first_line(error: Exception) -> str:
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return lines[0][:200] if lines else type(error).__name__


@contextlib.contextmanager
def one_at_a_time(url: str, number: int = 0x62756D62) -> Iterator[None]:
    """One process of all machines at a time, held by the database itself: it is free again when that one is gone."""
    psycopg2 = importlib.import_module("psycopg2")
    with contextlib.closing(psycopg2.connect(url, connect_timeout=ANSWER)) as connection:
        connection.autocommit = True
        with connection.cursor() as cursor:
            cursor.execute("SELECT pg_advisory_lock(%s)", (number,))
            yield
