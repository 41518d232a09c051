"""The graph of stages, kept as text: whoever changes it sees the change in the diff.

Renew with: python -m tests.test_dag
"""

from collections.abc import Iterable
from functools import cache
from pathlib import Path

import yaml

from flows.stages import read_stages
from tests.import_graph import Graph, call_graph, modules, reached

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


# What stages call and need not depend on, by the beginning of its path, each with the reason why its change may leave
# their outputs as they are.
NO_RESULT = {
    "bumblebee/errors.py": "how a refusal reads",
    "bumblebee/last_line.py": "how a command ends",
    "bumblebee/progress.py": "bars on the terminal",
    "bumblebee/files.py": "writes whole or not at all",
    "bumblebee/io/": "reads within limits and writes whole: it refuses or passes, and changes no value",
    "bumblebee/ranges.py": "refuses settings; those that pass are among the parameters",
    "bumblebee/learning/checkpoint.py": "what a killed training goes on from",
    "bumblebee/learning/gpu_memory.py": "refuses a GPU that is too small, or passes",
    "bumblebee/learning/curve.py": "the learning curve, to be looked at",
    "bumblebee/measured/metadata.py": "reads and writes files of rollouts: it refuses or passes",
    "bumblebee/measured/tables.py": "the same",
    "bumblebee/measured/csv_faults.py": "how a refusal reads",
    **{
        f"bumblebee/motion/{name}.py": "reads and writes the library of clips: it refuses or passes"
        for name in ("captions", "checks", "clip_facts", "parquet", "raw", "texts")
    },
    "bumblebee/motion/store/": "the same",
    "tasks/stage.py": "starts a stage and stores what it made",
    "tasks/paths.py": "where that lies; dvc.yaml says it too",
    "tasks/params.py": "reads parameters; what they are is a dependency of its own",
    "tasks/sections.py": "the same",
    "tasks/parent.py": "ends with the process that started it",
    "tasks/recorder.py": "what MLflow is told",
    "bumblebee/measured/gate_record.py": "a copy of what was answered, which no stage reads",
    "tasks/registry/": "what MLflow is told",
    "tasks/outputs.py": "what MLflow is told",
    "tasks/database.py": "keeps what MLflow is told",
    "tasks/private.py": "who may look at what DVC keeps",
    "tasks/lab.py": "where that is kept",
    "tasks/lab_checks.py": "the same",
    "tasks/lab_serve.py": "the same",
    "tasks/run_form.py": "the same",
    "tasks/lineage.py": "the same",
    "tasks/lock_file.py": "the same",
}
_PAGE = "draws the page for people, which no later stage reads"
_NETWORK = "of learning/ppo.py it takes the algorithm; the task of policies and their motions are not its own"
_CONTRACT = "of an exported policy it reads the contract and the hash, of which this is no part"
_DRAWN = ("example_windows", "gain_by_horizon", "headline", "html", "left_table", "page", "svg", "terminal")
NO_RESULT_OF = {
    "ingest": {
        **{f"bumblebee/measured/{name}.py": _PAGE for name in ("gate_words", "overview", "overview_plots")},
        **{
            f"bumblebee/measured/{name}.py": "who answers, and how; the request is not its result"
            for name in ("gate_people", "gate_table")
        },
    },
    "diagnose": {
        **{
            f"bumblebee/diagnosis/report/{name}.py": _PAGE
            # html also rounds the numbers in notes
            for name in _DRAWN
        },
        "bumblebee/report/": _PAGE,
        "bumblebee/diagnosis/gap/": "another command writes it",
        "bumblebee/diagnosis/places.py": "refuses a folder that is in use",
    },
    "report": {"bumblebee/diagnosis/report/": "the diagnosis' own page"},
    "compensate": {"bumblebee/measured/model_file.py": "loads a user's model; the loop's is the G1"},
    "delta": {
        path: _NETWORK
        for path in (
            "bumblebee/tracking/",
            "bumblebee/motion/",
            "bumblebee/learning/learner.py",
            "bumblebee/learning/policy.py",
            "bumblebee/learning/ranks.py",
        )
    },
    "publish": {
        f"bumblebee/{room}": _CONTRACT
        for room in ("effects/", "motion/", "quaternions.py", "robot/", "sim/", "tracking/")
    },
}


def described() -> dict[str, dict[str, list[str]]]:
    """The stages of dvc.yaml as they stand there."""
    return yaml.safe_load((HOME / "dvc.yaml").read_text())["stages"]


@cache
def called_files(stage: str) -> frozenset[str]:
    """The files of the stage's module and of all that it calls."""
    start, known = f"tasks.{stage}", modules(HOME)
    return frozenset(str(known[name].relative_to(HOME)) for name in {start} | reached(calls(), start))


@cache
def calls() -> Graph:
    """Who calls whom; read once."""
    return call_graph(HOME)


def covered(path: str, deps: Iterable[str]) -> bool:
    """Whether a file is one of the dependencies or lies in one."""
    return any(path == dep or path.startswith(f"{dep}/") for dep in deps)


def test_a_stage_depends_on_all_code_that_it_calls():
    """However far away: a change there makes it stale, or it is said above why not."""
    missing = []
    for name, stage in described().items():
        spared = tuple([*NO_RESULT, *NO_RESULT_OF.get(name, ())])
        called = {path for path in called_files(name) if not path.endswith("__init__.py")}  # faces pass names on
        wanting = (path for path in called if not path.startswith(spared))
        missing += [f"{name}: {path}" for path in sorted(wanting) if not covered(path, stage["deps"])]
    assert missing == []


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

    for page in ("diagnosis/report/html.py", "diagnosis/report/page.py", "measured/overview.py"):
        assert stale(f"bumblebee/{page}") == set()
    assert stale("bumblebee/report/page.py") == {"report"}


def test_what_follows_a_diagnosis_does_not_read_its_page():
    for name, stage in described().items():
        deps = [dep for dep in stage["deps"] if dep.startswith("data/diagnosis")]
        assert all(dep.endswith(("/diagnosis.json", "/effects.yaml", "/model.xml")) for dep in deps), name


if __name__ == "__main__":
    SNAPSHOT.write_text(drawn())
