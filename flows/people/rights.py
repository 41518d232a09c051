"""Who may change what on the servers, by method and path: what no line allows is refused.

Everybody with a login reads, starts and cancels runs of the served loop, and answers gates. The group `serve.write`
logs runs. The group `serve.promote` moves aliases, changes models and deletes. What decides which code runs, and
secrets, are changed on the servers' machine alone: no login from elsewhere gets there.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

ONE = r"[0-9a-f-]{36}"
READS = ("GET", "HEAD", "OPTIONS")
API = r"/(ajax-)?api/[234]\.0"
MLFLOW, FILES = rf"{API}/mlflow", rf"{API}/mlflow-artifacts"
RUNS_CODE = (
    rf"{MLFLOW}/(assistant|gateway[a-z-]*|webhooks|prompt-optimization|scorers)(/.*)?|{API}/jobs(/.*)?|/gateway/.*"
)
SECRETS = r"/api/.*block_documents.*"
ASKED = (  # of Prefect, by POST though nothing changes
    r"/api/(ui/)?(flows|flow_runs|task_runs|deployments|logs|artifacts|artifacts/latest|work_pools|work_queues|variables"
    r"|task_workers|automations|saved_searches|(v2/)?concurrency_limits|block_types|block_schemas|events)"
    r"/(filter|count|paginate|history|lateness)"
    r"|/api/work_pools/[^/]+/(queues|workers)/filter|/api/events/count-by/[a-z_-]+"
    r"|/api/ui/(flows/(count-deployments|next-runs)|flow_runs/count-task-runs|schemas/validate"
    r"|task_runs/dashboard/counts)"
)
SEARCHED = (  # of MLflow, likewise
    rf"{MLFLOW}/(experiments|runs|logged-models|traces|datasets)/search|/graphql|{API}/?mlflow/experiments/search-datasets"
    rf"|{MLFLOW}/(registered-models/get-latest-versions|traces/batchGetInfos|traces/metrics"
    r"|artifacts/presigned-download-url)"
)

Rule = tuple[str, tuple[str, ...], str]
"""Who ("all", "write", "promote"), methods, and a pattern of the whole path."""

RULES: dict[str, list[Rule]] = {
    "prefect": [
        ("all", READS, rf"(?!{SECRETS}).*"),
        ("all", ("POST",), ASKED),
        ("all", ("POST",), rf"/api/deployments/{ONE}/create_flow_run|/api/flow_runs/{ONE}/(resume|set_state)"),
        ("all", ("WEBSOCKET",), r"/api/(events|logs)/out"),
        ("write", ("WEBSOCKET",), r"/api/events/in"),
        ("write", ("POST",), r"/api/(flows|flow_runs|task_runs|logs|artifacts)/?|/api/events"),
        ("write", ("POST",), rf"/api/task_runs/{ONE}/set_state"),
        ("write", ("PATCH",), rf"/api/(flow_runs|task_runs)/{ONE}"),
    ],
    "mlflow": [
        ("all", READS, rf"(?!({RUNS_CODE})$).*"),
        ("all", ("POST",), SEARCHED),
        ("write", ("POST",), rf"{MLFLOW}/experiments/create"),
        ("write", ("POST",), rf"{MLFLOW}/runs/(create|update|set-tag|delete-tag|outputs|log-[a-z]+)"),
        ("write", ("PUT",), rf"{FILES}/artifacts/(?!(.*/)?models/).+"),
        ("promote", ("POST", "PATCH", "DELETE"), rf"{MLFLOW}/(registered-models|model-versions|logged-models|runs"
         r"|experiments)(/.*)?"),
        ("promote", ("PUT", "DELETE"), rf"{FILES}/artifacts/.+"),
        ("promote", ("POST",), rf"{FILES}/mpu/(create|complete|abort)/.+"),
    ],
}  # fmt: skip
PATTERNS = {name: [(who, methods, re.compile(path)) for who, methods, path in rules] for name, rules in RULES.items()}
CROOKED = re.compile(r"//|/\.{1,2}(/|$)|[%\\]")  # what a server might read as another path than we did
CANCEL = ("CANCELLING", "CANCELLED")
MAKES_EXPERIMENT = re.compile(rf"{MLFLOW}/experiments/create")
PLACE = re.compile(r"(mlflow-artifacts:(/[A-Za-z0-9_-]+)+)?")  # in the lab's store; "" for where the server puts it


@dataclass(frozen=True)
class Rights:
    """Which groups of people may do more than everybody."""

    write: str = ""
    """May log runs; "" for nobody."""
    promote: str = ""
    """May also move aliases, change models and delete; "" for nobody."""

    def ranks(self, groups: tuple[str, ...]) -> set[str]:
        """Ranks of a member of these groups."""
        promotes = bool(self.promote) and self.promote in groups
        writes = promotes or (bool(self.write) and self.write in groups)
        return {"all"} | ({"write"} if writes else set()) | ({"promote"} if promotes else set())

    def refused(self, server: str, method: str, path: str, groups: tuple[str, ...]) -> str | None:
        """Why a request may not be made; None when it may."""
        reads = method in READS
        if not reads and CROOKED.search(path):
            return "a plain path is needed to change anything"
        wanted = [who for who, methods, known in PATTERNS[server] if method in methods and known.fullmatch(path)]
        if set(wanted) & self.ranks(groups):
            return None
        if not wanted:
            return "this is done on the servers' own machine, not from elsewhere"
        group = self.write if "write" in wanted else self.promote
        key = "write" if "write" in wanted else "promote"
        who = f"members of the group {group}" if group else "nobody"
        return f"{who} may do this (lab.yaml, serve.{key})"


def placed(content: Mapping[str, Any]) -> bool:
    """Whether an experiment that is asked for keeps its files in the lab's store, and not in a folder of the server."""
    names = [name for name in content if name.replace("_", "").lower() == "artifactlocation"]
    named = isinstance(content.get("name"), str)  # what is no plain object here, the server could read as one
    return named and all(isinstance(content[name], str) and PLACE.fullmatch(content[name]) for name in names)
