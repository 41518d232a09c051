"""A workspace holds its own settings and data, uses the checkout's code, and keeps what it has."""

from pathlib import Path

import pytest
import yaml

from bumblebee.errors import BadInput
from flows import demo
from flows import workspace as workspaces
from flows.stages import read_stages
from tasks.settings.params import read


def test_sections_merge_and_everything_else_is_replaced():
    base = {"clusters": ["c0", "c1"], "base": {"ppo": {"iterations": 600, "gamma": 0.97}, "seed": 0}}
    over = {"clusters": ["c0"], "base": {"ppo": {"iterations": 2}}}
    merged = workspaces.merge(base, over)
    assert merged == {"clusters": ["c0"], "base": {"ppo": {"iterations": 2, "gamma": 0.97}, "seed": 0}}
    assert base["base"]["ppo"]["iterations"] == 600


def test_every_profile_only_changes_keys_that_are_known():
    known = set(read(workspaces.HOME / "params.yaml"))
    for profile in (workspaces.HOME / "profiles").glob("*.yaml"):
        assert set(read(profile)) <= known


def test_a_workspace_has_the_checkouts_graph_and_its_own_parameters(tmp_path: Path):
    folder = workspaces.create(tmp_path / "lab", gate={"mode": "ask"})
    assert {s.name for s in read_stages(folder)} == {s.name for s in read_stages(workspaces.HOME)}
    assert read(folder / "params.yaml")["gate"] == {"mode": "ask"}
    assert (folder / "bumblebee" / "errors.py").samefile(workspaces.HOME / "bumblebee" / "errors.py")


def test_making_it_again_changes_nothing_and_keeps_data(tmp_path: Path):
    folder = workspaces.create(tmp_path / "lab")
    (folder / "data" / "x").touch()
    before = {p: p.lstat().st_mtime_ns for p in folder.rglob("*") if ".dvc/tmp" not in str(p)}
    workspaces.create(folder)
    assert {p: p.lstat().st_mtime_ns for p in folder.rglob("*") if ".dvc/tmp" not in str(p)} == before


def test_settings_that_were_edited_in_the_workspace_are_kept(tmp_path: Path):
    """Also when it is brought up to date with other motions; what nobody edited follows the checkout."""
    folder = workspaces.create(tmp_path / "lab", profile="smoke")
    edited = (folder / "params.yaml").read_text().replace("mode: auto", "mode: ask")
    assert "mode: ask" in edited
    (folder / "params.yaml").write_text(edited)
    workspaces.create(folder, profile="smoke")
    assert (folder / "params.yaml").read_text() == edited
    (tmp_path / "mocap").mkdir()
    workspaces.create(folder, motions=tmp_path / "mocap")
    now = read(folder / "params.yaml")
    assert now["gate"] == {"mode": "ask"} and now["motions"]["source"] == str(tmp_path / "mocap")
    assert now["rollouts"]["base"] == "none"
    (folder / "params.yaml").write_text((folder / "params.yaml").read_text().replace("base: none", "base: mocap"))
    workspaces.create(folder, motions=tmp_path / "mocap")
    assert read(folder / "params.yaml")["rollouts"]["base"] == "mocap"


def test_the_users_motions_are_a_dependency_of_the_stage_that_reads_them(tmp_path: Path):
    motions = tmp_path / "mocap"
    motions.mkdir()
    folder = workspaces.create(tmp_path / "lab", motions=motions)
    stages = yaml.safe_load((folder / "dvc.yaml").read_text())["stages"]
    assert str(motions) in stages["motions"]["deps"]
    assert read(folder / "params.yaml")["motions"]["source"] == str(motions)


def test_a_mapping_of_joints_is_a_dependency_of_the_stage_that_reads_motions(tmp_path: Path):
    folder = workspaces.create(tmp_path / "lab", motions=tmp_path)
    settings = read(folder / "params.yaml")
    settings["motions"]["read"] = {"skeleton": "/lab/skeleton.yaml"}
    (folder / "params.yaml").write_text(yaml.safe_dump(settings))
    workspaces.create(folder)
    assert "/lab/skeleton.yaml" in yaml.safe_load((folder / "dvc.yaml").read_text())["stages"]["motions"]["deps"]


def test_the_files_that_the_filter_is_given_are_dependencies_of_its_stage(tmp_path: Path):
    named = {"overrule": "word.csv", "policy": {"source": "/lab/policy"}}
    folder = workspaces.create(tmp_path / "lab", filter=named)
    deps = yaml.safe_load((folder / "dvc.yaml").read_text())["stages"]["filter"]["deps"]
    assert deps[-2:] == ["word.csv", "/lab/policy"]
    workspaces.create(folder, filter={"overrule": "", "policy": {"source": "shipped"}})
    assert (folder / "dvc.yaml").read_text() == (workspaces.HOME / "dvc.yaml").read_text()


def test_missing_motions_and_unknown_names_are_bad_input(tmp_path: Path):
    with pytest.raises(BadInput, match="a folder of motion files"):
        workspaces.create(tmp_path / "lab", motions=tmp_path / "nothing")
    assert not (tmp_path / "lab").exists()
    with pytest.raises(BadInput, match="smoke"):
        workspaces.create(tmp_path / "lab", profile="smkoe")
    with pytest.raises(BadInput, match="a workspace"):
        workspaces.named("no-such-workspace")


@pytest.mark.parametrize(
    ("seed", "seal"), [("", {}), ("3", {"seal": {"seed": 3}}), ("null", {"seal": {"n_effects": 0}})]
)
def test_a_seed_asks_for_another_sealed_robot_and_null_for_none(seed: str, seal: dict):
    assert demo.robot_of(seed) == seal


@pytest.mark.parametrize("seed", ["x", "-1", "1.5", "3; rm", "9" * 20])
def test_a_seed_that_is_no_number_is_refused_in_one_line(seed: str):
    with pytest.raises(BadInput, match="--seed: expected a number"):
        demo.robot_of(seed)
