"""The picture of the loop: every stage once, in its turn, with its state, in 100 columns."""

import io
from pathlib import Path

import pytest
from rich.console import Console

from bumblebee.errors import EXIT_BAD_INPUT
from flows.stages import AFTER, DONE, LACKS, STALE, WIDTH, Stage, by_level, main, state_of, table, to_run

STAGES = [
    Stage("base", "python -m tasks.base", frozenset(), frozenset()),
    *[
        Stage(f"experts@c{n}", f"python -m tasks.experts --round 0 --cluster c{n}", frozenset({"base"}), frozenset())
        for n in range(9)
    ],
    Stage(
        "gate", "python -m tasks.gate --round 1", frozenset({"experts@c1"}), frozenset({"data/approvals/round-1.json"})
    ),
    Stage("end", "python -m tasks.end", frozenset({"gate", "base", *(f"experts@c{n}" for n in range(9))}), frozenset()),
]


def test_stages_come_in_turns_that_can_run_side_by_side() -> None:
    levels = [[stage.name for stage in level] for level in by_level(STAGES)]
    assert levels == [["base"], [f"experts@c{n}" for n in range(9)], ["gate"], ["end"]]


def test_each_stage_has_its_state() -> None:
    changed = {"experts@c1"}
    busy = to_run(STAGES, changed)
    states = {stage.name: state_of(stage, changed, busy) for stage in STAGES}
    assert (states["base"], states["experts@c1"], states["end"]) == (DONE, STALE, AFTER)
    assert states["gate"] == f"{LACKS} data/approvals/round-1.json"


def test_the_table_has_every_stage_once_in_at_most_100_columns() -> None:
    out = io.StringIO()
    Console(file=out, width=WIDTH).print(table(STAGES, {"base"}))
    lines = out.getvalue().splitlines()
    assert max(map(len, lines)) <= WIDTH
    for stage in STAGES:
        assert sum(line[6:].startswith(f"{stage.title} ") for line in lines) == 1, stage.title
    assert "base" not in lines[-1].partition(AFTER)[2], "what is read through another stage is left out"


def test_a_folder_without_stages_is_refused_in_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--workspace", str(tmp_path)]) == EXIT_BAD_INPUT
    assert capsys.readouterr().err.count("\n") == 1
