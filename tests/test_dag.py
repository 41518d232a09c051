"""The graph of stages, kept as text: whoever changes it sees the change in the diff.

Renew with: python -m tests.test_dag
"""

from pathlib import Path

from flows.stages import read_stages
from tests.stage_code import NO_RESULT, NO_RESULT_OF, called_files, covered, described

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


def test_a_stage_depends_on_all_code_that_it_calls():
    """However far away: a change there makes it stale, or it is said above why not."""
    missing = []
    for name, stage in described().items():
        spared = tuple([*NO_RESULT, *NO_RESULT_OF.get(name, ())])
        called = {path for path in called_files(name) if not path.endswith("__init__.py")}  # faces pass names on
        wanting = (path for path in called if not path.startswith(spared))
        missing += [f"{name}: {path}" for path in sorted(wanting) if not covered(path, stage["deps"])]
    assert missing == [], "python -m tests.stage_code writes what is missing"


def test_a_stage_depends_on_no_code_that_it_does_not_call():
    for name, stage in described().items():
        called = called_files(name)
        code = [dep for dep in stage["deps"] if dep.startswith(("bumblebee/", "tasks/"))]
        assert [dep for dep in code if not any(covered(path, [dep]) for path in called)] == [], name


def test_no_reason_is_given_for_what_no_stage_calls():
    files = {name: called_files(name) for name in described()}
    everywhere = set().union(*files.values())
    assert [path for path in NO_RESULT if not any(f.startswith(path) for f in everywhere)] == []
    for name, reasons in NO_RESULT_OF.items():
        assert [path for path in reasons if not any(f.startswith(path) for f in files[name])] == [], name


def test_a_new_style_sheet_of_a_page_makes_nothing_stale_but_the_report():
    def stale(page: str) -> set[str]:
        assert (HOME / page).is_file(), page
        return {name for name, stage in described().items() if covered(page, stage["deps"])}

    for page in ("html.py", "page.py"):
        assert stale(f"bumblebee/diagnosis/report/{page}") == set()
    assert stale("tasks/pages/overview.py") == {"report"}
    assert stale("bumblebee/report/page.py") == {"report"}


def test_what_follows_a_diagnosis_does_not_read_its_page():
    for name, stage in described().items():
        deps = [dep for dep in stage["deps"] if dep.startswith("data/diagnosis")]
        assert all(dep.endswith(("/diagnosis.json", "/effects.yaml", "/model.xml")) for dep in deps), name


if __name__ == "__main__":
    SNAPSHOT.write_text(drawn())
