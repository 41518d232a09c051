"""profiles/world_model.yaml: the demo with the other learner in the stage that trains."""

from flows.workspace import HOME, merge
from tasks.refine import RefineConfig
from tasks.sections import check_content
from tasks.settings import params

FILE = HOME / "profiles" / "world_model.yaml"


def test_the_profile_changes_the_refinement_alone_and_the_stage_takes_it() -> None:
    demo = params.read(HOME / "params.yaml")
    changed = merge(demo, params.read(FILE))
    check_content(changed, FILE)
    assert {name for name in changed if changed[name] != demo.get(name)} == {"refine"}
    assert params.section_of(changed, "refine", RefineConfig, FILE).learner == "world_model"
