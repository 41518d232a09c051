"""The graph of stages, kept as text: whoever changes it sees the change in the diff.

Renew with: python -m tests.test_dag
"""

from pathlib import Path

from flows.stages import read_stages

HOME = Path(__file__).parent.parent
SNAPSHOT = Path(__file__).parent / "dag.txt"


def drawn(workspace: Path = HOME) -> str:
    """One line a stage: its name, and the stages whose files it reads."""
    stages = sorted(read_stages(workspace), key=lambda stage: stage.name)
    return "".join(f"{stage.name} <- {', '.join(sorted(stage.needs)) or '-'}\n" for stage in stages)


def test_the_graph_is_the_one_in_the_snapshot():
    assert drawn() == SNAPSHOT.read_text(), "the DAG changed; if it should: python -m tests.test_dag"


def test_a_stage_comes_after_those_it_needs():
    seen: set[str] = set()
    for stage in read_stages(HOME):
        assert stage.needs <= seen, stage.name
        seen.add(stage.name)


def test_only_the_answer_at_a_gate_is_made_by_no_stage():
    for stage in read_stages(HOME):
        outside = {path for path in stage.lacks if path.startswith(("data/", "models/", "reports/"))}
        expected = {f"data/approvals/round-{stage.option('round')}.json"} if stage.kind == "gate" else set()
        assert outside <= expected, stage.name


def test_the_sealed_effects_are_read_by_the_stand_in_and_the_report_only():
    text = {stage.name: stage for stage in read_stages(HOME)}
    readers = {stage.kind for stage in text.values() if "seal" in stage.needs}
    assert readers == {"rollouts", "evaluate", "report"}


if __name__ == "__main__":
    SNAPSHOT.write_text(drawn())
