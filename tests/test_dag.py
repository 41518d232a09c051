"""The graph of stages, kept as text: whoever changes it sees the change in the diff.

Renew with: python -m tests.test_dag
"""

from pathlib import Path

import yaml

from flows.stages import read_stages
from tests.test_imports import imports

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


# Shared by all stages, and changed without changing what any of them finds.
NO_RESULT = ("bumblebee/errors", "bumblebee/files", "bumblebee/progress", "bumblebee/motion/store")


def test_a_stage_depends_on_the_code_that_it_calls():
    """Every library module that a stage imports itself is among its dependencies: a change there makes it stale."""
    described = yaml.safe_load((HOME / "dvc.yaml").read_text())["stages"]
    missing = []
    for name, stage in described.items():
        code = [dep for dep in stage["deps"] if dep.startswith(("bumblebee", "tasks"))]
        for _, module in imports(HOME / "tasks" / f"{name}.py"):
            path = "/".join(module.split(".")[:3])
            found = next((p for p in (f"{path}.py", path) if (HOME / p).exists()), None)
            if not module.startswith("bumblebee.") or found is None or found.startswith(NO_RESULT):
                continue
            if not any(found == dep or found.startswith(f"{dep}/") for dep in code):
                missing.append(f"{name}: {found}")
    assert missing == []


if __name__ == "__main__":
    SNAPSHOT.write_text(drawn())
