"""The process that writes a stage's run to MLflow beside it."""

import errno
from pathlib import Path

import pytest

from bumblebee.errors import BadInput
from tasks import registry
from tasks.running import recorder
from tasks.running.stage import disk_line


@pytest.fixture
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PYTHONPATH", str(Path(recorder.__file__).parents[2]))
    (tmp_path / "dvc.yaml").write_text("stages: {}\n")
    return tmp_path


def run(**over: object) -> dict[str, object]:
    empty = {"cluster": None, "round": None, "params": None, "metrics": {}, "curve": None, "tags": {}}
    return {"stage": "base", **empty, **over}


def test_the_run_is_written_with_everything_in_it(workspace: Path) -> None:
    curve = workspace / "curve.csv"
    curve.write_text("frames,reward\n10,0.5\n20,0.75\n")
    recorder.start()
    numbers = {"x": 0.5, "error": {200: 2.0, 1000: 3.0}}
    recorder.record(run(cluster="c0", round=1, params={"a": {"b": 2}}, metrics=numbers, curve=curve))
    client = registry.prepare()
    experiment = client.get_experiment_by_name(workspace.name)
    (found,) = client.search_runs([experiment.experiment_id])
    assert found.data.params == {"a.b": "2"}
    assert found.data.metrics == {"x": 0.5, "error": 3.0, "reward": 0.75}
    points = client.get_metric_history(found.info.run_id, "error")
    assert [(point.step, point.value) for point in points] == [(200, 2.0), (1000, 3.0)]
    assert (found.data.tags["cluster"], found.data.tags["round"]) == ("c0", "1")
    assert [item.path for item in client.list_artifacts(found.info.run_id)] == ["lineage.json", "outputs.json"]


def test_a_failure_is_the_stages(workspace: Path) -> None:
    recorder.start()
    with pytest.raises(FileNotFoundError, match="no-curve"):
        recorder.record(run(curve=workspace / "no-curve.csv"))


def test_a_full_disk_is_still_known_as_one_on_the_other_side() -> None:
    full = recorder.heard("a warning\n" + recorder.told(OSError(errno.ENOSPC, "No space left", "artifacts/x")))
    assert isinstance(full, OSError) and disk_line(full) is not None and full.filename == "artifacts/x"
    database = recorder.heard(recorder.told(ValueError("database or disk is full\n[SQL: INSERT]\n(Background: ...)")))
    assert isinstance(database, RuntimeError) and "database or disk is full" in str(database)
    bad = BadInput(Path("x.db"), "a database", "text", "mv it.")
    assert str(recorder.heard(recorder.told(bad))) == str(bad)
    assert "Killed" in str(recorder.heard("Killed\n")) and str(recorder.heard(""))


@pytest.mark.parametrize(
    ("kind", "text"),
    [
        ("EndpointConnectionError", 'Could not connect to the endpoint URL: "http://s3.lab/bumblebee/x"'),
        ("ReadTimeoutError", 'Read timeout on endpoint URL: "http://s3.lab/bumblebee/x"'),
        ("MlflowException", "(psycopg2.OperationalError) server closed the connection unexpectedly"),
    ],
)
def test_a_labs_servers_that_are_away_are_one_line_and_no_error_of_ours(kind: str, text: str) -> None:
    away = recorder.heard(recorder.told(type(kind, (Exception,), {})(text)))
    assert isinstance(away, BadInput) and text in str(away) and "start again when they answer" in str(away)


def test_a_stage_that_ends_without_a_run_leaves_none(workspace: Path) -> None:
    recorder.start()
    process = recorder._started.pop()
    process.communicate("")
    assert process.returncode == 0
    client = registry.prepare()
    assert client.search_runs([client.get_experiment_by_name(workspace.name).experiment_id]) == []


def test_a_stages_run_lasts_from_the_stages_beginning(monkeypatch: pytest.MonkeyPatch) -> None:
    told: dict[str, object] = {}
    monkeypatch.setattr(registry, "log_run", lambda **given: told.update(given))
    recorder.record(run())
    assert told["begun"] == recorder._BEGUN
