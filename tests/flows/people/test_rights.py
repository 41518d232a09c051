"""Who may change what, tried on everything that the installed Prefect and MLflow answer."""

import re
from collections.abc import Iterator

import pytest

from flows.people.rights import READS, Rights

RIGHTS = Rights(write="robotics", promote="leads")
GROUPS = {"all": (), "write": ("robotics",), "promote": ("leads",)}
NUMBER = "0" * 8 + "-" + "-".join(["0" * 4] * 3) + "-" + "0" * 12


def may(server: str, method: str, path: str) -> set[str]:
    """Ranks that may do it."""
    return {rank for rank, groups in GROUPS.items() if RIGHTS.refused(server, method, path, groups) is None}


def of_prefect() -> Iterator[tuple[str, str]]:
    """Every method and path of Prefect's interface."""
    from prefect.server.api.server import API_ROUTERS

    for router in API_ROUTERS:
        for route in router.routes:
            path = re.sub(r"\{\w*id:uuid\}", NUMBER, str(getattr(route, "path", "")))
            path = re.sub(r"\{[^}]*\}", "x", path)
            for method in getattr(route, "methods", None) or ("WEBSOCKET",):
                yield method, f"/api{path}"


def of_mlflow() -> Iterator[tuple[str, str]]:
    """Every method and path of MLflow's interface that Flask answers."""
    from mlflow.server import app

    for rule in app.url_map.iter_rules():
        for method in rule.methods or ():
            yield method, re.sub(r"<[^>]*>", "x", rule.rule)


def open_to(rank: str, server: str) -> set[str]:
    """Requests that change something and are open to a rank, without the servers' prefixes."""
    routes = of_prefect() if server == "prefect" else of_mlflow()
    changes = {(method, path) for method, path in routes if method not in READS and rank in may(server, method, path)}
    return {
        f"{method} {re.sub(r'^/(ajax-)?api/([234].0/)?', '', path).replace(NUMBER, 'N')}" for method, path in changes
    }


def test_what_everybody_may_ask_of_prefect_by_post_changes_nothing_but_runs_of_the_loop() -> None:
    reads = r"/(filter|counts?|paginate|history|lateness|count-by/x|count-deployments|next-runs|count-task-runs)$"
    found = {what for what in open_to("all", "prefect") if not re.search(reads, what)}
    assert found == {
        "POST deployments/N/create_flow_run",
        "POST flow_runs/N/resume",
        "POST flow_runs/N/set_state",
        "POST ui/schemas/validate",
        "WEBSOCKET events/out",
        "WEBSOCKET logs/out",
    }


def test_nobody_changes_from_elsewhere_what_prefect_runs_or_deletes_its_history() -> None:
    for method, path in of_prefect():
        decides = re.search(r"/(deployments|block_\w+|work_pools|work_queues|automations|variables|admin)\b", path)
        read = re.search(r"/(filter|count|paginate|create_flow_run)$", path)
        if method == "DELETE" or (method not in READS and decides and not read):
            assert may("prefect", method, path) == set(), (method, path)
        if "block_documents" in path:
            assert may("prefect", method, path) == set(), (method, path)
    assert may("prefect", "POST", f"/api/flow_runs/{NUMBER}/input") == set()


def test_what_everybody_may_ask_of_mlflow_by_post_changes_nothing() -> None:
    assert open_to("all", "mlflow") == {
        "POST mlflow/datasets/search", "POST mlflow/experiments/search", "POST mlflow/logged-models/search",
        "POST mlflow/runs/search", "POST mlflow/traces/search", "POST mlflow/registered-models/get-latest-versions",
        "POST mlflow/traces/batchGetInfos", "POST mlflow/traces/metrics", "POST mlflow/experiments/search-datasets",
        "POST 2.0mlflow/experiments/search-datasets", "POST mlflow/artifacts/presigned-download-url", "POST /graphql",
    }  # fmt: skip


def test_a_writer_logs_runs_and_touches_no_model() -> None:
    assert open_to("write", "mlflow") - open_to("all", "mlflow") == {
        "POST mlflow/experiments/create", "POST mlflow/runs/create", "POST mlflow/runs/update",
        "POST mlflow/runs/set-tag", "POST mlflow/runs/delete-tag", "POST mlflow/runs/outputs",
        "POST mlflow/runs/log-batch", "POST mlflow/runs/log-metric", "POST mlflow/runs/log-parameter",
        "POST mlflow/runs/log-inputs", "POST mlflow/runs/log-model", "PUT mlflow-artifacts/artifacts/x",
    }  # fmt: skip


@pytest.mark.parametrize("prefix", ["/api/2.0", "/ajax-api/2.0"])
def test_only_who_promotes_moves_aliases_and_deletes(prefix: str) -> None:
    for method, what in (
        ("POST", "mlflow/registered-models/alias"), ("DELETE", "mlflow/registered-models/alias"),
        ("DELETE", "mlflow/registered-models/delete"), ("DELETE", "mlflow/model-versions/delete"),
        ("POST", "mlflow/model-versions/set-tag"), ("POST", "mlflow/runs/delete"),
        ("POST", "mlflow/experiments/delete"), ("PUT", "mlflow-artifacts/artifacts/runs/models/m-1/policy.onnx"),
        ("DELETE", "mlflow-artifacts/artifacts/runs/x/file"), ("PATCH", "mlflow/logged-models/m-1"),
    ):  # fmt: skip
        assert may("mlflow", method, f"{prefix}/{what}") == {"promote"}, what
    assert may("mlflow", "GET", f"{prefix}/mlflow/registered-models/alias") == {"all", "write", "promote"}


@pytest.mark.parametrize(
    "path", ["a//models/m", "a/../models/m", "a/./b", "a/%6dodels/m", "a\\models\\m", "models/m", "a/models/m"]
)
def test_no_spelling_of_a_path_leads_a_writers_file_into_a_model(path: str) -> None:
    assert "write" not in may("mlflow", "PUT", f"/api/2.0/mlflow-artifacts/artifacts/{path}")


def test_what_starts_programs_or_reaches_others_is_open_to_nobody() -> None:
    for method, path in of_mlflow():
        if re.search(r"/mlflow/(assistant|gateway|webhooks|prompt-optimization|scorers)\b", path):
            assert may("mlflow", method, path) == set(), (method, path)
    for path in ("/ajax-api/3.0/mlflow/assistant/message", "/gateway/openai/v1/responses", "/ajax-api/3.0/jobs/"):
        assert may("mlflow", "POST", path) == set()


def test_groups_that_lab_yaml_does_not_name_are_nothing() -> None:
    assert Rights().ranks(("robotics", "")) == {"all"}
    said = Rights().refused("mlflow", "POST", "/api/2.0/mlflow/registered-models/alias", ("leads",))
    assert said == "nobody may do this (lab.yaml, serve.promote)"
