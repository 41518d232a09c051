"""The log of the loop: a stage's failure is said once, in its own words."""

import logging
from pathlib import Path

import pytest

from flows import loop


def record(text: str) -> logging.LogRecord:
    return logging.LogRecord("prefect.task_runs", logging.ERROR, "", 0, text, None, None)


def test_prefects_echo_of_a_failed_stage_is_left_out_and_all_else_is_kept():
    logger = logging.getLogger("prefect.task_runs")
    assert not logger.filter(record("Task run failed with state: Failed(message='base: no')"))
    assert not logger.filter(record("Finished in state Failed('base: no')"))
    assert logger.filter(record("Finished in state Crashed('killed')"))
    assert logger.filter(record("base: no such file"))


@pytest.mark.parametrize(
    ("content", "said"),
    [("seal: {seed: 4}\nfinal_round: 1\n", "lab-2, seed 4, round 1"),
     ("seal: {seed: 4}\nfinal_round: 2\nrollouts: {source: data/incoming}\n", "lab-2, round 2"),
     ("[", "lab-2")],
)  # fmt: skip
def test_a_run_is_named_by_workspace_seed_and_round(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, content: str, said: str
) -> None:
    folder = tmp_path / "runs" / "lab-2"
    folder.mkdir(parents=True)
    (folder / "params.yaml").write_text(content)
    monkeypatch.setenv("BUMBLEBEE_WORKSPACE", str(folder))
    assert loop.run_name() == said
    assert loop.loop.flow_run_name is loop.run_name
