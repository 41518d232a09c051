"""A stage or a reward term that lacks a part says so, and names the file and what to add.

docs/adding-a-stage.md and docs/adding-a-reward.md are the worked examples.
"""

import re
from pathlib import Path

import pytest
import yaml

from bumblebee.tracking import rewards
from tasks.running import paths

HOME = Path(__file__).parent.parent
STAGES = yaml.safe_load((HOME / "dvc.yaml").read_text())["stages"]
TERMS = {**rewards.PENALTIES, **rewards.ERRORS}
# Sections that a stage reads and need not depend on, each with the reason.
SPARED = {("ingest", "gate"): "it only says whether the loop answers by itself"}
# What stages read by a way that dvc.yaml names otherwise.
READ_OTHERWISE = {
    ("publish", "data/filtered"): "facts for the model card; through data/evaluation",
    ("report", "data/filtered"): "through data/evaluation",
    ("report", "data/motions"): "through data/filtered",
    ("report", "models"): "through data/published.json",
}


def source(stage: str) -> str:
    """The text of a stage's module."""
    return (HOME / "tasks" / f"{stage}.py").read_text()


def test_a_module_that_runs_as_a_stage_stands_in_dvc_yaml():
    modules = [
        file.stem for file in sorted((HOME / "tasks").glob("*.py")) if "\n    run_stage(main" in file.read_text()
    ]
    missing = [f"dvc.yaml: add the stage {name}, cmd: python -m tasks.{name}" for name in modules if name not in STAGES]
    assert missing == [], missing


@pytest.mark.parametrize("stage", STAGES)
def test_a_stage_depends_on_the_sections_that_its_module_loads(stage: str):
    loaded = set(re.findall(r'(?<![\w.])load\(\s*"(\w+)"', source(stage)))
    wanting = sorted(name for name in loaded - set(STAGES[stage]["params"]) if (stage, name) not in SPARED)
    assert wanting == [], f"dvc.yaml, stage {stage}: add {wanting} to params, or a change there does not run it again"


@pytest.mark.parametrize("stage", STAGES)
def test_a_stage_names_the_paths_that_its_module_uses(stage: str):
    """Paths that are constants in running/paths.py; those of rounds and clusters are spelled in dvc.yaml alone."""
    entry = STAGES[stage]
    named = [path if isinstance(path, str) else next(iter(path)) for path in (*entry["deps"], *entry["outs"])]
    for name in sorted(set(re.findall(r"\bpaths\.([A-Z][A-Z_]*)\b", source(stage)))):
        path = getattr(paths, name)
        if not isinstance(path, Path) or path == paths.SCRATCH:
            continue
        spared = any(who == stage and str(path).startswith(place) for who, place in READ_OTHERWISE)
        known = any(f"{path}/".startswith(f"{one}/") or one.startswith(f"{path}/") for one in named)
        assert spared or known, f"dvc.yaml, stage {stage}: add {path} (tasks/running/paths.py: {name}) to deps or outs"


@pytest.mark.parametrize("stage", STAGES)
def test_a_stage_has_its_row_in_the_documents(stage: str):
    row = re.compile(rf"^\| `{stage}[`@]", re.MULTILINE)
    text = (HOME / "docs/architecture.md").read_text()
    assert row.search(text), f"docs/architecture.md: add a row for `{stage}` to 'Stages and files'"


def test_every_row_of_the_reward_is_registered():
    """A function on a `Step` that no table has is never called."""
    functions = re.findall(r"^def ([a-z]\w*)\(step: Step\)", Path(rewards.__file__).read_text(), re.MULTILINE)
    missing = [name for name in functions if name not in TERMS]
    assert missing == [], f"bumblebee/tracking/rewards.py: add {missing} to PENALTIES or ERRORS"


@pytest.mark.parametrize("name", rewards.ERRORS)
def test_every_error_has_a_sharpness_in_both_presets(name: str):
    assert name in rewards.DEMO_SHARPNESS, f"bumblebee/tracking/rewards.py: add {name} to DEMO_SHARPNESS"
    assert name in rewards.PAPER_SHARPNESS, f"bumblebee/tracking/rewards.py: add {name} to PAPER_SHARPNESS"


@pytest.mark.parametrize("name", TERMS)
def test_every_term_has_a_test_by_hand_and_one_beside_the_table_its_words(name: str):
    tests = (HOME / "tests/tracking/test_rewards.py").read_text()
    assert name == "alive" or re.search(rf"\b{name}\b", tests), (
        f"tests/tracking/test_rewards.py: add a value of {name} by hand"
    )
    words = (HOME / "docs/decisions/rewards.md").read_text()
    told = name in rewards.PAPER_WEIGHTS or name in words or name == "alive"
    assert told, f"docs/decisions/rewards.md: say what {name} is; the paper's table does not have it"
