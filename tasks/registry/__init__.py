"""The one folder that knows MLflow: runs with what they were made from, models with their aliases.

Runs and models are written straight into the database and store of the workspace, or of its lab (`lab.yaml`), so that
plain `dvc repro` and the flow leave the same history; the server only shows it. Why: docs/decisions/mlflow-store.md.
Where `lab.yaml` names nothing but `tracking`, a lab's server, all goes through that, under the login of who works here.
"""

from tasks.registry.models import (
    NO_WORKSPACE,
    champion_tags,
    champion_version,
    describe,
    fetch,
    register,
    set_alias,
    version_card,
    version_tags,
)
from tasks.registry.runs import log_run
from tasks.registry.store import DATABASE, NO_TELEMETRY, ensure_database, experiment_name, prepare

__all__ = [
    "DATABASE",
    "NO_TELEMETRY",
    "NO_WORKSPACE",
    "champion_tags",
    "champion_version",
    "describe",
    "ensure_database",
    "experiment_name",
    "fetch",
    "log_run",
    "prepare",
    "register",
    "set_alias",
    "version_card",
    "version_tags",
]
