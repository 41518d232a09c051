"""Every number of params.yaml has a range beside its field, and a value outside is refused before the first stage."""

import math
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml
from dvc_data.hashfile.meta import Meta

from bumblebee.errors import BadInput
from bumblebee.ranges import Range, Ranged, Text, annotations, fault
from flows.workspace import create, merge
from tasks import sections
from tasks.running import stage
from tasks.settings import params
from tests.tasks.settings.small import HOME, bare, changed, classes, leaves, shipped
from tests.tasks.settings.wrong_values import WRONG

NEEDED = {sections.Round: {"n": 1, "parent": 0}, sections.Loop: {"clusters": [], "rounds": [], "final_round": 0}}
BAD = (-1, -1.5, math.nan, math.inf, -math.inf, 1e300, 10**400, "text", "1e999", [[]], {"a": 1}, True, None)


def written(folder: Path, content: dict[str, Any]) -> Path:
    path = folder / "params.yaml"
    path.write_text(yaml.safe_dump(content, allow_unicode=True))
    return path


def line_of(path: Path) -> str:
    with pytest.raises(BadInput) as caught:
        sections.check(path)
    assert len(str(caught.value).splitlines()) == 1
    return str(caught.value)


@pytest.mark.parametrize("section", [*params.LOOP, *params.SECTIONS])
def test_a_wrong_value_is_refused_in_one_line_that_names_its_key(section: str):
    content = shipped()
    for key, value, named in WRONG:
        if key.partition(".")[0] == section:
            with pytest.raises(BadInput) as caught:
                sections.check_content(changed(content, key, value), Path("params.yaml"))
            said = str(caught.value)
            assert said.startswith(f"params.yaml: {named}"), said
            assert len(said.splitlines()) == 1 and len(said) < 500


def test_the_table_of_wrong_values_covers_every_section():
    assert len(WRONG) >= 100
    assert {key.partition(".")[0] for key, *_ in WRONG} >= set(params.SECTIONS) | set(params.LOOP)


@pytest.mark.parametrize("kind", classes())
def test_no_number_without_both_ends_of_a_range_and_no_text_without_a_limit(kind: type):
    assert issubclass(kind, Ranged) and kind.__dataclass_params__.frozen  # type: ignore[attr-defined]
    for annotation in annotations(kind).values():
        for scalar, meta in leaves(annotation):
            if scalar in (int, float):
                (found,) = (one for one in meta if isinstance(one, Range))
                assert found.least is not None or found.above is not None
                assert found.most is not None or found.below is not None
            elif scalar in (str, Path):
                assert any(isinstance(one, Text) for one in meta)


@pytest.mark.parametrize("kind", classes())
def test_no_setting_has_a_name_that_dvc_leaves_out_of_a_runs_key(kind: type):
    """By such a name DVC's run cache gives a stage the result of before, as if the setting had not changed."""
    assert not {Meta.PARAM_SIZE, Meta.PARAM_NFILES} & set(annotations(kind))


@pytest.mark.parametrize("kind", classes())
def test_a_number_is_refused_or_within_its_range_in_a_file_and_in_python(kind: type):
    for name, annotation in annotations(kind).items():
        scalars = list(leaves(annotation))
        if not {scalar for scalar, _ in scalars} & {int, float}:
            continue
        for bad in BAD:
            value = placed(annotation, bad)
            if fault(annotation, value, name) is None:  # it lies within: the range says so itself
                held = [one for _, meta in scalars for one in meta if isinstance(one, Range)]
                assert bad is None or (bad in (-1, -1.5) and any(one.holds(bad) for one in held)), (name, bad)
                continue
            with pytest.raises(BadInput, match=name) as caught:
                params.build(kind, NEEDED.get(kind, {}) | {name: value}, "params.yaml", "section")
            assert "\n" not in str(caught.value)
            with pytest.raises(ValueError, match=name):
                kind(**NEEDED.get(kind, {}) | {name: tuple(value) if isinstance(value, list) else value})


def placed(annotation: Any, bad: Any) -> Any:
    """The bad number where the field wants one: in a list, a mapping, or by itself."""
    text = str(bare(annotation))
    if text.startswith("tuple"):
        count = 1 if "..." in text else text.count("Range(") or 1
        return [bad] * count
    return {"a": bad} if text.startswith("dict") else bad


@pytest.mark.parametrize("profile", ["", *sorted(file.stem for file in (HOME / "profiles").glob("*.yaml"))])
def test_what_is_shipped_is_within_the_ranges(tmp_path: Path, profile: str):
    content = shipped()
    if profile:
        content = merge(content, params.read(HOME / "profiles" / f"{profile}.yaml"))
    assert set(sections.check(written(tmp_path, content))) == {"", *params.SECTIONS}


def test_presets_and_methods_of_the_benchmarks_are_within_the_ranges():
    """They are made when their modules are imported or called, and hold their ranges then."""
    from benchmarks.baselines.methods import RANDOMISATIONS
    from bumblebee.learning.config import PAPER
    from bumblebee.learning.generalist.distill import PAPER_DAGGER
    from bumblebee.learning.generalist.teacher_student import PAPER_GENERALIST
    from bumblebee.tracking.presets import PAPER_TASK, distillation_task

    presets = (PAPER, PAPER_DAGGER, PAPER_GENERALIST, PAPER_TASK)
    assert all(isinstance(one, Ranged) for one in (*RANDOMISATIONS.values(), *presets))
    assert distillation_task(PAPER_TASK).student.history == 10


