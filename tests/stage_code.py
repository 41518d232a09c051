"""Code that each stage calls, and so depends on in dvc.yaml.

Renew dvc.yaml's lines of code after a module came, moved or went: python -m tests.stage_code
"""

import re
from collections.abc import Iterable
from functools import cache
from pathlib import Path

import yaml

from tests.import_graph import Graph, call_graph, modules, reached

HOME = Path(__file__).parent.parent

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
    "tasks/running/stage.py": "starts a stage and stores what it made",
    "tasks/running/paths.py": "where that lies; dvc.yaml says it too",
    "tasks/settings/params.py": "reads parameters; what they are is a dependency of its own",
    "tasks/sections.py": "the same",
    "tasks/running/parent.py": "ends with the process that started it",
    "tasks/running/recorder.py": "what MLflow is told",
    "tasks/approvals/ledger.py": "a copy of what was answered, which no stage reads",
    "tasks/registry/": "what MLflow is told",
    "tasks/running/outputs.py": "what MLflow is told",
    "tasks/lab/": "where that is kept, and who may look at it",
    "tasks/running/run_form.py": "the same",
    "tasks/running/lineage.py": "the same",
    "tasks/running/lock_file.py": "the same",
}
_PAGE = "draws the page for people, which no later stage reads"
_NETWORK = "of learning/ppo/learner.py it takes the algorithm; the task of policies and their motions are not its own"
_CONTRACT = "of an exported policy it reads the contract and the hash, of which this is no part"
_DRAWN = ("example_windows", "gain_by_horizon", "headline", "html", "left_table", "page", "svg", "terminal")
NO_RESULT_OF = {
    "ingest": {
        "tasks/approvals/words.py": _PAGE,
        "tasks/pages/overview.py": _PAGE,
        "bumblebee/measured/overview_plots.py": _PAGE,
        "bumblebee/report/": _PAGE,
        **{
            f"tasks/approvals/{name}.py": "who answers, and how; the request is not its result"
            for name in ("people", "table")
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


def code_deps(stage: str) -> list[str]:
    """Code that a stage is to depend on: its module first; a folder in the place of files where it calls most of them.

    A folder with a file that this stage is spared is never named whole.
    """
    own = tuple(NO_RESULT_OF.get(stage, ()))
    called = {path for path in called_files(stage) if not path.endswith("__init__.py")}
    wanted = {path for path in called if not path.startswith((*NO_RESULT, *own))}
    known = {str(path.relative_to(HOME)) for path in modules(HOME).values() if path.name != "__init__.py"}
    whole: list[str] = []
    for folder in sorted({str(parent) for path in wanted for parent in Path(path).parents if len(parent.parts) > 1}):
        inside = {path for path in known if path.startswith(f"{folder}/")}
        spared = any(path.startswith(own) for path in inside) if own else False
        if not covered(folder, whole) and not spared and 2 * len(inside & wanted) > len(inside):
            whole.append(folder)
    first = f"tasks/{stage}.py"
    return [first, *sorted({*whole, *(path for path in wanted if not covered(path, whole))} - {first})]


def renewed(text: str) -> str:
    """The text of dvc.yaml with each stage's lines of code as they are to be; comments and the rest stay."""
    for stage in described():
        lines = "".join(f"      - {path}\n" for path in code_deps(stage))
        block = re.compile(
            rf"(^  {stage}:\n(?:(?!^  \w).*\n)*?    deps:\n)(?:      - (?:bumblebee|tasks)/\S+\n)+", re.M
        )
        text, count = block.subn(lambda found, lines=lines: found[1] + lines, text)
        assert count == 1, stage
    return text


if __name__ == "__main__":
    file = HOME / "dvc.yaml"
    file.write_text(renewed(file.read_text()))