@pytest.mark.parametrize(
    ("raw", "said"),
    [
        (b"seal: {}\nmotions: {source: \xff\xfe}\n", "line 2: expected UTF-8 text"),
        (b"seal: " + b"[" * 5000 + b"]" * 5000, "levels of nesting"),
        (b"seal:\n  seed: 1\n  seed: 2\n", "line 3: expected YAML of plain values, came the key 'seed' twice"),
        (b"seal: {}\nseal: {}\n", "line 2: expected YAML of plain values, came the key 'seal' twice"),
        (b"seal:\n\tseed: 1\n", "line 2: expected YAML"),
        (b"seal: !!python/object/apply:os.getcwd []\n", "expected YAML of plain values"),
        (b"- 1\n", "expected sections of parameters"),
        (b"", "expected sections of parameters"),
        (b"seal: {}\n---\nseal: {}\n", "expected YAML"),
    ],
)
def test_a_file_that_is_no_file_of_settings_ends_in_one_line_and_status_2(tmp_path: Path, raw: bytes, said: str):
    path = tmp_path / "params.yaml"
    path.write_bytes(raw)
    with pytest.raises(BadInput) as caught:
        sections.check(path)
    assert said in str(caught.value) and len(str(caught.value).splitlines()) == 1


def test_the_command_ends_with_one_line_and_status_2(tmp_path: Path):
    (tmp_path / "params.yaml").mkdir()
    env = os.environ | {"PYTHONPATH": str(HOME)}
    ran = subprocess.run(
        [sys.executable, "-m", "tasks.sections"], cwd=tmp_path, env=env, capture_output=True, text=True, check=False
    )
    assert (ran.returncode, ran.stdout, ran.stderr) == (2, "", "params.yaml: expected a file, came a folder\n")


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("motions.source", "nowhere"),
        ("motions.source", "~nobody-of-this-name/motions"),
        ("motions.read.skeleton", "nowhere.yaml"),
        ("motions.read.describe.captions_folder", "nowhere"),
        ("filter.overrule", "nowhere.csv"),
        ("filter.policy.source", "nowhere"),
        ("rollouts.source", "nowhere"),
        ("rollouts.source", "params.yaml"),
        ("ingest.incoming", "nowhere/r{round}"),
        ("ingest.model", "nowhere.xml"),
        ("cluster.text_encoder", "./nowhere"),
    ],
)
def test_a_source_that_is_not_there_is_found_before_the_first_stage(tmp_path, monkeypatch, key: str, value: str):
    monkeypatch.chdir(tmp_path)
    path = written(tmp_path, changed(shipped(), key, value))
    assert key in line_of(path)


def test_sources_that_are_there_pass(tmp_path: Path):
    for name in ("mine", "lab", "captions"):
        (tmp_path / name).mkdir()
    (tmp_path / "robot.xml").touch()
    content = changed(shipped(), "motions.source", str(tmp_path / "mine"))
    content = changed(content, "motions.read.describe.captions_folder", str(tmp_path / "captions"))
    (tmp_path / "word.csv").touch()
    content = changed(content, "filter.overrule", str(tmp_path / "word.csv"))
    content = changed(content, "filter.policy.source", "shipped")
    content = changed(content, "rollouts.source", str(tmp_path / "lab"))
    content = changed(content, "ingest.incoming", str(tmp_path / "lab" / "r{round}"))
    sections.check(written(tmp_path, changed(content, "ingest.model", str(tmp_path / "robot.xml"))))


def test_whichever_stage_comes_first_checks_all_sections_once(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("DVC_STAGE", "seal")
    monkeypatch.setattr(stage, "end_with_parent", lambda: None)
    path, ran = written(tmp_path, changed(shipped(), "report.seed", -1)), []
    with pytest.raises(SystemExit) as ended:
        stage.run_stage(lambda: ran.append(1), argv=[], logs=False)
    assert ended.value.code == 2 and not ran and "report.seed" in capsys.readouterr().err
    path.write_text(yaml.safe_dump(shipped()))
    stage.run_stage(lambda: ran.append(1), argv=[], logs=False)
    monkeypatch.setattr(sections, "check", lambda path: pytest.fail("checked again"))
    stage.run_stage(lambda: ran.append(2), argv=[], logs=False)
    assert ran == [1, 2]


@pytest.mark.parametrize("motions", [[1], {"source": 5}, {"source": "~nobody-of-this-name/x"}, {"source": "a\x00b"}])
def test_a_workspace_of_wrong_settings_is_made_and_then_refused_in_one_line(tmp_path: Path, monkeypatch, motions: Any):
    monkeypatch.setattr("flows.workspace.subprocess.run", lambda *a, **k: None)
    (tmp_path / ".dvc").mkdir()
    (tmp_path / ".dvc" / "config").touch()
    path = written(tmp_path, changed(shipped(), "motions", motions))
    create(tmp_path)
    assert line_of(path).startswith(f"{path}: motions")
